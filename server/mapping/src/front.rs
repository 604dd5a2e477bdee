//! What a flood is made of: what it spreads over, what it has reached, and its queue.

use crate::buckets::{Buckets, Entry};

/// What a flood spreads over.
pub trait Medium: Sync {
    /// Number of nodes.
    fn nodes(&self) -> usize;

    /// The least distance by which it is worth while to tell nodes apart, and the greatest from a node to the next.
    fn range(&self) -> [f64; 2];

    /// A distance at which a flood may start.
    fn round(&self, start: f64) -> f64;

    /// Goes on from a node that a source has reached at this distance to the next ones.
    fn leave(&self, node: u32, distance: f64, front: &mut impl Front);
}

/// The flood of one source, as a [`Medium`] sees it.
pub trait Front {
    /// How far the source is from a node, as far as is known; infinity where it has not come or was crowded out.
    fn known(&self, node: u32) -> f64;

    /// Tells that it comes to a node at this distance.
    fn reach(&mut self, node: u32, distance: f64);
}

/// What is known of the sources at each node.
pub(crate) trait Record {
    /// Takes note of a source at this distance from a node; false if that is no news, or none that counts.
    fn offer(&mut self, node: u32, source: u32, distance: f64) -> bool;

    /// How far a source is from a node; infinity if it is not known there.
    fn distance(&self, node: u32, source: u32) -> f64;
}

/// The flood of one source in a record.
pub(crate) struct Lone<'a, R> {
    pub(crate) record: &'a mut R,
    pub(crate) queue: &'a mut Buckets,
    pub(crate) source: u32,
    /// By what its distances are multiplied in the record.
    pub(crate) factor: f64,
    /// Up to where it goes in the record.
    pub(crate) limit: f64,
}

impl<R: Record> Front for Lone<'_, R> {
    fn known(&self, node: u32) -> f64 {
        let distance = self.record.distance(node, self.source);
        if self.factor > 0.0 {
            distance / self.factor
        } else {
            distance
        }
    }

    fn reach(&mut self, node: u32, distance: f64) {
        let recorded = self.factor * distance;
        if recorded <= self.limit && self.record.offer(node, self.source, recorded) {
            self.queue.push(Entry {
                distance,
                node,
                source: self.source,
            });
        }
    }
}
