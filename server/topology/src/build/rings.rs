//! The darts of all cells, one ring of darts per face of each cell; cells do not know each other yet.

use rayon::prelude::*;

use super::{BuildError, BuildReport};
use crate::Dart;
use crate::cell_pattern::Pattern;
use crate::input::{Extent, MeshCells, POLYHEDRON};

/// Darts by number, in the order of cells, rings and corners.
#[derive(Debug)]
pub(super) struct Rings {
    pub(super) beta1: Vec<Option<Dart>>,
    pub(super) beta2: Vec<Option<Dart>>,
    /// The mesh's vertex that each dart leaves.
    pub(super) vertex: Vec<u32>,
    /// First dart of each ring, and the end.
    pub(super) starts: Vec<u32>,
    /// First ring of each cell, and the end.
    pub(super) cells: Vec<u32>,
}

impl Rings {
    pub(super) fn next(&self, dart: u32) -> u32 {
        let next = self.beta1[dart as usize].expect("rings are closed");
        number(next.index())
    }

    /// The cell that a dart is of.
    pub(super) fn cell_of(&self, dart: u32) -> u32 {
        let ring = self.starts.partition_point(|&start| start <= dart) - 1;
        number(self.cells.partition_point(|&first| first as usize <= ring) - 1)
    }
}

pub(super) fn number(index: usize) -> u32 {
    u32::try_from(index).expect("checked meshes have fewer than Dart::MOST darts")
}

/// A column of free darts. Written in parallel, since it is the first touch of much memory, which costs more than the
/// writing.
pub(super) fn all_free(darts: usize) -> Vec<Option<Dart>> {
    rayon::iter::repeat_n(None, darts).collect()
}

/// How many cells one thread makes the darts of at a time.
const PIECE: usize = 1 << 13;

/// Makes the darts. `turned` says which cells to turn inside out; empty for none.
pub(super) fn emit(
    mesh: &MeshCells<'_>,
    extent: Extent,
    turned: &[bool],
    report: &mut BuildReport,
) -> Result<Rings, BuildError> {
    let mut rings = Rings {
        beta1: all_free(extent.darts),
        beta2: all_free(extent.darts),
        vertex: vec![0; extent.darts],
        starts: vec![0; extent.rings + 1],
        cells: vec![0; mesh.types.len() + 1],
    };
    let patterns = [false, true].map(|inside_out| {
        let kinds = 0..=16;
        kinds.map(|kind| Pattern::new(kind, inside_out)).collect()
    });
    let job = Job {
        mesh,
        is_surface: extent.is_surface,
        turned,
        patterns,
    };
    let pieces = rings.pieces(mesh);
    let made: Vec<_> = pieces
        .into_par_iter()
        .map(|mut piece| job.fill(&mut piece))
        .collect();
    for rewound in made {
        report.rewound.append(&mut rewound?);
    }
    rings.starts[extent.rings] = number(extent.darts);
    rings.cells[mesh.types.len()] = number(extent.rings);
    Ok(rings)
}

/// What is the same for all pieces.
struct Job<'a> {
    mesh: &'a MeshCells<'a>,
    is_surface: bool,
    turned: &'a [bool],
    /// By type, as they are and inside out.
    patterns: [Vec<Pattern>; 2],
}

/// The rows of some cells that follow each other.
struct Piece<'a> {
    first_cell: usize,
    first_dart: usize,
    first_ring: usize,
    beta1: &'a mut [Option<Dart>],
    beta2: &'a mut [Option<Dart>],
    vertex: &'a mut [u32],
    starts: &'a mut [u32],
    cells: &'a mut [u32],
    /// Darts and rings made.
    darts: usize,
    rings: usize,
}

impl Rings {
    fn pieces(&mut self, mesh: &MeshCells<'_>) -> Vec<Piece<'_>> {
        let mut pieces = Vec::new();
        let (mut beta1, mut beta2) = (&mut self.beta1[..], &mut self.beta2[..]);
        let (mut vertex, mut starts) = (&mut self.vertex[..], &mut self.starts[..]);
        let (mut first_cell, mut first_dart, mut first_ring) = (0, 0, 0);
        let count = mesh.types.len();
        for cells in self.cells[..count].chunks_mut(PIECE) {
            let (mut darts, mut rings) = (0, 0);
            for cell in first_cell..first_cell + cells.len() {
                let (more_darts, more_rings) = mesh.size_of(cell);
                (darts, rings) = (darts + more_darts, rings + more_rings);
            }
            let length = cells.len();
            pieces.push(Piece {
                first_cell,
                first_dart,
                first_ring,
                beta1: beta1.split_off_mut(..darts).unwrap_or_default(),
                beta2: beta2.split_off_mut(..darts).unwrap_or_default(),
                vertex: vertex.split_off_mut(..darts).unwrap_or_default(),
                starts: starts.split_off_mut(..rings).unwrap_or_default(),
                cells,
                darts: 0,
                rings: 0,
            });
            first_cell += length;
            first_dart += darts;
            first_ring += rings;
        }
        pieces
    }
}

impl Job<'_> {
    /// Returns the polyhedra whose faces did not wind alike.
    fn fill(&self, piece: &mut Piece<'_>) -> Result<Vec<u32>, BuildError> {
        let mut rewound = Vec::new();
        let mut scratch = Vec::new();
        for at in 0..piece.cells.len() {
            let cell = piece.first_cell + at;
            piece.cells[at] = number(piece.first_ring + piece.rings);
            let inside_out = self.turned.get(cell).copied().unwrap_or(false);
            let (kind, corners) = (self.mesh.types[cell], self.mesh.vertices_of(cell));
            if kind == POLYHEDRON {
                if piece.push_polyhedron(self.mesh, cell, inside_out)? {
                    rewound.push(number(cell));
                }
                continue;
            }
            if let Some(vertex) = repeated(corners, &mut scratch) {
                return Err(BuildError::RepeatedVertex { cell, vertex });
            }
            if self.is_surface {
                piece.push_ring(corners, inside_out);
            } else {
                let patterns = &self.patterns[usize::from(inside_out)];
                piece.push_pattern(&patterns[usize::from(kind)], corners);
            }
        }
        Ok(rewound)
    }
}

/// A vertex that occurs twice.
fn repeated(ring: &[u32], scratch: &mut Vec<u32>) -> Option<u32> {
    if ring.len() <= 12 {
        let mut rest = ring;
        while let Some((first, others)) = rest.split_first() {
            if others.contains(first) {
                return Some(*first);
            }
            rest = others;
        }
        return None;
    }
    scratch.clear();
    scratch.extend_from_slice(ring);
    scratch.sort_unstable();
    let pair = scratch.windows(2).find(|pair| pair[0] == pair[1])?;
    Some(pair[0])
}

impl Piece<'_> {
    fn start_ring(&mut self, dart: usize) {
        self.starts[self.rings] = number(dart);
        self.rings += 1;
    }

    fn push_pattern(&mut self, pattern: &Pattern, corners: &[u32]) {
        let rows = self.darts..self.darts + pattern.origin.len();
        let first = self.first_dart + self.darts;
        self.darts = rows.end;
        let mut start = first;
        for &length in &pattern.rings {
            self.start_ring(start);
            start += usize::from(length);
        }
        for (to, &corner) in self.vertex[rows.clone()].iter_mut().zip(&pattern.origin) {
            *to = corners[usize::from(corner)];
        }
        let dart = |&local: &u8| Some(Dart::at(first + usize::from(local)));
        for (to, next) in self.beta1[rows.clone()].iter_mut().zip(&pattern.next) {
            *to = dart(next);
        }
        for (to, across) in self.beta2[rows].iter_mut().zip(&pattern.across) {
            *to = dart(across);
        }
    }

    fn push_ring(&mut self, ring: &[u32], backward: bool) {
        let rows = self.darts..self.darts + ring.len();
        let first = self.first_dart + self.darts;
        self.darts = rows.end;
        self.start_ring(first);
        let vertices = &mut self.vertex[rows.clone()];
        vertices.copy_from_slice(ring);
        if backward {
            vertices.reverse();
        }
        for (at, to) in self.beta1[rows].iter_mut().enumerate() {
            let next = if at + 1 == ring.len() { 0 } else { at + 1 };
            *to = Some(Dart::at(first + next));
        }
    }

    /// Returns whether its faces did not wind alike.
    fn push_polyhedron(
        &mut self,
        mesh: &MeshCells<'_>,
        cell: usize,
        inside_out: bool,
    ) -> Result<bool, BuildError> {
        let given: Vec<_> = mesh.rings_of(cell).collect();
        let mut scratch = Vec::new();
        for ring in &given {
            if let Some(vertex) = repeated(ring, &mut scratch) {
                return Err(BuildError::RepeatedVertex { cell, vertex });
            }
        }
        let backward = winding(cell, &given)?;
        // Each edge comes twice, once in each direction.
        let mut uses = Vec::new();
        for (ring, &backward) in given.iter().zip(&backward) {
            let start = self.darts;
            self.push_ring(ring, backward != inside_out);
            for row in start..self.darts {
                let next = if row + 1 == self.darts {
                    start
                } else {
                    row + 1
                };
                let [from, to] = [row, next].map(|row| self.vertex[row]);
                uses.push((from.min(to), from.max(to), row));
            }
        }
        uses.sort_unstable();
        for pair in uses.chunks_exact(2) {
            let [one, other] = [pair[0].2, pair[1].2];
            self.beta2[one] = Some(Dart::at(self.first_dart + other));
            self.beta2[other] = Some(Dart::at(self.first_dart + one));
        }
        Ok(backward.contains(&true))
    }
}

/// Which rings of a polyhedron to turn, so that all wind like the first.
fn winding(cell: usize, rings: &[&[u32]]) -> Result<Vec<bool>, BuildError> {
    // Edge, ring, and whether the ring runs it from the higher vertex to the lower.
    let mut uses = Vec::new();
    for (ring, vertices) in rings.iter().enumerate() {
        for (at, &from) in vertices.iter().enumerate() {
            let to = vertices[(at + 1) % vertices.len()];
            uses.push(([from.min(to), from.max(to)], ring, from > to));
        }
    }
    uses.sort_unstable();
    let mut neighbours = vec![Vec::new(); rings.len()];
    for group in uses.chunk_by(|a, b| a.0 == b.0) {
        let &[(ends, one, down), (_, other, other_down)] = group else {
            let (ends, uses) = (group[0].0, group.len());
            return Err(BuildError::OpenPolyhedron { cell, ends, uses });
        };
        if one == other {
            let uses = 1;
            return Err(BuildError::OpenPolyhedron { cell, ends, uses });
        }
        neighbours[one].push((other, down == other_down));
        neighbours[other].push((one, down == other_down));
    }
    let bad = |problem| BuildError::BadPolyhedron { cell, problem };
    let mut backward = vec![None; rings.len()];
    backward[0] = Some(false);
    let mut queue = vec![0];
    while let Some(ring) = queue.pop() {
        for &(other, differs) in &neighbours[ring] {
            let wanted = backward[ring].map(|here| here != differs);
            match backward[other] {
                None => {
                    backward[other] = wanted;
                    queue.push(other);
                }
                known if known != wanted => return Err(bad("cannot be wound alike")),
                Some(_) => {}
            }
        }
    }
    let found: Option<Vec<_>> = backward.into_iter().collect();
    found.ok_or(bad("are several closed surfaces, not one"))
}
