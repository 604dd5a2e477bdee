//! Why a source cannot be heard.

use std::{io, net::SocketAddr};

use crate::Garbled;

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
    /// A multicast group that cannot be joined.
    #[error(
        "cannot join the multicast group {group}: {source}; name this machine's address on that network by --local"
    )]
    Join {
        /// Which.
        group: std::net::Ipv4Addr,
        /// The system's word.
        source: io::Error,
    },
    /// The network failed.
    #[error("the network failed: {0}")]
    Network(#[from] io::Error),
    /// The peer speaks a protocol of another age.
    #[error("the server speaks NatNet {major}.{minor}; versions 3 and 4 are understood")]
    Version {
        /// Major version.
        major: u8,
        /// Minor version.
        minor: u8,
    },
    /// A message of the handshake cannot be read.
    #[error("{what} cannot be read: {problem}")]
    Garbled {
        /// Which message.
        what: &'static str,
        /// Where and why.
        problem: Garbled,
    },
    /// A stream without points.
    #[error("{0}")]
    Layout(String),
    /// Whoever asked has left.
    #[error("nobody listens any more")]
    Abandoned,
}
