//! Darts of neighbouring cells linked, and all cells numbered.

use rayon::prelude::*;

use super::rings::{Rings, all_free, number};
use super::{BuildError, BuildReport, NonManifold, Pair};
use crate::input::MeshCells;
use crate::map::{EDGE, SIDE, VERTEX};
use crate::orbit::Walk;
use crate::slots::NONE;
use crate::{Cell, Dart, Dimension, Map};

pub(super) fn finish(
    mesh: &MeshCells<'_>,
    dimension: Dimension,
    rings: Rings,
    pairs: &[Pair],
    otherwise: NonManifold,
    mut report: BuildReport,
) -> Result<(Map, BuildReport), BuildError> {
    let darts = rings.vertex.len();
    let mut map = Map::new(dimension);
    map.beta = [rings.beta1, rings.beta2, all_free(darts)];
    map.label[VERTEX] = rings.vertex;
    match dimension {
        Dimension::Three => link_faces(&mut map, pairs),
        Dimension::Two => link_edges(&mut map, pairs),
    }
    let (counts, corners) = first_darts(&map, mesh.vertices);
    map.slots[0].dart = corners;
    let isolated = (0u32..).zip(&counts).filter(|(_, count)| **count == 0);
    report.isolated = isolated.map(|(vertex, _)| vertex).collect();
    map.slots[0].retired.clone_from(&report.isolated);
    // Three looks at the links that do not need each other.
    let (edges, (faces, torn)) = rayon::join(
        || number_edges(&map),
        || {
            rayon::join(
                || number_faces(&map, &rings.starts, &rings.cells, pairs.len()),
                || torn_vertices(&map, &counts),
            )
        },
    );
    (map.label[EDGE], map.slots[1].dart) = (edges.labels, edges.darts);
    (map.label[SIDE], map.slots[2].dart) = (faces.sides, faces.darts);
    (map.side_volume, map.slots[3].dart) = (faces.volumes, faces.volume_darts);
    if dimension == Dimension::Two {
        number_components(&mut map);
    }
    report.split_edges = doubled_edges(&map, mesh.vertices);
    let is_manifold =
        report.split_faces.is_empty() && report.split_edges.is_empty() && torn.is_empty();
    if !is_manifold && otherwise == NonManifold::Refuse {
        return Err(BuildError::NonManifold {
            faces: report.split_faces,
            edges: report.split_edges,
            vertices: torn,
        });
    }
    split_vertices(&mut map, &torn, &mut report);
    Ok((map, report))
}

fn link_faces(map: &mut Map, pairs: &[Pair]) {
    let [beta1, _, beta3] = &mut map.beta;
    for pair in pairs {
        // Both leave the smallest vertex, in opposite directions: the one is linked with the dart before the other.
        let [one, other] = pair.darts.map(|dart| Dart::at(dart as usize));
        let next = |dart: Dart| beta1[dart.index()].expect("rings are closed");
        let mut link = |a: Dart, b: Dart| {
            beta3[a.index()] = Some(b);
            beta3[b.index()] = Some(a);
        };
        let ([a1, b1], [a2, b2]) = {
            let first = [one, other].map(next);
            (first, first.map(next))
        };
        if next(a2) == one {
            link(one, b2);
            link(a1, b1);
            link(a2, other);
            continue;
        }
        let mut ring = vec![other];
        let mut at = b1;
        while at != other {
            ring.push(at);
            at = next(at);
        }
        let mut at = one;
        for &facing in ring.iter().rev() {
            link(at, facing);
            at = next(at);
        }
    }
}

fn link_edges(map: &mut Map, pairs: &[Pair]) {
    for pair in pairs {
        let [one, other] = pair.darts.map(|dart| Dart::at(dart as usize));
        map.beta[1][one.index()] = Some(other);
        map.beta[1][other.index()] = Some(one);
    }
}

struct Faces {
    sides: Vec<u32>,
    darts: Vec<Option<Dart>>,
    /// Of each side.
    volumes: Vec<u32>,
    volume_darts: Vec<Option<Dart>>,
}

/// Faces in the order of their first ring; volumes, except of surfaces, as the mesh numbers its cells.
fn number_faces(map: &Map, starts: &[u32], cells: &[u32], pairs: usize) -> Faces {
    let is_surface = map.dimension == Dimension::Two;
    let rings = starts.len() - 1;
    let count = if is_surface { rings } else { rings - pairs };
    let mut faces = Faces {
        sides: vec![NONE; map.dart_slot_count()],
        darts: Vec::with_capacity(count),
        volumes: vec![NONE; 2 * count],
        volume_darts: Vec::with_capacity(if is_surface { 0 } else { cells.len() - 1 }),
    };
    for (cell, rings) in (0u32..).zip(cells.windows(2)) {
        if !is_surface {
            let first = starts[rings[0] as usize] as usize;
            faces.volume_darts.push(Some(Dart::at(first)));
        }
        for ring in rings[0] as usize..rings[1] as usize {
            let span = starts[ring] as usize..starts[ring + 1] as usize;
            let across = map.beta[2][span.start].map(|dart| faces.sides[dart.index()]);
            let side = match across {
                None | Some(NONE) => {
                    let face = number(faces.darts.len());
                    faces.darts.push(Some(Dart::at(span.start)));
                    2 * face
                }
                Some(side) => side ^ 1,
            };
            if !is_surface {
                faces.volumes[side as usize] = cell;
            }
            faces.sides[span].fill(side);
        }
    }
    faces
}

struct Edges {
    labels: Vec<u32>,
    darts: Vec<Option<Dart>>,
}

/// Edges in the order of their first darts.
fn number_edges(map: &Map) -> Edges {
    let [_, beta2, beta3] = &map.beta;
    let mut labels = vec![NONE; map.dart_slot_count()];
    let mut darts = Vec::new();
    for first in 0..labels.len() {
        if labels[first] != NONE {
            continue;
        }
        let label = number(darts.len());
        darts.push(Some(Dart::at(first)));
        labels[first] = label;
        // Around by β2, β3, β2, … until the ring closes, or by β2 and then β3 where it ends.
        let mut at = first;
        let is_closed = loop {
            let Some(across) = beta2[at] else { break false };
            labels[across.index()] = label;
            let Some(beyond) = beta3[across.index()] else {
                break false;
            };
            at = beyond.index();
            if at == first {
                break true;
            }
            labels[at] = label;
        };
        let mut at = first;
        while let (false, Some(beyond)) = (is_closed, beta3[at]) {
            labels[beyond.index()] = label;
            let Some(across) = beta2[beyond.index()] else {
                break;
            };
            at = across.index();
            labels[at] = label;
        }
    }
    darts.shrink_to_fit();
    Edges { labels, darts }
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

/// Edges of the map with the same two vertices, by these.
fn doubled_edges(map: &Map, vertices: usize) -> Vec<[u32; 2]> {
    let ends = |dart: Dart| {
        let [a, b] = [dart, map.beta1(dart)].map(|dart| map.label[VERTEX][dart.index()]);
        [a.min(b), a.max(b)]
    };
    let edges = || map.slots[1].dart.iter().flatten().map(|&dart| ends(dart));
    let mut starts = vec![0u32; vertices + 1];
    edges().for_each(|[low, _]| starts[low as usize + 1] += 1);
    for vertex in 0..vertices {
        starts[vertex + 1] += starts[vertex];
    }
    let mut highs = vec![0; map.slots[1].dart.len()];
    for [low, high] in edges() {
        let at = &mut starts[low as usize];
        highs[*at as usize] = high;
        *at += 1;
    }
    let mut doubled = Vec::new();
    let mut start = 0;
    for (low, &end) in (0u32..).zip(&starts[..vertices]) {
        let bucket = &mut highs[start..end as usize];
        bucket.sort_unstable();
        let same = bucket.chunk_by(|a, b| a == b).filter(|same| same.len() > 1);
        doubled.extend(same.map(|same| [low, same[0]]));
        start = end as usize;
    }
    doubled
}

/// Vertices whose darts are not one orbit.
fn torn_vertices(map: &Map, counts: &[u32]) -> Vec<u32> {
    // Each piece of the work has a walk of its own, with a bit for every dart.
    let vertices = map.slots[0]
        .dart
        .par_iter()
        .enumerate()
        .with_min_len(1 << 14);
    let torn = vertices.map_init(Walk::default, |walk, (vertex, dart)| {
        let reached = dart.map_or(0, |dart| walk.collect(map, 0, dart).len());
        (reached != counts[vertex] as usize).then(|| number(vertex))
    });
    torn.flatten_iter().collect()
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
