//! Requests about sessions.

use sinew_proto::v1::{CreateSessionRequest, ListSessionsRequest, SessionState, SubscribeRequest};
use sinew_tests::{Refusal, TestServer, live, refused, scenes as posted};
use tonic::Code;

use super::Witness;

#[test]
fn ids_that_are_none() {
    live(async {
        let witness = Witness::start().await;
        let long = "a".repeat(64);
        for id in [
            "A",
            "1a",
            "-a",
            "a_b",
            "a/b",
            "a b",
            "é",
            "sessions/a",
            "a.b",
            &long,
        ] {
            let request = CreateSessionRequest {
                session_id: id.to_owned(),
                ..posted::creation(posted::small())
            };
            let refusal = witness
                .refuses(request, Code::InvalidArgument, "ID_INVALID")
                .await;
            assert_eq!(refusal.field.as_deref(), Some("session_id"), "{id}");
        }
        let request = CreateSessionRequest {
            request_id: "r".repeat(129),
            ..posted::creation(posted::small())
        };
        let refusal = witness
            .refuses(request, Code::InvalidArgument, "REQUEST_ID_TOO_LONG")
            .await;
        assert_eq!(refusal.field.as_deref(), Some("request_id"));
    });
}

#[test]
fn a_duplicate_id() {
    live(async {
        let witness = Witness::start().await;
        let request = CreateSessionRequest {
            session_id: "witness".to_owned(),
            ..posted::creation(posted::small())
        };
        refused(
            witness.server.try_create(request).await,
            Code::AlreadyExists,
            "SESSION_EXISTS",
        );
        witness.nothing_changed("a duplicate id").await;
    });
}

#[test]
fn a_step_while_running() {
    live(async {
        let server = TestServer::start().await;
        // External motion: it runs, and without frames it stands still.
        let session = server.create("tissue", posted::small()).await;
        let before = session.run().await.unwrap();
        refused(
            session.step(1).await,
            Code::FailedPrecondition,
            "SESSION_RUNNING",
        );
        assert_eq!(session.get().await.unwrap(), before);
        assert_eq!(before.state(), SessionState::Running);
    });
}

#[test]
fn a_stale_expected_step() {
    live(async {
        let witness = Witness::start().await;
        for stale in [0, 2, u64::MAX] {
            let answer = witness.session.step_from(1, Some(stale)).await;
            refused(answer, Code::Aborted, "STEP_MISMATCH");
            witness.nothing_changed("a stale step").await;
        }
    });
}

#[test]
fn more_steps_than_one_request_may_ask_for() {
    live(async {
        let witness = Witness::start().await;
        for steps in [10_001, u32::MAX] {
            let answer = witness.session.step(steps).await;
            let refusal = refused(answer, Code::InvalidArgument, "VALUE_OUT_OF_RANGE");
            assert_eq!(refusal.field.as_deref(), Some("steps"));
            witness.nothing_changed("too many steps").await;
        }
    });
}

#[test]
fn forged_page_tokens_and_sizes_below_nothing() {
    live(async {
        let witness = Witness::start().await;
        let list = async |page_size, token: &str| {
            let request = ListSessionsRequest {
                page_size,
                page_token: token.to_owned(),
            };
            let answer = witness.server.sessions().list_sessions(request).await;
            answer.map_err(Refusal::of)
        };
        // The last is the token of `sessions/a` with its hash put to zero.
        let nothing = "MDAwMDAwMDAwMDAwMDAwMHNlc3Npb25zL2E";
        for token in ["x", "sessions/a", "c2Vzc2lvbnMvYQ", "////", "é", nothing] {
            let refusal = refused(
                list(1, token).await,
                Code::InvalidArgument,
                "PAGE_TOKEN_FORGED",
            );
            assert_eq!(refusal.field.as_deref(), Some("page_token"), "{token}");
        }
        let refusal = refused(
            list(-1, "").await,
            Code::InvalidArgument,
            "VALUE_OUT_OF_RANGE",
        );
        assert_eq!(refusal.field.as_deref(), Some("page_size"));
        witness.nothing_changed("a forged page token").await;
    });
}

#[test]
fn subscriptions_that_cannot_be_served() {
    type Case = (fn(&mut SubscribeRequest), &'static str, &'static str);
    let cases: [Case; 7] = [
        (|s| s.content = 99, "ENUM_UNKNOWN", "content"),
        (|s| s.precision = 99, "ENUM_UNKNOWN", "precision"),
        (
            |s| s.keyframe_interval_seconds = 0.5,
            "VALUE_OUT_OF_RANGE",
            "keyframe_interval_seconds",
        ),
        (
            |s| s.keyframe_interval_seconds = -1.0,
            "VALUE_OUT_OF_RANGE",
            "keyframe_interval_seconds",
        ),
        (
            |s| s.keyframe_interval_seconds = f64::NAN,
            "VALUE_OUT_OF_RANGE",
            "keyframe_interval_seconds",
        ),
        (
            |s| s.keyframe_interval_seconds = f64::INFINITY,
            "VALUE_OUT_OF_RANGE",
            "keyframe_interval_seconds",
        ),
        (
            |s| s.max_message_bytes = 65_535,
            "VALUE_OUT_OF_RANGE",
            "max_message_bytes",
        ),
    ];
    live(async {
        let witness = Witness::start().await;
        for (change, reason, field) in cases {
            let mut request = witness.session.subscription();
            change(&mut request);
            let answer = witness.session.subscribe(request).await;
            let refusal = refused(answer.map(drop), Code::InvalidArgument, reason);
            assert_eq!(refusal.field.as_deref(), Some(field));
            witness.nothing_changed(field).await;
        }
    });
}
