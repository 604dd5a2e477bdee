//! Markers at one moment.

use nalgebra::Vector3;

/// Markers at one moment, as a source sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The source's number for this moment.
    pub sequence: u64,
    /// When it was seen, s, on the source's clock.
    pub time: f64,
    /// One per marker, m; not read where not seen.
    pub positions: Vec<Vector3<f64>>,
    /// Whether each marker is seen and labelled.
    pub seen: Vec<bool>,
}
