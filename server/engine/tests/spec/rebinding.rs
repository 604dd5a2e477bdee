//! What is bound anew where a mesh changes: as much as needed, and no bit of it other than if all were.

use nalgebra::Vector3;
use sinew_engine::{
    Answer, Cost, Dimension, Filter, Fit, FitWeights, MeshSource, Metric, Motion, MovingFit, Paths,
    Polynomial, RadialBasis, RadialFunction, Recipe, Reference, Request, Roots, Rule,
    ShapeMatching, Start, Weighting, World,
};
use sinew_mesh::{Grid, shapes};

use crate::common::{SHAPE, bar, build, paths, rest, step};

/// Numbers from a seed, the same everywhere.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> u32 {
        self.0 = (self.0.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
        u32::try_from((self.0 >> 33) % sides as u64).expect("below the sides")
    }

    fn request(&mut self, world: &World) -> Request {
        let cells = world.frame().layout.cells.len();
        let one = self.roll(cells);
        match self.roll(8) {
            0..4 => Request::Open {
                facets: vec![[one, one + 1], [one, one + 2], [one, one + 8]],
            },
            4 | 5 => Request::Separate {
                points: [self.roll(5), self.roll(5)],
            },
            6 => Request::Remove { cells: vec![one] },
            _ => Request::Subdivide { cells: vec![one] },
        }
    }
}

fn recipes() -> Vec<Recipe> {
    let straight = Recipe {
        weighting: Weighting {
            scale: Some(2.0),
            ..Weighting::default()
        },
        filter: Filter::KeepK(3),
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    };
    let rule = |rule| Recipe {
        rule,
        ..straight.clone()
    };
    let mean = Rule::ShapeMatching(ShapeMatching {
        fit: Fit::Rigid,
        weights: FitWeights::ClusterMean,
    });
    let flooded = |targets, filter| Recipe {
        weighting: Weighting {
            metric: match targets {
                Dimension::Edge => Metric::Straight,
                Dimension::Vertex | Dimension::Face | Dimension::Volume => paths(),
            },
            targets,
            ..straight.weighting.clone()
        },
        filter,
        ..straight.clone()
    };
    vec![
        straight.clone(),
        Recipe {
            filter: Filter::KeepAtLeast { k: 1, within: 2.5 },
            ..straight.clone()
        },
        rule(Rule::Direct),
        rule(Rule::Mean),
        rule(SHAPE),
        rule(mean),
        rule(Rule::MovingLeastSquares(MovingFit::Affine)),
        rule(Rule::MovingLeastSquares(MovingFit::Rigid)),
        rule(Rule::RadialBasis(RadialBasis {
            function: RadialFunction::Gaussian,
            scale: None,
            polynomial: Polynomial::Constant,
        })),
        Recipe {
            filter: Filter::KeepK(usize::MAX),
            ..rule(Rule::RadialBasis(RadialBasis {
                function: RadialFunction::Gaussian,
                scale: None,
                polynomial: Polynomial::Constant,
            }))
        },
        Recipe {
            reference: Reference::Previous,
            ..straight.clone()
        },
        flooded(Dimension::Vertex, Filter::KeepK(1)),
        flooded(Dimension::Vertex, Filter::KeepK(3)),
        flooded(Dimension::Vertex, Filter::KeepK(8)),
        flooded(Dimension::Volume, Filter::KeepK(2)),
        flooded(Dimension::Edge, Filter::KeepK(2)),
        Recipe {
            rule: Rule::MovingLeastSquares(MovingFit::Affine),
            ..flooded(Dimension::Vertex, Filter::KeepK(4))
        },
    ]
}

/// Weights along paths of every kind.
fn floods() -> Vec<Recipe> {
    let flooded = |arcs, cost, roots, start, filter| Recipe {
        weighting: Weighting {
            metric: Metric::Paths(Paths {
                arcs,
                roots,
                start,
                cost,
            }),
            scale: Some(2.0),
            ..Weighting::default()
        },
        filter,
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    };
    let (nearest, zero, far) = (Roots::Nearest, Start::Zero, Start::Distance);
    let (edge, face, volume) = (Dimension::Edge, Dimension::Face, Dimension::Volume);
    let near = || Filter::Interval {
        nearest: 0.0,
        farthest: 6.0,
    };
    let kinds = [
        (edge, Cost::Hops, nearest, zero, Filter::KeepK(2)),
        (face, Cost::Length, nearest, far, Filter::KeepK(2)),
        (volume, Cost::Hops, nearest, far, Filter::KeepK(1)),
        (volume, Cost::Length, nearest, zero, near()),
        (edge, Cost::Length, Roots::Ball(1.5), far, near()),
        (
            edge,
            Cost::Length,
            nearest,
            far,
            Filter::KeepAtLeast { k: 1, within: 3.0 },
        ),
        (edge, Cost::Volume, nearest, far, Filter::KeepK(3)),
        (edge, Cost::Curvature(0.5), nearest, far, Filter::KeepK(3)),
        (edge, Cost::Length, Roots::Containing, far, Filter::KeepK(3)),
    ];
    let kinds =
        kinds.map(|(arcs, cost, roots, start, filter)| flooded(arcs, cost, roots, start, filter));
    let lengths = flooded(edge, Cost::Length, nearest, far, Filter::KeepK(3));
    let mut floods = kinds.to_vec();
    for rule in [SHAPE, Rule::MovingLeastSquares(MovingFit::Rigid)] {
        let lengths = lengths.clone();
        floods.push(Recipe { rule, ..lengths });
    }
    let mut scaled = lengths.clone();
    scaled.weighting.coefficients = vec![1.0, 0.5, 2.0, 1.0, 1.5];
    floods.push(scaled);
    floods.push(Recipe {
        reference: Reference::Previous,
        ..lengths
    });
    floods
}

/// Random edits of a bar of hexahedra or tetrahedra, after each of which all of the mapping is bound anew in one world and not in the other; how
/// many were done.
fn compare(recipe: &Recipe, tetrahedra: bool, dice: &mut Dice, edits: usize) -> usize {
    let mut scene = bar(8, recipe.rule, Vec::new());
    scene.mapping.recipe = recipe.clone();
    if tetrahedra {
        let grid = shapes::tetrahedra(8, 2, 2);
        scene.mesh = MeshSource::Grid(Grid {
            positions: grid.positions.iter().map(|x| 8.0 * x).collect(),
            cells: grid.cells,
        });
    }
    let mapping = scene.mapping.clone();
    // Points on a line leave open how the mesh turns around it; then a mapping goes on from its last pose.
    let Motion::External(points) = &mut scene.motion else {
        panic!("external points");
    };
    points.rest[1].y += 0.7;
    points.rest[3].z += 0.6;
    let [mut local, mut whole] = [(); 2].map(|()| build(scene.clone()));
    let rest = rest(&local);
    let mut done = 0;
    for _ in 0..edits {
        let requests: Vec<_> = (0..=dice.roll(2)).map(|_| dice.request(&local)).collect();
        let [edited, same] =
            [&mut local, &mut whole].map(|world| world.edit(requests.clone()).expect("a body"));
        assert_eq!(edited.answers, same.answers, "{recipe:?}");
        let refused = |answer: &&Answer| matches!(answer, Answer::Refused(_));
        done += edited.answers.len() - edited.answers.iter().filter(refused).count();
        if edited.frame.is_some() && recipe.reference == Reference::Initial {
            let bound = whole.rest().bind(mapping.clone()).expect("it was bound");
            whole.remap(bound, 0.0).expect("at once");
        }
        let mut by = || f64::from(dice.roll(100)) / 100.0;
        let points: Vec<_> = (rest.iter())
            .map(|p| p + Vector3::new(by(), by(), by()))
            .collect();
        let [here, there] = [&mut local, &mut whole].map(|world| step(world, points.clone()));
        // A part that keeps two points alone may turn around them as it did before, which a mapping bound anew does not know.
        let turns = [SHAPE, Rule::MovingLeastSquares(MovingFit::Rigid)].contains(&recipe.rule);
        if !turns || recipe.weighting.metric == Metric::Straight {
            assert_eq!(here.vertices, there.vertices, "{recipe:?} {requests:?}");
        }
        assert_eq!(here.layout.dominant, there.layout.dominant, "{recipe:?}");
        for vertex in 0..here.vertices.len() {
            let [one, other] =
                [&local, &whole].map(|world| world.explain(vertex).expect("a vertex"));
            assert_eq!(one.influences, other.influences, "{recipe:?}");
            assert_eq!(one.cluster, other.cluster, "{recipe:?}");
        }
    }
    done
}

#[test]
fn what_is_bound_anew_locally_is_what_would_be_bound_as_a_whole() {
    let long = std::env::var_os("SINEW_LONG").is_some();
    let mut dice = Dice(1);
    for recipe in recipes().into_iter().chain(floods()) {
        let done: usize = (0..if long { 100 } else { 4 })
            .map(|run| compare(&recipe, run % 2 == 1, &mut dice, 16))
            .sum();
        assert!(done > 12, "{done} of {recipe:?}");
    }
}
