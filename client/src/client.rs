//! The typed client: one method for each RPC.

use std::time::Duration;

use futures::StreamExt as _;
use sinew_mesh::Grid;
use sinew_proto::v1;
use tonic::transport::{Channel, Endpoint};
use v1::{
    asset_service_client::AssetServiceClient, mesh_service_client::MeshServiceClient,
    motion_service_client::MotionServiceClient, session_service_client::SessionServiceClient,
};

use crate::{
    ClientError, MotionStream, Recording, Subscription, Watch, grid,
    motion::{self, Pinger},
    upload,
};

/// Largest message taken: a keyframe of 5 million f32 vertices. Greater items come as chunks.
const MAX_MESSAGE_BYTES: usize = 64 << 20;

/// Bytes that a stream may be ahead of its reader: the receiver sets the windows, and with HTTP/2's 64 KiB a mesh of
/// 100k vertices waits for window updates. More would only be older frames.
const STREAM_WINDOW: u32 = 4 << 20;

/// Bytes of an HTTP/2 frame taken: with its 16 KiB a mesh of 100k vertices comes in 70 pieces, a third slower.
const FRAME: u32 = 1 << 20;

/// The same as [`STREAM_WINDOW`] for all streams together: one that nobody reads leaves room for the others.
const CONNECTION_WINDOW: u32 = 256 << 20;

/// Meshes up to this size travel inside the scene; the server takes messages of 4 MiB.
const MAX_INLINE_BYTES: usize = 3 << 20;

/// A connection to a server. Cheap to clone; clones share the connection.
#[derive(Clone, Debug)]
pub struct Client {
    channel: Channel,
}

impl Client {
    /// Connects to `address`, `HOST:PORT` or a whole `http://` URL.
    ///
    /// # Errors
    /// [`ClientError::Address`] and [`ClientError::Connect`].
    pub async fn connect(address: &str) -> Result<Self, ClientError> {
        let url = if address.contains("://") {
            address.to_owned()
        } else {
            format!("http://{address}")
        };
        let endpoint =
            Endpoint::from_shared(url).map_err(|_| ClientError::Address(address.to_owned()))?;
        let channel = endpoint
            .tcp_nodelay(true)
            .initial_stream_window_size(STREAM_WINDOW)
            .initial_connection_window_size(CONNECTION_WINDOW)
            .max_frame_size(FRAME)
            .connect_timeout(Duration::from_secs(5))
            .http2_keep_alive_interval(Duration::from_secs(20))
            .connect()
            .await
            .map_err(|source| ClientError::Connect {
                address: address.to_owned(),
                source,
            })?;
        Ok(Self { channel })
    }

    /// Creates a session.
    ///
    /// # Errors
    /// The server's refusal of the scene or of the id.
    pub async fn create_session(
        &self,
        request: v1::CreateSessionRequest,
    ) -> Result<v1::Session, ClientError> {
        Ok(self.sessions().create_session(request).await?.into_inner())
    }

    /// Reads a session.
    ///
    /// # Errors
    /// `NOT_FOUND`.
    pub async fn session(&self, name: &str) -> Result<v1::Session, ClientError> {
        let name = name.to_owned();
        let request = v1::GetSessionRequest { name };
        Ok(self.sessions().get_session(request).await?.into_inner())
    }

    /// Reads one page of the sessions.
    ///
    /// # Errors
    /// The server's refusal of the page.
    pub async fn list_sessions(
        &self,
        request: v1::ListSessionsRequest,
    ) -> Result<v1::ListSessionsResponse, ClientError> {
        Ok(self.sessions().list_sessions(request).await?.into_inner())
    }

    /// Reads all sessions, page after page.
    ///
    /// # Errors
    /// The server's refusal.
    pub async fn all_sessions(&self) -> Result<Vec<v1::Session>, ClientError> {
        let mut request = v1::ListSessionsRequest::default();
        let mut sessions = Vec::new();
        loop {
            let page = self.list_sessions(request).await?;
            sessions.extend(page.sessions);
            if page.next_page_token.is_empty() {
                return Ok(sessions);
            }
            request = v1::ListSessionsRequest {
                page_size: 0,
                page_token: page.next_page_token,
            };
        }
    }

    /// Ends a session.
    ///
    /// # Errors
    /// `NOT_FOUND`.
    pub async fn delete_session(&self, name: &str) -> Result<(), ClientError> {
        let name = name.to_owned();
        let request = v1::DeleteSessionRequest { name };
        self.sessions().delete_session(request).await?;
        Ok(())
    }

    /// Lets a session step by itself.
    ///
    /// # Errors
    /// `NOT_FOUND`, `FAILED_PRECONDITION`.
    pub async fn run(&self, name: &str) -> Result<v1::Session, ClientError> {
        let name = name.to_owned();
        let request = v1::RunRequest { name };
        Ok(self.sessions().run(request).await?.into_inner())
    }

    /// Stops a session after the step under way.
    ///
    /// # Errors
    /// `NOT_FOUND`, `FAILED_PRECONDITION`.
    pub async fn pause(&self, name: &str) -> Result<v1::Session, ClientError> {
        let name = name.to_owned();
        let request = v1::PauseRequest { name };
        Ok(self.sessions().pause(request).await?.into_inner())
    }

    /// Takes some steps of a paused session.
    ///
    /// # Errors
    /// `NOT_FOUND`, `FAILED_PRECONDITION`, `ABORTED` where the session is not at `expected_step`.
    pub async fn step(&self, request: v1::StepRequest) -> Result<v1::StepResponse, ClientError> {
        Ok(self.sessions().step(request).await?.into_inner())
    }

    /// Changes how the points drive a session's mesh.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT`, `ABORTED` where the etag is stale, `FAILED_PRECONDITION` where it blends already.
    pub async fn update_mapping(
        &self,
        request: v1::UpdateMappingRequest,
    ) -> Result<v1::Session, ClientError> {
        Ok(self.sessions().update_mapping(request).await?.into_inner())
    }

    /// Changes a session's mesh.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT` for an edit that says nothing, `ABORTED` where the topology is at another version,
    /// `FAILED_PRECONDITION` where the mesh cannot be edited.
    pub async fn edit_mesh(
        &self,
        request: v1::EditMeshRequest,
    ) -> Result<v1::EditMeshResponse, ClientError> {
        Ok(self.sessions().edit_mesh(request).await?.into_inner())
    }

    /// Asks why a vertex is where it is.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT` where there is no such vertex.
    pub async fn explain(&self, name: &str, vertex: u32) -> Result<v1::Explanation, ClientError> {
        let name = name.to_owned();
        let request = v1::ExplainRequest { name, vertex };
        Ok(self.sessions().explain(request).await?.into_inner())
    }

    /// Reads places and forces of modules of the particles that the server simulates.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT` for modules that are not there or too many, `FAILED_PRECONDITION` where a client
    /// streams the points.
    pub async fn read_modules(
        &self,
        request: v1::ReadModulesRequest,
    ) -> Result<v1::Modules, ClientError> {
        Ok(self.sessions().read_modules(request).await?.into_inner())
    }

    /// Uploads a grid.
    ///
    /// # Errors
    /// `INVALID_ARGUMENT` where it is no valid grid, `RESOURCE_EXHAUSTED` where the server's store is full.
    pub async fn upload_grid(&self, grid: &v1::UnstructuredGrid) -> Result<v1::Asset, ClientError> {
        let items = futures::stream::iter(upload::requests(grid));
        let mut assets = AssetServiceClient::new(self.channel.clone());
        Ok(assets.upload_asset(items).await?.into_inner())
    }

    /// Makes the source of a scene's mesh of a grid: inside the scene where it is small, else uploaded.
    ///
    /// # Errors
    /// As [`Client::upload_grid`].
    pub async fn mesh_source(&self, grid: &Grid) -> Result<v1::mesh::Source, ClientError> {
        let packed = grid::to_proto(grid);
        Ok(if upload::size(&packed) <= MAX_INLINE_BYTES {
            v1::mesh::Source::Grid(packed)
        } else {
            v1::mesh::Source::Asset(self.upload_grid(&packed).await?.name)
        })
    }

    /// A cloud of points for a scene: inside, or uploaded where it is large.
    ///
    /// # Errors
    /// The server's refusal of the upload.
    pub async fn cloud(
        &self,
        positions: v1::Reals,
    ) -> Result<v1::elastic_solid::Cloud, ClientError> {
        let points = v1::UnstructuredGrid {
            positions: Some(positions),
            ..v1::UnstructuredGrid::default()
        };
        if upload::size(&points) > MAX_INLINE_BYTES {
            let asset = self.upload_grid(&points).await?;
            return Ok(v1::elastic_solid::Cloud::Asset(asset.name));
        }
        Ok(v1::elastic_solid::Cloud::Positions(
            points.positions.unwrap_or_default(),
        ))
    }

    /// Opens a stream of motion: says Hello, waits until the session accepts, then sends `frames` as they come; see
    /// [`crate::Take`] for those of a take. The stream is closed after the last frame.
    ///
    /// # Errors
    /// The server's refusal of the Hello.
    pub async fn stream_motion(
        &self,
        hello: v1::Hello,
        frames: impl futures::Stream<Item = v1::MotionFrame> + Send + 'static,
    ) -> Result<MotionStream, ClientError> {
        let mut client = MotionServiceClient::new(self.channel.clone());
        let answers = client
            .stream_motion(motion::requests(
                hello,
                frames.map(v1::stream_motion_request::Item::Frame),
            ))
            .await?;
        MotionStream::open(answers.into_inner(), None).await
    }

    /// Opens a stream of motion as it is captured ([`v1::Delivery::Live`]): as [`Client::stream_motion`], with pings
    /// between the frames, by which the session learns the source's clock.
    ///
    /// * `clock` - what that of the frames' capture times shows now, s; see [`crate::CaptureClock`].
    ///
    /// # Errors
    /// The server's refusal of the Hello.
    pub async fn stream_motion_live(
        &self,
        mut hello: v1::Hello,
        frames: impl futures::Stream<Item = v1::MotionFrame> + Send + 'static,
        clock: impl Fn() -> f64 + Send + Sync + 'static,
    ) -> Result<MotionStream, ClientError> {
        hello.set_delivery(v1::Delivery::Live);
        let pinger = Pinger::new(clock);
        let items = motion::requests(hello, pinger.clone().between(frames));
        let mut client = MotionServiceClient::new(self.channel.clone());
        let answers = client.stream_motion(items).await?;
        MotionStream::open(answers.into_inner(), Some(pinger)).await
    }

    /// Records what a session's points are given at each step from now on.
    ///
    /// # Errors
    /// `NOT_FOUND`, `FAILED_PRECONDITION` where the session makes its own motion.
    pub async fn record_motion(&self, name: &str) -> Result<Recording, ClientError> {
        let session = name.to_owned();
        let request = v1::RecordMotionRequest { session };
        let mut client = MotionServiceClient::new(self.channel.clone())
            .max_decoding_message_size(MAX_MESSAGE_BYTES);
        let items = client.record_motion(request).await?.into_inner();
        Recording::open(items).await
    }

    /// Subscribes to a session's mesh and points.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT`, `OUT_OF_RANGE` where events after `after_event` are no longer kept.
    pub async fn subscribe(
        &self,
        request: v1::SubscribeRequest,
    ) -> Result<Subscription, ClientError> {
        let request = with_message_size(request);
        let (content, after) = (request.content(), request.after_event);
        let items = self.meshes().subscribe(request).await?.into_inner();
        Ok(Subscription::new(items, content, after))
    }

    /// Subscribes in the reader's control: [`Watch`] gives credit for each update when the next one is asked for, so
    /// that the next is the newest, and asks for a keyframe where it needs one.
    ///
    /// # Errors
    /// As [`Client::subscribe`].
    pub async fn watch(
        &self,
        request: v1::SubscribeRequest,
        mode: v1::WatchMode,
    ) -> Result<Watch, ClientError> {
        let request = with_message_size(request);
        let (content, after) = (request.content(), request.after_event);
        let (asks, requests) = Watch::requests(request, mode);
        let items = self.meshes().watch(requests).await?.into_inner();
        Ok(Watch::new(Subscription::new(items, content, after), asks))
    }

    /// Reads the whole mesh at the step last taken.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT`, `RESOURCE_EXHAUSTED` where it is larger than 64 MiB.
    pub async fn keyframe(
        &self,
        mut request: v1::GetKeyframeRequest,
    ) -> Result<v1::Keyframe, ClientError> {
        if request.max_message_bytes == 0 {
            request.max_message_bytes = max_message_bytes();
        }
        Ok(self.meshes().get_keyframe(request).await?.into_inner())
    }

    /// Reads one page of a session's events.
    ///
    /// # Errors
    /// `NOT_FOUND`, `INVALID_ARGUMENT`, `OUT_OF_RANGE` where events after `after_event` are no longer kept.
    pub async fn list_events(
        &self,
        request: v1::ListEventsRequest,
    ) -> Result<v1::ListEventsResponse, ClientError> {
        Ok(self.meshes().list_events(request).await?.into_inner())
    }

    fn meshes(&self) -> MeshServiceClient<Channel> {
        MeshServiceClient::new(self.channel.clone())
            .max_decoding_message_size(MAX_MESSAGE_BYTES + (64 << 10))
    }

    fn sessions(&self) -> SessionServiceClient<Channel> {
        SessionServiceClient::new(self.channel.clone())
    }
}

fn with_message_size(mut request: v1::SubscribeRequest) -> v1::SubscribeRequest {
    if request.max_message_bytes == 0 {
        request.max_message_bytes = max_message_bytes();
    }
    request
}

fn max_message_bytes() -> u32 {
    u32::try_from(MAX_MESSAGE_BYTES).expect("64 MiB fits 32 bits")
}
