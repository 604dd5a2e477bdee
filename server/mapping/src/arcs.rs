//! Graphs of which some rows change.

use crate::graph::{Graph, Ticks};
use crate::{MappingError, Rows};

/// A neighbour, and what the arc to it costs.
pub(crate) type Arc = (u32, f64);

/// A graph whose rows can be replaced. One that has outgrown its place moves to the end.
#[derive(Clone, Debug)]
pub(crate) struct Arcs {
    /// Where each row starts, and its length.
    spans: Vec<[u32; 2]>,
    /// Neighbours ascend in each row.
    arcs: Vec<Arc>,
    /// Entries of `arcs` in no row.
    unused: usize,
    ticks: Ticks,
    census: Census,
    /// Whether all arcs cost 1: starts of floods are not rounded then.
    even: bool,
}

/// The arcs that decide how costs are rounded.
#[derive(Clone, Copy, Debug)]
struct Census {
    /// In the binade of the greatest.
    peaks: usize,
    /// That do not cost 1.
    uneven: usize,
}

/// Rows of a graph before it takes them over.
#[derive(Clone, Debug)]
pub(crate) struct Rewired {
    /// Ascending.
    nodes: Vec<u32>,
    starts: Vec<usize>,
    arcs: Vec<Arc>,
    census: Census,
}

impl Arcs {
    /// `None` where the costs are so near to a power of two that a change of one may round all others anew.
    pub(crate) fn new(graph: &Graph) -> Option<Self> {
        let (ticks, peaks) = graph.ticks();
        let [least, most] = graph.range();
        if ticks.is_beyond(most) {
            return None;
        }
        let mut of_graph = Self {
            spans: Vec::with_capacity(graph.len()),
            arcs: Vec::new(),
            unused: 0,
            ticks,
            census: Census { peaks, uneven: 0 },
            even: [least, most] == [1.0, 1.0],
        };
        for node in 0..number(graph.len()) {
            let start = of_graph.arcs.len();
            of_graph.arcs.extend(graph.arcs(node));
            let length = of_graph.arcs.len() - start;
            of_graph.spans.push([number(start), number(length)]);
        }
        let uneven = of_graph.arcs.iter().filter(|(_, cost)| *cost != 1.0);
        of_graph.census.uneven = uneven.count();
        Some(of_graph)
    }

    pub(crate) fn len(&self) -> usize {
        self.spans.len()
    }

    /// The neighbours of a node; none of one that is not there yet.
    pub(crate) fn row(&self, node: u32) -> &[Arc] {
        match self.spans.get(node as usize) {
            Some(&[start, length]) => &self.arcs[start as usize..(start + length) as usize],
            None => &[],
        }
    }

    /// A start of a flood, rounded as [`Graph`] does.
    pub(crate) fn round(&self, start: f64) -> f64 {
        if self.even {
            start
        } else {
            self.ticks.round(start)
        }
    }

    /// Other rows for these nodes, ascending, of which the last may be new. `costs` are one per item, or none for 1 each.
    /// `None` where other costs would be rounded otherwise.
    ///
    /// # Errors
    /// Costs that are none.
    pub(crate) fn rewired(
        &self,
        nodes: &[u32],
        rows: &Rows,
        costs: &[f64],
    ) -> Result<Option<Rewired>, MappingError> {
        if let Some(arc) =
            (costs.iter()).position(|cost| !(0.0..=crate::binding::LARGEST).contains(cost))
        {
            let value = costs[arc];
            return Err(MappingError::Cost { arc, value });
        }
        let mut census = self.census;
        for (_, cost) in nodes.iter().flat_map(|&node| self.row(node)) {
            census.peaks = census
                .peaks
                .saturating_sub(self.ticks.is_peak(*cost).into());
            census.uneven -= usize::from(*cost != 1.0);
        }
        let mut rewired = Rewired {
            nodes: nodes.to_vec(),
            starts: vec![0],
            arcs: Vec::with_capacity(rows.items().len()),
            census,
        };
        for row in 0..rows.len() {
            for place in rows.span(row) {
                let cost = costs.get(place).copied().unwrap_or(1.0);
                let rounded = self.ticks.round(cost);
                if self.ticks.is_beyond(rounded) {
                    return Ok(None);
                }
                rewired.census.peaks += usize::from(self.ticks.is_peak(cost));
                rewired.census.uneven += usize::from(rounded != 1.0);
                rewired.arcs.push((rows.items()[place], rounded));
            }
            rewired.starts.push(rewired.arcs.len());
        }
        let Census { peaks, uneven } = rewired.census;
        let keeps = peaks > 0 && (uneven == 0) == self.even;
        Ok(keeps.then_some(rewired))
    }

    /// Takes over rows.
    pub(crate) fn take(&mut self, rewired: &Rewired) {
        for (at, &node) in rewired.nodes.iter().enumerate() {
            if self.len() <= node as usize {
                self.spans.resize(node as usize + 1, [0, 0]);
            }
            let row = rewired.at(at);
            let [start, length] = self.spans[node as usize];
            if row.len() <= length as usize {
                self.arcs[start as usize..][..row.len()].copy_from_slice(row);
                self.unused += length as usize - row.len();
                self.spans[node as usize][1] = number(row.len());
            } else {
                self.unused += length as usize;
                self.spans[node as usize] = [number(self.arcs.len()), number(row.len())];
                self.arcs.extend_from_slice(row);
            }
        }
        self.census = rewired.census;
        if 2 * self.unused > self.arcs.len() {
            self.tidy();
        }
    }

    /// Moves the rows together.
    fn tidy(&mut self) {
        let mut arcs = Vec::with_capacity(self.arcs.len() - self.unused);
        for [start, length] in &mut self.spans {
            let from = *start as usize;
            *start = number(arcs.len());
            arcs.extend_from_slice(&self.arcs[from..from + *length as usize]);
        }
        self.arcs = arcs;
        self.unused = 0;
    }
}

impl Rewired {
    /// Whose rows these are, ascending.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    fn at(&self, at: usize) -> &[Arc] {
        &self.arcs[self.starts[at]..self.starts[at + 1]]
    }

    /// The neighbours of a node of a graph with these rows.
    pub(crate) fn row<'a>(&'a self, before: &'a Arcs, node: u32) -> &'a [Arc] {
        match self.nodes.binary_search(&node) {
            Ok(at) => self.at(at),
            Err(_) => before.row(node),
        }
    }

    /// How many nodes a graph has with these rows.
    pub(crate) fn len(&self, before: &Arcs) -> usize {
        let last = self.nodes.last().map_or(0, |&node| node as usize + 1);
        last.max(before.len())
    }
}

fn number(index: usize) -> u32 {
    u32::try_from(index).expect("graphs have fewer than u32::MAX arcs")
}
