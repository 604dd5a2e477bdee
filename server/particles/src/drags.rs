//! Particles that someone holds while the system runs.

use nalgebra::Vector3;

use crate::{Track, state::Inertia};

/// The particles held, ascending.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drags {
    held: Vec<Drag>,
    /// Particle and target of each, for a digest.
    summary: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Drag {
    particle: u32,
    target: Vector3<f64>, // m
    /// On the way to the target.
    path: Track,
    /// To be given back, 1/kg.
    inverse_mass: f64,
}

impl Drags {
    /// Holds a particle, whose target the next step leads to, or lets it go.
    pub(crate) fn set(
        &mut self,
        particle: u32,
        target: Option<Vector3<f64>>,
        inertia: &mut Inertia,
    ) {
        let inverse_mass = &mut inertia.inverse_mass[particle as usize];
        let at = self
            .held
            .binary_search_by_key(&particle, |drag| drag.particle);
        match (at, target) {
            (Ok(at), Some(target)) => self.held[at].target = target,
            (Ok(at), None) => *inverse_mass = self.held.remove(at).inverse_mass,
            (Err(at), Some(target)) => self.held.insert(
                at,
                Drag {
                    particle,
                    target,
                    path: Track::constant(target),
                    inverse_mass: std::mem::take(inverse_mass),
                },
            ),
            (Err(_), None) => {}
        }
        self.summary.clear();
        for drag in &self.held {
            self.summary.push(f64::from(drag.particle));
            self.summary.extend(drag.target.iter());
        }
    }

    /// Lays the paths to the targets: straight, within a step of `dt` from `time`, both s.
    pub(crate) fn lay(&mut self, position: &[Vector3<f64>], time: f64, dt: f64) {
        for drag in &mut self.held {
            drag.path = Track {
                times: vec![time, time + dt],
                values: vec![position[drag.particle as usize], drag.target],
            };
        }
    }

    /// The particles held with their positions, m, and velocities, m/s, at a time, s.
    pub(crate) fn at(
        &self,
        time: f64,
    ) -> impl Iterator<Item = (usize, Vector3<f64>, Vector3<f64>)> {
        let held = self.held.iter();
        held.map(move |drag| {
            (
                drag.particle as usize,
                drag.path.at(time),
                drag.path.rate(time),
            )
        })
    }

    /// Numbers that tell who is held where.
    pub(crate) fn summary(&self) -> &[f64] {
        &self.summary
    }
}
