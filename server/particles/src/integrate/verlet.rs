use nalgebra::{UnitQuaternion, Vector3};

use super::{Workspace, turned};
use crate::{
    model::Model,
    rows::{fill, for_each_block},
    state::{Inertia, Loads, State},
};

impl Workspace {
    /// Half a kick, a drift, half a kick. `[P13]`
    ///
    /// Where loads depend on the velocity, those of the second kick do on what the first one predicts, which keeps order 2
    /// at one evaluation per step. The drag on every particle is exact in each half.
    pub(super) fn velocity_verlet(&mut self, model: &mut Model, state: &State, time: f64, dt: f64) {
        let before = self.kept.take().unwrap_or_else(|| {
            let mut loads = Loads::default();
            model.loads(state, time, &mut loads);
            loads
        });
        let half = 0.5 * dt;
        let Self {
            next, loads: after, ..
        } = self;
        let drag = Drag::new(model, half);
        let damped = model.is_damped();
        let kicked = |model: &Model, i: usize| {
            drag.on_velocity(model, i, state.velocity[i]) + model.acceleration(i, &before) * half
        };
        fill(&mut next.position, &mut next.velocity, |i| {
            let v = kicked(model, i);
            let x = state.position[i] + v * dt;
            if damped {
                let predicted = v + model.acceleration(i, &before) * half;
                (x, drag.on_velocity(model, i, predicted))
            } else {
                (x, v)
            }
        });
        let turning = |model: &Model, i: usize, frames: &crate::state::Frames| {
            let q = &frames.orientation[i];
            drag.on_momentum(model, i, q, frames.momentum[i]) + model.torque(i, &before) * half
        };
        if let (Some(frames), Some(next)) = (&state.frames, &mut next.frames) {
            fill(&mut next.orientation, &mut next.momentum, |i| {
                let momentum = turning(model, i, frames);
                let q = drift(&model.inertia, i, &frames.orientation[i], &momentum, dt);
                let predicted = momentum + model.torque(i, &before) * half;
                (q, drag.on_momentum(model, i, &q, predicted))
            });
        }
        model.impose(next, time + dt);
        model.loads(next, time + dt, after);
        let model = &*model;
        for_each_block(&mut next.velocity, |first, velocity| {
            for (i, v) in (first..).zip(velocity) {
                let kicked_once = if damped { kicked(model, i) } else { *v };
                let kicked_twice = kicked_once + model.acceleration(i, after) * half;
                *v = drag.on_velocity(model, i, kicked_twice);
            }
        });
        if let (Some(frames), Some(next)) = (&state.frames, &mut next.frames) {
            for (i, momentum) in next.momentum.iter_mut().enumerate() {
                let kicked = turning(model, i, frames) + model.torque(i, after) * half;
                *momentum = drag.on_momentum(model, i, &next.orientation[i], kicked);
            }
        }
        self.kept = Some(std::mem::replace(&mut self.loads, before));
    }
}

/// The drag on every particle over half a step, in closed form.
struct Drag {
    /// N s²/m; 0 for none.
    impulse: f64,
    /// N m s²; 0 for none.
    spin_impulse: f64,
}

impl Drag {
    fn new(model: &Model, seconds: f64) -> Self {
        Self {
            impulse: model.drag * seconds,
            spin_impulse: model.spin_drag * seconds,
        }
    }

    fn on_velocity(&self, model: &Model, i: usize, velocity: Vector3<f64>) -> Vector3<f64> {
        if self.impulse == 0.0 {
            return velocity;
        }
        velocity * (-self.impulse * model.inertia.inverse_mass[i]).exp()
    }

    fn on_momentum(
        &self,
        model: &Model,
        i: usize,
        orientation: &UnitQuaternion<f64>,
        momentum: Vector3<f64>,
    ) -> Vector3<f64> {
        if self.spin_impulse == 0.0 {
            return momentum;
        }
        let left = model.inertia.inverse_moments[i].map(|w| (-self.spin_impulse * w).exp());
        orientation * (orientation.inverse_transform_vector(&momentum)).component_mul(&left)
    }
}

/// The rotation of a free body, split into exact ones about its axes x, y, z, y, x: symplectic, of order 2. `[P14]`
fn drift(
    inertia: &Inertia,
    i: usize,
    orientation: &UnitQuaternion<f64>,
    momentum: &Vector3<f64>,
    dt: f64,
) -> UnitQuaternion<f64> {
    let moments = inertia.inverse_moments[i];
    if moments.x == moments.y && moments.y == moments.z {
        return turned(orientation, momentum * (moments.x * dt));
    }
    let mut q = *orientation;
    for (axis, part) in [(0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)] {
        let in_body = q.inverse_transform_vector(momentum);
        let mut turn = Vector3::zeros();
        turn[axis] = part * dt * in_body[axis] * moments[axis];
        q *= UnitQuaternion::from_scaled_axis(turn);
    }
    q.renormalize();
    q
}
