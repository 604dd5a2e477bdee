//! Meshes that grow together where what came apart meets again.

use std::sync::Arc;

use sinew_engine::{
    Action, Effect, EventKind, Frame, Limits, Measure, Rule, Scene, SceneError, Strain,
    TopologyRule, World,
};

use crate::common::{bar, build, paths, rest, rule, step, stretched};

/// The faces of the bar of 8 at x = 5, midway between two points: four rows.
fn seam() -> Vec<[u32; 2]> {
    (0..4).map(|row| [8 * row + 4, 8 * row + 5]).collect()
}

/// Cuts the bar in two where it is stretched by half.
fn cut() -> TopologyRule {
    TopologyRule {
        limits: Limits {
            seam: seam(),
            ..Limits::default()
        },
        ..rule(Measure::Edges(Strain::Elongation), 0.5, Action::Open)
    }
}

/// Glues what meets again to 5 cm, having been apart by 30 cm.
fn glue() -> TopologyRule {
    TopologyRule {
        hysteresis: 0.25,
        ..rule(Measure::Gaps, 0.05, Action::Glue)
    }
}

/// A bar of which each vertex follows the point that is nearest along paths over the mesh: on the two sides of a tear
/// these are others.
fn scene(rules: Vec<TopologyRule>) -> Scene {
    let mut scene = bar(8, Rule::Direct, rules);
    scene.mapping.recipe.weighting.metric = paths();
    scene
}

/// The frames of a bar whose points stretch it by these parts, one after the other.
fn pulled(rules: Vec<TopologyRule>, stretches: &[f64]) -> Vec<Arc<Frame>> {
    let mut world = build(scene(rules));
    let rest = rest(&world);
    let frames = stretches
        .iter()
        .map(|&e| step(&mut world, stretched(&rest, e)));
    frames.collect()
}

/// What happened at each step, crossings aside.
fn kinds(frames: &[Arc<Frame>]) -> Vec<Vec<EventKind>> {
    let of = |frame: &Arc<Frame>| {
        let events = frame.change.iter().flat_map(|change| &change.events);
        let kinds = events.map(|event| event.kind.clone());
        kinds
            .filter(|kind| !matches!(kind, EventKind::Crossed { .. }))
            .collect()
    };
    frames.iter().map(of).collect()
}

#[test]
fn what_came_apart_is_glued_where_it_meets_again() {
    let frames = pulled(vec![cut(), glue()], &[0.0, 1.0, 0.8, 0.01, 0.0]);
    let torn = vec![
        EventKind::Torn { faces: 4 },
        EventKind::Followed(Effect::FragmentBorn {
            fragment: 1,
            parent: 0,
            cells: 12,
        }),
    ];
    let glued = vec![
        EventKind::Glued { faces: 4 },
        EventKind::Followed(Effect::FragmentsJoined {
            fragment: 0,
            absorbed: 1,
        }),
    ];
    assert_eq!(kinds(&frames), [vec![], torn, vec![], glued, vec![]]);
    let [first, last] = [&frames[0], &frames[4]].map(|frame| &frame.layout.cells);
    assert_eq!(first.len(), last.len());
    // Nine vertices were doubled, and are one again.
    let used = |frame: &Frame| {
        let mut used = frame.layout.cells.connectivity.clone();
        used.sort_unstable();
        used.dedup();
        used.len()
    };
    assert_eq!(used(&frames[1]), used(&frames[0]) + 9);
    assert_eq!(used(&frames[4]), used(&frames[0]));
    // The rule's measure is the gap while there is one that may close.
    let gap = |frame: &Frame| {
        let of_rule = frame.measures.iter().find(|measured| measured.rule == 1);
        of_rule.map(|measured| measured.greatest)
    };
    assert_eq!(gap(&frames[1]), None);
    assert!(gap(&frames[2]).is_some_and(|gap| gap > 0.05));
}

#[test]
fn what_has_just_come_apart_is_not_glued_at_once() {
    // The points stay so near that the two sides never part by more than 30 cm: at most 2 m × e.
    let gentle = TopologyRule {
        threshold: 0.01,
        ..cut()
    };
    let stretches = [0.0, 0.1, 0.12, 0.0, 0.02, 0.1, 0.0];
    let frames = pulled(vec![gentle, glue()], &stretches);
    let all: Vec<EventKind> = kinds(&frames).concat();
    let is_glued = |kind: &EventKind| matches!(kind, EventKind::Glued { .. });
    let is_torn = |kind: &EventKind| matches!(kind, EventKind::Torn { .. });
    assert!(all.iter().any(is_torn));
    assert!(!all.iter().any(is_glued));
}

#[test]
fn a_bar_tears_and_heals_as_often_as_it_is_pulled() {
    let stretches: Vec<f64> = (0..5).flat_map(|_| [1.0, 0.8, 0.0]).collect();
    let frames = pulled(vec![cut(), glue()], &stretches);
    let all: Vec<EventKind> = kinds(&frames).concat();
    let count = |wanted: &EventKind| all.iter().filter(|kind| *kind == wanted).count();
    assert_eq!(count(&EventKind::Torn { faces: 4 }), 5);
    assert_eq!(count(&EventKind::Glued { faces: 4 }), 5);
}

#[test]
fn gaps_are_glued_or_reported_and_nothing_else_is_glued() {
    let refusal = |rule: TopologyRule| -> SceneError {
        World::build(scene(vec![rule])).expect_err("it means nothing")
    };
    for wrong in [
        rule(Measure::Gaps, 0.1, Action::Open),
        rule(Measure::Gaps, 0.1, Action::Separate),
        rule(Measure::Edges(Strain::Elongation), 0.1, Action::Glue),
    ] {
        assert_eq!(refusal(wrong).field, "scene.rules[0].action");
    }
    let endless = TopologyRule {
        hysteresis: f64::INFINITY,
        ..glue()
    };
    assert_eq!(refusal(endless).field, "scene.rules[0].hysteresis");
    assert!(
        World::build(bar(
            8,
            Rule::Direct,
            vec![rule(Measure::Gaps, 0.1, Action::Report)]
        ))
        .is_ok()
    );
}
