//! What a step costs in which the mesh changes, beside a plain one: `cargo bench -p sinew-engine`.
//!
//! Boxes of 10k, 100k and 1M tetrahedra, 64 points to 1,000 cells. An event opens the faces of some cells against their
//! neighbours, up to 100 cells; it includes measures, patch, rebinding and pose. Beside it, what binding all anew takes
//! after the last event. Wall time, medians.

#![allow(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]

use std::hint::black_box;
use std::time::Instant;

use nalgebra::Vector3;
use sinew_engine::{
    Action, Cost, Dimension, ExternalPoints, Filter, Fit, FitWeights, Limits, Mapping, Measure,
    MeshSource, Metric, Motion, MotionSample, Paths, Recipe, Reference, Request, Roots, Rule,
    Scene, ShapeMatching, Start, Strain, TopologyRule, Tracking, UpAxis, Weighting, World,
};
use sinew_mesh::shapes;

/// Cubes along an axis; six tetrahedra each.
const SIZES: [usize; 3] = [12, 26, 55];
const EVENTS: usize = 21;

/// Scattered evenly in the unit cube: the additive recurrence of the plastic number's powers.
fn scattered(n: usize) -> Vec<Vector3<f64>> {
    let step = Vector3::new(
        0.819_172_513_396_164,
        0.671_043_606_703_789,
        0.549_700_477_901_97,
    );
    (1..=n).map(|i| (step * i as f64).map(f64::fract)).collect()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}

fn timed<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = black_box(run());
    (value, start.elapsed().as_secs_f64())
}

fn scene(cubes: usize, rest: &[Vector3<f64>], metric: Metric, rule: Rule) -> Scene {
    let watched = TopologyRule {
        measure: Measure::Edges(Strain::Elongation),
        threshold: 10.0,
        hysteresis: 0.0,
        limits: Limits::default(),
        action: Action::Open,
    };
    Scene {
        title: String::new(),
        motion: Motion::External(ExternalPoints {
            labels: (0..rest.len()).map(|i| format!("p{i}")).collect(),
            rest: rest.to_vec(),
            absent: Vec::new(),
            tracking: Tracking::default(),
        }),
        mesh: MeshSource::Grid(shapes::tetrahedra(cubes, cubes, cubes)),
        mapping: Mapping {
            recipe: Recipe {
                weighting: Weighting {
                    metric,
                    ..Weighting::default()
                },
                filter: Filter::KeepK(8),
                rule,
                reference: Reference::Initial,
            },
            points: Vec::new(),
        },
        rules: vec![watched],
        time_step: 0.01,
        up: UpAxis::Z,
        probes: Vec::new(),
    }
}

/// Opens up to eight cells, one after the other in the mesh, against their neighbours.
fn crack(world: &World, first: u32) -> Request {
    let cells = &world.frame().layout.cells;
    let faces = |cell: u32| -> Vec<Vec<u32>> {
        let faces = cells.cell(cell as usize).faces().map(|face| {
            let mut face: Vec<u32> = face.vertices().collect();
            face.sort_unstable();
            face
        });
        faces.collect()
    };
    let mut facets = Vec::new();
    for one in first..first + 8 {
        for other in one + 1..first + 16 {
            let theirs = faces(other);
            if faces(one).iter().any(|face| theirs.contains(face)) {
                facets.push([one, other]);
            }
        }
    }
    Request::Open { facets }
}

fn main() {
    let paths = Metric::Paths(Paths {
        arcs: Dimension::Edge,
        roots: Roots::Nearest,
        start: Start::Distance,
        cost: Cost::Length,
    });
    let shape = Rule::ShapeMatching(ShapeMatching {
        fit: Fit::Rigid,
        weights: FitWeights::Alike,
    });
    let mappings = [
        ("straight", Metric::Straight, Rule::WeightedMean),
        ("shape", Metric::Straight, shape),
        ("flood", paths, Rule::WeightedMean),
    ];
    for cubes in SIZES {
        for (name, metric, rule) in &mappings {
            let cells = 6 * cubes * cubes * cubes;
            let rest = scattered(64 * cells / 1000);
            let mut world = World::build(scene(cubes, &rest, metric.clone(), *rule)).unwrap();
            let mut n = 0_u32;
            let mut moved = || {
                n += 1;
                let by = Vector3::new(0.001 * f64::from(n), 0.0, 0.0);
                MotionSample {
                    sequence: u64::from(n),
                    time: 0.01 * f64::from(n),
                    seen: vec![true; rest.len()],
                    positions: rest.iter().map(|p| p + by).collect(),
                }
            };
            let (mut plain, mut events, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
            for at in 0..EVENTS {
                for _ in 0..3 {
                    let sample = moved();
                    plain.push(timed(|| world.step(Some(&sample)).unwrap()).1);
                }
                let first = u32::try_from((2 * at + 1) * cells / (2 * EVENTS)).unwrap();
                let request = crack(&world, first);
                let (edited, time) = timed(|| world.edit(vec![request]).unwrap());
                let frame = edited.frame.unwrap();
                let patch = frame.change.as_ref().unwrap().patch.as_ref();
                events.push(time);
                sizes.push(patch.map_or(0, |patch| patch.slots.len()) as f64);
            }
            let mapping = scene(cubes, &rest, metric.clone(), *rule).mapping;
            let bind = || timed(|| world.rest().bind(mapping.clone()).unwrap()).1;
            let whole = median((0..3).map(|_| bind()).collect());
            let (plain, event) = (median(plain), median(events));
            println!(
                "{cells:>8} {name:<9} step {:>8.1} us, event of {:>3.0} cells {:>9.1} us: {:>5.2} steps; all bound anew {:>5.1} events",
                plain * 1e6,
                median(sizes),
                event * 1e6,
                (plain + event) / plain,
                whole / event,
            );
        }
    }
}
