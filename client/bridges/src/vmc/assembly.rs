//! Frames of the packets that come.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use super::{message::Said, skeleton};
use crate::Frame;

/// Frames without anything new until the layout is taken to be known.
const SETTLED: u32 = 3;
/// From here on the sender's clock, a binary32, ticks in steps of a millisecond, s.
const COARSE: f64 = 8192.0;
/// A clock that goes back by more was started again, s.
const RESTART: f64 = 1.0;
/// A pause of so many periods ends a frame, whatever is missing of it.
const PAUSE: f64 = 0.5;
/// Points of a sender; more are passed over.
const MOST: usize = 1024;
/// How much of a new period goes into the estimate.
const GAIN: f64 = 0.1;

/// Puts frames together. VMC marks no frame's end, so that a frame ends when all of its points are here, when one of
/// them comes again, when nothing comes for half a period, or when the point comes that follows most such pauses:
/// whichever is first.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    labels: Vec<String>,
    index: BTreeMap<String, usize>,
    parents: Vec<Option<usize>>,
    poses: Vec<Option<Isometry3<f64>>>,
    here: usize,
    /// How often each label came first after a pause, and whether there was one just now.
    starts: Vec<u64>,
    paused: bool,
    /// The layout that was told.
    told: Option<Timing>,
    settled: u32,
    tracking: bool,
    /// The sender's clock, and when it was told, s.
    clock: Option<(f64, f64)>,
    /// What the frame before was told to be captured at, s.
    last: f64,
    /// When the last packet came, s.
    heard: f64,
    /// When the frame began, s, and what the sender's clock was known to show then.
    begun: Option<f64>,
    shown: Option<(f64, f64)>,
    /// Between frames, s.
    period: Option<f64>,
}

/// By what frames are timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Timing {
    /// Their arrival.
    Arrival,
    /// The sender's clock.
    Sender,
}

/// What became of a packet.
#[derive(Debug, PartialEq)]
pub(super) enum Assembled {
    /// Frames from now on have these points.
    Layout(Vec<String>, Timing),
    Frame(Frame),
}

impl Assembly {
    pub(super) fn new() -> Self {
        Self {
            tracking: true,
            ..Self::default()
        }
    }

    /// Takes in what a packet said.
    ///
    /// * `now` - when it came, s.
    pub(super) fn take(&mut self, said: Vec<Said>, now: f64) -> Vec<Assembled> {
        let mut out = Vec::new();
        let pause = self.period.map_or(f64::INFINITY, |period| PAUSE * period);
        self.paused |= now - self.heard > pause;
        if self.here > 0 && self.paused {
            self.finish(&mut out);
        }
        self.heard = now;
        for said in said {
            match said {
                Said::Tracking(tracking) => self.tracking = tracking,
                Said::Time(time) => self.time(time, now),
                Said::Pose { label, pose } => self.pose(label, pose, now, &mut out),
            }
        }
        out
    }

    fn time(&mut self, time: f64, now: f64) {
        let back = self.clock.is_some_and(|(last, _)| time < last - RESTART);
        if back || self.told == Some(Timing::Sender) && time >= COARSE {
            self.forget();
        }
        self.clock = Some((time, now));
    }

    /// The layout is to be told again.
    fn forget(&mut self) {
        self.told = None;
        self.settled = 0;
        self.last = f64::NEG_INFINITY;
    }

    fn pose(&mut self, label: String, pose: Isometry3<f64>, now: f64, out: &mut Vec<Assembled>) {
        let index = match self.index.get(&label) {
            Some(index) => *index,
            None if self.labels.len() == MOST => return,
            None => {
                self.forget();
                self.labels.push(label.clone());
                self.poses.push(None);
                self.starts.push(0);
                self.parents = skeleton::parents(&self.labels);
                self.index.insert(label, self.labels.len() - 1);
                self.labels.len() - 1
            }
        };
        self.starts[index] += u64::from(std::mem::take(&mut self.paused));
        let most = self.starts.iter().max().copied().unwrap_or_default();
        let first = most > 0 && self.starts[index] == most;
        if self.poses[index].is_some() || self.here > 0 && first {
            self.finish(out);
        }
        if self.here == 0 {
            self.begin(now);
        }
        self.poses[index] = Some(pose);
        self.here += 1;
        if self.told.is_some() && self.here == self.labels.len() {
            self.finish(out);
        }
    }

    fn begin(&mut self, now: f64) {
        self.shown = self.clock;
        if let Some(before) = self.begun.replace(now) {
            let period = now - before;
            self.period = Some(match self.period {
                Some(known) => known + GAIN * (period.min(4.0 * known) - known),
                None => period,
            });
        }
    }

    /// Ends the frame under way.
    fn finish(&mut self, out: &mut Vec<Assembled>) {
        let count = self.labels.len();
        let poses = std::mem::replace(&mut self.poses, vec![None; count]);
        self.here = 0;
        if self.told.is_none() {
            self.settled += 1;
            if self.settled <= SETTLED {
                return;
            }
            let fine = |(time, _): (f64, f64)| time < COARSE;
            let timing = match self.clock.is_some_and(fine) {
                true => Timing::Sender,
                false => Timing::Arrival,
            };
            self.told = Some(timing);
            out.push(Assembled::Layout(self.labels.clone(), timing));
            return; // when it was captured is not sure yet
        }
        let time = self.moment();
        if time <= self.last {
            return; // no later than the one before: of no moment
        }
        self.last = time;
        let mut frame = Frame::unseen(time, count);
        if self.tracking {
            let world = skeleton::in_world(&self.parents, &poses);
            for (point, pose) in world.into_iter().enumerate() {
                if let Some(pose) = pose {
                    frame.see(point, pose.translation.vector, crate::SOLVED);
                }
            }
        }
        out.push(Assembled::Frame(frame));
    }

    /// When the frame under way was captured, s. A sender's clock may be told once a frame, before or after the poses,
    /// or more seldom: what it showed last is then as old as that is. That a clock told after the poses is a frame late
    /// is one more unknown offset, which shifts no frame beside another.
    fn moment(&self) -> f64 {
        let begun = self.begun.unwrap_or(self.heard);
        match (self.told, self.shown) {
            (Some(Timing::Sender), Some((time, _))) if time > self.last => time,
            (Some(Timing::Sender), Some((time, told))) => time + (begun - told),
            (Some(Timing::Sender | Timing::Arrival) | None, _) => begun,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn pose(label: &str, x: f64) -> Said {
        Said::Pose {
            label: label.to_owned(),
            pose: Isometry3::translation(x, 0.0, 0.0),
        }
    }

    /// Frames of what packets said, and how often a layout was told.
    fn frames(said: impl IntoIterator<Item = (f64, Vec<Said>)>) -> (Vec<Frame>, Vec<Vec<String>>) {
        let mut assembly = Assembly::new();
        let (mut frames, mut layouts) = (Vec::new(), Vec::new());
        for (now, said) in said {
            for assembled in assembly.take(said, now) {
                match assembled {
                    Assembled::Frame(frame) => frames.push(frame),
                    Assembled::Layout(labels, _) => layouts.push(labels),
                }
            }
        }
        (frames, layouts)
    }

    /// The root, hips and a tracker in packets of their own, frame `i` at 10 ms · i.
    fn packets(i: u32) -> Vec<(f64, Vec<Said>)> {
        let (x, now) = (f64::from(i), f64::from(i) * 0.01);
        vec![
            (now, vec![pose("root", x), pose("Hips", 0.5)]),
            (now + 0.001, vec![pose("a tracker", -x)]),
        ]
    }

    #[test]
    fn a_frame_is_told_as_soon_as_it_is_whole() {
        let mut assembly = Assembly::new();
        for (now, said) in (0..5).flat_map(packets) {
            assembly.take(said, now);
        }
        let [(first, head), (second, tail)] = packets(5).try_into().unwrap();
        assert_eq!(assembly.take(head, first), []);
        let out = assembly.take(tail, second);
        let [Assembled::Frame(frame)] = out.as_slice() else {
            panic!("{out:?}");
        };
        assert_eq!(frame.time, first);
        let xs: Vec<f64> = frame.positions.iter().map(|p| p.x).collect();
        assert_eq!(
            xs,
            [5.0, 5.5, -5.0],
            "bones hang on the root, trackers on nothing"
        );
        assert!(frame.flags.iter().all(|flags| *flags == crate::SOLVED));
    }

    #[test]
    fn what_is_lost_on_the_way_is_occluded_and_mixes_with_nothing() {
        let mut sent: Vec<_> = (0..20).flat_map(packets).collect();
        sent.remove(2 * 10); // the head of frame 10
        sent.remove(2 * 15); // the tail of frame 15, as one is gone before
        let (frames, layouts) = frames(sent);
        assert_eq!(layouts.len(), 1);
        for frame in &frames {
            let x = frame
                .positions
                .iter()
                .map(|p| p.x.abs().floor())
                .fold(0.0, f64::max);
            let of_one = |(p, flags): (&Vector3<f64>, &u8)| {
                *flags == crate::OCCLUDED || p.x.abs().floor() == x
            };
            assert!(
                frame.positions.iter().zip(&frame.flags).all(of_one),
                "{frame:?}"
            );
        }
        let occluded = |frame: &Frame| {
            frame
                .flags
                .iter()
                .filter(|f| **f == crate::OCCLUDED)
                .count()
        };
        assert_eq!(frames.iter().map(occluded).sum::<usize>(), 3);
    }

    #[test]
    fn a_machine_that_hesitates_within_a_frame_mixes_no_two() {
        let sent = (0..40).flat_map(|i| {
            let mut packets = packets(i);
            if i % 10 == 5 {
                packets[1].0 += 0.007;
            }
            packets
        });
        let (frames, _) = frames(sent);
        assert!(frames.len() > 35);
        for frame in frames {
            let seen = frame.flags[0] == crate::SOLVED && frame.flags[2] == crate::SOLVED;
            assert!(
                !seen || frame.positions[0].x == -frame.positions[2].x,
                "{frame:?}"
            );
        }
    }

    #[test]
    fn the_senders_clock_times_frames_whether_it_comes_first_or_last() {
        for clock_at in [0, 1] {
            let sent = (0..40).flat_map(|i| {
                let mut packets = packets(i);
                let jitter = f64::from(i % 3) * 0.002;
                packets.iter_mut().for_each(|(now, _)| *now += jitter);
                packets[clock_at]
                    .1
                    .push(Said::Time(100.0 + f64::from(i) / 64.0));
                packets
            });
            let (frames, _) = frames(sent);
            assert!(frames.len() > 30);
            for pair in frames.windows(2) {
                assert_eq!(pair[1].time - pair[0].time, 1.0 / 64.0, "{clock_at}");
            }
        }
    }

    #[test]
    fn a_sender_that_starts_again_or_grows_a_bone_has_a_new_layout() {
        let again = (0..10).flat_map(|i| {
            let time = if i < 5 { 50.0 } else { 0.0 } + f64::from(i);
            let mut packets = packets(i);
            packets[0].1.insert(0, Said::Time(time));
            packets
        });
        let (_, layouts) = frames(again.chain((10..20).flat_map(|i| {
            let mut packets = packets(i);
            packets[0].1.push(pose("Spine", 0.0));
            packets
        })));
        let counts: Vec<usize> = layouts.iter().map(Vec::len).collect();
        assert_eq!(counts, [3, 3, 4]);
    }

    #[test]
    fn what_is_not_tracked_is_not_seen() {
        let lost = (0..10).flat_map(|i| {
            let mut packets = packets(i);
            packets[0].1.insert(0, Said::Tracking(i < 8));
            packets
        });
        let (frames, _) = frames(lost);
        let seen: Vec<bool> = frames.iter().map(|f| f.flags[0] == crate::SOLVED).collect();
        assert_eq!(&seen[seen.len() - 3..], [true, false, false]);
    }
}
