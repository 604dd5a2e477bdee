//! One scene: points that move, a mesh that follows, one step at a time. Pure: no clock, no hidden
//! randomness, no IO; threads only as the caller's rayon pool has them.

mod build;
mod digest;
mod frame;
mod scene;
mod world;

pub use frame::{Frame, Layout, PointState};
pub use scene::{
    Bone, CellShape, ExternalPoints, Filter, Kernel, Lattice, Mapping, MassSpring, MeshSource,
    Motion, MotionSample, Recipe, Rule, Scene, SceneError, UpAxis, Weighting,
};
pub use world::{StepError, World};
