//! Bad input: the exact code, the reason, the field to blame; and afterwards everything is as it was.

mod assets;
mod commands;
mod links;
mod meshes;
mod messages;
mod motion;
mod networks;
mod rules;
mod scenes;

use sinew_proto::v1::{CreateSessionRequest, Scene, Session};
use sinew_tests::{Refusal, TestServer, TestSession, live, refused, scenes as posted};
use tonic::Code;

/// A server with one session that no refusal may touch.
struct Witness {
    server: TestServer,
    session: TestSession,
    before: Session,
}

impl Witness {
    /// The session has external motion and has taken a step.
    async fn start() -> Self {
        let server = TestServer::start().await;
        let session = server.create("witness", posted::small()).await;
        session
            .source()
            .await
            .send_and_close(&posted::rest(8))
            .await;
        session.step(1).await.unwrap();
        let before = session.get().await.unwrap();
        Self {
            server,
            session,
            before,
        }
    }

    /// The server still serves, no session was made or lost, and the session is in the state that it was in.
    async fn nothing_changed(&self, after: &str) {
        assert_eq!(
            self.session.get().await.as_ref(),
            Ok(&self.before),
            "after {after}"
        );
        assert_eq!(
            self.server.names().await,
            ["sessions/witness"],
            "after {after}"
        );
    }

    /// Expects a request for a session to be refused, and a dry run of it for the same reason.
    async fn refuses(&self, request: CreateSessionRequest, code: Code, reason: &str) -> Refusal {
        let dry = CreateSessionRequest {
            validate_only: true,
            ..request.clone()
        };
        let refusal = refused(self.server.try_create(request).await, code, reason);
        assert_eq!(
            self.server.try_create(dry).await.err(),
            Some(refusal.clone())
        );
        self.nothing_changed(reason).await;
        refusal
    }

    /// Expects a scene to be refused for the value of a field.
    async fn refuses_scene(&self, scene: Scene, reason: &str, field: &str) {
        let creation = posted::creation(scene);
        let refusal = self.refuses(creation, Code::InvalidArgument, reason).await;
        assert_eq!(refusal.field.as_deref(), Some(field), "{refusal:?}");
        // The message names the field, and says something of it.
        assert!(refusal.message.contains(field), "{refusal:?}");
    }
}

/// A change of a scene, the reason for which it must be refused, and the field to blame.
type Case = (fn(&mut Scene), &'static str, &'static str);

/// Each change of a scene that is accepted as it is must be refused for its reason, at its field.
fn each(scene: fn() -> Scene, cases: &[Case]) {
    live(async {
        let witness = Witness::start().await;
        for (change, reason, field) in cases {
            let mut scene = scene();
            change(&mut scene);
            witness.refuses_scene(scene, reason, field).await;
        }
        witness.server.create("unchanged", scene()).await;
    });
}
