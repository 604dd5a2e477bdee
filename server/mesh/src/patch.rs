//! Cells that change some of their slots at once.

use thiserror::Error;

use crate::{Cells, GridError, check::at_most};

/// Why cells cannot be changed so.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PatchError {
    /// Not one slot per changed cell.
    #[error("{slots} slots for {cells} cells; give one slot per cell")]
    Length {
        /// Slots given.
        slots: usize,
        /// Cells given.
        cells: usize,
    },
    /// A slot that does not follow the one before.
    #[error("entry {entry} of the slots is {slot} after {before}; slots ascend, each named once")]
    Order {
        /// Entry among the slots.
        entry: usize,
        /// The slot.
        slot: u32,
        /// The one before.
        before: u32,
    },
    /// A slot beyond the next to be appended.
    #[error("entry {entry} of the slots is {slot}, where the next cell to append is {next}")]
    Gap {
        /// Entry among the slots.
        entry: usize,
        /// The slot.
        slot: u32,
        /// The slot that it may be at most.
        next: usize,
    },
    /// The changed cells make no sense, or all cells together are too many.
    #[error("the changed cells: {0}")]
    Cells(#[from] GridError),
}

impl Cells {
    /// The cells after slot `slots[i]` took the form of `forms.cell(i)`, for each `i`. Slots ascend; those from
    /// [`Cells::len`] on are appended, without a gap. `vertices` is the number of vertices afterwards.
    ///
    /// Time is that of copying `self` and checking `forms`.
    ///
    /// # Errors
    /// The first [`PatchError`] found.
    pub fn patched(
        &self,
        slots: &[u32],
        forms: &Self,
        vertices: usize,
    ) -> Result<Self, PatchError> {
        forms.check(vertices)?;
        self.check_slots(slots, forms.len())?;
        let entries = [
            &self.connectivity,
            &forms.connectivity,
            &self.faces,
            &forms.faces,
        ];
        let entries = entries.map(Vec::len).into_iter().sum();
        at_most("connectivity` and `faces", entries, u32::MAX as usize)?;
        let cells = self.len() + forms.len();
        at_most("types", cells, u32::MAX as usize - 1)?;

        let mut patched = Self::with_capacity_of(self, forms);
        let mut kept = 0;
        for (form, &slot) in slots.iter().enumerate() {
            patched.extend(self, kept, self.len().min(slot as usize));
            patched.extend(forms, form, form + 1);
            kept = self.len().min(slot as usize + 1);
        }
        patched.extend(self, kept, self.len());
        if patched.faces.is_empty() {
            patched.face_offsets.clear();
        }
        Ok(patched)
    }

    /// [`Cells::hash`] of what [`Cells::patched`] makes of the same, given that of `self`: at the cost of the change.
    ///
    /// # Panics
    /// As [`Cells::cell`], and where `slots` and `forms` would be refused by [`Cells::patched`].
    pub fn patched_hash(&self, hash: u64, slots: &[u32], forms: &Self) -> u64 {
        let mut hash = hash;
        for (form, &slot) in forms.iter().zip(slots) {
            if (slot as usize) < self.len() {
                hash = hash.wrapping_sub(self.slot_hash(slot as usize));
            }
            hash = hash.wrapping_add(form.hash(slot));
        }
        hash
    }

    fn check_slots(&self, slots: &[u32], cells: usize) -> Result<(), PatchError> {
        if slots.len() != cells {
            let slots = slots.len();
            return Err(PatchError::Length { slots, cells });
        }
        let mut next = self.len();
        for (entry, &slot) in slots.iter().enumerate() {
            if let Some(&before) = entry.checked_sub(1).and_then(|before| slots.get(before))
                && slot <= before
            {
                return Err(PatchError::Order {
                    entry,
                    slot,
                    before,
                });
            }
            if slot as usize > next {
                return Err(PatchError::Gap { entry, slot, next });
            }
            next += usize::from(slot as usize == next);
        }
        Ok(())
    }

    fn with_capacity_of(a: &Self, b: &Self) -> Self {
        let mut offsets = Vec::with_capacity(a.offsets.len() + b.len());
        offsets.push(0);
        let streams = !a.faces.is_empty() || !b.faces.is_empty();
        Self {
            types: Vec::with_capacity(a.len() + b.len()),
            connectivity: Vec::with_capacity(a.connectivity.len() + b.connectivity.len()),
            face_offsets: if streams { offsets.clone() } else { Vec::new() },
            offsets,
            faces: Vec::with_capacity(a.faces.len() + b.faces.len()),
        }
    }

    /// Appends cells `start` to `end` of `from`, column by column.
    fn extend(&mut self, from: &Self, start: usize, end: usize) {
        self.types.extend_from_slice(&from.types[start..end]);
        extend_lists(
            [&mut self.connectivity, &mut self.offsets],
            [&from.connectivity, &from.offsets],
            start..end,
        );
        if self.face_offsets.is_empty() {
            return;
        }
        if from.face_offsets.is_empty() {
            let none = *self.face_offsets.last().expect("offsets begin with 0");
            self.face_offsets.resize(self.types.len() + 1, none);
        } else {
            extend_lists(
                [&mut self.faces, &mut self.face_offsets],
                [&from.faces, &from.face_offsets],
                start..end,
            );
        }
    }
}

/// Appends some of a column of lists, given as entries and offsets, to another.
fn extend_lists(
    [entries, offsets]: [&mut Vec<u32>; 2],
    [from_entries, from_offsets]: [&[u32]; 2],
    lists: std::ops::Range<usize>,
) {
    let base = *offsets.last().expect("offsets begin with 0");
    let ends = &from_offsets[lists.start..=lists.end];
    let first = ends[0];
    offsets.extend(ends[1..].iter().map(|end| base + (end - first)));
    entries.extend_from_slice(&from_entries[first as usize..ends[ends.len() - 1] as usize]);
}
