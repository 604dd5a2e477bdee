//! Particle systems: masses and bodies with an orientation, joined by links of many laws.
//!
//! A [`SystemSpec`] says what is wanted, [`System::new`] checks every value of it, and [`System::step`] moves the
//! particles. SI units, world frame, double precision. Results have the same bits for any number of threads.
//!
//! ```
//! use nalgebra::Vector3;
//! use sinew_particles::{Elastic, LinkLaw, Links, System, SystemSpec};
//!
//! let mut system = System::new(SystemSpec {
//!     positions: vec![Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0)],
//!     velocities: vec![Vector3::zeros(); 2],
//!     masses: vec![1.0, 0.5],
//!     fixed: vec![0],
//!     links: vec![Links {
//!         ends: vec![[0, 1]],
//!         law: LinkLaw::Spring(Elastic {
//!             stiffness: vec![100.0],
//!             damping: vec![0.1],
//!             rest_lengths: None,
//!         }),
//!     }],
//!     gravity: Vector3::new(0.0, 0.0, -9.81),
//!     ..SystemSpec::default()
//! })?;
//! let dt = 0.5 * system.largest_stable_step();
//! for _ in 0..100 {
//!     system.step(dt)?;
//! }
//! assert_eq!(system.positions()[0], Vector3::zeros());
//! assert!(system.positions()[1].z < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The tags in the documentation, such as `[P1]`, are the lines of `EQUATIONS.md`.

mod check;
mod drags;
mod error;
mod guard;
mod integrate;
mod krylov;
mod links;
mod measure;
mod model;
mod neighbours;
mod pairs;
mod rows;
mod shapes;
mod solid;
mod spec;
mod state;
mod stepping;
mod surface;
mod system;
mod track;

pub use error::{Diverged, Fault, SpecError};
pub use links::{Elastic, LinkLaw, Links};
pub use measure::oscillation;
pub use pairs::{
    Attraction, AttractionLaw, EndingKind, Form, Gradient, Normalisation, PairFriction, PairSpec,
    Repulsion, Weighting,
};
pub use shapes::{TooCurved, arc_chain};
pub use solid::{
    Dimension, Integration, Material, MaterialLaw, Metric, Reach, Solid, SolidReport, SolidSpec,
    Survey,
};
pub use spec::{Driven, ExternalForce, FrameSpec, Integrator, Stepping, SystemSpec};
pub use surface::{Surface, surface};
pub use system::{Link, System};
pub use track::Track;
