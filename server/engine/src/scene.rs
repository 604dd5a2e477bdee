//! What a scene says, before anything is checked.

use nalgebra::Vector3;
pub use sinew_mapping::{
    Cost, Dimension, Filter, Fit, FitWeights, Geodesics, Kernel, Metric, MovingFit, Paths,
    Polynomial, Preset, RadialBasis, RadialFunction, Recipe, Reference, Roots, Rule, ShapeMatching,
    Start, Weighting,
};
use sinew_mesh::Grid;
use sinew_particles::SystemSpec;

use crate::rule::TopologyRule;

/// A scene as posted. [`crate::World::build`] checks all of it.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Shown to people.
    pub title: String,
    /// Where motion comes from.
    pub motion: Motion,
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// How the points drive the mesh.
    pub mapping: Mapping,
    /// When the motion changes the mesh, and how.
    pub rules: Vec<TopologyRule>,
    /// Simulated time of one step, s.
    pub time_step: f64,
    /// Which axis points up.
    pub up: UpAxis,
    /// What is read at every step.
    pub probes: Vec<Probe>,
}

/// A module of the simulated particles that is read at every step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Probe {
    /// Shown to people.
    pub name: String,
    /// Which.
    pub module: Module,
}

/// A part of a network that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Module {
    /// A particle, by index.
    Particle(u32),
    /// A link.
    Link {
        /// Its batch, by index.
        batch: u32,
        /// Its index in the batch.
        link: u32,
    },
}

/// How the points drive the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    /// Weights, filter, rule.
    pub recipe: Recipe,
    /// Labels of the points that may drive the mesh; empty for every point with a rest position.
    pub points: Vec<String>,
}

/// The axis that points up, for viewers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +Y.
    Y,
    /// +Z.
    Z,
}

/// Where the motion comes from.
#[derive(Clone, Debug)]
pub enum Motion {
    /// Points streamed in.
    External(ExternalPoints),
    /// Particles that the world moves itself, as `sinew.v1.Particles`.
    Particles(Box<SystemSpec>),
    /// The same in its short form, as `sinew.v1.MassSpring`: one batch of springs.
    MassSpring(Box<SystemSpec>),
    /// The same as a solid, as `sinew.v1.ElasticSolid`.
    Elastic(Box<SystemSpec>),
}

impl Motion {
    /// One label per point; particles are labelled by their indices.
    pub fn labels(&self) -> Vec<String> {
        match self {
            Self::External(points) => points.labels.clone(),
            Self::Particles(spec) | Self::MassSpring(spec) | Self::Elastic(spec) => {
                (0..spec.positions.len()).map(|i| i.to_string()).collect()
            }
        }
    }
}

/// Points streamed in.
#[derive(Clone, Debug)]
pub struct ExternalPoints {
    /// One per point.
    pub labels: Vec<String>,
    /// One per point, m.
    pub rest: Vec<Vector3<f64>>,
    /// Points with no position at rest.
    pub absent: Vec<u32>,
    /// For how long, and how far, points are believed.
    pub tracking: Tracking,
}

/// Where the mesh comes from.
#[derive(Clone, Debug)]
pub enum MeshSource {
    /// Given.
    Grid(Grid),
    /// Made around the points.
    Lattice(Lattice),
    /// Made inside a surface.
    Fill(Fill),
}

/// The inside of a closed surface.
#[derive(Clone, Debug)]
pub struct Fill {
    /// The surface.
    pub skin: Grid,
    /// What the cells are.
    pub shape: CellShape,
    /// Distance between neighbouring vertices, m.
    pub spacing: f64,
}

/// A lattice around points and bones.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// What the cells are.
    pub shape: CellShape,
    /// Distance between neighbouring vertices, m.
    pub spacing: f64,
    /// Reach from points and bones, m.
    pub radius: f64,
    /// Segments between points.
    pub bones: Vec<Bone>,
}

/// A segment that a lattice surrounds.
#[derive(Clone, Debug)]
pub struct Bone {
    /// Label of the first point.
    pub from: String,
    /// Label of the second point.
    pub to: String,
    /// Reach from this bone, m.
    pub radius: f64,
}

pub use sinew_mesh::CellShape;

pub use sinew_capture::{Sample as MotionSample, Settings as Tracking};

/// Why a scene is refused: which field, what is wrong with its value, what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {message}")]
pub struct SceneError {
    /// Upper-case name of the kind of problem, such as `VALUE_NOT_FINITE`.
    pub reason: &'static str,
    /// Path of the field in the request, such as `scene.mesh.grid.positions`.
    pub field: String,
    /// What is wrong, with the value, and what to do about it.
    pub message: String,
}
