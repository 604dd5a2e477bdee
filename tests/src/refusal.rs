//! What a client can learn from a refusal.

use prost::Message as _;
use tonic::{Code, Status};
use tonic_types::{BadRequest, ErrorInfo, FieldViolation, StatusExt as _};

/// A `google.rpc.Status` whose form was checked: exactly one ErrorInfo of this domain, and at most one BadRequest
/// with exactly one field.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The code.
    pub code: Code,
    /// The ErrorInfo's reason.
    pub reason: String,
    /// The field to blame, where there is one.
    pub field: Option<String>,
    /// For people.
    pub message: String,
}

impl Refusal {
    /// Reads a status.
    ///
    /// # Panics
    /// If it has not the form that every refusal has.
    pub fn of(status: Status) -> Self {
        let raw = tonic_types::pb::Status::decode(status.details());
        let raw = raw.unwrap_or_else(|error| panic!("{status:?} has garbled details: {error}"));
        assert_eq!(raw.code, i32::from(status.code()), "{status:?}");
        let kinds = |kind: &str| {
            let of_kind = raw
                .details
                .iter()
                .filter(|any| any.type_url.ends_with(kind));
            of_kind.count()
        };
        let infos = kinds("google.rpc.ErrorInfo");
        assert_eq!(infos, 1, "{status:?} has {infos} ErrorInfos");
        let blames = kinds("google.rpc.BadRequest");
        assert!(blames <= 1, "{status:?} has {blames} BadRequests");
        assert_eq!(raw.details.len(), infos + blames, "{status:?}");

        let details = status.get_error_details();
        let ErrorInfo { reason, domain, .. } = details.error_info().unwrap().clone();
        assert_eq!(domain, "sinew.v1", "{status:?}");
        let upper = |b: u8| b.is_ascii_uppercase() || b == b'_';
        assert!(!reason.is_empty() && reason.bytes().all(upper), "{reason}");
        assert!(!status.message().is_empty(), "{reason} says nothing");
        let field = details
            .bad_request()
            .map(|BadRequest { field_violations }| {
                let [
                    FieldViolation {
                        field, description, ..
                    },
                ] = field_violations.as_slice()
                else {
                    panic!("{status:?} blames {field_violations:?}");
                };
                assert!(!field.is_empty() && !description.is_empty(), "{status:?}");
                field.clone()
            });
        Self {
            code: status.code(),
            reason,
            field,
            message: status.message().to_owned(),
        }
    }
}

/// Expects a refusal with this code and reason.
///
/// # Panics
/// If there is none, or another.
#[track_caller]
pub fn refused<T>(answer: Result<T, Refusal>, code: Code, reason: &str) -> Refusal {
    let Err(refusal) = answer else {
        panic!("{reason} was expected, and nothing was refused");
    };
    assert_eq!(
        (refusal.code, refusal.reason.as_str()),
        (code, reason),
        "{refusal:?}"
    );
    refusal
}
