//! For how long to wait for frames.

use std::collections::VecDeque;

/// Frames remembered.
const WINDOW: usize = 512;
/// Share of frames that may come too late: one in this many.
const LATE: usize = 128;
/// How fast the delay falls when frames come sooner, s per frame: slowly, since each fall is a moment with less time to
/// wait and each rise a moment without frames.
const FALL: f64 = 1e-4;

/// The playout delay of a source: what frames came late by, all but the worst of the last few hundred. `[S2]`
///
/// It rises at once and falls slowly.
#[derive(Clone, Debug, Default)]
pub struct Delay {
    lateness: VecDeque<f64>,
    seconds: f64,
}

impl Delay {
    /// Takes in how long after its capture a frame came, s, both on one clock.
    pub fn observe(&mut self, lateness: f64) {
        if self.lateness.len() == WINDOW {
            self.lateness.pop_front();
        }
        self.lateness.push_back(lateness.max(0.0));
        let mut sorted: Vec<f64> = self.lateness.iter().copied().collect();
        let worst = sorted.len() / LATE;
        let (_, &mut wanted, _) = sorted.select_nth_unstable_by(worst, |a, b| b.total_cmp(a));
        self.seconds = wanted.max(self.seconds - FALL);
    }

    /// How long after its capture a moment is played out, s.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }
}
