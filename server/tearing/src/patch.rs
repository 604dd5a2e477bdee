//! What became of the cells, as it goes out.

use sinew_mesh::Cells;

/// From one set of cells to the next.
///
/// Vertices and cells live in slots that are only ever appended within an epoch: a vertex that no cell uses any more
/// keeps its slot, and a cell that is removed leaves an empty cell (VTK's type 0) in its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// The topology version that this applies to; it makes the next one.
    pub from_version: u64,
    /// The vertices that each appended vertex comes from, one after the other: the one it was split from, or those that
    /// it was put between; none where it is new material.
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
