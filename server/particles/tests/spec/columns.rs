//! What a system remembers between steps: columns for what it declares, and no others.

use nalgebra::{UnitQuaternion, Vector3};
use sinew_particles::{FrameSpec, Integrator, LinkLaw, Links, SystemSpec};

use super::{build, elastic, particles, springs};

const PARTICLES: usize = 100;
const LINKS: usize = PARTICLES - 1;
/// Bytes of a vector.
const VECTOR: usize = 24;

fn ends() -> Vec<[u32; 2]> {
    (1..).take(LINKS).map(|i| [i - 1, i]).collect()
}

fn chain(links: Links, frames: Option<FrameSpec>, integrator: Integrator) -> SystemSpec {
    let place = |i: u32| Vector3::new(f64::from(i), 0.0, 0.0);
    SystemSpec {
        links: vec![links],
        frames,
        integrator,
        ..particles((0..).take(PARTICLES).map(place).collect())
    }
}

fn frames() -> Option<FrameSpec> {
    Some(FrameSpec {
        orientations: vec![UnitQuaternion::identity(); PARTICLES],
        spins: vec![Vector3::zeros(); PARTICLES],
        moments: vec![Vector3::repeat(1.0); PARTICLES],
        damping: 0.0,
    })
}

/// Bytes of state beside positions after a step.
fn bytes(spec: SystemSpec) -> usize {
    let mut system = build(spec);
    system.step(1e-3).unwrap();
    system
        .hidden_state()
        .into_iter()
        .map(size_of_val::<[f64]>)
        .sum()
}

#[test]
fn points_have_no_column_of_orientations_nor_of_torques() {
    let spring = || springs(ends(), 1.0, 0.0, None);
    let euler = Integrator::SemiImplicitEuler;
    assert_eq!(bytes(chain(spring(), None, euler)), PARTICLES * VECTOR);
    let framed = bytes(chain(spring(), frames(), euler));
    assert_eq!(framed, PARTICLES * (2 * VECTOR + 32));
    // Verlet keeps the last forces, and torques where there are some.
    let verlet = Integrator::VelocityVerlet;
    let kept = bytes(chain(spring(), None, verlet)) - PARTICLES * VECTOR;
    assert_eq!(kept, PARTICLES * VECTOR);
    assert_eq!(
        bytes(chain(spring(), frames(), verlet)) - framed,
        2 * PARTICLES * VECTOR
    );
    let points = build(chain(spring(), None, euler));
    assert!(points.orientations().is_none() && points.angular_momenta().is_empty());
    let [forces, torques] = points.loads();
    assert_eq!((forces.len(), torques.len()), (PARTICLES, 0));
}

#[test]
fn links_remember_what_their_law_needs_and_springs_nothing() {
    let elastic = || elastic(LINKS, 1.0, 0.1, None);
    let laws = [
        (LinkLaw::Spring(elastic()), 0),
        (LinkLaw::Contact(elastic()), 0),
        (
            LinkLaw::Breaking {
                elastic: elastic(),
                elongations: vec![1.0; LINKS],
            },
            8,
        ),
        (
            LinkLaw::Plastic {
                elastic: elastic(),
                yields: vec![1.0; LINKS],
            },
            8,
        ),
        (
            LinkLaw::Friction {
                stiffness: vec![1.0; LINKS],
                limits: vec![1.0; LINKS],
            },
            VECTOR,
        ),
        (
            LinkLaw::Table {
                lengths: vec![1.0, 2.0],
                forces: vec![0.0, -1.0],
            },
            0,
        ),
    ];
    for (law, each) in laws {
        let links = Links { ends: ends(), law };
        let found = bytes(chain(links, None, Integrator::SemiImplicitEuler));
        assert_eq!(found - PARTICLES * VECTOR, LINKS * each);
    }
}
