//! Rings that no other ring of the same vertices was met for yet.

use super::rings::number;
use crate::slots::NONE;

/// A ring, seen from its smallest vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// The vertices after and before the smallest.
    pub(super) after: u32,
    pub(super) before: u32,
    /// How many vertices there are.
    pub(super) length: u32,
    /// The dart that leaves the smallest vertex.
    pub(super) dart: u32,
}

impl View {
    /// The place of the smallest vertex in `ring`, and the ring as seen from there; its darts start at `first`.
    #[inline]
    pub(super) fn of(ring: &[u32], first: usize) -> (usize, Self) {
        let (place, after, before) = match *ring {
            [a, b, c] if a < b && a < c => (0, b, c),
            [a, b, c] if b < c => (1, c, a),
            [a, b, _] => (2, a, b),
            _ => {
                let least = |least, at| if ring[at] < ring[least] { at } else { least };
                let place = (1..ring.len()).fold(0, least);
                let around = |steps| ring[(place + steps) % ring.len()];
                (place, around(1), around(ring.len() - 1))
            }
        };
        let view = Self {
            after,
            before,
            length: number(ring.len()),
            dart: number(first + place),
        };
        (place, view)
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    view: View,
    /// Another ring with the same smallest vertex, or [`NONE`].
    next: u32,
}

/// Open rings, in lists by smallest vertex. A list is as long as a vertex has open faces around it, since rings leave it
/// in pairs.
#[derive(Debug)]
pub(super) struct OpenFaces {
    head: Vec<u32>,
    nodes: Vec<Node>,
    /// Nodes not in use.
    free: u32,
}

/// What a ring met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meeting {
    /// No other: it is open now.
    Nothing,
    /// A ring that runs against it, which leaves the list; its dart that leaves the smallest vertex.
    Other(u32),
    /// A ring that runs as it does, so that one of the cells is inside out.
    Mirrored,
}

impl OpenFaces {
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            head: vec![NONE; vertices],
            nodes: Vec::new(),
            free: NONE,
        }
    }

    /// Meets a ring whose smallest vertex is `least`. `is_same` is asked, of an open ring that agrees around that vertex and
    /// is no triangle, whether it agrees elsewhere: of its dart, and whether it runs along.
    #[inline]
    pub(super) fn meet(
        &mut self,
        least: u32,
        view: View,
        is_same: impl Fn(u32, bool) -> bool,
    ) -> Meeting {
        let (mut at, mut last) = (self.head[least as usize], NONE);
        while at != NONE {
            let Node { view: other, next } = self.nodes[at as usize];
            let is_along = other.after == view.after && other.before == view.before;
            let is_against = other.after == view.before && other.before == view.after;
            if (is_against || is_along)
                && other.length == view.length
                && (view.length == 3 || is_same(other.dart, is_along))
            {
                if is_along {
                    return Meeting::Mirrored;
                }
                match self.nodes.get_mut(last as usize) {
                    Some(last) => last.next = next,
                    None => self.head[least as usize] = next,
                }
                self.nodes[at as usize].next = self.free;
                self.free = at;
                return Meeting::Other(other.dart);
            }
            (at, last) = (next, at);
        }
        self.open(least, view);
        Meeting::Nothing
    }

    fn open(&mut self, least: u32, view: View) {
        let head = &mut self.head[least as usize];
        let node = Node { view, next: *head };
        *head = match self.nodes.get_mut(self.free as usize) {
            Some(unused) => {
                let place = std::mem::replace(&mut self.free, unused.next);
                *unused = node;
                place
            }
            None => {
                self.nodes.push(node);
                number(self.nodes.len() - 1)
            }
        };
    }
}
