//! The grid itself.

use nalgebra::Vector3;

/// VTK's number for a kind of cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum CellType {
    /// Three vertices.
    Triangle = 5,
    /// Any number of vertices in a plane.
    Polygon = 7,
    /// Four vertices.
    Quad = 9,
    /// Four vertices.
    Tetrahedron = 10,
    /// Eight vertices.
    Hexahedron = 12,
    /// Six vertices.
    Wedge = 13,
    /// Five vertices.
    Pyramid = 14,
    /// Ten vertices.
    PentagonalPrism = 15,
    /// Twelve vertices.
    HexagonalPrism = 16,
    /// Any closed set of polygons; its faces stand in the face stream.
    Polyhedron = 42,
}

/// The cells of a grid, in VTK's form. Indices are vertex indices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cells {
    /// One [`CellType`] number per cell.
    pub types: Vec<u8>,
    /// The vertices of all cells, one cell after the other.
    pub connectivity: Vec<u32>,
    /// Where each cell starts in `connectivity`; one entry more than cells.
    pub offsets: Vec<u32>,
    /// Face streams of the polyhedra: face count, then per face its vertex count and vertices. Empty without polyhedra.
    pub faces: Vec<u32>,
    /// Where each cell's stream starts in `faces`; one entry more than cells, or empty without polyhedra.
    pub face_offsets: Vec<u32>,
}

/// A mesh: positions and cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    /// One per vertex, m.
    pub positions: Vec<Vector3<f64>>,
    /// The cells.
    pub cells: Cells,
}

/// The cells of a lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellShape {
    /// Cubes; stepped surface.
    Hexahedron,
    /// Tetrahedra; smooth surface.
    Tetrahedron,
}
