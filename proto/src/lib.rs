//! The API `sinew.v1`: messages, clients and servers generated from `proto/sinew/v1`, with protobuf's JSON mapping
//! on every message.

mod columns;

pub use columns::ColumnError;

/// `sinew.v1`.
pub mod v1 {
    #![allow(
        missing_docs,
        unused_qualifications,
        unreachable_pub,
        clippy::all,
        clippy::allow_attributes_without_reason,
        clippy::cast_possible_truncation,
        clippy::missing_errors_doc,
        clippy::too_many_lines,
        clippy::unwrap_used,
        clippy::wildcard_enum_match_arm,
        clippy::disallowed_types,
        reason = "generated code"
    )]

    tonic::include_proto!("sinew.v1");
    include!(concat!(env!("OUT_DIR"), "/sinew.v1.serde.rs"));
}

/// The serialised descriptor set of `sinew.v1`, for reflection.
pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));

/// The field mask and the timestamp of the JSON mapping.
pub use pbjson_types::{FieldMask, Timestamp};
