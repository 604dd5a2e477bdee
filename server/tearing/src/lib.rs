//! Bodies that come apart and grow together: topological events on a live mesh.
//!
//! A [`Body`] is a mesh's 3-map with what outlives single edits: slots for vertices and cells that are only ever appended
//! (so that whoever follows from outside keeps its numbers), the pose at rest, fragments and inner fractures. It is given
//! [`Request`]s, each of which is done wholly or refused wholly, and answers with one [`Patch`].
//!
//! ```
//! use nalgebra::Vector3;
//! use sinew_mapping::{bind, Filter, Recipe, Reference, Rule, Weighting};
//! use sinew_mesh::shapes;
//! use sinew_tearing::{Answer, Body, Effect, Request, View};
//!
//! // Two cubes in a row, one point at each end; the two points nearest to a vertex move it.
//! let (mut body, _) = Body::new(shapes::hexahedra(2, 1, 1))?;
//! let points = [Vector3::new(0.0, 0.25, 0.25), Vector3::new(1.0, 0.25, 0.25)];
//! let recipe = Recipe {
//!     weighting: Weighting::default(),
//!     filter: Filter::Interval { nearest: 0.0, farthest: 0.75 },
//!     rule: Rule::WeightedMean,
//!     reference: Reference::Initial,
//! };
//! let binding = bind(body.rest(), &points, &[true, true], &recipe).expect("they can be bound");
//!
//! // They come apart between the points: the four vertices that both move become eight, and a fragment is born.
//! let view = View { binding: &binding, points: &points, now: &body.rest().to_vec() };
//! let outcome = body.apply(&[Request::Separate { points: [0, 1] }], &view);
//! let Answer::Applied(done) = &outcome.answers[0] else { panic!("refused") };
//! assert_eq!(done.effects, [Effect::FragmentBorn { fragment: 1, parent: 0, cells: 1 }]);
//! let patch = outcome.patch.expect("something changed");
//! assert_eq!(patch.vertex_parents.len(), 4);
//! assert_eq!(body.rest().len(), 16);
//! # Ok::<(), sinew_tearing::BodyError>(())
//! ```

mod add;
mod areas;
mod body;
mod commit;
mod cut;
mod fractures;
mod fragments;
mod glue;
mod ledger;
mod open;
mod patch;
mod refine;
mod request;
mod separate;
mod shape;

pub use areas::View;
pub use body::{Body, BodyError, BodyReport, Outcome};
pub use patch::{Patch, Seam, SeamKind};
pub use request::{Answer, Done, Effect, Facet, Refusal, Request};
