//! Particle systems.

use nalgebra::Vector3;

/// A mass-spring network as described, before anything is checked. Columns have one entry per particle or per spring.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NetworkSpec {
    /// m.
    pub positions: Vec<Vector3<f64>>,
    /// m/s.
    pub velocities: Vec<Vector3<f64>>,
    /// kg.
    pub masses: Vec<f64>,
    /// Particles that never move.
    pub fixed: Vec<u32>,
    /// The two particles of each spring.
    pub springs: Vec<[u32; 2]>,
    /// N/m.
    pub stiffness: Vec<f64>,
    /// N s/m.
    pub damping: Vec<f64>,
    /// m; `None` for the distance at the start.
    pub rest_lengths: Option<Vec<f64>>,
    /// m/s².
    pub gravity: Vector3<f64>,
}
