//! How stiff a system is, and so how large a step it bears.

use crate::{Integrator, state::Inertia};

/// For each degree of freedom, a bound on the eigenvalues of stiffness and damping over mass that it takes part in, by
/// Gershgorin's theorem: 1/s² and 1/s. `[P4]`
///
/// Angles count as lengths on a circle of the body's radius of gyration, so that both compare.
#[derive(Debug)]
pub(crate) struct Bounds<'a> {
    inertia: &'a Inertia,
    /// Of positions, then of orientations where there are any.
    rows: [Vec<Row>; 2],
}

/// What a degree of freedom meets: stiffness 1/s², damping 1/s.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    stiffness: f64,
    damping: f64,
}

impl<'a> Bounds<'a> {
    /// Every particle damped alike, N s/m, and every spin, N m s.
    pub(crate) fn new(inertia: &'a Inertia, drag: f64, spin_drag: f64) -> Self {
        let row = |damping| Row {
            stiffness: 0.0,
            damping,
        };
        let moving = inertia.inverse_mass.iter().map(|w| row(w * drag));
        let turning = inertia
            .inverse_moments
            .iter()
            .map(|w| row(w.max() * spin_drag));
        Self {
            inertia,
            rows: [moving.collect(), turning.collect()],
        }
    }

    fn ends(&self, other: usize) -> f64 {
        if self.inertia.is_free(other) {
            2.0
        } else {
            1.0
        }
    }

    /// A pair of stiffness, N/m, and damping, N s/m, as particle `i` meets it.
    pub(crate) fn add_pair(&mut self, i: usize, other: usize, stiffness: f64, damping: f64) {
        let scale = self.ends(other) * self.inertia.inverse_mass[i];
        let row = &mut self.rows[0][i];
        row.stiffness += stiffness * scale;
        row.damping += damping * scale;
    }

    /// Bounds that hold for all particles together: stiffness 1/s², damping 1/s.
    pub(crate) fn add_all(&mut self, [stiffness, damping]: [f64; 2]) {
        for row in &mut self.rows[0] {
            row.stiffness += stiffness;
            row.damping += damping;
        }
    }

    /// A pair that turns: stiffness of positions by positions, N/m, by angles, N, and of angles by angles, N m.
    pub(crate) fn add_turning(&mut self, i: usize, other: usize, stiffness: [f64; 3]) {
        let [moving, turning] = self.coupled(i, other, stiffness);
        self.rows[0][i].stiffness += moving;
        self.rows[1][i].stiffness += turning;
    }

    /// A pair that brakes turning: damping of positions by spins, N s, and of spins by spins, N m s.
    pub(crate) fn add_turning_damping(&mut self, i: usize, other: usize, damping: [f64; 2]) {
        let [moving, turning] = self.coupled(i, other, [0.0, damping[0], damping[1]]);
        self.rows[0][i].damping += moving;
        self.rows[1][i].damping += turning;
    }

    fn coupled(&self, i: usize, other: usize, [xx, xt, tt]: [f64; 3]) -> [f64; 2] {
        let inverse_mass = self.inertia.inverse_mass[i];
        if inverse_mass == 0.0 {
            return [0.0; 2];
        }
        let inverse_moment = self.inertia.inverse_moments[i].max();
        let gyration = (inverse_mass / inverse_moment).sqrt();
        let ends = self.ends(other);
        [
            ends * inverse_mass * (xx + xt / gyration),
            ends * inverse_moment * (tt + xt * gyration),
        ]
    }

    /// The largest step that keeps small motions bounded, s.
    pub(crate) fn largest_step(&self, integrator: Integrator) -> f64 {
        let rows = self.rows.iter().flatten();
        rows.map(|row| integrator.largest_step(row.stiffness, row.damping))
            .fold(f64::INFINITY, f64::min)
    }
}

impl Integrator {
    /// The largest step for one oscillator of stiffness and damping over mass, 1/s² and 1/s. `[P4]` The roots are in the
    /// form that neither cancels nor divides by a stiffness of 0.
    pub(crate) fn largest_step(self, stiffness: f64, damping: f64) -> f64 {
        let root = |z: f64| z + (z * z + 4.0 * stiffness).sqrt();
        match self {
            Self::SemiImplicitEuler => 4.0 / root(damping),
            Self::VelocityVerlet => 4.0 / root(2.0 * damping),
            // The left half of a disc of this radius lies in the region of stability.
            Self::RungeKutta4 => 2.0 * 2.6 / root(damping),
            Self::LinearlyImplicitEuler | Self::ImplicitMidpoint => f64::INFINITY,
        }
    }
}
