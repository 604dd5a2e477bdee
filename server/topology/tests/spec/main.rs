//! The laws of maps.

mod adjacency;
mod build;
mod columns;
mod cutting;
mod files;
mod random_edits;
mod sewing;
mod shapes;
mod subdividing;
