//! Motion on its way to a session.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use futures::{Stream, StreamExt as _, stream};
use nalgebra::Vector3;
use sinew_formats::take::Take;
use sinew_proto::v1::{
    Accepted, Ack, Hello, MotionFrame, Precision, Reals, StreamMotionRequest, StreamMotionResponse,
    stream_motion_request, stream_motion_response,
};
use tokio::time::{Instant, sleep_until};
use tonic::Streaming;

use crate::{ClientError, grid::flatten};

/// Bit 0 of a point's flags.
const OCCLUDED: u8 = 1;

/// A stream of motion that a session has accepted; made by [`crate::Client::stream_motion`].
#[derive(Debug)]
pub struct MotionStream {
    accepted: Accepted,
    answers: Streaming<StreamMotionResponse>,
}

impl MotionStream {
    pub(crate) async fn open(
        mut answers: Streaming<StreamMotionResponse>,
    ) -> Result<Self, ClientError> {
        match answers.message().await?.and_then(|answer| answer.item) {
            Some(stream_motion_response::Item::Accepted(accepted)) => {
                Ok(Self { accepted, answers })
            }
            Some(stream_motion_response::Item::Ack(_)) | None => Err(ClientError::Protocol(
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
        match self.answers.message().await? {
            None => Ok(None),
            Some(answer) => match answer.item {
                Some(stream_motion_response::Item::Ack(ack)) => Ok(Some(ack)),
                Some(stream_motion_response::Item::Accepted(_)) | None => Err(
                    ClientError::Protocol("a frame was answered by something else than Ack".into()),
                ),
            },
        }
    }
}

/// Hello, then the frames.
pub(crate) fn requests(
    hello: Hello,
    frames: impl Stream<Item = MotionFrame> + Send + 'static,
) -> impl Stream<Item = StreamMotionRequest> + Send + 'static {
    let first = stream::iter([stream_motion_request::Item::Hello(hello)]);
    first
        .chain(frames.map(stream_motion_request::Item::Frame))
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
    let seen = |(position, visible): (&Vector3<f64>, &bool)| {
        *visible && position.iter().all(|x| x.is_finite())
    };
    let seen: Vec<bool> = positions.iter().zip(visible).map(seen).collect();
    let positions: Vec<_> = positions
        .iter()
        .zip(&seen)
        .map(|(position, seen)| if *seen { *position } else { Vector3::zeros() })
        .collect();
    let flags = if seen.iter().all(|seen| *seen) {
        Bytes::new()
    } else {
        seen.iter()
            .map(|seen| if *seen { 0 } else { OCCLUDED })
            .collect()
    };
    MotionFrame {
        sequence,
        capture_time_seconds,
        positions: Some(Reals::pack(&flatten(&positions), Precision::F64)),
        flags,
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
        let (instant, first) = *start.get_or_insert_with(|| (Instant::now(), time));
        async move {
            // A span that is none (a clock going back) does not wait: the server says what is wrong with it.
            let wait = Duration::try_from_secs_f64(time - first).unwrap_or_default();
            sleep_until(instant + wait).await;
            frame
        }
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
