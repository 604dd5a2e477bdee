//! What a step did to the mesh beside moving it.

use nalgebra::Vector3;
use sinew_mesh::Cells;

/// The facts of one step. Frames may be missed by a reader, facts may not.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// In the order in which they happened.
    pub events: Vec<Event>,
    /// What they did to the mesh, all at once; `None` where nothing came of them.
    pub patch: Option<Patch>,
}

/// From one [`Layout`](crate::Layout) to the next. The positions of the new vertices are those of the step's frame.
///
/// Vertices and cells live in slots that are only ever appended within an epoch: a vertex that no cell uses any more
/// keeps its slot, and a cell that is removed leaves an empty cell (VTK's type 0) in its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// The topology version that this applies to; it makes the next one.
    pub from_version: u64,
    /// The vertices that each appended vertex comes from, one after the other: the one it was split from, or those that
    /// it was put between.
    pub vertex_parents: Vec<u32>,
    /// Where each appended vertex's parents start in `vertex_parents`; one entry more than appended vertices.
    pub vertex_parent_offsets: Vec<u32>,
    /// The slot of each cell in `cells`, ascending; those from the old number of cells on are appended, without a gap.
    pub slots: Vec<u32>,
    /// The new form of each of `slots`.
    pub cells: Cells,
    /// For each appended cell the slot of the cell that it was split from, or its own slot where it is new material.
    pub cell_parents: Vec<u32>,
    /// Faces that came apart or together.
    pub seams: Vec<Seam>,
    /// Hash of the cells afterwards.
    pub hash: u64,
}

/// A face between two cells that came apart or together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seam {
    /// Which of both.
    pub kind: SeamKind,
    /// The slots of the cells on its two sides.
    pub cells: [u32; 2],
    /// The face's vertices on the first cell's side, counter-clockwise as seen from outside that cell.
    pub vertices: Vec<u32>,
}

/// What became of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SeamKind {
    /// Two cells shared it and do no more.
    Opened,
    /// Two cells share it from now on.
    Closed,
}

/// A measured threshold crossing, or what came of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The rule behind it, by index in the scene; `None` where a client asked for it.
    pub rule: Option<u32>,
    /// Where, m.
    pub position: Vector3<f64>,
    /// The cells concerned, by slot.
    pub cells: Vec<u32>,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// A measure crossed its rule's threshold.
    Crossed {
        /// What was measured, in the rule's unit.
        measured: f64,
        /// The threshold.
        threshold: f64,
    },
    /// The mesh came apart along some faces.
    Torn {
        /// How many.
        faces: u32,
    },
    /// The mesh grew together along some faces.
    Glued {
        /// How many.
        faces: u32,
    },
    /// Cells were taken away.
    Removed,
    /// Cells were added.
    Added,
    /// Cells were divided.
    Divided,
    /// Nothing was done; why, for people.
    Refused(String),
    /// A part of the mesh came loose.
    FragmentBorn {
        /// Its number; the mesh at rest has those from 0 on.
        fragment: u32,
        /// The one that it was part of.
        parent: u32,
        /// How many cells it has.
        cells: u32,
    },
    /// Two fragments became one.
    FragmentsJoined {
        /// The one that lives on.
        fragment: u32,
        /// The one that does not.
        absorbed: u32,
    },
    /// Faces came apart inside, where nobody sees it yet.
    InnerFracture,
    /// An inner fracture reached the surface.
    FractureOpened,
}
