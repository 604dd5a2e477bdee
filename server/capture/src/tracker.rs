//! A motion without jumps, from markers that come and go.

mod names;

use std::collections::VecDeque;

use nalgebra::{Rotation3, Vector3};

use crate::neighbours::Neighbours;
use crate::{Doubt, Sample, Settings, SettingsError, State};

/// How fast a speed dies away while nothing is seen, s.
const MOMENTUM: f64 = 0.1;
/// Over how long a speed beside the neighbours is taken, s: the noise of two neighbouring frames is no speed.
const BASELINE: f64 = 0.05;
/// How much of a step's surprise goes into the speed: enough to follow, little enough not to predict from noise.
const GAIN: f64 = 0.5;
/// How many neighbours tell how a marker's surroundings turn.
const ENOUGH: u32 = 3;

/// One marker.
#[derive(Clone, Debug)]
struct Marker {
    state: State,
    doubt: Doubt,
    /// m/s
    velocity: Vector3<f64>,
    /// Since it was believed last, s.
    unseen: f64,
    /// Where it is beside its neighbours' guess, turned back to rest, m, and how fast that changes, m/s.
    aside: Vector3<f64>,
    drift: Vector3<f64>,
    /// How far beside it was seen at most, m.
    most_aside: f64,
    /// The neighbours that `aside` belongs to, and how they are turned.
    who: u16,
    turn: Rotation3<f64>,
    /// By how much it is shown beside its place, m, so that nothing jumps; no place is ever told from what is shown.
    offset: Vector3<f64>,
    /// What the offset was when it came back, m, and since when, s.
    back: Option<(Vector3<f64>, f64)>,
    /// Where it is seen without being believed, m, and for how long, s.
    rival: Option<(Vector3<f64>, f64)>,
}

/// Where markers were at a step, m, and which were seen and believed.
#[derive(Clone, Debug, Default)]
struct Past {
    places: Vec<Vector3<f64>>,
    believed: Vec<bool>,
}

/// Markers from step to step. `[S4]`
///
/// A marker that is not seen is carried by the rigid motion of those around it, beside which it first goes on as it
/// went (`predict`), then moves to its place at rest (`release`). It is never frozen in space while the body walks on,
/// and nothing it does has a jump. Seen again, it is taken back over `take_back`.
#[derive(Clone, Debug)]
pub struct Tracker {
    settings: Settings,
    time_step: f64,
    neighbours: Vec<Neighbours>,
    markers: Vec<Marker>,
    /// Whether anything was ever seen: where markers rest says nothing of where they are seen first.
    started: bool,
    /// For each marker the one under whose name it comes.
    named: Vec<usize>,
    /// The last step's last.
    past: VecDeque<Past>,
    /// Where each is taken to be, m: where it is seen, or else where it is carried.
    places: Vec<Vector3<f64>>,
    shown: Vec<Vector3<f64>>,
    /// Of the step under way: where markers should be, and which are seen and believed.
    expected: Vec<Vector3<f64>>,
    believed: Vec<bool>,
}

impl Tracker {
    /// Markers at rest, all of them seen there.
    ///
    /// * `rest`, `present` - one per marker; places in m, not read where not present.
    /// * `time_step` - s, > 0.
    ///
    /// # Errors
    /// As [`Settings::check`].
    pub fn new(
        rest: &[Vector3<f64>],
        present: &[bool],
        time_step: f64,
        settings: Settings,
    ) -> Result<Self, SettingsError> {
        settings.check()?;
        let marker = |present: &bool| Marker {
            state: match present {
                true => State::Valid,
                false => State::Absent,
            },
            doubt: Doubt::None,
            velocity: Vector3::zeros(),
            unseen: f64::INFINITY,
            aside: Vector3::zeros(),
            drift: Vector3::zeros(),
            most_aside: 0.0,
            who: 0,
            turn: Rotation3::identity(),
            offset: Vector3::zeros(),
            back: None,
            rival: None,
        };
        Ok(Self {
            settings,
            time_step,
            neighbours: (0..rest.len())
                .map(|i| Neighbours::of(i, rest, present))
                .collect(),
            markers: present.iter().map(marker).collect(),
            started: false,
            named: (0..rest.len()).collect(),
            past: VecDeque::new(),
            places: rest.to_vec(),
            shown: rest.to_vec(),
            expected: rest.to_vec(),
            believed: vec![false; rest.len()],
        })
    }

    /// For how long, and how far, markers are believed.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Where each marker is shown, m.
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.shown
    }

    /// What is known of each marker.
    pub fn states(&self) -> impl ExactSizeIterator<Item = State> + '_ {
        self.markers.iter().map(|marker| marker.state)
    }

    /// What was not believed at the last step.
    pub fn doubts(&self) -> impl ExactSizeIterator<Item = Doubt> + '_ {
        self.markers.iter().map(|marker| marker.doubt)
    }

    /// All that the next step depends on beside the rest, in words.
    pub fn state(&self) -> impl Iterator<Item = u64> + '_ {
        let vector = |v: Vector3<f64>| [v.x, v.y, v.z].map(f64::to_bits);
        let held = move |aside: Option<(Vector3<f64>, f64)>| {
            let (place, since) = aside.unwrap_or((Vector3::zeros(), -1.0));
            vector(place).into_iter().chain([since.to_bits()])
        };
        let marker = move |marker: &Marker| {
            let vectors = [marker.velocity, marker.aside, marker.drift, marker.offset];
            let turn = marker.turn.matrix().iter().map(|x| x.to_bits());
            let words = [
                marker.unseen.to_bits(),
                u64::from(marker.who),
                marker.most_aside.to_bits(),
            ];
            (words
                .into_iter()
                .chain(vectors.into_iter().flat_map(vector)))
            .chain(turn.collect::<Vec<_>>())
            .chain(held(marker.back))
            .chain(held(marker.rival))
        };
        let names = self.named.iter().map(|&name| name as u64);
        let step = move |past: &Past| {
            let places: Vec<u64> = past.places.iter().copied().flat_map(vector).collect();
            let believed = past.believed.iter().map(|believed| u64::from(*believed));
            places.into_iter().chain(believed.collect::<Vec<_>>())
        };
        let past = self.past.iter().flat_map(step);
        let places = self
            .places
            .iter()
            .chain(&self.shown)
            .copied()
            .flat_map(vector);
        names
            .chain([u64::from(self.started)])
            .chain(self.markers.iter().flat_map(marker))
            .chain(places)
            .chain(past)
    }

    /// One step; without a sample nothing is seen.
    ///
    /// # Panics
    /// If the sample has another number of markers.
    pub fn step(&mut self, sample: Option<&Sample>) {
        self.remember();
        for marker in &mut self.markers {
            marker.doubt = Doubt::None;
        }
        self.believed.fill(false);
        self.expect();
        if let Some(sample) = sample {
            assert_eq!(sample.positions.len(), self.markers.len(), "other markers");
            assert_eq!(sample.seen.len(), self.markers.len(), "other markers");
            if self.is_cut(sample) {
                self.started = false;
            } else if self.settings.max_speed_change.is_finite() {
                self.tell_apart(sample);
            }
        }
        let seen = |column: usize| {
            let sample = sample.filter(|sample| sample.seen[column])?;
            Some(sample.positions[column])
        };
        let present = |marker: &Marker| marker.state != State::Absent;
        // First those that were there all the time and go on as they went, then those that go with these: they carry the
        // others.
        for way in [Self::goes_on, Self::goes_along] {
            for i in 0..self.markers.len() {
                let there = !self.started || self.markers[i].unseen == 0.0;
                if let Some(seen) = seen(self.named[i]).filter(|_| there && !self.believed[i])
                    && present(&self.markers[i])
                    && way(self, i, seen)
                {
                    self.accept(i, seen);
                }
            }
        }
        // Then those that come back where they can be: they too carry the rest.
        let left = |tracker: &Self, i: usize| present(&tracker.markers[i]) && !tracker.believed[i];
        let back: Vec<usize> = (0..self.markers.len())
            .filter(|&i| left(self, i) && seen(self.named[i]).is_some())
            .collect();
        for &i in &back {
            self.carry(i);
        }
        // Where nobody was believed for a while, nobody knows where the body is but those who see it now.
        let predict = self.settings.predict_seconds;
        let adrift =
            (self.markers.iter()).all(|marker| !present(marker) || marker.unseen > predict);
        for &i in &back {
            match seen(self.named[i]) {
                Some(seen) if adrift => {
                    self.expected[i] = self.places[i];
                    self.accept(i, seen);
                }
                Some(seen) => self.consider(i, seen),
                None => {}
            }
        }
        for i in 0..self.markers.len() {
            if left(self, i) && !back.contains(&i) {
                self.carry(i);
                self.markers[i].rival = None;
            }
        }
        self.started |= sample.is_some_and(|sample| sample.seen.contains(&true));
    }

    fn remember(&mut self) {
        let baseline = (BASELINE / self.time_step).round().max(1.0);
        let mut oldest = Past::default();
        if !self.started {
            self.past.clear();
        } else if self.past.len() as f64 > baseline {
            oldest = self.past.pop_front().unwrap_or_default();
        }
        oldest.places.clone_from(&self.places);
        oldest.believed.clone_from(&self.believed);
        self.past.push_back(oldest);
    }

    /// The step before.
    fn before(&self) -> &Past {
        &self.past[self.past.len() - 1]
    }

    /// Where each marker should be now: where it goes by itself, or with its neighbours of the step before.
    fn expect(&mut self) {
        for ((marker, place), expected) in self
            .markers
            .iter()
            .zip(&self.places)
            .zip(&mut self.expected)
        {
            *expected = place + marker.velocity * self.time_step;
        }
    }

    /// Whether most markers jump at once: no marker's fault, but a cut in the motion, or a scale that no body has.
    fn is_cut(&self, sample: &Sample) -> bool {
        let reach = self.reach();
        let there = |&i: &usize| self.markers[i].unseen == 0.0 && sample.seen[self.named[i]];
        let jumps =
            |&i: &usize| (sample.positions[self.named[i]] - self.expected[i]).norm() > reach;
        let count = (0..self.markers.len()).filter(there).count();
        let jumping = (0..self.markers.len()).filter(there).filter(jumps).count();
        jumping > 1 && 2 * jumping > count
    }

    /// How much further off than at a step a marker may be by now, m: as it was not seen for a while.
    fn slack(&self, i: usize) -> f64 {
        let unseen = self.markers[i].unseen;
        let most = self.settings.max_speed_change;
        match unseen.is_finite() {
            true => most * unseen.min(self.settings.release_seconds) / 4.0,
            false => f64::INFINITY,
        }
    }

    /// Whether a marker that was there is where it can be by itself.
    fn goes_on(&self, i: usize, seen: Vector3<f64>) -> bool {
        !self.started || (seen - self.expected[i]).norm() <= self.reach()
    }

    /// Whether it is where its neighbours would take it: a body may start faster than one marker is believed to.
    fn goes_along(&self, i: usize, seen: Vector3<f64>) -> bool {
        let neighbours = &self.neighbours[i];
        let who = self.steady(i, self.before());
        let before = &self.before().places;
        let guess = |at: &[Vector3<f64>], last: &Rotation3<f64>| neighbours.guess(who, at, last);
        let taken = guess(before, &self.markers[i].turn).and_then(|was| {
            let now = guess(&self.places, &was.turn)?;
            Some(now.position + now.turn * (was.turn.inverse() * (before[i] - was.position)))
        });
        taken.is_some_and(|taken| (seen - taken).norm() <= self.reach())
    }

    /// The neighbours of a marker that are believed now and were at a step before; where these are too few to tell a
    /// turn by, all that are believed now.
    fn steady(&self, i: usize, past: &Past) -> u16 {
        let neighbours = &self.neighbours[i];
        let now = neighbours.who(&self.believed);
        let both = now & neighbours.who(&past.believed);
        match both.count_ones() >= ENOUGH {
            true => both,
            false => now,
        }
    }

    /// How far beside its way a marker can be after a step, m.
    fn reach(&self) -> f64 {
        self.settings.max_speed_change * self.time_step
    }

    /// Takes what is seen of a marker that was carried so far for true, where it can be.
    fn consider(&mut self, i: usize, seen: Vector3<f64>) {
        self.expected[i] = self.places[i];
        // One carried since this step only was there, and has been turned down.
        let fresh = self.markers[i].unseen <= self.time_step;
        let off = (seen - self.places[i]).norm();
        if (fresh || off > self.reach() + self.slack(i)) && !self.persists(i, seen) {
            self.markers[i].doubt = Doubt::Speed;
        } else {
            self.accept(i, seen);
        }
    }

    /// Whether a marker has been seen in an unbelievable place, moving as a body does, for long enough.
    fn persists(&mut self, i: usize, seen: Vector3<f64>) -> bool {
        let reach = self.reach();
        let marker = &mut self.markers[i];
        let since = match marker.rival {
            Some((last, since)) if (seen - last).norm() <= reach => since + self.time_step,
            _ => 0.0,
        };
        marker.rival = Some((seen, since));
        since >= self.settings.believe_seconds
    }

    fn accept(&mut self, i: usize, seen: Vector3<f64>) {
        let step = self.time_step;
        let surprise = seen - self.expected[i];
        let marker = &mut self.markers[i];
        if !self.started {
            marker.velocity = Vector3::zeros();
            marker.back = None;
        } else if marker.unseen > 0.0 {
            marker.back = Some((self.shown[i] - seen, 0.0));
        } else {
            marker.velocity += surprise * (GAIN / step);
        }
        marker.unseen = 0.0;
        marker.rival = None;
        marker.state = State::Valid;
        marker.offset = Vector3::zeros();
        if let Some((offset, since)) = &mut marker.back {
            *since += step;
            let t = *since / self.settings.take_back_seconds;
            if *since + 0.5 * step < self.settings.take_back_seconds {
                marker.offset = *offset * (1.0 - t * t * (3.0 - 2.0 * t));
                marker.state = State::Held;
            } else {
                marker.back = None;
            }
        }
        self.believed[i] = true;
        self.places[i] = seen;
        self.shown[i] = seen + marker.offset;
    }

    /// Carries along a marker that is not seen.
    fn carry(&mut self, i: usize) {
        let step = self.time_step;
        let Settings {
            predict_seconds: predict,
            release_seconds: release,
            take_back_seconds: back,
            ..
        } = self.settings;
        let fresh = self.markers[i].unseen == 0.0;
        let drift = match fresh {
            true => self.drift(i),
            false => self.markers[i].drift,
        };
        let who = self.steady(i, self.before());
        let (neighbours, before) = (&self.neighbours[i], &self.past[self.past.len() - 1].places);
        let marker = &mut self.markers[i];
        let was = neighbours.guess(who, before, &marker.turn);
        let now = was.and_then(|was| neighbours.guess(who, &self.places, &was.turn));
        marker.back = None;
        marker.unseen += step;
        // Half a step more: a sum of steps is not the time to the last bit.
        marker.state = state(marker.unseen - 0.5 * step, predict, release);
        let decay = (-step / MOMENTUM).exp();
        let (Some(was), Some(now)) = (was, now) else {
            // Nobody knows: it goes on, ever slower.
            self.places[i] = before[i] + marker.velocity * step;
            self.shown[i] = self.places[i] + marker.offset;
            marker.velocity *= decay;
            marker.who = 0;
            return;
        };
        if fresh || marker.who == 0 {
            marker.drift = drift;
        }
        let others = marker.who != who;
        let mut jump = Vector3::zeros();
        if fresh || others {
            let aside = was.turn.inverse() * (before[i] - was.position);
            if fresh {
                marker.most_aside = marker.most_aside.max(aside.norm());
            }
            // Errors of those that are carried add up, but not beyond what was ever seen.
            marker.aside = aside.cap_magnitude(marker.most_aside);
            jump = aside - marker.aside;
        }
        marker.who = who;
        marker.turn = now.turn;
        let aside = marker.aside;
        marker.aside += marker.drift * step;
        marker.drift *= decay;
        if marker.unseen > predict {
            // As much as makes it one twentieth by `release`.
            let rate = 3.0 / (release - predict).max(step);
            marker.aside *= (-rate * step).exp();
        }
        self.places[i] = now.position + now.turn * marker.aside;
        marker.offset += now.turn * jump;
        marker.offset *= match back > 0.0 {
            true => (-3.0 * step / back).exp(),
            false => 0.0,
        };
        self.shown[i] = self.places[i] + marker.offset;
        // Of the same neighbours: that others speak now is no speed.
        let taken = self.places[i] - (was.position + was.turn * aside);
        marker.velocity += GAIN * (taken / step - marker.velocity);
    }

    /// How fast a marker that was seen until the step before went beside its neighbours, m/s, by what was seen of both;
    /// none where that was too little.
    fn drift(&self, i: usize) -> Vector3<f64> {
        let neighbours = &self.neighbours[i];
        let last = self.before();
        let both = |past: &Past| neighbours.who(&past.believed) & neighbours.who(&last.believed);
        let steps = self.past.len() - 1;
        let first = (0..steps)
            .find(|&k| self.past[k].believed[i] && both(&self.past[k]).count_ones() >= ENOUGH);
        let drift = first.and_then(|k| {
            let who = both(&self.past[k]);
            let aside = |past: &Past| {
                let guess = neighbours.guess(who, &past.places, &self.markers[i].turn)?;
                Some(guess.turn.inverse() * (past.places[i] - guess.position))
            };
            let moved = aside(last)? - aside(&self.past[k])?;
            Some(moved / ((steps - k) as f64 * self.time_step))
        });
        drift.unwrap_or_else(Vector3::zeros)
    }
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
