//! A queue in which every reader keeps its own place.

use std::collections::VecDeque;

/// Entries numbered from zero as they come, forgotten from the front. Readers hold numbers, not entries, so that a
/// reader which stands still costs nothing.
#[derive(Debug)]
pub(crate) struct Lane<T> {
    entries: VecDeque<Entry<T>>,
    /// Number that the next entry gets.
    next: u64,
    /// Bytes of all entries ever appended.
    appended: u64,
}

#[derive(Debug)]
struct Entry<T> {
    /// Bytes appended before this entry.
    start: u64,
    item: T,
}

impl<T> Lane<T> {
    pub(crate) const fn new() -> Self {
        Self {
            entries: VecDeque::new(),
            next: 0,
            appended: 0,
        }
    }

    /// Number of the oldest entry kept; the next number if none is.
    pub(crate) fn first(&self) -> u64 {
        self.next - self.entries.len() as u64
    }

    /// Number that the next entry gets.
    pub(crate) fn next(&self) -> u64 {
        self.next
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Bytes of all entries kept.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes_from(self.first())
    }

    /// Bytes of the entries from `place` on.
    pub(crate) fn bytes_from(&self, place: u64) -> u64 {
        self.entry(place)
            .map_or(0, |entry| self.appended - entry.start)
    }

    pub(crate) fn get(&self, place: u64) -> Option<&T> {
        self.entry(place).map(|entry| &entry.item)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> {
        self.entries.iter().map(|entry| &entry.item)
    }

    pub(crate) fn push(&mut self, bytes: u64, item: T) {
        self.entries.push_back(Entry {
            start: self.appended,
            item,
        });
        self.appended += bytes;
        self.next += 1;
    }

    pub(crate) fn forget_first(&mut self) -> Option<T> {
        self.entries.pop_front().map(|entry| entry.item)
    }

    fn entry(&self, place: u64) -> Option<&Entry<T>> {
        let index = place.checked_sub(self.first())?;
        self.entries.get(usize::try_from(index).ok()?)
    }
}

#[cfg(test)]
mod tests {
    use super::Lane;

    #[test]
    fn a_place_keeps_its_meaning_while_the_front_is_forgotten() {
        let mut lane = Lane::new();
        for (bytes, item) in [(10, 'a'), (20, 'b'), (30, 'c')] {
            lane.push(bytes, item);
        }
        assert_eq!((lane.first(), lane.next(), lane.bytes()), (0, 3, 60));
        assert_eq!(lane.forget_first(), Some('a'));
        assert_eq!((lane.first(), lane.len(), lane.bytes()), (1, 2, 50));
        assert_eq!(lane.get(0), None);
        assert_eq!(lane.get(2), Some(&'c'));
        assert_eq!((lane.bytes_from(2), lane.bytes_from(3)), (30, 0));
    }
}
