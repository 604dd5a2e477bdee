//! What can go wrong between client and server.

use std::fmt;

use tonic::{Code, Status};
use tonic_types::StatusExt as _;

/// Why a call failed.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The address cannot be read.
    #[error("`{0}` is no server address; write HOST:PORT, such as 127.0.0.1:7370")]
    Address(String),
    /// Nobody answers there.
    #[error("no Sinew server answers at {address} ({}); start one with `sinew-server`, or give --server HOST:PORT", root(.source))]
    Connect {
        /// The address asked for.
        address: String,
        /// What the transport says.
        source: tonic::transport::Error,
    },
    /// The connection broke.
    #[error("the connection to the server is lost ({0}); see whether it still runs")]
    Lost(String),
    /// The server said no.
    #[error(transparent)]
    Refused(#[from] Box<Refusal>),
    /// The server sent what the protocol does not allow.
    #[error("the server broke the protocol: {0}; client and server may be of different versions")]
    Protocol(String),
}

/// A server's answer of no: `google.rpc.Status` with its details read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The gRPC code.
    pub code: Code,
    /// Upper-case name of the kind of problem (`ErrorInfo`), such as `VALUE_NOT_FINITE`; empty where the server gave
    /// none.
    pub reason: String,
    /// Path of the field that is wrong (`BadRequest`), such as `scene.mesh.grid.positions[12]`.
    pub field: Option<String>,
    /// What is wrong and what to do, for people.
    pub message: String,
}

impl fmt::Display for Refusal {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(field) = &self.field
            && !self.message.contains(field.as_str())
        {
            write!(to, "{field}: ")?;
        }
        match (self.message.is_empty(), self.reason.is_empty()) {
            (false, false) => write!(to, "{} [{}]", self.message, self.reason),
            (false, true) => write!(to, "{} [{:?}]", self.message, self.code),
            (true, false) => write!(to, "{} [{:?}]", self.reason, self.code),
            (true, true) => write!(to, "{}", self.code.description()),
        }
    }
}

impl std::error::Error for Refusal {}

impl From<Status> for ClientError {
    fn from(status: Status) -> Self {
        // A status that the transport made has the transport's error behind it; one that the server sent has none.
        if let Some(source) = std::error::Error::source(&status) {
            return Self::Lost(root(source));
        }
        let details = status.get_error_details();
        Self::Refused(Box::new(Refusal {
            code: status.code(),
            reason: details
                .error_info()
                .map(|info| info.reason.clone())
                .unwrap_or_default(),
            field: details
                .bad_request()
                .and_then(|request| request.field_violations.first())
                .map(|violation| violation.field.clone()),
            message: status.message().to_owned(),
        }))
    }
}

/// What stands at the end of a chain of errors: the system's own words.
fn root(mut error: &(dyn std::error::Error + 'static)) -> String {
    while let Some(source) = error.source() {
        error = source;
    }
    error.to_string()
}

impl ClientError {
    /// The refusal, where the server refused.
    pub fn refusal(&self) -> Option<&Refusal> {
        match self {
            Self::Refused(refusal) => Some(refusal),
            Self::Address(_) | Self::Connect { .. } | Self::Lost(_) | Self::Protocol(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use tonic_types::ErrorDetails;

    use super::*;

    #[test]
    fn a_refusal_names_reason_and_field() {
        let mut details = ErrorDetails::with_error_info("VALUE_NOT_POSITIVE", "sinew", []);
        details.add_bad_request_violation("scene.mesh.lattice.spacing", "is 0");
        let status = Status::with_error_details(
            Code::InvalidArgument,
            "must be greater than 0; give metres",
            details,
        );
        let error = ClientError::from(status);
        let refusal = error.refusal().unwrap();
        assert_eq!(refusal.code, Code::InvalidArgument);
        assert_eq!(refusal.reason, "VALUE_NOT_POSITIVE");
        assert_eq!(refusal.field.as_deref(), Some("scene.mesh.lattice.spacing"));
        assert_eq!(
            error.to_string(),
            "scene.mesh.lattice.spacing: must be greater than 0; give metres [VALUE_NOT_POSITIVE]"
        );
    }

    #[test]
    fn a_field_that_the_message_names_is_not_said_twice() {
        let refusal = Refusal {
            code: Code::InvalidArgument,
            reason: "R".into(),
            field: Some("a.b".into()),
            message: "a.b: is wrong".into(),
        };
        assert_eq!(refusal.to_string(), "a.b: is wrong [R]");
    }

    #[test]
    fn a_status_without_details_still_reads() {
        let error = ClientError::from(Status::unavailable("connection refused"));
        assert_eq!(error.to_string(), "connection refused [Unavailable]");
    }
}
