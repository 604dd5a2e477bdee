//! What points are worth to a measure.

use crate::{
    digest::Digest,
    frame::{Doubt, PointState},
};

/// What a point's position is worth to a measure, the most first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Standing {
    /// It is seen there.
    Seen,
    /// It was not believed, and is from this step on. Where it is now it came to by no motion.
    Regained,
    /// It is carried along by others: nothing is known of itself.
    Unseen,
}

/// Which points are believed, from step to step.
#[derive(Clone, Debug)]
pub(crate) struct Standings {
    /// Which were seen where they cannot be, and were not believed since.
    doubted: Vec<bool>,
    now: Vec<Standing>,
}

impl Standings {
    pub(crate) fn new(points: usize) -> Self {
        Self {
            doubted: vec![false; points],
            now: vec![Standing::Unseen; points],
        }
    }

    /// The standings at the next step.
    pub(crate) fn judge(&mut self, states: &[PointState], doubts: &[(u32, Doubt)]) -> &[Standing] {
        for &(point, doubt) in doubts {
            self.doubted[point as usize] |= doubt == Doubt::Speed;
        }
        for ((doubted, now), state) in self.doubted.iter_mut().zip(&mut self.now).zip(states) {
            *now = match state {
                PointState::Valid if std::mem::take(doubted) => Standing::Regained,
                PointState::Valid => Standing::Seen,
                PointState::Held
                | PointState::Absent
                | PointState::Predicted
                | PointState::Lost => Standing::Unseen,
            };
        }
        &self.now
    }

    /// All of the past that the next judgement depends on.
    pub(crate) fn digest(&self, digest: &mut Digest) {
        let doubted: Vec<u8> = self.doubted.iter().map(|&doubted| doubted.into()).collect();
        digest.bytes(&doubted);
    }
}
