//! A session's mesh and points as they come.

use sinew_proto::v1::{
    Content, Event, Frame, Goodbye, Keyframe, SubscribeResponse, TopologyPatch,
    subscribe_response::Item,
};
use tonic::Streaming;

use crate::{Applied, ClientError, MeshMirror, chunks::Joiner};

/// A subscription, made by [`crate::Client::subscribe`].
#[derive(Debug)]
pub struct Subscription {
    items: Streaming<SubscribeResponse>,
    joiner: Joiner,
    ledger: Ledger,
}

/// What a subscription yields. Positions travel packed; [`crate::grid::positions`] unpacks them.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "one at a time, nearly always the larger: a box would cost an allocation per frame"
)]
pub enum Update {
    /// Everything: draw from this alone.
    Keyframe(Keyframe),
    /// Positions that fit the mesh.
    Frame(Frame),
    /// The mesh changes; its frame has positions unless another item follows at once.
    Patch(TopologyPatch),
    /// What happened, before the positions that show it.
    Events(Vec<Event>),
    /// The last item.
    Goodbye(Goodbye),
}

/// What came of a message.
#[expect(
    clippy::large_enum_variant,
    reason = "as Update: one at a time, nearly always the larger"
)]
pub(crate) enum Received {
    Update(Update),
    /// Nothing to yield.
    Passed,
    End,
}

/// What a subscription has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Published frames that arrived, keyframes included; one that comes twice counts once.
    pub received: u64,
    /// Published frames that did not: gaps in the sequence, since the reader was slow.
    pub missed: u64,
    /// Frames and patches that arrived and do not fit the mesh; they are not yielded.
    pub unfit: u64,
}

impl Subscription {
    pub(crate) fn new(
        items: Streaming<SubscribeResponse>,
        content: Content,
        after_event: Option<u64>,
    ) -> Self {
        Self {
            items,
            joiner: Joiner::default(),
            ledger: Ledger::new(content, after_event),
        }
    }

    /// The next update; `None` after the Goodbye. Frames whose epoch, topology version, layout hash or vertex count
    /// differ from those of the mesh are counted and passed over: positions are never applied to another mesh.
    /// Cancel safe.
    ///
    /// # Errors
    /// [`ClientError::Refused`] where the session faults, [`ClientError::Lost`] where the connection breaks, and
    /// [`ClientError::Protocol`] where cells do not have the hash that they claim, where positions do not have the
    /// length that they claim, where the sequence goes back or one of the events' has a gap, or where the stream ends
    /// without a goodbye.
    pub async fn next(&mut self) -> Result<Option<Update>, ClientError> {
        loop {
            match self.receive().await? {
                Received::Update(update) => return Ok(Some(update)),
                Received::Passed => {}
                Received::End => return Ok(None),
            }
        }
    }

    /// The next message.
    pub(crate) async fn receive(&mut self) -> Result<Received, ClientError> {
        if self.ledger.ended {
            return Ok(Received::End);
        }
        let Some(message) = self.items.message().await? else {
            return Err(protocol("the stream of frames ended without a goodbye"));
        };
        let Some(item) = self.joiner.push(message)? else {
            return Ok(Received::Passed);
        };
        let update = self.ledger.admit(item)?;
        Ok(update.map_or(Received::Passed, Received::Update))
    }

    /// Items with positions since the last call.
    pub(crate) fn take_used(&mut self) -> u32 {
        std::mem::take(&mut self.ledger.used)
    }

    /// The mesh; it stays empty for readers of points or events alone.
    pub fn mirror(&self) -> &MeshMirror {
        &self.ledger.mirror
    }

    /// Sequence of the last event seen: where to go on after this stream. None before any is known of.
    pub fn last_event(&self) -> Option<u64> {
        self.ledger.last_event
    }

    /// What came so far.
    pub fn counts(&self) -> Counts {
        self.ledger.counts
    }
}

/// Decides what of a stream may be drawn.
#[derive(Debug)]
struct Ledger {
    content: Content,
    mirror: MeshMirror,
    last_event: Option<u64>,
    /// Items with positions.
    used: u32,
    sequence: Option<u64>,
    counts: Counts,
    ended: bool,
}

impl Ledger {
    fn new(content: Content, after_event: Option<u64>) -> Self {
        Self {
            content,
            mirror: MeshMirror::default(),
            last_event: after_event,
            used: 0,
            sequence: None,
            counts: Counts::default(),
            ended: false,
        }
    }

    fn admit(&mut self, item: Item) -> Result<Option<Update>, ClientError> {
        self.used += u32::from(match &item {
            Item::Keyframe(_) | Item::Frame(_) => true,
            Item::Patch(patch) => {
                let frame = patch.frame.as_ref();
                frame.is_some_and(|frame| frame.vertices.is_some())
            }
            Item::Events(_) | Item::Goodbye(_) | Item::Chunk(_) => false,
        });
        let (applied, update) = match item {
            Item::Keyframe(keyframe) => {
                let Some(frame) = &keyframe.frame else {
                    return Err(protocol("a keyframe without a frame"));
                };
                self.count(frame.sequence)?;
                self.last_event.get_or_insert(frame.event_sequence);
                let applied = match self.content {
                    Content::Points => Applied::Mesh,
                    Content::Unspecified | Content::Mesh | Content::MeshAndPoints => {
                        self.mirror.keyframe(&keyframe)?
                    }
                };
                (applied, Update::Keyframe(keyframe))
            }
            Item::Frame(frame) => {
                self.count(frame.sequence)?;
                let applied = match self.content {
                    Content::Points => Applied::Positions,
                    Content::Unspecified | Content::Mesh | Content::MeshAndPoints => {
                        self.mirror.frame(&frame)?
                    }
                };
                (applied, Update::Frame(frame))
            }
            Item::Patch(patch) => {
                let applied = self.mirror.patch(&patch)?;
                if let Some(sequence) = self.mirror.shown() {
                    self.count(sequence)?;
                }
                (applied, Update::Patch(patch))
            }
            Item::Events(events) => {
                self.check_events(&events.events)?;
                return Ok(Some(Update::Events(events.events)));
            }
            Item::Goodbye(goodbye) => {
                self.ended = true;
                if let Some(last) = self.sequence {
                    self.counts.missed += goodbye.last_sequence.saturating_sub(last);
                }
                return Ok(Some(Update::Goodbye(goodbye)));
            }
            Item::Chunk(_) => return Err(protocol("a chunk that was not joined")),
        };
        match applied {
            Applied::Mesh | Applied::Positions => Ok(Some(update)),
            // One that comes twice.
            Applied::Stale => Ok(None),
            Applied::Unfit => {
                self.counts.unfit += 1;
                Ok(None)
            }
        }
    }

    /// Events are never dropped.
    fn check_events(&mut self, events: &[Event]) -> Result<(), ClientError> {
        for event in events {
            if let Some(last) = self.last_event.replace(event.sequence)
                && event.sequence != last + 1
            {
                let problem = format!("event {} came after event {last}", event.sequence);
                return Err(protocol(&problem));
            }
        }
        Ok(())
    }

    fn count(&mut self, sequence: u64) -> Result<(), ClientError> {
        let last = self.sequence.replace(sequence);
        match last {
            Some(last) if sequence < last => {
                return Err(protocol(&format!(
                    "frame {sequence} came after frame {last}"
                )));
            }
            // A keyframe that comes again may repeat the frame before it.
            Some(last) if sequence == last => return Ok(()),
            Some(last) => self.counts.missed += sequence - last - 1,
            None => {}
        }
        self.counts.received += 1;
        Ok(())
    }
}

fn protocol(what: &str) -> ClientError {
    ClientError::Protocol(what.to_owned())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use sinew_mesh::{Cells, Grid};
    use sinew_proto::v1::{Precision, Reals, UnstructuredGrid};

    use super::*;
    use crate::grid;

    fn tetrahedron() -> Grid {
        Grid {
            positions: vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()],
            cells: Cells {
                types: vec![10],
                connectivity: vec![0, 1, 2, 3],
                offsets: vec![0, 4],
                ..Cells::default()
            },
        }
    }

    fn frame(sequence: u64) -> Frame {
        let grid = tetrahedron();
        Frame {
            epoch: 1,
            topology_version: 2,
            sequence,
            layout_hash: grid.cells.hash(),
            vertex_count: 4,
            vertices: Some(Reals::pack(&grid::flatten(&grid.positions), Precision::F32)),
            ..Frame::default()
        }
    }

    fn keyframe(sequence: u64) -> Keyframe {
        Keyframe {
            grid: Some(UnstructuredGrid {
                positions: None,
                ..grid::to_proto(&tetrahedron())
            }),
            labels: Vec::new(),
            frame: Some(frame(sequence)),
        }
    }

    fn opened() -> Ledger {
        let mut ledger = Ledger::new(Content::Mesh, None);
        let update = ledger.admit(Item::Keyframe(keyframe(10))).unwrap();
        assert_eq!(update, Some(Update::Keyframe(keyframe(10))));
        ledger
    }

    #[test]
    fn gaps_are_counted_and_a_repeated_keyframe_is_not() {
        let mut ledger = opened();
        ledger.admit(Item::Frame(frame(11))).unwrap();
        ledger.admit(Item::Frame(frame(15))).unwrap();
        ledger.admit(Item::Keyframe(keyframe(15))).unwrap();
        ledger
            .admit(Item::Goodbye(Goodbye {
                reason: 1,
                last_sequence: 17,
                last_event: 0,
            }))
            .unwrap();
        assert_eq!(
            ledger.counts,
            Counts {
                received: 3,
                missed: 5,
                unfit: 0
            }
        );
    }

    #[test]
    fn positions_of_another_mesh_are_never_yielded() {
        let other: [fn(&mut Frame); 3] = [
            |frame| frame.epoch += 1,
            |frame| frame.topology_version += 1,
            |frame| frame.layout_hash += 1,
        ];
        for change in other {
            let mut ledger = opened();
            let mut stray = frame(11);
            change(&mut stray);
            assert_eq!(ledger.admit(Item::Frame(stray)).unwrap(), None);
            assert_eq!(ledger.counts.unfit, 1);
            assert!(ledger.admit(Item::Frame(frame(12))).unwrap().is_some());
        }
    }

    #[test]
    fn a_frame_before_any_keyframe_is_never_yielded() {
        let mut ledger = Ledger::new(Content::Mesh, None);
        assert_eq!(ledger.admit(Item::Frame(frame(1))).unwrap(), None);
    }

    #[test]
    fn cells_that_do_not_have_their_hash_are_refused() {
        let mut wrong = keyframe(1);
        wrong.grid.as_mut().unwrap().cell_types = vec![9].into();
        let error = Ledger::new(Content::Mesh, None)
            .admit(Item::Keyframe(wrong))
            .unwrap_err();
        assert!(error.to_string().contains("hash"), "{error}");
    }

    #[test]
    fn positions_of_another_length_are_refused() {
        let mut short = frame(11);
        short.vertices = Some(Reals::pack(&[0.0; 9], Precision::F64));
        let error = opened().admit(Item::Frame(short)).unwrap_err();
        assert!(
            error.to_string().contains("9 coordinates for 4 vertices"),
            "{error}"
        );
    }

    #[test]
    fn a_sequence_that_goes_back_is_refused() {
        assert!(opened().admit(Item::Frame(frame(9))).is_err());
    }

    #[test]
    fn a_reader_of_points_needs_no_cells() {
        let mut ledger = Ledger::new(Content::Points, None);
        let mut points = keyframe(1);
        points.grid = None;
        points.frame.as_mut().unwrap().vertices = None;
        assert!(ledger.admit(Item::Keyframe(points)).unwrap().is_some());
    }
}
