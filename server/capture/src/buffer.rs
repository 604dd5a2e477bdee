//! Frames on their way to the step grid.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::Sample;

/// What became of a frame that came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is in its place.
    Taken,
    /// It came after a later one, and is in its place all the same.
    Reordered,
    /// It is there already.
    Duplicate,
    /// Its moment is over.
    Late,
    /// There is no room: the steps stand still, or the source is far ahead of them.
    Full,
}

/// How many frames came to what end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All that came.
    pub received: u64,
    /// See [`Verdict::Reordered`].
    pub reordered: u64,
    /// See [`Verdict::Duplicate`].
    pub duplicate: u64,
    /// See [`Verdict::Late`].
    pub late: u64,
    /// See [`Verdict::Full`].
    pub refused: u64,
}

/// Frames in the order of their capture, and between them any moment. `[S3]`
#[derive(Clone, Debug)]
pub struct Buffer {
    /// By ascending sequence and time.
    frames: VecDeque<Sample>,
    capacity: usize,
    /// Frames further apart than this have nothing to say of the time between them, s.
    span: f64,
    /// A marker that goes faster than this from one frame to the next jumped, m/s.
    leap: f64,
    /// The moment asked for last.
    past: f64,
    /// When and where each marker was seen last by then.
    last: Vec<(f64, Vector3<f64>)>,
    counts: Counts,
}

/// A moment this close to a frame is the frame's, s: what clocks in decimal fractions are off by.
const SNAP: f64 = 1e-5;

impl Buffer {
    /// An empty one.
    ///
    /// * `capacity` - frames that may wait, at least 2.
    /// * `span` - the longest time between two frames across which a marker is interpolated, s.
    /// * `leap` - the greatest speed from one to the next at which it is, m/s: one that is faster jumped, or bears
    ///   another's name, and was nowhere in between. It is where the nearer frame sees it, for others to judge.
    pub fn new(capacity: usize, span: f64, leap: f64) -> Self {
        Self {
            frames: VecDeque::new(),
            capacity: capacity.max(2),
            span,
            leap,
            past: f64::NEG_INFINITY,
            last: Vec::new(),
            counts: Counts::default(),
        }
    }

    /// Puts a frame in its place.
    pub fn insert(&mut self, frame: Sample) -> Verdict {
        self.counts.received += 1;
        let after = (self.frames).partition_point(|other| other.sequence < frame.sequence);
        let before = after.checked_sub(1).map(|i| &self.frames[i]);
        let next = self.frames.get(after);
        if next.is_some_and(|next| next.sequence == frame.sequence) {
            self.counts.duplicate += 1;
            return Verdict::Duplicate;
        }
        // One whose time contradicts its place comes from a clock that went back; it is of no moment.
        let contradicts = before.is_some_and(|before| before.time >= frame.time)
            || next.is_some_and(|next| next.time <= frame.time);
        if frame.time <= self.past || contradicts {
            self.counts.late += 1;
            return Verdict::Late;
        }
        if self.frames.len() == self.capacity {
            self.counts.refused += 1;
            return Verdict::Full;
        }
        let last = after == self.frames.len();
        self.frames.insert(after, frame);
        if last {
            Verdict::Taken
        } else {
            self.counts.reordered += 1;
            Verdict::Reordered
        }
    }

    /// Markers at `time`, which never goes back: linear between the two frames around it that see the marker, if these
    /// are near enough and the later one is here already; else the marker is not seen. `None` where no frame is near.
    ///
    /// The sequence is that of the last frame at or before `time`, or else the first one's.
    pub fn at(&mut self, time: f64) -> Option<Sample> {
        self.past = time;
        let after = (self.frames).partition_point(|frame| frame.time <= time + SNAP);
        // All before the one at or before `time` is past.
        for i in 0..after {
            remember(&mut self.last, &self.frames[i]);
        }
        self.frames.drain(..after.saturating_sub(1));
        let before = (after > 0).then(|| &self.frames[0]);
        let next = self.frames.get(usize::from(after > 0));
        let frame = match (before, next) {
            (Some(frame), _) if time - frame.time <= SNAP => Sample {
                time,
                ..frame.clone()
            },
            (Some(a), Some(b)) if b.time - a.time <= self.span => Sample {
                sequence: a.sequence,
                time,
                positions: vec![Vector3::zeros(); a.positions.len()],
                seen: vec![false; a.seen.len()],
            },
            _ => return None,
        };
        Some(self.bridge(frame))
    }

    /// Puts markers that a frame does not see between when they were seen before it and when they are seen after it.
    fn bridge(&self, mut frame: Sample) -> Sample {
        let later = self.frames.range(1.min(self.frames.len())..);
        for i in (0..frame.seen.len())
            .filter(|&i| !frame.seen[i])
            .collect::<Vec<_>>()
        {
            let a = self.last[i];
            let near = later
                .clone()
                .take_while(|next| next.time - a.0 <= self.span);
            if let Some(next) = near.into_iter().find(|next| next.seen[i]) {
                let b = (next.time, next.positions[i]);
                frame.positions[i] = between(a, b, frame.time, self.leap);
                frame.seen[i] = true;
            }
        }
        frame
    }

    /// The time of the last frame that waits, s.
    pub fn newest(&self) -> Option<f64> {
        self.frames.back().map(|frame| frame.time)
    }

    /// Frames that wait.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// How many frames came to what end.
    pub fn counts(&self) -> Counts {
        self.counts
    }
}

fn remember(last: &mut Vec<(f64, Vector3<f64>)>, frame: &Sample) {
    last.resize(frame.seen.len(), (f64::NEG_INFINITY, Vector3::zeros()));
    let seen = frame.positions.iter().zip(&frame.seen);
    for (last, (place, seen)) in last.iter_mut().zip(seen) {
        if *seen {
            *last = (frame.time, *place);
        }
    }
}

fn between(
    (before, a): (f64, Vector3<f64>),
    (after, b): (f64, Vector3<f64>),
    time: f64,
    leap: f64,
) -> Vector3<f64> {
    let share = (time - before) / (after - before);
    match (b - a).norm() <= leap * (after - before) {
        true => a.lerp(&b, share),
        false if share < 0.5 => a,
        false => b,
    }
}
