//! Floods against one plain shortest-path search per source.

use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use sinew_mapping::{Flood, Graph, MappingError, Nearest, Root, Rows};

fn index(number: usize) -> u32 {
    u32::try_from(number).expect("small graphs")
}

/// Arcs in both directions, as rows.
fn graph(nodes: usize, arcs: &[(usize, usize, f64)], hops: bool) -> Graph {
    let mut rows = vec![Vec::new(); nodes];
    for &(a, b, cost) in arcs {
        rows[a].push((index(b), cost));
        rows[b].push((index(a), cost));
    }
    let mut starts = vec![0];
    let (mut ends, mut costs) = (Vec::new(), Vec::new());
    for row in rows {
        ends.extend(row.iter().map(|arc| arc.0));
        costs.extend(row.iter().map(|arc| arc.1));
        starts.push(index(ends.len()));
    }
    if hops {
        costs.clear();
    }
    Graph::new(Rows::new(starts, ends), costs).expect("sound arcs")
}

/// A case of small numbers that binary fractions hold exactly, so that sums in any order are equal.
#[derive(Clone, Debug)]
struct Case {
    nodes: usize,
    arcs: Vec<(usize, usize, f64)>,
    hops: bool,
    roots: Vec<Root>,
    coefficients: Vec<f64>,
    count: usize,
    limit: f64,
}

impl Case {
    fn graph(&self) -> Graph {
        graph(self.nodes, &self.arcs, self.hops)
    }

    fn flood<'a>(&'a self, graph: &'a Graph) -> Flood<'a> {
        Flood {
            graph,
            roots: &self.roots,
            coefficients: &self.coefficients,
            limit: self.limit,
        }
    }

    /// Each source alone, by relaxing every arc until nothing changes; then the nearest of each node.
    fn expected(&self) -> Vec<Vec<(u32, f64)>> {
        let mut rows = vec![Vec::new(); self.nodes];
        for source in 0..8 {
            let mut distances = vec![f64::INFINITY; self.nodes];
            for root in self.roots.iter().filter(|root| root.source == source) {
                let known = &mut distances[root.node as usize];
                *known = known.min(root.start);
            }
            for _ in 0..self.nodes {
                for &(a, b, cost) in &self.arcs {
                    let cost = if self.hops { 1.0 } else { cost };
                    distances[a] = distances[a].min(distances[b] + cost);
                    distances[b] = distances[b].min(distances[a] + cost);
                }
            }
            let factor = self.coefficients.get(source as usize).unwrap_or(&1.0);
            for (row, distance) in rows.iter_mut().zip(distances) {
                if distance < f64::INFINITY && factor * distance <= self.limit {
                    row.push((source, factor * distance));
                }
            }
        }
        for row in &mut rows {
            row.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            row.truncate(self.count);
        }
        rows
    }
}

fn rows(nearest: &Nearest, nodes: usize) -> Vec<Vec<(u32, f64)>> {
    (0..nodes).map(|node| nearest.row(node).collect()).collect()
}

fn any_case() -> impl Strategy<Value = Case> {
    (2..40_usize).prop_flat_map(|nodes| {
        let cost = prop_oneof![
            3 => (0..32_u32).prop_map(|quarters| f64::from(quarters) / 4.0),
            1 => Just(4096.0),
        ];
        let arcs = prop::collection::vec((0..nodes, 0..nodes, cost), 0..3 * nodes);
        let root = (0..nodes, 0..8_u32, 0..12_u32).prop_map(|(node, source, start)| Root {
            node: index(node),
            source,
            start: f64::from(start) / 4.0,
        });
        let coefficient = prop::sample::select(vec![0.0, 0.5, 1.0, 1.0, 2.0, 8.0]);
        (
            Just(nodes),
            arcs,
            any::<bool>(),
            prop::collection::vec(root, 0..16),
            prop_oneof![Just(Vec::new()), prop::collection::vec(coefficient, 8..=8)],
            1..10_usize,
            prop_oneof![Just(f64::INFINITY), (0..40_u32).prop_map(f64::from)],
        )
            .prop_map(
                |(nodes, arcs, hops, roots, coefficients, count, limit)| Case {
                    nodes,
                    arcs,
                    hops,
                    roots,
                    coefficients,
                    count,
                    limit,
                },
            )
    })
}

proptest! {
    #[test]
    fn one_flood_of_all_sources_gives_the_nearest_of_one_flood_each(case in any_case()) {
        let found = case.flood(&case.graph()).nearest(case.count);
        prop_assert_eq!(rows(&found, case.nodes), case.expected());
    }
}

/// A cubic lattice, whose paths are of many equal lengths.
fn lattice(side: usize, hops: bool) -> Graph {
    let at = |x: usize, y: usize, z: usize| (x * side + y) * side + z;
    let place = |i: usize| i as f64 / (side as f64 - 1.0) / 3.0;
    let mut arcs = Vec::new();
    for (x, y, z) in (0..side.pow(3)).map(|i| (i / side / side, i / side % side, i % side)) {
        for (a, b, c) in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)] {
            if x + a < side && y + b < side && z + c < side {
                let step = [(x, a), (y, b), (z, c)].map(|(i, d)| place(i + d) - place(i));
                let length = (step[0].powi(2) + step[1].powi(2) + step[2].powi(2)).sqrt();
                arcs.push((at(x, y, z), at(x + a, y + b, z + c), length));
            }
        }
    }
    graph(side.pow(3), &arcs, hops)
}

#[test]
fn paths_of_equal_length_tie_whatever_the_order_of_their_arcs() {
    let side = 9;
    let graph = lattice(side, false);
    let corner = |x: usize, y: usize, z: usize| index((x * side + y) * side + z);
    // Two sources, each the mirror image of the other by x and y: all nodes with x = y are as far from both.
    let ends = [corner(0, 8, 3), corner(8, 0, 3)];
    let roots = [0, 1].map(|source| Root {
        node: ends[source as usize],
        source,
        start: 0.0,
    });
    let flood = Flood {
        graph: &graph,
        roots: &roots,
        coefficients: &[],
        limit: f64::INFINITY,
    };
    let (both, nearest) = (flood.nearest(2), flood.nearest(1));
    for x in 0..side {
        for z in 0..side {
            let node = corner(x, x, z) as usize;
            let row: Vec<_> = both.row(node).collect();
            assert_eq!((row[0].0, row[1].0), (0, 1));
            assert_eq!(row[0].1, row[1].1);
            assert_eq!(nearest.row(node).next(), Some(row[0]));
        }
    }
}

#[test]
fn a_flood_has_the_same_bits_for_any_number_of_threads_and_any_order_of_roots() {
    let graph = lattice(24, false);
    let mut roots: Vec<Root> = (0..50)
        .map(|source| Root {
            node: source * 7919 % 13_824,
            source,
            start: f64::from(source) * 1e-3,
        })
        .collect();
    let found = |roots: &[Root], threads, count| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let flood = Flood {
            graph: &graph,
            roots,
            coefficients: &[],
            limit: f64::INFINITY,
        };
        pool.unwrap().install(|| flood.nearest(count))
    };
    for count in [1, 8, 50] {
        let expected = found(&roots, 1, count);
        roots.reverse();
        for threads in [1, 2, 7] {
            assert_eq!(found(&roots, threads, count), expected);
        }
    }
}

#[test]
fn arcs_that_are_none_are_refused() {
    let two = || Rows::new(vec![0, 1, 2], vec![1, 0]);
    let refusal = |rows, costs| Graph::new(rows, costs).unwrap_err();
    assert_eq!(
        refusal(Rows::new(vec![0, 1], vec![1]), Vec::new()),
        MappingError::Node { node: 1, nodes: 1 }
    );
    for value in [-1.0, f64::INFINITY, 1e101] {
        let expected = MappingError::Cost { arc: 1, value };
        assert_eq!(refusal(two(), vec![1.0, value]), expected);
    }
    let nan = refusal(two(), vec![f64::NAN, 1.0]);
    assert!(matches!(nan, MappingError::Cost { arc: 0, .. }));
    let short = refusal(two(), vec![1.0]);
    assert!(matches!(
        short,
        MappingError::Length {
            found: 1,
            expected: 2,
            ..
        }
    ));
}

#[test]
fn costs_of_any_size_neither_stall_nor_overflow() {
    let arcs = [(0, 1, 1e100), (1, 2, 1e-100), (2, 3, 0.0), (3, 4, 1e100)];
    let graph = graph(6, &arcs, false);
    let roots = [Root {
        node: 0,
        source: 0,
        start: 1e100,
    }];
    let flood = Flood {
        graph: &graph,
        roots: &roots,
        coefficients: &[1e30],
        limit: f64::INFINITY,
    };
    let found = flood.nearest(3);
    let last: Vec<_> = found.row(4).collect();
    assert_eq!(last.len(), 1);
    assert!((last[0].1 / 3e130 - 1.0).abs() < 1e-9);
    assert_eq!(found.row(5).count(), 0);
}
