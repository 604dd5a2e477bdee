//! What can be done to a session, and what that leaves.

use sinew_proto::v1::{self, GoodbyeReason, SessionState};
use sinew_tests::{Refusal, TestServer, TestSession, live, refused, scenes, scenes::Rule};
use tonic::Code;

async fn state(session: &TestSession) -> SessionState {
    session.get().await.unwrap().state()
}

#[test]
fn a_new_session_waits_at_step_0_and_says_what_it_holds() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let told = session.get().await.unwrap();
        assert_eq!(told.name, "sessions/tissue");
        assert_eq!(told.state(), SessionState::Paused);
        assert_eq!((told.step, told.time_seconds), (0, 0.0));
        assert_eq!(
            (told.point_count, told.vertex_count, told.cell_count),
            (8, 27, 8)
        );
        assert_eq!(told.title, scenes::small().title);
        assert_eq!(told.time_step_seconds, 0.01); // of a motion of 100 Hz
        assert!(told.external_motion && told.fault.is_none());
        assert!(
            told.create_time
                .is_some_and(|time| time.seconds > 1_700_000_000)
        );
        let hexadecimal = |b: u8| matches!(b, b'0'..=b'9' | b'a'..=b'f');
        assert!(told.digest.len() == 32 && told.digest.bytes().all(hexadecimal));
    });
}

#[test]
fn ids_that_the_server_makes_are_valid_and_differ() {
    live(async {
        let server = TestServer::start().await;
        let first = server.create("", scenes::small()).await;
        let second = server.create("", scenes::small()).await;
        assert_ne!(first.name, second.name);
        for session in [first, second] {
            let id = session.name.strip_prefix("sessions/").unwrap();
            assert!(
                id.len() <= 63 && id.starts_with(|c: char| c.is_ascii_lowercase()),
                "{id}"
            );
            let tail = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
            assert!(id.bytes().all(tail), "{id}");
            assert_eq!(session.get().await.unwrap().name, session.name);
        }
    });
}

#[test]
fn sessions_are_listed_in_the_order_of_their_names_page_by_page() {
    live(async {
        let server = TestServer::start().await;
        for id in ["e", "a", "d", "b", "c"] {
            server.create(id, scenes::small()).await;
        }
        let mut request = v1::ListSessionsRequest {
            page_size: 2,
            ..v1::ListSessionsRequest::default()
        };
        let mut pages = Vec::new();
        loop {
            let page = server
                .sessions()
                .list_sessions(request.clone())
                .await
                .unwrap()
                .into_inner();
            pages.push(
                page.sessions
                    .into_iter()
                    .map(|s| s.name)
                    .collect::<Vec<_>>(),
            );
            if page.next_page_token.is_empty() {
                break;
            }
            request.page_token = page.next_page_token;
        }
        let expected = [
            vec!["sessions/a", "sessions/b"],
            vec!["sessions/c", "sessions/d"],
            vec!["sessions/e"],
        ];
        assert_eq!(pages, expected);
    });
}

#[test]
fn a_page_that_holds_exactly_the_rest_is_the_last() {
    live(async {
        let server = TestServer::start().await;
        for id in ["a", "b"] {
            server.create(id, scenes::small()).await;
        }
        let request = v1::ListSessionsRequest {
            page_size: 2,
            ..v1::ListSessionsRequest::default()
        };
        let page = server
            .sessions()
            .list_sessions(request)
            .await
            .unwrap()
            .into_inner();
        assert_eq!(
            (page.sessions.len(), page.next_page_token.as_str()),
            (2, "")
        );
    });
}

#[test]
fn a_session_steps_when_asked_runs_when_told_and_stops_at_a_pause() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let stepped = session.step(3).await.unwrap();
        assert_eq!((stepped.step, stepped.time_seconds), (3, 0.003));
        assert_eq!(stepped.digest, session.digest().await);

        let mut watcher = session.watch().await;
        assert_eq!(session.run().await.unwrap().state(), SessionState::Running);
        watcher.until(50).await;
        assert_eq!(state(&session).await, SessionState::Running);

        let paused = session.pause().await.unwrap();
        assert_eq!(paused.state(), SessionState::Paused);
        let again = session.get().await.unwrap();
        assert_eq!((again.step, again.digest), (paused.step, paused.digest));
        assert_eq!(session.step(1).await.unwrap().step, paused.step + 1);
    });
}

#[test]
fn to_run_what_runs_and_to_pause_what_is_paused_is_no_error() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        session.pause().await.unwrap();
        session.run().await.unwrap();
        session.run().await.unwrap();
        assert_eq!(state(&session).await, SessionState::Running);
    });
}

#[test]
fn a_session_in_real_time_runs_too() {
    live(async {
        let server = TestServer::start().await;
        let mut scene = scenes::sheet(3);
        scene.pace = v1::Pace::RealTime.into();
        let session = server.create("sheet", scene).await;
        session.run().await.unwrap();
        session.watch().await.until(5).await;
    });
}

#[test]
fn a_session_can_be_created_running() {
    live(async {
        let server = TestServer::start().await;
        let request = v1::CreateSessionRequest {
            run: true,
            ..scenes::creation(scenes::sheet(3))
        };
        let session = server.try_create(request).await.unwrap();
        session.watch().await.until(20).await;
        assert_eq!(state(&session).await, SessionState::Running);
    });
}

#[test]
fn a_step_repeated_with_its_expected_step_is_taken_once() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let first = session.step_from(5, Some(0)).await.unwrap();
        assert_eq!(first.step, 5);
        for stale in [0, 4, 6] {
            let repeat = session.step_from(5, Some(stale)).await;
            refused(repeat, Code::Aborted, "STEP_MISMATCH");
            let told = session.get().await.unwrap();
            assert_eq!((told.step, &told.digest), (5, &first.digest));
        }
        assert_eq!(session.step_from(5, Some(5)).await.unwrap().step, 10);
    });
}

#[test]
fn of_many_equal_steps_asked_for_at_once_one_is_taken() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let ask = || {
            let session = session.clone();
            tokio::spawn(async move { session.step_from(1, Some(0)).await })
        };
        let asked: Vec<_> = (0..8).map(|_| ask()).collect();
        let mut taken = 0;
        for answer in asked {
            match answer.await.unwrap() {
                Ok(stepped) => taken += stepped.step,
                Err(refusal) => assert_eq!(refusal.reason, "STEP_MISMATCH"),
            }
        }
        assert_eq!((taken, session.get().await.unwrap().step), (1, 1));
    });
}

#[test]
fn one_step_at_a_time_and_many_at_once_lead_to_the_same_state() {
    live(async {
        let server = TestServer::start().await;
        let one = server.create("one", scenes::sheet(4)).await;
        let many = server.create("many", scenes::sheet(4)).await;
        for _ in 0..20 {
            one.step(1).await.unwrap();
        }
        let stepped = many.step(20).await.unwrap();
        assert_eq!(one.digest().await, stepped.digest);
    });
}

#[test]
fn a_creation_repeated_with_its_request_id_makes_no_second_session() {
    live(async {
        let server = TestServer::start().await;
        let request = v1::CreateSessionRequest {
            request_id: "f1d2".to_owned(),
            ..scenes::creation(scenes::sheet(3))
        };
        let first = server.try_create(request.clone()).await.unwrap();
        let stepped = first.step(4).await.unwrap();
        let second = server.try_create(request.clone()).await.unwrap();
        assert_eq!(second.name, first.name);
        assert_eq!(second.digest().await, stepped.digest);
        assert_eq!(server.names().await.len(), 1);

        let other = v1::CreateSessionRequest {
            scene: Some(scenes::sheet(4)),
            ..request.clone()
        };
        let answer = server.try_create(other).await;
        refused(answer, Code::AlreadyExists, "REQUEST_ID_REUSED");
        assert_eq!(server.names().await, [first.name.as_str()]);

        // Within the life of the session: afterwards the request is a new one.
        first.delete().await.unwrap();
        let reborn = server.try_create(request).await.unwrap();
        assert_eq!(reborn.get().await.unwrap().step, 0);
    });
}

#[test]
fn of_many_equal_creations_at_once_one_session_comes() {
    live(async {
        let server = TestServer::start().await;
        let request = v1::CreateSessionRequest {
            request_id: "f1d2".to_owned(),
            ..scenes::creation(scenes::block(40, 10, Rule::Rigid))
        };
        let ask = || {
            let (mut client, request) = (server.sessions(), request.clone());
            tokio::spawn(async move { client.create_session(request).await })
        };
        let asked: Vec<_> = (0..8).map(|_| ask()).collect();
        let mut names = Vec::new();
        for answer in asked {
            match answer.await.unwrap() {
                Ok(session) => names.push(session.into_inner().name),
                Err(status) => {
                    let refusal = Refusal::of(status);
                    assert_eq!(refusal.code, Code::Aborted, "{refusal:?}"); // that is, try again
                    assert_eq!(refusal.reason, "SESSION_BEING_CREATED");
                }
            }
        }
        names.dedup();
        assert_eq!(names, server.names().await);
    });
}

#[test]
fn an_id_that_is_taken_is_refused_until_its_session_is_deleted() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("only", scenes::sheet(3)).await;
        let stepped = session.step(2).await.unwrap();
        let twin = v1::CreateSessionRequest {
            session_id: "only".to_owned(),
            ..scenes::creation(scenes::small())
        };
        let answer = server.try_create(twin.clone()).await;
        refused(answer, Code::AlreadyExists, "SESSION_EXISTS");
        assert_eq!(session.digest().await, stepped.digest);
        session.delete().await.unwrap();
        server.try_create(twin).await.unwrap();
    });
}

#[test]
fn a_validated_scene_is_checked_and_nothing_is_made() {
    live(async {
        let server = TestServer::start().await;
        let request = v1::CreateSessionRequest {
            session_id: "draft".to_owned(),
            validate_only: true,
            ..scenes::creation(scenes::small())
        };
        let told = server
            .sessions()
            .create_session(request.clone())
            .await
            .unwrap()
            .into_inner();
        assert_eq!(
            (told.point_count, told.vertex_count, told.cell_count),
            (8, 27, 8)
        );
        assert!(server.names().await.is_empty());
        refused(
            server.session("draft").get().await,
            Code::NotFound,
            "SESSION_UNKNOWN",
        );

        let session = server.create("draft", scenes::small()).await;
        assert_eq!(session.digest().await, told.digest);

        let mut wrong = request;
        scenes::points(wrong.scene.as_mut().unwrap()).rate_hz = -1.0;
        let answer = server.try_create(wrong).await;
        refused(answer, Code::InvalidArgument, "VALUE_OUT_OF_RANGE");
    });
}

#[test]
fn subscribers_of_a_deleted_session_get_its_last_frame_and_a_goodbye() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let mut watchers = [session.watch().await, session.watch().await];
        let stepped = session.step(1).await.unwrap();
        session.delete().await.unwrap();
        for watcher in &mut watchers {
            let goodbye = watcher.goodbye().await;
            assert_eq!(goodbye.reason(), GoodbyeReason::Deleted);
            let last = watcher.last();
            assert_eq!(
                (last.step, last.sequence),
                (stepped.step, goodbye.last_sequence)
            );
        }
        refused(session.get().await, Code::NotFound, "SESSION_UNKNOWN");
        assert!(server.names().await.is_empty());
    });
}

#[test]
fn the_last_frame_of_a_running_session_comes_before_its_goodbye() {
    live(async {
        let server = TestServer::start().await;
        // A race between the step under way and the goodbye: once proves nothing.
        for _ in 0..20 {
            let session = server.create("sheet", scenes::sheet(8)).await;
            let mut watcher = session.watch().await;
            session.run().await.unwrap();
            watcher.until(5).await;
            session.delete().await.unwrap();
            let goodbye = watcher.goodbye().await;
            assert_eq!(watcher.last().sequence, goodbye.last_sequence);
        }
    });
}

#[test]
fn a_step_that_is_answered_was_shown_even_where_the_session_is_deleted_meanwhile() {
    live(async {
        let server = TestServer::start().await;
        for _ in 0..10 {
            let session = server.create("sheet", scenes::sheet(16)).await;
            let mut watcher = session.watch().await;
            let stepper = session.clone();
            let stepping = tokio::spawn(async move { stepper.step(10_000).await });
            watcher.until(3).await;
            session.delete().await.unwrap();
            let goodbye = watcher.goodbye().await;
            let stepped = stepping.await.unwrap().unwrap();
            assert_eq!(watcher.last().step, stepped.step);
            assert_eq!(watcher.last().sequence, goodbye.last_sequence);
        }
    });
}

#[test]
fn an_unknown_session_is_not_found_by_any_method() {
    live(async {
        let server = TestServer::start().await;
        server.create("known", scenes::small()).await;
        for name in [
            "sessions/nobody",
            "known",
            "",
            "sessions/known/",
            "SESSIONS/known",
        ] {
            let mut session = server.session("");
            session.name = name.to_owned();
            let unknown = |answer| refused(answer, Code::NotFound, "SESSION_UNKNOWN");
            unknown(session.get().await.map(drop));
            unknown(session.run().await.map(drop));
            unknown(session.pause().await.map(drop));
            unknown(session.step(1).await.map(drop));
            unknown(session.delete().await);
            unknown(session.subscribe(session.subscription()).await.map(drop));
            unknown(session.source_in_order(&[]).await.map(drop));
        }
    });
}

#[test]
fn a_full_server_refuses_a_session_and_takes_one_when_another_is_gone() {
    live(async {
        let server = TestServer::with(|config| config.max_sessions = 2).await;
        let first = server.create("first", scenes::small()).await;
        server.create("second", scenes::small()).await;
        let third = scenes::creation(scenes::small());
        let answer = server.try_create(third.clone()).await;
        refused(answer, Code::ResourceExhausted, "TOO_MANY_SESSIONS");
        first.delete().await.unwrap();
        server.try_create(third).await.unwrap();
    });
}

#[test]
fn a_scene_that_is_refused_leaves_its_id_free() {
    live(async {
        let server = TestServer::with(|config| config.max_sessions = 1).await;
        let mut scene = scenes::small();
        scene.mapping.as_mut().unwrap().points = vec!["nobody".to_owned()];
        let request = v1::CreateSessionRequest {
            session_id: "mine".to_owned(),
            ..scenes::creation(scene)
        };
        let answer = server.try_create(request).await;
        refused(answer, Code::InvalidArgument, "LABEL_UNKNOWN");
        server.create("mine", scenes::small()).await;
    });
}
