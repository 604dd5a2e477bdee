//! Why a source cannot be heard.

use std::{io, net::SocketAddr};

/// Why a source cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// No socket there.
    #[error(
        "cannot listen at {address}: {source}; give an address of this machine and a port that is free"
    )]
    Listen {
        /// Where.
        address: SocketAddr,
        /// The system's word.
        source: io::Error,
    },
    /// The network failed.
    #[error("the network failed: {0}")]
    Network(#[from] io::Error),
    /// Whoever asked has left.
    #[error("nobody listens any more")]
    Abandoned,
}
