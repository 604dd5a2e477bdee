//! The darts of one cell after the other.

use std::marker::PhantomData;

use crate::{Cell, Dart, Kind, Map};

/// A set of rows, one bit each, that is emptied in proportion to what was put in.
#[derive(Clone, Debug, Default)]
pub(crate) struct Marks {
    bits: Vec<u64>,
}

impl Marks {
    /// Room for rows below `length`.
    pub(crate) fn reserve(&mut self, length: usize) {
        let words = length.div_ceil(64);
        if self.bits.len() < words {
            self.bits.resize(words, 0);
        }
    }

    /// Puts a row in; returns whether it was new.
    pub(crate) fn insert(&mut self, row: usize) -> bool {
        let (word, bit) = (&mut self.bits[row / 64], 1 << (row % 64));
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    pub(crate) fn contains(&self, row: usize) -> bool {
        self.bits[row / 64] >> (row % 64) & 1 != 0
    }

    pub(crate) fn remove(&mut self, row: usize) {
        self.bits[row / 64] &= !(1 << (row % 64));
    }
}

/// Labels, each once, in the order of their arrival.
#[derive(Clone, Debug, Default)]
pub(crate) struct LabelSet {
    marks: Marks,
    pub(crate) labels: Vec<u32>,
}

impl LabelSet {
    /// Empties the set and makes room for labels below `length`.
    pub(crate) fn restart(&mut self, length: usize) {
        for label in self.labels.drain(..) {
            self.marks.remove(label as usize);
        }
        self.marks.reserve(length);
    }

    /// Puts a label in; returns whether it was new.
    pub(crate) fn insert(&mut self, label: u32) -> bool {
        let new = self.marks.insert(label as usize);
        if new {
            self.labels.push(label);
        }
        new
    }

    pub(crate) fn has(&self, label: u32) -> bool {
        self.marks.contains(label as usize)
    }

    fn bytes(&self) -> usize {
        8 * self.marks.bits.capacity() + 4 * self.labels.capacity()
    }
}

/// Scratch memory for walks: one bit per dart and cell, and the darts and cells of the last walk. Keep one and use it
/// again: then a walk allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    seen: Marks,
    darts: Vec<Dart>,
    /// For queries that collect cells.
    pub(crate) found: LabelSet,
    pub(crate) through: LabelSet,
}

impl Walk {
    pub(crate) fn restart(&mut self, map: &Map) {
        self.clear();
        self.seen.reserve(map.dart_slot_count());
    }

    pub(crate) fn clear(&mut self) {
        for dart in self.darts.drain(..) {
            self.seen.remove(dart.index());
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let cells = self.found.bytes() + self.through.bytes();
        8 * self.seen.bits.capacity() + 4 * self.darts.capacity() + cells
    }

    /// The darts met so far.
    pub(crate) fn darts(&self) -> &[Dart] {
        &self.darts
    }

    #[inline]
    pub(crate) fn push(&mut self, dart: Dart) {
        if self.seen.insert(dart.index()) {
            self.darts.push(dart);
        }
    }

    pub(crate) fn has(&self, dart: Dart) -> bool {
        self.seen.contains(dart.index())
    }

    /// Meets what is one step away from `dart` within its `dimension`-cell.
    #[inline]
    pub(crate) fn step(&mut self, map: &Map, dimension: usize, dart: Dart) {
        let [beta1, beta2, beta3] = &map.beta;
        let at = dart.index();
        let then = |dart: Option<Dart>| dart.and_then(|dart| beta1[dart.index()]);
        match dimension {
            0 => {
                match then(beta2[at]) {
                    Some(next) => self.push(next),
                    // The end of a fan that a border cuts: what lies before its start is reached from here only.
                    None => self.step_back(map, dart),
                }
                if let Some(next) = then(beta3[at]) {
                    self.push(next);
                }
            }
            1 => self.meet_both(beta2[at], beta3[at]),
            2 => self.meet_both(beta1[at], beta3[at]),
            _ => self.meet_both(beta1[at], beta2[at]),
        }
    }

    #[inline]
    fn meet_both(&mut self, one: Option<Dart>, other: Option<Dart>) {
        for dart in [one, other].into_iter().flatten() {
            self.push(dart);
        }
    }

    /// Meets the darts before `dart` in the fan of faces around its vertex, within one volume.
    fn step_back(&mut self, map: &Map, dart: Dart) {
        let mut at = dart;
        while let Some(before) = map.try_beta0(at).and_then(|d| map.beta2(d)) {
            self.push(before);
            at = before;
        }
    }

    /// Whether `to` is in the same `dimension`-cell as `from`. If not, the walk has met all darts of `from`'s.
    pub(crate) fn reaches(&mut self, map: &Map, dimension: usize, from: Dart, to: Dart) -> bool {
        self.restart(map);
        self.push(from);
        let mut done = 0;
        while let Some(&next) = self.darts.get(done) {
            self.step(map, dimension, next);
            if self.has(to) {
                return true;
            }
            done += 1;
        }
        false
    }

    /// All darts of the `dimension`-cell that `dart` belongs to, beginning with it.
    pub(crate) fn collect(&mut self, map: &Map, dimension: usize, dart: Dart) -> &[Dart] {
        self.restart(map);
        self.push(dart);
        let mut done = 0;
        while let Some(&next) = self.darts.get(done) {
            self.step(map, dimension, next);
            done += 1;
        }
        &self.darts
    }
}

/// The darts of one cell, each once. See [`Map::orbit`].
#[derive(Debug)]
pub struct Orbit<'a, K> {
    map: &'a Map,
    walk: &'a mut Walk,
    done: usize,
    kind: PhantomData<fn() -> K>,
}

impl<K: Kind> Iterator for Orbit<'_, K> {
    type Item = Dart;

    fn next(&mut self) -> Option<Dart> {
        let dart = *self.walk.darts.get(self.done)?;
        self.walk.step(self.map, K::DIMENSION, dart);
        self.done += 1;
        Some(dart)
    }
}

impl Map {
    /// The darts of a cell, each once, beginning with [`Map::dart`]. Of a vertex: those that leave it.
    ///
    /// `walk` is scratch memory; without edits in between, nothing is allocated from the second orbit on.
    ///
    /// # Panics
    /// If the cell is dead.
    pub fn orbit<'a, K: Kind>(&'a self, cell: Cell<K>, walk: &'a mut Walk) -> Orbit<'a, K> {
        self.orbit_of::<K>(self.dart(cell), walk)
    }

    /// [`Map::orbit`] of the cell that `dart` belongs to, beginning with it.
    pub fn orbit_of<'a, K: Kind>(&'a self, dart: Dart, walk: &'a mut Walk) -> Orbit<'a, K> {
        walk.restart(self);
        walk.push(dart);
        Orbit {
            map: self,
            walk,
            done: 0,
            kind: PhantomData,
        }
    }

    /// The darts of one side of a face, along the ring from `dart`.
    ///
    /// # Panics
    /// As [`Map::beta1`].
    pub fn ring(&self, dart: Dart) -> impl Iterator<Item = Dart> + '_ {
        let mut next = Some(dart);
        std::iter::from_fn(move || {
            let now = next?;
            next = Some(self.beta1(now)).filter(|&following| following != dart);
            Some(now)
        })
    }

    /// The darts of an edge, in the order around it, from `dart`. Where the boundary cuts the ring of volumes around,
    /// from `dart` to the one end, then from `dart` to the other.
    pub fn around(&self, dart: Dart) -> impl Iterator<Item = Dart> + '_ {
        // 1 and 2 stand for β2 and β3: they alternate.
        let (mut at, mut by, mut second) = (dart, 1, false);
        let mut first = Some(dart);
        std::iter::from_fn(move || {
            if let Some(first) = first.take() {
                return Some(first);
            }
            loop {
                match self.beta[by][at.index()] {
                    Some(next) if next == dart => return None,
                    Some(next) => {
                        (at, by) = (next, 3 - by);
                        return Some(next);
                    }
                    None if second => return None,
                    None => (at, by, second) = (dart, 2, true),
                }
            }
        })
    }

    /// The darts one step from `dart` within its vertex or edge (0 or 1), of a 3-map.
    pub(crate) fn steps(&self, dimension: usize, dart: Dart) -> [Option<Dart>; 2] {
        let across = [1, 2].map(|beta| self.beta[beta][dart.index()]);
        match dimension {
            0 => across.map(|next| self.beta[0][next?.index()]),
            _ => across,
        }
    }

    /// β0, or `None` where the face is open.
    pub(crate) fn try_beta0(&self, dart: Dart) -> Option<Dart> {
        let mut before = dart;
        loop {
            let next = self.beta[0][before.index()]?;
            if next == dart {
                return Some(before);
            }
            before = next;
        }
    }
}
