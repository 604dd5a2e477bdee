//! Isosurface stuffing: F. Labelle, J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
//! Angles", SIGGRAPH 2007, in its uniform form.
//!
//! A body-centred cubic lattice has a point at every corner and every centre of the cubes. *Long* edges join
//! neighbours of the same sort, *short* ones a corner and a centre; every tetrahedron has two opposite long edges. Where
//! the surface crosses an edge close to one end, that end is moved onto it; what then still crosses is cut.

use nalgebra::Vector3;

use crate::solid::{Place, Sample, Solid, find_sorted};
use crate::{Cell, CellType, Cells, Grid};

/// How close to an end a crossing must be to move it, as a fraction of a long edge.
///
/// With [`WARP_SHORT`], a little below the paper's 0.24999 and 0.41189: those let three moved ends press a tetrahedron to
/// 9.2°, these to 11.6° (by enumeration). 22 million tetrahedra in random solids had 10.1° to 157.7°.
const WARP_LONG: f64 = 0.24;

/// As [`WARP_LONG`], of a short edge.
const WARP_SHORT: f64 = 0.39;

/// From a point to its neighbours, in half cube edges, in the order of their places.
const STEPS: [[i64; 3]; 14] = [
    [0, 0, -2],
    [-1, -1, -1],
    [1, -1, -1],
    [-1, 1, -1],
    [1, 1, -1],
    [0, -2, 0],
    [-2, 0, 0],
    [2, 0, 0],
    [0, 2, 0],
    [-1, -1, 1],
    [1, -1, 1],
    [-1, 1, 1],
    [1, 1, 1],
    [0, 0, 2],
];

/// Along each axis, the long edge and the ring of points around it, as entries of [`STEPS`].
const RINGS: [(usize, [usize; 4]); 3] = [
    (7, [2, 4, 12, 10]),
    (8, [3, 4, 12, 11]),
    (13, [9, 10, 12, 11]),
];

/// No such neighbour.
const NONE: u32 = u32::MAX;

/// Fills `solid` with tetrahedra; `spacing` is the length of the long edges, m.
pub(crate) fn stuff(spacing: f64, solid: &impl Solid) -> Grid {
    let mut lattice = Lattice::new(spacing, solid);
    lattice.cut(solid);
    lattice.warp();
    lattice.fill()
}

/// Where the surface crosses an edge of the lattice.
struct Crossing {
    /// Lattice point inside the solid.
    inside: u32,
    /// Lattice point outside.
    outside: u32,
    /// Of the way from inside to outside.
    fraction: f64,
    position: Vector3<f64>,
}

/// The lattice points in and near the solid, by ascending place.
struct Lattice {
    places: Vec<Place>,
    positions: Vec<Vector3<f64>>,
    /// Above 0 inside, below outside, 0 on the surface.
    depths: Vec<f64>,
    neighbours: Vec<[u32; 14]>,
    samples: Vec<Sample>,
    /// Where each point starts in `samples`.
    starts: Vec<usize>,
    /// By ascending `inside`, then `outside`.
    crossings: Vec<Crossing>,
}

impl Lattice {
    fn new(spacing: f64, solid: &impl Solid) -> Self {
        // A tetrahedron with a vertex inside has the others within one long edge; the rest allows for rounding.
        let margin = 1.001 * spacing;
        let mut samples = Vec::new();
        for half in [0, 1] {
            let shift = half as f64 / 2.0;
            solid.sample(spacing, shift, margin, |index, part, depth| {
                if depth > -margin {
                    let place = Place::new(index.map(|at| 2 * at + half));
                    samples.push(Sample { place, part, depth });
                }
            });
        }
        samples.sort_unstable_by_key(|sample| (sample.place, sample.part));
        let (mut places, mut depths, mut starts) = (Vec::new(), Vec::new(), vec![0]);
        for same in samples.chunk_by(|a, b| a.place == b.place) {
            places.push(same[0].place);
            depths.push(solid.depth(same));
            starts.push(starts[starts.len() - 1] + same.len());
        }
        let mut neighbours = vec![[NONE; 14]; places.len()];
        for (slot, step) in STEPS.into_iter().enumerate() {
            let queries = places.iter().map(|place| place.step(step));
            for (found, of) in find_sorted(&places, queries).zip(&mut neighbours) {
                of[slot] = found.map_or(NONE, index);
            }
        }
        Self {
            positions: (places.iter())
                .map(|place| place.position(0.5 * spacing))
                .collect(),
            places,
            depths,
            neighbours,
            samples,
            starts,
            crossings: Vec::new(),
        }
    }

    /// Finds where the surface crosses edges.
    fn cut(&mut self, solid: &impl Solid) {
        for inside in 0..self.places.len() {
            if self.depths[inside] <= 0.0 {
                continue;
            }
            for outside in self.neighbours[inside] {
                // A point inside has all its neighbours, by the margin.
                if outside == NONE || self.depths[outside as usize] >= 0.0 {
                    continue;
                }
                let near = &self.samples[self.starts[inside]..self.starts[inside + 1]];
                let end = |point: usize| (self.positions[point], self.depths[point]);
                let (from, to) = (end(inside), end(outside as usize));
                let fraction = solid.crossing(near, from, to);
                self.crossings.push(Crossing {
                    inside: index(inside),
                    outside,
                    fraction,
                    position: from.0 + (to.0 - from.0) * fraction,
                });
            }
        }
    }

    fn crossing(&self, inside: u32, outside: u32) -> usize {
        let key = |crossing: &Crossing| (crossing.inside, crossing.outside);
        self.crossings
            .binary_search_by_key(&(inside, outside), key)
            .expect("every edge between inside and outside is cut")
    }

    /// Moves points onto the surface where it crosses one of their edges close by. That uncuts all edges of the point.
    fn warp(&mut self) {
        for point in 0..self.places.len() {
            let mut closest: Option<(f64, Vector3<f64>)> = None;
            for (slot, other) in self.neighbours[point].into_iter().enumerate() {
                if other == NONE || self.depths[point] * self.depths[other as usize] >= 0.0 {
                    continue;
                }
                let crossing = if self.depths[point] > 0.0 {
                    self.crossing(index(point), other)
                } else {
                    self.crossing(other, index(point))
                };
                let Crossing {
                    fraction, position, ..
                } = self.crossings[crossing];
                let fraction = if self.depths[point] > 0.0 {
                    fraction
                } else {
                    1.0 - fraction
                };
                let is_long = STEPS[slot].contains(&0);
                let distance = (position - self.positions[point]).norm();
                if fraction < if is_long { WARP_LONG } else { WARP_SHORT }
                    && closest.is_none_or(|(least, _)| distance < least)
                {
                    closest = Some((distance, position));
                }
            }
            if let Some((_, position)) = closest {
                self.positions[point] = position;
                self.depths[point] = 0.0;
            }
        }
    }

    /// Keeps what is inside of every tetrahedron of the lattice.
    fn fill(self) -> Grid {
        let mut tetrahedra = Vec::new();
        for (point, around) in self.neighbours.iter().enumerate() {
            // Every tetrahedron has one long edge between corners of cubes; those have even coordinates.
            if self.places[point].coordinates()[0] % 2 != 0 {
                continue;
            }
            for (end, ring) in RINGS {
                for side in 0..4 {
                    let corners = [end, ring[side], ring[(side + 1) % 4]].map(|slot| around[slot]);
                    if !corners.contains(&NONE) {
                        let [b, c, d] = corners;
                        self.fill_tetrahedron([index(point), b, c, d], &mut tetrahedra);
                    }
                }
            }
        }
        let crossings = self.crossings.into_iter().map(|crossing| crossing.position);
        let mut positions = self.positions;
        positions.extend(crossings);
        assemble(&positions, tetrahedra)
    }

    /// Adds the part of one tetrahedron that lies inside, in any orientation. Crossings count as vertices behind the
    /// lattice's points.
    fn fill_tetrahedron(&self, corners: [u32; 4], out: &mut Vec<[u32; 4]>) {
        let (mut inside, mut on, mut outside) =
            (Corners::default(), Corners::default(), Corners::default());
        for corner in corners {
            let depth = self.depths[corner as usize];
            if depth > 0.0 {
                inside.push(corner);
            } else if depth < 0.0 {
                outside.push(corner);
            } else {
                on.push(corner);
            }
        }
        let cut = |a: u32, m: u32| index(self.places.len() + self.crossing(a, m));
        match (inside.get(), on.get(), outside.get()) {
            ([], _, _) => {}
            (_, _, []) => out.push(corners),
            (&[a], &[y, z], &[m]) => out.push([a, y, z, cut(a, m)]),
            (&[a], &[z], &[m, n]) => out.push([a, z, cut(a, m), cut(a, n)]),
            (&[a], _, &[m, n, o]) => out.push([a, cut(a, m), cut(a, n), cut(a, o)]),
            (&[a, b], &[z], &[m]) => {
                let touched = self.diagonal(a, b, m);
                let other = if touched == a { b } else { a };
                out.push([z, touched, other, cut(other, m)]);
                out.push([z, touched, cut(other, m), cut(touched, m)]);
            }
            (&[a, b], _, &[m, n]) => {
                // Name the outer two so that the diagonals are b to am, and a to bn; then am to bn splits the rest.
                let (m, n) = if self.diagonal(a, b, m) == b {
                    (m, n)
                } else {
                    (n, m)
                };
                let apex = cut(a, m);
                out.push([apex, b, cut(b, m), cut(b, n)]);
                out.push([apex, a, b, cut(b, n)]);
                out.push([apex, a, cut(b, n), cut(a, n)]);
            }
            (&[a, b, c], _, &[m]) => {
                // The one across the long edge from m: its crossing is touched by both diagonals beside it.
                let (p, q, r) = if self.is_long(a, m) {
                    (a, b, c)
                } else if self.is_long(b, m) {
                    (b, c, a)
                } else {
                    (c, a, b)
                };
                let apex = cut(p, m);
                out.push([apex, p, q, r]);
                let touched = self.diagonal(q, r, m);
                let other = if touched == q { r } else { q };
                out.push([apex, touched, other, cut(other, m)]);
                out.push([apex, touched, cut(other, m), cut(touched, m)]);
            }
            _ => unreachable!("a tetrahedron has four corners"),
        }
    }

    fn is_long(&self, a: u32, b: u32) -> bool {
        let odd = |point: u32| self.places[point as usize].coordinates()[0] & 1;
        odd(a) == odd(b)
    }

    /// Of a lattice triangle cut between `m` and the inner two, `a` or `b`: the one that the diagonal of the remaining
    /// quadrilateral ends at. Both tetrahedra at the triangle must find the same.
    fn diagonal(&self, a: u32, b: u32, m: u32) -> u32 {
        if self.is_long(a, b) {
            // Alternates around the long edge, so that no tetrahedron there has both diagonals at one end.
            let (from, to) = (self.places[a as usize], self.places[m as usize]);
            let (from, to) = (from.coordinates(), to.coordinates());
            let ahead = (0..3).filter(|&axis| to[axis] > from[axis]).count();
            if ahead % 2 == 0 { a } else { b }
        } else if self.is_long(a, m) {
            b
        } else {
            a
        }
    }
}

/// Up to four lattice points.
#[derive(Default)]
struct Corners {
    points: [u32; 4],
    count: usize,
}

impl Corners {
    fn push(&mut self, point: u32) {
        self.points[self.count] = point;
        self.count += 1;
    }

    fn get(&self) -> &[u32] {
        &self.points[..self.count]
    }
}

/// Orients the tetrahedra, and keeps the positions that they use.
fn assemble(positions: &[Vector3<f64>], mut tetrahedra: Vec<[u32; 4]>) -> Grid {
    let mut numbers = vec![NONE; positions.len()];
    for corner in tetrahedra.iter().flatten() {
        numbers[*corner as usize] = 0;
    }
    let mut used = Vec::new();
    for (number, position) in numbers.iter_mut().zip(positions) {
        if *number != NONE {
            *number = index(used.len());
            used.push(*position);
        }
    }
    for tetrahedron in &mut tetrahedra {
        *tetrahedron = tetrahedron.map(|corner| numbers[corner as usize]);
        let [a, b, c, d] = tetrahedron.map(|corner| used[corner as usize]);
        if (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0 {
            tetrahedron.swap(2, 3);
        }
    }
    let mut cells = Cells::default();
    for vertices in &tetrahedra {
        cells.push(Cell {
            kind: CellType::Tetrahedron,
            vertices,
            face_stream: &[],
        });
    }
    Grid {
        positions: used,
        cells,
    }
}

fn index(point: usize) -> u32 {
    u32::try_from(point).expect("MOST_CELLS bounds the lattice")
}
