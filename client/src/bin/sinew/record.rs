//! `sinew record` and `sinew replay`: what a session is given to a file, and back.

use std::{
    fs,
    io::{BufWriter, Write as _},
    path::PathBuf,
};

use clap::Args;
use futures::stream;
use sinew_client::{Client, MotionRecord, MotionStream, RECORD_MAGIC};
use sinew_proto::v1::{self, record_motion_response::Item};

use tokio::sync::mpsc;

use crate::{
    Failure,
    connection::{Connection, session_name},
    out::say,
    progress::Progress,
    table::count,
};

/// Records what a session is given (motion, changes of the mapping and of the mesh), until Ctrl-C or the session's end.
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

/// Gives a paused session what is in a record, step by step, and prints the digest that it leads to.
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
        let item = tokio::select! {
            item = recording.next() => item?,
            _ = tokio::signal::ctrl_c() => None,
        };
        let Some(item) = item else { break };
        steps += u64::from(matches!(item, Item::Frame(_)));
        file.write_all(&MotionRecord::item(item))?;
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
const ROOM: usize = 64;

pub(crate) async fn replay(arguments: Replay) -> Result<(), Failure> {
    let MotionRecord { start, items } = MotionRecord::read(fs::read(&arguments.file)?.into())?;
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
    let (frames, mut waiting) = mpsc::channel(ROOM);
    let waiting = stream::poll_fn(move |context| waiting.poll_recv(context));
    let mut player = Player {
        motion: client.stream_motion(hello, waiting).await?,
        client,
        name,
        frames,
        sent: None,
        pending: 0,
    };
    let is_frame = |item: &&Item| matches!(item, Item::Frame(_));
    let total = items.iter().filter(is_frame).count() as u64;
    let mut progress = Progress::new(total);
    let mut done = 0;
    for item in items {
        done += u64::from(is_frame(&&item));
        player.give(item).await?;
        progress.update(done, String::new);
    }
    player.step().await?;
    drop(progress);
    let digest = player.client.session(&player.name).await?.digest;
    say!("{} steps; digest {digest}", count(total));
    Ok(())
}

/// Gives a session what a record holds.
struct Player {
    client: Client,
    name: String,
    frames: mpsc::Sender<v1::MotionFrame>,
    motion: MotionStream,
    /// Sequence of the last frame sent.
    sent: Option<u64>,
    /// Frames sent whose steps were not taken.
    pending: usize,
}

impl Player {
    async fn give(&mut self, item: Item) -> Result<(), Failure> {
        match item {
            Item::Start(_) => {}
            Item::Frame(frame) => {
                if self.pending == ROOM {
                    self.step().await?;
                }
                self.sent = Some(frame.sequence);
                self.pending += 1;
                self.frames.send(frame).await.ok(); // where nobody takes it, the acknowledgements say why
            }
            Item::Mapping(v1::RecordedMapping {
                mapping,
                blend_seconds,
            }) => {
                self.step().await?;
                let mut request = v1::UpdateMappingRequest {
                    name: self.name.clone(),
                    mapping,
                    blend_seconds,
                    ..v1::UpdateMappingRequest::default()
                };
                request.update_mask.get_or_insert_default().paths = vec!["*".to_owned()];
                self.client.update_mapping(request).await?;
            }
            Item::Edits(v1::RecordedEdits { edits }) => {
                self.step().await?;
                let request = v1::EditMeshRequest {
                    name: self.name.clone(),
                    edits,
                    ..v1::EditMeshRequest::default()
                };
                self.client.edit_mesh(request).await?;
            }
        }
        Ok(())
    }

    /// Takes the steps whose motion was sent.
    async fn step(&mut self) -> Result<(), Failure> {
        let Some(sent) = self.sent.take() else {
            return Ok(());
        };
        while self
            .motion
            .ack()
            .await?
            .ok_or("the stream of motion ended early")?
            .sequence
            < sent
        {}
        let request = v1::StepRequest {
            name: self.name.clone(),
            steps: u32::try_from(std::mem::take(&mut self.pending))?,
            ..v1::StepRequest::default()
        };
        self.client.step(request).await?;
        Ok(())
    }
}
