use super::{Workspace, turned};
use crate::{model::Model, rows::fill, state::State};

impl Workspace {
    /// All velocities `[P2]`, then all positions with the new velocities `[P3]`; spins `[P11]` and orientations `[P12]`
    /// alike.
    pub(super) fn semi_implicit_euler(
        &mut self,
        model: &mut Model,
        state: &State,
        time: f64,
        dt: f64,
    ) {
        let Self { next, loads, .. } = self;
        model.loads(state, time, loads);
        model.add_drag(state, loads);
        let model = &*model;
        fill(&mut next.position, &mut next.velocity, |i| {
            let v = state.velocity[i] + model.acceleration(i, loads) * dt; // [P2]
            (state.position[i] + v * dt, v) // [P3]
        });
        if let (Some(frames), Some(next)) = (&state.frames, &mut next.frames) {
            fill(&mut next.orientation, &mut next.momentum, |i| {
                let q = &frames.orientation[i];
                let momentum = frames.momentum[i] + model.torque(i, loads) * dt;
                let spin = model.inertia.spin(i, q, &momentum);
                (turned(q, spin * dt), momentum)
            });
        }
    }
}
