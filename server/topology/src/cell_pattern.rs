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

/// The darts of a cell of a fixed shape, numbered from 0 within the cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pattern {
    /// The corner that each dart leaves.
    pub(crate) origin: Vec<u8>,
    /// β1.
    pub(crate) next: Vec<u8>,
    /// β2.
    pub(crate) across: Vec<u8>,
    /// Darts in each ring.
    pub(crate) rings: Vec<u8>,
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
            let first = pattern.origin.len();
            let small = |number: usize| u8::try_from(number).expect("no more than 36 darts");
            for at in 0..ring.len() {
                let corner = if inside_out { ring.len() - 1 - at } else { at };
                pattern.origin.push(ring[corner]);
                pattern.next.push(small(first + (at + 1) % ring.len()));
            }
            pattern.rings.push(small(ring.len()));
        }
        let ends = |dart: usize| {
            let next = usize::from(pattern.next[dart]);
            [pattern.origin[dart], pattern.origin[next]]
        };
        for dart in 0..pattern.origin.len() {
            let [from, to] = ends(dart);
            let across = (0u8..).find(|&other| ends(usize::from(other)) == [to, from]);
            pattern
                .across
                .push(across.expect("every pattern is closed"));
        }
        pattern
    }
}
