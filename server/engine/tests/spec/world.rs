//! What a world does, whatever the scene.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use sinew_engine::{
    CellShape, Elastic, ExternalPoints, Filter, Fit, Lattice, LinkLaw, Links, Mapping, MeshSource,
    Motion, MotionSample, PointState, Recipe, Reference, Rule, Scene, SceneError, ShapeMatching,
    StepError, SystemSpec, Tracking, UpAxis, Weighting, World,
};
use sinew_mesh::{Grid, shapes};

/// The corners of the unit cube, as points.
fn corners() -> ExternalPoints {
    let rest: Vec<_> = (0..8)
        .map(|i| {
            let bit = |k: u32| f64::from(i >> k & 1);
            Vector3::new(bit(0), bit(1), bit(2))
        })
        .collect();
    let labels = (0..rest.len()).map(|i| format!("corner {i}")).collect();
    ExternalPoints {
        labels,
        rest,
        absent: Vec::new(),
        tracking: Tracking::default(),
    }
}

fn mapping(rule: Rule) -> Mapping {
    let weighting = Weighting::default();
    let recipe = Recipe {
        weighting,
        filter: Filter::KeepK(4),
        rule,
        reference: Reference::Initial,
    };
    Mapping {
        recipe,
        points: Vec::new(),
    }
}

fn scene(motion: Motion, mesh: MeshSource, rule: Rule) -> Scene {
    let title = String::new();
    Scene {
        title,
        motion,
        mesh,
        mapping: mapping(rule),
        rules: Vec::new(),
        time_step: 0.01,
        up: UpAxis::Z,
        probes: Vec::new(),
    }
}

fn cube(rule: Rule) -> Scene {
    let grid = shapes::hexahedra(4, 4, 4);
    scene(Motion::External(corners()), MeshSource::Grid(grid), rule)
}

fn build(scene: Scene) -> World {
    World::build(scene).expect("the scene is good")
}

fn sample(sequence: u64, positions: Vec<Vector3<f64>>) -> MotionSample {
    let seen = vec![true; positions.len()];
    MotionSample {
        sequence,
        time: sequence as f64 / 120.0,
        positions,
        seen,
    }
}

/// A chain of masses that hangs from its first one, with cubes around it.
fn chain() -> Scene {
    let count = 20_u32;
    let particles = SystemSpec {
        positions: (0..count)
            .map(|i| Vector3::new(f64::from(i) * 0.1, 0.0, 0.0))
            .collect(),
        velocities: vec![Vector3::zeros(); count as usize],
        masses: vec![0.1; count as usize],
        fixed: vec![0],
        links: vec![Links {
            ends: (1..count).map(|i| [i - 1, i]).collect(),
            law: LinkLaw::Spring(Elastic {
                stiffness: vec![200.0; count as usize - 1],
                damping: vec![0.1; count as usize - 1],
                rest_lengths: None,
            }),
        }],
        gravity: Vector3::new(0.0, 0.0, -9.81),
        ..SystemSpec::default()
    };
    let lattice = Lattice {
        shape: CellShape::Hexahedron,
        spacing: 0.02,
        radius: 0.06,
        bones: Vec::new(),
    };
    scene(
        Motion::Particles(Box::new(particles)),
        MeshSource::Lattice(lattice),
        Rule::WeightedMean,
    )
}

proptest! {
    #[test]
    fn a_translation_of_all_points_moves_every_vertex_by_it(
        shift in prop::array::uniform3(-10.0..10.0f64),
        shape_matching in any::<bool>(),
    ) {
        let shift = Vector3::from(shift);
        let rule = if shape_matching { Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)) } else { Rule::WeightedMean };
        let mut world = build(cube(rule));
        let rest = world.frame();
        let moved = rest.points.iter().map(|p| p + shift).collect();
        let frame = world.step(Some(&sample(1, moved))).expect("a step");
        for (x, x0) in frame.vertices.iter().zip(&rest.vertices) {
            prop_assert!((x - x0 - shift).norm() < 1e-12, "{x} from {x0}");
        }
    }

    #[test]
    fn a_rigid_motion_is_exact_under_shape_matching(angles in prop::array::uniform3(-3.0..3.0f64)) {
        let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let mut world = build(cube(Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid))));
        let rest = world.frame();
        let moved = rest.points.iter().map(|p| rotation * p).collect();
        let frame = world.step(Some(&sample(1, moved))).expect("a step");
        for (x, x0) in frame.vertices.iter().zip(&rest.vertices) {
            prop_assert!((x - rotation * x0).norm() < 1e-12, "{x} from {x0}");
        }
    }
}

#[test]
fn an_occluded_point_moves_no_vertex_whatever_its_numbers_say() {
    for rule in [
        Rule::WeightedMean,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    ] {
        let mut world = build(cube(rule));
        let rest = world.frame();
        for garbage in [0.0, f64::NAN, 1e300] {
            let mut hidden = sample(1, rest.points.clone());
            hidden.positions[3] = Vector3::repeat(garbage);
            hidden.seen[3] = false;
            let frame = world.step(Some(&hidden)).expect("a step");
            assert_ne!(frame.point_states[3], PointState::Valid);
            assert_eq!(frame.points[3], rest.points[3]);
            for (x, x0) in frame.vertices.iter().zip(&rest.vertices) {
                assert!((x - x0).norm() < 1e-12, "{x} from {x0}");
            }
        }
        // A tenth of a second later it is trusted again.
        let back = || sample(2, rest.points.clone());
        let states: Vec<_> = (0..10)
            .map(|_| world.step(Some(&back())).expect("a step").point_states[3])
            .collect();
        assert_eq!(states[8], PointState::Held);
        assert_eq!(states[9], PointState::Valid);
    }
}

#[test]
fn an_absent_point_drives_nothing_even_when_it_appears() {
    let mut points = corners();
    points.absent = vec![2];
    points.rest[2] = Vector3::repeat(f64::NAN);
    let grid = shapes::hexahedra(4, 4, 4);
    let mut world = build(scene(
        Motion::External(points),
        MeshSource::Grid(grid),
        Rule::WeightedMean,
    ));
    let rest = world.frame();
    let mut seen = sample(1, rest.points.clone());
    seen.positions[2] = Vector3::repeat(9.0);
    let frame = world.step(Some(&seen)).expect("a step");
    assert_eq!(frame.point_states[2], PointState::Absent);
    assert_eq!(frame.vertices, rest.vertices);
}

#[test]
fn the_digest_is_the_same_for_any_number_of_threads() {
    // Large enough that the kernels split it.
    let large = |rule| {
        let grid = shapes::hexahedra(40, 40, 40);
        scene(Motion::External(corners()), MeshSource::Grid(grid), rule)
    };
    let run = |scene: Scene, threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let mut world = build(scene);
            for step in 1..20_u64 {
                let turn = Rotation3::from_euler_angles(0.05 * step as f64, 0.02, -0.03);
                let moved = corners().rest.iter().map(|p| turn * p + p * 0.1).collect();
                world.step(Some(&sample(step, moved))).expect("a step");
            }
            world.digest()
        })
    };
    for scene in [
        large(Rule::WeightedMean),
        large(Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid))),
        chain(),
    ] {
        let digests = [1, 2, 8].map(|threads| run(scene.clone(), threads));
        assert_eq!(digests[0], digests[1]);
        assert_eq!(digests[0], digests[2]);
    }
}

#[test]
fn the_digest_sees_every_part_of_the_state() {
    let mut digests = Vec::new();
    for nudge in [0.0, f64::EPSILON, 1e-3] {
        let mut world = build(cube(Rule::WeightedMean));
        let mut moved = corners().rest;
        moved[7].z += nudge;
        world.step(Some(&sample(1, moved))).expect("a step");
        digests.push(world.digest());
        world.step(None).expect("a step");
        digests.push(world.digest());
    }
    let count = digests.len();
    digests.sort_unstable();
    digests.dedup();
    assert_eq!(digests.len(), count);
}

#[test]
fn a_frame_given_out_never_changes() {
    let mut world = build(chain());
    let held: Vec<_> = (0..40).map(|_| world.step(None).expect("a step")).collect();
    let copies: Vec<_> = held.iter().map(|frame| (**frame).clone()).collect();
    for _ in 0..40 {
        world.step(None).expect("a step");
    }
    for (frame, copy) in held.iter().zip(&copies) {
        assert_eq!(**frame, *copy);
    }
}

#[test]
fn a_diverging_network_ends_in_an_error_and_never_in_a_nan() {
    let mut wild = chain();
    wild.time_step = 10.0;
    let mut world = build(wild);
    assert!(
        world.warnings()[0].contains("stable up to"),
        "{:?}",
        world.warnings()
    );
    let error = loop {
        match world.step(None) {
            Ok(frame) => assert!(
                frame
                    .vertices
                    .iter()
                    .all(|x| x.iter().all(|c| c.is_finite()))
            ),
            Err(error) => break error,
        }
    };
    assert!(
        matches!(error, StepError::Diverged(_) | StepError::OutOfRange { .. }),
        "{error}"
    );
}

/// A change that spoils a scene, and the reason and the field of the refusal.
type Spoil = (fn(&mut Scene), &'static str, &'static str);

fn points(scene: &mut Scene) -> &mut ExternalPoints {
    match &mut scene.motion {
        Motion::External(points) => points,
        Motion::Particles(_) | Motion::MassSpring(_) | Motion::Elastic(_) => {
            unreachable!("the cube's points are external")
        }
    }
}
fn grid(scene: &mut Scene) -> &mut Grid {
    match &mut scene.mesh {
        MeshSource::Grid(grid) => grid,
        MeshSource::Lattice(_) | MeshSource::Fill(_) => unreachable!("the cube is a grid"),
    }
}
const SPOILS: [Spoil; 12] = [
    (
        |s| s.time_step = 0.0,
        "VALUE_OUT_OF_RANGE",
        "scene.time_step_seconds",
    ),
    (
        |s| s.time_step = f64::NAN,
        "VALUE_OUT_OF_RANGE",
        "scene.time_step_seconds",
    ),
    (
        |s| points(s).labels.clear(),
        "FIELD_MISSING",
        "scene.motion.external.labels",
    ),
    (
        |s| points(s).labels[1].clear(),
        "LABEL_EMPTY",
        "scene.motion.external.labels[1]",
    ),
    (
        |s| points(s).labels[1] = "corner 0".into(),
        "LABEL_DUPLICATE",
        "scene.motion.external.labels[1]",
    ),
    (
        |s| points(s).absent.push(8),
        "INDEX_OUT_OF_RANGE",
        "scene.motion.external.absent[0]",
    ),
    (
        |s| points(s).rest[5].y = f64::INFINITY,
        "VALUE_NOT_FINITE",
        "scene.motion.external.rest_positions[5]",
    ),
    (
        |s| s.mapping.points.push("nobody".into()),
        "LABEL_UNKNOWN",
        "scene.mapping.points[0]",
    ),
    (
        |s| grid(s).cells.connectivity[9] = 125,
        "INDEX_OUT_OF_RANGE",
        "scene.mesh.grid",
    ),
    (
        |s| grid(s).positions[0].x = f64::NAN,
        "VALUE_NOT_FINITE",
        "scene.mesh.grid",
    ),
    (
        |s| grid(s).cells.connectivity[..8].rotate_left(4),
        "CELL_INVERTED",
        "scene.mesh.grid",
    ),
    (
        |s| grid(s).positions[0] = Vector3::new(0.25, 0.25, 0.25),
        "CELL_INVERTED",
        "scene.mesh.grid",
    ),
];

#[test]
fn each_bad_value_is_refused_by_its_field() {
    for (i, (spoil, reason, field)) in SPOILS.into_iter().enumerate() {
        let mut bad = cube(Rule::WeightedMean);
        spoil(&mut bad);
        let SceneError {
            reason: found,
            field: at,
            message,
        } = World::build(bad).expect_err("a spoilt scene");
        assert_eq!(
            (found, at.as_str()),
            (reason, field),
            "spoil {i}: {message}"
        );
    }
}
