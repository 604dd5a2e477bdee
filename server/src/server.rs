//! A server's life: start, serve, stop. gRPC, grpc-web, the Rerun feed, the page and plain HTTP share
//! one port.

use std::{io, net::SocketAddr, sync::Arc, time::Duration};

use axum::{Router, middleware};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::{conn::auto, graceful::GracefulShutdown},
    service::TowerToHyperService,
};
use sinew_proto::v1::{
    asset_service_server::AssetServiceServer, mesh_service_server::MeshServiceServer,
    motion_service_server::MotionServiceServer, session_service_server::SessionServiceServer,
};
use tokio::{
    net::TcpListener,
    task::JoinHandle,
    time::{Instant, timeout_at},
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};
use tonic::service::Routes;
use tonic_health::{ServingStatus, server::HealthReporter};

use crate::{
    assets::Assets, config::Config, http, kernels::Kernels, metrics::Metrics, registry::Registry,
    services::Shared, status,
};

/// Streams that one connection may hold open.
const STREAMS: u32 = 256;
/// Bytes that a stream may send before they are read. A connection has room for all of its streams, so
/// that one held back, such as motion for a paused session, holds back no other.
const STREAM_WINDOW: u32 = 256 << 10;

/// A server that listens. Dropping it stops it at once; [`Server::shutdown`] stops it in order.
pub struct Server {
    address: SocketAddr,
    shared: Shared,
    health: HealthReporter,
    /// Cancelled first: no new work.
    closing: CancellationToken,
    listening: JoinHandle<GracefulShutdown>,
}

/// Why a server cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {source}; choose another with --listen")]
    Listen {
        /// The address asked for.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The viewer cannot start.
    #[error("cannot start the viewer feed: {0}")]
    Viewer(io::Error),
    /// The kernels' threads cannot start.
    #[error("cannot start the kernels' threads: {0}")]
    Kernels(#[from] rayon::ThreadPoolBuildError),
    /// The descriptors for reflection are unreadable.
    #[error("cannot serve reflection: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
}

/// How a server stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// Every stream got its last item and its goodbye.
    Drained,
    /// The grace period passed first.
    GraceExpired,
}

impl Server {
    /// Starts to serve.
    ///
    /// # Errors
    /// [`StartError`] where the address cannot be listened on or a part cannot start.
    pub async fn start(config: Config) -> Result<Self, StartError> {
        let address = config.listen;
        let failed = |source| StartError::Listen { address, source };
        let listener = TcpListener::bind(address).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let viewer = sinew_viewer::Viewer::start(sinew_viewer::Config {
            recordings: config.recordings.clone(),
            ..sinew_viewer::Config::default()
        });
        let shared = Shared {
            registry: Arc::new(Registry::new(config.max_sessions)),
            assets: Arc::new(Assets::new(config.max_asset_bytes)),
            kernels: Kernels::start(config.threads)?,
            metrics: Arc::new(Metrics::new()),
            viewer: viewer.map_err(StartError::Viewer)?,
            tasks: TaskTracker::new(),
            config: Arc::new(config),
        };
        let closing = CancellationToken::new();
        let (health, routes) = routes(&shared, closing.clone())?;
        let listening = tokio::spawn(listen(listener, routes, closing.clone()));
        tracing::info!(%address, "serving");
        Ok(Self {
            address,
            shared,
            health,
            closing,
            listening,
        })
    }

    /// Where it listens, with the real port.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    #[cfg(test)]
    pub(crate) fn shared(&self) -> &Shared {
        &self.shared
    }

    /// Stops: no new connections, sessions end after the step under way, streams get their last item
    /// and a goodbye, recordings are closed.
    pub async fn shutdown(mut self) -> Stopped {
        self.health
            .set_service_status("", ServingStatus::NotServing)
            .await;
        self.closing.cancel();
        self.shared.registry.shut_down();
        self.shared.tasks.close();
        let grace = Duration::from_secs_f64(self.shared.config.grace_seconds);
        let deadline = Instant::now() + grace;
        let told = timeout_at(deadline, self.shared.tasks.wait()).await;
        // The feed's streams end with the viewer, so this comes before the wait for connections.
        let viewer = self.shared.viewer.clone();
        // Closing files may wait for the disk.
        let closed = tokio::task::spawn_blocking(move || viewer.shutdown(grace)).await;
        match closed {
            Ok(Ok(())) => {}
            Ok(Err(unfinished)) => tracing::error!("{unfinished}"),
            Err(panic) => tracing::error!(%panic, "the viewer feed did not close"),
        }
        // Ends the streams of those who watch the health: they have heard of the end.
        self.health.clear_service_status("").await;
        let drained = timeout_at(deadline, async {
            if let Ok(connections) = (&mut self.listening).await {
                connections.shutdown().await;
            }
        });
        let stopped = match told.and(drained.await) {
            Ok(()) => Stopped::Drained,
            Err(_) => Stopped::GraceExpired,
        };
        tracing::info!(?stopped, "stopped");
        stopped
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.closing.cancel();
        self.shared.registry.shut_down();
    }
}

/// Everything on the port.
fn routes(
    shared: &Shared,
    closing: CancellationToken,
) -> Result<(HealthReporter, Router), StartError> {
    let (health, health_service) = tonic_health::server::health_reporter();
    let reflection = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(sinew_proto::DESCRIPTORS)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    let limit = shared.config.max_message_bytes;
    let services =
        Routes::new(SessionServiceServer::new(shared.clone()).max_decoding_message_size(limit))
            .add_service(MotionServiceServer::new(shared.clone()).max_decoding_message_size(limit))
            .add_service(MeshServiceServer::new(shared.clone()).max_decoding_message_size(limit))
            .add_service(AssetServiceServer::new(shared.clone()).max_decoding_message_size(limit))
            .add_service(health_service)
            .add_service(reflection().build_v1()?)
            .add_service(reflection().build_v1alpha()?)
            .add_service(shared.viewer.feed())
            .into_axum_router()
            .layer(middleware::from_fn(status::translate))
            .layer(tonic_web::GrpcWebLayer::new())
            .layer(middleware::from_fn(http::only_calls));
    let pages = shared
        .viewer
        .pages()
        .merge(http::routes(shared.clone(), closing));
    Ok((health, pages.fallback_service(services)))
}

/// Accepts connections until `closing`; then gives back those that are open.
async fn listen(
    listener: TcpListener,
    routes: Router,
    closing: CancellationToken,
) -> GracefulShutdown {
    let connections = GracefulShutdown::new();
    let mut builder = auto::Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(Duration::from_secs(10));
    builder
        .http2()
        .timer(TokioTimer::new())
        .max_concurrent_streams(STREAMS)
        .initial_stream_window_size(STREAM_WINDOW)
        .initial_connection_window_size(STREAMS * STREAM_WINDOW)
        .keep_alive_interval(Duration::from_secs(20))
        .keep_alive_timeout(Duration::from_secs(20))
        .max_send_buf_size(256 << 10);
    loop {
        let accepted = tokio::select! {
            () = closing.cancelled() => return connections,
            accepted = listener.accept() => accepted,
        };
        let stream = match accepted {
            Ok((stream, _)) => stream,
            Err(error) => {
                // Out of file descriptors, or a client that left: the next one may do.
                tracing::warn!(%error, "a connection could not be accepted");
                tokio::task::yield_now().await;
                continue;
            }
        };
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "a connection keeps its delay");
        }
        let service = TowerToHyperService::new(routes.clone());
        let connection = builder
            .serve_connection_with_upgrades(TokioIo::new(stream), service)
            .into_owned();
        let connection = connections.watch(connection);
        tokio::spawn(async move {
            if let Err(error) = connection.await {
                tracing::debug!(%error, "a connection broke");
            }
        });
    }
}
