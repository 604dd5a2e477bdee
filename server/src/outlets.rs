//! What a session gives out. State is latest-wins, facts are logs; every outlet is bounded; nobody who reads can slow a
//! step.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use bytes::Bytes;
use sinew_engine::{Frame, Layout};
use sinew_proto::v1::{self, Precision, Reals, UnstructuredGrid};
use tokio::sync::{broadcast, watch};

use crate::{
    end::End,
    facts::{self, EventLog, Trimmed, Turn, TurnLog},
    given::Inputs,
    pack,
    timing::{StepTiming, now_nanos},
};

/// Frames a subscriber may lag behind before it misses some: enough for a keyframe's transmission,
/// little enough that it never sees old news.
const LAG: usize = 8;

/// A frame on its way out. Subscribers share its packed forms.
#[derive(Debug)]
pub(crate) struct Published {
    pub(crate) frame: Arc<Frame>,
    pub(crate) sequence: u64,
    pub(crate) timing: StepTiming,
    /// Sequence of the last event up to this step.
    pub(crate) event_sequence: u64,
    vertices: [OnceLock<Reals>; 2],
    points: [OnceLock<Reals>; 2],
    orientations: [OnceLock<Reals>; 2],
}

impl Published {
    fn new(frame: Arc<Frame>, timing: StepTiming, event_sequence: u64) -> Arc<Self> {
        Arc::new(Self {
            sequence: frame.sequence + 1,
            frame,
            timing,
            event_sequence,
            vertices: [OnceLock::new(), OnceLock::new()],
            points: [OnceLock::new(), OnceLock::new()],
            orientations: [OnceLock::new(), OnceLock::new()],
        })
    }

    /// Vertex positions, packed once for all subscribers.
    pub(crate) fn vertices(&self, precision: Precision) -> Reals {
        packed(&self.vertices, precision, |precision| {
            Reals::pack(bytemuck::cast_slice(&self.frame.vertices), precision)
        })
    }

    /// Point positions, packed once for all subscribers.
    pub(crate) fn points(&self, precision: Precision) -> Reals {
        packed(&self.points, precision, |precision| {
            Reals::pack(bytemuck::cast_slice(&self.frame.points), precision)
        })
    }

    /// Orientations of the points as w x y z, packed once for all subscribers.
    pub(crate) fn orientations(&self, precision: Precision) -> Reals {
        packed(&self.orientations, precision, |precision| {
            let orientations = self.frame.orientations.iter();
            let numbers: Vec<f64> = orientations.flat_map(|q| [q.w, q.i, q.j, q.k]).collect();
            Reals::pack(&numbers, precision)
        })
    }

    /// One state per point.
    pub(crate) fn point_states(&self) -> Bytes {
        self.frame
            .point_states
            .iter()
            .map(|state| *state as u8)
            .collect()
    }
}

fn packed(
    cache: &[OnceLock<Reals>; 2],
    precision: Precision,
    pack: impl FnOnce(Precision) -> Reals,
) -> Reals {
    let slot = usize::from(precision == Precision::F64);
    cache[slot].get_or_init(|| pack(precision)).clone()
}

#[derive(Default)]
struct Facts {
    events: EventLog,
    turns: TurnLog,
}

/// A session's outlets.
pub(crate) struct Outlets {
    latest: watch::Sender<Arc<Published>>,
    recent: broadcast::Sender<Arc<Published>>,
    /// What the session is given.
    pub(crate) inputs: Inputs,
    /// Why it will be over after the step under way, where someone decided so.
    ending: OnceLock<End>,
    end: watch::Sender<Option<End>>,
    facts: Mutex<Facts>,
    /// The cells packed last, for keyframes.
    grid: Mutex<Option<(Arc<Layout>, UnstructuredGrid)>>,
}

impl Outlets {
    pub(crate) fn new(first: Arc<Frame>) -> Self {
        let now = now_nanos();
        let first = Published::new(
            first,
            StepTiming {
                published: now,
                ..StepTiming::default()
            },
            0,
        );
        Self {
            latest: watch::Sender::new(first),
            recent: broadcast::Sender::new(LAG),
            inputs: Inputs::default(),
            ending: OnceLock::new(),
            end: watch::Sender::new(None),
            facts: Mutex::default(),
            grid: Mutex::default(),
        }
    }

    /// Gives out a step's facts and then its frame. Never waits.
    pub(crate) fn publish(&self, frame: Arc<Frame>, timing: StepTiming) {
        let event_sequence = self.log(&frame);
        let published = Published::new(frame, timing, event_sequence);
        self.latest.send_replace(Arc::clone(&published));
        self.recent.send(published).ok(); // without subscribers nobody takes it
    }

    /// Logs a step's facts; the sequence of the last event.
    fn log(&self, frame: &Frame) -> u64 {
        let mut facts = self.facts();
        if let Some(change) = &frame.change {
            let Facts { events, turns } = &mut *facts;
            events.push(frame, &change.events);
            turns.push(frame, change, events.last());
        }
        facts.events.last()
    }

    fn facts(&self) -> MutexGuard<'_, Facts> {
        self.facts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sequences of the oldest event kept and of the last one; 0 where there was none.
    pub(crate) fn event_range(&self) -> (u64, u64) {
        let facts = self.facts();
        (facts.events.oldest(), facts.events.last())
    }

    /// The events after `after`: at most `most`, and no more once they have `bytes`.
    pub(crate) fn events_after(
        &self,
        after: u64,
        most: usize,
        bytes: usize,
    ) -> Result<Vec<v1::Event>, Trimmed> {
        // Packed without the lock: a step may wait for it.
        let steps = self.facts().events.after(after, most, bytes)?;
        Ok(facts::take(&steps, after, most, bytes))
    }

    /// The topology changes that lead from one version of an epoch to another, if all are still kept.
    pub(crate) fn turns(&self, epoch: u64, from: u64, to: u64) -> Option<Vec<Arc<Turn>>> {
        self.facts().turns.between(epoch, from, to)
    }

    /// The newest frame.
    pub(crate) fn latest(&self) -> Arc<Published> {
        Arc::clone(&self.latest.borrow())
    }

    /// The cells, without positions, packed once for all keyframes of a layout.
    pub(crate) fn grid(&self, layout: &Arc<Layout>) -> UnstructuredGrid {
        let mut cached = self.grid.lock().unwrap_or_else(PoisonError::into_inner);
        match &*cached {
            Some((known, grid)) if Arc::ptr_eq(known, layout) => grid.clone(),
            _ => {
                let grid = pack::cells(&layout.cells);
                *cached = Some((Arc::clone(layout), grid.clone()));
                grid
            }
        }
    }

    /// Frames from now on, and the end.
    pub(crate) fn subscribe(
        &self,
    ) -> (
        broadcast::Receiver<Arc<Published>>,
        watch::Receiver<Option<End>>,
    ) {
        (self.recent.subscribe(), self.end.subscribe())
    }

    /// Says why it will be over. The session finishes when its last frame is out.
    pub(crate) fn announce(&self, end: End) {
        self.ending.set(end).ok(); // the first one stands
    }

    /// Tells everyone that no frame follows. The first end stands.
    pub(crate) fn finish(&self, end: End) {
        self.end.send_if_modified(|slot| {
            let open = slot.is_none();
            slot.get_or_insert(end);
            open
        });
    }

    /// Why it is over or about to be.
    pub(crate) fn end(&self) -> End {
        let over = self.end.borrow().clone();
        over.or_else(|| self.ending.get().cloned())
            .unwrap_or(End::Deleted)
    }
}
