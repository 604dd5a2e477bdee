//! Where a marker should be, by those around it.

use nalgebra::{Rotation3, Vector3};

/// How many markers speak for one that is not seen.
const MOST: usize = 16;
/// What [`Rotation3::from_matrix_eps`] calls done, rad, and after how many steps it gives up.
const ANGLE: f64 = 1e-12;
const STEPS: usize = 100;
/// By what share of their distance two markers are taken to part as long as nothing is known, and at least.
const SOFT: f64 = 0.03;
const STIFF: f64 = 1e-7;
/// After how much of its way a marker knows who goes with it, and after how much it forgets, m.
const LEARN: f64 = 0.1;
const FORGET: f64 = 2.0;
/// How fast a part of a body turns, rad/s: what its markers say less surely than this is not believed.
const TURN: f64 = 10.0;
/// What is left of that where it is not known how they were turned before.
const AFRESH: f64 = 1e-6;
/// What an arm says of a turn about an axis, on average over all axes.
const LEVER: f64 = 2.0 / 3.0;

/// One that may go with a marker.
#[derive(Clone, Debug)]
struct Neighbour {
    index: usize,
    rest: Vector3<f64>,
    /// Of its distance to the marker: mean, m, and variance, m², of what was seen.
    mean: f64,
    variance: f64,
    /// At rest, m².
    squared: f64,
}

/// The markers nearest to one at rest, and how closely each goes with it.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    rest: Vector3<f64>,
    around: Vec<Neighbour>,
    /// How far the marker went while it was seen, m.
    way: f64,
}

/// How much each neighbour has to say, 1/m², and how they were turned before, 1/rad².
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    each: [f64; MOST],
    turn: f64,
}

impl Weights {
    /// The same, with next to nothing of how they were turned before.
    pub(crate) fn afresh(self) -> Self {
        let turn = AFRESH * self.turn;
        Self { turn, ..self }
    }
}

/// A rigid motion of a marker's surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Guess {
    /// Where the marker is if it moved with them.
    pub(crate) position: Vector3<f64>,
    /// How they turned since rest.
    pub(crate) turn: Rotation3<f64>,
    /// How far off the place may be, m²: as far as they stray, and what their turn may be off by at the marker's arm.
    pub(crate) variance: f64,
}

impl Neighbours {
    /// The nearest present markers of `marker`; ties go to the lower index.
    pub(crate) fn of(marker: usize, rest: &[Vector3<f64>], present: &[bool]) -> Self {
        let squared = |other: usize| (rest[other] - rest[marker]).norm_squared();
        let mut others: Vec<usize> = (0..rest.len())
            .filter(|&other| other != marker && present[other])
            .collect();
        others.sort_by(|&a, &b| squared(a).total_cmp(&squared(b)).then(a.cmp(&b)));
        others.truncate(MOST);
        // Of two markers in one place neither says all.
        let floor = others.last().map_or(1.0, |&far| 1e-4 * squared(far));
        let neighbour = |index: usize| Neighbour {
            index,
            rest: rest[index],
            mean: squared(index).sqrt(),
            variance: 0.0,
            squared: squared(index).max(floor.max(f64::MIN_POSITIVE)),
        };
        Self {
            rest: rest[marker],
            around: others.into_iter().map(neighbour).collect(),
            way: 0.0,
        }
    }

    /// Learns who goes with the marker, that went `way` to be `here`, of those that are seen.
    pub(crate) fn learn(
        &mut self,
        here: Vector3<f64>,
        way: f64,
        places: &[Vector3<f64>],
        seen: &[bool],
    ) {
        self.way += way;
        let share = (way / FORGET.min(self.way)).min(1.0);
        if share.is_nan() {
            return;
        }
        for other in self.around.iter_mut().filter(|other| seen[other.index]) {
            let off = (places[other.index] - here).norm() - other.mean;
            other.mean += share * off;
            other.variance = (1.0 - share) * (other.variance + share * off * off);
        }
    }

    /// How far its distance to another strays, m².
    fn softness(&self, other: &Neighbour) -> f64 {
        let unknown = (-self.way / LEARN).exp();
        other.variance + (SOFT * SOFT * unknown + STIFF * STIFF) * other.squared
    }

    /// How much each has to say.
    ///
    /// * `before`, `now` - how far off each marker may be taken to be at the step before and at this one, m².
    /// * `step` - s.
    pub(crate) fn weights(&self, before: &[f64], now: &[f64], step: f64) -> Weights {
        let mut each = [0.0; MOST];
        for (weight, other) in each.iter_mut().zip(&self.around) {
            *weight = (self.softness(other) + before[other.index] + now[other.index]).recip();
        }
        let turn = 0.5 / (TURN * step * TURN * step);
        Weights { each, turn }
    }

    /// The rigid motion that takes them from rest to `now`, and the marker with it; `None` where nobody has a say. `[S6]`
    ///
    /// * `last` - how they were turned before.
    pub(crate) fn guess(
        &self,
        weights: &Weights,
        now: &[Vector3<f64>],
        last: &Rotation3<f64>,
    ) -> Option<Guess> {
        let chosen = || {
            let each = self.around.iter().zip(weights.each);
            each.filter(|&(_, weight)| weight > 0.0)
        };
        let total: f64 = chosen().map(|(_, weight)| weight).sum();
        let count = chosen().count() as f64;
        if total <= 0.0 {
            return None;
        }
        let (mut centre, mut centre_rest) = (Vector3::zeros(), Vector3::zeros());
        for (other, weight) in chosen() {
            centre += now[other.index] * (weight / total);
            centre_rest += other.rest * (weight / total);
        }
        let mut arms = last.matrix() * weights.turn;
        let mut sureness = 2.0 * weights.turn;
        for (other, weight) in chosen() {
            let arm = other.rest - centre_rest;
            arms += (now[other.index] - centre) * arm.transpose() * weight;
            sureness += LEVER * weight * arm.norm_squared();
        }
        let turn = Rotation3::from_matrix_eps(&(arms / arms.norm()), ANGLE, STEPS, *last);
        let arm = self.rest - centre_rest;
        Some(Guess {
            position: centre + turn * arm,
            turn,
            variance: count / total + arm.norm_squared() / sureness,
        })
    }

    /// All that was learnt, in words.
    pub(crate) fn state(&self) -> impl Iterator<Item = u64> + '_ {
        let learnt = |other: &Neighbour| [other.mean.to_bits(), other.variance.to_bits()];
        std::iter::once(self.way.to_bits()).chain(self.around.iter().flat_map(learnt))
    }
}
