//! What may be asked of a body, and what it answers.

use std::ops::Range;

use sinew_topology::EditError;
use thiserror::Error;

/// A change of a body. Plain data: cells and vertices are named by their slots, so that a log of requests replays.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Opens every face that these pairs of cells share.
    Open {
        /// Pairs of cells, by slot.
        facets: Vec<[u32; 2]>,
    },
    /// Takes cells away.
    Remove {
        /// The cells, by slot.
        cells: Vec<u32>,
    },
}

/// What came of a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Done as asked.
    Applied(Done),
    /// Done after the points' areas were drawn anew.
    Refined {
        /// Of each vertex, so many of its strongest points counted.
        kept: u32,
        /// So many edges the areas then grew beyond their vertices.
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
    /// A request about nothing.
    #[error("the request names nothing to change")]
    Nothing,
    /// The map refused.
    #[error(transparent)]
    Edit(#[from] EditError),
}

impl Refusal {
    /// The cells that stand in the way, by slot.
    pub fn cells(&self) -> &[u32] {
        match self {
            Self::NoCell { cell } => std::slice::from_ref(cell),
            Self::NoFacet { cells } => cells,
            Self::Nothing | Self::Edit(_) => &[],
        }
    }
}
