//! Polyhedral meshes as VTK's unstructured grids: what they are, what is wrong with them, their surface, and lattices
//! made around points. This crate knows coordinates; it knows no motion and no file.

mod grid;

pub use grid::{CellShape, CellType, Cells, Grid};
