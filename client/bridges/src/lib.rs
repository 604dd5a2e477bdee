//! Live motion capture of other programs, as it comes over the network: one module for each protocol.
//!
//! A source runs in a task of its own and says what it hears as [`Update`]s: first a [`Layout`], then [`Frame`]s in
//! that layout. It never ends by itself: a peer that falls silent is waited for, one that comes back under another
//! layout or clock says so by a new layout.
//!
//! What a protocol says is decoded by functions that have no socket, so that every byte of it can be tested.

mod cursor;
mod error;
pub mod lsl;
pub mod natnet;

mod time;
pub mod vmc;

use nalgebra::Vector3;
use tokio::sync::mpsc;

pub use cursor::Garbled;
pub use error::BridgeError;
pub use time::{Local, PeerClock};

/// How a source's axes lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// z up, right-handed.
    ZUpRight,
    /// y up, right-handed.
    YUpRight,
    /// z up, left-handed.
    ZUpLeft,
    /// y up, left-handed.
    YUpLeft,
}

/// By which clock a source's frames are timed.
#[derive(Clone, Debug)]
pub enum Clock {
    /// The source's own, of which nothing else is known.
    Foreign,
    /// One that can be read here.
    Readable(PeerClock),
}

/// What a source's frames are made of.
#[derive(Clone, Debug)]
pub struct Layout {
    /// One for each point, each once.
    pub labels: Vec<String>,
    /// Frames per second, Hz, where the source says.
    pub rate_hz: Option<f64>,
    /// Metres per unit of length.
    pub unit_metres: f64,
    /// `None` where the source does not say: those of the scene.
    pub axes: Option<Axes>,
    /// Of [`Frame::time`].
    pub clock: Clock,
    /// Who sends, for people.
    pub source: String,
}

/// Bit 0 of a point's flags: it has no position.
pub const OCCLUDED: u8 = 1;
/// Bit 2: filled in from a model.
pub const FILLED: u8 = 4;
/// Bit 3: solved, such as a joint.
pub const SOLVED: u8 = 8;

/// All points at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// When it was captured, s, on the layout's clock.
    pub time: f64,
    /// One per point, in the layout's unit and axes; zero where occluded.
    pub positions: Vec<Vector3<f64>>,
    /// One per point: [`OCCLUDED`], [`FILLED`], [`SOLVED`].
    pub flags: Vec<u8>,
}

impl Frame {
    /// A frame of which nothing is seen yet.
    fn unseen(time: f64, points: usize) -> Self {
        Self {
            time,
            positions: vec![Vector3::zeros(); points],
            flags: vec![OCCLUDED; points],
        }
    }

    /// Sees a point, unless its position is none.
    fn see(&mut self, point: usize, position: Vector3<f64>, flags: u8) {
        if position.iter().all(|x| x.is_finite()) {
            self.positions[point] = position;
            self.flags[point] = flags;
        }
    }
}

/// What a source says.
#[derive(Clone, Debug)]
pub enum Update {
    /// Frames from now on are of this layout, and of a clock that has nothing to do with the one before.
    Layout(Layout),
    /// In the last layout.
    Frame(Frame),
    /// Something that people should know.
    Note(String),
}

/// Updates that wait for who asked; a source that is ahead by more waits too.
const WAITING: usize = 256;

/// A source that runs.
#[derive(Debug)]
pub struct Source {
    updates: mpsc::Receiver<Update>,
    task: tokio::task::JoinHandle<BridgeError>,
}

impl Source {
    fn spawn<F: Future<Output = BridgeError> + Send + 'static>(
        run: impl FnOnce(mpsc::Sender<Update>) -> F,
    ) -> Self {
        let (sender, updates) = mpsc::channel(WAITING);
        Self {
            updates,
            task: tokio::spawn(run(sender)),
        }
    }

    /// The next update. May be dropped while it waits: nothing is lost.
    ///
    /// # Errors
    /// Why the source cannot go on.
    pub async fn next(&mut self) -> Result<Update, BridgeError> {
        match self.updates.recv().await {
            Some(update) => Ok(update),
            None => Err((&mut self.task).await.unwrap_or(BridgeError::Abandoned)),
        }
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        self.task.abort();
    }
}
