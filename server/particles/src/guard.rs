//! How stiff a system is, and so how large a step it bears.

use crate::{Integrator, state::Inertia};

/// For each degree of freedom, a bound on the eigenvalues of stiffness and damping over mass that it takes part in, by
/// Gershgorin's theorem: 1/s² and 1/s. `[P4]`
#[derive(Debug)]
pub(crate) struct Bounds<'a> {
    inertia: &'a Inertia,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
}

impl<'a> Bounds<'a> {
    /// Every particle damped alike, N s/m.
    pub(crate) fn new(inertia: &'a Inertia, damping: f64) -> Self {
        let damped = inertia.inverse_mass.iter().map(|w| w * damping);
        Self {
            inertia,
            stiffness: vec![0.0; inertia.inverse_mass.len()],
            damping: damped.collect(),
        }
    }

    /// A pair of stiffness, N/m, and damping, N s/m, as particle `i` meets it.
    pub(crate) fn add_pair(&mut self, i: usize, other: usize, stiffness: f64, damping: f64) {
        let ends = if self.inertia.is_free(other) {
            2.0
        } else {
            1.0
        };
        let scale = ends * self.inertia.inverse_mass[i];
        self.stiffness[i] += stiffness * scale;
        self.damping[i] += damping * scale;
    }

    /// The largest step that keeps small motions bounded, s.
    pub(crate) fn largest_step(&self, integrator: Integrator) -> f64 {
        let rows = self.stiffness.iter().zip(&self.damping);
        rows.map(|(&k, &z)| integrator.largest_step(k, z))
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
