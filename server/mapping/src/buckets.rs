//! The queue of a flood.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Most buckets: 100 kB of them.
const MOST: f64 = 4096.0;

/// A source on its way at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    /// In units of the arcs' costs, before coefficients.
    pub(crate) distance: f64,
    pub(crate) node: u32,
    pub(crate) source: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    /// The nearest is the greatest, as a heap has it.
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |entry: &Self| (entry.source, entry.node);
        (other.distance.total_cmp(&self.distance)).then_with(|| key(other).cmp(&key(self)))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Entries by distance, in a ring of buckets that reaches one arc ahead of the current one.
///
/// As a rule a bucket is no wider than the cheapest arc. Nothing that comes from a bucket then falls into it, so that
/// its entries may be taken in any order, and the queue costs no more than the writing of its entries. Where the costs
/// differ too much for that, the current bucket is a heap.
pub(crate) struct Buckets {
    ring: Vec<Vec<Entry>>,
    heap: BinaryHeap<Entry>,
    ordered: bool,
    per_distance: f64,
    now: u64,
    /// Entries in other buckets than the current one.
    ahead: usize,
}

impl Buckets {
    /// For arcs that cost from `least` to `most`.
    pub(crate) fn new([least, most]: [f64; 2]) -> Self {
        let width = least.max(most / MOST);
        let width = if width > 0.0 { width } else { 1.0 };
        // An arc goes at most so far; one bucket more for rounding, and the current one.
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the width is no less than most / MOST"
        )]
        let reach = (most / width).ceil() as usize + 2;
        Self {
            ring: vec![Vec::new(); reach.next_power_of_two()],
            heap: BinaryHeap::new(),
            ordered: least < width,
            per_distance: width.recip(),
            now: 0,
            ahead: 0,
        }
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "beyond the last bucket all share one, in any order: slower, and as right"
    )]
    fn bucket(&self, distance: f64) -> u64 {
        (distance * self.per_distance) as i64 as u64 // a signed one is a single instruction away
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "the ring takes the lowest bits only"
    )]
    fn slot(&self, bucket: u64) -> usize {
        bucket as usize & (self.ring.len() - 1)
    }

    /// Whether it belongs into the current bucket.
    pub(crate) fn is_due(&self, distance: f64) -> bool {
        self.bucket(distance) <= self.now
    }

    pub(crate) fn push(&mut self, entry: Entry) {
        let bucket = self.bucket(entry.distance).max(self.now);
        if bucket > self.now {
            self.ahead += 1;
        } else if self.ordered {
            return self.heap.push(entry);
        }
        let slot = self.slot(bucket);
        self.ring[slot].push(entry);
    }

    /// An entry of the current bucket.
    pub(crate) fn pop(&mut self) -> Option<Entry> {
        if self.ordered {
            return self.heap.pop();
        }
        let slot = self.slot(self.now);
        self.ring[slot].pop()
    }

    /// Goes from an empty bucket to the next one that has entries, or to that of `stop`, if that comes first. False if
    /// there is neither.
    pub(crate) fn advance(&mut self, stop: Option<f64>) -> bool {
        let stop = stop.map(|distance| self.bucket(distance));
        if self.ahead == 0 {
            let Some(stop) = stop else {
                return false;
            };
            self.now = stop;
            return true;
        }
        loop {
            self.now += 1;
            let slot = self.slot(self.now);
            let found = self.ring[slot].len();
            if found > 0 {
                self.ahead -= found;
                if self.ordered {
                    let empty = std::mem::take(&mut self.heap).into_vec();
                    self.heap = std::mem::replace(&mut self.ring[slot], empty).into();
                }
                return true;
            }
            if stop == Some(self.now) {
                return true;
            }
        }
    }
}
