//! Simulations that diverge.

use sinew_proto::v1::{Content, Precision, Scene, SessionState, SubscribeRequest};
use sinew_tests::{Refusal, TestServer, TestSession, Watcher, live, refused, scenes};
use tonic::Code;

/// Reads to the error that ends the stream; whatever comes before it is finite, in the precision that it came in.
async fn last_words(watcher: &mut Watcher) -> Refusal {
    loop {
        match watcher.positions().await {
            Err(refusal) => return refusal,
            Ok(None) => panic!("a faulted session says goodbye"),
            Ok(Some(frame)) => {
                for column in [&frame.vertices, &frame.points] {
                    let numbers = column.as_ref().unwrap().unpack().unwrap();
                    assert!(
                        numbers.iter().all(|x| x.is_finite()),
                        "at step {}",
                        frame.step
                    );
                }
            }
        }
    }
}

async fn watch_in(session: &TestSession, precision: Precision) -> Watcher {
    let request = SubscribeRequest {
        precision: precision.into(),
        content: Content::MeshAndPoints.into(),
        ..session.subscription()
    };
    session.subscribe(request).await.unwrap()
}

#[test]
fn a_session_that_diverges_ends_alone_and_never_sends_a_nan() {
    live(async {
        let server = TestServer::start().await;
        let other = server.create("other", scenes::sheet(3)).await;
        let session = server.create("wild", scenes::explosive()).await;
        let warned = session.get().await.unwrap().warnings;
        assert!(warned.iter().any(|w| w.contains("diverge")), "{warned:?}");

        let mut exact = watch_in(&session, Precision::F64).await;
        let mut rounded = watch_in(&session, Precision::F32).await;
        session.run().await.unwrap();
        for watcher in [&mut exact, &mut rounded] {
            let refusal = last_words(watcher).await;
            assert_eq!(
                (refusal.code, refusal.reason.as_str()),
                (Code::Aborted, "SIM_DIVERGED")
            );
        }

        let told = session.get().await.unwrap();
        assert_eq!(told.state(), SessionState::Faulted);
        let fault = told.fault.clone().unwrap();
        assert_eq!(fault.reason, "SIM_DIVERGED");
        // It says at which step.
        assert!(
            fault.message.contains(&(told.step + 1).to_string()),
            "{}",
            fault.message
        );
        assert_eq!(told.step, exact.last().step);

        other.step(10).await.unwrap();
        server.create("new", scenes::small()).await;
    });
}

#[test]
fn a_faulted_session_can_be_read_and_deleted_and_nothing_else() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("wild", scenes::explosive()).await;
        let diverged = |answer| refused(answer, Code::FailedPrecondition, "SIM_DIVERGED");
        diverged(session.step(10_000).await.map(drop));
        let told = session.get().await.unwrap();
        assert_eq!(told.state(), SessionState::Faulted);
        diverged(session.run().await.map(drop));
        diverged(session.pause().await.map(drop));
        diverged(session.step(1).await.map(drop));
        assert_eq!(session.get().await.unwrap(), told);

        // A late reader gets the last good state, and then why there is no more.
        let mut late = session.watch().await;
        assert_eq!(late.keyframe().await.frame.unwrap().step, told.step);
        let refusal = last_words(&mut late).await;
        assert_eq!(
            (refusal.code, refusal.reason.as_str()),
            (Code::Aborted, "SIM_DIVERGED")
        );

        session.delete().await.unwrap();
        assert!(server.names().await.is_empty());
    });
}

#[test]
fn points_that_run_away_while_the_mesh_stands_still_are_a_fault_too() {
    live(async {
        let server = TestServer::start().await;
        let mut scene: Scene = scenes::explosive();
        // Only the fixed row drives the mesh.
        scene.mapping.get_or_insert_default().points = vec!["0".into(), "1".into(), "2".into()];
        let session = server.create("wild", scene).await;
        let mut rounded = watch_in(&session, Precision::F32).await;
        session.run().await.unwrap();
        assert_eq!(last_words(&mut rounded).await.reason, "SIM_DIVERGED");
    });
}
