//! A server under test.

use std::net::SocketAddr;

use sinew_proto::v1::{
    self, asset_service_client::AssetServiceClient, mesh_service_client::MeshServiceClient,
    motion_service_client::MotionServiceClient, session_service_client::SessionServiceClient,
};
use sinew_server::{Config, Server, Stopped};
use tonic::transport::{Channel, Endpoint};

use crate::{Refusal, TestSession};

/// A server on a free port of loopback, and a connection to it.
pub struct TestServer {
    server: Server,
    channel: Channel,
}

impl TestServer {
    /// A server with the default settings.
    pub async fn start() -> Self {
        Self::with(|_| {}).await
    }

    /// A server with other settings.
    pub async fn with(adjust: impl FnOnce(&mut Config)) -> Self {
        let mut config = Config {
            listen: SocketAddr::from(([127, 0, 0, 1], 0)),
            ..Config::default()
        };
        adjust(&mut config);
        let server = Server::start(config).await.unwrap();
        let channel = endpoint(server.address()).connect().await.unwrap();
        Self { server, channel }
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }

    /// The connection that the clients here share.
    pub fn channel(&self) -> Channel {
        self.channel.clone()
    }

    /// A connection of its own that takes no more than 64 KiB before its reader does.
    pub async fn narrow_channel(&self) -> Channel {
        endpoint(self.address())
            .initial_stream_window_size(65_535)
            .initial_connection_window_size(65_535)
            .connect()
            .await
            .unwrap()
    }

    /// The generated client of SessionService.
    pub fn sessions(&self) -> SessionServiceClient<Channel> {
        SessionServiceClient::new(self.channel())
    }

    /// The generated client of MeshService.
    pub fn meshes(&self) -> MeshServiceClient<Channel> {
        MeshServiceClient::new(self.channel()).max_decoding_message_size(64 << 20)
    }

    /// The generated client of MotionService.
    pub fn motion(&self) -> MotionServiceClient<Channel> {
        MotionServiceClient::new(self.channel())
    }

    /// The generated client of AssetService.
    pub fn assets(&self) -> AssetServiceClient<Channel> {
        AssetServiceClient::new(self.channel())
    }

    /// Creates a session of a scene.
    pub async fn create(&self, id: &str, scene: v1::Scene) -> TestSession {
        let request = v1::CreateSessionRequest {
            session_id: id.to_owned(),
            scene: Some(scene),
            ..v1::CreateSessionRequest::default()
        };
        self.try_create(request).await.unwrap()
    }

    /// Asks for a session.
    pub async fn try_create(
        &self,
        request: v1::CreateSessionRequest,
    ) -> Result<TestSession, Refusal> {
        let answer = self.sessions().create_session(request).await;
        let session = answer.map_err(Refusal::of)?.into_inner();
        Ok(TestSession::new(session.name, self.channel()))
    }

    /// The session with this id, whether there is one or not.
    pub fn session(&self, id: &str) -> TestSession {
        TestSession::new(format!("sessions/{id}"), self.channel())
    }

    /// The names of all sessions.
    pub async fn names(&self) -> Vec<String> {
        let all = v1::ListSessionsRequest::default();
        let page = self.sessions().list_sessions(all).await.unwrap();
        let sessions = page.into_inner().sessions.into_iter();
        sessions.map(|session| session.name).collect()
    }

    /// Stops the server in order.
    pub async fn shutdown(self) -> Stopped {
        self.server.shutdown().await
    }
}

fn endpoint(address: SocketAddr) -> Endpoint {
    Endpoint::from_shared(format!("http://{address}"))
        .unwrap()
        .tcp_nodelay(true)
}
