//! One run of a scene: post it, stream its take, receive the mesh, measure.

use std::{sync::Arc, time::Instant};

use futures::{StreamExt as _, future::Either};
use sinew_client::{
    Client, ClientError, Counts, SceneFile, Subscription, Update, paced, take_frames,
};
use sinew_formats::take::Take;
use sinew_proto::v1::{self, TopologyPatch};

use crate::{
    Failure,
    latency::{Latencies, SendTimes, now},
    progress::Progress,
    table::{Table, count},
    watch::ended,
};

/// Tears named in the report.
const TEARS: usize = 3;
/// Simulated time of a run that nobody limits and no take ends, s.
const DEFAULT_SECONDS: f64 = 10.0;

/// How fast a run goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Speed {
    /// The take's own rate, or the scene's pace.
    AsCaptured,
    /// As fast as the machine can.
    Unpaced,
}

/// A scene that is posted and waits for its run.
pub(crate) struct Posted {
    pub(crate) session: v1::Session,
    take: Option<Arc<Take>>,
    speed: Speed,
    total: u64,
    subscription: Subscription,
}

/// What a run measured.
pub(crate) struct Report {
    sent: Option<u64>,
    steps: u64,
    received: u64,
    dropped: u64,
    /// `None` where it was to be as fast as could be.
    asked_hz: Option<f64>,
    held_hz: f64,
    tears: Vec<Tear>,
    latencies: Latencies,
}

/// The mesh came apart.
struct Tear {
    /// Simulated time, s.
    at: f64,
    faces: u32,
}

/// Creates the session, paused, and subscribes, so that no frame is missed.
///
/// * `frames` - at most so many; without it the whole take, or ten seconds where there is none.
pub(crate) async fn post(
    client: &Client,
    file: SceneFile,
    id: &str,
    frames: Option<u64>,
    speed: Speed,
) -> Result<Posted, ClientError> {
    let mut scene = file.scene_for(client).await?;
    if speed == Speed::Unpaced {
        scene.set_pace(v1::Pace::Unpaced);
    }
    let request = v1::CreateSessionRequest {
        session_id: id.to_owned(),
        scene: Some(scene),
        ..v1::CreateSessionRequest::default()
    };
    let session = client.create_session(request).await?;
    let whole = match &file.take {
        Some(take) => take.frames() as u64,
        None => steps_in(DEFAULT_SECONDS, session.time_step_seconds),
    };
    let total = match (&file.take, frames) {
        (Some(_), Some(frames)) => frames.min(whole),
        (None, Some(frames)) => frames,
        (_, None) => whole,
    };
    let subscription = client
        .subscribe(v1::SubscribeRequest {
            session: session.name.clone(),
            ..v1::SubscribeRequest::default()
        })
        .await?;
    Ok(Posted {
        session,
        take: file.take.map(Arc::new),
        speed,
        total,
        subscription,
    })
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` saturates, and a time step is > 0"
)]
fn steps_in(seconds: f64, time_step: f64) -> u64 {
    ((seconds / time_step).round() as u64).max(1)
}

impl Posted {
    /// Frames, or steps, of the run to come.
    pub(crate) fn total(&self) -> u64 {
        self.total
    }

    /// Frames per second that the run is to hold, where it is not to be as fast as can be.
    pub(crate) fn rate_hz(&self) -> f64 {
        match &self.take {
            Some(take) => take.rate_hz(),
            None => 1.0 / self.session.time_step_seconds,
        }
    }

    /// Runs to the end of the motion and returns what was measured. The session is left paused, or faulted.
    pub(crate) async fn run(mut self, client: &Client) -> Result<Report, Failure> {
        let sent = SendTimes::new(match self.take {
            Some(_) => usize::try_from(self.total)?,
            None => 0,
        });
        let mut arrivals = Arrivals::default();
        // The keyframe of the state at rest: from now on this reader is in time.
        arrivals.next(&mut self.subscription, &sent).await?;
        client.run(&self.session.name).await?;

        let sending = match self.take.clone() {
            Some(take) => Either::Left(self.send(client, take, sent.clone())),
            None => Either::Right(std::future::ready(Ok(()))),
        };
        let receiving = async {
            let mut progress = Progress::new(self.total);
            while arrivals.done < self.total {
                arrivals.next(&mut self.subscription, &sent).await?;
                progress.update(arrivals.done, || arrivals.note(self.subscription.counts()));
            }
            Ok(())
        };
        tokio::try_join!(sending, receiving)?;

        let session = client.session(&self.session.name).await?;
        if let Some(fault) = session.fault {
            return Err(format!(
                "{} ended: {} [{}]",
                session.name, fault.message, fault.reason
            )
            .into());
        }
        client.pause(&self.session.name).await?;
        let counts = self.subscription.counts();
        Ok(Report {
            sent: self.take.is_some().then_some(self.total),
            steps: arrivals.step,
            received: arrivals.received,
            dropped: counts.missed + counts.unfit,
            asked_hz: match self.speed {
                Speed::AsCaptured => Some(self.rate_hz()),
                Speed::Unpaced => None,
            },
            held_hz: arrivals.rate().unwrap_or(0.0),
            tears: arrivals.tears,
            latencies: arrivals.latencies,
        })
    }

    /// Streams the take and reads the acknowledgements to the end.
    fn send(
        &self,
        client: &Client,
        take: Arc<Take>,
        sent: SendTimes,
    ) -> impl Future<Output = Result<(), Failure>> + use<> {
        let hello = v1::Hello {
            session: self.session.name.clone(),
            source: "sinew".to_owned(),
            labels: take.labels().to_vec(),
            rate_hz: take.rate_hz(),
            ..v1::Hello::default()
        };
        let frames = take_frames(take, usize::try_from(self.total).unwrap_or(usize::MAX));
        let frames = match self.speed {
            Speed::AsCaptured => Either::Left(paced(frames)),
            Speed::Unpaced => Either::Right(frames),
        };
        let frames = frames.inspect(move |frame| sent.note(frame.sequence));
        let (client, total) = (client.clone(), self.total);
        async move {
            let mut stream = client.stream_motion(hello, frames).await?;
            let mut acknowledged = 0;
            while let Some(ack) = stream.ack().await? {
                acknowledged = ack.sequence;
            }
            all_acknowledged(acknowledged, total)
        }
    }
}

/// Refuses an end of acknowledgements before the last frame's.
pub(crate) fn all_acknowledged(acknowledged: u64, total: u64) -> Result<(), Failure> {
    if acknowledged < total {
        let (acknowledged, total) = (count(acknowledged), count(total));
        return Err(format!(
            "only {acknowledged} of {total} frames were acknowledged; see the server's log"
        )
        .into());
    }
    Ok(())
}

/// What came over the subscription.
#[derive(Default)]
struct Arrivals {
    /// Frames of the motion, or steps, whose mesh is here.
    done: u64,
    step: u64,
    sequence: u64,
    /// Frames after the state at rest.
    received: u64,
    first: Option<(u64, Instant)>,
    last: Option<(u64, Instant)>,
    tears: Vec<Tear>,
    latencies: Latencies,
}

impl Arrivals {
    async fn next(
        &mut self,
        subscription: &mut Subscription,
        sent: &SendTimes,
    ) -> Result<(), Failure> {
        let frame = match subscription.next().await? {
            Some(Update::Frame(frame)) => frame,
            Some(Update::Keyframe(keyframe)) => keyframe.frame.unwrap_or_default(),
            Some(Update::Patch(TopologyPatch {
                frame: Some(frame), ..
            })) if frame.vertices.is_some() => frame,
            Some(Update::Events(events)) => {
                self.tears.extend(events.iter().filter_map(tear));
                return Ok(());
            }
            Some(Update::Patch(_)) => return Ok(()),
            Some(Update::Goodbye(goodbye)) => {
                return Err(format!("{} before the run was over", ended(goodbye.reason())).into());
            }
            None => return Err("the stream of frames ended before the run was over".into()),
        };
        let arrived = now();
        // A keyframe that comes again holds nothing new.
        if frame.sequence > self.sequence {
            self.sequence = frame.sequence;
            self.done = frame.motion_sequence.unwrap_or(frame.step);
            self.step = frame.step;
            if frame.step > 0 {
                self.received += 1;
                self.latencies.record(&frame, sent, arrived);
                let here = (frame.step, Instant::now());
                self.first.get_or_insert(here);
                self.last = Some(here);
            }
        }
        Ok(())
    }

    /// Steps per second between the first frame and the last one.
    fn rate(&self) -> Option<f64> {
        let (first, last) = (self.first?, self.last?);
        let seconds = last.1.duration_since(first.1).as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 steps")]
        let steps = (last.0 - first.0) as f64;
        (seconds > 0.0).then(|| steps / seconds)
    }

    fn note(&self, counts: Counts) -> String {
        format!(
            "{:.1} Hz, {} missed",
            self.rate().unwrap_or(0.0),
            counts.missed
        )
    }
}

impl Report {
    /// The table that ends a run.
    pub(crate) fn table(&self) -> Table {
        let mut table = Table::of_numbers();
        table.row(["frames"]);
        if let Some(sent) = self.sent {
            table.row(["  sent", &count(sent)]);
        }
        table.row(["  stepped", &count(self.steps)]);
        table.row(["  received", &count(self.received)]);
        table.row(["  dropped", &count(self.dropped)]);
        table.row(["rate"]);
        if let Some(asked) = self.asked_hz {
            table.row(["  asked", &format!("{asked:.1} Hz")]);
        }
        table.row(["  held", &format!("{:.1} Hz", self.held_hz)]);
        if !self.tears.is_empty() {
            table.row(["tears", &count(self.tears.len() as u64)]);
        }
        for Tear { at, faces } in self.tears.iter().take(TEARS) {
            table.row([&*format!("  at {at:.2} s"), &format!("{faces} faces")]);
        }
        table.row(["latency", "p50", "p99"]);
        self.latencies.rows(&mut table);
        table
    }
}

fn tear(event: &v1::Event) -> Option<Tear> {
    match event.kind {
        Some(v1::event::Kind::Torn(torn)) => Some(Tear {
            at: event.time_seconds,
            faces: torn.faces,
        }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_says_what_was_sent_received_and_dropped() {
        let mut report = Report {
            sent: Some(1064),
            steps: 1064,
            received: 1060,
            dropped: 4,
            asked_hz: Some(120.0),
            held_hz: 119.96,
            tears: Vec::new(),
            latencies: Latencies::default(),
        };
        assert_eq!(
            report.table().to_string(),
            "frames\n  sent         1,064\n  stepped      1,064\n  received     1,060\n  dropped          4\n\
             rate\n  asked     120.0 Hz\n  held      120.0 Hz\nlatency          p50  p99\n"
        );
        (report.sent, report.asked_hz) = (None, None);
        let text = report.table().to_string();
        assert!(!text.contains("sent") && !text.contains("asked"), "{text}");
        assert!(!text.contains("tears"), "{text}");
        let torn = |at| Tear { at, faces: 107 };
        report.tears = vec![torn(3.308), torn(4.0), torn(5.0), torn(6.0)];
        let text = report.table().to_string();
        let words: Vec<&str> = text.split_whitespace().collect();
        let told = ["tears", "4", "at", "3.31", "s", "107", "faces"];
        assert!(
            words.windows(told.len()).any(|seven| seven == told),
            "{text}"
        );
        assert!(
            text.contains("5.00 s") && !text.contains("6.00 s"),
            "{text}"
        );
    }

    #[test]
    fn a_run_without_a_take_lasts_ten_simulated_seconds() {
        assert_eq!(steps_in(DEFAULT_SECONDS, 1.0 / 120.0), 1200);
        assert_eq!(steps_in(DEFAULT_SECONDS, 1e9), 1);
    }

    #[test]
    fn frames_without_acknowledgement_are_a_failure() {
        assert!(all_acknowledged(10, 10).is_ok());
        let error = all_acknowledged(9, 10).unwrap_err();
        assert!(error.to_string().contains("only 9 of 10"), "{error}");
    }
}
