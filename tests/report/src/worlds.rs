//! Worlds of points and meshes, through the engine's public face alone.

use nalgebra::Vector3;
use sinew_engine::{
    ExternalPoints, Filter, Fit, Frame, Mapping, MeshSource, Motion, MotionSample, Recipe,
    Reference, Rule, Scene, SceneError, ShapeMatching, Tracking, UpAxis, Weighting, World,
};
use sinew_mesh::{Cell, CellType, Grid};
use std::sync::Arc;

use crate::fields::Field;

/// A world driven from outside by points at `rest`.
///
/// # Errors
/// What the engine says of the mapping or the mesh.
pub(crate) fn build(
    grid: Grid,
    rest: &[Vector3<f64>],
    mapping: Mapping,
) -> Result<World, SceneError> {
    World::build(scene(grid, rest, mapping))
}

/// A scene of a mesh and points at `rest` that are driven from outside, without rules.
pub(crate) fn scene(grid: Grid, rest: &[Vector3<f64>], mapping: Mapping) -> Scene {
    Scene {
        title: String::new(),
        motion: Motion::External(ExternalPoints {
            labels: (0..rest.len()).map(|i| i.to_string()).collect(),
            rest: rest.to_vec(),
            absent: Vec::new(),
            tracking: Tracking {
                // Fields are no bodies: all that they do is meant.
                max_speed_change: f64::INFINITY,
                ..Tracking::default()
            },
        }),
        mesh: MeshSource::Grid(grid),
        mapping,
        rules: Vec::new(),
        time_step: 0.01,
        up: UpAxis::Z,
        probes: Vec::new(),
    }
}

/// A mapping by distance, onto every point.
pub(crate) fn mapping(filter: Filter, rule: Rule) -> Mapping {
    by(gaussian(None), filter, rule)
}

/// A mapping onto every point.
pub(crate) fn by(weighting: Weighting, filter: Filter, rule: Rule) -> Mapping {
    Mapping {
        recipe: Recipe {
            weighting,
            filter,
            rule,
            reference: Reference::Initial,
        },
        points: Vec::new(),
    }
}

/// The rigid motion of each cluster.
pub(crate) const RIGID: Rule = Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid));
/// The affine map of each cluster.
pub(crate) const LINEAR: Rule =
    Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 }));
/// The quadratic map of each cluster.
pub(crate) const QUADRATIC: Rule =
    Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 }));

/// Weights by distance, of this scale or the engine's own.
pub(crate) fn gaussian(scale: Option<f64>) -> Weighting {
    Weighting {
        scale,
        ..Weighting::default()
    }
}

/// Steps a world to where its points are at `positions`.
///
/// # Panics
/// If the step fails: what is measured here must not.
pub(crate) fn move_to(world: &mut World, positions: &[Vector3<f64>]) -> Arc<Frame> {
    let sample = MotionSample {
        sequence: world.frame().step + 1,
        time: world.frame().time_seconds,
        positions: positions.to_vec(),
        seen: vec![true; positions.len()],
    };
    world.step(Some(&sample)).expect("a sound motion")
}

/// Where a field takes positions.
pub(crate) fn moved(positions: &[Vector3<f64>], field: &Field) -> Vec<Vector3<f64>> {
    positions.iter().map(|&x| (field.at)(x)).collect()
}

/// A grid of free vertices: one tetrahedron of the first four, for a mesh must have a cell.
pub(crate) fn cloud(positions: Vec<Vector3<f64>>) -> Grid {
    let [a, b, c, d] = [0, 1, 2, 3].map(|i: usize| positions[i]);
    let inside_out = (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0;
    let mut grid = Grid {
        positions,
        ..Grid::default()
    };
    grid.cells.push(Cell {
        kind: CellType::Tetrahedron,
        vertices: &if inside_out {
            [0, 2, 1, 3]
        } else {
            [0, 1, 2, 3]
        },
        face_stream: &[],
    });
    grid
}
