//! What a session gives out. State is latest-wins; every outlet is bounded; nobody who reads can slow
//! a step.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use bytes::Bytes;
use nalgebra::Vector3;
use sinew_engine::{Frame, Layout};
use sinew_mesh::Cells;
use sinew_proto::v1::{Indices, Precision, Reals, UnstructuredGrid};
use tokio::sync::{broadcast, watch};

use crate::{
    end::End,
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
    vertices: [OnceLock<Reals>; 2],
    points: [OnceLock<Reals>; 2],
}

impl Published {
    fn new(frame: Arc<Frame>, timing: StepTiming) -> Arc<Self> {
        Arc::new(Self {
            sequence: frame.step + 1,
            frame,
            timing,
            vertices: [OnceLock::new(), OnceLock::new()],
            points: [OnceLock::new(), OnceLock::new()],
        })
    }

    /// Vertex positions, packed once for all subscribers.
    pub(crate) fn vertices(&self, precision: Precision) -> Reals {
        packed(&self.vertices, &self.frame.vertices, precision)
    }

    /// Point positions, packed once for all subscribers.
    pub(crate) fn points(&self, precision: Precision) -> Reals {
        packed(&self.points, &self.frame.points, precision)
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

fn packed(cache: &[OnceLock<Reals>; 2], positions: &[Vector3<f64>], precision: Precision) -> Reals {
    let slot = usize::from(precision == Precision::F64);
    cache[slot]
        .get_or_init(|| Reals::pack(bytemuck::cast_slice(positions), precision))
        .clone()
}

/// A session's outlets.
pub(crate) struct Outlets {
    latest: watch::Sender<Arc<Published>>,
    recent: broadcast::Sender<Arc<Published>>,
    /// Why it will be over after the step under way, where someone decided so.
    ending: OnceLock<End>,
    end: watch::Sender<Option<End>>,
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
        );
        Self {
            latest: watch::Sender::new(first),
            recent: broadcast::Sender::new(LAG),
            ending: OnceLock::new(),
            end: watch::Sender::new(None),
            grid: Mutex::default(),
        }
    }

    /// Gives out a step's frame. Never waits.
    pub(crate) fn publish(&self, frame: Arc<Frame>, timing: StepTiming) {
        let published = Published::new(frame, timing);
        self.latest.send_replace(Arc::clone(&published));
        self.recent.send(published).ok(); // without subscribers nobody takes it
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
                let grid = pack_cells(&layout.cells);
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

fn pack_cells(cells: &Cells) -> UnstructuredGrid {
    let Cells {
        types,
        connectivity,
        offsets,
        faces,
        face_offsets,
    } = cells;
    UnstructuredGrid {
        positions: None,
        cell_types: Bytes::copy_from_slice(types),
        connectivity: Some(Indices::pack(connectivity)),
        offsets: Some(Indices::pack(offsets)),
        faces: (!faces.is_empty()).then(|| Indices::pack(faces)),
        face_offsets: (!face_offsets.is_empty()).then(|| Indices::pack(face_offsets)),
    }
}
