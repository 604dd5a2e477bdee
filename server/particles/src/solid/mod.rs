//! Elastic solids of nothing but points: total Lagrangian, with neighbourhoods measured along the body at rest.

mod consistent;
mod curvature;
mod geodesic;
mod graph;
mod material;
mod skin;
mod spec;
mod stencil;
mod surroundings;
mod survey;
mod tear;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

pub use spec::{Dimension, Integration, Material, MaterialLaw, Metric, Reach, SolidSpec};
pub use survey::Survey;

use self::{
    graph::Places,
    material::{Deformation, Moduli},
    stencil::Stencils,
    surroundings::Surroundings,
    tear::Tearing,
};
use crate::{SpecError, check, rows::for_each_block};

/// Iterations of the power method, and what it may still be short of.
const POWER: usize = 40;
const SHORT: f64 = 1.05;
/// Particles per task.
const TASK: usize = 256;

/// An elastic solid: what its particles do to each other, wherever they are.
#[derive(Clone, Debug)]
pub struct Solid {
    rest: Vec<Vector3<f64>>,
    stencils: Stencils,
    moduli: Moduli,
    /// Of each particle at rest, m³.
    volumes: Vec<f64>,
    /// kg.
    masses: Vec<f64>,
    /// Pa: Young's modulus times what the specification asks for.
    stabilisation: f64,
    damping: f64,
    /// The greatest eigenvalue of stiffness over mass at rest, 1/s².
    stiffness: f64,
    /// Of a solid that can tear.
    tearing: Option<Box<Tearing>>,
    /// Pushes of the particles on those that they see, N, per slot: kept for its memory.
    pushes: Vec<Vector3<f64>>,
}

/// What a solid's neighbourhoods came to.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidReport {
    /// The fewest, the mean and the most particles that a particle sees.
    pub neighbours: [f64; 3],
    /// How many particles see no direction, one, two and three.
    pub ranks: [usize; 4],
    /// Pieces that nothing holds together.
    pub components: usize,
}

impl Solid {
    /// Finds the neighbourhoods of the particles at rest.
    ///
    /// # Errors
    /// The first value of `spec` at fault, or of the positions.
    pub fn new(spec: &SolidSpec, positions: &[Vector3<f64>]) -> Result<Self, SpecError> {
        check::finite("positions", positions)?;
        spec.check(positions)?;
        Ok(Self::checked(spec, positions.to_vec()))
    }

    pub(crate) fn checked(spec: &SolidSpec, rest: Vec<Vector3<f64>>) -> Self {
        let places = Places::new(rest.clone());
        let spacings = places.spacings(spec.dimension);
        let dim = i32::try_from(spec.dimension.count()).expect("2 or 3");
        let volumes = spec.volumes.clone();
        let volumes = volumes.unwrap_or_else(|| spacings.iter().map(|s| s.powi(dim)).collect());
        let surroundings = Surroundings::new(spec, places, &spacings);
        let mut stencils = Stencils::new(&surroundings);
        match spec.integration {
            Integration::Nodal => {}
            Integration::Consistent => {
                let all: Vec<usize> = (0..rest.len()).collect();
                stencils.make_consistent(&rest, &volumes, &all);
            }
        }
        let tearing = spec
            .break_at_stretch
            .map(|stretch| Tearing::new(surroundings, spec.integration, stretch));
        let mut solid = Self {
            pushes: vec![Vector3::zeros(); stencils.other.len()],
            moduli: Moduli::new(&spec.material, spec.dimension),
            masses: volumes.iter().map(|volume| volume * spec.density).collect(),
            stabilisation: spec.stabilisation * spec.material.young,
            damping: spec.damping,
            stiffness: 0.0,
            tearing: tearing.map(Box::new),
            rest,
            stencils,
            volumes,
        };
        solid.stiffness = solid.greatest_stiffness();
        solid
    }

    /// Masses of the particles by density and volume, kg.
    #[must_use]
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// The particles that a particle sees, ascending, with their distances along the body, m.
    ///
    /// # Panics
    /// If there is no such particle.
    pub fn neighbours(&self, particle: usize) -> impl Iterator<Item = (u32, f64)> {
        let Stencils {
            other, distance, ..
        } = &self.stencils;
        self.stencils
            .row(particle)
            .map(|slot| (other[slot], distance[slot]))
    }

    /// The gradient of a column of vectors at a particle: `[a, b]` is the derivative of component a along axis b.
    ///
    /// # Panics
    /// If there is no such particle, or the column has not one entry for each.
    #[must_use]
    pub fn gradient(&self, particle: usize, values: &[Vector3<f64>]) -> Matrix3<f64> {
        assert_eq!(values.len(), self.rest.len(), "one value for each particle");
        self.stencils.derivative(particle, values)
    }

    /// What the neighbourhoods came to.
    #[must_use]
    pub fn report(&self) -> SolidReport {
        let counts = (0..self.rest.len()).map(|i| self.stencils.row(i).len());
        let mut ranks = [0; 4];
        for sight in &self.stencils.sight {
            ranks[sight.rank] += 1;
        }
        #[expect(clippy::cast_precision_loss, reason = "counts of particles")]
        let neighbours = [
            counts.clone().min().unwrap_or(0) as f64,
            self.stencils.other.len() as f64 / self.rest.len().max(1) as f64,
            counts.max().unwrap_or(0) as f64,
        ];
        SolidReport {
            neighbours,
            ranks,
            components: self.stencils.components(),
        }
    }

    /// Adds the forces of the solid on its particles, N, at positions, m, and velocities, m/s. `[B10]`, `[B11]`
    pub(crate) fn add_forces(
        &mut self,
        position: &[Vector3<f64>],
        velocity: &[Vector3<f64>],
        force: &mut [Vector3<f64>],
    ) {
        let mut pushes = std::mem::take(&mut self.pushes);
        let tasks = rows_of(&self.stencils.start, &mut pushes);
        let push = |(first, pushes): (usize, &mut [Vector3<f64>])| {
            self.push(first, position, pushes);
        };
        tasks.into_par_iter().for_each(push);
        let stencils = &self.stencils;
        for_each_block(force, |first, force| {
            for (i, force) in (first..).zip(force) {
                let mut sum = velocity[i] * (-self.damping * self.masses[i]);
                for slot in stencils.row(i) {
                    sum += pushes[slot];
                }
                for slot in stencils.into(i) {
                    sum -= pushes[slot];
                }
                *force += sum;
            }
        });
        self.pushes = pushes;
    }

    /// What the particles of a task, from `first` on, push those that they see by: the opposite acts on themselves.
    fn push(&self, first: usize, position: &[Vector3<f64>], mut pushes: &mut [Vector3<f64>]) {
        let mut i = first;
        while !pushes.is_empty() {
            let slots = self.stencils.row(i);
            let (row, rest) = pushes.split_at_mut(slots.len());
            let f = self.stencils.derivative(i, position);
            let sight = &self.stencils.sight[i];
            let deformation = Deformation { gradient: f, sight };
            let mut stress = self.moduli.stress(&deformation) * self.volumes[i];
            let resisting = self.resistance(i);
            if resisting > 0.0 {
                for slot in slots.clone() {
                    let (residual, x) = self.residual(slot, i, &f, position);
                    let pull = residual * (resisting * self.stencils.share[slot]);
                    row[slot - slots.start] = pull;
                    stress -= pull * x.transpose();
                }
            } else {
                row.fill(Vector3::zeros());
            }
            for (push, slot) in row.iter_mut().zip(slots) {
                *push += stress * self.stencils.gradient[slot];
            }
            pushes = rest;
            i += 1;
        }
    }

    /// N/m.
    fn resistance(&self, i: usize) -> f64 {
        self.stabilisation * self.volumes[i] / self.stencils.sight[i].reach.powi(2)
    }

    /// What the gradient does not show of where a particle is as another sees it, m, and where it was at rest, m.
    fn residual(
        &self,
        slot: usize,
        i: usize,
        f: &Matrix3<f64>,
        position: &[Vector3<f64>],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let j = self.stencils.other[slot] as usize;
        let x = self.rest[j] - self.rest[i];
        (position[j] - position[i] - f * x, x)
    }

    /// Elastic energy at positions, m, in J; 0 at rest.
    ///
    /// # Panics
    /// If there is not one position for each particle.
    #[must_use]
    pub fn energy(&self, position: &[Vector3<f64>]) -> f64 {
        assert_eq!(position.len(), self.rest.len(), "one position for each");
        let each = |i: usize| {
            let f = self.stencils.derivative(i, position);
            let sight = &self.stencils.sight[i];
            let density = self.moduli.energy(&Deformation { gradient: f, sight });
            let residuals = self.stencils.row(i).map(|slot| {
                self.residual(slot, i, &f, position).0.norm_squared() * self.stencils.share[slot]
            });
            density * self.volumes[i] + 0.5 * self.resistance(i) * residuals.sum::<f64>()
        };
        let energies: Vec<f64> = (0..position.len()).into_par_iter().map(each).collect();
        energies.iter().sum()
    }

    /// The forces of the solid on its particles at positions, m, in N. `[B10]`
    ///
    /// # Panics
    /// If there is not one position for each particle.
    #[must_use]
    pub fn forces(&mut self, position: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        assert_eq!(position.len(), self.rest.len(), "one position for each");
        let still = vec![Vector3::zeros(); position.len()];
        let mut forces = still.clone();
        self.add_forces(position, &still, &mut forces);
        forces
    }

    /// Whether forces depend on velocities.
    pub(crate) fn is_damped(&self) -> bool {
        self.damping > 0.0
    }

    /// Bounds on the eigenvalues of stiffness, 1/s², and damping, 1/s, over mass at positions, m. `[B12]`
    pub(crate) fn bounds(&self, position: &[Vector3<f64>]) -> [f64; 2] {
        let stiffening = (0..position.len()).into_par_iter().map(|i| {
            let f = self.stencils.derivative(i, position);
            self.moduli.stiffening(&f)
        });
        let most = stiffening.reduce(|| 1.0, f64::max);
        [self.stiffness * most, self.damping]
    }

    /// The greatest eigenvalue of stiffness over mass at rest, 1/s², by the power method. `[B12]`
    fn greatest_stiffness(&mut self) -> f64 {
        let Some(size) = self
            .stencils
            .sight
            .iter()
            .map(|sight| sight.reach)
            .reduce(f64::min)
        else {
            return 0.0;
        };
        // Where a displacement is small enough for every law to be linear, and large enough for rounding.
        let small = 1e-6 * size;
        let scatter = |i: usize| {
            // A sequence without pattern, which has a part in every mode.
            #[expect(clippy::cast_precision_loss, reason = "a seed, not a number")]
            let seed = i as f64;
            Vector3::new(0.1, 0.7, 1.3).map(|k: f64| (seed * 12.9898 + k).sin() * 43758.5453 % 1.0)
        };
        let mut mode: Vec<Vector3<f64>> = (0..self.rest.len()).map(scatter).collect();
        let mut greatest = 0.0;
        for _ in 0..POWER {
            let most = mode.iter().map(|m| m.norm()).fold(0.0, f64::max);
            if most == 0.0 {
                break;
            }
            let scale = small / most;
            let moved = self.rest.iter().zip(&mode);
            let moved: Vec<_> = moved.map(|(x, m)| x + m * scale).collect();
            // At rest there is no force.
            let forces = self.forces(&moved);
            let accelerations = forces.iter().zip(&self.masses);
            let next: Vec<_> = accelerations.map(|(f, mass)| -f / (scale * mass)).collect();
            let norm = |column: &[Vector3<f64>]| {
                let terms = column.iter().zip(&self.masses);
                terms
                    .map(|(m, mass)| m.norm_squared() * mass)
                    .sum::<f64>()
                    .sqrt()
            };
            greatest = norm(&next) / norm(&mode);
            let unit = next
                .iter()
                .map(|m| m.norm())
                .fold(f64::MIN_POSITIVE, f64::max)
                .recip();
            mode = next.into_iter().map(|m| m * unit).collect();
        }
        SHORT * greatest
    }
}

/// Parts of a column of slots for tasks of whole rows, each with its first row.
fn rows_of<'a, T>(start: &[usize], mut column: &'a mut [T]) -> Vec<(usize, &'a mut [T])> {
    let rows = start.len() - 1;
    let mut parts = Vec::with_capacity(rows.div_ceil(TASK));
    for first in (0..rows).step_by(TASK) {
        let end = (first + TASK).min(rows);
        let (part, rest) = column.split_at_mut(start[end] - start[first]);
        parts.push((first, part));
        column = rest;
    }
    parts
}
