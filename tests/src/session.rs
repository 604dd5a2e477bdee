//! One session, through the generated clients.

use sinew_proto::v1::stream_motion_request::Item as Asked;
use sinew_proto::v1::{self, Content, Precision};
use sinew_proto::v1::{
    mesh_service_client::MeshServiceClient, motion_service_client::MotionServiceClient,
    session_service_client::SessionServiceClient,
};
use tonic::transport::Channel;

use crate::{Refusal, Source, Watcher};

/// A session's name and a way to the server.
#[derive(Clone)]
pub struct TestSession {
    /// `sessions/{id}`.
    pub name: String,
    channel: Channel,
}

impl TestSession {
    pub(crate) fn new(name: String, channel: Channel) -> Self {
        Self { name, channel }
    }

    fn sessions(&self) -> SessionServiceClient<Channel> {
        SessionServiceClient::new(self.channel.clone())
    }

    /// What the server says of it.
    pub async fn get(&self) -> Result<v1::Session, Refusal> {
        let name = self.name.clone();
        let request = v1::GetSessionRequest { name };
        let answer = self.sessions().get_session(request).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// The digest of its state.
    pub async fn digest(&self) -> String {
        self.get().await.unwrap().digest
    }

    /// Lets it run.
    pub async fn run(&self) -> Result<v1::Session, Refusal> {
        let name = self.name.clone();
        let answer = self.sessions().run(v1::RunRequest { name }).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Stops it.
    pub async fn pause(&self) -> Result<v1::Session, Refusal> {
        let name = self.name.clone();
        let answer = self.sessions().pause(v1::PauseRequest { name }).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Takes steps.
    pub async fn step(&self, steps: u32) -> Result<v1::StepResponse, Refusal> {
        self.step_from(steps, None).await
    }

    /// Takes steps if the session is where it is thought to be.
    pub async fn step_from(
        &self,
        steps: u32,
        expected_step: Option<u64>,
    ) -> Result<v1::StepResponse, Refusal> {
        let name = self.name.clone();
        let request = v1::StepRequest {
            name,
            steps,
            expected_step,
        };
        let answer = self.sessions().step(request).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Takes one step to this pose of its points; the state's digest.
    pub async fn step_to(&self, source: &mut Source, pose: &[[f64; 3]]) -> String {
        let sequence = source.send(pose).await;
        source.acked(sequence).await.unwrap();
        self.step(1).await.unwrap().digest
    }

    /// Changes its mapping; the request's name is filled in.
    pub async fn remap(&self, request: v1::UpdateMappingRequest) -> Result<v1::Session, Refusal> {
        let name = self.name.clone();
        let request = v1::UpdateMappingRequest { name, ..request };
        let answer = self.sessions().update_mapping(request).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Changes its mesh; the request's name is filled in.
    pub async fn edit(
        &self,
        request: v1::EditMeshRequest,
    ) -> Result<v1::EditMeshResponse, Refusal> {
        let name = self.name.clone();
        let request = v1::EditMeshRequest { name, ..request };
        let answer = self.sessions().edit_mesh(request).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Why a vertex is where it is.
    pub async fn explain(&self, vertex: u32) -> Result<v1::Explanation, Refusal> {
        let name = self.name.clone();
        let request = v1::ExplainRequest { name, vertex };
        let answer = self.sessions().explain(request).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Reads modules; the request's name is filled in.
    pub async fn read_modules(
        &self,
        request: v1::ReadModulesRequest,
    ) -> Result<v1::Modules, Refusal> {
        let name = self.name.clone();
        let request = v1::ReadModulesRequest { name, ..request };
        let answer = self.sessions().read_modules(request).await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }

    /// Ends it.
    pub async fn delete(&self) -> Result<(), Refusal> {
        let name = self.name.clone();
        let request = v1::DeleteSessionRequest { name };
        let answer = self.sessions().delete_session(request).await;
        answer.map(drop).map_err(Refusal::of)
    }

    /// A subscription to mesh and points in the engine's own precision.
    pub fn subscription(&self) -> v1::SubscribeRequest {
        v1::SubscribeRequest {
            session: self.name.clone(),
            content: Content::MeshAndPoints.into(),
            precision: Precision::F64.into(),
            ..v1::SubscribeRequest::default()
        }
    }

    /// Watches mesh and points in the engine's own precision.
    pub async fn watch(&self) -> Watcher {
        self.subscribe(self.subscription()).await.unwrap()
    }

    /// Subscribes.
    pub async fn subscribe(&self, request: v1::SubscribeRequest) -> Result<Watcher, Refusal> {
        self.subscribe_over(self.channel.clone(), request).await
    }

    /// Subscribes by another connection.
    pub async fn subscribe_over(
        &self,
        channel: Channel,
        request: v1::SubscribeRequest,
    ) -> Result<Watcher, Refusal> {
        let mut client = MeshServiceClient::new(channel).max_decoding_message_size(64 << 20);
        let answer = client.subscribe(request).await;
        answer
            .map(|response| Watcher::new(response.into_inner()))
            .map_err(Refusal::of)
    }

    /// Opens a stream of motion in the scene's own order.
    pub async fn source(&self) -> Source {
        self.source_in_order(&[]).await.unwrap()
    }

    /// Opens a stream of motion whose frames have the points in this order.
    pub async fn source_in_order(&self, labels: &[String]) -> Result<Source, Refusal> {
        let client = MotionServiceClient::new(self.channel.clone());
        Source::open(client, crate::hello(&self.name, labels)).await
    }

    /// Opens a stream of motion by this hello; its session is filled in.
    pub async fn source_by(&self, hello: v1::Hello) -> Result<Source, Refusal> {
        let client = MotionServiceClient::new(self.channel.clone());
        let session = self.name.clone();
        let hello = v1::Hello { session, ..hello };
        Source::open(client, Asked::Hello(hello)).await
    }

    /// Records what its points are given.
    pub async fn record(&self) -> Result<tonic::Streaming<v1::RecordMotionResponse>, Refusal> {
        let session = self.name.clone();
        let mut client = MotionServiceClient::new(self.channel.clone());
        let answer = client
            .record_motion(v1::RecordMotionRequest { session })
            .await;
        answer.map(tonic::Response::into_inner).map_err(Refusal::of)
    }
}
