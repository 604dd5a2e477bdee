//! What the integration tests share: a real server on a port of its own, scenes, readers of its streams and of its
//! refusals. The server is driven through the generated client; [`wire`] is for bytes that no client would send.

#![allow(
    clippy::unwrap_used,
    clippy::missing_errors_doc,
    reason = "a test fails by panicking"
)]

mod refusal;
pub mod scenes;
mod server;
mod session;
mod source;
mod watcher;
pub mod wire;

use std::time::Duration;

pub use refusal::{Refusal, refused};
pub use server::TestServer;
pub use session::TestSession;
pub use source::{Source, hello};
pub use watcher::{Watcher, vertices};

/// Runs a test that speaks to servers, on a runtime such as the server's own. The deadline is for streams that hang;
/// nothing in a test may depend on it.
pub fn live<T>(test: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .unwrap()
        .block_on(async { tokio::time::timeout(Duration::from_secs(20), test).await })
        .expect("the test hangs")
}
