//! Motion/geometry mapping: how moving points drive the vertices of a mesh.
//!
//! A [`Recipe`] names one choice per stage; [`bind`] runs the stages at rest and [`Binding::pose`] the last one every step.
//! Each stage is a function from the value before it to a new value, in a file of its own:
//!
//! ```text
//! targets    the cells that have distances and keep points, and the points of each vertex that follow `[W8]`
//! distance   how far each target is straight from its points   `[W1]`, `[W6]`
//! flood      how far along paths over the mesh, or inside it   `[W7]`, `[W9]`, `[W10]`, `[W12]`, `[W13]`
//! filter     which points it keeps                             `[F1]` to `[F5]`
//! clusters   which vertices keep the same points               `[C1]`
//! weights    how strongly each kept point acts                 `[W2]` to `[W5]`
//! operator   all of it compiled: a linear map `[M1]`, `[M5]` to `[M7]`, `[M10]`, `[M14]`, or one motion per cluster `[M2]` to `[M4]`,
//!            `[M8]`, `[M9]`, `[M13]`, or per vertex `[M15]`
//! ```
//!
//! Displacements are from the rest pose, or from the last one `[M16]`: then the operator is compiled each step. SI units, world frame, double precision. Results have the same bits for
//! any number of threads.
//!
//! ```
//! use nalgebra::Vector3;
//! use sinew_mapping::{bind, Filter, Kernel, Recipe, Reference, Rule, Weighting};
//!
//! let points = [Vector3::zeros(), Vector3::new(2.0, 0.0, 0.0)];
//! let vertices = [Vector3::new(1.0, 0.0, 0.0)];
//! let recipe = Recipe {
//!     weighting: Weighting { kernel: Kernel::Gaussian, ..Weighting::default() },
//!     filter: Filter::KeepK(8),
//!     rule: Rule::WeightedMean,
//!     reference: Reference::Initial,
//! };
//! let mut binding = bind(&vertices, &points, &[true, true], &recipe)?;
//!
//! let lifted = [Vector3::zeros(), Vector3::new(2.0, 0.0, 1.0)];
//! let mut posed = [Vector3::zeros()];
//! binding.pose(&lifted, &mut posed)?;
//! assert_eq!(posed[0], Vector3::new(1.0, 0.0, 0.5)); // halfway between the points: half the motion
//! # Ok::<(), sinew_mapping::MappingError>(())
//! ```
//!
//! The tags in the documentation, such as `[W1]`, are the lines of `EQUATIONS.md`.

mod arcs;
mod barycentric;
mod binding;
mod blocks;
mod buckets;
mod clusters;
mod compile;
mod distance;
mod error;
mod factors;
mod filter;
mod flood;
mod flooded;
mod front;
#[cfg(test)]
mod goldens;
mod graph;
mod interpolation;
mod lanes;
mod linear;
mod moments;
mod moving;
mod paths;
mod preset;
mod quadratic;
mod radial;
mod rbf;
mod recipe;
mod reflood;
mod renewal;
mod roots;
mod rotation;
mod shape;
mod simplices;
mod strays;
mod system;
mod targets;
mod wave;
mod weights;

pub use binding::{Binding, MAX_INFLUENCES, bind, bind_mesh};
pub use error::MappingError;
pub use flood::{Flood, Nearest, Root};
pub use front::{Front, Medium};
pub use graph::{Graph, Rows};
pub use preset::Preset;
pub use rbf::MAX_BASIS;
pub use recipe::{
    Cost, Dimension, Filter, Fit, FitWeights, Geodesics, Kernel, Metric, MovingFit, Paths,
    Polynomial, RadialBasis, RadialFunction, Recipe, Reference, Roots, Rule, ShapeMatching, Start,
    Weighting,
};
pub use renewal::{Change, Renewal, Wiring};
pub use simplices::Simplices;
pub use targets::{Body, Cells, Mesh, distances};
