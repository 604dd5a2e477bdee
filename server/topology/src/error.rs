//! Why an edit was refused.

use thiserror::Error;

use crate::{AnyCell, Cell, Dart, Edge, Face, Vertex, Volume};

/// Why an edit was refused. The map is as it was before.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum EditError {
    /// A dart that the map does not have.
    #[error("{dart} is not a dart of this map, or no more")]
    NoDart {
        /// The dart.
        dart: Dart,
    },
    /// A cell that the map does not have.
    #[error("{cell} is not a cell of this map, or no more")]
    NoCell {
        /// The cell.
        cell: AnyCell,
    },
    /// More darts than can be numbered.
    #[error("the map cannot number so many darts more; split the mesh")]
    Full,
    /// A dart that is linked already.
    #[error("cannot {beta}-link {one} and {other}: β{beta}({taken}) is not free; unlink it first")]
    NotFree {
        /// Which β.
        beta: u8,
        /// The one dart.
        one: Dart,
        /// The other.
        other: Dart,
        /// The dart that is not free.
        taken: Dart,
    },
    /// A dart that is not linked.
    #[error("cannot {beta}-unlink {dart}: β{beta}({dart}) is free already")]
    Free {
        /// Which β.
        beta: u8,
        /// The dart.
        dart: Dart,
    },
    /// A dart that would be linked to itself.
    #[error("cannot {beta}-link {dart} to itself")]
    Itself {
        /// Which β.
        beta: u8,
        /// The dart.
        dart: Dart,
    },
    /// Two faces that cannot be sewn.
    #[error("cannot 3-sew {one} and {other}: their faces have {left} and {right} darts")]
    Unequal {
        /// The one dart.
        one: Dart,
        /// The other.
        other: Dart,
        /// Darts around the face of `one`.
        left: usize,
        /// Darts around the face of `other`.
        right: usize,
    },
    /// A face whose two sides do not run against each other any more.
    #[error(
        "β1 was changed on one side of the face of {dart} only; link the other side alike, or unlink β3 first"
    )]
    SidesDiffer {
        /// A dart of the face.
        dart: Dart,
    },
    /// Two darts of the same face, on the same side.
    #[error("cannot 3-sew {one} and {other}: they are of the same side of a face")]
    SameSide {
        /// The one dart.
        one: Dart,
        /// The other.
        other: Dart,
    },
    /// A 3-sew in a map of dimension 2.
    #[error("cannot 3-sew {dart}: the map has dimension 2")]
    Surface {
        /// The dart.
        dart: Dart,
    },
    /// A face that the edit leaves open.
    #[error("the edit leaves a face open: β1({dart}) is free; link it, or undo the unlinking")]
    OpenFace {
        /// The dart.
        dart: Dart,
    },
    /// A volume that the edit leaves open.
    #[error("the edit leaves a volume open: β2({dart}) is free; link it, or undo the unlinking")]
    OpenVolume {
        /// The dart.
        dart: Dart,
    },
    /// Links that were not followed by their partners beyond β3.
    #[error("cannot 1-link at {dart}: its face has another side, {other}, that would not follow")]
    OtherSide {
        /// The dart.
        dart: Dart,
        /// β3 of it.
        other: Dart,
    },
    /// Two darts that no edge can be drawn between.
    #[error("cannot join {from} and {to}: {reason}")]
    NotAChord {
        /// The one dart.
        from: Dart,
        /// The other.
        to: Dart,
        /// Why not.
        reason: &'static str,
    },
    /// A path that bounds no face within a volume.
    #[error("cannot span a face along the path: at {dart}, {reason}")]
    NotARing {
        /// The dart of the path.
        dart: Dart,
        /// Why not.
        reason: &'static str,
    },
    /// Two vertices of a volume that no edge joins.
    #[error("{volume} has no edge from {from} to {to}")]
    NoEdge {
        /// The volume.
        volume: Cell<Volume>,
        /// The one vertex.
        from: Cell<Vertex>,
        /// The other.
        to: Cell<Vertex>,
    },
    /// A face that a cut crosses more than once.
    #[error(
        "cannot cut {face}: the cut meets it at {crossings} vertices, and 2 are needed; split the face first"
    )]
    FaceCrossings {
        /// The face.
        face: Cell<Face>,
        /// Vertices of the face on the cut.
        crossings: usize,
    },
    /// No path, or one of a single edge.
    #[error("cannot span a face along fewer than three edges")]
    NoPath,
    /// A cell of another shape than the operation is for.
    #[error("{cell} is no {needed}")]
    WrongShape {
        /// The cell.
        cell: AnyCell,
        /// What it should be.
        needed: &'static str,
    },
    /// An edge whose collapse would change what the mesh is.
    #[error("cannot collapse {edge}: {reason} ({at})")]
    NotCollapsible {
        /// The edge.
        edge: Cell<Edge>,
        /// The cell that would be spoilt.
        at: AnyCell,
        /// How.
        reason: &'static str,
    },
    /// Faces that enclose no volume.
    #[error("the faces are no volume: {reason} (face {face}, corner {corner})")]
    NotAVolume {
        /// Which of the faces.
        face: usize,
        /// Which of its corners.
        corner: usize,
        /// Why not.
        reason: &'static str,
    },
}
