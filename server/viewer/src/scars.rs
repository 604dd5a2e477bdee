//! Which faces of a mesh a fracture left behind.

use std::collections::{BTreeMap, BTreeSet};

use sinew_engine::{Patch, SeamKind};
use sinew_mesh::Face;

/// The faces that came apart, each by where its vertices come from: a vertex that was split is on both sides, so that
/// both are known by the same.
#[derive(Default)]
pub(crate) struct Scars {
    /// Of each vertex that was split off, the one that it was at rest.
    origins: BTreeMap<u32, u32>,
    /// Vertices at rest, ascending.
    open: BTreeSet<Vec<u32>>,
    /// The face looked at.
    face: Vec<u32>,
}

impl Scars {
    /// Follows a change of a mesh that now has `vertices` vertices.
    pub(crate) fn follow(&mut self, patch: &Patch, vertices: usize) {
        let appended = patch.vertex_parent_offsets.windows(2);
        let first = vertices - appended.len();
        for (vertex, parents) in (first..).zip(appended) {
            let parents = &patch.vertex_parents[parents[0] as usize..parents[1] as usize];
            if let (&[parent], Ok(vertex)) = (parents, u32::try_from(vertex)) {
                let origin = self.origin(parent);
                self.origins.insert(vertex, origin);
            }
        }
        for seam in &patch.seams {
            self.look_at(seam.vertices.iter().copied());
            match seam.kind {
                SeamKind::Opened => self.open.insert(self.face.clone()),
                SeamKind::Closed => self.open.remove(&self.face),
            };
        }
    }

    /// Whether the face came apart.
    pub(crate) fn contain(&mut self, face: &Face<'_>) -> bool {
        if self.open.is_empty() {
            return false;
        }
        self.look_at(face.vertices());
        self.open.contains(&self.face)
    }

    fn origin(&self, vertex: u32) -> u32 {
        self.origins.get(&vertex).copied().unwrap_or(vertex)
    }

    fn look_at(&mut self, vertices: impl Iterator<Item = u32>) {
        let mut face = std::mem::take(&mut self.face);
        face.clear();
        face.extend(vertices.map(|vertex| self.origin(vertex)));
        face.sort_unstable();
        self.face = face;
    }
}
