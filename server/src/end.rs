//! How sessions end.

use std::fmt;

/// Why a session ended by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub(crate) reason: &'static str,
    pub(crate) message: String,
}

/// Why a session, or a stream of it, is over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Deleted,
    Shutdown,
    Faulted(Fault),
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Deleted => write!(f, "it was deleted"),
            Self::Shutdown => write!(f, "the server shuts down"),
            Self::Faulted(fault) => write!(f, "{}", fault.message),
        }
    }
}
