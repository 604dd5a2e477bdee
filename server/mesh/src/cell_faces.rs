//! The faces of each kind of cell, wound counter-clockwise as seen from outside.

use crate::{Cell, CellType};

const TETRAHEDRON: &[&[u8]] = &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]];
const HEXAHEDRON: &[&[u8]] = &[
    &[0, 4, 7, 3],
    &[1, 2, 6, 5],
    &[0, 1, 5, 4],
    &[3, 7, 6, 2],
    &[0, 3, 2, 1],
    &[4, 5, 6, 7],
];
const WEDGE: &[&[u8]] = &[
    &[0, 1, 2],
    &[3, 5, 4],
    &[0, 3, 4, 1],
    &[1, 4, 5, 2],
    &[2, 5, 3, 0],
];
const PYRAMID: &[&[u8]] = &[
    &[0, 3, 2, 1],
    &[0, 1, 4],
    &[1, 2, 4],
    &[2, 3, 4],
    &[3, 0, 4],
];
const PENTAGONAL_PRISM: &[&[u8]] = &[
    &[0, 4, 3, 2, 1],
    &[5, 6, 7, 8, 9],
    &[0, 1, 6, 5],
    &[1, 2, 7, 6],
    &[2, 3, 8, 7],
    &[3, 4, 9, 8],
    &[4, 0, 5, 9],
];
const HEXAGONAL_PRISM: &[&[u8]] = &[
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// A face of a cell: a ring of vertices, counter-clockwise as seen from outside the cell.
#[derive(Clone, Copy, Debug)]
pub struct Face<'a> {
    vertices: &'a [u32],
    /// Which of `vertices`, in order; `None` means all.
    order: Option<&'static [u8]>,
}

impl<'a> From<&'a [u32]> for Face<'a> {
    /// The face with these vertices, three or more, in their order.
    fn from(vertices: &'a [u32]) -> Self {
        let order = None;
        Self { vertices, order }
    }
}

impl<'a> Face<'a> {
    /// Number of vertices.
    #[expect(
        clippy::len_without_is_empty,
        reason = "a face has three vertices or more"
    )]
    pub fn len(&self) -> usize {
        self.order.map_or(self.vertices.len(), <[u8]>::len)
    }

    /// Vertex `corner` of the ring.
    ///
    /// # Panics
    /// If `corner` is not below [`Face::len`].
    pub fn vertex(&self, corner: usize) -> u32 {
        match self.order {
            Some(order) => self.vertices[usize::from(order[corner])],
            None => self.vertices[corner],
        }
    }

    /// The vertices, along the ring.
    pub fn vertices(self) -> impl ExactSizeIterator<Item = u32> + use<'a> {
        (0..self.len()).map(move |corner| self.vertex(corner))
    }

    /// The edges `[from, to]`, along the ring.
    pub fn edges(self) -> impl ExactSizeIterator<Item = [u32; 2]> + use<'a> {
        let corners = self.len();
        (0..corners).map(move |corner| {
            let next = if corner + 1 == corners { 0 } else { corner + 1 };
            [self.vertex(corner), self.vertex(next)]
        })
    }
}

impl<'a> Cell<'a> {
    /// The faces; of a triangle, quad or polygon, the cell itself; of an empty cell, none. Nothing is allocated.
    pub fn faces(&self) -> impl Iterator<Item = Face<'a>> + use<'a> {
        let vertices = self.vertices;
        let mut stream = self.face_stream.get(1..).unwrap_or_default();
        let polyhedron = std::iter::from_fn(move || {
            let (&count, rest) = stream.split_first()?;
            let (ring, rest) = rest.split_at(count as usize);
            stream = rest;
            Some(Face {
                vertices: ring,
                order: None,
            })
        });
        let itself = self.kind.is_surface().then_some(Face {
            vertices,
            order: None,
        });
        let fixed = fixed_faces(self.kind).iter().map(move |&order| Face {
            vertices,
            order: Some(order),
        });
        fixed.chain(itself).chain(polyhedron)
    }
}

/// Vertex numbers within the cell, for each face of a cell that encloses a volume by a fixed pattern.
const fn fixed_faces(kind: CellType) -> &'static [&'static [u8]] {
    match kind {
        CellType::Tetrahedron => TETRAHEDRON,
        CellType::Hexahedron => HEXAHEDRON,
        CellType::Wedge => WEDGE,
        CellType::Pyramid => PYRAMID,
        CellType::PentagonalPrism => PENTAGONAL_PRISM,
        CellType::HexagonalPrism => HEXAGONAL_PRISM,
        CellType::Empty
        | CellType::Triangle
        | CellType::Quad
        | CellType::Polygon
        | CellType::Polyhedron => &[],
    }
}
