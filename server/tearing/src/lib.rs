//! Bodies that come apart and grow together: topological events on a live mesh.
//!
//! A [`Body`] is a mesh's 3-map with what outlives single edits: slots for vertices and cells that are only ever appended
//! (so that whoever follows from outside keeps its numbers), the pose at rest, fragments and inner fractures. It is given
//! [`Request`]s, each of which is done wholly or refused wholly, and answers with one [`Patch`].
//!
//! ```
//! use sinew_mesh::shapes;
//! use sinew_tearing::{Answer, Body, Effect, Request};
//!
//! // Two cubes in a row come apart: four vertices become eight, and a fragment is born.
//! let (mut body, _) = Body::new(shapes::hexahedra(2, 1, 1))?;
//! let outcome = body.apply(&[Request::Open { facets: vec![[0, 1]] }]);
//! let Answer::Applied(done) = &outcome.answers[0] else { panic!("refused") };
//! assert_eq!(done.effects, [Effect::FragmentBorn { fragment: 1, parent: 0, cells: 1 }]);
//! let patch = outcome.patch.expect("something changed");
//! assert_eq!(patch.vertex_parents, [4, 10, 7, 1]);
//! assert_eq!(body.rest().len(), 16);
//! # Ok::<(), sinew_tearing::BodyError>(())
//! ```

mod body;
mod commit;
mod fractures;
mod fragments;
mod open;
mod patch;
mod request;

pub use body::{Body, BodyError, BodyReport, Outcome};
pub use patch::{Patch, Seam, SeamKind};
pub use request::{Answer, Done, Effect, Refusal, Request};
