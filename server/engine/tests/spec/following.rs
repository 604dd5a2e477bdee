//! How a mapping follows a mesh that changes.

use nalgebra::Vector3;
use sinew_engine::{
    Answer, Cost, Dimension, EventKind, Facet, Filter, Metric, Paths, Request, Roots, Rule, Scene,
    Start, Weighting, World,
};

use crate::common::{bar, build, rest, step, stretched};

/// The bar of 8 with weights along paths over targets of this dimension.
fn flooded(targets: Dimension, arcs: Dimension, filter: Filter) -> Scene {
    let mut scene = bar(8, Rule::WeightedMean, Vec::new());
    scene.mapping.recipe.filter = filter;
    scene.mapping.recipe.weighting = Weighting {
        targets,
        metric: Metric::Paths(Paths {
            arcs,
            roots: Roots::Nearest,
            start: Start::Distance,
            cost: Cost::Length,
        }),
        ..Weighting::default()
    };
    scene
}

/// The cell of the bar of 8 at a place: x first.
fn cell([x, y, z]: [u32; 3]) -> u32 {
    x + 8 * (y + 2 * z)
}

fn is_refused(answers: &[Answer]) -> bool {
    let refused = |answer: &Answer| matches!(answer, Answer::Refused(_));
    answers.iter().all(refused)
}

/// Steps a world as its points are pulled, and checks that its vertices stay where points may bring them.
fn pull(world: &mut World) {
    let rest = rest(world);
    for n in 1..=5 {
        let frame = step(world, stretched(&rest, 0.02 * f64::from(n)));
        let cells = &frame.layout.cells;
        for &vertex in &cells.connectivity {
            let place = frame.vertices[vertex as usize];
            assert!((-1.0..9.0).contains(&place.x), "{vertex}: {place:?}");
        }
    }
}

#[test]
fn a_corner_that_no_path_reaches_any_more_follows_the_nearest_point() {
    for (targets, arcs) in [
        (Dimension::Vertex, Dimension::Edge),
        (Dimension::Vertex, Dimension::Volume),
        (Dimension::Edge, Dimension::Vertex),
        (Dimension::Face, Dimension::Edge),
        (Dimension::Volume, Dimension::Face),
    ] {
        let mut world = build(flooded(targets, arcs, Filter::KeepK(2)));
        let gone = [
            [6, 0, 0],
            [6, 1, 0],
            [6, 0, 1],
            [6, 1, 1],
            [7, 1, 0],
            [7, 0, 1],
        ];
        let cells = gone.into_iter().chain([[7, 1, 1]]).map(cell).collect();
        let edited = world.edit(vec![Request::Remove { cells }]).unwrap();
        assert!(!is_refused(&edited.answers), "{targets:?}");
        let frame = edited.frame.unwrap();
        let corner = frame.layout.cells.cell(cell([7, 0, 0]) as usize);
        // Point 4 is in the middle of the bar's end, 8 1 1, and was as near to the other three.
        for &vertex in corner.vertices {
            assert_eq!(frame.layout.dominant[vertex as usize], 4, "{targets:?}");
        }
        pull(&mut world);
    }
}

#[test]
fn a_part_that_is_cut_off_from_all_points_follows_the_nearest() {
    // The mapping knows the points at x = 0 and 2.
    let mut scene = flooded(Dimension::Vertex, Dimension::Edge, Filter::KeepK(2));
    scene.mapping.points = ["p0", "p1"].map(str::to_owned).to_vec();
    let mut world = build(scene);
    let facets = [0, 1].into_iter().flat_map(|y| [0, 1].map(|z| [y, z]));
    let facets = facets.map(|[y, z]| [cell([4, y, z]), cell([5, y, z])]);
    let open = Request::Open {
        facets: facets.collect(),
    };
    let edited = world.edit(vec![open]).unwrap();
    assert!(!is_refused(&edited.answers));
    let frame = edited.frame.unwrap();
    for x in 5..8 {
        for &vertex in frame.layout.cells.cell(cell([x, 0, 0]) as usize).vertices {
            let explained = world.explain(vertex as usize).unwrap();
            let points: Vec<_> = (explained.influences.iter())
                .map(|influence| influence.point)
                .collect();
            assert_eq!(points, [1], "of the nearest point alone");
        }
    }
    pull(&mut world);
}

#[test]
fn a_mesh_with_a_part_that_no_path_reaches_is_refused_at_first() {
    let mut scene = flooded(Dimension::Vertex, Dimension::Edge, Filter::KeepK(2));
    // A mesh in two parts from the start, one of them without a point.
    scene.mapping.points = vec!["p0".to_owned()];
    let sinew_engine::MeshSource::Grid(grid) = &mut scene.mesh else {
        panic!("a grid");
    };
    let other = grid.clone();
    let shift = u32::try_from(grid.positions.len()).unwrap();
    let far = Vector3::new(100.0, 0.0, 0.0);
    grid.positions
        .extend(other.positions.iter().map(|x| x + far));
    let connectivity = other.cells.connectivity.iter();
    (grid.cells.connectivity).extend(connectivity.map(|vertex| vertex + shift));
    let end = *grid.cells.offsets.last().unwrap();
    (grid.cells.offsets).extend(other.cells.offsets[1..].iter().map(|offset| offset + end));
    grid.cells.types.extend(&other.cells.types);
    let refusal = World::build(scene).unwrap_err();
    assert_eq!(refusal.field, "scene.mapping.weighting.flood.roots");
}

#[test]
fn an_edit_that_the_mapping_cannot_follow_is_refused_and_changes_nothing() {
    let mut scene = bar(8, Rule::WeightedMean, Vec::new());
    let farthest = 2.0;
    scene.mapping.recipe.filter = Filter::Interval {
        nearest: 0.0,
        farthest,
    };
    let mut world = build(scene);
    let rest = rest(&world);
    step(&mut world, stretched(&rest, 0.1));
    let facet = |world: &World| {
        let frame = world.frame();
        let form = frame.layout.cells.cell(cell([7, 0, 0]) as usize);
        let end = |vertex: &u32| world.explain(*vertex as usize).unwrap().rest.x == 8.0;
        let vertices: Vec<_> = form.vertices.iter().copied().filter(end).collect();
        let cell = cell([7, 0, 0]);
        Facet { cell, vertices }
    };
    let digest = world.digest();
    let facets = vec![facet(&world)];
    // So high that its top is out of the reach of every point; the other edit goes with it.
    let high = Request::Add {
        facets: facets.clone(),
        thickness: 5.0,
    };
    let open = Request::Open {
        facets: vec![[0, 1]],
    };
    let edited = world.edit(vec![open.clone(), high]).unwrap();
    assert!(edited.frame.is_none());
    for answer in &edited.answers {
        let Answer::Refused(refusal) = answer else {
            panic!("{answer:?}");
        };
        assert!(
            refusal.to_string().contains("the mapping cannot follow"),
            "{refusal}"
        );
    }
    assert_eq!(world.digest(), digest);
    // What can be followed still is, as if nothing had been asked.
    let low = Request::Add {
        facets,
        thickness: 0.5,
    };
    let edited = world.edit(vec![open, low]).unwrap();
    assert!(!is_refused(&edited.answers));
    let change = edited.frame.unwrap().change.clone().unwrap();
    assert!(change.patch.is_some());
    let refused = |event: &sinew_engine::Event| matches!(event.kind, EventKind::Refused(_));
    assert!(!change.events.iter().any(refused));
    step(&mut world, stretched(&rest, 0.2));
}

#[test]
fn vertices_far_from_a_tear_keep_their_weights() {
    // Without a scale of its own a flood takes the mean distance at first, and keeps to it.
    let mut world = build(flooded(
        Dimension::Vertex,
        Dimension::Edge,
        Filter::KeepK(2),
    ));
    let far = world.frame().layout.cells.cell(0).vertices.to_vec();
    let weights = |world: &World| -> Vec<_> {
        let explain = |&vertex: &u32| world.explain(vertex as usize).unwrap().influences;
        far.iter().map(explain).collect()
    };
    let before = weights(&world);
    let facets = vec![[cell([6, 0, 0]), cell([7, 0, 0])]];
    let edited = world.edit(vec![Request::Open { facets }]).unwrap();
    assert!(edited.frame.is_some());
    assert_eq!(weights(&world), before);
}
