//! Changes of a live mesh that clients ask for.

use sinew_proto::v1::{
    EditMeshRequest, EditMeshResponse, Indices, Scene, edit_outcome::Result as Outcome,
};
use sinew_tests::{TestServer, TestSession, live, refused, scenes};
use tonic::Code;

const POINTS: usize = 12;

fn scene() -> Scene {
    scenes::block(POINTS, 3, scenes::Rule::Mean)
}

/// A request as a file has it.
fn edits(edits: &str) -> EditMeshRequest {
    EditMeshRequest {
        edits: serde_json::from_str(edits).unwrap(),
        ..EditMeshRequest::default()
    }
}

async fn edit(session: &TestSession, request: &str) -> EditMeshResponse {
    session.edit(edits(request)).await.unwrap()
}

fn numbers(column: Option<&Indices>) -> Vec<u32> {
    column.unwrap().unpack().unwrap()
}

/// The faces across the middle third of three cubes a side: three cells wide, each with the next along x.
const CUT: &str = r#"[{"open": {"facets": {"values":
    [0, 1, 3, 4, 6, 7, 9, 10, 12, 13, 15, 16, 18, 19, 21, 22, 24, 25]}}}]"#;

#[test]
fn an_edit_answers_with_what_changed_in_ids_with_parents() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", scene()).await;
        let answer = edit(&session, CUT).await;
        let [outcome] = &answer.outcomes[..] else {
            panic!("{answer:?}")
        };
        let Some(Outcome::Done(done)) = &outcome.result else {
            panic!("{outcome:?}")
        };
        // A cross-section of 4 by 4 vertices; 64 were there.
        assert_eq!((done.opened, done.closed), (9, 0));
        assert_eq!((done.first_vertex, done.vertex_count), (64, 16));
        assert_eq!(numbers(done.cells.as_ref()).len(), 18);
        let patch = answer.patch.as_ref().unwrap();
        assert_eq!((patch.from_version, patch.to_version), (0, 1));
        let parents = numbers(patch.vertex_parents.as_ref());
        assert!(parents.len() == 16 && parents.iter().all(|&parent| parent < 64));
        let after = session.get().await.unwrap();
        assert_eq!((after.vertex_count, after.step), (80, 0));
        assert_eq!((answer.topology_version, answer.digest), (1, after.digest));
    });
}

#[test]
fn what_was_opened_closes_again_where_it_is() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", scene()).await;
        edit(&session, CUT).await;
        let answer = edit(
            &session,
            r#"[{"close": {"a": 0, "b": 1, "distance": 1e-9}}]"#,
        )
        .await;
        let Some(Outcome::Done(done)) = &answer.outcomes[0].result else {
            panic!("{answer:?}")
        };
        assert_eq!((done.opened, done.closed), (0, 9));
        assert_eq!(answer.topology_version, 2);
    });
}

#[test]
fn a_refused_edit_changes_nothing_and_the_others_are_done() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", scene()).await;
        let before = session.get().await.unwrap();
        let answer = edit(&session, r#"[{"remove": {"cells": {"values": [99]}}}]"#).await;
        let Some(Outcome::Refused(why)) = &answer.outcomes[0].result else {
            panic!("{answer:?}")
        };
        assert!(why.reason.contains("99"), "{why:?}");
        assert_eq!(answer.patch, None);
        assert_eq!(session.get().await.unwrap(), before);

        let both =
            r#"[{"remove": {"cells": {"values": [99]}}}, {"remove": {"cells": {"values": [0]}}}]"#;
        let answer = edit(&session, both).await;
        let results: Vec<_> = answer.outcomes.iter().map(|o| &o.result).collect();
        assert!(
            matches!(
                results[..],
                [Some(Outcome::Refused(_)), Some(Outcome::Done(_))]
            ),
            "{results:?}"
        );
        assert_eq!(answer.topology_version, 1);
    });
}

#[test]
fn a_log_of_edits_replays() {
    live(async {
        let server = TestServer::start().await;
        let mut digests = Vec::new();
        for name in ["first", "again"] {
            let session = server.create(name, scene()).await;
            let mut source = session.source().await;
            session
                .step_to(&mut source, &scenes::bent(POINTS, 0.1))
                .await;
            edit(&session, CUT).await;
            session
                .step_to(&mut source, &scenes::bent(POINTS, 0.2))
                .await;
            edit(&session, r#"[{"subdivide": {"cells": {"values": [13]}}}]"#).await;
            digests.push(
                session
                    .step_to(&mut source, &scenes::bent(POINTS, 0.3))
                    .await,
            );
        }
        assert_eq!(digests[0], digests[1]);
    });
}

#[test]
fn edits_that_cannot_be() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", scene()).await;
        let before = session.get().await.unwrap();
        let cases = [
            ("[]", "FIELD_MISSING", "edits"),
            ("[{}]", "FIELD_MISSING", "edits[0]"),
            (
                r#"[{"open": {"facets": {"values": [0, 1, 2]}}}]"#,
                "LENGTH_MISMATCH",
                "edits[0].open.facets",
            ),
            (
                r#"[{"separate": {"a": "p0", "b": "elbow"}}]"#,
                "LABEL_UNKNOWN",
                "edits[0].separate.b",
            ),
            (
                r#"[{"close": {"distance": -1}}]"#,
                "VALUE_OUT_OF_RANGE",
                "edits[0].close.distance",
            ),
            (
                r#"[{"add": {"thickness": 0}}]"#,
                "VALUE_OUT_OF_RANGE",
                "edits[0].add.thickness",
            ),
        ];
        for (request, reason, field) in cases {
            let answer = session.edit(edits(request)).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            assert_eq!(refusal.field.as_deref(), Some(field));
        }
        let late = EditMeshRequest {
            expected_topology_version: Some(1),
            ..edits(CUT)
        };
        refused(
            session.edit(late).await,
            Code::Aborted,
            "TOPOLOGY_VERSION_MISMATCH",
        );
        assert_eq!(session.get().await.unwrap(), before);
    });
}
