//! Which faces of a mesh a fracture left behind.

use std::collections::{BTreeMap, BTreeSet};

use sinew_engine::{Patch, SeamKind};
use sinew_mesh::Face;

/// The faces that came apart, each by where its vertices come from: a vertex that was split is on both sides, so that
/// both are known by the same. A face that is cut later leaves its colour to its parts: those whose vertices were all put
/// between vertices of the face.
#[derive(Default)]
pub(crate) struct Scars {
    /// Of each vertex that was split off, the one that it was at rest.
    origins: BTreeMap<u32, u32>,
    /// Of each vertex that was put between others, these, as they were at rest.
    parents: BTreeMap<u32, Vec<u32>>,
    /// Vertices at rest, ascending.
    open: BTreeSet<Vec<u32>>,
    /// The faces of `open` by each of their vertices.
    at: BTreeMap<u32, BTreeSet<Vec<u32>>>,
}

impl Scars {
    /// Follows a change of a mesh that now has `vertices` vertices.
    pub(crate) fn follow(&mut self, patch: &Patch, vertices: usize) {
        let appended = patch.vertex_parent_offsets.windows(2);
        let first = vertices - appended.len();
        for (vertex, parents) in (first..).zip(appended) {
            let Ok(vertex) = u32::try_from(vertex) else {
                continue;
            };
            match &patch.vertex_parents[parents[0] as usize..parents[1] as usize] {
                [] => {}
                &[parent] => {
                    let origin = self.origin(parent);
                    self.origins.insert(vertex, origin);
                }
                parents => {
                    let parents = parents.iter().map(|&parent| self.origin(parent));
                    let parents = parents.collect();
                    self.parents.insert(vertex, parents);
                }
            }
        }
        for seam in &patch.seams {
            let face = self.face(seam.vertices.iter().copied());
            for vertex in &face {
                let faces = self.at.entry(*vertex).or_default();
                match seam.kind {
                    SeamKind::Opened => faces.insert(face.clone()),
                    SeamKind::Closed => faces.remove(&face),
                };
            }
            match seam.kind {
                SeamKind::Opened => self.open.insert(face),
                SeamKind::Closed => self.open.remove(&face),
            };
        }
    }

    /// Whether the face came apart, or is part of one that did.
    pub(crate) fn contain(&self, face: &Face<'_>) -> bool {
        if self.open.is_empty() {
            return false;
        }
        let face = self.face(face.vertices());
        if self.open.contains(&face) {
            return true;
        }
        // A part has a vertex that was put between others.
        let Some(new) = face.iter().find(|vertex| self.parents.contains_key(vertex)) else {
            return false;
        };
        let mut ancestors = vec![*new];
        let mut met = 0;
        while let Some(vertex) = ancestors.get(met).copied() {
            met += 1;
            let faces = self.at.get(&vertex).into_iter().flatten();
            let is_whole = |whole: &Vec<u32>| face.iter().all(|&vertex| self.is_in(vertex, whole));
            if faces.into_iter().any(is_whole) {
                return true;
            }
            let parents = self.parents.get(&vertex).into_iter().flatten();
            ancestors.extend(
                parents
                    .filter(|parent| !ancestors.contains(parent))
                    .copied()
                    .collect::<Vec<_>>(),
            );
        }
        false
    }

    /// Whether a vertex is one of a face's, or was put between vertices that are.
    fn is_in(&self, vertex: u32, face: &[u32]) -> bool {
        let parents = || self.parents.get(&vertex);
        let are_in = |parents: &Vec<u32>| parents.iter().all(|&parent| self.is_in(parent, face));
        face.binary_search(&vertex).is_ok() || parents().is_some_and(are_in)
    }

    fn origin(&self, vertex: u32) -> u32 {
        self.origins.get(&vertex).copied().unwrap_or(vertex)
    }

    fn face(&self, vertices: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut face: Vec<_> = vertices.map(|vertex| self.origin(vertex)).collect();
        face.sort_unstable();
        face
    }
}
