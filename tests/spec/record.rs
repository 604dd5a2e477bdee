//! What a record holds, and what comes of it when it is replayed.

use sinew_proto::v1::{
    self, EditMeshRequest, UpdateMappingRequest, event::Kind, record_motion_response::Item,
};
use sinew_tests::{TestServer, TestSession, live, scenes};

const POINTS: usize = 12;

/// Bends and stretches, so that the rule tears it in the end.
fn pose(step: u32) -> Vec<[f64; 3]> {
    let by = 0.03 * f64::from(step);
    let stretched = |[x, y, z]: [f64; 3]| [x, y, z + by * z * z];
    scenes::bent(POINTS, 0.3 * by)
        .into_iter()
        .map(stretched)
        .collect()
}

fn scene() -> v1::Scene {
    let rule = r#"[{"measure": {"edges": {}}, "threshold": 0.35, "action": {"open": {}}}]"#;
    let mut scene = scenes::block(POINTS, 3, scenes::Rule::Mean);
    *scenes::mesh(&mut scene) = scenes::grid(&sinew_mesh::shapes::tetrahedra(3, 3, 3));
    v1::Scene {
        rules: serde_json::from_str(rule).unwrap(),
        ..scene
    }
}

fn edits(edits: &str) -> Vec<v1::MeshEdit> {
    serde_json::from_str(edits).unwrap()
}

async fn edit(session: &TestSession, edits: Vec<v1::MeshEdit>) {
    let request = EditMeshRequest {
        edits,
        ..EditMeshRequest::default()
    };
    session.edit(request).await.unwrap();
}

async fn remap(session: &TestSession, mapping: v1::Mapping, blend_seconds: f64) {
    let request = UpdateMappingRequest {
        mapping: Some(mapping),
        blend_seconds,
        ..UpdateMappingRequest::default()
    };
    session.remap(request).await.unwrap();
}

async fn events(server: &TestServer, session: &TestSession) -> Vec<v1::Event> {
    let request = v1::ListEventsRequest {
        session: session.name.clone(),
        page_size: 1000,
        ..v1::ListEventsRequest::default()
    };
    let page = server.meshes().list_events(request).await.unwrap();
    page.into_inner().events
}

/// A session whose mapping and mesh are changed on the way: its digest and its log.
async fn eventful(server: &TestServer, session: &TestSession) -> (String, Vec<v1::Event>) {
    let mut source = session.source().await;
    for step in 1..=30 {
        session.step_to(&mut source, &pose(step)).await;
        match step {
            3 => {
                // Vertex 64 comes to be in the middle of the edge.
                let both = r#"[{"bisect": {"edges": {"values": [21, 22]}}}, {"collapse": {"kept": 64, "drawn": 22}}]"#;
                edit(session, edits(both)).await;
            }
            5 => remap(session, scenes::mapping(scenes::Rule::Rigid), 0.04).await,
            8 => {
                // One is done and one refused.
                let both = r#"[{"remove": {"cells": {"values": [99]}}}, {"remove": {"cells": {"values": [0]}}}]"#;
                edit(session, edits(both)).await;
            }
            12 => remap(session, scenes::mapping(scenes::Rule::Mean), 0.0).await,
            14 => {
                edit(
                    session,
                    edits(r#"[{"subdivide": {"cells": {"values": [13]}}}]"#),
                )
                .await
            }
            _ => {}
        }
    }
    (session.digest().await, events(server, session).await)
}

#[test]
fn a_record_holds_every_input_at_its_step_and_leads_to_the_same_events() {
    live(async {
        let server = TestServer::start().await;
        let first = server.create("first", scene()).await;
        let mut record = first.record().await.unwrap();
        let (digest, log) = eventful(&server, &first).await;
        assert!(
            log.iter().any(|event| event.rule.is_some()),
            "a rule tears it"
        );
        for done in [
            Kind::Divided(v1::Divided {}),
            Kind::Collapsed(v1::Collapsed {}),
        ] {
            assert!(log.iter().any(|event| event.kind.as_ref() == Some(&done)));
        }
        first.delete().await.unwrap();
        let mut items = Vec::new();
        while let Some(message) = record.message().await.unwrap() {
            items.push(message.item.unwrap());
        }
        let kinds = |item: &Item| match item {
            Item::Start(_) => 's',
            Item::Frame(_) => '.',
            Item::Mapping(_) => 'm',
            Item::Edits(_) => 'e',
        };
        let order: String = items.iter().map(kinds).collect();
        assert_eq!(order, "s...e..m...e....m..e................");

        let again = server.create("again", scene()).await;
        let mut source = again.source().await;
        for item in items {
            match item {
                Item::Start(start) => assert_eq!(start.digest, again.digest().await),
                Item::Frame(frame) => {
                    let sequence = frame.sequence;
                    source
                        .send_item(v1::stream_motion_request::Item::Frame(frame))
                        .await;
                    source.acked(sequence).await.unwrap();
                    again.step(1).await.unwrap();
                }
                Item::Mapping(change) => {
                    remap(&again, change.mapping.unwrap(), change.blend_seconds).await;
                }
                Item::Edits(change) => edit(&again, change.edits).await,
            }
        }
        assert_eq!(events(&server, &again).await, log);
        assert_eq!(again.digest().await, digest);
    });
}

#[test]
fn a_record_that_begins_late_holds_only_what_came_after() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("late", scene()).await;
        let mut source = session.source().await;
        session.step_to(&mut source, &pose(1)).await;
        remap(&session, scenes::mapping(scenes::Rule::Rigid), 0.0).await;
        let mut record = session.record().await.unwrap();
        session.step_to(&mut source, &pose(2)).await;
        session.delete().await.unwrap();
        let mut items = Vec::new();
        while let Some(message) = record.message().await.unwrap() {
            items.push(message.item.unwrap());
        }
        assert!(matches!(
            &items[..],
            [Item::Start(v1::RecordStart { step: 1, .. }), Item::Frame(_)]
        ));
    });
}
