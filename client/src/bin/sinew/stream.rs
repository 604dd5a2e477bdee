//! `sinew stream`: a take to a session that exists.

use std::{path::PathBuf, sync::Arc};

use clap::Args;
use futures::future::Either;
use sinew_client::{paced, take_frames};
use sinew_formats::take;
use sinew_proto::v1;

use crate::out::say;
use crate::{
    Failure,
    connection::{Connection, session_name},
    drive::all_acknowledged,
    progress::Progress,
    run::warn,
    table::count,
};

/// Streams a take (C3D, TRC, BVH and others; see `sinew inspect --help`) to a session. The take's points are those of the scene, in any order.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew stream walk.c3d --session walk                      at the take's own rate
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
    };
    let frames = take_frames(take, usize::try_from(total)?);
    let frames = if arguments.fast {
        Either::Left(frames)
    } else {
        Either::Right(paced(frames))
    };
    let mut motion = client.stream_motion(hello, frames).await?;
    let mut progress = Progress::new(total);
    let (mut last, mut step) = (0, 0);
    while let Some(ack) = motion.ack().await? {
        (last, step) = (ack.sequence, ack.step);
        progress.update(last, || format!("step {step}"));
    }
    drop(progress);
    all_acknowledged(last, total)?;
    say!(
        "{} frames sent, all acknowledged; the session was at step {}.",
        count(total),
        count(step)
    );
    Ok(())
}
