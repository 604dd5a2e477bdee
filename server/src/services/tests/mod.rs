//! What readers get of a mesh that comes apart. A script plays the session's steps: it tears a real body, and publishes
//! at the session's own outlets.

mod facts;
mod script;
mod watch;

use std::time::Duration;

/// Runs a test that speaks to a server. The deadline is for streams that hang; nothing may depend on it.
fn live<T>(test: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .unwrap()
        .block_on(async { tokio::time::timeout(Duration::from_secs(60), test).await })
        .expect("the test hangs")
}
