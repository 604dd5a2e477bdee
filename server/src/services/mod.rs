//! The RPCs: from requests to sessions and back. No rule of the domain is decided here.

mod asset;
mod edit;
mod frames;
mod mapping;
mod mesh;
mod modules;
mod motion;
mod page;
mod reader;
mod session;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use tokio_util::task::TaskTracker;

use crate::{
    assets::Assets, config::Config, kernels::Kernels, metrics::Metrics, registry::Registry,
};

/// What all services share.
#[derive(Clone)]
pub(crate) struct Shared {
    pub(crate) config: Arc<Config>,
    pub(crate) registry: Arc<Registry>,
    pub(crate) assets: Arc<Assets>,
    pub(crate) kernels: Kernels,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) viewer: sinew_viewer::Viewer,
    /// Tasks behind sessions and streams; shutdown waits for them.
    pub(crate) tasks: TaskTracker,
}
