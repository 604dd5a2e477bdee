//! A source's motion by its capture time: when each step is due, and what it is given.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sinew_engine::{Buffer, Clock, Delay, Exchange, MotionSample, Verdict};

use crate::inbox::{Arrival, Progress};

/// A session this far behind its steps skips to the present, s: longer than a machine hesitates, shorter than anyone
/// would wait for it to catch up.
const LAG: f64 = 0.25;
/// Time of frames that a buffer holds, s, and bounds of their number and bytes.
const SPAN: f64 = 1.0;
const FEWEST: usize = 64;
const MOST: usize = 1024;
const BYTES: usize = 64 << 20;
/// Periods between two frames across which points are interpolated: one frame may be lost.
const GAP: f64 = 2.5;
/// And time across which they are, s, where the frame after it is here: so long a limb's way is a line, but for millimetres.
const BRIDGE: f64 = 0.05;
/// A moment this close to a frame is the frame's, in steps: what sums of decimal fractions are off by.
const ROUNDING: f64 = 1e-6;

/// One stream of motion, played a little after it was captured. Pure: what time it is, is an argument, in seconds of
/// the session's clock.
#[derive(Debug)]
pub(crate) struct Live {
    clock: Clock,
    delay: Delay,
    buffer: Buffer,
    capacity: usize,
    points: usize,
    /// Of the source's frames, s.
    period: f64,
    time_step: f64,
    /// Capture time of the first step, s, and steps since, taken or skipped.
    first: Option<f64>,
    steps: u32,
    /// When the frames that are not yet used came, ns since the Unix epoch, by sequence.
    received: BTreeMap<u64, u64>,
    /// Sequence of the last frame used.
    used: u64,
    /// No frame follows.
    closed: bool,
}

impl Live {
    /// Before the first frame.
    ///
    /// * `points` - in each frame.
    /// * `period`, `time_step` - of the source's frames and of the session's steps, s, > 0.
    /// * `leap` - a point that goes faster from one frame to the next jumped, m/s.
    pub(crate) fn new(points: usize, period: f64, time_step: f64, leap: f64) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "`as` saturates, and the number is clamped"
        )]
        let wanted = ((SPAN / period).round() as usize).clamp(FEWEST, MOST);
        let capacity = wanted
            .min(BYTES / (points.max(1) * size_of::<Vector3<f64>>()))
            .max(8);
        Self {
            clock: Clock::default(),
            delay: Delay::default(),
            buffer: Buffer::new(capacity, BRIDGE.max(GAP * period), leap),
            capacity,
            points,
            period,
            time_step,
            first: None,
            steps: 0,
            received: BTreeMap::new(),
            used: 0,
            closed: false,
        }
    }

    /// Takes in a ping.
    pub(crate) fn ping(&mut self, exchange: Exchange) {
        self.clock.exchange(exchange);
    }

    /// Takes in a frame.
    pub(crate) fn frame(&mut self, arrival: Arrival) -> Verdict {
        let Arrival {
            sequence: _,
            sample,
            received,
            received_nanos,
        } = arrival;
        let (sequence, time) = (sample.sequence, sample.time);
        self.clock.frame(time, received);
        self.delay.observe(received - self.clock.to_ours(time));
        let verdict = self.buffer.insert(sample);
        if matches!(verdict, Verdict::Taken | Verdict::Reordered) {
            self.first.get_or_insert(time);
            self.received.insert(sequence, received_nanos);
        }
        verdict
    }

    /// No frame follows.
    pub(crate) fn close(&mut self) {
        self.closed = true;
    }

    /// Whether the last moment was played.
    pub(crate) fn is_over(&self) -> bool {
        self.closed && self.due().is_none()
    }

    /// When the next step is due; `None` before the first frame and after the last one.
    pub(crate) fn due(&self) -> Option<f64> {
        let moment = self.moment()?;
        let newest = self.buffer.newest().unwrap_or(f64::NEG_INFINITY);
        let over = self.closed && self.steps_to(moment, newest) < 1.0;
        (!over).then(|| self.clock.to_ours(moment) + self.wait())
    }

    /// How many steps have their moments in the frames that are here.
    pub(crate) fn waiting(&self) -> usize {
        let (Some(moment), Some(newest)) = (self.moment(), self.buffer.newest()) else {
            return 0;
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "`as` saturates, and brings what is negative to 0"
        )]
        let steps = self.steps_to(moment, newest) as usize;
        steps
    }

    /// What the next step is given. Points are not seen where no frame came in time.
    ///
    /// * `now` - where steps go by the clock: those long overdue are then skipped.
    pub(crate) fn take(&mut self, now: Option<f64>) -> Option<Arrival> {
        let behind = now.zip(self.due()).map_or(0.0, |(now, due)| now - due);
        if behind > LAG {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "`as` saturates, and time goes on"
            )]
            let skipped = (behind / self.time_step) as u32;
            self.steps = self.steps.saturating_add(skipped);
        }
        let time = self.moment()?;
        self.steps = self.steps.saturating_add(1);
        let sample = self.buffer.at(time).unwrap_or_else(|| MotionSample {
            sequence: self.used,
            time,
            positions: vec![Vector3::zeros(); self.points],
            seen: vec![false; self.points],
        });
        self.used = sample.sequence;
        self.received = self.received.split_off(&self.used);
        Some(Arrival {
            sequence: self.used,
            received: now.unwrap_or_default(),
            received_nanos: self.received.get(&self.used).copied().unwrap_or_default(),
            sample,
        })
    }

    /// Says how it goes.
    pub(crate) fn report(&self, progress: &mut Progress) {
        let counts = self.buffer.counts();
        let now = self.moment().unwrap_or_default();
        progress.used = self.used;
        progress.reordered = counts.reordered;
        progress.late = counts.late;
        progress.refused = counts.refused;
        progress.delay = self.wait();
        progress.offset = self.clock.to_ours(now) - now;
        progress.skew = self.clock.skew();
    }

    /// Capture time of the next step, s.
    fn moment(&self) -> Option<f64> {
        let first = self.first?;
        Some(first + f64::from(self.steps) * self.time_step)
    }

    /// How many steps have their moments from `moment` to `newest`, beside a fraction.
    fn steps_to(&self, moment: f64, newest: f64) -> f64 {
        (newest - moment) / self.time_step + 1.0 + ROUNDING
    }

    /// How long after its capture a moment is played, s. The frame after it must be here too, and half of the buffer is
    /// room for a source that is ahead.
    fn wait(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "at most 1024 frames")]
        let most = 0.5 * self.capacity as f64 * self.period;
        self.delay.seconds().min(most) + self.period
    }
}
