//! Shows each session in Rerun: a feed that native viewers and browsers read, recordings on disk, and the pages with
//! the browser's viewer.
//!
//! ```text
//! session ─publish→ one slot ─thread "sinew-viewer"→ rows, encoded once ─→ hub ─→ viewers (gRPC, grpc-web)
//!                                                                            └──→ files (a thread each)
//! ```
//!
//! A session never waits: what it publishes replaces what was not taken yet. Past the slot, nobody waits for anybody
//! else: viewers and files are readers with a place in a bounded history, and one that falls behind moves its place
//! forward. What a reader gets is never wrong: positions come only after the whole mesh that they belong to.

mod blueprint;
mod feed;
mod file;
mod happenings;
mod hub;
mod lane;
mod pages;
mod palette;
mod publisher;
mod recorder;
mod recording;
mod scars;

use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use re_protos::sdk_comms::v1alpha1::message_proxy_service_server::MessageProxyServiceServer;
use re_sdk::external::re_log_encoding::rrd::CodecError;
use sinew_engine::{Frame, UpAxis};

use file::RecordingFile;
use hub::{Hub, Interest, Limits};
use publisher::Mailbox;
use recorder::Recorder;

pub use feed::Feed;
pub use hub::Stats;
pub use publisher::Publisher;

/// What may be used.
#[derive(Clone, Debug)]
pub struct Config {
    /// Folder for recordings, one `ID.rrd` per session; an older one of the same name is replaced.
    pub recordings: Option<PathBuf>,
    /// Past kept for each session, in bytes of encoded steps. Beyond it come the newest whole mesh, one step, and plots
    /// of an eighth of it.
    pub history_bytes: u64,
    /// How far behind a viewer may fall before it is moved to the newest step, in bytes of encoded steps.
    pub viewer_buffer_bytes: u64,
    /// Viewers at a time.
    pub viewers: usize,
    /// Shortest time between two frames of a session that are encoded.
    pub interval: Duration,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            recordings: None,
            history_bytes: 32 << 20,
            viewer_buffer_bytes: 8 << 20,
            viewers: 32,
            interval: Duration::from_millis(4),
        }
    }
}

/// What is known of a session when it begins.
#[derive(Clone, Debug)]
pub struct SessionInfo {
    /// The `id` of `sessions/{id}`: letters, digits, `-`, `_` and `.`.
    pub id: String,
    /// Shown to people.
    pub title: String,
    /// One per point.
    pub labels: Vec<String>,
    /// Names of what frames hold readings of, in order.
    pub probes: Vec<String>,
    /// Which axis points up.
    pub up: UpAxis,
}

/// A frame and how it came about.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The frame.
    pub frame: Arc<Frame>,
    /// What its step took, s.
    pub step_seconds: f64,
    /// From the arrival of the motion behind it to the end of its step, s.
    pub latency_seconds: Option<f64>,
}

/// Why something cannot be said in Rerun's format.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// While making a row.
    #[error("cannot make a row: {0}")]
    Row(#[from] re_sdk::log::ChunkError),
    /// While encoding it.
    #[error("cannot encode a message: {0}")]
    Message(#[from] CodecError),
    /// While making the blueprint.
    #[error("cannot make the blueprint: {0}")]
    Blueprint(#[from] re_sdk::RecordingStreamError),
}

/// Why a session cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The id could not name a file.
    #[error(
        "session id {0:?} cannot name a recording; use letters, digits, '-', '_' and '.', the first not a '.'"
    )]
    Id(String),
    /// The file cannot be written.
    #[error("cannot write a recording: {0}; choose a folder that exists and can be written")]
    File(#[from] std::io::Error),
    /// Something cannot be encoded.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// What was not written in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("recordings were not complete after {} s; the end of some is missing", .0.as_secs_f64())]
pub struct Unfinished(pub Duration);

/// See the module. Clones are the same viewer.
#[derive(Clone)]
pub struct Viewer {
    shared: Arc<Shared>,
}

struct Shared {
    recordings: Option<PathBuf>,
    hub: Arc<Hub>,
    mailbox: Arc<Mailbox>,
    workers: Mutex<Workers>,
}

impl Drop for Shared {
    fn drop(&mut self) {
        self.mailbox.close();
    }
}

/// Each thread holds a sender, so the receiver hears when the last one is gone.
struct Workers {
    alive: Option<Sender<()>>,
    done: Receiver<()>,
}

impl Viewer {
    /// Starts the publishing thread.
    ///
    /// # Errors
    /// If the thread cannot be started, or if the folder for recordings cannot be made.
    pub fn start(config: Config) -> std::io::Result<Self> {
        if let Some(folder) = &config.recordings {
            std::fs::create_dir_all(folder)?;
        }
        let greeting = blueprint::messages().map_err(std::io::Error::other)?;
        let limits = Limits {
            history_bytes: config.history_bytes,
            backlog_bytes: config.viewer_buffer_bytes,
            viewers: config.viewers,
        };
        let hub = Hub::new(greeting.into(), limits);
        let mailbox = Arc::new(Mailbox::default());
        let (alive, done) = mpsc::channel();
        spawn("sinew-viewer", alive.clone(), {
            let (hub, mailbox) = (Arc::clone(&hub), Arc::clone(&mailbox));
            move || publisher::run(&mailbox, &hub, config.interval)
        })?;
        let alive = Some(alive);
        Ok(Self {
            shared: Arc::new(Shared {
                recordings: config.recordings,
                hub,
                mailbox,
                workers: Mutex::new(Workers { alive, done }),
            }),
        })
    }

    /// Begins a session's recording.
    ///
    /// # Errors
    /// [`OpenError`] if the id could not name a file, the file cannot be made or something cannot be encoded.
    pub fn open(&self, session: &SessionInfo) -> Result<Publisher, OpenError> {
        let id = &session.id;
        if !names_a_file(id) {
            return Err(OpenError::Id(id.clone()));
        }
        let Shared {
            recordings,
            hub,
            mailbox,
            workers,
        } = &*self.shared;
        let file = recordings
            .as_ref()
            .map(|folder| RecordingFile::create(folder, id))
            .transpose()?;
        // A viewer that saw an earlier session of this id must not mix the two.
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let name = format!("{id}@{}", now.unwrap_or_default().as_nanos());
        let recorder = Recorder::new(session, &name);
        let key = hub.open(id.clone(), recorder.setup(session)?);
        let publisher = Publisher::new(Arc::clone(mailbox), key, recorder);
        if let Some(file) = file {
            let workers = workers.lock().unwrap_or_else(PoisonError::into_inner);
            let messages = hub.subscribe(Interest::File(key));
            if let (Some(alive), Ok(messages)) = (&workers.alive, messages) {
                spawn("sinew-recording", alive.clone(), move || file.run(messages))?;
            }
        }
        Ok(publisher)
    }

    /// Rerun's proxy service, to be served over gRPC and grpc-web.
    pub fn feed(&self) -> MessageProxyServiceServer<Feed> {
        let Shared { hub, mailbox, .. } = &*self.shared;
        MessageProxyServiceServer::new(Feed::new(Arc::clone(hub), Arc::clone(mailbox)))
    }

    /// `GET /`, `GET /sessions/{id}` and what they load. The list asks `GET /api/sessions`, which is not served here.
    pub fn pages(&self) -> axum::Router {
        pages::router()
    }

    /// What is kept for readers just now.
    pub fn stats(&self) -> Stats {
        self.shared.hub.stats()
    }

    /// Ends everything: each file gets its last frame and is closed, each viewer's stream ends after what is left.
    /// Blocks until the files are written, at most for `grace`.
    ///
    /// # Errors
    /// [`Unfinished`] if they are not written by then.
    pub fn shutdown(&self, grace: Duration) -> Result<(), Unfinished> {
        self.shared.mailbox.close();
        let workers = &self.shared.workers;
        let mut workers = workers.lock().unwrap_or_else(PoisonError::into_inner);
        workers.alive = None;
        match workers.done.recv_timeout(grace) {
            Ok(()) | Err(RecvTimeoutError::Disconnected) => Ok(()),
            Err(RecvTimeoutError::Timeout) => Err(Unfinished(grace)),
        }
    }
}

fn spawn(
    name: &str,
    alive: Sender<()>,
    work: impl FnOnce() + Send + 'static,
) -> std::io::Result<()> {
    let work = move || {
        work();
        drop(alive);
    };
    thread::Builder::new().name(name.into()).spawn(work)?;
    Ok(())
}

fn names_a_file(id: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    !id.is_empty() && id.len() <= 128 && !id.starts_with('.') && id.chars().all(allowed)
}
