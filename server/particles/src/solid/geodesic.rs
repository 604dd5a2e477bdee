//! Distances along a body, each as far as a particle sees.

use std::{cmp::Reverse, collections::BinaryHeap};

use rayon::prelude::*;

use super::{
    Metric,
    graph::{CLOSED, Graph},
};

/// Particles whose costs to all others are known, as bounds for those between any two.
const LANDMARKS: usize = 16;
/// The same arcs in another order have the same cost.
const ROUNDING: f64 = 1.0 + 1e-12;

/// A particle that another sees: which, and how far along the body, m.
pub(super) type Seen = (u32, f64);

/// For each of some particles those within reach along the body, ascending. `reach` in m, as of the graph.
///
/// No search leaves the ball of its reach but for pairs that are near in space and may not be so along the cheapest path:
/// there the costs from a few landmarks settle nearly all, and a search that ends with the last of the pairs the rest.
pub(super) fn neighbourhoods(
    graph: &Graph,
    metric: Metric,
    reach: &[f64],
    of: &[usize],
) -> Vec<Vec<Seen>> {
    let within = |i: usize| {
        let arcs = graph.row(i).iter();
        let near = arcs.filter(|arc| arc.length <= reach[i] * CLOSED);
        near.map(|arc| arc.to).collect::<Vec<_>>()
    };
    let searches = of.par_iter();
    let found: Vec<(usize, Found)> = searches
        .map_init(
            || Search::new(graph.len()),
            |search, &i| {
                let found = search.within_reach(graph, metric, i, reach[i], &within(i));
                (i, found)
            },
        )
        .collect();
    let doubtful = found.iter().filter(|(_, found)| !found.doubtful.is_empty());
    let doubtful: Vec<usize> = doubtful.map(|&(i, _)| i).collect();
    let marks = landmarks(graph, &doubtful);
    let rows = found.into_par_iter();
    rows.map_init(
        || Search::new(graph.len()),
        |search, (i, found)| search.settle(graph, i, found, &marks),
    )
    .collect()
}

/// The costs to all particles from some of those given, spread evenly.
fn landmarks(graph: &Graph, of: &[usize]) -> Vec<Vec<f64>> {
    let step = of.len().div_ceil(LANDMARKS).max(1);
    let marks: Vec<usize> = of.iter().copied().step_by(step).collect();
    let costs = marks.into_par_iter().map(|mark| {
        let mut search = Search::new(graph.len());
        search.everywhere(graph, mark, &[]);
        let costs = search.label.iter();
        costs
            .map(|label| {
                if label.round == search.round {
                    label.cost
                } else {
                    f64::INFINITY
                }
            })
            .collect()
    });
    costs.collect()
}

/// What a search within reach found.
pub(super) struct Found {
    seen: Vec<Seen>,
    /// Seen along the cheapest path that stays within reach, with its cost: a longer one may be cheaper.
    doubtful: Vec<(Seen, f64)>,
}

#[derive(Clone, Copy, Default)]
struct Label {
    cost: f64,
    /// Of the cheapest path, m.
    length: f64,
    /// In which search the label was given, and whether the particle is among those searched for in it.
    round: u32,
    wanted: u32,
}

/// Memory for searches, one after another.
pub(super) struct Search {
    label: Vec<Label>,
    round: u32,
    /// Costs as bits, which are ordered as the costs are, for none is negative.
    open: BinaryHeap<Reverse<(u64, u32)>>,
}

impl Search {
    pub(super) fn new(particles: usize) -> Self {
        Self {
            label: vec![Label::default(); particles],
            round: 0,
            open: BinaryHeap::new(),
        }
    }

    fn start(&mut self, from: usize, wanted: &[u32]) {
        self.round += 1;
        self.open.clear();
        for &i in wanted {
            self.label[i as usize].wanted = self.round;
        }
        let i = u32::try_from(from).expect("particles are counted in 32 bits");
        self.offer(i, 0.0, 0.0);
    }

    /// Takes note of a path to `to`, if it is cheaper than those before.
    fn offer(&mut self, to: u32, cost: f64, length: f64) {
        let round = self.round;
        let label = &mut self.label[to as usize];
        if label.round != round || cost < label.cost {
            *label = Label {
                cost,
                length,
                round,
                ..*label
            };
            self.open.push(Reverse((cost.to_bits(), to)));
        }
    }

    /// The cheapest particle that is still open.
    fn next(&mut self) -> Option<(u32, f64, f64)> {
        while let Some(Reverse((cost, i))) = self.open.pop() {
            let label = &self.label[i as usize];
            if label.cost.to_bits() == cost {
                return Some((i, label.cost, label.length));
            }
        }
        None
    }

    /// Which of `wanted`, all particles within `reach` of `from` in space, lie within it along the body. Paths are followed
    /// through these alone. `[B1]`, `[B2]`
    pub(super) fn within_reach(
        &mut self,
        graph: &Graph,
        metric: Metric,
        from: usize,
        reach: f64,
        wanted: &[u32],
    ) -> Found {
        self.start(from, wanted);
        let mut found = Found {
            seen: Vec::new(),
            doubtful: Vec::new(),
        };
        // The least cost at which a path leaves the reach: what costs more may be cheaper the long way round.
        let mut exit = f64::INFINITY;
        while let Some((i, cost, length)) = self.next() {
            let (distance, sure) = match metric {
                Metric::Geodesic { .. } => (length, cost <= exit),
                Metric::Graded { .. } => (cost, true),
            };
            if distance > reach * CLOSED {
                exit = exit.min(cost);
                continue;
            }
            if i as usize != from && sure {
                found.seen.push((i, distance));
            } else if i as usize != from {
                found.doubtful.push(((i, distance), cost));
            }
            for arc in graph.row(i as usize) {
                if self.label[arc.to as usize].wanted == self.round {
                    self.offer(arc.to, cost + arc.cost, length + arc.length);
                } else if arc.to as usize != from {
                    exit = exit.min(cost + arc.cost);
                }
            }
        }
        found
    }

    /// Keeps of the doubtful those to which no longer path is cheaper.
    pub(super) fn settle(
        &mut self,
        graph: &Graph,
        from: usize,
        found: Found,
        marks: &[Vec<f64>],
    ) -> Vec<Seen> {
        let Found {
            mut seen,
            mut doubtful,
        } = found;
        doubtful.retain(|&((i, _), cost)| {
            let around = marks.iter().map(|costs| costs[from] + costs[i as usize]);
            around.fold(f64::INFINITY, f64::min) * ROUNDING >= cost
        });
        if !doubtful.is_empty() {
            let wanted: Vec<u32> = doubtful.iter().map(|&((i, _), _)| i).collect();
            self.everywhere(graph, from, &wanted);
            let cheapest =
                |&((i, _), cost): &(Seen, f64)| self.label[i as usize].cost * ROUNDING >= cost;
            seen.extend(
                doubtful
                    .iter()
                    .filter(|found| cheapest(found))
                    .map(|(seen, _)| *seen),
            );
        }
        seen.sort_unstable_by_key(|&(i, _)| i);
        seen
    }

    /// Labels of all particles, or until the `wanted` have theirs.
    fn everywhere(&mut self, graph: &Graph, from: usize, wanted: &[u32]) {
        self.start(from, wanted);
        let mut left = wanted.len();
        while let Some((i, cost, length)) = self.next() {
            if self.label[i as usize].wanted == self.round {
                left -= 1;
                if left == 0 {
                    break;
                }
            }
            for arc in graph.row(i as usize) {
                self.offer(arc.to, cost + arc.cost, length + arc.length);
            }
        }
    }
}
