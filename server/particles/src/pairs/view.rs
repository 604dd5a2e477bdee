//! Columns as the rows of pairs number them.

use nalgebra::{Matrix3, Vector3};

use crate::state::{Inertia, Loads, State};

/// What a pass over pairs reads, and the loads that it leaves, in the order of its rows.
#[derive(Clone, Debug, Default)]
pub(super) struct View {
    pub(super) position: Vec<Vector3<f64>>,
    /// World from body; empty where no orientation acts.
    pub(super) frame: Vec<Matrix3<f64>>,
    /// Velocity and spin; empty where no friction acts.
    pub(super) motion: Vec<[Vector3<f64>; 2]>,
    pub(super) load: Vec<[Vector3<f64>; 2]>,
    pub(super) force: Vec<Vector3<f64>>,
}

/// What a pass reads beside positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Needs {
    pub(super) frames: bool,
    pub(super) motion: bool,
}

impl View {
    /// Takes the columns in an order of particles.
    pub(super) fn gather(&mut self, state: &State, inertia: &Inertia, order: &[u32], needs: Needs) {
        let particles = || order.iter().map(|&i| i as usize);
        self.position.clear();
        self.position.extend(particles().map(|i| state.position[i]));
        self.frame.clear();
        self.motion.clear();
        self.force.clear();
        self.load.clear();
        let Some(frames) = &state.frames else {
            return;
        };
        if needs.frames {
            let frame = |i: usize| frames.orientation[i].to_rotation_matrix().into_inner();
            self.frame.extend(particles().map(frame));
        }
        if needs.motion {
            let motion = |i: usize| {
                let spin = inertia.spin(i, &frames.orientation[i], &frames.momentum[i]);
                [state.velocity[i], spin]
            };
            self.motion.extend(particles().map(motion));
        }
    }

    /// Adds the loads to those of the particles.
    pub(super) fn scatter(&self, order: &[u32], loads: &mut Loads) {
        for (force, &i) in self.force.iter().zip(order) {
            loads.force[i as usize] += force;
        }
        for ([force, torque], &i) in self.load.iter().zip(order) {
            loads.force[i as usize] += force;
            loads.torque[i as usize] += torque;
        }
    }
}
