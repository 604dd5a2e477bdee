//! What a step leaves behind for everyone who looks.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use sinew_mesh::Cells;

use crate::change::Change;

pub use sinew_capture::{Doubt, State as PointState};

/// All of the mesh that stays the same between topology changes.
#[derive(Debug, PartialEq)]
pub struct Layout {
    /// Vertex slots are append-only within an epoch.
    pub epoch: u64,
    /// Grows by one with each topology change.
    pub topology_version: u64,
    /// [`Cells::hash`] of the cells.
    pub hash: u64,
    /// The cells.
    pub cells: Arc<Cells>,
    /// For each vertex the point with the greatest weight.
    pub dominant: Vec<u32>,
}

/// How near a rule is to acting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The rule, by index in the scene.
    pub rule: u32,
    /// The greatest of all that it measures, in its unit. What cannot have crossed since it was measured last counts as
    /// it was then.
    pub greatest: f64,
    /// Where it acts.
    pub threshold: f64,
}

/// The state at one step; never changes once made.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The mesh these positions belong to.
    pub layout: Arc<Layout>,
    /// Frames before this one: those of steps, and those of edits between two steps.
    pub sequence: u64,
    /// Steps taken.
    pub step: u64,
    /// Simulated time, s.
    pub time_seconds: f64,
    /// Capture time of the motion sample behind this step, s.
    pub capture_time_seconds: Option<f64>,
    /// Sequence of that sample.
    pub motion_sequence: Option<u64>,
    /// Point positions, m.
    pub points: Vec<Vector3<f64>>,
    /// World from body, one per point; empty where the points have no orientation.
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// One per point.
    pub point_states: Vec<PointState>,
    /// The points whose samples were not believed at this step, ascending.
    pub doubts: Vec<(u32, Doubt)>,
    /// Vertex positions, m.
    pub vertices: Vec<Vector3<f64>>,
    /// What each rule measured at this step; without rules, and where a rule measured nothing, nothing.
    pub measures: Vec<Measured>,
    /// Of each probe of the scene, in order: a particle's position, m, or a link's force on its second end, N.
    pub readings: Vec<Vector3<f64>>,
    /// What this step did to the mesh beside moving it; `None` in the ordinary case.
    pub change: Option<Arc<Change>>,
}
