//! A server inside the command.

use std::{net::SocketAddr, path::PathBuf};

use sinew_server::{Config, Server, StartError, Stopped};

use crate::Failure;

/// Starts a server on loopback: on `port`; without one on the usual port, or on any where that is taken.
pub(crate) async fn start(
    port: Option<u16>,
    recordings: Option<PathBuf>,
) -> Result<Server, Failure> {
    let usual = Config::default().listen.port();
    let on = |port| Config {
        listen: SocketAddr::from(([127, 0, 0, 1], port)),
        recordings: recordings.clone(),
        ..Config::default()
    };
    match (Server::start(on(port.unwrap_or(usual))).await, port) {
        (Ok(server), _) => Ok(server),
        (Err(StartError::Listen { .. }), None) => Ok(Server::start(on(0)).await?),
        (Err(StartError::Listen { source, .. }), Some(port)) => Err(format!(
            "cannot listen on port {port}: {source}; give another --port, or none for any that is free"
        )
        .into()),
        (Err(error), _) => Err(error.into()),
    }
}

/// Stops the server, so that its recordings are whole.
pub(crate) async fn stop(server: Server) -> Result<(), Failure> {
    match server.shutdown().await {
        Stopped::Drained => Ok(()),
        Stopped::GraceExpired => {
            Err("the server did not stop in time; its recordings may lack their end".into())
        }
    }
}
