//! Implicit steps. The stiffness is never written down: its product with a vector is a difference of loads.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Unsolved, Workspace, turned};
use crate::{
    krylov::{gmres, norm},
    model::Model,
    rows::fill,
    state::{Inertia, Loads, State},
};

/// Displacement of the central difference quotients, in spacings: where rounding and curvature err alike.
const NUDGE: f64 = 1e-5;
/// Residual of the linear systems, as a fraction of its start.
const LINEAR: f64 = 1e-8;
/// Most products per linear system.
const PRODUCTS: usize = 400;
/// Displacement in an iteration of Newton's method that is the last, in spacings.
const SOLVED: f64 = 1e-12;
/// Most iterations of Newton's method, and most halvings of one of them.
const ITERATIONS: usize = 40;
const HALVINGS: usize = 8;

impl Workspace {
    /// One iteration of Newton's method for the state that its own loads lead to. `[P16]`
    pub(super) fn linearly_implicit_euler(
        &mut self,
        model: &mut Model,
        state: &State,
        time: f64,
        dt: f64,
    ) {
        let mut problem = Implicit::new(model, state, time + dt, dt);
        let still = vec![0.0; problem.len()];
        let impulses = problem.impulses(&still);
        let change = problem.solve(&still, &impulses);
        problem.place(&change, 1.0, &mut self.next);
    }

    /// The state half way between both ends is the one that its own loads lead to. `[P17]`
    pub(super) fn implicit_midpoint(
        &mut self,
        model: &mut Model,
        state: &State,
        time: f64,
        dt: f64,
    ) -> Result<(), Unsolved> {
        let half = 0.5 * dt;
        let mut problem = Implicit::new(model, state, time + half, half);
        let change = problem.newton()?;
        problem.place(&change, 2.0, &mut self.next);
        Ok(())
    }
}

/// The equations `z = h S F(stage(z))` of a stage that lies `h` seconds after a state.
///
/// The unknown `z` holds the changes of velocity and of angular momentum, each times the square root of what resists
/// it: so the derivative of the loads becomes symmetric wherever they have a potential, and large masses count as much
/// as small ones.
struct Implicit<'a> {
    model: &'a mut Model,
    from: State,
    time: f64,
    h: f64,
    /// Root of the inverse mass, and of the mean inverse moment, of each particle.
    roots: [Vec<f64>; 2],
    stage: State,
    loads: Loads,
}

impl<'a> Implicit<'a> {
    fn new(model: &'a mut Model, state: &State, time: f64, h: f64) -> Self {
        let mut from = state.clone();
        model.impose(&mut from, time);
        let Inertia {
            inverse_mass,
            inverse_moments,
        } = &model.inertia;
        let roots = [
            inverse_mass.iter().map(|w| w.sqrt()).collect(),
            inverse_moments.iter().map(|w| w.mean().sqrt()).collect(),
        ];
        Self {
            stage: from.clone(),
            model,
            from,
            time,
            h,
            roots,
            loads: Loads::default(),
        }
    }

    fn len(&self) -> usize {
        3 * (self.roots[0].len() + self.roots[1].len())
    }

    /// `z` with the residual zero to rounding.
    fn newton(&mut self) -> Result<Vec<f64>, Unsolved> {
        let masses = self.roots[0].iter().filter(|&&root| root > 0.0);
        let mass: f64 = masses.map(|root| root.powi(-2)).sum();
        let enough = SOLVED * self.model.spacing / self.h * mass.sqrt();
        let mut z = vec![0.0; self.len()];
        let mut residual = self.impulses(&z);
        let start = norm(&residual);
        for _ in 0..ITERATIONS {
            let full = self.solve(&z, &residual);
            if norm(&full) <= enough {
                add(&mut z, &full, 1.0);
                return Ok(z);
            }
            let mut part = 1.0;
            let better = (0..HALVINGS).find_map(|_| {
                let mut trial = z.clone();
                add(&mut trial, &full, part);
                part *= 0.5;
                let mut left = self.impulses(&trial);
                add(&mut left, &trial, -1.0);
                (norm(&left) < norm(&residual)).then_some((trial, left))
            });
            match better {
                Some(better) => (z, residual) = better,
                // Rounding is all that is left, or the way is lost.
                None if norm(&residual) <= 1e-9 * start => return Ok(z),
                None => break,
            }
        }
        let residual = norm(&residual) / start;
        Err(Unsolved { residual })
    }

    /// The step of Newton's method from `z`: `(1 − h S ∂F/∂z) s = residual`.
    fn solve(&mut self, z: &[f64], residual: &[f64]) -> Vec<f64> {
        let mut step = vec![0.0; z.len()];
        let apply = |s: &[f64], product: &mut [f64]| {
            product.copy_from_slice(s);
            let reach = self.reach(s);
            if reach > 0.0 {
                let nudge = NUDGE * self.model.spacing / reach;
                let [ahead, behind] = [nudge, -nudge].map(|nudge| {
                    let mut nudged = z.to_vec();
                    add(&mut nudged, s, nudge);
                    self.impulses(&nudged)
                });
                for ((product, ahead), behind) in product.iter_mut().zip(ahead).zip(behind) {
                    *product -= (ahead - behind) / (2.0 * nudge);
                }
            }
        };
        gmres(apply, residual, &mut step, LINEAR, PRODUCTS);
        step
    }

    /// The furthest that a change moves a particle, m; a spacing for each radian.
    fn reach(&self, s: &[f64]) -> f64 {
        let (of_velocity, of_momentum) = s.split_at(3 * self.roots[0].len());
        let furthest = |changes: &[f64], roots: &[f64]| {
            let each = changes.iter().zip(roots.iter().flat_map(|root| [root; 3]));
            each.map(|(s, root)| (s * root).abs()).fold(0.0, f64::max)
        };
        let moved = furthest(of_velocity, &self.roots[0]);
        let turned = furthest(of_momentum, &self.roots[1]);
        self.h * moved.max(turned * self.model.spacing)
    }

    /// `h S F(stage(z))`
    fn impulses(&mut self, z: &[f64]) -> Vec<f64> {
        let mut stage = std::mem::replace(&mut self.stage, State::EMPTY);
        self.place(z, 1.0, &mut stage);
        let Self { model, loads, .. } = self;
        model.loads(&stage, self.time, loads);
        model.add_drag(&stage, loads);
        self.stage = stage;
        let mut impulses = Vec::with_capacity(z.len());
        for (i, &root) in self.roots[0].iter().enumerate() {
            let mass_root = if root > 0.0 { root.recip() } else { 0.0 };
            let impulse = self.model.acceleration(i, &self.loads) * (mass_root * self.h);
            impulses.extend(impulse.iter());
        }
        for (i, &root) in self.roots[1].iter().enumerate() {
            let impulse = self.model.torque(i, &self.loads) * (root * self.h);
            impulses.extend(impulse.iter());
        }
        impulses
    }

    /// The state after `steps` times `h` at the stage's velocity, with the stage's changes as many times.
    fn place(&self, z: &[f64], steps: f64, to: &mut State) {
        let (from, inertia) = (&self.from, &self.model.inertia);
        let (of_velocity, of_momentum) = z.split_at(3 * self.roots[0].len());
        let change = |column: &[f64], i: usize, root: f64| {
            Vector3::from_column_slice(&column[3 * i..3 * i + 3]) * root
        };
        fill(&mut to.position, &mut to.velocity, |i| {
            let (x, v) = (from.position[i], from.velocity[i]);
            if !inertia.is_free(i) {
                return (x, v);
            }
            let change = change(of_velocity, i, self.roots[0][i]);
            (x + (v + change) * (steps * self.h), v + change * steps)
        });
        if let (Some(from), Some(to)) = (&from.frames, &mut to.frames) {
            fill(&mut to.orientation, &mut to.momentum, |i| {
                let (q, momentum) = (&from.orientation[i], from.momentum[i]);
                let root = self.roots[1][i];
                let root = if root > 0.0 { root.recip() } else { 0.0 };
                let change = change(of_momentum, i, root);
                let spin = spin_at(inertia, i, q, momentum + change, self.h);
                (
                    turned(q, spin * (steps * self.h)),
                    momentum + change * steps,
                )
            });
        }
    }
}

/// The spin of the orientation that it leads to after `h` seconds, by iteration. `[P11]`
fn spin_at(
    inertia: &Inertia,
    i: usize,
    orientation: &UnitQuaternion<f64>,
    momentum: Vector3<f64>,
    h: f64,
) -> Vector3<f64> {
    let mut spin = inertia.spin(i, orientation, &momentum);
    let moments = inertia.inverse_moments[i];
    if moments.x == moments.y && moments.y == moments.z {
        return spin;
    }
    for _ in 0..60 {
        let there = inertia.spin(i, &turned(orientation, spin * h), &momentum);
        let moved = (there - spin).amax();
        spin = there;
        if moved <= 1e-15 * (1.0 + spin.amax()) {
            break;
        }
    }
    spin
}

fn add(to: &mut [f64], what: &[f64], times: f64) {
    for (to, what) in to.iter_mut().zip(what) {
        *to += times * what;
    }
}
