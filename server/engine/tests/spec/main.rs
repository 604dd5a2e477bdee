//! The laws of worlds.

mod common;
mod following;
mod gluing;
mod rebinding;
mod remap;
mod rules;
mod tearing;
mod world;
