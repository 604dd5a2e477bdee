//! Motion on its way to a session.

use std::{
    fmt,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use bytes::Bytes;
use futures::{Stream, StreamExt as _, stream};
use nalgebra::Vector3;
use sinew_bridges::OCCLUDED;
use sinew_formats::take::Take;
use sinew_proto::v1::{
    Accepted, Ack, Hello, MotionFrame, Ping, Precision, Reals, StreamMotionRequest,
    StreamMotionResponse, stream_motion_request, stream_motion_response,
};
use tokio::time::{Instant, sleep_until};
use tonic::Streaming;

use crate::{ClientError, grid::flatten};

/// A stream of motion that a session has accepted; made by [`crate::Client::stream_motion`].
#[derive(Debug)]
pub struct MotionStream {
    accepted: Accepted,
    answers: Streaming<StreamMotionResponse>,
    pinger: Option<Pinger>,
    throttled: u64,
}

/// A source's clock: the capture time of what is seen now.
#[derive(Clone, Copy, Debug)]
pub struct CaptureClock {
    start: Instant,
    first: f64,
}

impl CaptureClock {
    /// One that shows `seconds` now.
    pub fn showing(seconds: f64) -> Self {
        Self {
            start: Instant::now(),
            first: seconds,
        }
    }

    /// What it shows, s.
    pub fn now(&self) -> f64 {
        self.first + self.start.elapsed().as_secs_f64()
    }

    async fn reached(&self, seconds: f64) {
        // A span that is none (a clock going back) does not wait: the server says what is wrong with it.
        let wait = Duration::try_from_secs_f64(seconds - self.first).unwrap_or_default();
        sleep_until(self.start + wait).await;
    }
}

/// Pings: quick ones first, so that the session knows the clock early.
const QUICK: u32 = 10;
const QUICK_PERIOD: Duration = Duration::from_millis(10);
const PERIOD: Duration = Duration::from_millis(100);

/// Asks for the session's clock. The half that sends and the one that hears share it.
#[derive(Clone)]
pub(crate) struct Pinger {
    /// What the source's clock shows now, s.
    now: Arc<dyn Fn() -> f64 + Send + Sync>,
    /// When the last ping's answer came, s.
    returned: Arc<Mutex<Option<f64>>>,
}

impl fmt::Debug for Pinger {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "Pinger({} s)", (self.now)())
    }
}

impl Pinger {
    pub(crate) fn new(now: impl Fn() -> f64 + Send + Sync + 'static) -> Self {
        Self {
            now: Arc::new(now),
            returned: Arc::default(),
        }
    }

    fn answered(&self) {
        let mut returned = self.returned.lock().unwrap_or_else(PoisonError::into_inner);
        *returned = Some((self.now)());
    }

    fn ping(&self) -> Ping {
        let mut returned = self.returned.lock().unwrap_or_else(PoisonError::into_inner);
        Ping {
            returned_seconds: returned.take(),
            sent_seconds: (self.now)(),
        }
    }

    /// The frames, and pings between them as long as frames come.
    pub(crate) fn between(
        self,
        frames: impl Stream<Item = MotionFrame> + Send + 'static,
    ) -> impl Stream<Item = stream_motion_request::Item> + Send + 'static {
        let state = (Box::pin(frames), self, Instant::now(), 0);
        stream::unfold(state, async |(mut frames, pinger, next, pings)| {
            tokio::select! {
                biased;
                () = sleep_until(next) => {
                    let period = if pings < QUICK { QUICK_PERIOD } else { PERIOD };
                    let ping = stream_motion_request::Item::Ping(pinger.ping());
                    Some((ping, (frames, pinger, Instant::now() + period, pings.saturating_add(1))))
                }
                frame = frames.next() => {
                    let frame = stream_motion_request::Item::Frame(frame?);
                    Some((frame, (frames, pinger, next, pings)))
                }
            }
        })
    }
}

impl MotionStream {
    pub(crate) async fn open(
        mut answers: Streaming<StreamMotionResponse>,
        pinger: Option<Pinger>,
    ) -> Result<Self, ClientError> {
        match answers.message().await?.and_then(|answer| answer.item) {
            Some(stream_motion_response::Item::Accepted(accepted)) => Ok(Self {
                accepted,
                answers,
                pinger,
                throttled: 0,
            }),
            Some(
                stream_motion_response::Item::Ack(_)
                | stream_motion_response::Item::Pong(_)
                | stream_motion_response::Item::Throttle(_),
            )
            | None => Err(ClientError::Protocol(
                "the first answer to a stream of motion was not Accepted".to_owned(),
            )),
        }
    }

    /// What the session answered to the Hello.
    pub fn accepted(&self) -> Accepted {
        self.accepted
    }

    /// The next acknowledgement; `None` when all frames are sent and acknowledged. Must be called until then: a
    /// stream whose answers nobody reads stands still.
    ///
    /// # Errors
    /// The server's refusal of a frame, or the end of the session.
    pub async fn ack(&mut self) -> Result<Option<Ack>, ClientError> {
        while let Some(answer) = self.answers.message().await? {
            match answer.item {
                Some(stream_motion_response::Item::Ack(ack)) => return Ok(Some(ack)),
                Some(stream_motion_response::Item::Pong(_)) => {
                    self.pinger.iter().for_each(Pinger::answered);
                }
                Some(stream_motion_response::Item::Throttle(_)) => self.throttled += 1,
                Some(stream_motion_response::Item::Accepted(_)) | None => {
                    let problem = "a frame was answered by something else than Ack";
                    return Err(ClientError::Protocol(problem.into()));
                }
            }
        }
        Ok(None)
    }

    /// How often the session said so far that it has no room.
    pub fn throttled(&self) -> u64 {
        self.throttled
    }
}

/// Hello, then the items.
pub(crate) fn requests(
    hello: Hello,
    items: impl Stream<Item = stream_motion_request::Item> + Send + 'static,
) -> impl Stream<Item = StreamMotionRequest> + Send + 'static {
    let first = stream::iter([stream_motion_request::Item::Hello(hello)]);
    first
        .chain(items)
        .map(|item| StreamMotionRequest { item: Some(item) })
}

/// One moment of the motion. A point that is not visible, or whose position is not finite, is flagged occluded and its
/// numbers are 0: nothing that is no position ever travels as one.
///
/// * `positions`, `visible` - one per point.
pub fn motion_frame(
    sequence: u64,
    capture_time_seconds: f64,
    positions: &[Vector3<f64>],
    visible: &[bool],
) -> MotionFrame {
    let flags: Vec<u8> = visible.iter().map(|visible| u8::from(!visible)).collect();
    flagged_frame(sequence, capture_time_seconds, positions, &flags)
}

/// [`motion_frame`] of points with all that is known of them.
///
/// * `positions`, `flags` - one per point; flags as in [`MotionFrame`].
pub(crate) fn flagged_frame(
    sequence: u64,
    capture_time_seconds: f64,
    positions: &[Vector3<f64>],
    flags: &[u8],
) -> MotionFrame {
    let place = |(position, flags): (&Vector3<f64>, &u8)| {
        let seen = flags & OCCLUDED == 0 && position.iter().all(|x| x.is_finite());
        match seen {
            true => (*position, *flags),
            false => (Vector3::zeros(), flags | OCCLUDED),
        }
    };
    let (positions, flags): (Vec<_>, Vec<u8>) = positions.iter().zip(flags).map(place).unzip();
    MotionFrame {
        sequence,
        capture_time_seconds,
        positions: Some(Reals::pack(&flatten(&positions), Precision::F64)),
        flags: match flags.iter().all(|flags| *flags == 0) {
            true => Bytes::new(),
            false => flags.into(),
        },
        source_sequence: None,
        drags: Vec::new(),
    }
}

/// The first `count` frames of a take, numbered from 1. A take shorter than that ends early.
pub fn take_frames(take: Arc<Take>, count: usize) -> impl Stream<Item = MotionFrame> + Send {
    stream::iter(
        (1..)
            .zip(0..take.frames().min(count))
            .map(move |(sequence, index)| {
                let (positions, visible) = take.frame(index);
                #[expect(
                    clippy::cast_precision_loss,
                    reason = "a take has far fewer than 2^53 frames"
                )]
                let time = take.first_time_seconds() + index as f64 / take.rate_hz();
                motion_frame(sequence, time, positions, visible)
            }),
    )
}

/// Holds each frame back until its capture time, counted from the first frame's. The schedule is absolute: a frame that
/// is late shifts no other, so that no drift adds up.
pub fn paced(
    frames: impl Stream<Item = MotionFrame> + Send,
) -> impl Stream<Item = MotionFrame> + Send {
    let mut start = None;
    frames.then(move |frame| {
        let time = frame.capture_time_seconds;
        let clock = *start.get_or_insert_with(|| CaptureClock::showing(time));
        async move {
            clock.reached(time).await;
            frame
        }
    })
}

/// Holds each frame back until this clock shows its capture time.
pub fn paced_by(
    clock: CaptureClock,
    frames: impl Stream<Item = MotionFrame> + Send,
) -> impl Stream<Item = MotionFrame> + Send {
    frames.then(move |frame| async move {
        clock.reached(frame.capture_time_seconds).await;
        frame
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(times: &'static [f64]) -> impl Stream<Item = MotionFrame> + Send {
        stream::iter(times.iter().zip(1..).map(|(time, sequence)| MotionFrame {
            sequence,
            capture_time_seconds: *time,
            ..MotionFrame::default()
        }))
    }

    #[tokio::test(start_paused = true)]
    async fn frames_leave_at_their_capture_times() {
        let start = Instant::now();
        let left: Vec<f64> = paced(frames(&[10.0, 10.25, 10.25, 11.0]))
            .map(|_| start.elapsed().as_secs_f64())
            .collect()
            .await;
        for (left, due) in left.iter().zip([0.0, 0.25, 0.25, 1.0]) {
            assert!((left - due).abs() < 2e-3, "left at {left}, due at {due}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_late_frame_shifts_no_other() {
        let start = Instant::now();
        let mut paced = std::pin::pin!(paced(frames(&[0.0, 0.1, 0.2, 0.3])));
        paced.next().await;
        tokio::time::advance(Duration::from_millis(250)).await;
        paced.next().await;
        paced.next().await;
        assert!((start.elapsed().as_secs_f64() - 0.25).abs() < 2e-3);
        paced.next().await;
        assert!((start.elapsed().as_secs_f64() - 0.3).abs() < 2e-3);
    }

    #[tokio::test(start_paused = true)]
    async fn a_clock_that_goes_back_does_not_hang_or_panic() {
        let start = Instant::now();
        assert_eq!(paced(frames(&[5.0, 1.0, f64::NAN])).count().await, 3);
        assert!(start.elapsed() < Duration::from_millis(10));
    }

    #[test]
    fn what_is_no_position_travels_as_occluded() {
        let positions = [
            Vector3::new(1.0, 2.0, 3.0),
            Vector3::new(f64::NAN, 0.0, 0.0),
            Vector3::new(4.0, 5.0, 6.0),
        ];
        let frame = motion_frame(3, 0.5, &positions, &[true, true, false]);
        assert_eq!(&frame.flags[..], [0, OCCLUDED, OCCLUDED]);
        assert_eq!(
            frame.positions.unwrap().unpack().unwrap(),
            [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        );
    }

    #[test]
    fn a_frame_seen_whole_has_no_flags() {
        let frame = motion_frame(1, 0.0, &[Vector3::zeros()], &[true]);
        assert!(frame.flags.is_empty());
    }
}
