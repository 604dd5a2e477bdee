//! Vertex numbers as files give them.

/// From the numbers that a file gives its vertices to indices counted from 0.
pub(super) struct Labels {
    /// Sorted by label.
    label_and_index: Vec<(i64, u32)>,
}

impl Labels {
    /// The `n`-th label belongs to vertex `n`.
    ///
    /// # Errors
    /// The label that two vertices share.
    pub(super) fn new(labels: impl Iterator<Item = i64>) -> Result<Self, i64> {
        let mut label_and_index: Vec<(i64, u32)> = labels.zip(0..).collect();
        label_and_index.sort_unstable();
        match label_and_index.windows(2).find(|two| two[0].0 == two[1].0) {
            Some(two) => Err(two[0].0),
            None => Ok(Self { label_and_index }),
        }
    }

    pub(super) fn index(&self, label: i64) -> Option<u32> {
        // Nearly always the labels have no gaps, and the place follows from the first.
        let first = self.label_and_index.first()?.0;
        let guess = label
            .checked_sub(first)
            .and_then(|place| usize::try_from(place).ok())
            .and_then(|place| self.label_and_index.get(place));
        if let Some(&(_, index)) = guess.filter(|found| found.0 == label) {
            return Some(index);
        }
        let place = self
            .label_and_index
            .binary_search_by_key(&label, |pair| pair.0)
            .ok()?;
        Some(self.label_and_index[place].1)
    }
}
