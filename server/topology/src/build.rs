//! From meshes to maps.

mod faces;
mod manifold;
mod names;
mod open_faces;
mod orient;
mod rings;
mod surface;
mod weave;

use thiserror::Error;

use crate::input::{InputError, MeshCells};
use crate::{Cell, Map, Vertex};

/// What to do with a mesh that is no manifold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NonManifold {
    /// Refuse it.
    Refuse,
    /// Split it. Cells stay apart at a face (in a surface, an edge) of three or more, edges and vertices become as many
    /// as the parts that meet there, and the report says where.
    Split,
}

/// Why a mesh cannot become a map.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BuildError {
    /// The columns make no sense together.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A cell that uses a vertex twice.
    #[error("cell {cell} uses vertex {vertex} twice; drop the cell")]
    RepeatedVertex {
        /// The cell.
        cell: usize,
        /// The vertex.
        vertex: u32,
    },
    /// A polyhedron whose faces enclose nothing.
    #[error(
        "polyhedron {cell} is open or not one piece: its edge {ends:?} is in {uses} of its faces, not in 2"
    )]
    OpenPolyhedron {
        /// The cell.
        cell: usize,
        /// The edge.
        ends: [u32; 2],
        /// Faces of the cell with that edge.
        uses: usize,
    },
    /// A polyhedron that is no single closed surface.
    #[error("the faces of polyhedron {cell} {problem}")]
    BadPolyhedron {
        /// The cell.
        cell: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// Two cells with the same faces.
    #[error("cells {cells:?} have the same vertices; drop one")]
    DuplicateCells {
        /// The cells.
        cells: [u32; 2],
    },
    /// Cells that cannot be oriented alike.
    #[error(
        "cell {cell} closes a loop of cells that comes back mirrored, like a Möbius strip; cut the mesh there"
    )]
    NotOrientable {
        /// The cell.
        cell: usize,
    },
    /// Not a manifold, and not to be split.
    #[error("not a manifold: {} faces of three cells or more, {} edges and {} vertices where parts touch; the first: {}", faces.len(), edges.len(), vertices.len(), first_of(faces, edges, vertices))]
    NonManifold {
        /// The cells at each face (in a surface, edge) of three or more.
        faces: Vec<Vec<u32>>,
        /// Edges, by their vertices, where parts touch that have no face in common there.
        edges: Vec<[u32; 2]>,
        /// Vertices where parts touch that have no face (in a surface, edge) in common there.
        vertices: Vec<u32>,
    },
}

fn first_of(faces: &[Vec<u32>], edges: &[[u32; 2]], vertices: &[u32]) -> String {
    match (faces.first(), edges.first(), vertices.first()) {
        (Some(cells), _, _) => format!("the face of cells {cells:?}"),
        (_, Some(ends), _) => format!("edge {ends:?}"),
        (_, _, Some(vertex)) => format!("vertex {vertex}"),
        (None, None, None) => "none".into(),
    }
}

/// What was found odd in a mesh, and put right.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BuildReport {
    /// Cells that were turned inside out, so that all of their component wind alike. Of each component the fewer were.
    pub turned: Vec<u32>,
    /// Polyhedra whose faces did not wind alike.
    pub rewound: Vec<u32>,
    /// Vertices of no cell. Their slots stay empty.
    pub isolated: Vec<u32>,
    /// Faces (in a surface, edges) of three cells or more, where these were left apart; the cells of each.
    pub split_faces: Vec<Vec<u32>>,
    /// Edges of the mesh that are several in the map, by the mesh's vertices.
    pub split_edges: Vec<[u32; 2]>,
    /// New vertices, appended to the mesh's, and the mesh's vertex that each was split from.
    pub split_vertices: Vec<(Cell<Vertex>, u32)>,
}

impl Map {
    /// Builds the map of a mesh. Vertices and volumes keep the mesh's numbers (in a surface, components are the volumes,
    /// and the faces keep theirs).
    ///
    /// # Errors
    /// The first [`BuildError`] found.
    pub fn build(
        mesh: &MeshCells<'_>,
        otherwise: NonManifold,
    ) -> Result<(Self, BuildReport), BuildError> {
        let extent = mesh.check()?;
        match extent.is_surface {
            true => surface::build(mesh, extent, otherwise),
            false => weave::build(mesh, extent, otherwise),
        }
    }
}

/// Two rings (in a surface, darts) of the same vertices: a dart of each, by number.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// Darts of a triangle or any other ring that leave the same vertex; in a surface, darts of the same edge.
    darts: [u32; 2],
    /// Whether both wind the same way, so that one of the cells is inside out.
    is_mirrored: bool,
}

#[derive(Debug, Default)]
struct Partners {
    pairs: Vec<Pair>,
    /// Of each face of three or more cells, a dart of each.
    crowded: Vec<Vec<u32>>,
}

impl Partners {
    /// The cells at each crowded face.
    fn crowded_cells(&self, rings: &rings::Rings) -> Vec<Vec<u32>> {
        let cells = |darts: &Vec<u32>| darts.iter().map(|&dart| rings.cell_of(dart)).collect();
        self.crowded.iter().map(cells).collect()
    }
}
