//! Edits: all of a batch or nothing of it.

use crate::error::EditError;
use crate::journal::Undo;
use crate::{AnyCell, Cell, Changes, Dart, Dimension, Kind, Map, Vertex, Volume};

/// A map that is being edited. What is done is final when the closure given to [`Map::edit`] returns `Ok`.
///
/// Each operation checks everything first: one that refuses has changed nothing, and the edit may go on without it.
///
/// Links alone ([`Edit::link1`] and its like) may leave a face open, or its two sides different, for as long as nothing
/// else is asked for: then every other operation, and the end of the edit, refuses with [`EditError::OpenFace`] or
/// [`EditError::SidesDiffer`].
#[derive(Debug)]
pub struct Edit<'a> {
    pub(crate) map: &'a mut Map,
    /// Writes of edits before.
    first: usize,
    pub(crate) changes: Changes,
    /// Darts whose cells are to be settled when the edit ends.
    pub(crate) unsettled: Vec<Dart>,
    /// Of faces that were linked or unlinked along β3, one dart and its β3 as the cells have it.
    pub(crate) unsettled_faces: Vec<(Dart, Option<Dart>)>,
    /// Darts before which their face is open.
    pub(crate) headless: Vec<Dart>,
    /// Whether β2 was ever free in this edit, so that fans of faces around vertices may have borders.
    pub(crate) has_borders: bool,
    /// Scratch memory, as the next.
    pub(crate) scratch: Vec<Dart>,
    pub(crate) queue: Vec<Dart>,
    pub(crate) flags: Vec<bool>,
    /// The darts of the faces that were paired or parted last, each with the one that faces it.
    pub(crate) pairs: Vec<[Dart; 2]>,
    finished: bool,
}

/// Where an edit was; see [`Edit::attempt`].
#[derive(Clone, Debug)]
struct Mark {
    writes: usize,
    events: usize,
    among: usize,
    darts: usize,
    /// Mostly empty, as the next two: only links leave anything to settle.
    unsettled: Vec<Dart>,
    unsettled_faces: Vec<(Dart, Option<Dart>)>,
    headless: Vec<Dart>,
    has_borders: bool,
}

impl Map {
    /// Makes a batch of edits: all of them, or none if `batch` returns an error. A rollback costs what the batch cost.
    ///
    /// In debug builds this asserts that the map has no [`Map::violations`] afterwards, which costs a look at every dart.
    ///
    /// # Errors
    /// What `batch` returns, or [`EditError::OpenFace`] or [`EditError::OpenVolume`] if links were left open.
    pub fn edit<T, E: From<EditError>>(
        &mut self,
        batch: impl FnOnce(&mut Edit<'_>) -> Result<T, E>,
    ) -> Result<(T, Changes), E> {
        self.journal.added = self.dart_slot_count();
        self.journal.fresh = self.journal.added;
        let first = self.journal.writes.len();
        let mut edit = Edit {
            map: self,
            first,
            changes: Changes::default(),
            unsettled: Vec::new(),
            unsettled_faces: Vec::new(),
            headless: Vec::new(),
            has_borders: false,
            scratch: Vec::new(),
            queue: Vec::new(),
            flags: Vec::new(),
            pairs: Vec::new(),
            finished: false,
        };
        let value = batch(&mut edit)?;
        edit.settle_whole()?;
        edit.finished = true;
        edit.changes.note(edit.map, first);
        let changes = std::mem::take(&mut edit.changes);
        if edit.map.journal.kept.is_none() {
            edit.map.journal.writes.clear();
        }
        drop(edit);
        debug_assert_eq!(self.violations(), [], "after an edit");
        Ok((value, changes))
    }
}

/// An edit that is not finished, be it for an error or a panic, did not happen.
impl Drop for Edit<'_> {
    fn drop(&mut self) {
        if !self.finished {
            self.map.undo(self.first, self.map.journal.added);
        }
    }
}

impl Edit<'_> {
    /// The map as it is now. Until the edit ends, faces may be open, and cells not follow what only links changed.
    pub fn map(&self) -> &Map {
        self.map
    }

    /// What was changed so far; which darts were written to is known when the edit ends.
    pub fn changes(&self) -> &Changes {
        &self.changes
    }

    /// Makes a batch within the batch: if `part` refuses, only what it did is taken back.
    ///
    /// # Errors
    /// What `part` returns.
    pub fn attempt<T, E>(&mut self, part: impl FnOnce(&mut Self) -> Result<T, E>) -> Result<T, E> {
        let mark = Mark {
            writes: self.map.journal.writes.len(),
            events: self.changes.events.len(),
            among: self.changes.among.len(),
            darts: self.changes.darts.len(),
            unsettled: self.unsettled.clone(),
            unsettled_faces: self.unsettled_faces.clone(),
            headless: self.headless.clone(),
            has_borders: self.has_borders,
        };
        let rows = self.map.dart_slot_count();
        let fresh = std::mem::replace(&mut self.map.journal.fresh, rows);
        let done = part(self);
        self.map.journal.fresh = fresh;
        done.inspect_err(|_| {
            self.map.undo(mark.writes, rows);
            self.changes.events.truncate(mark.events);
            self.changes.among.truncate(mark.among);
            self.changes.darts.truncate(mark.darts);
            self.unsettled = mark.unsettled;
            self.unsettled_faces = mark.unsettled_faces;
            self.headless = mark.headless;
            self.has_borders = mark.has_borders;
        })
    }

    /// What linking leaves open only an edit as a whole can close.
    fn check_closed(&self) -> Result<(), EditError> {
        let map = &*self.map;
        let added = map.journal.added..map.dart_slot_count();
        let writes = map.journal.writes[self.first..].iter();
        let written = writes.filter_map(|undo| match *undo {
            Undo::Beta {
                of: 1 | 2, dart, ..
            }
            | Undo::ReusedDart(dart) => Some(dart),
            Undo::Beta { .. }
            | Undo::Label { .. }
            | Undo::SideVolume { .. }
            | Undo::CellDart { .. }
            | Undo::PairedFaces { .. }
            | Undo::UnpairedFaces { .. }
            | Undo::FreedDart(_)
            | Undo::NewCell { .. }
            | Undo::FreedCell { .. } => None,
        });
        for dart in added.map(Dart::at).chain(written) {
            if map.dart_at(dart.index()).is_none() {
                continue;
            }
            if map.beta[0][dart.index()].is_none() {
                return Err(EditError::OpenFace { dart });
            }
            if map.dimension == Dimension::Three && map.beta2(dart).is_none() {
                return Err(EditError::OpenVolume { dart });
            }
        }
        Ok(())
    }

    /// Settles what was linked, unless a face is open, or in a 3-map a volume.
    pub(crate) fn settle_whole(&mut self) -> Result<(), EditError> {
        self.settle_pending()?;
        if self.has_borders {
            self.check_closed()?;
            self.has_borders = false;
        }
        Ok(())
    }

    /// That `dart` is one of the map's.
    pub(crate) fn known(&self, dart: Dart) -> Result<(), EditError> {
        // Whatever has a β1 is; that column is about to be read anyway.
        let next = self.map.beta[0].get(dart.index());
        match next.is_some_and(Option::is_some) || self.map.dart_at(dart.index()).is_some() {
            true => Ok(()),
            false => Err(EditError::NoDart { dart }),
        }
    }

    /// One dart of `cell`.
    pub(crate) fn alive<K: Kind>(&self, cell: Cell<K>) -> Result<Dart, EditError> {
        let any = AnyCell::of(K::DIMENSION, cell.label());
        self.map
            .try_dart(cell)
            .ok_or(EditError::NoCell { cell: any })
    }

    /// That there may be so many darts more.
    pub(crate) fn room(&self, darts: usize) -> Result<(), EditError> {
        match self.map.dart_slot_count().checked_add(darts) {
            Some(total) if total <= Dart::MOST => Ok(()),
            _ => Err(EditError::Full),
        }
    }

    /// A new cell of `dimension` that comes from `parent`, with `dart` in it.
    pub(crate) fn bear(&mut self, dimension: usize, parent: Option<AnyCell>, dart: Dart) -> u32 {
        let label = self.map.new_cell(dimension, dart);
        self.changes
            .born(AnyCell::of(dimension, label), parent, &[]);
        label
    }

    /// A new vertex within `parent`, in the midst of `among`.
    pub(crate) fn bear_vertex(
        &mut self,
        parent: Option<AnyCell>,
        among: &[Cell<Vertex>],
        dart: Dart,
    ) -> Cell<Vertex> {
        let label = self.map.new_cell(0, dart);
        self.changes.born(AnyCell::of(0, label), parent, among);
        Cell::new(label)
    }

    pub(crate) fn bury(&mut self, dimension: usize, label: u32, heir: Option<u32>) {
        self.map.free_cell(dimension, label);
        let heir = heir.map(|heir| AnyCell::of(dimension, heir));
        self.changes.died(AnyCell::of(dimension, label), heir);
    }

    /// Sets both directions of β2 or β3.
    pub(crate) fn pair(&mut self, beta: usize, one: Dart, other: Dart) {
        self.map.set_beta(beta, one, Some(other));
        self.map.set_beta(beta, other, Some(one));
    }

    /// Gives all sides of faces around a volume, of which `darts` are the darts, to `volume`.
    pub(crate) fn own_sides(&mut self, darts: &[Dart], volume: Cell<Volume>) {
        for &dart in darts {
            let side = self.map.label[crate::map::SIDE][dart.index()];
            self.map.set_side_volume(side, volume.label());
        }
    }
}
