//! Cases at the edge of what numbers bear.

use nalgebra::Vector3;
use sinew_particles::{Integrator, SystemSpec};

use crate::{INTEGRATORS, build, particles, run, springs};

#[test]
fn ends_that_coincide_or_nearly_so_stay_finite() {
    for gap in [0.0, 1e-9, 1e-300] {
        for integrator in INTEGRATORS {
            let mut system = build(SystemSpec {
                links: vec![springs(vec![[0, 1]], 100.0, 1.0, 1.0)],
                integrator,
                ..particles(vec![
                    Vector3::repeat(0.5),
                    Vector3::repeat(0.5) + Vector3::new(gap, 0.0, 0.0),
                ])
            });
            run(&mut system, 100, 0.01);
            let gap_after = (system.positions()[1] - system.positions()[0]).norm();
            assert!(gap_after.is_finite() && gap_after < 3.0, "{integrator:?}");
        }
    }
}

#[test]
fn a_mass_ratio_of_a_million_is_solved_by_implicit_steps() {
    // 20 and 2,000 times what semi-implicit Euler bears.
    for (integrator, dt) in [
        (Integrator::ImplicitMidpoint, 1e-4),
        (Integrator::LinearlyImplicitEuler, 1e-2),
    ] {
        let masses = vec![1e-3, 1e3, 1e-3, 1e3];
        let mut system = build(SystemSpec {
            velocities: [0.1, 0.0, -0.2, 0.0]
                .map(|v| Vector3::new(v, 0.0, 0.3 * v))
                .to_vec(),
            masses: masses.clone(),
            links: vec![springs(vec![[0, 1], [1, 2], [2, 3]], 1e8, 0.0, None)],
            integrator,
            ..particles(
                (0..4)
                    .map(|i| Vector3::new(f64::from(i), 0.0, 0.0))
                    .collect(),
            )
        });
        let energy = system.energy();
        run(&mut system, 500, dt);
        let growth = system.energy() / energy;
        assert!(growth < 1.0 + 1e-4, "{integrator:?}: {growth}");
    }
}

#[test]
fn a_million_steps_at_rest_move_nothing() {
    let mut system = build(SystemSpec {
        links: vec![springs(vec![[0, 1], [1, 2], [2, 0]], 100.0, 0.1, None)],
        ..particles(vec![
            Vector3::zeros(),
            Vector3::new(0.3, 0.1, 0.2),
            Vector3::new(0.7, -0.1, 0.4),
        ])
    });
    let start = system.positions().to_vec();
    run(&mut system, 1_000_000, 0.01);
    assert_eq!(system.positions(), start);
}

#[test]
fn a_particle_infinitely_far_ends_nothing() {
    for integrator in INTEGRATORS {
        let mut system = build(SystemSpec {
            links: vec![springs(vec![[0, 1]], 100.0, 0.1, None)],
            integrator,
            ..particles(vec![Vector3::zeros(), Vector3::x(), Vector3::repeat(1e150)])
        });
        run(&mut system, 10, 0.01);
        assert_eq!(system.positions()[0], Vector3::zeros());
    }
}
