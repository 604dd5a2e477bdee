//! Meshes that come apart by the rules of their scenes, as clients meet them.

use sinew_proto::v1::{
    ListEventsRequest, Mapping, MotionRule, Scene, UpdateMappingRequest, event::Kind, motion_rule,
};
use sinew_tests::{TestServer, live, scenes};

use crate::determinism::same_on_any_number_of_threads;

const POINTS: usize = 12;

/// Cubes in the unit cube, which open around whatever is stretched by a fifth.
fn brittle(cubes: usize) -> Scene {
    brittle_within(scenes::block(POINTS, cubes, scenes::Rule::Mean))
}

pub(crate) fn brittle_within(scene: Scene) -> Scene {
    let rule = r#"[{"measure": {"edges": {}}, "threshold": 0.2, "action": {"open": {}}}]"#;
    Scene {
        rules: serde_json::from_str(rule).unwrap(),
        ..scene
    }
}

/// Points pulled apart along z, m.
fn pulled(by: f64) -> Vec<[f64; 3]> {
    let pull = |[x, y, z]: [f64; 3]| [x, y, z + by * z];
    scenes::rest(POINTS).into_iter().map(pull).collect()
}

#[test]
fn a_recording_tears_a_scene_alike_on_any_number_of_threads() {
    same_on_any_number_of_threads(async |server| {
        let session = server.create("tissue", brittle(8)).await;
        let mut source = session.source().await;
        let mut digests = vec![session.digest().await];
        for n in 1..=12 {
            digests.push(
                session
                    .step_to(&mut source, &pulled(0.05 * f64::from(n)))
                    .await,
            );
        }
        let torn = session.get().await.unwrap();
        assert!(torn.vertex_count > 9 * 9 * 9, "it tears");
        digests
    });
}

/// Paper 000, figure 12: a surface that borders a filled volume.
#[test]
fn a_filled_surface_tears_like_the_volume_that_it_borders() {
    live(async {
        let server = TestServer::start().await;
        let mut torn = Vec::new();
        for scene in [
            brittle(4),
            brittle_within(scenes::filled(POINTS, 4, scenes::Rule::Mean)),
        ] {
            let session = server.create("", scene).await;
            let mut source = session.source().await;
            for n in 1..=12 {
                session
                    .step_to(&mut source, &pulled(0.05 * f64::from(n)))
                    .await;
            }
            let session = session.get().await.unwrap();
            torn.push((session.vertex_count, session.cell_count));
        }
        assert_eq!(torn[0], torn[1]);
        assert!(torn[0].0 > 125 && torn[0].1 == 64, "{torn:?}");
    });
}

#[test]
fn the_same_tears_and_glues_are_logged_on_any_number_of_threads() {
    let rules = r#"[
        {"measure": {"edges": {}}, "threshold": 0.2, "hysteresis": 0.1, "action": {"open": {}}},
        {"measure": {"gaps": {}}, "threshold": 0.01, "hysteresis": 0.05, "action": {"glue": {}}}
    ]"#;
    let mapping = r#"{
        "weighting": {"flood": {"length": {}}}, "filter": {"keep": {"k": 1}}, "rule": {"direct": {}}
    }"#;
    let scene = Scene {
        rules: serde_json::from_str(rules).unwrap(),
        mapping: serde_json::from_str(mapping).unwrap(),
        ..brittle(8)
    };
    same_on_any_number_of_threads(async |server| {
        let session = server.create("tissue", scene.clone()).await;
        let mut source = session.source().await;
        let mut facts = vec![session.digest().await];
        for by in [0.1, 0.2, 0.4, 0.6, 0.5, 0.3, 0.1, 0.0, 0.3, 0.01] {
            facts.push(session.step_to(&mut source, &pulled(by)).await);
        }
        let request = ListEventsRequest {
            session: session.get().await.unwrap().name,
            after_event: Some(0),
            page_size: 1000,
            ..ListEventsRequest::default()
        };
        let page = server.meshes().list_events(request).await.unwrap();
        let events = page.into_inner().events;
        let count = |is: fn(&Kind) -> bool| {
            let kinds = events.iter().filter_map(|event| event.kind.as_ref());
            kinds.filter(|kind| is(kind)).count()
        };
        assert!(count(|kind| matches!(kind, Kind::Torn(_))) > 0);
        assert!(count(|kind| matches!(kind, Kind::Glued(_))) > 0);
        facts.push(format!("{events:?}"));
        facts
    });
}

#[test]
fn a_scene_without_rules_never_tears() {
    live(async {
        let server = TestServer::start().await;
        let mut scene = brittle(3);
        scene.rules.clear();
        let session = server.create("", scene).await;
        let mut source = session.source().await;
        for n in 1..=12 {
            session
                .step_to(&mut source, &pulled(0.2 * f64::from(n)))
                .await;
        }
        assert_eq!(session.get().await.unwrap().vertex_count, 64);
    });
}

#[test]
fn a_torn_mesh_can_be_mapped_anew_and_explained() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", brittle(3)).await;
        let mut source = session.source().await;
        for n in 1..=10 {
            session
                .step_to(&mut source, &pulled(0.05 * f64::from(n)))
                .await;
        }
        let vertices = session.get().await.unwrap().vertex_count;
        assert!(vertices > 64, "it tears");
        let direct = motion_rule::Kind::Direct(Default::default());
        let update = UpdateMappingRequest {
            mapping: Some(Mapping {
                rule: Some(MotionRule { kind: Some(direct) }),
                ..Mapping::default()
            }),
            ..UpdateMappingRequest::default()
        };
        session.remap(update).await.unwrap();
        session.step_to(&mut source, &pulled(0.5)).await;
        let newest = session.explain(vertices - 1).await.unwrap();
        assert_eq!((newest.rule.as_str(), newest.points.len()), ("direct", 1));
        assert!(newest.topology_step.is_some(), "{newest:?}");
    });
}
