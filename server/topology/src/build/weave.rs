//! Volumes, in one pass over the cells: each is linked with those before it, and its edges and corners take their names
//! from there.

use std::ops::Range;

use super::names::Names;
use super::open_faces::{Meeting, OpenFaces, View};
use super::rings::{Shapes, emit, number};
use super::{BuildError, BuildReport, NonManifold, faces, manifold, orient};
use crate::cell_pattern::Pattern;
use crate::input::{Extent, MeshCells};
use crate::map::{EDGE, SIDE, VERTEX};
use crate::slots::NONE;
use crate::{Cell, Dart, Dimension, Map};

/// What must be known beforehand of a mesh that is no manifold, or that has cells inside out.
#[derive(Debug, Default)]
struct Odd {
    /// Whether each cell is to be turned inside out; empty for none.
    turned: Vec<bool>,
    /// The first darts of rings that stay apart, as three or more are of the same face, ascending.
    apart: Vec<u32>,
}

pub(super) fn build(
    mesh: &MeshCells<'_>,
    extent: Extent,
    otherwise: NonManifold,
) -> Result<(Map, BuildReport), BuildError> {
    let mut report = BuildReport::default();
    // Few meshes are odd: it pays to find out on the way.
    if let Some(weaver) = weave(mesh, extent, &Odd::default(), &mut report)? {
        let woven = weaver.finish(mesh, NonManifold::Split, report)?;
        let (map, found) = &woven;
        if found.split_edges.is_empty()
            && found.split_vertices.is_empty()
            && !manifold::has_doubled_faces(map)
        {
            return Ok(woven);
        }
    }
    let mut report = BuildReport::default();
    let odd = survey(mesh, extent, &mut report)?;
    report.rewound.clear();
    let weaver = weave(mesh, extent, &odd, &mut report)?;
    let weaver =
        weaver.expect("no two rings run alike where cells are turned and crowds are apart");
    weaver.finish(mesh, otherwise, report)
}

/// Looks at all faces without linking any.
fn survey(
    mesh: &MeshCells<'_>,
    extent: Extent,
    report: &mut BuildReport,
) -> Result<Odd, BuildError> {
    let mut rings = emit(mesh, extent, &[], report)?;
    let mut partners = faces::find(mesh.vertices, &rings);
    let turned = orient::turned(&partners.pairs, &rings, mesh.types.len(), report)?;
    if !turned.is_empty() {
        rings = emit(mesh, extent, &turned, report)?;
        partners = faces::find(mesh.vertices, &rings);
    }
    report.split_faces = partners.crowded_cells(&rings);
    let darts = partners.crowded.iter().flatten();
    let mut apart: Vec<_> = darts.map(|&dart| rings.first_of_ring(dart)).collect();
    apart.sort_unstable();
    Ok(Odd { turned, apart })
}

/// The columns of a map as far as its cells were taken in. Edges and vertices have names until all are.
#[derive(Debug)]
struct Weaver {
    beta: [Vec<Option<Dart>>; 3],
    label: [Vec<u32>; 3],
    side_volume: Vec<u32>,
    /// The first dart of each face and volume.
    faces: Vec<Option<Dart>>,
    volumes: Vec<Option<Dart>>,
    open: OpenFaces,
    edges: Names,
    vertices: Names,
    /// The mesh's vertex of each vertex name.
    of_mesh: Vec<u32>,
    /// The names of the last cell's edges and corners.
    edge_names: Vec<u32>,
    corner_names: Vec<u32>,
    /// The mesh's vertex of each dart of it.
    ring_vertices: Vec<u32>,
}

/// `None` if the mesh is odd beyond what is known.
fn weave(
    mesh: &MeshCells<'_>,
    extent: Extent,
    odd: &Odd,
    report: &mut BuildReport,
) -> Result<Option<Weaver>, BuildError> {
    let column = || Vec::with_capacity(extent.darts);
    let mut weaver = Weaver {
        beta: [(); 3].map(|()| Vec::with_capacity(extent.darts)),
        label: [(); 3].map(|()| column()),
        side_volume: Vec::with_capacity(extent.rings + extent.rings / 8),
        faces: Vec::with_capacity(extent.rings / 2 + extent.rings / 16),
        volumes: Vec::with_capacity(mesh.types.len()),
        open: OpenFaces::new(mesh.vertices),
        edges: Names::default(),
        vertices: Names::default(),
        of_mesh: Vec::new(),
        edge_names: Vec::new(),
        corner_names: Vec::new(),
        ring_vertices: Vec::new(),
    };
    let mut shapes = Shapes::new(mesh, &odd.turned);
    for cell in 0..mesh.types.len() {
        let (pattern, corners) = shapes.of(cell, report)?;
        if !weaver.add(number(cell), pattern, corners, &odd.apart) {
            return Ok(None);
        }
    }
    Ok(Some(weaver))
}

/// The cell that is being taken in.
#[derive(Clone, Copy, Debug)]
struct Incoming<'a> {
    /// Its first dart.
    first: usize,
    pattern: &'a Pattern,
    /// The mesh's vertices.
    corners: &'a [u32],
}

impl Weaver {
    /// Takes in a cell. Returns whether it could.
    fn add(&mut self, cell: u32, pattern: &Pattern, corners: &[u32], apart: &[u32]) -> bool {
        let first = self.label[SIDE].len();
        let incoming = Incoming {
            first,
            pattern,
            corners,
        };
        let [beta1, beta2, beta3] = &mut self.beta;
        beta1.extend(Dart::beyond(first, &pattern.next));
        beta2.extend(Dart::beyond(first, &pattern.across));
        beta3.resize(beta1.len(), None);
        self.volumes.push(Some(Dart::at(first)));
        self.edge_names.clear();
        self.edge_names.resize(pattern.first_of_edge.len(), NONE);
        self.corner_names.clear();
        self.corner_names
            .resize(pattern.first_of_corner.len(), NONE);
        let vertices = pattern.origin.iter().map(|&at| corners[at as usize]);
        self.ring_vertices.clear();
        self.ring_vertices.extend(vertices);
        let mut start = 0;
        for &length in &pattern.rings {
            let end = start + length as usize;
            let is_apart = !apart.is_empty() && apart.binary_search(&number(first + start)).is_ok();
            let Some(side) = self.add_ring(incoming, start..end, is_apart) else {
                return false;
            };
            self.side_volume[side as usize] = cell;
            self.label[SIDE].resize(first + end, side);
            start = end;
        }
        for edge in 0..self.edge_names.len() {
            self.name_edge(incoming, edge);
        }
        for corner in 0..self.corner_names.len() {
            self.name_corner(incoming, corner);
        }
        let [vertex, edge, _] = &mut self.label;
        let names = |local: &u32| self.corner_names[*local as usize];
        vertex.extend(pattern.origin.iter().map(names));
        let names = |local: &u32| self.edge_names[*local as usize];
        edge.extend(pattern.edge.iter().map(names));
        true
    }

    /// The name of an edge of the incoming cell: a new one if it has none.
    fn name_edge(&mut self, incoming: Incoming<'_>, edge: usize) -> u32 {
        let name = &mut self.edge_names[edge];
        if *name == NONE {
            let dart = incoming.pattern.first_of_edge[edge] as usize;
            *name = self.edges.make(incoming.first + dart);
        }
        *name
    }

    /// As [`Weaver::name_edge`], of a corner.
    fn name_corner(&mut self, incoming: Incoming<'_>, corner: usize) -> u32 {
        let name = &mut self.corner_names[corner];
        if *name == NONE {
            let dart = incoming.pattern.first_of_corner[corner] as usize;
            *name = self.vertices.make(incoming.first + dart);
            self.of_mesh.push(incoming.corners[corner]);
        }
        *name
    }

    /// Takes in a ring of the incoming cell. Returns its side, if it fits.
    fn add_ring(
        &mut self,
        incoming: Incoming<'_>,
        ring: Range<usize>,
        is_apart: bool,
    ) -> Option<u32> {
        let first = incoming.first;
        let vertices = &self.ring_vertices[ring.clone()];
        let (place, view) = View::of(vertices, first + ring.start);
        let next = |dart: usize| self.beta[0][dart].map_or(dart, Dart::index);
        let is_same = |other: u32, is_along: bool| {
            let mut at = other as usize;
            (1..vertices.len()).all(|step| {
                at = next(at);
                let step = if is_along {
                    step
                } else {
                    vertices.len() - step
                };
                let vertex = match at.checked_sub(first) {
                    None => self.of_mesh[self.label[VERTEX][at] as usize],
                    Some(at) => self.ring_vertices[at],
                };
                vertex == vertices[(place + step) % vertices.len()]
            })
        };
        let met = match is_apart {
            true => Meeting::Nothing,
            false => self.open.meet(vertices[place], view, is_same),
        };
        match met {
            Meeting::Mirrored => None,
            Meeting::Other(other) => {
                self.link(other as usize, incoming, ring, place);
                Some(self.label[SIDE][other as usize] ^ 1)
            }
            Meeting::Nothing => {
                self.faces.push(Some(Dart::at(first + ring.start)));
                self.side_volume.extend([NONE; 2]);
                Some(2 * number(self.faces.len() - 1))
            }
        }
    }

    /// Links the ring of `other` and one of the incoming cell, which run against each other; `other` leaves the vertex at
    /// `place` in the ring.
    fn link(&mut self, other: usize, incoming: Incoming<'_>, ring: Range<usize>, place: usize) {
        let Incoming { first, pattern, .. } = incoming;
        let (mut at, mut facing) = (other, ring.start + place);
        loop {
            let origin = pattern.origin[facing] as usize;
            facing = if facing == ring.start {
                ring.end
            } else {
                facing
            } - 1;
            let [vertex, edge] = match at.checked_sub(first) {
                None => [self.label[VERTEX][at], self.label[EDGE][at]],
                // A face of the same cell.
                Some(at) => [
                    self.name_corner(incoming, pattern.origin[at] as usize),
                    self.name_edge(incoming, pattern.edge[at] as usize),
                ],
            };
            let name = &mut self.corner_names[origin];
            *name = self.vertices.join(*name, vertex);
            let name = &mut self.edge_names[pattern.edge[facing] as usize];
            *name = self.edges.join(*name, edge);
            self.beta[2][at] = Some(Dart::at(first + facing));
            self.beta[2][first + facing] = Some(Dart::at(at));
            at = self.beta[0][at].map_or(other, Dart::index);
            if at == other {
                return;
            }
        }
    }

    fn finish(
        self,
        mesh: &MeshCells<'_>,
        otherwise: NonManifold,
        mut report: BuildReport,
    ) -> Result<(Map, BuildReport), BuildError> {
        let mut map = Map::new(Dimension::Three);
        map.beta = self.beta;
        map.label = self.label;
        map.side_volume = self.side_volume;
        map.slots[2].dart = self.faces;
        map.slots[3].dart = self.volumes;
        map.side_volume.shrink_to_fit();
        map.slots[2].dart.shrink_to_fit();
        let [vertex, edge, _] = &mut map.label;
        let mut edges = Vec::new();
        self.edges.settle(edge, |_, first| {
            edges.push(Some(first));
            number(edges.len() - 1)
        });
        edges.shrink_to_fit();
        map.slots[1].dart = edges;
        // Of several vertices for one of the mesh's, the first keeps its number; the others are appended.
        let mut darts = vec![None; mesh.vertices];
        let mut split = Vec::new();
        self.vertices.settle(vertex, |name, first| {
            let vertex = self.of_mesh[name];
            let dart = &mut darts[vertex as usize];
            if dart.is_none() {
                *dart = Some(first);
                return vertex;
            }
            darts.push(Some(first));
            split.push(vertex);
            number(darts.len() - 1)
        });
        map.slots[0].dart = darts;
        stand_at_ends(&mut map);
        let mut torn = split.clone();
        torn.sort_unstable();
        torn.dedup();
        manifold::check(&mut map, &torn, &split, otherwise, &mut report)?;
        let new = (number(mesh.vertices)..).map(Cell::new);
        report.split_vertices = new.zip(split).collect();
        Ok((map, report))
    }
}

/// Lets darts on the boundary stand for edges there: of each, the first.
fn stand_at_ends(map: &mut Map) {
    for face in (0..map.slots[2].dart.len()).rev() {
        let Some(first) = map.slots[2].dart[face].filter(|_| map.side_volume[2 * face + 1] == NONE)
        else {
            continue;
        };
        let mut dart = first;
        loop {
            let edge = map.label[EDGE][dart.index()] as usize;
            map.slots[1].dart[edge] = Some(dart);
            dart = map.beta1(dart);
            if dart == first {
                break;
            }
        }
    }
}
