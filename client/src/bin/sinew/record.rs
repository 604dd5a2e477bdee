//! `sinew record` and `sinew replay`: a session's motion to a file, and back.

use std::{
    fs,
    io::{BufWriter, Write as _},
    path::PathBuf,
};

use clap::Args;
use futures::stream;
use sinew_client::{MotionRecord, RECORD_MAGIC};
use sinew_proto::v1::{self, record_motion_response::Item};

use crate::{
    Failure,
    connection::{Connection, session_name},
    out::say,
    progress::Progress,
    table::count,
};

/// Records what a session's points are given at each step, until Ctrl-C or the session's end.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew record walk.motion --session walk                   from now on
  sinew record walk.motion --session walk --steps 600       ten seconds of 60 Hz")]
pub(crate) struct Record {
    /// The file.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The session.
    #[arg(long, value_name = "ID")]
    session: String,
    /// End after so many steps.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    #[command(flatten)]
    connection: Connection,
}

/// Gives a paused session the motion of a record, one frame for each step, and prints the digest that it leads to.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew replay walk.motion --session again                  a new session of the same scene")]
pub(crate) struct Replay {
    /// The record.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The session.
    #[arg(long, value_name = "ID")]
    session: String,
    #[command(flatten)]
    connection: Connection,
}

pub(crate) async fn record(arguments: Record) -> Result<(), Failure> {
    let client = arguments.connection.open().await?;
    let mut recording = client
        .record_motion(&session_name(&arguments.session))
        .await?;
    let mut file = BufWriter::new(fs::File::create(&arguments.file)?);
    file.write_all(RECORD_MAGIC)?;
    file.write_all(&MotionRecord::item(Item::Start(recording.start().clone())))?;
    let most = arguments.steps.unwrap_or(u64::MAX);
    let mut progress = Progress::new(most);
    let mut steps = 0;
    while steps < most {
        let frame = tokio::select! {
            frame = recording.next() => frame?,
            _ = tokio::signal::ctrl_c() => None,
        };
        let Some(frame) = frame else { break };
        file.write_all(&MotionRecord::item(Item::Frame(frame)))?;
        steps += 1;
        progress.update(steps, String::new);
    }
    file.flush()?;
    drop(progress);
    say!(
        "{} steps from step {} on.",
        count(steps),
        count(recording.start().step)
    );
    Ok(())
}

/// Frames that a session keeps waiting: no step asks for more at once.
const ROOM: u64 = 64;

pub(crate) async fn replay(arguments: Replay) -> Result<(), Failure> {
    let MotionRecord { start, frames } = MotionRecord::read(fs::read(&arguments.file)?.into())?;
    let client = arguments.connection.open().await?;
    let name = session_name(&arguments.session);
    let session = client.pause(&name).await?;
    if session.digest != start.digest {
        eprintln!(
            "sinew: {name} is not in the state in which the record began (step {}); the digest will be another",
            start.step
        );
    }
    let hello = v1::Hello {
        session: name.clone(),
        source: arguments.file.display().to_string(),
        labels: start.labels,
        ..v1::Hello::default()
    };
    let total = frames.len() as u64;
    let mut motion = client.stream_motion(hello, stream::iter(frames)).await?;
    let mut progress = Progress::new(total);
    let mut done = 0;
    let mut digest = session.digest;
    while done < total {
        let waiting = match motion.ack().await? {
            Some(ack) if ack.sequence > 0 => ack.sequence - start.step - done,
            Some(_) => 0,
            None => total - done,
        };
        if waiting > 0 {
            let steps = u32::try_from(waiting.min(ROOM))?;
            let request = v1::StepRequest {
                name: name.clone(),
                steps,
                ..v1::StepRequest::default()
            };
            digest = client.step(request).await?.digest;
            done += u64::from(steps);
            progress.update(done, String::new);
        }
    }
    drop(progress);
    say!("{} steps; digest {digest}", count(total));
    Ok(())
}
