//! One scene: points that move, a mesh that follows, one step at a time. Pure: no clock, no hidden
//! randomness, no IO; threads only as the caller's rayon pool has them.

mod blend;
mod build;
mod cells;
mod change;
mod digest;
mod explain;
mod frame;
mod gauge;
mod modules;
mod particles;
mod refusal;
mod rest;
mod rule;
mod rules;
mod scene;
mod topology;
mod wiring;
mod world;

pub use change::{Change, Event, EventKind};
pub use explain::{Cluster, Explanation, Influence};
pub use frame::{Doubt, Frame, Layout, Measured, PointState};
pub use modules::{LinkModules, LinkSelection, Modules, ReadError, Selection};
pub use rest::{Bound, Rest};
pub use rule::{Action, Limits, Measure, Pairs, Region, Strain, TopologyRule};
pub use scene::{
    Bone, CellShape, Cost, Dimension, ExternalPoints, Fill, Filter, Fit, FitWeights, Geodesics,
    Kernel, Lattice, Mapping, MeshSource, Metric, Module, Motion, MotionSample, MovingFit, Paths,
    Polynomial, Preset, Probe, RadialBasis, RadialFunction, Recipe, Reference, Roots, Rule, Scene,
    SceneError, ShapeMatching, Start, Tracking, UpAxis, Weighting,
};
pub use sinew_capture::{Buffer, Clock, Delay, Exchange, Verdict};
pub use sinew_mapping::Nearest;
pub use sinew_particles::{
    Attraction, AttractionLaw, Dimension as SolidDimension, Driven, Elastic, EndingKind,
    ExternalForce, Form, FrameSpec, Gradient, Integration, Integrator, LinkLaw, Links, Material,
    MaterialLaw, Metric as SolidMetric, Normalisation, PairFriction, PairSpec, Reach, Repulsion,
    SolidSpec, Stepping, Surface, SystemSpec, Track, Weighting as FormWeighting, surface,
};
pub use sinew_tearing::{
    Answer, BodyError, Done, Effect, Facet, Patch, Refusal, Request, Seam, SeamKind,
};
pub use topology::{EditError, Edited};
pub use world::{Drag, RemapError, StepError, World};
