//! What rules see and do, by the laws that they promise.

use crate::common::{SHAPE, bar, build, moved, neighbours, rest, rule, sample, step, stretched};
use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_engine::{Action, EventKind, Frame, Measure, Region, Rule, Strain, TopologyRule};
use sinew_mesh::{Cells, Grid};

/// How many events of a step say that a measure crossed.
fn crossed(frame: &Frame) -> usize {
    let events = frame.change.iter().flat_map(|change| &change.events);
    events
        .filter(|event| matches!(event.kind, EventKind::Crossed { .. }))
        .count()
}

/// The cells that a step says crossed.
fn crossed_cells(frame: &Frame) -> Vec<u32> {
    let events = frame.change.iter().flat_map(|change| &change.events);
    let crossed = events.filter(|event| matches!(event.kind, EventKind::Crossed { .. }));
    crossed.flat_map(|event| event.cells.clone()).collect()
}

/// What a cell's parts depart from rest, at most, by the definition.
fn departure(measure: &Measure, cell: usize, grid: &Grid, now: &Grid) -> f64 {
    let ratios: Vec<(Strain, f64)> = match measure {
        Measure::Edges(strain) => {
            let edges = grid.cells.cell(cell).faces().flat_map(|face| face.edges());
            let length = |grid: &Grid, [a, b]: [u32; 2]| {
                (grid.positions[a as usize] - grid.positions[b as usize]).norm()
            };
            let ratio = |ends| (*strain, length(now, ends) / length(grid, ends));
            edges.map(ratio).collect()
        }
        Measure::Faces(strain) => {
            let faces = grid.cells.cell(cell).faces();
            let area = |grid: &Grid, face: &sinew_mesh::Face<'_>| {
                sinew_mesh::face_area(&grid.positions, face)
            };
            faces
                .map(|face| (*strain, area(now, &face) / area(grid, &face)))
                .collect()
        }
        Measure::Volumes(strain) => {
            vec![(
                *strain,
                sinew_mesh::volume(now, cell) / sinew_mesh::volume(grid, cell),
            )]
        }
        Measure::Points { .. } | Measure::Fit | Measure::Gaps => panic!("not of cells"),
    };
    let departs = ratios.into_iter().map(|(strain, ratio)| match strain {
        Strain::Elongation => ratio - 1.0,
        Strain::Compression => 1.0 - ratio,
    });
    departs.reduce(f64::max).expect("a part")
}

fn any_part() -> impl Strategy<Value = Measure> {
    let strain = prop_oneof![Just(Strain::Elongation), Just(Strain::Compression)];
    (0..3, strain).prop_map(|(kind, strain)| match kind {
        0 => Measure::Edges(strain),
        1 => Measure::Faces(strain),
        _ => Measure::Volumes(strain),
    })
}

fn any_measure() -> impl Strategy<Value = Measure> {
    prop_oneof![
        any_part(),
        Just(neighbours(Strain::Elongation)),
        Just(neighbours(Strain::Compression)),
        Just(Measure::Fit),
    ]
}

/// Displacements of the five points that grow over the steps in small and in large ones.
fn any_motion() -> impl Strategy<Value = Vec<Vec<Vector3<f64>>>> {
    let push = prop::array::uniform3(-0.1..0.1f64);
    let pushes = prop::collection::vec(push, 5);
    prop::collection::vec(pushes, 1..40).prop_map(|steps| {
        let mut at = vec![Vector3::zeros(); 5];
        let advance = |pushes: Vec<[f64; 3]>| {
            for (at, push) in at.iter_mut().zip(pushes) {
                *at += Vector3::from(push);
            }
            at.clone()
        };
        steps.into_iter().map(advance).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn raising_a_threshold_never_makes_the_first_event_come_earlier(
        measure in any_measure(),
        low in 0.01..0.9f64,
        raise in 0.0..0.1f64,
        motion in any_motion(),
    ) {
        let mapping = if measure == Measure::Fit { SHAPE } else { Rule::WeightedMean };
        let first = |threshold| {
            let rules = vec![rule(measure.clone(), threshold, Action::Report)];
            let mut world = build(bar(8, mapping, rules));
            let rest = rest(&world);
            let crosses = |by: &Vec<_>| crossed(&step(&mut world, moved(&rest, by))) > 0;
            motion.iter().position(crosses).unwrap_or(usize::MAX)
        };
        prop_assert!(first(low) <= first(low + raise));
    }

    #[test]
    fn cells_cross_where_their_measure_reaches_the_threshold_and_come_back_below_the_hysteresis(
        measure in any_part(),
        threshold in 0.05..0.5f64,
        share in 0.0..1.0f64,
        motion in any_motion(),
    ) {
        let hysteresis = share * threshold;
        let mut watch = rule(measure.clone(), threshold, Action::Report);
        watch.hysteresis = hysteresis;
        let mut world = build(bar(8, Rule::WeightedMean, vec![watch]));
        let rest = rest(&world);
        let first = world.frame();
        let cells = &first.layout.cells;
        let grid = Grid { positions: first.vertices.clone(), cells: Cells::clone(cells) };
        let mut armed = vec![true; cells.len()];
        for by in &motion {
            let frame = step(&mut world, moved(&rest, by));
            let now = Grid { positions: frame.vertices.clone(), cells: Cells::clone(cells) };
            let mut expected = Vec::new();
            for (cell, armed) in (0..).zip(&mut armed) {
                let measured = departure(&measure, cell as usize, &grid, &now);
                if measured >= threshold {
                    if *armed {
                        expected.push(cell);
                    }
                    *armed = false;
                } else if measured < threshold - hysteresis {
                    *armed = true;
                }
            }
            prop_assert_eq!(crossed_cells(&frame), expected);
        }
    }

    #[test]
    fn a_rigid_motion_crosses_nothing(
        turns in prop::collection::vec(prop::array::uniform3(-3.0..3.0f64), 1..10),
        shift in prop::array::uniform3(-0.2..0.2f64),
    ) {
        let measures = [Measure::Fit, neighbours(Strain::Elongation), neighbours(Strain::Compression)];
        let rules = measures.map(|measure| rule(measure, 1e-6, Action::Report)).to_vec();
        let mut world = build(bar(8, SHAPE, rules));
        let rest = rest(&world);
        for turn in turns {
            let turn = nalgebra::Rotation3::new(Vector3::from(turn));
            let frame = step(&mut world, rest.iter().map(|p| turn * p + Vector3::from(shift)).collect());
            prop_assert_eq!(crossed(&frame), 0);
        }
    }
}

/// The steps, from 1, at which a bar that is stretched by `e` of one step after the other says that something crossed.
fn when(watch: TopologyRule, stretches: &[f64]) -> Vec<usize> {
    let mut world = build(bar(8, Rule::WeightedMean, vec![watch]));
    let rest = rest(&world);
    let crosses = |e: &f64| crossed(&step(&mut world, stretched(&rest, *e))) > 0;
    let crosses: Vec<bool> = stretches.iter().map(crosses).collect();
    (1..)
        .zip(crosses)
        .filter_map(|(step, crosses)| crosses.then_some(step))
        .collect()
}

#[test]
fn a_measure_must_fall_below_the_hysteresis_before_it_crosses_again() {
    let mut watch = rule(neighbours(Strain::Elongation), 0.1, Action::Report);
    watch.hysteresis = 0.05;
    let stretches = [0.05, 0.101, 0.2, 0.06, 0.101, 0.04, 0.101];
    assert_eq!(when(watch, &stretches), [2, 7]);
}

#[test]
fn a_rule_acts_within_its_time_alone() {
    let mut watch = rule(neighbours(Strain::Elongation), 0.01, Action::Report);
    watch.limits.from = Some(0.025);
    watch.limits.until = Some(0.045);
    assert_eq!(when(watch.clone(), &[0.02; 6]), [3]);
    assert_eq!(when(watch, &[0.0, 0.02, 0.0, 0.0, 0.02, 0.02]), [0; 0]);
}

#[test]
fn a_rule_watches_its_region_alone() {
    let region = Region {
        min: Vector3::new(3.1, 0.0, 0.0),
        max: Vector3::new(4.9, 2.0, 1.0),
    };
    let mut watch = rule(Measure::Edges(Strain::Elongation), 0.01, Action::Report);
    watch.limits.region = Some(region);
    let mut world = build(bar(8, Rule::WeightedMean, vec![watch]));
    let points = stretched(&rest(&world), 0.5);
    // The cubes whose middles are at x = 3.5 and 4.5 and z = 0.5: numbers 3 and 4 of each row of 8.
    assert_eq!(crossed_cells(&step(&mut world, points)), [3, 4, 11, 12]);
}

#[test]
fn a_point_that_leaps_or_vanishes_crosses_nothing() {
    let watches = [
        neighbours(Strain::Elongation),
        neighbours(Strain::Compression),
        Measure::Edges(Strain::Elongation),
        Measure::Volumes(Strain::Compression),
    ];
    let acts = |measure: Measure| {
        let of_points = matches!(measure, Measure::Points { .. });
        let action = if of_points {
            Action::Report
        } else {
            Action::Open
        };
        rule(measure, 0.1, action)
    };
    let rules = watches.map(acts).to_vec();
    let mut world = build(bar(8, Rule::WeightedMean, rules));
    let rest = rest(&world);
    let mut quiet = |positions: Vec<Vector3<f64>>, hidden: Option<usize>| {
        let mut sample = sample(positions);
        if let Some(point) = hidden {
            sample.seen[point] = false;
            sample.positions[point] = Vector3::new(9.0, 9.0, 9.0);
        }
        let frame = world.step(Some(&sample)).expect("a step");
        assert_eq!(frame.change, None, "step {}", frame.step);
    };
    quiet(rest.clone(), None);
    let mut away = rest.clone();
    away[2] += Vector3::new(0.0, 50.0, 0.0);
    for _ in 0..500 {
        quiet(away.clone(), None);
        away[2].y += 1e-4;
    }
    quiet(rest.clone(), None);
    // Held while the others move on.
    for step in 0..50 {
        let by = Vector3::new(0.0, 0.01 * f64::from(step), 0.0);
        quiet(rest.iter().map(|p| p + by).collect(), Some(2));
    }
}

#[test]
fn a_true_stretch_crosses_after_a_leap_and_its_return() {
    let mut world = build(bar(
        8,
        Rule::WeightedMean,
        vec![rule(neighbours(Strain::Elongation), 0.1, Action::Report)],
    ));
    let rest = rest(&world);
    let mut away = rest.clone();
    away[2].y += 50.0;
    for positions in [rest.clone(), away, rest.clone()] {
        assert_eq!(crossed(&step(&mut world, positions)), 0);
    }
    let slowly = |percent: u32| stretched(&rest, f64::from(percent) / 100.0);
    for percent in 1..10 {
        assert_eq!(crossed(&step(&mut world, slowly(percent))), 0);
    }
    assert_eq!(crossed(&step(&mut world, slowly(11))), 4);
}

#[test]
fn points_that_swap_cross_nothing_however_slow_they_may_be() {
    let measures = [
        neighbours(Strain::Elongation),
        Measure::Edges(Strain::Elongation),
    ];
    let rules = measures
        .map(|measure| rule(measure, 0.1, Action::Report))
        .to_vec();
    let mut world = build(bar(8, Rule::WeightedMean, rules));
    let rest = rest(&world);
    let mut swapped = rest.clone();
    swapped.swap(1, 3);
    for positions in [&rest, &swapped, &swapped, &rest, &rest] {
        assert_eq!(crossed(&step(&mut world, positions.clone())), 0);
    }
    assert!(crossed(&step(&mut world, stretched(&rest, 0.2))) > 0);
}
