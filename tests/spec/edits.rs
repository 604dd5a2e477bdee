//! Changes of a live mesh that clients ask for.

use sinew_mesh::shapes;
use sinew_proto::v1::{
    EditDone, EditMeshRequest, EditMeshResponse, EditRefused, Indices, Scene,
    edit_outcome::Result as Outcome,
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

/// What was done, or why nothing was.
fn outcomes(answer: &EditMeshResponse) -> Vec<Result<&EditDone, &EditRefused>> {
    let outcomes = answer.outcomes.iter();
    outcomes
        .map(|one| match one.result.as_ref() {
            Some(Outcome::Done(done)) => Ok(done),
            Some(Outcome::Refused(refused)) => Err(refused),
            None => panic!("an outcome says what it is"),
        })
        .collect()
}

/// As [`scene`], of tetrahedra.
fn tetrahedra() -> Scene {
    let mut scene = scene();
    *scenes::mesh(&mut scene) = scenes::grid(&shapes::tetrahedra(3, 3, 3));
    scene
}

#[test]
fn edges_are_halved_and_drawn_together_or_left_with_a_reason() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", tetrahedra()).await;
        // The diagonal of a cube: six tetrahedra around it.
        let halved = edit(&session, r#"[{"bisect": {"edges": {"values": [0, 21]}}}]"#).await;
        let [Ok(done)] = outcomes(&halved)[..] else {
            panic!("{halved:?}")
        };
        assert_eq!((done.first_vertex, done.vertex_count), (64, 1));
        assert_eq!(numbers(done.cells.as_ref()), [0, 1, 2, 3, 4, 5]);
        let patch = halved.patch.as_ref().unwrap();
        let mut parents = numbers(patch.vertex_parents.as_ref());
        parents.sort_unstable();
        assert_eq!(parents, [0, 21]);
        assert_eq!(numbers(patch.cell_parents.as_ref()), [0, 1, 2, 3, 4, 5]);

        let joined = edit(&session, r#"[{"collapse": {"kept": 0, "drawn": 64}}]"#).await;
        let [Ok(done)] = outcomes(&joined)[..] else {
            panic!("{joined:?}")
        };
        assert_eq!(
            (done.vertex_count, numbers(done.cells.as_ref()).len()),
            (0, 6)
        );
        assert_eq!(joined.topology_version, 2);

        let cases = [
            (
                r#"[{"collapse": {"kept": 0, "drawn": 5}}]"#,
                "drawing vertex 5 to vertex 0 would turn 2 cells flat or inside out; draw the other way",
                vec![8, 23],
            ),
            (
                r#"[{"collapse": {"kept": 0, "drawn": 63}}]"#,
                "no edge joins vertices 0 and 63",
                vec![],
            ),
            (
                r#"[{"bisect": {"edges": {"values": [0, 63]}}}]"#,
                "no edge joins vertices 0 and 63",
                vec![],
            ),
        ];
        let before = session.get().await.unwrap();
        for (edits, reason, cells) in cases {
            let answer = edit(&session, edits).await;
            let [Err(why)] = outcomes(&answer)[..] else {
                panic!("{edits}: {answer:?}")
            };
            assert!(why.reason.contains(reason), "{why:?}");
            assert_eq!(numbers(why.cells.as_ref()), cells);
            assert_eq!(answer.patch, None);
        }
        assert_eq!(session.get().await.unwrap(), before);
    });
}

#[test]
fn points_are_separated_only_where_the_mapping_can_show_it() {
    live(async {
        let server = TestServer::start().await;
        let request = r#"[{"separate": {"a": "p0", "b": "p1"}}]"#;
        let session = server.create("", scene()).await;
        let before = session.get().await.unwrap();
        let answer = edit(&session, request).await;
        let [Err(why)] = outcomes(&answer)[..] else {
            panic!("{answer:?}")
        };
        assert!(
            why.reason.contains("use mapping.weighting.flood"),
            "{why:?}"
        );
        assert_eq!(session.get().await.unwrap(), before);

        let mut flooded = scene();
        let flood = r#"{"weighting": {"flood": {}}}"#;
        flooded.mapping = serde_json::from_str(flood).unwrap();
        let session = server.create("", flooded).await;
        let answer = edit(&session, request).await;
        let [Ok(done)] = outcomes(&answer)[..] else {
            panic!("{answer:?}")
        };
        // The areas had whole cells in common; by four points of each vertex instead of eight they have not.
        assert!(done.opened > 0 && done.kept_points == 4, "{done:?}");
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
                r#"[{"bisect": {"edges": {"values": [0]}}}]"#,
                "LENGTH_MISMATCH",
                "edits[0].bisect.edges",
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
