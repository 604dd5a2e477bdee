//! A motion without jumps, from markers that come and go.

mod carry;
mod names;

use nalgebra::{Rotation3, Vector3};

use crate::course::{Course, Law};
use crate::neighbours::Neighbours;
use crate::{Doubt, Sample, Settings, SettingsError, State};

/// For how long a marker that is not seen may change its speed as much as from one step to the next, s.
const SLIP: f64 = 0.04;

/// One marker.
#[derive(Clone, Debug)]
struct Marker {
    state: State,
    doubt: Doubt,
    /// Where it goes by itself, from what was seen of it.
    course: Course,
    /// How fast it is taken to go, m/s.
    velocity: Vector3<f64>,
    /// Since it was believed last, s.
    unseen: f64,
    /// Where its neighbours take it, m, since it is not seen.
    carried: Vector3<f64>,
    /// How far off that may be, m².
    stray: f64,
    /// How fast it goes beside them, turned back to rest, m/s.
    drift: Vector3<f64>,
    /// How its neighbours are turned.
    turn: Rotation3<f64>,
    /// By how much it is shown beside its place, m, so that nothing jumps; no place is ever told from what is shown.
    offset: Vector3<f64>,
    /// What the offset was when it came back, m, and since when, s.
    back: Option<(Vector3<f64>, f64)>,
    /// Where it is seen without being believed, m, and for how long, s.
    rival: Option<(Vector3<f64>, f64)>,
}

/// Where markers are taken to be.
#[derive(Clone, Debug, Default)]
struct Places {
    /// m: where each is seen, or else where it is carried.
    places: Vec<Vector3<f64>>,
    /// How far off that may be, m²; 0 where it is seen, infinite where nobody knows.
    variances: Vec<f64>,
}

/// Markers from step to step. `[S4]`
///
/// A marker that is not seen first goes on as it went (`[S5]`). The less sure that is, the more it is carried by the
/// rigid motion of those around it that go with it, and in the end it moves to its place among them at rest
/// (`release`). It is never frozen in space while the body walks on, and nothing it does has a jump. Seen again, it is
/// taken back over `take_back`.
#[derive(Clone, Debug)]
pub struct Tracker {
    settings: Settings,
    time_step: f64,
    law: Law,
    neighbours: Vec<Neighbours>,
    markers: Vec<Marker>,
    /// Whether anything was ever seen: where markers rest says nothing of where they are seen first.
    started: bool,
    /// For each marker the one under whose name it comes.
    named: Vec<usize>,
    /// At the step before, and now.
    before: Places,
    now: Places,
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
        let marker = |(present, rest): (&bool, &Vector3<f64>)| Marker {
            state: match present {
                true => State::Valid,
                false => State::Absent,
            },
            doubt: Doubt::None,
            course: Course::unknown(*rest),
            velocity: Vector3::zeros(),
            unseen: f64::INFINITY,
            carried: *rest,
            stray: 0.0,
            drift: Vector3::zeros(),
            turn: Rotation3::identity(),
            offset: Vector3::zeros(),
            back: None,
            rival: None,
        };
        let places = Places {
            places: rest.to_vec(),
            variances: vec![0.0; rest.len()],
        };
        Ok(Self {
            settings,
            time_step,
            law: Law::new(time_step),
            neighbours: (0..rest.len())
                .map(|i| Neighbours::of(i, rest, present))
                .collect(),
            markers: present.iter().zip(rest).map(marker).collect(),
            started: false,
            named: (0..rest.len()).collect(),
            before: places.clone(),
            now: places,
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
            let vectors = [marker.velocity, marker.carried, marker.drift, marker.offset];
            let turn = marker.turn.matrix().iter().map(|x| x.to_bits());
            [marker.unseen.to_bits(), marker.stray.to_bits()]
                .into_iter()
                .chain(vectors.into_iter().flat_map(vector))
                .chain(marker.course.state())
                .chain(turn.collect::<Vec<_>>())
                .chain(held(marker.back))
                .chain(held(marker.rival))
                .collect::<Vec<_>>()
        };
        let names = self.named.iter().map(|&name| name as u64);
        let places = (self.now.places.iter())
            .chain(&self.shown)
            .copied()
            .flat_map(vector);
        names
            .chain([u64::from(self.started)])
            .chain(self.markers.iter().flat_map(marker))
            .chain(self.neighbours.iter().flat_map(Neighbours::state))
            .chain(places)
            .chain(self.now.variances.iter().map(|x| x.to_bits()))
    }

    /// One step; without a sample nothing is seen.
    ///
    /// # Panics
    /// If the sample has another number of markers.
    pub fn step(&mut self, sample: Option<&Sample>) {
        self.advance();
        if let Some(sample) = sample {
            assert_eq!(sample.positions.len(), self.markers.len(), "other markers");
            assert_eq!(sample.seen.len(), self.markers.len(), "other markers");
            if self.is_cut(sample) {
                self.started = false;
                for marker in &mut self.markers {
                    marker.course.forget();
                }
            } else if self.settings.max_speed_change.is_finite() {
                self.tell_apart(sample);
            }
        }
        let seen: Vec<Option<Vector3<f64>>> = (self.named.iter())
            .map(|&column| {
                let sample = sample.filter(|sample| sample.seen[column])?;
                Some(sample.positions[column])
            })
            .collect();
        self.foresee(&seen);
        let present = |marker: &Marker| marker.state != State::Absent;
        // First those that were there all the time and go on as they went, then those that go with these: they carry the
        // others.
        for way in [Self::goes_on, Self::goes_along] {
            for i in 0..self.markers.len() {
                let there = !self.started || self.markers[i].unseen == 0.0;
                if let Some(seen) = seen[i].filter(|_| there && !self.believed[i])
                    && present(&self.markers[i])
                    && way(self, i, seen)
                {
                    self.accept(i, seen);
                }
            }
        }
        // Then those that come back where they can be: they too carry the rest.
        let mut left: Vec<usize> = (0..self.markers.len())
            .filter(|&i| present(&self.markers[i]) && !self.believed[i])
            .collect();
        // Those that are known best speak first.
        left.sort_by(|&a, &b| self.before.variances[a].total_cmp(&self.before.variances[b]));
        let (back, hidden): (Vec<_>, Vec<_>) = left.into_iter().partition(|&i| seen[i].is_some());
        // Where nobody was believed for a while, nobody knows where the body is but those who see it now.
        let predict = self.settings.predict_seconds;
        let adrift =
            (self.markers.iter()).all(|marker| !present(marker) || marker.unseen > predict);
        for &i in &back {
            self.carry(i);
        }
        for &i in &back {
            match seen[i] {
                Some(seen) if adrift => self.accept(i, seen),
                Some(seen) => self.consider(i, seen),
                None => {}
            }
        }
        for &i in &hidden {
            self.carry(i);
            self.markers[i].rival = None;
        }
        self.learn();
        self.started |= seen.iter().any(Option::is_some);
    }

    /// Begins a step: all that is known is of the one before.
    fn advance(&mut self) {
        self.before.places.clone_from(&self.now.places);
        self.before.variances.clone_from(&self.now.variances);
        self.believed.fill(false);
        for (marker, expected) in self.markers.iter_mut().zip(&mut self.expected) {
            marker.doubt = Doubt::None;
            marker.course.advance(&self.law);
            *expected = marker.course.position;
        }
        for (i, marker) in self.markers.iter().enumerate() {
            if marker.unseen > 0.0 {
                self.expected[i] = self.now.places[i] + marker.velocity * self.time_step;
            }
        }
    }

    /// Takes those that are not seen to be where they go by themselves; of those that are, nothing is known until they
    /// are believed.
    fn foresee(&mut self, seen: &[Option<Vector3<f64>>]) {
        for (i, marker) in self.markers.iter().enumerate() {
            let known = seen[i].is_none() && marker.unseen.is_finite();
            self.now.variances[i] = match known {
                true => {
                    self.now.places[i] = marker.course.position;
                    marker.course.variance()
                }
                false => f64::INFINITY,
            };
        }
    }

    /// Remembers who goes with whom.
    fn learn(&mut self) {
        let now = &self.now.places;
        for (i, neighbours) in self.neighbours.iter_mut().enumerate() {
            if self.believed[i] {
                let way = self.markers[i].course.velocity.norm() * self.time_step;
                neighbours.learn(now[i], way, now, &self.believed);
            }
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
            true => most * (unseen.min(self.settings.release_seconds) / 4.0 + unseen.min(SLIP)),
            false => f64::INFINITY,
        }
    }

    /// Whether a marker that was there is where it can be by itself.
    fn goes_on(&self, i: usize, seen: Vector3<f64>) -> bool {
        !self.started || (seen - self.expected[i]).norm() <= self.reach()
    }

    /// Whether it is where its neighbours would take it: a body may start faster than one marker is believed to.
    fn goes_along(&self, i: usize, seen: Vector3<f64>) -> bool {
        let taken = self.taken(i);
        taken
            .is_some_and(|taken| (seen - taken.place(self.before.places[i])).norm() <= self.reach())
    }

    /// How far beside its way a marker can be after a step, m.
    fn reach(&self) -> f64 {
        self.settings.max_speed_change * self.time_step
    }

    /// Takes what is seen of a marker that was carried so far for true, where it can be.
    fn consider(&mut self, i: usize, seen: Vector3<f64>) {
        // One carried since this step only was there, and has been turned down.
        let fresh = self.markers[i].unseen <= self.time_step;
        let off = (seen - self.now.places[i]).norm();
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
        let marker = &mut self.markers[i];
        if !self.started {
            marker.course = Course::start(seen, Vector3::zeros());
            marker.back = None;
        } else {
            if marker.unseen > 0.0 {
                marker.back = Some((self.shown[i] - seen, 0.0));
            }
            match marker.unseen > self.settings.predict_seconds {
                true => marker.course = Course::start(seen, marker.velocity),
                false => marker.course.correct(seen),
            }
        }
        marker.velocity = marker.course.velocity;
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
        self.now.places[i] = seen;
        self.now.variances[i] = 0.0;
        self.shown[i] = seen + marker.offset;
    }
}
