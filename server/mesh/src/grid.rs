//! The grid itself.

use nalgebra::Vector3;
use xxhash_rust::xxh3::Xxh3;

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
    pub const ALL: [Self; 10] = [
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

    /// Whether the cell encloses a volume; the others are pieces of a surface.
    pub const fn is_volume(self) -> bool {
        !matches!(self, Self::Triangle | Self::Polygon | Self::Quad)
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

    /// A number that two sets of cells share only if they are equal (up to the odds of a 64-bit hash).
    ///
    /// It is XXH3-64 (seed 0) over the columns `types`, `connectivity`, `offsets`, `faces`, `face_offsets` in this
    /// order, each written as its number of *entries* (u64, little-endian) and then its entries (u8 for `types`, u32
    /// for the others, little-endian). Clients in any language can so recompute it.
    pub fn hash(&self) -> u64 {
        let mut hasher = Xxh3::new();
        hasher.update(&(self.types.len() as u64).to_le_bytes());
        hasher.update(&self.types);
        for column in [
            &self.connectivity,
            &self.offsets,
            &self.faces,
            &self.face_offsets,
        ] {
            hasher.update(&(column.len() as u64).to_le_bytes());
            let mut bytes = [0; 4096];
            for entries in column.chunks(bytes.len() / 4) {
                for (to, entry) in bytes.chunks_exact_mut(4).zip(entries) {
                    to.copy_from_slice(&entry.to_le_bytes());
                }
                hasher.update(&bytes[..4 * entries.len()]);
            }
        }
        hasher.digest()
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
