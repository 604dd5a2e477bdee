//! The service as its users meet it: real servers on ports of their own, driven through the generated client.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod determinism;
mod edits;
mod elastic;
mod events;
mod explain;
mod faults;
mod floods;
mod guards;
mod http;
mod lifecycle;
mod mappings;
mod modules;
mod motion;
mod motion_door;
mod motion_live;
mod particles;
mod record;
mod refusals;
mod remap;
mod shutdown;
mod slow;
mod streaming;
mod tearing;
mod tidy;
