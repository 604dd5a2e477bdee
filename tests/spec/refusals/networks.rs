//! Mass-spring networks.

use sinew_proto::v1::{Indices, Vector3};
use sinew_tests::scenes as posted;

use super::{Case, each};

fn each_of_a_sheet(cases: &[Case]) {
    each(|| posted::sheet(3), cases);
}

/// A column of this length with one entry that is off.
fn off(len: usize, entry: usize, value: f64) -> Option<sinew_proto::v1::Reals> {
    let mut column = vec![1.0; len];
    column[entry] = value;
    Some(posted::reals(&column))
}

#[test]
fn masses_that_are_none() {
    each_of_a_sheet(&[
        (
            |s| posted::network(s).masses = off(9, 4, f64::NAN),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.masses[4]",
        ),
        (
            |s| posted::network(s).masses = off(9, 8, f64::INFINITY),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.masses[8]",
        ),
        (
            |s| posted::network(s).masses = off(9, 2, 0.0),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.masses[2]",
        ),
        (
            |s| posted::network(s).masses = off(9, 2, -1.0),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.masses[2]",
        ),
        (
            |s| posted::network(s).masses = off(1, 0, 0.0),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.masses[0]",
        ),
        (
            |s| posted::network(s).masses = off(8, 0, 1.0),
            "LENGTH_MISMATCH",
            "scene.motion.mass_spring.masses",
        ),
    ]);
}

#[test]
fn springs_that_are_none() {
    each_of_a_sheet(&[
        (
            |s| posted::network(s).stiffness = off(12, 3, f64::NAN),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.stiffness[3]",
        ),
        (
            |s| posted::network(s).stiffness = off(12, 3, f64::INFINITY),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.stiffness[3]",
        ),
        (
            |s| posted::network(s).stiffness = off(12, 3, -1.0),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.stiffness[3]",
        ),
        (
            |s| posted::network(s).stiffness = None,
            "LENGTH_MISMATCH",
            "scene.motion.mass_spring.stiffness",
        ),
        (
            |s| posted::network(s).damping = off(12, 0, f64::NAN),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.damping[0]",
        ),
        (
            |s| posted::network(s).damping = off(12, 0, -0.5),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.damping[0]",
        ),
        (
            |s| posted::network(s).rest_lengths = off(12, 11, -0.1),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.rest_lengths[11]",
        ),
        (
            |s| posted::network(s).rest_lengths = off(11, 0, 1.0),
            "LENGTH_MISMATCH",
            "scene.motion.mass_spring.rest_lengths",
        ),
        (
            |s| posted::network(s).springs = Some(Indices::pack(&[0, 1, 2])),
            "LENGTH_MISMATCH",
            "scene.motion.mass_spring.springs",
        ),
        (
            |s| posted::network(s).springs = Some(Indices::pack(&[0, 1, 2, 9])),
            "INDEX_OUT_OF_RANGE",
            "scene.motion.mass_spring.springs[1]",
        ),
        (
            |s| posted::network(s).springs = Some(Indices::pack(&[0, 1, 2, 2])),
            "LINK_DEGENERATE",
            "scene.motion.mass_spring.springs[1]",
        ),
    ]);
}

#[test]
fn particles_that_are_nowhere() {
    each_of_a_sheet(&[
        (
            |s| posted::network(s).positions = off(27, 14, f64::NAN),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.positions[4]",
        ),
        (
            |s| posted::network(s).positions = off(27, 14, 1e40),
            "VALUE_OUT_OF_RANGE",
            "scene.motion.mass_spring.positions[4]",
        ),
        (
            |s| posted::network(s).positions = off(26, 0, 1.0),
            "LENGTH_MISMATCH",
            "scene.motion.mass_spring.positions",
        ),
        (
            |s| posted::network(s).velocities = off(27, 26, f64::INFINITY),
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.velocities[8]",
        ),
        (
            |s| posted::network(s).velocities = off(3, 0, 1.0),
            "LENGTH_MISMATCH",
            "scene.motion.mass_spring.velocities",
        ),
        (
            |s| posted::network(s).fixed = Some(Indices::pack(&[0, 1, 9])),
            "INDEX_OUT_OF_RANGE",
            "scene.motion.mass_spring.fixed[2]",
        ),
        (
            |s| {
                posted::network(s).gravity = Some(Vector3 {
                    y: f64::NAN,
                    ..Vector3::default()
                });
            },
            "VALUE_NOT_FINITE",
            "scene.motion.mass_spring.gravity",
        ),
    ]);
}
