//! `sinew stream`: a take to a session that exists.

use std::{path::PathBuf, sync::Arc};

use clap::Args;
use futures::future::Either;
use sinew_client::{CaptureClock, paced, paced_by, take_frames};
use sinew_formats::take;
use sinew_proto::v1;

use crate::out::say;
use crate::{
    Failure,
    connection::{Connection, session_name},
    drive::all_acknowledged,
    latency::milliseconds,
    progress::Progress,
    run::warn,
    table::{Table, count},
};

/// Streams a take (C3D, TRC, BVH and others; see `sinew inspect --help`) to a session. The take's points are those of the scene, in any order.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew stream walk.c3d --session walk                      at the take's own rate
  sinew stream walk.c3d --session walk --live               as if it was captured now: resampled by capture time
  sinew stream walk.c3d --session walk --fast               as fast as the session takes it
  sinew stream dance.bvh --session dance --unit-scale 0.0254  a BVH in inches")]
pub(crate) struct Arguments {
    /// The take.
    #[arg(value_name = "TAKE")]
    take: PathBuf,
    /// The session.
    #[arg(long, value_name = "ID")]
    session: String,
    /// End after so many frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// No pacing.
    #[arg(long)]
    fast: bool,
    /// Steps by capture time, on the session's own grid, instead of one for each frame.
    #[arg(long, conflicts_with = "fast")]
    live: bool,
    /// Metres per unit of length in the file. Without it: what the file says; centimetres for BVH, which says nothing.
    #[arg(long, value_name = "METRES")]
    unit_scale: Option<f64>,
    #[command(flatten)]
    connection: Connection,
}

pub(crate) async fn stream(arguments: Arguments) -> Result<(), Failure> {
    let options = take::Options {
        unit_scale: arguments.unit_scale,
    };
    let take = Arc::new(take::read(&arguments.take, &options)?);
    warn(take.warnings());
    let total = arguments
        .frames
        .unwrap_or(u64::MAX)
        .min(take.frames() as u64);
    let client = arguments.connection.open().await?;
    let hello = v1::Hello {
        session: session_name(&arguments.session),
        source: arguments.take.display().to_string(),
        labels: take.labels().to_vec(),
        rate_hz: take.rate_hz(),
        ..v1::Hello::default()
    };
    let clock = CaptureClock::showing(take.first_time_seconds());
    let frames = take_frames(take, usize::try_from(total)?);
    let mut motion = if arguments.live {
        let frames = paced_by(clock, frames);
        client
            .stream_motion_live(hello, frames, move || clock.now())
            .await?
    } else {
        let frames = match arguments.fast {
            true => Either::Left(frames),
            false => Either::Right(paced(frames)),
        };
        client.stream_motion(hello, frames).await?
    };
    let mut progress = Progress::new(total);
    let mut last = v1::Ack::default();
    while let Some(ack) = motion.ack().await? {
        progress.update(ack.sequence, || format!("step {}", ack.step));
        last = ack;
    }
    drop(progress);
    if arguments.live {
        say!("{}", played(total, &last, motion.throttled()));
        return Ok(());
    }
    all_acknowledged(last.sequence, total)?;
    say!(
        "{} frames sent, all acknowledged; the session was at step {}.",
        count(total),
        count(last.step)
    );
    Ok(())
}

/// How a live stream went.
pub(crate) fn played(total: u64, ack: &v1::Ack, throttled: u64) -> Table {
    let mut table = Table::of_numbers();
    let mut row = |name: &str, value: String| {
        table.row([name, &value]);
    };
    row("frames sent", count(total));
    row("  last one used", count(ack.sequence));
    row("  reordered", count(ack.reordered));
    row("  twice", count(ack.duplicates));
    row("  late", count(ack.late));
    row("  refused", count(ack.refused));
    row("throttled", count(throttled));
    row("step", count(ack.step));
    row("played after", milliseconds(ack.delay_seconds));
    row("clock skew", format!("{:.1} ppm", ack.clock_skew * 1e6));
    table
}
