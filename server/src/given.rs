//! What a session is given, in the order in which it takes effect: all that a replay needs.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use sinew_engine::{Drag, MotionSample};
use sinew_proto::v1;
use tokio::sync::broadcast;

/// Items that a recorder may lag behind before it is too slow: two seconds of the fastest capture.
const LAG: usize = 1024;

/// One thing that a session was given.
#[derive(Clone, Debug)]
pub(crate) enum Input {
    /// A step's motion.
    Motion {
        step: u64,
        sample: Arc<MotionSample>,
    },
    /// Who was dragged and let go before a step of a session that makes its own motion.
    Drags { step: u64, drags: Arc<[Drag]> },
    /// A new mapping.
    Mapping {
        mapping: Arc<v1::Mapping>,
        blend_seconds: f64,
    },
    /// Changes of the mesh.
    Edits(Arc<[v1::MeshEdit]>),
}

/// An input, and how many there are with it.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    pub(crate) number: u64,
    pub(crate) input: Input,
}

/// Where a session's inputs go to those who record them.
#[derive(Debug)]
pub(crate) struct Inputs {
    count: AtomicU64,
    given: broadcast::Sender<Given>,
}

impl Default for Inputs {
    fn default() -> Self {
        Self {
            count: AtomicU64::new(0),
            given: broadcast::Sender::new(LAG),
        }
    }
}

impl Inputs {
    /// Gives out an input. Never waits; only the session's own task does it.
    pub(crate) fn record(&self, input: Input) {
        let number = self.count.fetch_add(1, Ordering::AcqRel) + 1;
        self.given.send(Given { number, input }).ok(); // without recorders nobody takes it
    }

    /// How many there were.
    pub(crate) fn count(&self) -> u64 {
        self.count.load(Ordering::Acquire)
    }

    /// Inputs from now on.
    pub(crate) fn listen(&self) -> broadcast::Receiver<Given> {
        self.given.subscribe()
    }
}
