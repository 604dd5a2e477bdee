//! What readers may not miss: a session's events and the changes of its mesh's topology, as logs that each reader walks
//! at its own pace. Both are bounded, and say so to who comes too late.

use std::{
    collections::VecDeque,
    mem::size_of,
    sync::{Arc, OnceLock},
};

use sinew_engine::{Change, Event, EventKind, Frame, Patch};
use sinew_mesh::Cells;
use sinew_proto::v1;

use crate::pack;

/// Bytes of events kept.
const EVENT_BYTES: usize = 16 << 20;

/// Events that a reader asks for are no longer kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Trimmed {
    /// Sequence of the oldest kept.
    pub(crate) oldest: u64,
}

/// The events of one step.
pub(crate) struct Happened {
    /// Sequence of the first.
    first: u64,
    step: u64,
    time_seconds: f64,
    topology_version: u64,
    events: Vec<Event>,
}

impl Happened {
    /// Sequence of the last.
    fn last(&self) -> u64 {
        self.first + self.events.len() as u64 - 1
    }

    fn bytes(&self) -> usize {
        self.events.iter().map(bytes_of).sum()
    }
}

fn bytes_of(event: &Event) -> usize {
    let text = match &event.kind {
        EventKind::Refused(reason) => reason.len(),
        EventKind::Crossed { .. }
        | EventKind::Torn { .. }
        | EventKind::Glued { .. }
        | EventKind::Removed
        | EventKind::Added
        | EventKind::Divided
        | EventKind::Collapsed
        | EventKind::Followed(_) => 0,
    };
    size_of::<Event>() + size_of_val(&*event.cells) + text
}

/// A session's events, the newest last.
#[derive(Default)]
pub(crate) struct EventLog {
    steps: VecDeque<Arc<Happened>>,
    bytes: usize,
    last: u64,
}

impl EventLog {
    /// Adds a step's events.
    pub(crate) fn push(&mut self, frame: &Frame, events: &[Event]) {
        if events.is_empty() {
            return;
        }
        let happened = Happened {
            first: self.last + 1,
            step: frame.step,
            time_seconds: frame.time_seconds,
            topology_version: frame.layout.topology_version,
            events: events.to_vec(),
        };
        self.last = happened.last();
        self.bytes += happened.bytes();
        self.steps.push_back(Arc::new(happened));
        while self.bytes > EVENT_BYTES
            && self.steps.len() > 1
            && let Some(oldest) = self.steps.pop_front()
        {
            self.bytes -= oldest.bytes();
        }
    }

    /// Sequence of the last event; 0 where there was none.
    pub(crate) fn last(&self) -> u64 {
        self.last
    }

    /// Sequence of the oldest event kept; 0 where there was none.
    pub(crate) fn oldest(&self) -> u64 {
        self.steps.front().map_or(0, |happened| happened.first)
    }

    /// The steps with the next events after `after`, as many as [`take`] takes from.
    pub(crate) fn after(
        &self,
        after: u64,
        most: usize,
        bytes: usize,
    ) -> Result<Vec<Arc<Happened>>, Trimmed> {
        let oldest = self.oldest();
        if after.saturating_add(1) < oldest {
            return Err(Trimmed { oldest });
        }
        let start = (self.steps).partition_point(|happened| happened.last() <= after);
        let mut size = 0;
        let needed = self.steps.range(start..).take_while(|happened| {
            let enough = happened.first > after.saturating_add(most as u64) || size >= bytes;
            size += happened.bytes();
            !enough
        });
        Ok(needed.cloned().collect())
    }
}

/// The events after `after`, for the wire: at most `most`, and no more once they have `bytes`.
pub(crate) fn take(
    steps: &[Arc<Happened>],
    after: u64,
    most: usize,
    bytes: usize,
) -> Vec<v1::Event> {
    let events = steps.iter().flat_map(|happened| {
        let events = (happened.first..).zip(&happened.events);
        events.map(move |(sequence, event)| (happened, sequence, event))
    });
    let mut size = 0;
    let wanted = events
        .skip_while(|(_, sequence, _)| *sequence <= after)
        .take(most)
        .take_while(|(.., event)| {
            let room = size < bytes;
            size += bytes_of(event);
            room
        });
    let packed = wanted.map(|(happened, sequence, event)| v1::Event {
        sequence,
        step: happened.step,
        time_seconds: happened.time_seconds,
        topology_version: happened.topology_version,
        ..pack::event(event)
    });
    packed.collect()
}

/// A topology change and the step that made it.
pub(crate) struct Turn {
    pub(crate) epoch: u64,
    pub(crate) from_version: u64,
    pub(crate) hash: u64,
    pub(crate) vertex_count: usize,
    pub(crate) sequence: u64,
    pub(crate) step: u64,
    pub(crate) time_seconds: f64,
    pub(crate) event_sequence: u64,
    change: Arc<Change>,
    packed: OnceLock<v1::TopologyPatch>,
}

impl Turn {
    /// The patch without a frame, packed once for all readers.
    pub(crate) fn packed(&self) -> v1::TopologyPatch {
        let pack = || self.change.patch.as_ref().map(pack::patch);
        self.packed
            .get_or_init(|| pack().unwrap_or_default())
            .clone()
    }

    fn bytes(&self) -> usize {
        self.change.patch.as_ref().map_or(0, patch_bytes)
    }
}

fn patch_bytes(patch: &Patch) -> usize {
    let Patch {
        from_version: _,
        vertex_parents,
        vertex_parent_offsets,
        slots,
        cells,
        cell_parents,
        seams,
        hash: _,
    } = patch;
    let columns = [vertex_parents, vertex_parent_offsets, slots, cell_parents];
    let seams = seams.iter().map(|seam| 13 + size_of_val(&*seam.vertices));
    columns
        .map(|column| size_of_val(&**column))
        .iter()
        .sum::<usize>()
        + cell_bytes(cells)
        + seams.sum::<usize>()
}

fn cell_bytes(cells: &Cells) -> usize {
    let Cells {
        types,
        connectivity,
        offsets,
        faces,
        face_offsets,
    } = cells;
    let columns = [connectivity, offsets, faces, face_offsets];
    types.len()
        + columns
            .map(|column| size_of_val(&**column))
            .iter()
            .sum::<usize>()
}

/// The newest topology changes: as many as take less than the cells themselves, since a reader that lacks more is
/// better off with a keyframe.
#[derive(Default)]
pub(crate) struct TurnLog {
    turns: VecDeque<Arc<Turn>>,
    bytes: usize,
}

impl TurnLog {
    /// Adds a step's change, if it made one.
    pub(crate) fn push(&mut self, frame: &Frame, change: &Arc<Change>, event_sequence: u64) {
        let Some(patch) = &change.patch else {
            return;
        };
        let turn = Turn {
            epoch: frame.layout.epoch,
            from_version: patch.from_version,
            hash: frame.layout.hash,
            vertex_count: frame.vertices.len(),
            sequence: frame.sequence,
            step: frame.step,
            time_seconds: frame.time_seconds,
            event_sequence,
            change: Arc::clone(change),
            packed: OnceLock::new(),
        };
        self.bytes += turn.bytes();
        self.turns.push_back(Arc::new(turn));
        let limit = cell_bytes(&frame.layout.cells);
        while self.bytes > limit
            && let Some(oldest) = self.turns.pop_front()
        {
            self.bytes -= oldest.bytes();
        }
    }

    /// The changes that lead from one version of an epoch to another, if all are here.
    pub(crate) fn between(&self, epoch: u64, from: u64, to: u64) -> Option<Vec<Arc<Turn>>> {
        let wanted =
            |turn: &&Arc<Turn>| turn.epoch == epoch && (from..to).contains(&turn.from_version);
        let turns: Vec<_> = self.turns.iter().filter(wanted).cloned().collect();
        let complete = turns.iter().map(|turn| turn.from_version).eq(from..to);
        (complete && from < to).then_some(turns)
    }
}
