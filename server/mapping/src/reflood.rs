//! Floods of the part of a graph that a change of it reaches.
//!
//! An entry of a row, a source at a distance, stands on a root of the source there or on an entry of a neighbour that is an
//! arc nearer. Where roots and arcs went, what stood on them falls, and what stood on that, the nearest first: at each
//! entry no more is asked than whether something nearer still holds it. Nodes that lost an entry may have room for what was
//! crowded out there, so all of their rows are made anew: from their roots, and from their neighbours that lost none. The
//! work is that of the nodes that lose or gain an entry and of the rows beside them. (Ramalingam and Reps 1996, with the
//! nearest few sources in place of one, and without a bound on the order in which equally near entries are met.)

use std::collections::{BTreeSet, BinaryHeap};

use crate::arcs::{Arc, Arcs, Rewired};
use crate::buckets::Entry;
use crate::flood::{NOBODY, Nearest, Root};

/// Sources at a node: how far they are, and which; the nearest first.
pub(crate) type Row = Vec<(f64, u32)>;

/// What a flood keeps of each node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// The most sources.
    pub(crate) count: usize,
    /// The greatest distance.
    pub(crate) limit: f64,
}

/// A change of what a flood spreads over, and of where it starts.
pub(crate) struct Change<'a> {
    pub(crate) before: &'a Arcs,
    pub(crate) rewired: &'a Rewired,
    /// Roots that are no more.
    pub(crate) gone: &'a [Root],
    /// Roots that are new.
    pub(crate) come: &'a [Root],
    /// All roots there are now, by node; starts in the units of the arcs.
    pub(crate) roots: &'a [Root],
}

impl Change<'_> {
    pub(crate) fn row(&self, node: u32) -> &[Arc] {
        self.rewired.row(self.before, node)
    }

    /// The roots at a node.
    fn roots_at(&self, node: u32) -> impl Iterator<Item = &Root> {
        let first = self.roots.partition_point(|root| root.node < node);
        let roots = self.roots[first..].iter();
        roots.take_while(move |root| root.node == node)
    }
}

/// A flood, of which some rows are made anew.
pub(crate) struct Reflood<'a> {
    known: &'a Nearest,
    bounds: Bounds,
    /// By node, its place among `rows`; [`NOBODY`] where its row is the known one.
    places: Vec<u32>,
    nodes: Vec<u32>,
    rows: Vec<Row>,
    ahead: BinaryHeap<Entry>,
}

impl<'a> Reflood<'a> {
    /// Follows a change of the graph. The rows of `lost` nodes are made anew in any case.
    pub(crate) fn new(
        known: &'a Nearest,
        bounds: Bounds,
        change: &Change<'_>,
        lost: &[u32],
    ) -> Self {
        let nodes = change.rewired.len(change.before);
        let mut reflood = Self {
            known,
            bounds,
            places: vec![NOBODY; nodes],
            nodes: Vec::new(),
            rows: Vec::new(),
            ahead: BinaryHeap::new(),
        };
        let mut lost: BTreeSet<u32> = lost.iter().copied().collect();
        let fallen = reflood.fallen(change, &lost);
        lost.extend(fallen.into_iter().map(|(node, _)| node));
        lost.extend(number(change.before.len())..number(nodes));
        for &node in &lost {
            reflood.row_mut(node).clear();
        }
        for &node in &lost {
            for root in change.roots_at(node) {
                reflood.offer(node, root.source, root.start);
            }
            for &(from, cost) in change.row(node) {
                if !lost.contains(&from) {
                    reflood.carry(from, node, cost);
                }
            }
        }
        for root in change.come {
            reflood.offer(root.node, root.source, root.start);
        }
        for &node in change.rewired.nodes() {
            for &(next, cost) in change.row(node) {
                let was = cost_of(change.before.row(node), next);
                if was.is_none_or(|was| cost < was) && !lost.contains(&next) {
                    reflood.carry(node, next, cost);
                }
            }
        }
        reflood.spread(change);
        reflood
    }

    /// Starts from more roots.
    pub(crate) fn start(&mut self, roots: &[Root], change: &Change<'_>) {
        for root in roots {
            self.offer(root.node, root.source, root.start);
        }
        self.spread(change);
    }

    /// What of the known entries holds no more, as nodes and sources, beside that of `lost` nodes.
    fn fallen(&self, change: &Change<'_>, lost: &BTreeSet<u32>) -> BTreeSet<(u32, u32)> {
        let mut doubtful = BinaryHeap::new();
        let mut doubt = |node, source, distance| {
            if self.distance(node, source) == Some(distance) {
                doubtful.push(Entry {
                    distance,
                    node,
                    source,
                });
            }
        };
        for root in change.gone {
            doubt(root.node, root.source, root.start);
        }
        for &node in change.rewired.nodes() {
            let now = change.row(node);
            for &(next, cost) in change.before.row(node) {
                if cost_of(now, next).is_none_or(|now| now > cost) {
                    self.see(node, |source, distance| {
                        doubt(next, source, distance + cost)
                    });
                }
            }
        }
        let mut fallen = BTreeSet::<(u32, u32)>::new();
        while let Some(entry) = doubtful.pop() {
            let Entry {
                distance,
                node,
                source,
            } = entry;
            let known = (node, source);
            if fallen.contains(&known)
                || self.is_held(entry, change, |node, source| {
                    lost.contains(&node) || fallen.contains(&(node, source))
                })
            {
                continue;
            }
            fallen.insert(known);
            // What stands on it does so by the arcs that there were.
            for &(next, cost) in change.before.row(node) {
                let distance = distance + cost;
                if self.distance(next, source) == Some(distance) {
                    doubtful.push(Entry {
                        distance,
                        node: next,
                        source,
                    });
                }
            }
        }
        fallen
    }

    /// Whether an entry stands on a root or on a nearer entry that has not fallen. All that are nearer are settled.
    fn is_held(
        &self,
        entry: Entry,
        change: &Change<'_>,
        is_fallen: impl Fn(u32, u32) -> bool,
    ) -> bool {
        let Entry {
            distance,
            node,
            source,
        } = entry;
        let mut roots = change.roots_at(node);
        if roots.any(|root| root.source == source && root.start <= distance) {
            return true;
        }
        change.row(node).iter().any(|&(from, cost)| {
            let before = self.distance(from, source);
            before.is_some_and(|before| before < distance && before + cost <= distance)
                && !is_fallen(from, source)
        })
    }

    /// How far a source is from a node.
    fn distance(&self, node: u32, source: u32) -> Option<f64> {
        match self.row(node) {
            Some(row) => row
                .iter()
                .find(|entry| entry.1 == source)
                .map(|entry| entry.0),
            None => {
                let row = self.known_row(node);
                let place = self.known.sources[row.clone()]
                    .iter()
                    .position(|&s| s == source)?;
                Some(self.known.distances[row.start + place])
            }
        }
    }

    fn known_row(&self, node: u32) -> std::ops::Range<usize> {
        let start = node as usize * self.known.stride;
        // A new node has none.
        start.min(self.known.sources.len())
            ..(start + self.known.stride).min(self.known.sources.len())
    }

    /// The row of a node, where it was made anew.
    fn row(&self, node: u32) -> Option<&Row> {
        self.rows.get(self.places[node as usize] as usize)
    }

    /// Shows the entries of a node.
    fn see(&self, node: u32, mut see: impl FnMut(u32, f64)) {
        match self.row(node) {
            Some(row) => row
                .iter()
                .for_each(|&(distance, source)| see(source, distance)),
            None => {
                let row = self.known_row(node);
                let sources = self.known.sources[row.clone()].iter();
                let entries = sources.zip(&self.known.distances[row]);
                let entries = entries.take_while(|entry| *entry.0 != NOBODY);
                entries.for_each(|(&source, &distance)| see(source, distance));
            }
        }
    }

    /// The entries of a node.
    pub(crate) fn entries(&self, node: u32) -> Row {
        let mut row = Row::new();
        self.see(node, |source, distance| row.push((distance, source)));
        row
    }

    /// The row of a node, to be changed.
    fn row_mut(&mut self, node: u32) -> &mut Row {
        if self.row(node).is_none() {
            let row = self.entries(node);
            self.places[node as usize] = number(self.rows.len());
            self.nodes.push(node);
            self.rows.push(row);
        }
        &mut self.rows[self.places[node as usize] as usize]
    }

    /// Takes what is at a node along an arc from it.
    fn carry(&mut self, from: u32, to: u32, cost: f64) {
        for (distance, source) in self.entries(from) {
            self.offer(to, source, distance + cost);
        }
    }

    /// Takes note of a source at this distance from a node, if that is news and counts.
    fn offer(&mut self, node: u32, source: u32, distance: f64) {
        let Bounds { count, limit } = self.bounds;
        let is_news = match self.row(node) {
            Some(row) => row.len() < count || (distance, source) < row[count - 1],
            None => {
                let last = self.known_row(node).nth(count - 1);
                last.is_none_or(|last| {
                    (distance, source) < (self.known.distances[last], self.known.sources[last])
                })
            }
        };
        let is_known = |known: f64| known <= distance;
        if distance > limit || !is_news || self.distance(node, source).is_some_and(is_known) {
            return;
        }
        let row = self.row_mut(node);
        row.retain(|entry| entry.1 != source);
        let place = row.partition_point(|entry| *entry < (distance, source));
        row.insert(place, (distance, source));
        row.truncate(count);
        self.ahead.push(Entry {
            distance,
            node,
            source,
        });
    }

    fn spread(&mut self, change: &Change<'_>) {
        while let Some(entry) = self.ahead.pop() {
            let Entry {
                distance,
                node,
                source,
            } = entry;
            // What has come nearer since is on its way already, and what was crowded out is no more.
            if self.distance(node, source) == Some(distance) {
                for &(next, cost) in change.row(node) {
                    self.offer(next, source, distance + cost);
                }
            }
        }
    }

    /// The nodes whose rows are other than the known ones, and all new ones; in no order.
    pub(crate) fn changed(&self) -> impl Iterator<Item = u32> + '_ {
        let rows = self.nodes.iter().zip(&self.rows);
        let changed = rows.filter(|&(&node, row)| {
            let known = self.known_row(node);
            let entries = self.known.distances[known.clone()].iter();
            let entries = entries
                .copied()
                .zip(self.known.sources[known].iter().copied());
            entries.len() == 0
                || !entries
                    .take_while(|entry| entry.1 != NOBODY)
                    .eq(row.iter().copied())
        });
        changed.map(|(node, _)| *node)
    }

    /// The nodes that lost all sources, ascending.
    pub(crate) fn unreached(&self) -> Vec<u32> {
        let rows = self.nodes.iter().zip(&self.rows);
        let mut empty: Vec<u32> = rows
            .filter(|(_, row)| row.is_empty())
            .map(|(&node, _)| node)
            .collect();
        empty.sort_unstable();
        empty
    }

    /// The rows that were made anew.
    pub(crate) fn into_rows(self) -> Vec<(u32, Row)> {
        self.nodes.into_iter().zip(self.rows).collect()
    }
}

fn cost_of(row: &[Arc], to: u32) -> Option<f64> {
    let place = row.binary_search_by_key(&to, |arc| arc.0).ok()?;
    Some(row[place].1)
}

fn number(index: usize) -> u32 {
    u32::try_from(index).expect("nodes are counted by u32")
}

impl Nearest {
    /// Takes over rows, of which those of new nodes come by rising node, without a gap.
    pub(crate) fn take(&mut self, mut rows: Vec<(u32, Row)>) {
        let longest = rows.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
        if longest > self.stride {
            self.widen(longest);
        }
        rows.sort_unstable_by_key(|(node, _)| *node);
        for (node, row) in rows {
            let start = node as usize * self.stride;
            let end = start + self.stride;
            if self.sources.len() < end {
                self.sources.resize(end, NOBODY);
                self.distances.resize(end, f64::INFINITY);
            }
            self.sources[start..end].fill(NOBODY);
            self.distances[start..end].fill(f64::INFINITY);
            for (place, (distance, source)) in (start..).zip(row) {
                (self.distances[place], self.sources[place]) = (distance, source);
            }
        }
    }

    /// Makes the rows longer.
    fn widen(&mut self, stride: usize) {
        let rows = self.sources.len() / self.stride;
        let mut wide = Self {
            stride,
            sources: Vec::with_capacity(rows * stride),
            distances: Vec::with_capacity(rows * stride),
        };
        for row in 0..rows {
            let old = row * self.stride..(row + 1) * self.stride;
            wide.sources.extend_from_slice(&self.sources[old.clone()]);
            wide.sources.resize((row + 1) * stride, NOBODY);
            wide.distances.extend_from_slice(&self.distances[old]);
            wide.distances.resize((row + 1) * stride, f64::INFINITY);
        }
        *self = wide;
    }
}
