//! What becomes of a world whose mesh comes apart.

use std::sync::Arc;

use crate::common::{
    SHAPE, bar, build, moved, neighbours, paths, rest, rule, sample, step, stretched,
};
use nalgebra::Vector3;
use sinew_engine::{
    Action, Change, Effect, EventKind, Filter, Frame, Limits, Measure, Pairs, RemapError, Request,
    Rule, Strain, TopologyRule, World,
};

/// Cuts the bar of 8 in two between x = 3 and x = 4 where it is stretched by half.
fn cut_in_two() -> TopologyRule {
    // Cells 3 and 4 of each row of 8, four rows.
    let seam = (0..4).map(|row| [8 * row + 3, 8 * row + 4]).collect();
    TopologyRule {
        limits: Limits {
            seam,
            ..Limits::default()
        },
        ..rule(Measure::Edges(Strain::Elongation), 0.5, Action::Open)
    }
}

fn changes(frames: &[Arc<Frame>]) -> Vec<(u64, Arc<Change>)> {
    let change = |frame: &Arc<Frame>| Some((frame.step, frame.change.clone()?));
    frames.iter().filter_map(change).collect()
}

/// The frames of a bar that is stretched by a tenth more at each step.
fn pulled(mapping: Rule, rules: Vec<TopologyRule>, steps: u32) -> Vec<Arc<Frame>> {
    let mut world = build(bar(8, mapping, rules));
    let rest = rest(&world);
    let first = world.frame();
    let steps = (1..=steps).map(|n| step(&mut world, stretched(&rest, 0.01 * f64::from(n))));
    std::iter::once(first).chain(steps).collect()
}

#[test]
fn a_world_has_a_map_only_where_something_may_change_its_mesh() {
    let report = rule(Measure::Edges(Strain::Elongation), 0.5, Action::Report);
    for rules in [Vec::new(), vec![report]] {
        let mut world = build(bar(8, SHAPE, rules));
        let rest = rest(&world);
        for factor in [0.2, 0.9] {
            step(&mut world, stretched(&rest, factor));
            assert_eq!(world.map_bytes(), 0);
        }
        let cells = vec![0];
        world.edit(vec![Request::Remove { cells }]).unwrap();
        assert!(world.map_bytes() > 0);
    }
    let torn = build(bar(8, SHAPE, vec![cut_in_two()]));
    // Six ids of four bytes for each of the 24 darts of a cube.
    let (cubes, columns) = (torn.frame().layout.cells.len(), 6 * 4 * 24);
    assert!(torn.map_bytes() > cubes * columns);
}

#[test]
fn a_bar_comes_apart_along_its_seam_once_it_is_stretched_enough() {
    for mapping in [Rule::WeightedMean, SHAPE] {
        let frames = pulled(mapping, vec![cut_in_two()], 120);
        let changes = changes(&frames);
        let (step, change) = &changes[0];
        let kinds: Vec<_> = change.events.iter().map(|event| &event.kind).collect();
        let [
            EventKind::Crossed {
                measured,
                threshold,
            },
            torn,
            born,
        ] = kinds[..]
        else {
            panic!("{kinds:?}")
        };
        assert!(
            measured >= threshold && *measured < 1.1 * threshold,
            "{measured}"
        );
        assert_eq!(*torn, EventKind::Torn { faces: 4 });
        assert_eq!(
            *born,
            EventKind::Followed(Effect::FragmentBorn {
                fragment: 1,
                parent: 0,
                cells: 16
            })
        );
        let patch = change.patch.as_ref().expect("a patch");
        // The nine vertices of the cross-section.
        assert_eq!(patch.vertex_parents.len(), 9);
        let step = usize::try_from(*step).unwrap();
        let (before, after) = (&frames[step - 1], &frames[step]);
        assert_eq!(after.layout.topology_version, 1);
        assert_eq!(after.vertices.len(), before.vertices.len() + 9);
        assert_eq!(after.layout.dominant.len(), after.vertices.len());
        let cells = before
            .layout
            .cells
            .patched(&patch.slots, &patch.cells, after.vertices.len());
        assert_eq!(cells.as_ref(), Ok(&*after.layout.cells));
        assert_eq!(patch.hash, after.layout.cells.hash());
        assert_eq!(patch.hash, after.layout.hash);
        // Distances do not see the cut, and so both sides of it stay together.
        for frame in &frames[step..] {
            for (new, &parent) in patch.vertex_parents.iter().enumerate() {
                let apart =
                    frame.vertices[before.vertices.len() + new] - frame.vertices[parent as usize];
                assert!(apart.norm() < 1e-12);
            }
        }
        let patches = changes.iter().filter(|(_, change)| change.patch.is_some());
        assert_eq!(patches.count(), 1);
    }
}

#[test]
fn all_cells_over_the_threshold_at_once_come_apart_at_once() {
    let frames = pulled(
        Rule::WeightedMean,
        vec![rule(Measure::Edges(Strain::Elongation), 1e-3, Action::Open)],
        3,
    );
    let last = &frames[3];
    assert_eq!(last.layout.cells.len(), 32);
    assert_eq!(last.layout.cells.connectivity.len(), 32 * 8);
    let mut used = last.layout.cells.connectivity.clone();
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len(), 32 * 8, "no cell shares a vertex");
    assert_eq!(changes(&frames).len(), 1);
}

#[test]
fn cells_squeezed_flat_or_turned_inside_out_are_seen_and_taken_away() {
    let flat = rule(Measure::Volumes(Strain::Compression), 1.0, Action::Remove);
    let mut world = build(bar(8, Rule::WeightedMean, vec![flat]));
    let rest = rest(&world);
    // The last point comes back over the others: the cells at the end of the bar turn inside out on the way.
    let mut removed = 0;
    for n in 0..200 {
        let mut points = rest.clone();
        points[4].x -= 0.05 * f64::from(n);
        let frame = step(&mut world, points);
        for change in frame.change.iter() {
            let gone = change
                .events
                .iter()
                .filter(|event| event.kind == EventKind::Removed);
            removed += gone.map(|event| event.cells.len()).sum::<usize>();
        }
        let grid = sinew_mesh::Grid {
            positions: frame.vertices.clone(),
            cells: sinew_mesh::Cells::clone(&frame.layout.cells),
        };
        for cell in 0..grid.cells.len() {
            if grid.cells.types[cell] != 0 {
                assert!(
                    sinew_mesh::volume(&grid, cell) > 0.0,
                    "step {n}, cell {cell}"
                );
            }
        }
    }
    assert!(removed > 0);
}

#[test]
fn the_same_recording_gives_the_same_events_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let near = Measure::Points {
                strain: Strain::Elongation,
                pairs: Pairs::Within(4.5),
            };
            let rules = vec![
                cut_in_two(),
                rule(near, 0.3, Action::Report),
                rule(Measure::Volumes(Strain::Elongation), 0.9, Action::Remove),
                rule(Measure::Fit, 0.2, Action::Open),
            ];
            let mut world = build(bar(16, SHAPE, rules));
            let rest = rest(&world);
            let mut log = String::new();
            for n in 1..80 {
                let wave = |(i, p): (usize, &Vector3<f64>)| {
                    let phase = 0.05 * f64::from(n) + i as f64;
                    p * 0.012 * f64::from(n) + Vector3::new(0.0, phase.sin(), phase.cos())
                };
                let by: Vec<_> = rest.iter().enumerate().map(wave).collect();
                let frame = step(&mut world, moved(&rest, &by));
                log += &format!("{:?}\n", frame.change);
            }
            (log, world.digest())
        })
    };
    let one = run(1);
    assert!(one.0.contains("Torn") && one.0.contains("Removed"));
    assert_eq!(run(2), one);
    assert_eq!(run(8), one);
}

#[test]
fn a_mapping_bound_before_a_tear_is_refused_after_it() {
    let mut world = build(bar(8, Rule::WeightedMean, vec![cut_in_two()]));
    let before = world.rest();
    let mapping = bar(8, Rule::Mean, Vec::new()).mapping;
    let rest_points = rest(&world);
    for n in 1..=120 {
        step(&mut world, stretched(&rest_points, 0.01 * f64::from(n)));
    }
    let stale = before.bind(mapping.clone()).expect("it binds");
    let digest = world.digest();
    assert_eq!(world.remap(stale, 0.0), Err(RemapError::Outdated));
    assert_eq!(world.digest(), digest);
    let fresh = world.rest().bind(mapping).expect("it binds");
    assert_eq!(world.remap(fresh, 0.1), Ok(()));
    step(&mut world, rest_points);
}

#[test]
fn a_blend_under_way_goes_on_over_a_tear() {
    let mut world = build(bar(8, Rule::WeightedMean, vec![cut_in_two()]));
    let rest_points = rest(&world);
    let mapping = bar(8, Rule::Direct, Vec::new()).mapping;
    let mut torn = 0;
    for n in 1..=120 {
        if n % 20 == 1 {
            let rule = if n % 40 == 1 {
                mapping.clone()
            } else {
                bar(8, SHAPE, Vec::new()).mapping
            };
            let bound = world.rest().bind(rule).expect("it binds");
            world.remap(bound, 0.15).expect("no blend is under way");
        }
        let frame = step(&mut world, stretched(&rest_points, 0.01 * f64::from(n)));
        torn += usize::from(frame.layout.topology_version > 0);
    }
    assert!(torn > 0);
}

#[test]
fn an_occluded_point_does_not_tear_what_it_moves() {
    let mut world = build(bar(8, Rule::WeightedMean, vec![cut_in_two()]));
    let rest_points = rest(&world);
    for n in 1..=120 {
        let mut seen = sample(stretched(&rest_points, 0.01 * f64::from(n)));
        seen.seen[2] = false;
        let frame = world.step(Some(&seen)).expect("a step");
        assert_eq!(frame.change, None);
    }
}

#[test]
fn a_tear_between_points_that_a_mapping_would_not_show_is_refused() {
    let watch = rule(neighbours(Strain::Elongation), 0.5, Action::Separate);
    let scene = bar(8, Rule::WeightedMean, vec![watch.clone()]);
    let refusal = World::build(scene).unwrap_err();
    assert_eq!(
        (refusal.reason, &*refusal.field),
        ("RULE_UNFIT", "scene.rules[0].action")
    );
    // Nor can such a mapping come later.
    let mut scene = bar(8, Rule::WeightedMean, vec![watch]);
    let straight = scene.mapping.clone();
    scene.mapping.recipe.weighting.metric = paths();
    let mut world = build(scene);
    let digest = world.digest();
    let bound = world.rest().bind(straight).unwrap();
    assert_eq!(world.remap(bound, 0.0), Err(RemapError::Straight));
    assert_eq!(world.digest(), digest);
}

#[test]
fn two_points_pulled_apart_tear_the_mesh_between_them() {
    let watch = rule(neighbours(Strain::Elongation), 0.5, Action::Separate);
    let mut scene = bar(8, Rule::WeightedMean, vec![watch]);
    scene.mapping.recipe.filter = Filter::KeepK(1);
    scene.mapping.recipe.weighting.metric = paths();
    let mut world = build(scene);
    let rest = rest(&world);
    let mut changes = Vec::new();
    for n in 1..=60 {
        // The last three of the five points go on, and the first two stay.
        let mut points = rest.clone();
        for point in &mut points[2..] {
            point.x += 0.05 * f64::from(n);
        }
        let frame = step(&mut world, points);
        changes.extend(frame.change.clone());
    }
    let [change] = &changes[..] else {
        panic!("{changes:?}")
    };
    let kinds: Vec<_> = change.events.iter().map(|event| &event.kind).collect();
    let [
        EventKind::Crossed { .. },
        EventKind::Torn { faces },
        EventKind::Followed(Effect::FragmentBorn { .. }),
    ] = kinds[..]
    else {
        panic!("{kinds:?}")
    };
    assert!(*faces > 0);
}
