//! How a step is divided.

use crate::{
    Diverged, System,
    state::{Loads, State},
};

/// Of the step that is stable for small motions, the part that is taken: large motions bear less. Lennard-Jones pairs
/// show a resonance of third order from 0.87 on (`NUMERICS.md` A.5).
const SAFETY: f64 = 0.5;
/// How much a substep may grow or shrink at once, and what is kept back from the tolerance.
const GROWTH: [f64; 2] = [0.2, 4.0];
const MARGIN: f64 = 0.9;

impl System {
    /// Equal substeps that stability allows as things stand.
    pub(crate) fn stable_step(&mut self, dt: f64, most: u32) -> Result<(), Diverged> {
        let needed = SAFETY * self.largest_stable_step();
        let count = (dt / needed).ceil().max(1.0);
        if count.is_nan() || count > f64::from(most) {
            return Err(Diverged::Substeps {
                time_step: dt,
                needed,
                most,
            });
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 1 and most"
        )]
        let substeps = count as u32;
        (0..substeps).try_for_each(|_| self.substep(dt / count))
    }

    /// Substeps that the tolerance allows: each is taken whole and in two halves, and the halves are kept where both
    /// agree.
    pub(crate) fn adaptive_step(
        &mut self,
        dt: f64,
        tolerance: f64,
        most: u32,
    ) -> Result<(), Diverged> {
        let start = self.time;
        let mut h = self.adapted.unwrap_or(dt);
        for _ in 0..most {
            let left = start + dt - self.time;
            if left <= 1e-12 * dt {
                break;
            }
            let part = h.min(left);
            let before = self.moment();
            let error = self.try_both_ways(&before, part);
            let accepted = error <= tolerance;
            if !accepted {
                self.return_to(&before);
            }
            let order = f64::from(self.integrator.order());
            let factor = MARGIN * (tolerance / error).powf(1.0 / (order + 1.0));
            let factor = if factor.is_nan() { GROWTH[0] } else { factor };
            // A substep that the end of the step cut short says nothing against larger ones.
            if !accepted || part == h {
                h = part * factor.clamp(GROWTH[0], GROWTH[1]);
            }
        }
        self.adapted = Some(h);
        if start + dt - self.time > 1e-12 * dt {
            return Err(Diverged::Substeps {
                time_step: dt,
                needed: h,
                most,
            });
        }
        self.time = start + dt;
        Ok(())
    }
}

/// All that a system needs to go on from a moment.
struct Moment {
    state: State,
    time: f64,
    kept: Option<Loads>,
    memories: Vec<Vec<f64>>,
}

impl System {
    fn moment(&self) -> Moment {
        let batches = self.model.links.iter();
        Moment {
            state: self.state.clone(),
            time: self.time,
            kept: self.workspace.kept.clone(),
            memories: batches.map(|batch| batch.memory().to_vec()).collect(),
        }
    }

    fn return_to(&mut self, moment: &Moment) {
        self.state.clone_from(&moment.state);
        self.time = moment.time;
        self.workspace.kept.clone_from(&moment.kept);
        for (batch, memory) in self.model.links.iter_mut().zip(&moment.memories) {
            batch.memory_mut().copy_from_slice(memory);
        }
    }

    /// Takes a substep whole, then in two halves, which stay; returns what the halves are off by, m, infinite where
    /// one of them diverges.
    fn try_both_ways(&mut self, before: &Moment, dt: f64) -> f64 {
        if self.substep(dt).is_err() {
            return f64::INFINITY;
        }
        let whole = self.state.clone();
        self.return_to(before);
        if (0..2).any(|_| self.substep(0.5 * dt).is_err()) {
            return f64::INFINITY;
        }
        let pairs = whole.position.iter().zip(&self.state.position);
        let moved = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let turned = match (&whole.frames, &self.state.frames) {
            (Some(whole), Some(halves)) => {
                let pairs = whole.orientation.iter().zip(&halves.orientation);
                let angles = pairs.map(|(a, b)| a.angle_to(b));
                angles.fold(0.0, f64::max) * self.model.spacing
            }
            (None, _) | (_, None) => 0.0,
        };
        // Richardson: the halves are closer to the limit than the whole is by this factor.
        moved.max(turned) / (2.0_f64.powi(self.integrator.order()) - 1.0)
    }
}
