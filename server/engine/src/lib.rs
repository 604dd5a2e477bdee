//! One scene: points that move, a mesh that follows, one step at a time. Pure: no clock, no threads of its own, no IO.

mod frame;
mod scene;

pub use frame::{Frame, Layout, PointState};
pub use scene::{
    Bone, CellShape, ExternalPoints, Lattice, Mapping, MassSpring, MeshSource, Motion,
    MotionSample, Scene, SceneError, UpAxis,
};
