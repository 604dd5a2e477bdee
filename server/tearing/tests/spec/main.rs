//! The laws of bodies.

mod common;
mod figures;
mod hard;
mod parts;
mod requests;
