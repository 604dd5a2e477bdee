//! Inner fractures: faces that came apart where nobody sees it.

use sinew_topology::{AnyCell, Cell, Dart, Face, Map};

use crate::commit::Made;
use crate::ledger::Ledger;
use crate::{Body, Effect};

/// Which faces of the boundary belong to a fracture that does not reach the surface.
#[derive(Clone, Debug)]
pub(crate) struct Fractures {
    /// By face of the map; faces beyond the end are not.
    inner: Ledger<bool>,
}

impl Default for Fractures {
    /// None.
    fn default() -> Self {
        Self {
            inner: Ledger::new(Vec::new()),
        }
    }
}

impl Fractures {
    pub(crate) fn is_inner(&self, face: Cell<Face>) -> bool {
        self.inner.get(face.index()).is_some_and(|inner| *inner)
    }

    fn set(&mut self, face: Cell<Face>, inner: bool) {
        if inner {
            self.inner.grow(face.index() + 1, false);
        }
        if self.is_inner(face) != inner {
            self.inner.set(face.index(), inner);
        }
    }

    pub(crate) fn keep(&mut self) {
        self.inner.keep();
    }

    pub(crate) fn revert(&mut self) {
        self.inner.revert();
    }

    pub(crate) fn born(&mut self, face: Cell<Face>, parent: Option<AnyCell>) {
        let inner = matches!(parent, Some(AnyCell::Face(parent)) if self.is_inner(parent));
        self.set(face, inner);
    }

    pub(crate) fn died(&mut self, face: Cell<Face>) {
        self.set(face, false);
    }
}

impl Body {
    /// Finds out which of the faces that were bared the outside can see: those that the boundary joins to its old part.
    pub(crate) fn follow_fractures(&mut self, made: &Made, effects: &mut Vec<Effect>) {
        let darts = made.opened.iter().flatten().chain(&made.bared);
        let mut bared: Vec<_> = darts.map(|&dart| self.map.face(dart)).collect();
        bared.sort_unstable();
        bared.dedup();
        let (mut is_inner, mut is_opened) = (false, false);
        let mut seen: Vec<Cell<Face>> = Vec::new();
        for &face in &bared {
            if seen.binary_search(&face).is_ok() {
                continue;
            }
            let shell = self.shell(face, &bared);
            let was_inner = shell
                .faces
                .iter()
                .any(|&face| self.fractures.is_inner(face));
            for &face in &shell.faces {
                self.fractures.set(face, !shell.is_seen);
            }
            is_inner |= !shell.is_seen;
            is_opened |= shell.is_seen && was_inner;
            seen.extend(shell.faces);
            seen.sort_unstable();
        }
        if is_inner && !made.opened.is_empty() {
            effects.push(Effect::InnerFracture);
        }
        if is_opened {
            effects.push(Effect::FractureOpened);
        }
    }

    /// The faces around `first` that were bared now, or are inner, joined by edges of the boundary.
    fn shell(&self, first: Cell<Face>, bared: &[Cell<Face>]) -> Shell {
        let mut shell = Shell {
            faces: vec![first],
            is_seen: false,
        };
        let mut met = std::collections::BTreeSet::from([first]);
        let mut done = 0;
        while let Some(&face) = shell.faces.get(done) {
            done += 1;
            for dart in self.map.ring(self.map.dart(face)) {
                let next = self.map.face(beside(&self.map, dart));
                if bared.binary_search(&next).is_err() && !self.fractures.is_inner(next) {
                    shell.is_seen = true;
                } else if met.insert(next) {
                    shell.faces.push(next);
                }
            }
        }
        shell
    }
}

struct Shell {
    faces: Vec<Cell<Face>>,
    /// Whether it joins on to the surface.
    is_seen: bool,
}

/// Of a boundary dart, the dart of the same edge in the next face of the boundary.
fn beside(map: &Map, dart: Dart) -> Dart {
    let mut at = dart;
    loop {
        let across = map.beta2(at).expect("the surfaces of volumes are closed");
        match map.beta3(across) {
            None => return across,
            Some(beyond) => at = beyond,
        }
    }
}
