//! The only place where a gRPC code is chosen. No `_` arm over our own errors: a new one does not
//! compile until someone decides what clients see. Every status carries exactly one `ErrorInfo`, and
//! a `BadRequest` where a field is to blame.

use std::time::Duration;

use axum::{
    extract::Request,
    http::{HeaderMap, HeaderValue},
    middleware::Next,
    response::Response,
};
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, StatusExt};

use crate::{
    end::End,
    error::{ServiceError, invalid},
};

/// The `domain` of every `ErrorInfo`.
const DOMAIN: &str = "sinew.v1";

impl From<ServiceError> for Status {
    fn from(error: ServiceError) -> Self {
        let (code, reason) = code_and_reason(&error);
        let mut details = ErrorDetails::with_error_info(reason, DOMAIN, []);
        if let ServiceError::Invalid(invalid) = &error {
            details.add_bad_request_violation(&invalid.field, &invalid.message);
        }
        Self::with_error_details(code, error.to_string(), details)
    }
}

fn code_and_reason(error: &ServiceError) -> (Code, &str) {
    use ServiceError as E;
    match error {
        E::Invalid(invalid) => (Code::InvalidArgument, invalid.reason),
        E::SessionUnknown(_) => (Code::NotFound, "SESSION_UNKNOWN"),
        E::AssetUnknown(_) => (Code::NotFound, "ASSET_UNKNOWN"),
        E::SessionExists(_) => (Code::AlreadyExists, "SESSION_EXISTS"),
        E::SessionBeingCreated(_) => (Code::Aborted, "SESSION_BEING_CREATED"),
        E::RequestIdReused(_) => (Code::AlreadyExists, "REQUEST_ID_REUSED"),
        E::TooManySessions(_) => (Code::ResourceExhausted, "TOO_MANY_SESSIONS"),
        E::AssetsFull(_) => (Code::ResourceExhausted, "ASSETS_FULL"),
        E::Running => (Code::FailedPrecondition, "SESSION_RUNNING"),
        E::Faulted(fault) => (Code::FailedPrecondition, fault.reason),
        E::Ended(End::Faulted(fault)) => (Code::Aborted, fault.reason),
        E::Ended(End::Deleted | End::Shutdown) => (Code::Aborted, "SESSION_ENDED"),
        E::StepMismatch { .. } => (Code::Aborted, "STEP_MISMATCH"),
        E::EtagMismatch => (Code::Aborted, "ETAG_MISMATCH"),
        E::MappingBlending(_) => (Code::FailedPrecondition, "MAPPING_BLENDING"),
        E::TopologyMismatch { .. } => (Code::Aborted, "TOPOLOGY_VERSION_MISMATCH"),
        E::Uneditable(_) => (Code::FailedPrecondition, "MESH_NOT_A_BODY"),
        E::MeshChanged => (Code::Aborted, "MESH_CHANGED"),
        E::MotionStarved { .. } => (Code::FailedPrecondition, "MOTION_STARVED"),
        E::MotionNotExternal => (Code::FailedPrecondition, "MOTION_NOT_EXTERNAL"),
        E::MotionExternal(_) => (Code::FailedPrecondition, "MOTION_EXTERNAL"),
        E::MotionSourceBusy => (Code::FailedPrecondition, "MOTION_SOURCE_BUSY"),
        E::MotionEpochStale { .. } => (Code::FailedPrecondition, "MOTION_EPOCH_STALE"),
        E::MotionSuperseded => (Code::Aborted, "MOTION_SUPERSEDED"),
        E::MotionHelloMissing => (Code::InvalidArgument, "MOTION_HELLO_MISSING"),
        E::MotionHelloRepeated => (Code::InvalidArgument, "MOTION_HELLO_REPEATED"),
        E::MotionBackwards { .. } => (Code::FailedPrecondition, "MOTION_BACKWARDS"),
        E::WatchOpenMissing => (Code::InvalidArgument, "WATCH_OPEN_MISSING"),
        E::WatchOpenRepeated => (Code::InvalidArgument, "WATCH_OPEN_REPEATED"),
        E::SubscriberTooSlow => (Code::ResourceExhausted, "SUBSCRIBER_TOO_SLOW"),
        E::EventsTrimmed { .. } => (Code::OutOfRange, "EVENTS_TRIMMED"),
        E::ShuttingDown => (Code::Unavailable, "SHUTTING_DOWN"),
        E::DeadlineExceeded => (Code::DeadlineExceeded, "DEADLINE_EXCEEDED"),
        E::Garbled(_) => (Code::InvalidArgument, "MESSAGE_GARBLED"),
        E::MessageTooLarge(_) => (Code::ResourceExhausted, "MESSAGE_TOO_LARGE"),
        E::Internal(_) => (Code::Internal, "INTERNAL"),
    }
}

/// What an item of a request stream that could not be read means. tonic reports undecodable bytes as
/// INTERNAL and a message over the limit as OUT_OF_RANGE; neither tells a client that it is to blame.
/// `None`: the stream just broke off.
pub(crate) fn unreadable(status: &Status) -> Option<ServiceError> {
    let message = status.message().to_owned();
    if status.code() == Code::Internal {
        Some(ServiceError::Garbled(message))
    } else if status.code() == Code::OutOfRange {
        Some(ServiceError::MessageTooLarge(message))
    } else {
        None
    }
}

/// Gives every error of a unary call that tonic chose by itself our code and details, and holds calls
/// to their deadline.
pub(crate) async fn translate(request: Request, next: Next) -> Response {
    let deadline = match deadline(request.headers()) {
        Ok(deadline) => deadline,
        Err(error) => return Status::from(error).into_http(),
    };
    let answer = next.run(request);
    let response = match deadline {
        None => answer.await,
        Some(deadline) => match tokio::time::timeout(deadline, answer).await {
            Ok(response) => response,
            Err(_) => return Status::from(ServiceError::DeadlineExceeded).into_http(),
        },
    };
    let Some(status) = Status::from_header_map(response.headers()) else {
        return response;
    };
    // Our own errors have details; what has none was made by tonic before it reached us.
    match unreadable(&status).filter(|_| status.details().is_empty()) {
        Some(error) => Status::from(error).into_http(),
        None => response,
    }
}

/// Reads `grpc-timeout`: at most 8 digits and a unit.
fn deadline(headers: &HeaderMap) -> Result<Option<Duration>, ServiceError> {
    let Some(value) = headers.get("grpc-timeout") else {
        return Ok(None);
    };
    parse_timeout(value).map(Some).ok_or_else(|| {
        invalid(
            "DEADLINE_GARBLED",
            "grpc-timeout",
            format!("{value:?} is no timeout"),
            "send at most 8 digits and one of H M S m u n",
        )
    })
}

fn parse_timeout(value: &HeaderValue) -> Option<Duration> {
    let (digits, unit) = value
        .to_str()
        .ok()?
        .split_at_checked(value.len().checked_sub(1)?)?;
    if digits.is_empty() || digits.len() > 8 || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let amount: u64 = digits.parse().ok()?;
    match unit {
        "H" => Some(Duration::from_secs(amount * 3600)),
        "M" => Some(Duration::from_secs(amount * 60)),
        "S" => Some(Duration::from_secs(amount)),
        "m" => Some(Duration::from_millis(amount)),
        "u" => Some(Duration::from_micros(amount)),
        "n" => Some(Duration::from_nanos(amount)),
        _ => None,
    }
}
