//! What an edit wrote, so that it can be taken back.

use crate::map::SIDE;
use crate::slots::{NONE, UNSETTLED};
use crate::{Dart, Map};

/// One write, and what was there before.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Undo {
    Beta {
        of: u8,
        dart: Dart,
        was: Option<Dart>,
    },
    Label {
        column: u8,
        dart: Dart,
        was: u32,
    },
    SideVolume {
        side: u32,
        was: u32,
    },
    CellDart {
        dimension: u8,
        cell: u32,
        was: Option<Dart>,
    },
    /// β3 of the darts around two faces that all had rows when the edit began. One entry does: by the time that it is
    /// undone, the rings are as they were.
    PairedFaces {
        one: Dart,
    },
    UnpairedFaces {
        one: Dart,
        other: Dart,
    },
    /// A dart in a row that had one before. Rows that are added need no entry: the map is cut off where they begin.
    ReusedDart(Dart),
    FreedDart(Dart),
    NewCell {
        dimension: u8,
        cell: u32,
        reused: bool,
    },
    FreedCell {
        dimension: u8,
        cell: u32,
    },
}

const _: () = assert!(size_of::<Undo>() <= 12);

#[derive(Clone, Debug, Default)]
pub(crate) struct Journal {
    pub(crate) writes: Vec<Undo>,
    /// Rows of darts from here on were added since the last point that may be gone back to: what is written there needs
    /// no undoing.
    pub(crate) fresh: usize,
    /// Rows of darts from here on were added since the edit began.
    pub(crate) added: usize,
    /// Rows of darts by the time of [`Map::keep`]: if there was one, writes are kept beyond the edit that made them.
    pub(crate) kept: Option<usize>,
}

impl Journal {
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Undo>() * self.writes.capacity()
    }
}

/// A dimension or a column, of which there are four at most.
#[expect(
    clippy::cast_possible_truncation,
    reason = "below 4; checking would cost as much as the write"
)]
fn small(number: usize) -> u8 {
    number as u8
}

/// Every write to a map goes through here.
impl Map {
    /// Takes the map as it is as what [`Map::revert`] goes back to. From then on what edits write over is remembered.
    pub fn keep(&mut self) {
        self.journal.writes.clear();
        self.journal.kept = Some(self.dart_slot_count());
    }

    /// Takes back all edits since [`Map::keep`], at their cost. Nothing, where that was never called.
    pub fn revert(&mut self) {
        if let Some(rows) = self.journal.kept {
            self.undo(0, rows);
        }
    }

    pub(crate) fn set_beta(&mut self, beta: usize, dart: Dart, to: Option<Dart>) {
        let was = std::mem::replace(&mut self.beta[beta - 1][dart.index()], to);
        if dart.index() < self.journal.fresh {
            let of = small(beta);
            self.journal.writes.push(Undo::Beta { of, dart, was });
        }
    }

    /// Links along β3 the darts around two faces, as [`Map::face_pairs`] has them.
    pub(crate) fn pair_faces(&mut self, pairs: &[[Dart; 2]]) {
        if self.are_old(pairs) {
            for &[one, other] in pairs {
                self.beta[2][one.index()] = Some(other);
                self.beta[2][other.index()] = Some(one);
            }
            let one = pairs[0][0];
            self.journal.writes.push(Undo::PairedFaces { one });
        } else {
            for &[one, other] in pairs {
                self.set_beta(3, one, Some(other));
                self.set_beta(3, other, Some(one));
            }
        }
    }

    /// Frees β3 of the darts around two faces.
    pub(crate) fn unpair_faces(&mut self, pairs: &[[Dart; 2]]) {
        if self.are_old(pairs) {
            for dart in pairs.as_flattened() {
                self.beta[2][dart.index()] = None;
            }
            let [one, other] = pairs[0];
            self.journal.writes.push(Undo::UnpairedFaces { one, other });
        } else {
            for &dart in pairs.as_flattened() {
                self.set_beta(3, dart, None);
            }
        }
    }

    /// Whether all had rows when the edit began, so that their links are in the journal.
    fn are_old(&self, pairs: &[[Dart; 2]]) -> bool {
        let mut darts = pairs.as_flattened().iter();
        darts.all(|dart| dart.index() < self.journal.added)
    }

    /// The darts around the face of `one`, each with the one of `other`'s that faces it when these two face each other.
    /// Returns whether the rings are of one length.
    pub(crate) fn face_pairs(&self, one: Dart, other: Dart, pairs: &mut Vec<[Dart; 2]>) -> bool {
        pairs.clear();
        pairs.extend(self.ring(one).map(|dart| [dart, other]));
        // The other ring runs against this one.
        let mut facing = other;
        for pair in pairs[1..].iter_mut().rev() {
            facing = self.beta1(facing);
            pair[1] = facing;
            if facing == other {
                return false;
            }
        }
        self.beta1(facing) == other
    }

    pub(crate) fn set_label(&mut self, column: usize, dart: Dart, to: u32) {
        let was = std::mem::replace(&mut self.label[column][dart.index()], to);
        if dart.index() < self.journal.fresh {
            let column = small(column);
            self.journal.writes.push(Undo::Label { column, dart, was });
        }
    }

    pub(crate) fn set_side_volume(&mut self, side: u32, to: u32) {
        let was = std::mem::replace(&mut self.side_volume[side as usize], to);
        // Whole cells are written, of which often little changes.
        if was != to {
            self.journal.writes.push(Undo::SideVolume { side, was });
        }
    }

    pub(crate) fn set_cell_dart(&mut self, dimension: usize, cell: u32, to: Option<Dart>) {
        let was = std::mem::replace(&mut self.slots[dimension].dart[cell as usize], to);
        if was != to {
            let dimension = small(dimension);
            let undo = Undo::CellDart {
                dimension,
                cell,
                was,
            };
            self.journal.writes.push(undo);
        }
    }

    /// A dart that is free everywhere and in no cell. The caller has made sure that there may be one more.
    pub(crate) fn new_dart(&mut self) -> Dart {
        if let Some(dart) = self.free_darts.pop() {
            self.label[SIDE][dart.index()] = UNSETTLED;
            self.journal.writes.push(Undo::ReusedDart(dart));
            return dart;
        }
        let dart = Dart::at(self.label[SIDE].len());
        self.beta.iter_mut().for_each(|column| column.push(None));
        let [vertex, edge, side] = &mut self.label;
        vertex.push(NONE);
        edge.push(NONE);
        side.push(UNSETTLED);
        dart
    }

    /// Takes a dart out of its cells and away. The caller has seen to whatever was linked to it.
    pub(crate) fn free_dart(&mut self, dart: Dart) {
        for beta in 1..=3 {
            self.set_beta(beta, dart, None);
        }
        for column in 0..3 {
            self.set_label(column, dart, NONE);
        }
        self.free_darts.push(dart);
        self.journal.writes.push(Undo::FreedDart(dart));
    }

    /// A new cell with `dart` in it.
    pub(crate) fn new_cell(&mut self, dimension: usize, dart: Dart) -> u32 {
        let (cell, reused) = self.slots[dimension].take(dart);
        if dimension == 2 && !reused {
            self.side_volume.extend([NONE; 2]);
        }
        let dimension = small(dimension);
        let undo = Undo::NewCell {
            dimension,
            cell,
            reused,
        };
        self.journal.writes.push(undo);
        cell
    }

    pub(crate) fn free_cell(&mut self, dimension: usize, cell: u32) {
        self.set_cell_dart(dimension, cell, None);
        if dimension == 2 {
            self.set_side_volume(2 * cell, NONE);
            self.set_side_volume(2 * cell + 1, NONE);
        }
        self.slots[dimension].give(cell);
        let dimension = small(dimension);
        self.journal
            .writes
            .push(Undo::FreedCell { dimension, cell });
    }

    /// Takes back all writes but the first `keep`, and all rows of darts but the first `rows`.
    pub(crate) fn undo(&mut self, keep: usize, rows: usize) {
        let mut pairs = Vec::new();
        while self.journal.writes.len() > keep {
            match self.journal.writes.pop() {
                None => return,
                Some(undo) => self.undo_one(undo, &mut pairs),
            }
        }
        self.beta
            .iter_mut()
            .for_each(|column| column.truncate(rows));
        self.label
            .iter_mut()
            .for_each(|column| column.truncate(rows));
    }

    /// `pairs` is scratch memory.
    fn undo_one(&mut self, undo: Undo, pairs: &mut Vec<[Dart; 2]>) {
        match undo {
            Undo::Beta { of, dart, was } => self.beta[usize::from(of) - 1][dart.index()] = was,
            Undo::Label { column, dart, was } => {
                self.label[usize::from(column)][dart.index()] = was;
            }
            Undo::SideVolume { side, was } => self.side_volume[side as usize] = was,
            Undo::PairedFaces { one } => {
                pairs.clear();
                pairs.extend(self.ring(one).filter_map(|d| Some([d, self.beta3(d)?])));
                for dart in pairs.as_flattened() {
                    self.beta[2][dart.index()] = None;
                }
            }
            Undo::UnpairedFaces { one, other } => {
                self.face_pairs(one, other, pairs);
                for &[one, other] in &*pairs {
                    self.beta[2][one.index()] = Some(other);
                    self.beta[2][other.index()] = Some(one);
                }
            }
            Undo::CellDart {
                dimension,
                cell,
                was,
            } => self.slots[usize::from(dimension)].dart[cell as usize] = was,
            Undo::ReusedDart(dart) => {
                self.label[SIDE][dart.index()] = NONE;
                self.free_darts.push(dart);
            }
            Undo::FreedDart(_) => {
                self.free_darts.pop();
            }
            Undo::NewCell {
                dimension,
                cell,
                reused,
            } => {
                self.slots[usize::from(dimension)].untake(cell, reused);
                if dimension == 2 && !reused {
                    self.side_volume.truncate(2 * cell as usize);
                }
            }
            Undo::FreedCell { dimension, cell } => {
                self.slots[usize::from(dimension)].ungive(cell);
            }
        }
    }
}
