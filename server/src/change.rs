//! What clients ask a session to change.

use std::sync::Arc;

use sinew_engine::{Bound, Request};
use sinew_proto::v1;

/// A change of the mesh that a client asks for.
pub(crate) struct Edit {
    pub(crate) requests: Vec<Request>,
    /// The same, as the client sent them.
    pub(crate) sent: Arc<[v1::MeshEdit]>,
    /// The topology version that it was made for; refused where that stands no more.
    pub(crate) expected: Option<u64>,
}

/// A new mapping.
#[derive(Debug)]
pub(crate) struct Remap {
    /// The one that it was made from; refused where that stands no more.
    pub(crate) base: Arc<v1::Mapping>,
    pub(crate) mapping: Arc<v1::Mapping>,
    /// The same, bound to the session's rest pose.
    pub(crate) bound: Bound,
    pub(crate) blend_seconds: f64,
    pub(crate) effect: Effect,
}

/// Whether a change is made or only checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effect {
    Made,
    Checked,
}
