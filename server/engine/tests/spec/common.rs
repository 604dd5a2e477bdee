//! A bar that five points drive.

use std::sync::Arc;

use nalgebra::Vector3;
use sinew_engine::{
    Action, Cost, Dimension, ExternalPoints, Filter, Fit, FitWeights, Frame, Limits, Mapping,
    Measure, MeshSource, Metric, Motion, MotionSample, Pairs, Paths, Recipe, Reference, Roots,
    Rule, Scene, ShapeMatching, Start, Strain, TopologyRule, Tracking, UpAxis, Weighting, World,
};
use sinew_mesh::{Grid, shapes};

const DT: f64 = 0.01;

/// What a point's speed may change by in a step, m/s: more than any of the tests' motions, less than their leaps.
const MAX_SPEED_CHANGE: f64 = 200.0;

pub(crate) const SHAPE: Rule = Rule::ShapeMatching(ShapeMatching {
    fit: Fit::Rigid,
    weights: FitWeights::Alike,
});

/// Lengths of paths along edges, which end where the mesh has come apart.
pub(crate) fn paths() -> Metric {
    Metric::Paths(Paths {
        arcs: Dimension::Edge,
        roots: Roots::Nearest,
        start: Start::Distance,
        cost: Cost::Length,
    })
}

/// A bar of `n` × 2 × 2 hexahedra of side 1 along x, and five points along its axis.
pub(crate) fn bar(n: usize, rule: Rule, rules: Vec<TopologyRule>) -> Scene {
    let length = n as f64;
    let rest: Vec<_> = (0..5)
        .map(|i| Vector3::new(length * f64::from(i) / 4.0, 1.0, 1.0))
        .collect();
    let grid = shapes::hexahedra(n, 2, 2);
    Scene {
        title: String::new(),
        motion: Motion::External(ExternalPoints {
            labels: (0..5).map(|i| format!("p{i}")).collect(),
            rest,
            absent: Vec::new(),
            tracking: Tracking {
                max_speed_change: MAX_SPEED_CHANGE,
                ..Tracking::default()
            },
        }),
        mesh: MeshSource::Grid(Grid {
            positions: grid.positions.iter().map(|x| length * x).collect(),
            cells: grid.cells,
        }),
        mapping: Mapping {
            recipe: Recipe {
                weighting: Weighting::default(),
                filter: Filter::KeepK(3),
                rule,
                reference: Reference::Initial,
            },
            points: Vec::new(),
        },
        rules,
        time_step: DT,
        up: UpAxis::Z,
        probes: Vec::new(),
    }
}

pub(crate) fn rule(measure: Measure, threshold: f64, action: Action) -> TopologyRule {
    TopologyRule {
        measure,
        threshold,
        hysteresis: 0.0,
        limits: Limits::default(),
        action,
    }
}

/// Neighbours along the bar of 8.
pub(crate) fn neighbours(strain: Strain) -> Measure {
    let pairs = Pairs::Within(2.5);
    Measure::Points { strain, pairs }
}

pub(crate) fn build(scene: Scene) -> World {
    World::build(scene).expect("the scene is good")
}

/// A world's rest points.
pub(crate) fn rest(world: &World) -> Vec<Vector3<f64>> {
    world.frame().points.clone()
}

pub(crate) fn sample(positions: Vec<Vector3<f64>>) -> MotionSample {
    MotionSample {
        sequence: 0,
        time: 0.0,
        seen: vec![true; positions.len()],
        positions,
    }
}

pub(crate) fn step(world: &mut World, positions: Vec<Vector3<f64>>) -> Arc<Frame> {
    world.step(Some(&sample(positions))).expect("a step")
}

/// Rest points stretched along x by `1 + e`.
pub(crate) fn stretched(rest: &[Vector3<f64>], e: f64) -> Vec<Vector3<f64>> {
    let along = |p: &Vector3<f64>| Vector3::new(p.x * (1.0 + e), p.y, p.z);
    rest.iter().map(along).collect()
}

/// Points displaced.
pub(crate) fn moved(rest: &[Vector3<f64>], by: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    rest.iter().zip(by).map(|(p, by)| p + by).collect()
}
