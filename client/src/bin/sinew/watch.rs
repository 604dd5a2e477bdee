//! `sinew watch`: what a session does, second by second.

use std::time::{Duration, Instant};

use clap::Args;
use sinew_client::{Counts, Update};
use sinew_proto::v1;

use crate::out::say;
use crate::{
    Failure,
    connection::{Connection, session_name},
    events,
    latency::{Latencies, SendTimes, milliseconds, now},
};

/// Watches a session and prints a line each second: step, rate, latency from publishing to arrival (true where both
/// clocks are one), frames missed; and a line for each event.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew watch demo                    until the session ends or Ctrl-C
  sinew watch demo --frames 600       ends after 600 frames
  sinew watch demo --events           events alone")]
pub(crate) struct Arguments {
    /// The session.
    #[arg(value_name = "SESSION")]
    session: String,
    /// End after so many frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Events alone, without frames.
    #[arg(long, conflicts_with = "frames")]
    events: bool,
    #[command(flatten)]
    connection: Connection,
}

pub(crate) async fn watch(arguments: Arguments) -> Result<(), Failure> {
    let client = arguments.connection.open().await?;
    let request = v1::SubscribeRequest {
        session: session_name(&arguments.session),
        ..v1::SubscribeRequest::default()
    };
    let mode = if arguments.events {
        v1::WatchMode::EventsOnly
    } else {
        v1::WatchMode::Latest
    };
    let mut session = client.watch(request, mode).await?;
    let limit = arguments.frames.unwrap_or(u64::MAX);
    let mut ticks = tokio::time::interval(Duration::from_secs(1));
    let mut second = Second::default();
    let mut frame = None;
    while session.subscription().counts().received < limit {
        tokio::select! {
            update = session.next() => match update? {
                Some(Update::Events(events)) => {
                    for event in &events {
                        say!("{}", events::line(event));
                    }
                }
                Some(Update::Patch(patch)) => frame = patch.frame.or(frame),
                Some(Update::Frame(next)) => {
                    second.latencies.record(&next, &SendTimes::new(0), now());
                    frame = Some(next);
                }
                Some(Update::Keyframe(next)) => frame = next.frame,
                Some(Update::Goodbye(goodbye)) => {
                    say!("{}", ended(goodbye.reason()));
                    return Ok(());
                }
                None => return Ok(()),
            },
            _ = ticks.tick() => {
                if let Some(frame) = &frame {
                    second = second.line(frame, session.subscription().counts())?;
                }
            }
        }
    }
    if let Some(frame) = &frame {
        second.line(frame, session.subscription().counts())?;
    }
    Ok(())
}

/// Why a session's stream ended, in words.
pub(crate) fn ended(reason: v1::GoodbyeReason) -> &'static str {
    match reason {
        v1::GoodbyeReason::Deleted => "the session was deleted",
        v1::GoodbyeReason::Shutdown => "the server shut down",
        v1::GoodbyeReason::Unspecified => "the session ended",
    }
}

/// One second of watching.
struct Second {
    start: Instant,
    before: Counts,
    latencies: Latencies,
}

impl Default for Second {
    fn default() -> Self {
        Self {
            start: Instant::now(),
            before: Counts::default(),
            latencies: Latencies::default(),
        }
    }
}

impl Second {
    /// Prints the second's line and begins the next one.
    fn line(self, frame: &v1::Frame, counts: Counts) -> Result<Self, Failure> {
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 frames")]
        let received = (counts.received - self.before.received) as f64;
        let latency = self.latencies.deliver_median();
        say!(
            "step {:>8}  time {:>9.3} s  {:>6.1} frames/s  latency {:>9}  missed {}",
            frame.step,
            frame.time_seconds,
            received / self.start.elapsed().as_secs_f64(),
            latency.map_or_else(|| "-".to_owned(), milliseconds),
            counts.missed - self.before.missed,
        );
        Ok(Self {
            before: counts,
            ..Self::default()
        })
    }
}
