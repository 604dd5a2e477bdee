//! Surfaces.

use super::rings::{Rings, emit, number};
use super::{BuildError, BuildReport, NonManifold, Pair, Partners, manifold, orient};
use crate::input::{Extent, MeshCells};
use crate::map::{EDGE, SIDE, VERTEX};
use crate::orbit::Walk;
use crate::slots::NONE;
use crate::{Cell, Dart, Dimension, Map};

pub(super) fn build(
    mesh: &MeshCells<'_>,
    extent: Extent,
    otherwise: NonManifold,
) -> Result<(Map, BuildReport), BuildError> {
    let mut report = BuildReport::default();
    let mut rings = emit(mesh, extent, &[], &mut report)?;
    let mut partners = find_partners(&rings);
    let turned = orient::turned(&partners.pairs, &rings, mesh.types.len(), &mut report)?;
    if !turned.is_empty() {
        rings = emit(mesh, extent, &turned, &mut report)?;
        partners = find_partners(&rings);
    }
    report.split_faces = partners.crowded_cells(&rings);
    let mut map = Map::new(Dimension::Two);
    link(&mut map, rings, &partners.pairs);
    number_components(&mut map);
    let (counts, corners) = first_darts(&map, mesh.vertices);
    map.slots[0].dart = corners;
    let torn = torn_vertices(&map, &counts);
    manifold::check(&mut map, &torn, &[], otherwise, &mut report)?;
    split_vertices(&mut map, &torn, &mut report);
    Ok((map, report))
}

/// Links the darts of each edge, and numbers edges and faces in the order of their first darts.
fn link(map: &mut Map, rings: Rings, pairs: &[Pair]) {
    let darts = rings.vertex.len();
    map.beta = [rings.beta1, rings.beta2, vec![None; darts]];
    map.label[VERTEX] = rings.vertex;
    for pair in pairs {
        let [one, other] = pair.darts.map(|dart| Dart::at(dart as usize));
        map.beta[1][one.index()] = Some(other);
        map.beta[1][other.index()] = Some(one);
    }
    let edges = &mut map.slots[1].dart;
    for dart in 0..darts {
        let edge = match map.beta[1][dart] {
            Some(across) if across.index() < dart => map.label[EDGE][across.index()],
            Some(_) | None => {
                edges.push(Some(Dart::at(dart)));
                number(edges.len() - 1)
            }
        };
        map.label[EDGE].push(edge);
    }
    for (face, ends) in (0u32..).zip(rings.starts.windows(2)) {
        let [first, end] = [ends[0], ends[1]].map(|dart| dart as usize);
        map.slots[2].dart.push(Some(Dart::at(first)));
        map.label[SIDE].resize(end, 2 * face);
    }
    map.side_volume = vec![NONE; 2 * map.slots[2].dart.len()];
}

/// Which darts of two cells are the same edge.
fn find_partners(rings: &Rings) -> Partners {
    let mut uses: Vec<_> = (0..number(rings.vertex.len()))
        .map(|dart| {
            let from = rings.vertex[dart as usize];
            let to = rings.vertex[rings.next(dart) as usize];
            (from.min(to), from.max(to), dart, from > to)
        })
        .collect();
    uses.sort_unstable();
    let mut partners = Partners::default();
    for edge in uses.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match *edge {
            [_] => {}
            [one, other] => partners.pairs.push(Pair {
                darts: [one.2, other.2],
                is_mirrored: one.3 == other.3,
            }),
            _ => {
                let darts = edge.iter().map(|&(_, _, dart, _)| dart);
                partners.crowded.push(darts.collect());
            }
        }
    }
    partners
}

/// The volumes of a surface are its components.
fn number_components(map: &mut Map) {
    let mut walk = Walk::default();
    for face in 0..map.slots[2].dart.len() {
        let Some(first) = map.slots[2].dart[face] else {
            continue;
        };
        if map.label_in(3, first) != NONE {
            continue;
        }
        let volume = number(map.slots[3].dart.len());
        map.slots[3].dart.push(Some(first));
        for &dart in walk.collect(map, 3, first) {
            let side = map.label[SIDE][dart.index()] as usize;
            map.side_volume[side] = volume;
        }
    }
}

/// Of each vertex, how many darts leave it, and the first of them.
fn first_darts(map: &Map, vertices: usize) -> (Vec<u32>, Vec<Option<Dart>>) {
    let mut darts = vec![None; vertices];
    let mut counts = vec![0u32; vertices];
    for (dart, &vertex) in map.label[VERTEX].iter().enumerate() {
        let vertex = vertex as usize;
        if counts[vertex] == 0 {
            darts[vertex] = Some(Dart::at(dart));
        }
        counts[vertex] += 1;
    }
    (counts, darts)
}

/// Vertices whose darts are not one orbit.
fn torn_vertices(map: &Map, counts: &[u32]) -> Vec<u32> {
    let mut walk = Walk::default();
    let mut torn = Vec::new();
    for (vertex, (dart, &count)) in (0u32..).zip(map.slots[0].dart.iter().zip(counts)) {
        let reached = dart.map_or(0, |dart| walk.collect(map, 0, dart).len());
        if reached != count as usize {
            torn.push(vertex);
        }
    }
    torn
}

/// Gives all orbits but the first of each torn vertex a vertex of their own.
fn split_vertices(map: &mut Map, torn: &[u32], report: &mut BuildReport) {
    if torn.is_empty() {
        return;
    }
    let mut walk = Walk::default();
    let mut settled = Walk::default();
    settled.restart(map);
    for &vertex in torn {
        if let Some(first) = map.slots[0].dart[vertex as usize] {
            let orbit = walk.collect(map, 0, first);
            orbit.iter().for_each(|&dart| settled.push(dart));
        }
    }
    for index in 0..map.label[VERTEX].len() {
        let (dart, vertex) = (Dart::at(index), map.label[VERTEX][index]);
        if torn.binary_search(&vertex).is_err() || settled.has(dart) {
            continue;
        }
        let new = number(map.slots[0].dart.len());
        map.slots[0].dart.push(Some(dart));
        for &dart in walk.collect(map, 0, dart) {
            settled.push(dart);
            map.label[VERTEX][dart.index()] = new;
        }
        report.split_vertices.push((Cell::new(new), vertex));
    }
}
