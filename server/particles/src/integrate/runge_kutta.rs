use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{Stage, Workspace};
use crate::{
    model::Model,
    rows::fill,
    state::{Frames, Loads, State},
};

/// When each stage is, in steps.
const TIMES: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
/// What each stage counts.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

impl Workspace {
    /// The classical method of order 4; orientations as quaternions, normalised where they are used. `[P15]`
    pub(super) fn runge_kutta_4(&mut self, model: &mut Model, state: &State, time: f64, dt: f64) {
        let Self { next, stages, .. } = self;
        stages.resize_with(4, || Stage {
            state: state.clone(),
            loads: Loads::default(),
            turning: Vec::new(),
        });
        for (s, after) in TIMES.map(|part| part * dt).into_iter().enumerate() {
            let (done, rest) = stages.split_at_mut(s);
            let stage = &mut rest[0];
            stage.set(model, state, done.last(), after);
            model.impose(&mut stage.state, time + after);
            model.loads(&stage.state, time + after, &mut stage.loads);
            model.add_drag(&stage.state, &mut stage.loads);
            stage.find_turning(model, state, done.last(), after);
        }
        let model = &*model;
        let sum = |term: &dyn Fn(&Stage) -> Vector3<f64>| -> Vector3<f64> {
            let terms = stages.iter().zip(WEIGHTS);
            terms
                .map(|(stage, weight)| term(stage) * (weight * dt))
                .sum()
        };
        for i in 0..next.position.len() {
            next.position[i] = state.position[i] + sum(&|stage| stage.state.velocity[i]);
            next.velocity[i] =
                state.velocity[i] + sum(&|stage| model.acceleration(i, &stage.loads));
        }
        if let (Some(frames), Some(next)) = (&state.frames, &mut next.frames) {
            for i in 0..next.orientation.len() {
                let mut q = *frames.orientation[i].quaternion();
                for (stage, weight) in stages.iter().zip(WEIGHTS) {
                    q += stage.turning[i] * (weight * dt);
                }
                next.orientation[i] = UnitQuaternion::new_normalize(q);
                next.momentum[i] = frames.momentum[i] + sum(&|stage| model.torque(i, &stage.loads));
            }
        }
    }
}

impl Stage {
    /// The state of a stage, s after the start, by the derivatives at the stage before.
    fn set(&mut self, model: &Model, start: &State, last: Option<&Self>, after: f64) {
        let Some(last) = last else {
            self.state.clone_from(start);
            return;
        };
        let State {
            position,
            velocity,
            frames,
        } = &mut self.state;
        fill(position, velocity, |i| {
            let x = start.position[i] + last.state.velocity[i] * after;
            let v = start.velocity[i] + model.acceleration(i, &last.loads) * after;
            (x, v)
        });
        if let (Some(frames), Some(start)) = (frames, &start.frames) {
            fill(&mut frames.orientation, &mut frames.momentum, |i| {
                let q = UnitQuaternion::new_normalize(raw(start, Some(last), i, after));
                let momentum = start.momentum[i] + model.torque(i, &last.loads) * after;
                (q, momentum)
            });
        }
    }

    fn find_turning(&mut self, model: &Model, start: &State, last: Option<&Self>, after: f64) {
        self.turning.clear();
        let (Some(frames), Some(start)) = (&self.state.frames, &start.frames) else {
            return;
        };
        self.turning.extend((0..frames.orientation.len()).map(|i| {
            let spin = model
                .inertia
                .spin(i, &frames.orientation[i], &frames.momentum[i]);
            Quaternion::from_imag(spin * 0.5) * raw(start, last, i, after)
        }));
    }
}

/// The orientation of a stage before it is normalised.
fn raw(start: &Frames, last: Option<&Stage>, i: usize, after: f64) -> Quaternion<f64> {
    let q = *start.orientation[i].quaternion();
    last.map_or(q, |last| q + last.turning[i] * after)
}
