//! The laws of worlds.

mod common;
mod following;
mod rebinding;
mod remap;
mod rules;
mod tearing;
mod world;
