//! Floods that follow a graph of which little changes, against floods of all of it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_mapping::{
    Binding, Change, Cost, Dimension, Filter, Graph, MappingError, Mesh, Metric, Paths, Recipe,
    Reference, Roots, Rows, Rule, Start, Weighting, Wiring, bind_mesh,
};

/// A graph that changes, with places on a coarse lattice: many are as far from one point as from another.
#[derive(Clone, Debug)]
struct Net {
    places: Vec<Vector3<f64>>,
    arcs: BTreeMap<[u32; 2], f64>,
    hops: bool,
}

/// Something that may happen to a graph. Nodes are taken modulo how many there are.
#[derive(Clone, Debug)]
enum Turn {
    /// A node becomes two in one place; the new one takes over every other arc, or all but the first.
    Split(u32, bool),
    Cut(u32, u32),
    Join(u32, u32, u8),
    Isolate(u32),
    Move(u32, [u8; 3]),
}

impl Net {
    fn count(&self) -> u32 {
        u32::try_from(self.places.len()).expect("few nodes")
    }

    fn neighbours(&self, node: u32) -> Vec<u32> {
        let ends = self.arcs.keys().filter(|ends| ends.contains(&node));
        let mut others: Vec<u32> = ends.map(|[a, b]| a + b - node).collect();
        others.sort_unstable();
        others
    }

    fn cost(&self, a: u32, b: u32) -> f64 {
        self.arcs[&[a.min(b), a.max(b)]]
    }

    /// Rows of these nodes, with costs.
    fn rows(&self, nodes: &[u32]) -> (Rows, Vec<f64>) {
        let (mut starts, mut items, mut costs) = (vec![0], Vec::new(), Vec::new());
        for &node in nodes {
            let row = self.neighbours(node);
            if !self.hops {
                costs.extend(row.iter().map(|&other| self.cost(node, other)));
            }
            items.extend(row);
            starts.push(u32::try_from(items.len()).expect("few arcs"));
        }
        (Rows::new(starts, items), costs)
    }

    fn graph(&self) -> Graph {
        let all: Vec<u32> = (0..self.count()).collect();
        let (rows, costs) = self.rows(&all);
        Graph::new(rows, costs).expect("sound arcs")
    }

    /// The nodes that this leaves other than they were, and those elsewhere or new.
    fn turn(&mut self, turn: &Turn) -> [BTreeSet<u32>; 2] {
        let count = self.count();
        let (mut touched, mut moved) = (BTreeSet::new(), BTreeSet::new());
        match *turn {
            Turn::Split(node, half) => {
                let node = node % count;
                let others = self.neighbours(node);
                self.places.push(self.places[node as usize]);
                for (at, other) in others.into_iter().enumerate() {
                    touched.insert(other);
                    if at > 0 && (!half || at % 2 == 0) {
                        let key = [node.min(other), node.max(other)];
                        let cost = self.arcs.remove(&key).expect("an arc");
                        self.arcs.insert([other, count], cost);
                    }
                }
                touched.extend([node, count]);
                moved.insert(count);
            }
            Turn::Cut(a, b) => {
                let ends = [a % count, b % count];
                self.arcs
                    .remove(&[ends[0].min(ends[1]), ends[0].max(ends[1])]);
                touched.extend(ends);
            }
            Turn::Join(a, b, cost) => {
                let ends = [a % count, b % count];
                if ends[0] != ends[1] {
                    let cost = f64::from(cost) / 4.0;
                    self.arcs
                        .insert([ends[0].min(ends[1]), ends[0].max(ends[1])], cost);
                }
                touched.extend(ends);
            }
            Turn::Isolate(node) => {
                let node = node % count;
                touched.extend(self.neighbours(node));
                touched.insert(node);
                self.arcs.retain(|ends, _| !ends.contains(&node));
            }
            Turn::Move(node, to) => {
                let node = node % count;
                self.places[node as usize] = Vector3::from(to.map(f64::from));
                touched.insert(node);
                moved.insert(node);
            }
        }
        [touched, moved]
    }
}

#[derive(Clone, Debug)]
struct Case {
    net: Net,
    points: Vec<Vector3<f64>>,
    recipe: Recipe,
    turns: Vec<Vec<Turn>>,
}

fn place() -> impl Strategy<Value = [u8; 3]> {
    [0..5_u8, 0..3_u8, 0..2_u8]
}

fn any_turn() -> impl Strategy<Value = Turn> {
    let node = || any::<u32>();
    prop_oneof![
        4 => (node(), any::<bool>()).prop_map(|(node, half)| Turn::Split(node, half)),
        3 => (node(), node()).prop_map(|(a, b)| Turn::Cut(a, b)),
        2 => (node(), node(), 0..8_u8).prop_map(|(a, b, cost)| Turn::Join(a, b, cost)),
        1 => node().prop_map(Turn::Isolate),
        1 => (node(), place()).prop_map(|(node, to)| Turn::Move(node, to)),
    ]
}

fn any_recipe() -> impl Strategy<Value = Recipe> {
    let filter = prop_oneof![
        (1..6_usize).prop_map(Filter::KeepK),
        Just(Filter::KeepK(usize::MAX)),
        (1..3_usize, 0..6_u8).prop_map(|(k, within)| Filter::KeepAtLeast {
            k,
            within: f64::from(within) / 2.0
        }),
        (3..12_u8).prop_map(|farthest| Filter::Interval {
            nearest: 0.0,
            farthest: f64::from(farthest)
        }),
        (1..4_usize).prop_map(|k| Filter::Sequence(vec![
            Filter::Interval {
                nearest: 0.5,
                farthest: 1e3
            },
            Filter::KeepK(k)
        ])),
    ];
    let roots = prop_oneof![
        3 => Just(Roots::Nearest),
        1 => (1..4_u8).prop_map(|radius| Roots::Ball(f64::from(radius))),
    ];
    let start = prop::sample::select(vec![Start::Zero, Start::Distance]);
    (filter, roots, start).prop_map(|(filter, roots, start)| Recipe {
        weighting: Weighting {
            metric: Metric::Paths(Paths {
                arcs: Dimension::Edge,
                roots,
                start,
                cost: Cost::Length,
            }),
            scale: Some(2.0),
            ..Weighting::default()
        },
        filter,
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    })
}

fn any_case() -> impl Strategy<Value = Case> {
    (2..24_u32).prop_flat_map(|nodes| {
        let places = prop::collection::vec(place(), nodes as usize);
        let arcs = prop::collection::btree_map((0..nodes, 0..nodes), 0..8_u8, 1..60);
        let points = prop::collection::vec(place(), 1..8);
        let turns = prop::collection::vec(prop::collection::vec(any_turn(), 1..4), 1..8);
        let parts = (places, arcs, any::<bool>(), points, any_recipe(), turns);
        parts.prop_map(|(places, arcs, hops, points, recipe, turns)| {
            let place = |x: [u8; 3]| Vector3::from(x.map(f64::from));
            let arcs = arcs.into_iter().filter(|((a, b), _)| a != b);
            let arcs = arcs.map(|((a, b), cost)| ([a.min(b), a.max(b)], f64::from(cost) / 4.0));
            Case {
                net: Net {
                    places: places.into_iter().map(place).collect(),
                    arcs: arcs.collect(),
                    hops,
                },
                points: points.into_iter().map(place).collect(),
                recipe,
                turns,
            }
        })
    })
}

impl Case {
    fn whole(&self, graph: &Graph) -> Result<Binding, MappingError> {
        let mesh = Mesh {
            graph: Some(graph),
            torn: true,
            may_change: true,
            ..Mesh::of_vertices(&self.net.places)
        };
        bind_mesh(
            &mesh,
            &self.points,
            &vec![true; self.points.len()],
            &self.recipe,
        )
    }
}

/// Follows a case turn by turn; how often that was possible without a look at all of the graph.
fn follow(mut case: Case) -> usize {
    let Ok(mut local) = case.whole(&case.net.graph()) else {
        return 0;
    };
    let mut followed = 0;
    for turns in std::mem::take(&mut case.turns) {
        let before = case.net.clone();
        let (mut touched, mut moved) = (BTreeSet::new(), BTreeSet::new());
        for turn in &turns {
            let [nodes, places] = case.net.turn(turn);
            touched.extend(nodes);
            moved.extend(places);
        }
        // What a cost or a neighbour says of one end, it says of the other.
        let ends = case
            .net
            .arcs
            .iter()
            .filter(|(ends, cost)| before.arcs.get(*ends) != Some(cost));
        touched.extend(ends.flat_map(|(ends, _)| *ends));
        let [nodes, vertices]: [Vec<u32>; 2] =
            [touched, moved].map(|set| set.into_iter().collect());
        let (arcs, costs) = case.net.rows(&nodes);
        let mesh = Mesh::of_vertices(&case.net.places);
        let change = Change {
            vertices: &vertices,
            wiring: Some(Wiring {
                nodes: &nodes,
                arcs: &arcs,
                costs: &costs,
            }),
        };
        let usable = vec![true; case.points.len()];
        let renewal = local.renewal(&mesh, &case.points, &usable, &case.recipe, &change);
        let whole = case.whole(&case.net.graph());
        match (renewal, whole) {
            (Some(renewal), Ok(whole)) => {
                local.renew(renewal);
                followed += 1;
                assert_eq!(local.dominant(), whole.dominant());
                for vertex in 0..case.net.places.len() {
                    assert_eq!(
                        local.weights(vertex),
                        whole.weights(vertex),
                        "vertex {vertex}"
                    );
                }
            }
            (None, Ok(whole)) => local = whole,
            (None, Err(_)) => return followed,
            (Some(_), Err(error)) => panic!("followed what is refused: {error}"),
        }
    }
    followed
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn a_flood_that_follows_a_change_is_the_flood_of_all_that_is_left(case in any_case()) {
        follow(case);
    }
}

#[test]
fn most_changes_are_followed_without_a_look_at_all_of_the_graph() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut followed, mut turns) = (0, 0);
    for _ in 0..500 {
        let case = any_case().new_tree(&mut runner).unwrap().current();
        if case.whole(&case.net.graph()).is_ok() {
            turns += case.turns.len();
            followed += follow(case);
        }
    }
    assert!(2 * followed > turns, "{followed} of {turns}");
}
