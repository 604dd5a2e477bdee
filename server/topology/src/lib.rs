//! Oriented combinatorial maps of dimension 2 and 3: any polyhedral mesh, cut, torn and glued without ever becoming
//! inconsistent.
//!
//! This crate knows no coordinates: attributes are columns that follow a map's changes.
//!
//! ```
//! use sinew_topology::{Column, Face, Map, MeshCells, NonManifold, Rules, Vertex};
//!
//! // Two tetrahedra on a face, in VTK's form.
//! let mesh = MeshCells {
//!     vertices: 5,
//!     types: &[10, 10],
//!     connectivity: &[0, 1, 2, 3, 1, 2, 3, 4],
//!     offsets: &[0, 4, 8],
//!     faces: &[],
//!     face_offsets: &[],
//! };
//! let (mut map, _) = Map::build(&mesh, NonManifold::Refuse)?;
//! let mut heights = Column::<Vertex, f64>::from_values(vec![0.0, 1.0, 2.0, 3.0, 4.0]);
//!
//! // Tear them apart: three vertices become six, each with the height that it had.
//! let inner = map.cells::<Face>().find(|&face| map.volumes_of(face).1.is_some());
//! let dart = map.dart(inner.expect("they share a face"));
//! let (_, changes) = map.edit(|edit| edit.unsew3(dart))?;
//! let rules = Rules { split: |height| *height, merge: |kept, _| *kept, make: |_| 0.0 };
//! heights.follow(&changes, &rules);
//! assert_eq!(map.count::<Vertex>(), 8);
//! assert_eq!(heights.values().iter().sum::<f64>(), 10.0 + 1.0 + 2.0 + 3.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adjacency;
mod build;
mod cell_pattern;
mod changes;
mod collapse;
mod column;
mod components;
mod cut;
mod edit;
mod error;
mod export;
mod ids;
mod incidence;
mod input;
mod insert;
mod journal;
mod link;
mod map;
mod orbit;
mod settle;
mod sew;
mod slots;
mod subdivide;
mod violations;
mod volume;

pub use adjacency::{Adjacency, Incidence};
pub use build::{BuildError, BuildReport, NonManifold};
pub use changes::{Changes, Event};
pub use column::{Column, Rules};
pub use components::Component;
pub use cut::{Cut, Place};
pub use edit::Edit;
pub use error::EditError;
pub use export::Exported;
pub use ids::{AnyCell, Cell, Dart, Edge, Face, Id, Kind, Vertex, Volume};
pub use input::{InputError, MeshCells};
pub use insert::VolumeSplit;
pub use map::{Dimension, Map};
pub use orbit::{Orbit, Walk};
pub use violations::Violation;
pub use volume::Added;
