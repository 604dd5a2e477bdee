//! What a world does when its mapping is changed.

use std::sync::Arc;

use nalgebra::Vector3;
use sinew_engine::{
    ExternalPoints, Filter, Mapping, MeshSource, Motion, MotionSample, Recipe, Reference,
    RemapError, Rule, Scene, Tracking, UpAxis, Weighting, World,
};
use sinew_mesh::shapes;

const DT: f64 = 0.01;

/// Two points beside a column of cubes, one below and one above.
fn points() -> Vec<Vector3<f64>> {
    vec![Vector3::new(0.5, 0.5, 0.0), Vector3::new(0.5, 0.5, 1.0)]
}

fn mapping(label: &str) -> Mapping {
    let weighting = Weighting::default();
    Mapping {
        recipe: Recipe {
            weighting,
            filter: Filter::KeepK(2),
            rule: Rule::WeightedMean,
            reference: Reference::Initial,
        },
        points: vec![label.to_owned()],
    }
}

/// A world that follows the lower point alone.
fn world() -> World {
    let labels = vec!["low".to_owned(), "high".to_owned()];
    World::build(Scene {
        title: String::new(),
        motion: Motion::External(ExternalPoints {
            labels,
            rest: points(),
            absent: Vec::new(),
            tracking: Tracking::default(),
        }),
        mesh: MeshSource::Grid(shapes::hexahedra(1, 1, 4)),
        mapping: mapping("low"),
        rules: Vec::new(),
        time_step: DT,
        up: UpAxis::Z,
        probes: Vec::new(),
    })
    .expect("the scene is good")
}

/// The upper point 1 m to the side.
fn apart(sequence: u64) -> MotionSample {
    let mut positions = points();
    positions[1].x += 1.0;
    MotionSample {
        sequence,
        time: DT * sequence as f64,
        positions,
        seen: vec![true; 2],
    }
}

/// How far the first vertex is from rest along x, m.
fn shift(world: &World) -> f64 {
    world.frame().vertices[0].x - shapes::hexahedra(1, 1, 4).positions[0].x
}

#[test]
fn frames_after_a_change_have_its_layout_and_frames_before_keep_theirs() {
    let mut world = world();
    let mut old = Vec::new();
    for i in 1..=20 {
        let frame = world.step(Some(&apart(i))).expect("it steps");
        old.extend((i % 3 == 0).then_some(frame)); // the others' memory is used again
    }
    let bound = world.rest().bind(mapping("high")).expect("it binds");
    world.remap(bound, 5.0 * DT).expect("nothing blends");
    let before = Arc::clone(&world.frame().layout);
    let mut new = Vec::new();
    for i in 21..=60 {
        let frame = world.step(Some(&apart(i))).expect("it steps");
        assert!(frame.layout.dominant.iter().all(|&point| point == 1));
        new.extend((i % 3 == 0).then_some(frame));
    }
    for frame in &old {
        assert!(Arc::ptr_eq(&frame.layout, &before));
        assert!(frame.layout.dominant.iter().all(|&point| point == 0));
    }
    for frame in &new {
        assert!(Arc::ptr_eq(&frame.layout, &world.frame().layout));
        assert_eq!(frame.layout.cells, before.cells);
        let key = |l: &sinew_engine::Layout| (l.epoch, l.topology_version, l.hash);
        assert_eq!(key(&frame.layout), key(&before));
    }
}

#[test]
fn a_blend_is_a_smoothstep_of_simulated_time_from_its_own_start() {
    let mut world = world();
    for i in 1..=3 {
        world.step(Some(&apart(i))).expect("it steps");
    }
    let bound = world.rest().bind(mapping("high")).expect("it binds");
    world.remap(bound, 4.0 * DT).expect("nothing blends");
    assert_eq!(shift(&world), 0.0); // a frame that was given out never changes
    for expected in [0.156_25, 0.5, 0.843_75, 1.0, 1.0] {
        let sequence = world.frame().step + 1;
        world.step(Some(&apart(sequence))).expect("it steps");
        assert!((shift(&world) - expected).abs() < 1e-12);
    }
}

#[test]
fn a_blend_shorter_than_a_step_is_no_blend() {
    let [mut short, mut none] = [(); 2].map(|()| world());
    for (world, seconds) in [(&mut short, 0.5 * DT), (&mut none, 0.0)] {
        let bound = world.rest().bind(mapping("high")).expect("it binds");
        world.remap(bound, seconds).expect("nothing blends");
        world.step(Some(&apart(1))).expect("it steps");
    }
    assert_eq!(short.digest(), none.digest());
}

#[test]
fn a_refused_change_changes_nothing() {
    let mut world = world();
    let bind = |world: &World| world.rest().bind(mapping("high")).expect("it binds");
    let first = bind(&world);
    world.remap(first, 1.0).expect("nothing blends");
    world.step(Some(&apart(1))).expect("it steps");
    let before = world.digest();
    let second = bind(&world);
    let refusal = world.remap(second, 1.0);
    assert_eq!(refusal, Err(RemapError::Blending { until: 1.0 }));
    for seconds in [-1.0, f64::NAN, f64::INFINITY, 86_401.0] {
        let bound = bind(&world);
        let refusal = world.remap(bound, seconds);
        assert!(matches!(refusal, Err(RemapError::BlendSeconds { .. })));
    }
    assert_eq!(world.digest(), before);
}
