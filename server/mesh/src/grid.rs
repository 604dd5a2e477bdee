//! The grid itself.

use nalgebra::Vector3;
use xxhash_rust::xxh3::xxh3_64;

/// VTK's number for a kind of cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum CellType {
    /// No vertices: the slot of a cell that was taken away.
    Empty = 0,
    /// Three vertices.
    Triangle = 5,
    /// Any number of vertices in a plane.
    Polygon = 7,
    /// Four vertices.
    Quad = 9,
    /// Four vertices; 0, 1, 2 wind counter-clockwise as seen from 3.
    Tetrahedron = 10,
    /// Eight vertices; 0 to 3 wind counter-clockwise as seen from 4 to 7 opposite.
    Hexahedron = 12,
    /// Six vertices; 0, 1, 2 wind *clockwise* as seen from 3, 4, 5 opposite. This is VTK's order; Gmsh, Medit and MFEM
    /// wind the other way (swap 1 with 2 and 4 with 5).
    Wedge = 13,
    /// Five vertices; the base 0 to 3 winds counter-clockwise as seen from the apex 4.
    Pyramid = 14,
    /// Ten vertices; 0 to 4 wind counter-clockwise as seen from 5 to 9 opposite.
    PentagonalPrism = 15,
    /// Twelve vertices; 0 to 5 wind counter-clockwise as seen from 6 to 11 opposite.
    HexagonalPrism = 16,
    /// Any closed set of polygons; its faces stand in the face stream and wind counter-clockwise as seen from outside.
    Polyhedron = 42,
}

impl CellType {
    /// Every kind, by ascending number.
    pub const ALL: [Self; 11] = [
        Self::Empty,
        Self::Triangle,
        Self::Polygon,
        Self::Quad,
        Self::Tetrahedron,
        Self::Hexahedron,
        Self::Wedge,
        Self::Pyramid,
        Self::PentagonalPrism,
        Self::HexagonalPrism,
        Self::Polyhedron,
    ];

    /// The kind with VTK's `number`, or `None` where no kind here has it.
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::Empty,
            5 => Self::Triangle,
            7 => Self::Polygon,
            9 => Self::Quad,
            10 => Self::Tetrahedron,
            12 => Self::Hexahedron,
            13 => Self::Wedge,
            14 => Self::Pyramid,
            15 => Self::PentagonalPrism,
            16 => Self::HexagonalPrism,
            42 => Self::Polyhedron,
            _ => return None,
        })
    }

    /// VTK's number.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// How many vertices every such cell has, or `None` where the number is free.
    pub const fn vertex_count(self) -> Option<usize> {
        match self {
            Self::Empty => Some(0),
            Self::Triangle => Some(3),
            Self::Quad | Self::Tetrahedron => Some(4),
            Self::Pyramid => Some(5),
            Self::Wedge => Some(6),
            Self::Hexahedron => Some(8),
            Self::PentagonalPrism => Some(10),
            Self::HexagonalPrism => Some(12),
            Self::Polygon | Self::Polyhedron => None,
        }
    }

    /// Whether the cell encloses a volume.
    pub const fn is_volume(self) -> bool {
        !matches!(self, Self::Empty) && !self.is_surface()
    }

    /// Whether the cell is a piece of a surface.
    pub const fn is_surface(self) -> bool {
        matches!(self, Self::Triangle | Self::Polygon | Self::Quad)
    }
}

/// The cells of a grid, in VTK's form. Indices are vertex indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cells {
    /// One [`CellType`] number per cell.
    pub types: Vec<u8>,
    /// The vertices of all cells, one cell after the other; of a polyhedron, each vertex of its faces once.
    pub connectivity: Vec<u32>,
    /// Where each cell starts in `connectivity`; one entry more than cells.
    pub offsets: Vec<u32>,
    /// Face streams of the polyhedra: face count, then per face its vertex count and vertices. Empty without polyhedra.
    pub faces: Vec<u32>,
    /// Where each cell's stream starts in `faces`; one entry more than cells, or empty without polyhedra.
    pub face_offsets: Vec<u32>,
}

impl Default for Cells {
    /// No cells. (`offsets` is `[0]`: one entry more than cells.)
    fn default() -> Self {
        Self {
            types: Vec::new(),
            connectivity: Vec::new(),
            offsets: vec![0],
            faces: Vec::new(),
            face_offsets: Vec::new(),
        }
    }
}

/// One cell of checked [`Cells`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell<'a> {
    /// Its kind.
    pub kind: CellType,
    /// Its vertices, in VTK's order for the kind.
    pub vertices: &'a [u32],
    /// Of a polyhedron, the face count, then per face its vertex count and vertices; of other cells, empty.
    pub face_stream: &'a [u32],
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.types.len()
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.types.is_empty()
    }

    /// The cell with index `cell`.
    ///
    /// # Panics
    /// If there is no such cell, or the cells would not pass [`Cells::check`].
    pub fn cell(&self, cell: usize) -> Cell<'_> {
        let kind = CellType::from_number(self.types[cell]).expect("checked cells have known types");
        let vertices =
            &self.connectivity[self.offsets[cell] as usize..self.offsets[cell + 1] as usize];
        let face_stream = if self.face_offsets.is_empty() {
            &[]
        } else {
            &self.faces[self.face_offsets[cell] as usize..self.face_offsets[cell + 1] as usize]
        };
        Cell {
            kind,
            vertices,
            face_stream,
        }
    }

    /// All cells, by ascending index.
    ///
    /// # Panics
    /// As [`Cells::cell`].
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Cell<'_>> {
        (0..self.len()).map(|cell| self.cell(cell))
    }

    /// Appends a cell. Columns of `self` stay consistent; whether the cell is one, [`Cells::check`] tells.
    ///
    /// # Panics
    /// If a column would grow beyond `u32::MAX` entries.
    pub fn push(&mut self, cell: Cell<'_>) {
        let end = |length: usize| u32::try_from(length).expect("columns stay below u32::MAX");
        if self.face_offsets.is_empty() && !cell.face_stream.is_empty() {
            self.face_offsets = vec![0; self.len() + 1];
        }
        self.types.push(cell.kind.number());
        self.connectivity.extend_from_slice(cell.vertices);
        self.offsets.push(end(self.connectivity.len()));
        if !self.face_offsets.is_empty() {
            self.faces.extend_from_slice(cell.face_stream);
            self.face_offsets.push(end(self.faces.len()));
        }
    }

    /// A number that two sets of cells share only if they are equal (up to the odds of a 64-bit hash): the sum of
    /// [`Cells::slot_hash`] over all slots, modulo 2⁶⁴. It so follows a change of some slots at their cost.
    ///
    /// # Panics
    /// As [`Cells::cell`].
    pub fn hash(&self) -> u64 {
        (0..self.len()).fold(0, |sum, slot| sum.wrapping_add(self.slot_hash(slot)))
    }

    /// What the cell with index `slot` adds to [`Cells::hash`]; see [`Cell::hash`].
    ///
    /// # Panics
    /// As [`Cells::cell`].
    pub fn slot_hash(&self, slot: usize) -> u64 {
        let number = u32::try_from(slot).expect("columns stay below u32::MAX");
        self.cell(slot).hash(number)
    }
}

impl Cell<'_> {
    /// A number for this cell in this slot: XXH3-64 (seed 0) of `slot`, the type's number, the number of vertices, the
    /// vertices and the face stream, each entry as a u32, little-endian. Clients in any language can so recompute it.
    pub fn hash(&self, slot: u32) -> u64 {
        let count = u32::try_from(self.vertices.len()).expect("columns stay below u32::MAX");
        let head = [slot, u32::from(self.kind.number()), count];
        let entries = head.iter().chain(self.vertices).chain(self.face_stream);
        // Cells but for polyhedra fit; a streaming hasher would cost more than the hash.
        let mut fixed = [0; 4 * (3 + 12)];
        let length = 4 * (head.len() + self.vertices.len() + self.face_stream.len());
        let mut long = Vec::new();
        let bytes = match fixed.get_mut(..length) {
            Some(bytes) => bytes,
            None => {
                long.resize(length, 0);
                &mut long
            }
        };
        for (to, entry) in bytes.chunks_exact_mut(4).zip(entries) {
            to.copy_from_slice(&entry.to_le_bytes());
        }
        xxh3_64(bytes)
    }
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
