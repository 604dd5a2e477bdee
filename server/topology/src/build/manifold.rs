//! Whether what was built is a manifold.

use super::rings::number;
use super::{BuildError, BuildReport, NonManifold};
use crate::map::{EDGE, VERTEX};
use crate::slots::NONE;
use crate::{Dart, Map};

/// Reports vertices of no cell and doubled edges, and refuses what is no manifold. `torn` are the mesh's vertices that are
/// several; `split` as in [`doubled_edges`].
pub(super) fn check(
    map: &mut Map,
    torn: &[u32],
    split: &[u32],
    otherwise: NonManifold,
    report: &mut BuildReport,
) -> Result<(), BuildError> {
    let darts = (0u32..).zip(&map.slots[0].dart);
    let isolated = darts.filter(|(_, dart)| dart.is_none());
    report.isolated = isolated.map(|(vertex, _)| vertex).collect();
    map.slots[0].retired.clone_from(&report.isolated);
    report.split_edges = doubled_edges(map, split);
    let is_manifold =
        report.split_faces.is_empty() && report.split_edges.is_empty() && torn.is_empty();
    if is_manifold || otherwise == NonManifold::Split {
        return Ok(());
    }
    Err(BuildError::NonManifold {
        faces: std::mem::take(&mut report.split_faces),
        edges: std::mem::take(&mut report.split_edges),
        vertices: torn.to_vec(),
    })
}

/// Whether two faces have the same edges, and so, in a map without doubled edges, the same vertices.
pub(super) fn has_doubled_faces(map: &Map) -> bool {
    let edge = |dart: Dart| map.label[EDGE][dart.index()];
    // In lists by their first edge: around an edge there are few. Of each face, its second edge and the one before.
    let mut latest = vec![NONE; map.slots[1].dart.len()];
    let mut faces = Vec::with_capacity(map.slots[2].dart.len());
    for &dart in map.slots[2].dart.iter().flatten() {
        let (mut first, mut second) = (NONE, NONE);
        for label in map.ring(dart).map(edge) {
            second = second.min(first.max(label));
            first = first.min(label);
        }
        let mut at = std::mem::replace(&mut latest[first as usize], number(faces.len()));
        faces.push((second, at));
        while at != NONE {
            let (its_second, earlier) = faces[at as usize];
            let other = map.slots[2].dart[at as usize];
            if its_second == second && other.is_some_and(|other| has_edges_of(map, dart, other)) {
                return true;
            }
            at = earlier;
        }
    }
    false
}

fn has_edges_of(map: &Map, dart: Dart, other: Dart) -> bool {
    let mut ring = map.ring(dart);
    ring.all(|dart| {
        map.ring(other)
            .any(|other| map.edge(other) == map.edge(dart))
    })
}

/// Edges of the map with the same two vertices, by these.
///
/// `split` are the mesh's vertices of those that the map has beyond the mesh's.
fn doubled_edges(map: &Map, split: &[u32]) -> Vec<[u32; 2]> {
    let vertices = map.slots[0].dart.len() - split.len();
    let of_mesh = |vertex: u32| match (vertex as usize).checked_sub(vertices) {
        None => vertex,
        Some(new) => split[new],
    };
    // In lists by their lower vertex: of each edge, the higher vertex and the edge before.
    let mut latest = vec![NONE; vertices];
    let mut edges = Vec::with_capacity(map.slots[1].dart.len());
    let mut doubled = Vec::new();
    for &dart in map.slots[1].dart.iter().flatten() {
        let [a, b] = [dart, map.beta1(dart)].map(|dart| of_mesh(map.label[VERTEX][dart.index()]));
        let (low, high) = (a.min(b), a.max(b));
        let mut at = std::mem::replace(&mut latest[low as usize], number(edges.len()));
        edges.push((high, at));
        while at != NONE {
            let (its_high, earlier) = edges[at as usize];
            if its_high == high {
                doubled.push([low, high]);
            }
            at = earlier;
        }
    }
    doubled.sort_unstable();
    doubled.dedup();
    doubled
}
