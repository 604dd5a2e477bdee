//! Columns that remember what they were.

use std::ops::Deref;

/// A column that can go back to where it was when it was kept last, at the cost of what was written since.
#[derive(Clone, Debug)]
pub(crate) struct Ledger<T> {
    values: Vec<T>,
    /// Entries that there were.
    kept: usize,
    /// What was written over of those, in order.
    was: Vec<(usize, T)>,
}

impl<T: Copy> Ledger<T> {
    /// A column that is kept as it is.
    pub(crate) fn new(values: Vec<T>) -> Self {
        Self {
            kept: values.len(),
            values,
            was: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, value: T) {
        self.values.push(value);
    }

    /// # Panics
    /// If there is no such entry.
    pub(crate) fn set(&mut self, at: usize, value: T) {
        let was = std::mem::replace(&mut self.values[at], value);
        if at < self.kept {
            self.was.push((at, was));
        }
    }

    /// Appends entries of this value until there are so many.
    pub(crate) fn grow(&mut self, length: usize, value: T) {
        if self.values.len() < length {
            self.values.resize(length, value);
        }
    }

    /// Takes what is there as what to go back to.
    pub(crate) fn keep(&mut self) {
        self.kept = self.values.len();
        self.was.clear();
    }

    pub(crate) fn revert(&mut self) {
        self.values.truncate(self.kept);
        for (at, was) in self.was.drain(..).rev() {
            self.values[at] = was;
        }
    }
}

impl<T> Deref for Ledger<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_goes_back_to_what_was_kept() {
        let mut ledger = Ledger::new(vec![1, 2, 3]);
        ledger.set(1, 20);
        ledger.keep();
        ledger.push(4);
        ledger.set(3, 40);
        ledger.set(0, 10);
        ledger.set(0, 11);
        ledger.grow(6, 0);
        assert_eq!(*ledger, [11, 20, 3, 40, 0, 0]);
        ledger.revert();
        assert_eq!(*ledger, [1, 20, 3]);
    }
}
