//! Polyhedral meshes as VTK's unstructured grids: what they are, what is wrong with them, their surface, and lattices
//! made around points or inside a surface. This crate knows coordinates; it knows no motion and no file.
//!
//! Whatever comes from outside passes [`Grid::check`] first; every other function takes a checked grid for granted.

mod adjacency;
mod cell_faces;
mod check;
mod complex;
mod fill;
mod grid;
mod holders;
mod inspect;
mod lattice;
mod measure;
mod patch;
mod repair;
pub mod shapes;
mod solid;
mod stuffing;
mod surface;
mod winding;

pub use cell_faces::Face;
pub use check::GridError;
pub use complex::{Complex, Dimension, MOST_NEIGHBOURS, Table, TooManyNeighbours};
pub use fill::{FillError, fill};
pub use grid::{Cell, CellShape, CellType, Cells, Grid};
pub use inspect::{Inspection, inspect};
pub use lattice::{Capsule, LatticeError, lattice};
pub use measure::{area, cell_volume, face_area, quality, scaled_jacobian, volume};
pub use patch::PatchError;
pub use repair::{Fault, Repairs, repair};
pub use solid::MOST_CELLS;
pub use surface::{Surface, split_surface, surface, vertex_normals};
