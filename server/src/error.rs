//! Everything the service can refuse, in the domain's own words. [`crate::status`] says what clients see.

use std::fmt::Display;

use sinew_engine::{ReadError, RemapError, SceneError};

use crate::end::{End, Fault};

/// Why a request is refused or a stream ends early.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum ServiceError {
    #[error(transparent)]
    Invalid(#[from] SceneError),
    #[error("`{0}` is no session here; ListSessions names those that are")]
    SessionUnknown(String),
    #[error("`{0}` is no asset here; upload it by AssetService first")]
    AssetUnknown(String),
    #[error("`{0}` exists already; choose another session_id or delete it first")]
    SessionExists(String),
    #[error("`{0}` is being created by another request; try again")]
    SessionBeingCreated(String),
    #[error("request_id `{0}` made another session before; use a new one for a new request")]
    RequestIdReused(String),
    #[error("the server holds {0} sessions already; delete one first")]
    TooManySessions(usize),
    #[error("the server's assets would pass {0} bytes; raise max_asset_bytes")]
    AssetsFull(u64),
    #[error("the session is running; pause it first")]
    Running,
    #[error("{}", .0.message)]
    Faulted(Fault),
    #[error("the session ended: {0}")]
    Ended(End),
    #[error(
        "the session is at step {actual}, not at expected_step {expected}; get the session and decide again"
    )]
    StepMismatch { expected: u64, actual: u64 },
    #[error("the mapping is no longer the one of this etag; get the session and decide again")]
    EtagMismatch,
    #[error("{0}")]
    MappingBlending(RemapError),
    #[error(
        "the mesh's topology is at version {actual}, not at expected_topology_version {expected}; get a keyframe and decide again"
    )]
    TopologyMismatch { expected: u64, actual: u64 },
    #[error("the mesh cannot be edited: {0}")]
    Uneditable(String),
    #[error("the mesh changed while the mapping was bound; try again")]
    MeshChanged,
    #[error("{wanted} steps need {wanted} motion frames and {waiting} wait; stream more first")]
    MotionStarved { wanted: usize, waiting: usize },
    #[error(
        "the session makes its own motion; only scenes with motion.external take positions, others take drags"
    )]
    MotionNotExternal,
    #[error("{0}")]
    MotionExternal(ReadError),
    #[error(
        "another source streams to this session; end that stream first, or take over by a higher stream_epoch"
    )]
    MotionSourceBusy,
    #[error("stream_epoch {epoch} is before {last}, the last stream's; use a higher one")]
    MotionEpochStale { epoch: u64, last: u64 },
    #[error("a source of a higher stream_epoch took over")]
    MotionSuperseded,
    #[error("the stream's first item must be a hello; send it before any frame")]
    MotionHelloMissing,
    #[error("a hello came after the first item; open a new stream instead")]
    MotionHelloRepeated,
    #[error(
        "frame {sequence} of {time} s came after frame {last} of {last_time} s, and goes back {back}; open a new stream to start over"
    )]
    MotionBackwards {
        sequence: u64,
        time: f64,
        last: u64,
        last_time: f64,
        back: &'static str,
    },
    #[error("the stream's first item must be open; send it before any credit or resync")]
    WatchOpenMissing,
    #[error("an open came after the first item; open a new stream instead")]
    WatchOpenRepeated,
    #[error(
        "the reader fell behind by more than a lossless stream keeps; watch again from the last event seen, or in mode latest"
    )]
    SubscriberTooSlow,
    #[error(
        "events after {after} are no longer kept; the oldest kept is {oldest}: ask for those after {}, or get a keyframe", .oldest - 1
    )]
    EventsTrimmed { after: u64, oldest: u64 },
    #[error("the server is shutting down; connect to another or try later")]
    ShuttingDown,
    #[error("the deadline passed; raise it or ask for less")]
    DeadlineExceeded,
    #[error("the message is no valid protobuf of this type: {0}")]
    Garbled(String),
    #[error("the message is over the limit: {0}; send less at once, or upload as an asset")]
    MessageTooLarge(String),
    #[error("an error of ours: {0}")]
    Internal(String),
}

impl From<RemapError> for ServiceError {
    fn from(error: RemapError) -> Self {
        match error {
            RemapError::BlendSeconds { .. } => Self::Invalid(SceneError {
                reason: "VALUE_OUT_OF_RANGE",
                field: "blend_seconds".to_owned(),
                message: error.to_string(),
            }),
            RemapError::Straight => Self::Invalid(SceneError {
                reason: "RULE_UNFIT",
                field: "mapping.weighting".to_owned(),
                message: error.to_string(),
            }),
            RemapError::Blending { .. } => Self::MappingBlending(error),
            RemapError::Outdated => Self::MeshChanged,
        }
    }
}

impl From<ReadError> for ServiceError {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::External => Self::MotionExternal(error),
            ReadError::Refused(refused) => Self::Invalid(refused),
        }
    }
}

/// Refuses a value of a request: the field's path, what is wrong with its value, what to do.
pub(crate) fn invalid(
    reason: &'static str,
    field: impl Into<String>,
    problem: impl Display,
    remedy: impl Display,
) -> ServiceError {
    ServiceError::Invalid(SceneError {
        reason,
        field: field.into(),
        message: format!("{problem}; {remedy}"),
    })
}
