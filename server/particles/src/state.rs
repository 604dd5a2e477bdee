//! Where everything is and how it moves. Columns have one entry per particle.

use nalgebra::{UnitQuaternion, Vector3};

use rayon::prelude::*;

use crate::{
    FrameSpec,
    rows::{for_each_block, is_shared},
};

/// Positions and motion at one moment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct State {
    pub(crate) position: Vec<Vector3<f64>>, // m
    pub(crate) velocity: Vec<Vector3<f64>>, // m/s
    /// Only where a particle has an orientation.
    pub(crate) frames: Option<Frames>,
}

/// Orientations and what turns them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Frames {
    pub(crate) orientation: Vec<UnitQuaternion<f64>>, // world from body
    pub(crate) momentum: Vec<Vector3<f64>>,           // angular, N m s, world frame
}

/// What acts on the particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Loads {
    pub(crate) force: Vec<Vector3<f64>>,  // N
    pub(crate) torque: Vec<Vector3<f64>>, // N m, world frame; empty without frames
}

/// What resists. Zero for a particle that is moved by hand or not at all.
#[derive(Clone, Debug)]
pub(crate) struct Inertia {
    pub(crate) inverse_mass: Vec<f64>, // 1/kg
    /// About the body's axes, 1/(kg m²); empty without frames.
    pub(crate) inverse_moments: Vec<Vector3<f64>>,
}

impl Inertia {
    pub(crate) fn is_free(&self, i: usize) -> bool {
        self.inverse_mass[i] > 0.0
    }

    /// Angular velocity, 1/s, world frame. `[P11]`
    pub(crate) fn spin(
        &self,
        i: usize,
        orientation: &UnitQuaternion<f64>,
        momentum: &Vector3<f64>,
    ) -> Vector3<f64> {
        let in_body = orientation.inverse_transform_vector(momentum);
        orientation * in_body.component_mul(&self.inverse_moments[i])
    }
}

impl Frames {
    /// Frames at the start, and the inverse moments of particles with these inverse masses.
    pub(crate) fn new(spec: FrameSpec, inverse_mass: &[f64]) -> (Self, Vec<Vector3<f64>>) {
        let FrameSpec {
            mut orientations,
            spins,
            moments,
            damping: _,
        } = spec;
        for orientation in &mut orientations {
            orientation.renormalize();
        }
        let free = |i: usize| if inverse_mass[i] > 0.0 { 1.0 } else { 0.0 };
        let momentum = |i: usize| {
            let q = &orientations[i];
            let in_body = q.inverse_transform_vector(&spins[i]);
            q * in_body.component_mul(&moments[i]) * free(i)
        };
        let momentum = (0..spins.len()).map(momentum).collect();
        let inverse = |(i, moments): (usize, &Vector3<f64>)| moments.map(|m| free(i) / m);
        let inverse_moments = moments.iter().enumerate().map(inverse).collect();
        let frames = Self {
            orientation: orientations,
            momentum,
        };
        (frames, inverse_moments)
    }
}

impl State {
    /// Nothing, which costs no memory.
    pub(crate) const EMPTY: Self = Self {
        position: Vec::new(),
        velocity: Vec::new(),
        frames: None,
    };

    /// The first particle with a number that is not finite.
    pub(crate) fn first_not_finite(&self) -> Option<usize> {
        // A sum is finite only if its terms are, unless two infinities cancel: then it is not a number.
        let moving = |i: &usize| !(self.position[*i].sum() + self.velocity[*i].sum()).is_finite();
        let turning = |i: &usize| {
            let turn = |f: &Frames| f.orientation[*i].coords.sum() + f.momentum[*i].sum();
            !self.frames.as_ref().map_or(0.0, turn).is_finite()
        };
        let particles = self.position.len();
        let is_lost = |i: &usize| moving(i) || turning(i);
        if is_shared(particles) {
            (0..particles).into_par_iter().find_first(is_lost)
        } else {
            (0..particles).find(is_lost)
        }
    }
}

impl Loads {
    pub(crate) fn clear(&mut self, particles: usize, framed: bool) {
        let zero = |column: &mut Vec<Vector3<f64>>, len: usize| {
            column.resize(len, Vector3::zeros());
            for_each_block(column, |_, part| part.fill(Vector3::zeros()));
        };
        zero(&mut self.force, particles);
        zero(&mut self.torque, if framed { particles } else { 0 });
    }
}
