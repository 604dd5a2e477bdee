//! What particle systems promise.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

mod columns;
mod goldens;
mod hard;
mod integrators;
mod links;
mod networks;
mod pair_goldens;
mod pairs;
mod paper;
mod refusals;
mod rotation;
mod society;
mod solid;
mod surfaces;
mod threads;

use nalgebra::Vector3;
use sinew_particles::{Elastic, Integrator, LinkLaw, Links, System, SystemSpec};

const INTEGRATORS: [Integrator; 5] = [
    Integrator::SemiImplicitEuler,
    Integrator::VelocityVerlet,
    Integrator::RungeKutta4,
    Integrator::LinearlyImplicitEuler,
    Integrator::ImplicitMidpoint,
];

/// Particles of mass 1 at rest at these places.
fn particles(positions: Vec<Vector3<f64>>) -> SystemSpec {
    SystemSpec {
        velocities: vec![Vector3::zeros(); positions.len()],
        masses: vec![1.0; positions.len()],
        positions,
        ..SystemSpec::default()
    }
}

/// Springs that are all alike.
fn springs(
    ends: Vec<[u32; 2]>,
    stiffness: f64,
    damping: f64,
    rest_length: impl Into<Option<f64>>,
) -> Links {
    let links = ends.len();
    Links {
        ends,
        law: LinkLaw::Spring(elastic(links, stiffness, damping, rest_length)),
    }
}

fn elastic(
    links: usize,
    stiffness: f64,
    damping: f64,
    rest_length: impl Into<Option<f64>>,
) -> Elastic {
    Elastic {
        stiffness: vec![stiffness; links],
        damping: vec![damping; links],
        rest_lengths: rest_length.into().map(|length| vec![length; links]),
    }
}

fn build(spec: SystemSpec) -> System {
    System::new(spec).unwrap()
}

fn run(system: &mut System, steps: usize, dt: f64) {
    for _ in 0..steps {
        system.step(dt).unwrap();
    }
}

/// Linear and angular momentum, about the origin.
fn momenta(system: &System, masses: &[f64]) -> [Vector3<f64>; 2] {
    let linear = system.velocities().iter().zip(masses).map(|(v, &m)| v * m);
    let moving = system.positions().iter().zip(system.velocities());
    let orbital = moving.zip(masses).map(|((x, v), &m)| x.cross(v) * m);
    let own: Vector3<f64> = system.angular_momenta().iter().sum();
    [linear.sum(), orbital.sum::<Vector3<f64>>() + own]
}

/// A mass on a spring of rest length 10 along x, anchored at the origin.
fn oscillator(mass: f64, stiffness: f64, damping: f64, x: f64, v: f64) -> SystemSpec {
    SystemSpec {
        velocities: vec![Vector3::zeros(), Vector3::new(v, 0.0, 0.0)],
        masses: vec![1.0, mass],
        fixed: vec![0],
        links: vec![springs(vec![[1, 0]], stiffness, damping, 10.0)],
        ..particles(vec![Vector3::zeros(), Vector3::new(10.0 + x, 0.0, 0.0)])
    }
}
