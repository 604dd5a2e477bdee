//! A session's mesh and points as they come.

use sinew_proto::v1::{
    Content, Frame, Goodbye, Keyframe, SubscribeResponse, UnstructuredGrid,
    subscribe_response::Item,
};
use tonic::Streaming;

use crate::{ClientError, chunks::Joiner, grid};

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
    /// Positions that fit the last keyframe.
    Frame(Frame),
    /// The last item.
    Goodbye(Goodbye),
}

/// What a subscription has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Published frames that arrived, keyframes included; one that comes twice counts once.
    pub received: u64,
    /// Published frames that did not: gaps in the sequence, since the reader was slow.
    pub missed: u64,
    /// Frames that arrived and do not fit the last keyframe; they are not yielded.
    pub unfit: u64,
}

impl Subscription {
    pub(crate) fn new(items: Streaming<SubscribeResponse>, content: Content) -> Self {
        Self {
            items,
            joiner: Joiner::default(),
            ledger: Ledger::new(content),
        }
    }

    /// The next update; `None` after the Goodbye. Frames whose epoch, topology version, layout hash or vertex count
    /// differ from the last keyframe's are counted and passed over: positions are never applied to another mesh.
    /// Cancel safe.
    ///
    /// # Errors
    /// [`ClientError::Refused`] where the session faults, [`ClientError::Lost`] where the connection breaks, and
    /// [`ClientError::Protocol`] where a keyframe's cells do not have the hash that it claims, where positions do not
    /// have the length that they claim, where the sequence goes back, or where the stream ends without a goodbye.
    pub async fn next(&mut self) -> Result<Option<Update>, ClientError> {
        if self.ledger.ended {
            return Ok(None);
        }
        loop {
            let Some(message) = self.items.message().await? else {
                return Err(protocol("the stream of frames ended without a goodbye"));
            };
            if let Some(item) = self.joiner.push(message)?
                && let Some(update) = self.ledger.admit(item)?
            {
                return Ok(Some(update));
            }
        }
    }

    /// What came so far.
    pub fn counts(&self) -> Counts {
        self.ledger.counts
    }
}

/// Which mesh positions belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fit {
    epoch: u64,
    topology_version: u64,
    layout_hash: u64,
    vertex_count: u32,
}

impl Fit {
    fn of(frame: &Frame) -> Self {
        Self {
            epoch: frame.epoch,
            topology_version: frame.topology_version,
            layout_hash: frame.layout_hash,
            vertex_count: frame.vertex_count,
        }
    }
}

/// Decides what of a stream may be drawn.
#[derive(Debug)]
struct Ledger {
    content: Content,
    keyframe: Option<Fit>,
    sequence: Option<u64>,
    counts: Counts,
    ended: bool,
}

impl Ledger {
    fn new(content: Content) -> Self {
        Self {
            content,
            keyframe: None,
            sequence: None,
            counts: Counts::default(),
            ended: false,
        }
    }

    fn admit(&mut self, item: Item) -> Result<Option<Update>, ClientError> {
        match item {
            Item::Keyframe(keyframe) => {
                let Some(frame) = &keyframe.frame else {
                    return Err(protocol("a keyframe without a frame"));
                };
                self.check_length(frame)?;
                self.check_cells(keyframe.grid.as_ref(), frame)?;
                self.count(frame.sequence)?;
                self.keyframe = Some(Fit::of(frame));
                Ok(Some(Update::Keyframe(keyframe)))
            }
            Item::Frame(frame) => {
                self.check_length(&frame)?;
                self.count(frame.sequence)?;
                if self.keyframe == Some(Fit::of(&frame)) {
                    Ok(Some(Update::Frame(frame)))
                } else {
                    self.counts.unfit += 1;
                    Ok(None)
                }
            }
            Item::Goodbye(goodbye) => {
                self.ended = true;
                if let Some(last) = self.sequence {
                    self.counts.missed += goodbye.last_sequence.saturating_sub(last);
                }
                Ok(Some(Update::Goodbye(goodbye)))
            }
            Item::Chunk(_) => Err(protocol("a chunk that was not joined")),
        }
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

    fn check_length(&self, frame: &Frame) -> Result<(), ClientError> {
        if self.content == Content::Points {
            return Ok(());
        }
        let numbers = frame.vertices.as_ref().map_or(0, |column| {
            column.f32.len() / 4 + column.f64.len() / 8 + column.values.len()
        });
        if numbers == 3 * frame.vertex_count as usize {
            Ok(())
        } else {
            Err(protocol(&format!(
                "frame {} has {numbers} coordinates for {} vertices",
                frame.sequence, frame.vertex_count
            )))
        }
    }

    fn check_cells(
        &self,
        cells: Option<&UnstructuredGrid>,
        frame: &Frame,
    ) -> Result<(), ClientError> {
        if self.content == Content::Points {
            return Ok(());
        }
        let cells = grid::cells(cells.unwrap_or(&UnstructuredGrid::default()))?;
        if let Err(error) = cells.check(frame.vertex_count as usize) {
            let sequence = frame.sequence;
            return Err(protocol(&format!(
                "the cells of keyframe {sequence} are none: {error}"
            )));
        }
        let hash = cells.hash();
        if hash == frame.layout_hash {
            Ok(())
        } else {
            Err(protocol(&format!(
                "the cells of keyframe {} have the hash {hash:016x}, not {:016x} as it says",
                frame.sequence, frame.layout_hash
            )))
        }
    }
}

fn protocol(what: &str) -> ClientError {
    ClientError::Protocol(what.to_owned())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use sinew_mesh::{Cells, Grid};
    use sinew_proto::v1::{Precision, Reals};

    use super::*;

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
        let mut ledger = Ledger::new(Content::Mesh);
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
        let mut ledger = Ledger::new(Content::Mesh);
        assert_eq!(ledger.admit(Item::Frame(frame(1))).unwrap(), None);
    }

    #[test]
    fn cells_that_do_not_have_their_hash_are_refused() {
        let mut wrong = keyframe(1);
        wrong.grid.as_mut().unwrap().cell_types = vec![9].into();
        let error = Ledger::new(Content::Mesh)
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
        let mut ledger = Ledger::new(Content::Points);
        let mut points = keyframe(1);
        points.grid = None;
        points.frame.as_mut().unwrap().vertices = None;
        assert!(ledger.admit(Item::Keyframe(points)).unwrap().is_some());
    }
}
