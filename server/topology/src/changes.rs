//! What an edit changed: what a patch is made of.

use std::ops::Range;

use crate::journal::Undo;
use crate::map::SIDE;
use crate::slots::{NONE, UNSETTLED};
use crate::{AnyCell, Cell, Dart, Kind, Map, Vertex};

/// A cell came or went. In the order of events, since a slot may be given up and taken again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A new cell.
    Born {
        /// The cell.
        cell: AnyCell,
        /// What it comes from: a cell of its own kind that was split and lives on, or the cell of a higher kind that it
        /// lies in, or nothing.
        parent: Option<AnyCell>,
        /// Of a new vertex, the vertices that it stands in the midst of: rows of [`Changes::among`]. Else empty.
        among: Range<u32>,
    },
    /// A cell that is no more.
    Died {
        /// The cell.
        cell: AnyCell,
        /// The cell of its kind that it was merged into, if any.
        heir: Option<AnyCell>,
    },
}

/// What an edit changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Cells that came or went, in order.
    pub events: Vec<Event>,
    /// The vertices that new vertices stand in the midst of; see [`Event::Born`].
    pub among: Vec<Cell<Vertex>>,
    /// Darts written to, perhaps several times, perhaps dead.
    pub(crate) darts: Vec<Dart>,
    /// Labels that these had before: column and label.
    before: Vec<(u8, u32)>,
    /// Volumes that sides of faces had before.
    volumes_before: Vec<u32>,
}

impl Changes {
    pub(crate) fn born(&mut self, cell: AnyCell, parent: Option<AnyCell>, among: &[Cell<Vertex>]) {
        let row = |length: usize| u32::try_from(length).expect("fewer than u32::MAX rows");
        let start = row(self.among.len());
        self.among.extend_from_slice(among);
        let among = start..row(self.among.len());
        self.events.push(Event::Born {
            cell,
            parent,
            among,
        });
    }

    pub(crate) fn died(&mut self, cell: AnyCell, heir: Option<AnyCell>) {
        self.events.push(Event::Died { cell, heir });
    }

    /// Takes down which darts an edit of `map` wrote to, whose writes are those from `first` on. Darts of faces that were
    /// paired or parted are here already.
    pub(crate) fn note(&mut self, map: &Map, first: usize) {
        let added = map.journal.added..map.dart_slot_count();
        self.darts.extend(added.map(Dart::at));
        for undo in &map.journal.writes[first..] {
            match *undo {
                Undo::Beta { dart, .. } | Undo::ReusedDart(dart) | Undo::FreedDart(dart) => {
                    self.touch(dart);
                }
                Undo::Label { column, dart, was } => {
                    self.touch(dart);
                    self.before.push((column, was));
                }
                Undo::SideVolume { was, .. } => self.volumes_before.push(was),
                Undo::CellDart { .. }
                | Undo::PairedFaces { .. }
                | Undo::UnpairedFaces { .. }
                | Undo::NewCell { .. }
                | Undo::FreedCell { .. } => {}
            }
        }
    }

    fn touch(&mut self, dart: Dart) {
        if self.darts.last() != Some(&dart) {
            self.darts.push(dart);
        }
    }

    /// The `K`-cells that the edit changed, made or ended, ascending: those that any dart written to belongs to, or did.
    /// `map` is the map as the edit left it.
    pub fn touched<K: Kind>(&self, map: &Map) -> Vec<Cell<K>> {
        let live = |dart: &&Dart| map.dart_at(dart.index()).is_some();
        let now = self.darts.iter().filter(live);
        let mut labels: Vec<_> = now.map(|&dart| map.label_of::<K>(dart)).collect();
        let column = K::DIMENSION.min(SIDE);
        for &(of, was) in &self.before {
            if usize::from(of) == column && was < UNSETTLED {
                match K::DIMENSION {
                    0 | 1 => labels.push(was),
                    2 => labels.push(was / 2),
                    _ => labels.push(map.side_volume[was as usize]),
                }
            }
        }
        if K::DIMENSION == 3 {
            labels.extend(&self.volumes_before);
        }
        labels.sort_unstable();
        labels.dedup();
        labels.retain(|&label| label != NONE);
        labels.into_iter().map(Cell::new).collect()
    }
}
