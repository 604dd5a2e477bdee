//! What may be asked of a body, and what it answers.

use std::ops::Range;

use sinew_topology::EditError;
use thiserror::Error;

/// A change of a body. Plain data: cells and vertices are named by their slots, so that a log of requests replays.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Tears the body along the frontier between the areas of two points: the vertices that they act on. `[T1]`
    ///
    /// Where the frontier is a set of faces, these open. Where it passes between vertices, the edges across it are split
    /// in the plane midway between the points `[T2]`, and with them every cell that has vertices in both areas; one of a shape
    /// that so cannot be parted stays whole, on the side of most of its vertices. Where the frontier is
    /// ill-defined, because the areas share whole cells or meet nowhere, the areas are drawn anew, first with fewer of
    /// each vertex's points `[T3]`, then with the vertices beside them `[T4]`.
    ///
    /// What was torn stays so: where a later tear cuts cells, so that a part is the other point's than the whole was, it
    /// opens what joins parts of points that were torn apart before.
    Separate {
        /// The points.
        points: [u32; 2],
    },
    /// Opens every face that these pairs of cells share.
    Open {
        /// Pairs of cells, by slot.
        facets: Vec<[u32; 2]>,
    },
    /// Glues faces of the boundary to each other that are the two sides of a tear: that lie upon each other at rest.
    Glue {
        /// Pairs of faces.
        facets: Vec<[Facet; 2]>,
    },
    /// Glues all two sides of tears between two fragments, or within one, that are near each other again.
    Close {
        /// The fragments, perhaps the same.
        fragments: [u32; 2],
        /// How far each two vertices that are to become one may be apart now, m.
        distance: f64,
    },
    /// Takes cells away.
    Remove {
        /// The cells, by slot.
        cells: Vec<u32>,
    },
    /// Adds new material: a prism on each of some faces of the boundary.
    Add {
        /// The faces.
        facets: Vec<Facet>,
        /// How high it is at rest, m, > 0.
        thickness: f64,
    },
    /// Divides cells: hexahedra in eight each if all are, else each in a pyramid from its midst over each face. Refused
    /// where a part would be flat or inside out of a cell that is neither.
    Subdivide {
        /// The cells, by slot.
        cells: Vec<u32>,
    },
    /// Halves edges, and with each all cells around it, which must be tetrahedra.
    Bisect {
        /// The vertices at the ends of each edge.
        edges: Vec<[u32; 2]>,
    },
    /// Draws an edge together to the first of its vertices; the other is in no cell any more. Refused where that would
    /// change what the mesh is, or turn a cell flat or inside out that is neither.
    Collapse {
        /// The vertices at the ends of the edge, first the one to stay.
        edge: [u32; 2],
    },
}

/// A face of a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Facet {
    /// The cell, by slot.
    pub cell: u32,
    /// The face's vertices, in any order.
    pub vertices: Vec<u32>,
}

/// What came of a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Done as asked.
    Applied(Done),
    /// Done after the points' areas were drawn anew.
    Refined {
        /// Of each vertex, so many of its strongest points counted. `[T3]`
        kept: u32,
        /// So many edges the areas then grew beyond their vertices. `[T4]`
        grown: u32,
        /// What was done.
        done: Done,
    },
    /// Nothing was done.
    Refused(Refusal),
}

/// What a request did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Done {
    /// Faces that came apart.
    pub opened: u32,
    /// Faces that came together.
    pub closed: u32,
    /// The cells it is about, by slot, ascending: those beside the faces, or those removed, added or divided.
    pub cells: Vec<u32>,
    /// The vertices that it appended.
    pub vertices: Range<u32>,
    /// What else came of it, in order.
    pub effects: Vec<Effect>,
}

impl Done {
    /// Adds what was done next.
    pub(crate) fn take(&mut self, more: Self) {
        self.opened += more.opened;
        self.closed += more.closed;
        self.cells.extend(more.cells);
        self.cells.sort_unstable();
        self.cells.dedup();
        self.vertices.end = more.vertices.end;
        self.effects.extend(more.effects);
    }
}

/// What followed from a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// A part of the body came loose.
    FragmentBorn {
        /// Its number; the body at rest has those from 0 on.
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

/// Why a request was refused. The body is as it was before.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Refusal {
    /// A slot without a cell.
    #[error("there is no cell {cell}, or no more")]
    NoCell {
        /// The slot.
        cell: u32,
    },
    /// Two cells without a face in common.
    #[error("cells {} and {} share no face", cells[0], cells[1])]
    NoFacet {
        /// The cells.
        cells: [u32; 2],
    },
    /// A point that does not exist, or acts on no vertex, or twice the same.
    #[error("point {point} has no area of its own to be separated from the other's")]
    NoArea {
        /// The point.
        point: u32,
    },
    /// Areas of points that share whole cells, however few points of each vertex count.
    #[error("the areas of points {} and {} share {} whole cells; drive each vertex by fewer points", points[0], points[1], cells.len())]
    Overlap {
        /// The points.
        points: [u32; 2],
        /// The cells that both share.
        cells: Vec<u32>,
    },
    /// Areas of points that meet nowhere, however far they grow.
    #[error("the areas of points {} and {} do not meet", points[0], points[1])]
    Gap {
        /// The points.
        points: [u32; 2],
        /// Cells at the borders of the areas, where they were to meet.
        cells: Vec<u32>,
    },
    /// A face that a cell does not have, or shares with another cell.
    #[error("cell {cell} has no such face, or shares it with another cell")]
    NoFreeFacet {
        /// The cell.
        cell: u32,
    },
    /// Faces that do not lie upon each other at rest.
    #[error("faces of cells {} and {} do not lie upon each other at rest; only what was torn can be glued", cells[0], cells[1])]
    Apart {
        /// The cells.
        cells: [u32; 2],
    },
    /// Cells that would touch themselves.
    #[error("{} cells would touch themselves", cells.len())]
    Spoilt {
        /// The cells.
        cells: Vec<u32>,
    },
    /// Two vertices that no edge joins.
    #[error("no edge joins vertices {} and {}", vertices[0], vertices[1])]
    NoEdge {
        /// The vertices.
        vertices: [u32; 2],
    },
    /// Cells around an edge to be halved that are no tetrahedra.
    #[error(
        "around an edge to be halved {} cells are no tetrahedra; halve edges of tetrahedra alone, or subdivide the cells", cells.len()
    )]
    NoTetrahedra {
        /// The cells.
        cells: Vec<u32>,
    },
    /// An edge whose collapse would change what the mesh is.
    #[error(
        "the edge of vertices {} and {} cannot be drawn together: {reason}; halve an edge beside it first, or take another", vertices[0], vertices[1]
    )]
    Tangled {
        /// The edge's.
        vertices: [u32; 2],
        /// What would be wrong.
        reason: &'static str,
        /// The cell that would be spoilt, or those around the edge.
        cells: Vec<u32>,
    },
    /// An edge whose collapse would turn cells flat or inside out.
    #[error(
        "drawing vertex {} to vertex {} would turn {} cells flat or inside out; draw the other way, or take another edge", vertices[1], vertices[0], cells.len()
    )]
    Folds {
        /// The edge's, first the one to stay.
        vertices: [u32; 2],
        /// The cells.
        cells: Vec<u32>,
    },
    /// Cells of which subdividing would make parts that are flat or inside out.
    #[error(
        "{} cells are too warped to be divided from their middle: a part would be flat or inside out; leave them out", cells.len()
    )]
    Blind {
        /// The cells.
        cells: Vec<u32>,
    },
    /// Points that the mapping would not let part.
    #[error(
        "the mapping weighs points by straight distances, which lead through a tear: its two sides would go on moving alike; use mapping.weighting.flood, or open faces"
    )]
    Straight,
    /// A thickness that is none.
    #[error("a thickness of {thickness} m: give one above 0")]
    Thickness {
        /// The thickness, m.
        thickness: f64,
    },
    /// A request about nothing.
    #[error("the request names nothing to change")]
    Nothing,
    /// What follows the body could not follow this, and it was taken back.
    #[error("the mapping cannot follow: {reason}")]
    Unfollowed {
        /// What was in the way, for people.
        reason: String,
    },
    /// The map refused.
    #[error(transparent)]
    Edit(#[from] EditError),
}

impl Refusal {
    /// The cells that stand in the way, by slot.
    pub fn cells(&self) -> &[u32] {
        match self {
            Self::NoCell { cell } | Self::NoFreeFacet { cell } => std::slice::from_ref(cell),
            Self::NoFacet { cells } | Self::Apart { cells } => cells,
            Self::Spoilt { cells }
            | Self::Overlap { cells, .. }
            | Self::Gap { cells, .. }
            | Self::NoTetrahedra { cells }
            | Self::Tangled { cells, .. }
            | Self::Folds { cells, .. }
            | Self::Blind { cells } => cells,
            Self::NoEdge { .. }
            | Self::Thickness { .. }
            | Self::NoArea { .. }
            | Self::Nothing
            | Self::Straight
            | Self::Unfollowed { .. }
            | Self::Edit(_) => &[],
        }
    }
}
