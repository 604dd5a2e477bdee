//! Floods: how far each node of a graph is from the sources nearest to it.

use rayon::prelude::*;

use crate::Graph;
use crate::blocks::BLOCK;
use crate::buckets::{Buckets, Entry};
use crate::front::{Front, Lone, Medium, Record};

/// In place of a source, where a node has fewer than are asked for.
pub(crate) const NOBODY: u32 = u32::MAX;

/// Rows up to this are sorted by insertion.
const SHORT: usize = 16;

/// Where the flood of a source starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// A node of the graph.
    pub node: u32,
    /// Whose flood it is, below `u32::MAX`. A source may have many roots.
    pub source: u32,
    /// At what distance from the source, 0 to 1e100.
    pub start: f64,
}

/// What spreads, and over what. `[W7]`
#[derive(Clone, Copy, Debug)]
pub struct Flood<'a, M = Graph> {
    /// Over what.
    pub graph: &'a M,
    /// Where from.
    pub roots: &'a [Root],
    /// By what the distances of each source are multiplied, 0 to 1e30; empty for 1 each. `[W6]`
    pub coefficients: &'a [f64],
    /// The greatest distance, times its coefficient, that is still reached; infinity for no end.
    pub limit: f64,
}

/// The sources nearest to each node, and how far they are, times their coefficients. `[W7]`
///
/// Rows of `stride` entries, nearest first, equal distances by source. A row that is not full ends in sources of
/// `u32::MAX` at infinite distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    pub(crate) stride: usize,
    pub(crate) sources: Vec<u32>,
    pub(crate) distances: Vec<f64>,
}

impl Nearest {
    /// The sources that reach a node and their distances, nearest first.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn row(&self, node: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let row = node * self.stride..(node + 1) * self.stride;
        let entries = self.sources[row.clone()].iter().zip(&self.distances[row]);
        let entries = entries.map(|(&source, &distance)| (source, distance));
        entries.take_while(|entry| entry.0 != NOBODY)
    }

    fn new(nodes: usize, stride: usize) -> Self {
        Self {
            stride,
            sources: vec![NOBODY; nodes * stride],
            distances: vec![f64::INFINITY; nodes * stride],
        }
    }
}

impl<M: Medium> Flood<'_, M> {
    /// The `count` ≥ 1 sources nearest to each node; all of them, if there are fewer.
    ///
    /// Fewer than there are come from one flood of all at once. A source then goes no farther from a node that has
    /// `count` nearer ones, since it is not among the nearest beyond either; so the cost does not grow with the number
    /// of sources: O(count (nodes + arcs)). Only sources of different coefficients, of which a later one may still win
    /// farther out, flood one after the other, and the cost grows with the logarithm of their number. All of them come
    /// from one flood each, side by side: O(sources (nodes + arcs)), or what is within the limit of that.
    ///
    /// # Panics
    /// If a root is at no node or its source has no coefficient, or `count` is 0.
    #[must_use]
    pub fn nearest(&self, count: usize) -> Nearest {
        let mut roots = self.roots.to_vec();
        roots.sort_unstable_by_key(|root| root.source);
        let sources = roots.chunk_by(|a, b| a.source == b.source);
        let of_each: Vec<&[Root]> = sources.collect();
        if count >= of_each.len() {
            return self.each(&of_each);
        }
        let mut nearest = Nearest::new(self.graph.nodes(), count);
        self.spread(&mut nearest, self.seeds(&roots));
        nearest
    }

    fn coefficient(&self, source: u32) -> f64 {
        match self.coefficients {
            [] => 1.0,
            coefficients => coefficients[source as usize],
        }
    }

    fn seeds(&self, roots: &[Root]) -> Vec<Seed> {
        let seed = |&Root {
                        node,
                        source,
                        start,
                    }: &Root| Seed {
            coefficient: self.coefficient(source),
            entry: Entry {
                distance: self.graph.round(start),
                node,
                source,
            },
        };
        roots.iter().map(seed).collect()
    }

    /// One flood per source.
    fn each(&self, of_each: &[&[Root]]) -> Nearest {
        if self.limit == f64::INFINITY {
            return self.each_everywhere(of_each);
        }
        let nodes = self.graph.nodes();
        let lone = |alone: &mut Alone, roots: &&[Root]| {
            self.spread(alone, self.seeds(roots));
            alone.take(roots[0].source)
        };
        let reached: Vec<Vec<Entry>> = of_each
            .par_iter()
            .map_init(|| Alone::new(nodes), lone)
            .collect();
        let mut lengths = vec![0_usize; nodes];
        for entry in reached.iter().flatten() {
            lengths[entry.node as usize] += 1;
        }
        let stride = lengths.iter().copied().max().unwrap_or(0).max(1);
        let mut nearest = Nearest::new(nodes, stride);
        lengths.fill(0);
        for entry in reached.iter().flatten() {
            let node = entry.node as usize;
            let place = node * stride + lengths[node];
            lengths[node] += 1;
            nearest.sources[place] = entry.source;
            nearest.distances[place] = entry.distance;
        }
        let rows = nearest.sources.par_chunks_exact_mut(stride);
        rows.zip(nearest.distances.par_chunks_exact_mut(stride))
            .zip(&lengths)
            .with_min_len(BLOCK)
            .for_each(|((sources, distances), &length)| {
                sort_row(&mut sources[..length], &mut distances[..length]);
            });
        nearest
    }

    /// One flood per source, without an end: nearly all nodes are reached, and a distance for each is the least to keep.
    fn each_everywhere(&self, of_each: &[&[Root]]) -> Nearest {
        let nodes = self.graph.nodes();
        let lone = |roots: &&[Root]| {
            let mut known = vec![f64::INFINITY; nodes];
            self.spread(&mut known, self.seeds(roots));
            known
        };
        let columns: Vec<Vec<f64>> = of_each.par_iter().map(lone).collect();
        let reach = |node: usize| columns.iter().filter(move |c| c[node] < f64::INFINITY);
        let counts = (0..nodes).into_par_iter().with_min_len(BLOCK);
        let stride = counts.map(|node| reach(node).count()).max();
        let stride = stride.unwrap_or(0).max(1);
        let mut nearest = Nearest::new(nodes, stride);
        let rows = nearest.sources.par_chunks_exact_mut(stride);
        rows.zip(nearest.distances.par_chunks_exact_mut(stride))
            .enumerate()
            .with_min_len(BLOCK)
            .for_each(|(node, (sources, distances))| {
                let mut length = 0;
                for (roots, known) in of_each.iter().zip(&columns) {
                    if known[node] < f64::INFINITY {
                        (sources[length], distances[length]) = (roots[0].source, known[node]);
                        length += 1;
                    }
                }
                sort_row(&mut sources[..length], &mut distances[..length]);
            });
        nearest
    }

    /// Floods from the seeds on, the sources of lesser coefficients first: those that crowd a source out of a row then
    /// grow no faster than it does, so that it stays behind them.
    fn spread(&self, record: &mut impl Record, mut seeds: Vec<Seed>) {
        seeds.sort_unstable_by(|a, b| {
            (a.coefficient.total_cmp(&b.coefficient)).then(b.entry.cmp(&a.entry))
        });
        let mut queue = Buckets::new(self.graph.range());
        for alike in seeds.chunk_by(|a, b| a.coefficient == b.coefficient) {
            self.spread_alike(record, alike, &mut queue);
        }
    }

    fn spread_alike<R: Record>(&self, record: &mut R, seeds: &[Seed], queue: &mut Buckets) {
        let factor = seeds[0].coefficient;
        let mut seeds = seeds.iter().map(|seed| seed.entry).peekable();
        while queue.advance(seeds.peek().map(|seed| seed.distance)) {
            while let Some(seed) = seeds.next_if(|seed| queue.is_due(seed.distance)) {
                let distance = factor * seed.distance;
                if distance <= self.limit && record.offer(seed.node, seed.source, distance) {
                    queue.push(seed);
                }
            }
            while let Some(entry) = queue.pop() {
                let Entry {
                    node,
                    source,
                    distance,
                } = entry;
                // What has come nearer since is on its way already, and what was crowded out is no more.
                if record.distance(node, source) != factor * distance {
                    continue;
                }
                let mut front = Lone {
                    record,
                    queue,
                    source,
                    factor,
                    limit: self.limit,
                };
                self.graph.leave(node, distance, &mut front);
            }
        }
    }
}

impl Medium for Graph {
    fn nodes(&self) -> usize {
        self.len()
    }

    fn range(&self) -> [f64; 2] {
        self.range()
    }

    fn round(&self, start: f64) -> f64 {
        self.round(start)
    }

    fn leave(&self, node: u32, distance: f64, front: &mut impl Front) {
        for (node, cost) in self.arcs(node) {
            front.reach(node, distance + cost);
        }
    }
}

/// A source at a node before the flood.
#[derive(Clone, Copy)]
struct Seed {
    coefficient: f64,
    entry: Entry,
}

impl Record for Nearest {
    fn offer(&mut self, node: u32, source: u32, distance: f64) -> bool {
        let start = node as usize * self.stride;
        let sources = &mut self.sources[start..start + self.stride];
        let distances = &mut self.distances[start..start + self.stride];
        let last = sources.len() - 1;
        let before = |place: usize, sources: &[u32], distances: &[f64]| {
            (distance, source) < (distances[place], sources[place])
        };
        if !before(last, sources, distances) {
            return false;
        }
        // It takes the place of its own entry, or of the last.
        let held = sources.iter().position(|&held| held == source);
        let mut place = held.unwrap_or(last);
        if held.is_some() && distances[place] <= distance {
            return false;
        }
        while place > 0 && before(place - 1, sources, distances) {
            distances[place] = distances[place - 1];
            sources[place] = sources[place - 1];
            place -= 1;
        }
        distances[place] = distance;
        sources[place] = source;
        true
    }

    fn distance(&self, node: u32, source: u32) -> f64 {
        let start = node as usize * self.stride;
        let row = start..start + self.stride;
        let held = self.sources[row].iter().position(|&held| held == source);
        held.map_or(f64::INFINITY, |place| self.distances[start + place])
    }
}

/// The flood of a single source to all nodes, by its distance from each.
impl Record for Vec<f64> {
    fn offer(&mut self, node: u32, _: u32, distance: f64) -> bool {
        let known = &mut self[node as usize];
        let nearer = distance < *known;
        if nearer {
            *known = distance;
        }
        nearer
    }

    fn distance(&self, node: u32, _: u32) -> f64 {
        self[node as usize]
    }
}

/// The flood of a single source as far as a limit.
struct Alone {
    distances: Vec<f64>,
    reached: Vec<u32>,
}

impl Alone {
    fn new(nodes: usize) -> Self {
        Self {
            distances: vec![f64::INFINITY; nodes],
            reached: Vec::new(),
        }
    }

    /// All that the source has reached, and nothing is known any more.
    fn take(&mut self, source: u32) -> Vec<Entry> {
        // In the order of the memory, which rows are filled in; where most were reached, a sort would cost more than a look
        // at all.
        if self.reached.len() > self.distances.len() / 8 {
            self.reached.clear();
            let nodes = (0..).zip(&self.distances);
            let reached = nodes.filter(|(_, distance)| **distance < f64::INFINITY);
            self.reached.extend(reached.map(|(node, _)| node));
        } else {
            self.reached.sort_unstable();
        }
        let entry = |node| Entry {
            distance: std::mem::replace(&mut self.distances[node as usize], f64::INFINITY),
            node,
            source,
        };
        self.reached.drain(..).map(entry).collect()
    }
}

impl Record for Alone {
    fn offer(&mut self, node: u32, _: u32, distance: f64) -> bool {
        let known = &mut self.distances[node as usize];
        if distance >= *known {
            return false;
        }
        if *known == f64::INFINITY {
            self.reached.push(node);
        }
        *known = distance;
        true
    }

    fn distance(&self, node: u32, _: u32) -> f64 {
        self.distances[node as usize]
    }
}

/// Orders a row by distance; its sources rise, so that equal distances stay in their order.
fn sort_row(sources: &mut [u32], distances: &mut [f64]) {
    if distances.len() > SHORT {
        let entries = distances.iter().copied().zip(sources.iter().copied());
        let mut row: Vec<(f64, u32)> = entries.collect();
        row.sort_by(|a, b| a.0.total_cmp(&b.0));
        for ((distance, source), entry) in distances.iter_mut().zip(sources).zip(row) {
            (*distance, *source) = entry;
        }
        return;
    }
    for end in 1..distances.len() {
        let (distance, source) = (distances[end], sources[end]);
        let mut place = end;
        while place > 0 && distance < distances[place - 1] {
            distances[place] = distances[place - 1];
            sources[place] = sources[place - 1];
            place -= 1;
        }
        (distances[place], sources[place]) = (distance, source);
    }
}
