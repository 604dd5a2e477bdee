//! Whether neighbouring faces wind the same way around, and how to make them.

use crate::Face;

/// One face's use of one edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct EdgeUse {
    /// Ascending.
    pub(crate) ends: [u32; 2],
    /// Whether the face runs along the edge from the higher end to the lower.
    pub(crate) descends: bool,
    /// Number of the face.
    pub(crate) face: u32,
}

/// All uses of edges by `faces`, those of the same edge beside each other.
pub(crate) fn edge_uses<'a>(faces: impl Iterator<Item = (u32, Face<'a>)>) -> Vec<EdgeUse> {
    let mut uses = Vec::new();
    for (number, face) in faces {
        let edges = face.edges().filter(|[from, to]| from != to);
        uses.extend(edges.map(|[from, to]| EdgeUse {
            ends: [from.min(to), from.max(to)],
            descends: from > to,
            face: number,
        }));
    }
    uses.sort_unstable();
    uses
}

/// The uses of one edge after the other.
pub(crate) fn by_edge(uses: &[EdgeUse]) -> impl Iterator<Item = &[EdgeUse]> {
    uses.chunk_by(|a, b| a.ends == b.ends)
}

/// Faces joined across edges that exactly two of them use.
pub(crate) struct Patches {
    /// Of each face, another of its patch that is nearer to the patch's root, or itself.
    parent: Vec<u32>,
    /// Whether the face winds against its parent.
    against: Vec<bool>,
}

impl Patches {
    /// Joins faces 0 to `faces`. Where a patch cannot be wound consistently (a Möbius strip), some edge stays wrong.
    pub(crate) fn new(faces: u32, uses: &[EdgeUse]) -> Self {
        let mut patches = Self {
            parent: (0..faces).collect(),
            against: vec![false; faces as usize],
        };
        for edge in by_edge(uses) {
            if let [a, b] = edge {
                patches.join(a.face, b.face, a.descends == b.descends);
            }
        }
        patches
    }

    /// The root of the face's patch, and whether the face winds against it.
    pub(crate) fn root(&mut self, face: u32) -> (u32, bool) {
        let (mut root, mut against) = (face, false);
        while self.parent[root as usize] != root {
            against ^= self.against[root as usize];
            root = self.parent[root as usize];
        }
        // Point the whole path at the root, so that the next search is short.
        let (mut at, mut rest) = (face, against);
        while self.parent[at as usize] != root && at != root {
            let next = self.parent[at as usize];
            let own = self.against[at as usize];
            (self.parent[at as usize], self.against[at as usize]) = (root, rest);
            rest ^= own;
            at = next;
        }
        (root, against)
    }

    fn join(&mut self, a: u32, b: u32, against: bool) {
        let ((a, a_against), (b, b_against)) = (self.root(a), self.root(b));
        if a != b {
            let (low, high) = (a.min(b), a.max(b));
            self.parent[high as usize] = low;
            self.against[high as usize] = against ^ a_against ^ b_against;
        }
    }
}
