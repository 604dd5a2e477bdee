//! The laws of worlds.

mod common;
mod remap;
mod rules;
mod tearing;
mod world;
