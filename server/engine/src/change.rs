//! What a step did to the mesh beside moving it.

use nalgebra::Vector3;
use sinew_tearing::{Effect, Patch};

/// The facts of one step. Frames may be missed by a reader, facts may not.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// In the order in which they happened.
    pub events: Vec<Event>,
    /// What they did to the mesh, all at once; `None` where nothing came of them.
    pub patch: Option<Patch>,
}

/// A measured threshold crossing, or what came of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The rule behind it, by index in the scene; `None` where a client asked for it.
    pub rule: Option<u32>,
    /// Where, m.
    pub position: Vector3<f64>,
    /// The cells concerned, by slot.
    pub cells: Vec<u32>,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// A measure crossed its rule's threshold.
    Crossed {
        /// What was measured, in the rule's unit.
        measured: f64,
        /// The threshold.
        threshold: f64,
    },
    /// The mesh came apart along some faces.
    Torn {
        /// How many.
        faces: u32,
    },
    /// The mesh grew together along some faces.
    Glued {
        /// How many.
        faces: u32,
    },
    /// Cells were taken away.
    Removed,
    /// Cells were added.
    Added,
    /// Cells were divided.
    Divided,
    /// An edge was drawn together.
    Collapsed,
    /// Nothing was done; why, for people.
    Refused(String),
    /// What followed from the change before.
    Followed(Effect),
}
