//! Which server a command talks to.

use clap::Args;
use sinew_client::{Client, ClientError};

/// Where `sinew-server` listens unless told otherwise.
const DEFAULT: &str = "127.0.0.1:7370";

/// The server of commands that need one.
#[derive(Args)]
pub(crate) struct Connection {
    /// The server.
    #[arg(long, value_name = "HOST:PORT", default_value = DEFAULT, global = true)]
    server: String,
}

impl Connection {
    pub(crate) async fn open(&self) -> Result<Client, ClientError> {
        Client::connect(&self.server).await
    }
}

/// The name of a session, given as `walk` or as `sessions/walk`.
pub(crate) fn session_name(given: &str) -> String {
    let id = given.strip_prefix("sessions/").unwrap_or(given);
    format!("sessions/{id}")
}
