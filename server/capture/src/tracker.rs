//! A motion without jumps, from markers that come and go.

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
/// Below this distance two markers under each other's names are no matter, m.
const CLOSE: f64 = 0.01;
/// How many times nearer to another's place a marker is to be that other one.
const NEARER: f64 = 2.0;

/// One marker.
#[derive(Clone, Debug)]
struct Marker {
    state: State,
    doubt: Doubt,
    /// Where it is taken to be, m: where it is seen, or else where it is carried.
    place: Vector3<f64>,
    /// m/s
    velocity: Vector3<f64>,
    /// Since it was believed last, s.
    unseen: f64,
    /// Where it is beside its neighbours' guess, turned back to rest, m, and how fast that changes, m/s.
    aside: Vector3<f64>,
    drift: Vector3<f64>,
    /// The neighbours that `aside` belongs to, and how they are turned.
    who: u16,
    turn: Rotation3<f64>,
    /// By how much it was beside `place` when it came back, m, and since when, s.
    back: Option<(Vector3<f64>, f64)>,
    /// Where it is seen without being believed, m, and for how long, s.
    rival: Option<(Vector3<f64>, f64)>,
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
    /// Where markers were shown: the last step's last.
    past: VecDeque<Vec<Vector3<f64>>>,
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
        let marker = |(rest, present): (&Vector3<f64>, &bool)| Marker {
            state: match present {
                true => State::Valid,
                false => State::Absent,
            },
            doubt: Doubt::None,
            place: *rest,
            velocity: Vector3::zeros(),
            unseen: f64::INFINITY,
            aside: Vector3::zeros(),
            drift: Vector3::zeros(),
            who: 0,
            turn: Rotation3::identity(),
            back: None,
            rival: None,
        };
        Ok(Self {
            settings,
            time_step,
            neighbours: (0..rest.len())
                .map(|i| Neighbours::of(i, rest, present))
                .collect(),
            markers: rest.iter().zip(present).map(marker).collect(),
            started: false,
            named: (0..rest.len()).collect(),
            past: VecDeque::new(),
            shown: rest.to_vec(),
            expected: rest.to_vec(),
            believed: vec![false; rest.len()],
        })
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
            let vectors = [marker.place, marker.velocity, marker.aside, marker.drift];
            let turn = marker.turn.matrix().iter().map(|x| x.to_bits());
            let words = [marker.unseen.to_bits(), u64::from(marker.who)];
            (words
                .into_iter()
                .chain(vectors.into_iter().flat_map(vector)))
            .chain(turn.collect::<Vec<_>>())
            .chain(held(marker.back))
            .chain(held(marker.rival))
        };
        let names = self.named.iter().map(|&name| name as u64);
        let past = self.past.iter().flatten().copied().flat_map(vector);
        names
            .chain([u64::from(self.started)])
            .chain(self.markers.iter().flat_map(marker))
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
        for i in 0..self.markers.len() {
            if present(&self.markers[i]) && !self.believed[i] {
                self.carry(i);
            }
        }
        for i in 0..self.markers.len() {
            if present(&self.markers[i]) && !self.believed[i] {
                self.consider(i, seen(self.named[i]));
            }
        }
        self.started |= sample.is_some_and(|sample| sample.seen.contains(&true));
    }

    fn remember(&mut self) {
        let baseline = (BASELINE / self.time_step).round().max(1.0);
        let mut oldest = Vec::new();
        if !self.started {
            self.past.clear();
        } else if self.past.len() as f64 > baseline {
            oldest = self.past.pop_front().unwrap_or_default();
        }
        oldest.clone_from(&self.shown);
        self.past.push_back(oldest);
    }

    /// Where each marker should be now: where it goes by itself, or with its neighbours of the step before.
    fn expect(&mut self) {
        for (marker, expected) in self.markers.iter().zip(&mut self.expected) {
            *expected = marker.place + marker.velocity * self.time_step;
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

    /// Finds markers under each other's names, and gives each its own again.
    fn tell_apart(&mut self, sample: &Sample) {
        let count = self.markers.len();
        let seen = |named: &[usize], i: usize| {
            let column = named[i];
            sample.seen[column].then(|| sample.positions[column])
        };
        let known = |marker: &Marker| marker.unseen.is_finite();
        let off = |named: &[usize], i: usize| {
            seen(named, i).map_or(0.0, |place| (place - self.expected[i]).norm())
        };
        let close = |i: usize| CLOSE + self.slack(i);
        let doubtful: Vec<usize> = (0..count)
            .filter(|&i| known(&self.markers[i]) && off(&self.named, i) > close(i))
            .collect();
        // Whose place each is in, if it is anyone's who is not there.
        let mut takes = vec![None; count];
        for &i in &doubtful {
            let Some(place) = seen(&self.named, i) else {
                continue;
            };
            let free = |&j: &usize| {
                j != i
                    && known(&self.markers[j])
                    && (seen(&self.named, j).is_none() || doubtful.contains(&j))
            };
            let distance = |j: usize| (place - self.expected[j]).norm();
            let nearest = (0..count)
                .filter(free)
                .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            takes[i] = nearest.filter(|&j| NEARER * distance(j) < off(&self.named, i));
        }
        let hidden: Vec<bool> = (0..count).map(|i| seen(&self.named, i).is_none()).collect();
        self.rename(&takes, &hidden);
    }

    /// Gives each marker that is in another's place that other's name. Swaps go all round, or end at a marker that is
    /// hidden, whose name goes to the first: markers that follow each other closely are in each other's places too when
    /// they speed up, but the last of them is in nobody's.
    fn rename(&mut self, takes: &[Option<usize>], hidden: &[bool]) {
        let mut claimed = vec![false; takes.len()];
        let mut moves = Vec::new();
        for (from, to) in takes.iter().enumerate() {
            if let Some(to) = *to
                && !std::mem::replace(&mut claimed[to], true)
            {
                moves.push((from, to));
            }
        }
        loop {
            let gives: Vec<usize> = moves.iter().map(|&(from, _)| from).collect();
            let before = moves.len();
            moves.retain(|&(_, to)| hidden[to] || gives.contains(&to));
            if moves.len() == before {
                break;
            }
        }
        claimed.fill(false);
        for &(_, to) in &moves {
            claimed[to] = true;
        }
        if moves.is_empty() {
            return;
        }
        let gives = |i: usize| moves.iter().any(|&(from, _)| from == i);
        let names: Vec<usize> = moves.iter().map(|&(from, _)| self.named[from]).collect();
        let mut left: Vec<usize> = moves
            .iter()
            .filter(|&&(_, to)| !gives(to))
            .map(|&(_, to)| self.named[to])
            .collect();
        for (&(_, to), name) in moves.iter().zip(names) {
            self.named[to] = name;
            self.markers[to].doubt = Doubt::Swap;
        }
        for &(from, _) in &moves {
            if !claimed[from] {
                self.named[from] = left.pop().expect("as many chains start as end");
                self.markers[from].doubt = Doubt::Swap;
            }
        }
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
        let who = neighbours.who(&self.believed);
        let before = &self.past[self.past.len() - 1];
        let guess = |at: &[Vector3<f64>], last: &Rotation3<f64>| neighbours.guess(who, at, last);
        let taken = guess(before, &self.markers[i].turn).and_then(|was| {
            let now = guess(&self.shown, &was.turn)?;
            Some(now.position + now.turn * (was.turn.inverse() * (before[i] - was.position)))
        });
        taken.is_some_and(|taken| (seen - taken).norm() <= self.reach())
    }

    /// How far beside its way a marker can be after a step, m.
    fn reach(&self) -> f64 {
        self.settings.max_speed_change * self.time_step
    }

    /// Takes what is seen of a marker that was carried so far for true, where it can be.
    fn consider(&mut self, i: usize, seen: Option<Vector3<f64>>) {
        let Some(seen) = seen else {
            self.markers[i].rival = None;
            return;
        };
        self.expected[i] = self.shown[i];
        // One carried since this step only was there, and has been turned down.
        let fresh = self.markers[i].unseen <= self.time_step;
        let off = (seen - self.shown[i]).norm();
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
            marker.back = Some((-surprise, 0.0));
        } else {
            marker.velocity += surprise * (GAIN / step);
        }
        marker.place = seen;
        marker.unseen = 0.0;
        marker.rival = None;
        marker.state = State::Valid;
        self.believed[i] = true;
        self.shown[i] = seen;
        if let Some((aside, since)) = &mut marker.back {
            *since += step;
            let t = *since / self.settings.take_back_seconds;
            if *since + 0.5 * step < self.settings.take_back_seconds {
                self.shown[i] += *aside * (1.0 - t * t * (3.0 - 2.0 * t));
                marker.state = State::Held;
            } else {
                marker.back = None;
            }
        }
    }

    /// Carries along a marker that is not seen.
    fn carry(&mut self, i: usize) {
        let step = self.time_step;
        let Settings {
            predict_seconds: predict,
            release_seconds: release,
            ..
        } = self.settings;
        let neighbours = &self.neighbours[i];
        let who = neighbours.who(&self.believed);
        let marker = &mut self.markers[i];
        let before = &self.past[self.past.len() - 1];
        let was = neighbours.guess(who, before, &marker.turn);
        let now = was.and_then(|was| neighbours.guess(who, &self.shown, &was.turn));
        let fresh = marker.unseen == 0.0;
        marker.back = None;
        marker.unseen += step;
        // Half a step more: a sum of steps is not the time to the last bit.
        marker.state = state(marker.unseen - 0.5 * step, predict, release);
        let decay = (-step / MOMENTUM).exp();
        let (Some(was), Some(now)) = (was, now) else {
            // Nobody knows: it goes on, ever slower.
            self.shown[i] = before[i] + marker.velocity * step;
            marker.place = self.shown[i];
            marker.velocity *= decay;
            marker.who = 0;
            return;
        };
        if fresh || marker.who != who {
            marker.aside = was.turn.inverse() * (before[i] - was.position);
        }
        if fresh || marker.who == 0 {
            let aside = |at: &[Vector3<f64>]| {
                let guess = neighbours.guess(who, at, &was.turn)?;
                Some(guess.turn.inverse() * (at[i] - guess.position))
            };
            let (first, steps) = (&self.past[0], self.past.len() - 1);
            let moved = aside(first).map_or_else(Vector3::zeros, |first| marker.aside - first);
            marker.drift = moved / (steps.max(1) as f64 * step);
        }
        marker.who = who;
        marker.turn = now.turn;
        marker.aside += marker.drift * step;
        marker.drift *= decay;
        if marker.unseen > predict {
            // As much as makes it one twentieth by `release`.
            let rate = 3.0 / (release - predict).max(step);
            marker.aside *= (-rate * step).exp();
        }
        self.shown[i] = now.position + now.turn * marker.aside;
        marker.place = self.shown[i];
        marker.velocity = (self.shown[i] - before[i]) / step;
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
