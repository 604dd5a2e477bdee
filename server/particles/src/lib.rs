//! Particle systems: mass-spring networks under gravity, integrated by semi-implicit Euler.
//!
//! A [`NetworkSpec`] says what is wanted, [`Network::new`] checks every value of it, and [`Network::step`] moves the
//! particles. SI units, world frame, double precision. Results have the same bits for any number of threads.
//!
//! ```
//! use nalgebra::Vector3;
//! use sinew_particles::{Network, NetworkSpec};
//!
//! let mut network = Network::new(NetworkSpec {
//!     positions: vec![Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0)],
//!     velocities: vec![Vector3::zeros(); 2],
//!     masses: vec![1.0, 0.5],
//!     fixed: vec![0],
//!     springs: vec![[0, 1]],
//!     stiffness: vec![100.0],
//!     damping: vec![0.1],
//!     rest_lengths: None,
//!     gravity: Vector3::new(0.0, 0.0, -9.81),
//! })?;
//! let dt = 0.5 * network.largest_stable_step();
//! for _ in 0..100 {
//!     network.step(dt)?;
//! }
//! assert_eq!(network.positions()[0], Vector3::zeros());
//! assert!(network.positions()[1].z < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The tags in the documentation, such as `[P1]`, are the lines of `EQUATIONS.md`.

mod error;
mod network;
mod spec;

pub use error::{Diverged, NetworkError};
pub use network::Network;
pub use spec::NetworkSpec;
