//! The darts of each kind of cell, in the order in which they are made.

/// Rings of corners, counter-clockwise as seen from outside.
type Rings = &'static [&'static [u8]];

const TETRAHEDRON: Rings = &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]];
const HEXAHEDRON: Rings = &[
    &[0, 4, 7, 3],
    &[1, 2, 6, 5],
    &[0, 1, 5, 4],
    &[3, 7, 6, 2],
    &[0, 3, 2, 1],
    &[4, 5, 6, 7],
];
const WEDGE: Rings = &[
    &[0, 1, 2],
    &[3, 5, 4],
    &[0, 3, 4, 1],
    &[1, 4, 5, 2],
    &[2, 5, 3, 0],
];
const PYRAMID: Rings = &[
    &[0, 3, 2, 1],
    &[0, 1, 4],
    &[1, 2, 4],
    &[2, 3, 4],
    &[3, 0, 4],
];
const PENTAGONAL_PRISM: Rings = &[
    &[0, 4, 3, 2, 1],
    &[5, 6, 7, 8, 9],
    &[0, 1, 6, 5],
    &[1, 2, 7, 6],
    &[2, 3, 8, 7],
    &[3, 4, 9, 8],
    &[4, 0, 5, 9],
];
const HEXAGONAL_PRISM: Rings = &[
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// How many of what a kind of cell has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) is_surface: bool,
    /// Fewest and most vertices.
    pub(crate) least: usize,
    pub(crate) most: usize,
    /// Darts and faces, where the number of vertices decides.
    pub(crate) darts: usize,
    pub(crate) rings: usize,
}

/// The darts of a cell, numbered from 0 within the cell, ring by ring.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pattern {
    /// The corner that each dart leaves.
    pub(crate) origin: Vec<u32>,
    /// β1.
    pub(crate) next: Vec<u32>,
    /// β2; empty in a surface.
    pub(crate) across: Vec<u32>,
    /// The edge of each dart, of those of the cell.
    pub(crate) edge: Vec<u32>,
    /// Darts in each ring.
    pub(crate) rings: Vec<u32>,
    /// The first dart of each corner and edge.
    pub(crate) first_of_corner: Vec<u32>,
    pub(crate) first_of_edge: Vec<u32>,
}

impl Pattern {
    pub(crate) fn shape(kind: u8) -> Option<Shape> {
        let surface = |least, most| Shape {
            is_surface: true,
            least,
            most,
            darts: 0,
            rings: 1,
        };
        let volume = |corners, rings: Rings| Shape {
            is_surface: false,
            least: corners,
            most: corners,
            darts: rings.iter().map(|ring| ring.len()).sum(),
            rings: rings.len(),
        };
        Some(match kind {
            5 => surface(3, 3),
            7 => surface(3, usize::MAX),
            9 => surface(4, 4),
            10 => volume(4, TETRAHEDRON),
            12 => volume(8, HEXAHEDRON),
            13 => volume(6, WEDGE),
            14 => volume(5, PYRAMID),
            15 => volume(10, PENTAGONAL_PRISM),
            16 => volume(12, HEXAGONAL_PRISM),
            crate::input::POLYHEDRON => volume(0, &[]),
            _ => return None,
        })
    }

    /// The rings of a kind whose shape is fixed; else none.
    pub(crate) fn rings_of(kind: u8) -> Rings {
        match kind {
            10 => TETRAHEDRON,
            12 => HEXAHEDRON,
            13 => WEDGE,
            14 => PYRAMID,
            15 => PENTAGONAL_PRISM,
            16 => HEXAGONAL_PRISM,
            _ => &[],
        }
    }

    /// The pattern of a kind, as it is or turned inside out (every ring the other way around).
    pub(crate) fn new(kind: u8, inside_out: bool) -> Self {
        let mut pattern = Self::default();
        for ring in Self::rings_of(kind) {
            pattern.push_ring(ring.iter().map(|&corner| u32::from(corner)), inside_out);
        }
        pattern.close();
        let corners = pattern.origin.iter().max().map_or(0, |&corner| corner + 1);
        pattern.first_of_corner = (0..corners)
            .map(|corner| pattern.number(pattern.origin.iter().position(|&of| of == corner)))
            .collect();
        pattern
    }

    pub(crate) fn clear(&mut self) {
        let Self {
            origin,
            next,
            across,
            edge,
            rings,
            first_of_corner,
            first_of_edge,
        } = self;
        let columns = [origin, next, across, edge, rings];
        columns.into_iter().for_each(Vec::clear);
        first_of_corner.clear();
        first_of_edge.clear();
    }

    fn number(&self, dart: Option<usize>) -> u32 {
        let number = dart.and_then(|dart| u32::try_from(dart).ok());
        number.expect("fewer than Dart::MOST darts, and corners have darts")
    }

    /// Adds a ring of corners, or until [`Pattern::name_corners`] of whatever tells these apart.
    pub(crate) fn push_ring(
        &mut self,
        corners: impl DoubleEndedIterator<Item = u32>,
        inside_out: bool,
    ) {
        let first = self.origin.len();
        if inside_out {
            self.origin.extend(corners.rev());
        } else {
            self.origin.extend(corners);
        }
        let [first, end] = [first, self.origin.len()].map(|dart| self.number(Some(dart)));
        self.next.extend(first + 1..end);
        self.next.push(first);
        self.rings.push(end - first);
    }

    /// Finds the edges of the closed surface that the rings make: each edge comes twice, once in each direction.
    pub(crate) fn close(&mut self) {
        let mut uses: Vec<_> = (0u32..)
            .zip(self.origin.iter().zip(&self.next))
            .map(|(dart, (&from, &next))| {
                let to = self.origin[next as usize];
                (from.min(to), from.max(to), dart)
            })
            .collect();
        uses.sort_unstable();
        self.across.resize(uses.len(), 0);
        for pair in uses.chunks_exact(2) {
            let [one, other] = [pair[0].2, pair[1].2];
            self.across[one as usize] = other;
            self.across[other as usize] = one;
        }
        for dart in 0..self.across.len() {
            let across = self.across[dart] as usize;
            let edge = match across < dart {
                true => self.edge[across],
                false => {
                    self.first_of_edge.push(self.number(Some(dart)));
                    self.number(Some(self.first_of_edge.len() - 1))
                }
            };
            self.edge.push(edge);
        }
    }

    /// Numbers the corners of a closed surface whose rings were pushed as vertices, which are put into `corners`. A vertex
    /// where the surface touches itself is several corners.
    pub(crate) fn name_corners(&mut self, corners: &mut Vec<u32>) {
        let vertices = std::mem::take(&mut self.origin);
        self.origin.resize(vertices.len(), u32::MAX);
        for (dart, &vertex) in vertices.iter().enumerate() {
            if self.origin[dart] != u32::MAX {
                continue;
            }
            let corner = self.number(Some(corners.len()));
            corners.push(vertex);
            self.first_of_corner.push(self.number(Some(dart)));
            let mut at = dart;
            while self.origin[at] == u32::MAX {
                self.origin[at] = corner;
                at = self.next[self.across[at] as usize] as usize;
            }
        }
    }
}
