//! When the motion changes the mesh, and how.

use nalgebra::Vector3;

/// Watches a measure of every step and acts where it crosses a threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct TopologyRule {
    /// What is measured, of what.
    pub measure: Measure,
    /// Where the rule acts: the measure is at least this, > 0 `[E3]`; of gaps, at most this.
    pub threshold: f64,
    /// How far below the threshold the measure must fall before the rule can act on the same thing again, 0 or more and
    /// no more than the threshold `[E3]`; of gaps, how far above it, without end.
    pub hysteresis: f64,
    /// What it is limited to.
    pub limits: Limits,
    /// What it does.
    pub action: Action,
}

/// What is measured at each step. All but gaps are relative to rest and have no unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Measure {
    /// The distance of two points. `[E1]`
    Points {
        /// Longer or shorter.
        strain: Strain,
        /// Which points.
        pairs: Pairs,
    },
    /// The length of a cell's edges; of each cell the edge that crosses farthest. `[E1]`
    Edges(Strain),
    /// The area of a cell's faces; of each cell the face that crosses farthest. `[E1]`
    Faces(Strain),
    /// The signed volume of a cell: one that is squeezed flat is compressed by 1, one that is inside out by more. `[E1]`
    Volumes(Strain),
    /// How badly the points of a cell's clusters fit a rigid motion; of each cell the worst. `[E2]`
    Fit,
    /// How far apart the two sides are of each face that came apart, m: the greatest distance of two vertices that were one.
    /// `[E5]` What has just come apart counts once it was farther than the threshold and the hysteresis.
    Gaps,
}

/// Which way a thing departs from rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strain {
    /// By how much of its rest size it has grown.
    Elongation,
    /// By how much of its rest size it has shrunk.
    Compression,
}

/// Pairs of points.
#[derive(Clone, Debug, PartialEq)]
pub enum Pairs {
    /// These, by label.
    Named(Vec<[String; 2]>),
    /// All at most this far apart at rest, m.
    Within(f64),
}

/// What a rule is limited to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// Only what is in this box at rest: cells by the mean of their vertices, pairs of points by their middle.
    pub region: Option<Region>,
    /// Only from this simulated time on, s.
    pub from: Option<f64>,
    /// Only up to this simulated time, s.
    pub until: Option<f64>,
    /// Only these faces, each by the cells of the mesh at rest on its two sides: cells beside none of them are not
    /// measured, and no other face comes apart. Empty for no such limit.
    pub seam: Vec<[u32; 2]>,
}

/// A box along the axes, at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Least coordinates, m.
    pub min: Vector3<f64>,
    /// Greatest coordinates, m.
    pub max: Vector3<f64>,
}

impl Region {
    pub(crate) fn contains(&self, place: &Vector3<f64>) -> bool {
        (0..3).all(|axis| (self.min[axis]..=self.max[axis]).contains(&place[axis]))
    }
}

impl Limits {
    pub(crate) fn contain(&self, place: &Vector3<f64>) -> bool {
        self.region.is_none_or(|region| region.contains(place))
    }

    pub(crate) fn open_at(&self, time: f64) -> bool {
        self.from.is_none_or(|from| time >= from) && self.until.is_none_or(|until| time <= until)
    }
}

/// What a rule does where its measure crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Only says so.
    Report,
    /// Tears the mesh along the frontier between the areas of the two measured points.
    Separate,
    /// Opens the faces between the measured cells and their neighbours; with a seam, only its faces.
    Open,
    /// Takes the measured cells away.
    Remove,
    /// Divides the measured cells.
    Subdivide,
    /// Makes one face again of the two sides of measured gaps.
    Glue,
}
