//! Markers that are not seen.

use nalgebra::Vector3;

use super::{Marker, Tracker};
use crate::neighbours::Guess;
use crate::{Settings, State};

/// How fast a speed dies away while nothing is seen, s.
const MOMENTUM: f64 = 0.1;
/// How long a marker takes to stray from its neighbours as far as it ever does, s.
const STRAY: f64 = 0.05;

/// How a marker's neighbours move over a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taken {
    was: Guess,
    now: Guess,
}

impl Taken {
    /// Where they take what was at `place`, m.
    pub(super) fn place(&self, place: Vector3<f64>) -> Vector3<f64> {
        self.now.position + self.now.turn * self.aside(place)
    }

    /// Where that was beside their guess, turned back to rest, m.
    fn aside(&self, place: Vector3<f64>) -> Vector3<f64> {
        self.was.turn.inverse() * (place - self.was.position)
    }
}

impl Tracker {
    /// How a marker's neighbours moved since the step before.
    pub(super) fn taken(&self, i: usize) -> Option<Taken> {
        let neighbours = &self.neighbours[i];
        let (before, now) = (&self.before, &self.now);
        let weights = neighbours.weights(&before.variances, &now.variances, self.time_step);
        let was = neighbours.guess(&weights.afresh(), &before.places, &self.markers[i].turn)?;
        let now = neighbours.guess(&weights, &now.places, &was.turn)?;
        Some(Taken { was, now })
    }

    /// Carries along a marker that is not seen.
    pub(super) fn carry(&mut self, i: usize) {
        let step = self.time_step;
        let Settings {
            predict_seconds: predict,
            release_seconds: release,
            take_back_seconds: back,
            ..
        } = self.settings;
        let taken = self.taken(i);
        let was = self.before.places[i];
        let marker = &mut self.markers[i];
        let fresh = marker.unseen == 0.0;
        marker.back = None;
        marker.unseen += step;
        // Half a step more: a sum of steps is not the time to the last bit.
        marker.state = state(marker.unseen - 0.5 * step, predict, release);
        if marker.unseen > predict {
            marker.course.slow((-step / MOMENTUM).exp());
        }
        let own = (marker.course.position, marker.course.variance());
        if fresh {
            marker.carried = was;
            marker.stray = 0.0;
            marker.drift = Vector3::zeros();
        }
        let carried = taken.map(|taken| {
            if fresh {
                let beside = (own.0 - taken.place(was)) / step;
                let usual = taken.now.variance / (STRAY * STRAY);
                let sure = usual / (usual + marker.course.speed_variance());
                marker.drift = taken.now.turn.inverse() * beside * sure;
            }
            marker.go_along(&taken, step, marker.leaves(step, predict, release))
        });
        // Where nobody knows, it goes on by itself.
        let (place, variance) = carried.map_or(own, |carried| meet(own, carried));
        self.now.places[i] = place;
        self.now.variances[i] = variance;
        marker.velocity = (place - was) / step;
        marker.offset *= match back > 0.0 {
            true => (-3.0 * step / back).exp(),
            false => 0.0,
        };
        self.shown[i] = place + marker.offset;
    }
}

impl Marker {
    /// What share of its way beside its place at rest a marker that is not seen leaves behind in a step.
    fn leaves(&self, step: f64, predict: f64, release: f64) -> f64 {
        match self.unseen > predict {
            // As much as makes it one twentieth by `release`.
            true => (-3.0 * step / (release - predict).max(step)).exp(),
            false => 1.0,
        }
    }

    /// Goes with its neighbours: where it is now, m, and how far off that may be, m².
    ///
    /// * `keeps` - the share of its way beside its place at rest that is left.
    fn go_along(&mut self, taken: &Taken, step: f64, keeps: f64) -> (Vector3<f64>, f64) {
        let aside = (taken.aside(self.carried) + self.drift * step) * keeps;
        self.drift *= (-step / MOMENTUM).exp();
        self.turn = taken.now.turn;
        self.carried = taken.now.position + taken.now.turn * aside;
        let strayed = (self.stray + taken.now.variance * step / STRAY).min(taken.now.variance);
        self.stray = self.stray.max(strayed);
        (self.carried, self.stray)
    }
}

/// Two places of one marker, each as far as it is sure.
fn meet(a: (Vector3<f64>, f64), b: (Vector3<f64>, f64)) -> (Vector3<f64>, f64) {
    let share = a.1 / (a.1 + b.1);
    (a.0.lerp(&b.0, share), share * b.1)
}

fn state(unseen: f64, predict: f64, release: f64) -> State {
    if unseen <= predict {
        State::Predicted
    } else if unseen <= release {
        State::Held
    } else {
        State::Lost
    }
}
