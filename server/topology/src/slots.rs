//! The cells of one kind: which there are, and which slots may be taken again.

use crate::Dart;

/// Stands in a label column for "no cell". As the label of a side, for "no dart" as well: the row is free.
pub(crate) const NONE: u32 = u32::MAX;

/// The side of a dart so new that its face is not settled.
pub(crate) const UNSETTLED: u32 = u32::MAX - 1;

/// When the slot of a dead cell may be taken again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reuse {
    /// As soon as the next cell is made.
    AtOnce,
    /// After [`crate::Map::reclaim`].
    WhenReclaimed,
}

#[derive(Clone, Debug)]
pub(crate) struct Slots {
    /// One dart of each cell; `None` in slots without one.
    pub(crate) dart: Vec<Option<Dart>>,
    /// Slots to be taken, the last first.
    pub(crate) free: Vec<u32>,
    /// Slots without a cell that are not to be taken yet.
    pub(crate) retired: Vec<u32>,
    /// How often each slot was given up. Ends at the last slot that ever was: most maps have none.
    pub(crate) generation: Vec<u32>,
    pub(crate) reuse: Reuse,
}

impl Slots {
    pub(crate) fn new(reuse: Reuse) -> Self {
        Self {
            dart: Vec::new(),
            free: Vec::new(),
            retired: Vec::new(),
            generation: Vec::new(),
            reuse,
        }
    }

    pub(crate) fn live(&self) -> usize {
        self.dart.len() - self.free.len() - self.retired.len()
    }

    pub(crate) fn generation(&self, slot: u32) -> u32 {
        self.generation.get(slot as usize).copied().unwrap_or(0)
    }

    /// A slot for a new cell with `dart` in it, and whether it had one before.
    pub(crate) fn take(&mut self, dart: Dart) -> (u32, bool) {
        if let Some(slot) = self.free.pop() {
            self.dart[slot as usize] = Some(dart);
            return (slot, true);
        }
        let slot = u32::try_from(self.dart.len()).expect("no more cells than darts");
        self.dart.push(Some(dart));
        (slot, false)
    }

    pub(crate) fn untake(&mut self, slot: u32, reused: bool) {
        if reused {
            self.dart[slot as usize] = None;
            self.free.push(slot);
        } else {
            self.dart.pop();
        }
    }

    /// Gives a slot up; the caller has set its dart to `None`.
    pub(crate) fn give(&mut self, slot: u32) {
        let index = slot as usize;
        if self.generation.len() <= index {
            self.generation.resize(index + 1, 0);
        }
        self.generation[index] += 1;
        self.idle().push(slot);
    }

    pub(crate) fn ungive(&mut self, slot: u32) {
        let given = self.idle().pop();
        debug_assert_eq!(given, Some(slot), "undone in the reverse order");
        self.generation[slot as usize] -= 1;
        // As it was, so that a rollback leaves no trace.
        while self.generation.last() == Some(&0) {
            self.generation.pop();
        }
    }

    fn idle(&mut self) -> &mut Vec<u32> {
        match self.reuse {
            Reuse::AtOnce => &mut self.free,
            Reuse::WhenReclaimed => &mut self.retired,
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        4 * (self.dart.capacity()
            + self.free.capacity()
            + self.retired.capacity()
            + self.generation.capacity())
    }
}
