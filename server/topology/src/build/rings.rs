//! The darts of cells, one ring of darts per face of each cell; cells do not know each other yet.

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
    fn push(&mut self, pattern: &Pattern, corners: &[u32]) {
        self.cells.push(number(self.starts.len()));
        let first = self.vertex.len();
        let mut start = first;
        for &length in &pattern.rings {
            self.starts.push(number(start));
            start += length as usize;
        }
        self.beta1.extend(Dart::beyond(first, &pattern.next));
        self.beta2.extend(Dart::beyond(first, &pattern.across));
        self.beta2.resize(start, None);
        let corner = |&corner: &u32| corners[corner as usize];
        self.vertex.extend(pattern.origin.iter().map(corner));
    }

    pub(super) fn next(&self, dart: u32) -> u32 {
        let next = self.beta1[dart as usize].expect("rings are closed");
        number(next.index())
    }

    fn ring_of(&self, dart: u32) -> usize {
        self.starts.partition_point(|&start| start <= dart) - 1
    }

    /// The first dart of the ring that a dart is of.
    pub(super) fn first_of_ring(&self, dart: u32) -> u32 {
        self.starts[self.ring_of(dart)]
    }

    /// The cell that a dart is of.
    pub(super) fn cell_of(&self, dart: u32) -> u32 {
        let ring = self.ring_of(dart);
        number(self.cells.partition_point(|&first| first as usize <= ring) - 1)
    }
}

pub(super) fn number(index: usize) -> u32 {
    u32::try_from(index).expect("checked meshes have fewer than Dart::MOST darts")
}

/// Makes the darts of all cells. `turned` says which to turn inside out; empty for none.
pub(super) fn emit(
    mesh: &MeshCells<'_>,
    extent: Extent,
    turned: &[bool],
    report: &mut BuildReport,
) -> Result<Rings, BuildError> {
    let mut rings = Rings {
        beta1: Vec::with_capacity(extent.darts),
        beta2: Vec::with_capacity(extent.darts),
        vertex: Vec::with_capacity(extent.darts),
        starts: Vec::with_capacity(extent.rings + 1),
        cells: Vec::with_capacity(mesh.types.len() + 1),
    };
    let mut shapes = Shapes::new(mesh, turned);
    for cell in 0..mesh.types.len() {
        let (pattern, corners) = shapes.of(cell, report)?;
        rings.push(pattern, corners);
    }
    rings.cells.push(number(rings.starts.len()));
    rings.starts.push(number(rings.vertex.len()));
    Ok(rings)
}

/// The patterns of cells, and the mesh's vertices at their corners.
pub(super) struct Shapes<'a> {
    mesh: &'a MeshCells<'a>,
    turned: &'a [bool],
    /// By type, as they are and inside out.
    patterns: [Vec<Pattern>; 2],
    /// Of the last cell without a fixed shape.
    pattern: Pattern,
    corners: Vec<u32>,
    scratch: Vec<u32>,
}

impl<'a> Shapes<'a> {
    pub(super) fn new(mesh: &'a MeshCells<'a>, turned: &'a [bool]) -> Self {
        let patterns = [false, true].map(|inside_out| {
            let kinds = 0..=16;
            kinds.map(|kind| Pattern::new(kind, inside_out)).collect()
        });
        Self {
            mesh,
            turned,
            patterns,
            pattern: Pattern::default(),
            corners: Vec::new(),
            scratch: Vec::new(),
        }
    }

    pub(super) fn of(
        &mut self,
        cell: usize,
        report: &mut BuildReport,
    ) -> Result<(&Pattern, &[u32]), BuildError> {
        let inside_out = self.turned.get(cell).copied().unwrap_or(false);
        let (kind, corners) = (self.mesh.types[cell], self.mesh.vertices_of(cell));
        if kind == POLYHEDRON {
            if self.close_polyhedron(cell, inside_out)? {
                report.rewound.push(number(cell));
            }
            return Ok((&self.pattern, &self.corners));
        }
        if let Some(vertex) = repeated(corners, &mut self.scratch) {
            return Err(BuildError::RepeatedVertex { cell, vertex });
        }
        if kind >= 10 {
            let pattern = &self.patterns[usize::from(inside_out)][usize::from(kind)];
            return Ok((pattern, corners));
        }
        self.pattern.clear();
        self.pattern.push_ring(0..number(corners.len()), inside_out);
        Ok((&self.pattern, corners))
    }

    /// Returns whether its faces did not wind alike.
    fn close_polyhedron(&mut self, cell: usize, inside_out: bool) -> Result<bool, BuildError> {
        let given: Vec<_> = self.mesh.rings_of(cell).collect();
        for ring in &given {
            if let Some(vertex) = repeated(ring, &mut self.scratch) {
                return Err(BuildError::RepeatedVertex { cell, vertex });
            }
        }
        let backward = winding(cell, &given)?;
        self.pattern.clear();
        self.corners.clear();
        for (ring, &backward) in given.iter().zip(&backward) {
            let vertices = ring.iter().copied();
            self.pattern.push_ring(vertices, backward != inside_out);
        }
        self.pattern.close();
        self.pattern.name_corners(&mut self.corners);
        Ok(backward.contains(&true))
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
