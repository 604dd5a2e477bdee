//! The figures of the paper on motion/geometry mapping, through a server.
#![cfg(feature = "embedded")]

mod sweeps;
mod tears;

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

use sinew_client::{Client, sweep::Sweep};
use sinew_server::{Config, Server};

async fn start() -> (Server, Client) {
    let config = Config {
        listen: SocketAddr::from(([127, 0, 0, 1], 0)),
        ..Config::default()
    };
    let server = Server::start(config).await.expect("a server");
    let address = server.address().to_string();
    let client = Client::connect(&address).await.expect("a client");
    (server, client)
}

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn load(figure: &str) -> Sweep {
    Sweep::load(&scenes().join(figure)).expect("a sweep")
}
