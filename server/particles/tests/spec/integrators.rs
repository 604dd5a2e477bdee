//! Order, stability, conservation and closed forms of each integrator.

use nalgebra::Vector3;
use sinew_particles::{Diverged, Integrator, Stepping, System, SystemSpec};

use crate::{INTEGRATORS, build, momenta, oscillator, particles, run, springs};

/// A tetrahedron of springs that tumbles and stretches, damped or not.
fn tumbling(damping: f64) -> SystemSpec {
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.1, 0.0],
        [0.2, 0.9, 0.1],
        [0.3, 0.2, 0.8],
    ];
    let edges = vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    SystemSpec {
        velocities: vec![
            Vector3::new(0.3, 0.1, -0.2),
            Vector3::new(-0.1, 0.4, 0.0),
            Vector3::new(0.0, -0.3, 0.3),
            Vector3::new(-0.2, 0.0, -0.1),
        ],
        masses: vec![1.0, 0.7, 1.3, 0.9],
        links: vec![springs(edges, 8.0, damping, 0.9)],
        ..particles(corners.map(Vector3::from).to_vec())
    }
}

fn after(spec: &SystemSpec, integrator: Integrator, seconds: f64, steps: u32) -> System {
    let mut system = build(SystemSpec {
        integrator,
        ..spec.clone()
    });
    run(&mut system, steps as usize, seconds / f64::from(steps));
    system
}

fn distance(a: &System, b: &System) -> f64 {
    let pairs = a.positions().iter().zip(b.positions());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn errors_fall_with_the_order_of_each_integrator() {
    for damping in [0.0, 0.3] {
        let spec = tumbling(damping);
        let exact = after(&spec, Integrator::RungeKutta4, 2.0, 20_000);
        for (integrator, order) in [
            (Integrator::SemiImplicitEuler, 1.0),
            (Integrator::VelocityVerlet, 2.0),
            (Integrator::RungeKutta4, 4.0),
            (Integrator::LinearlyImplicitEuler, 1.0),
            (Integrator::ImplicitMidpoint, 2.0),
        ] {
            let error = |steps| distance(&after(&spec, integrator, 2.0, steps), &exact);
            let found = (error(200) / error(400)).log2();
            assert!(
                (found - order).abs() < 0.15,
                "{integrator:?}, damping {damping}: {found}"
            );
        }
    }
}

#[test]
fn both_momenta_are_conserved_in_every_step() {
    for damping in [0.0, 0.3] {
        let spec = tumbling(damping);
        for integrator in INTEGRATORS {
            // A linear solve stops at a residual, and a linear step turns bodies by its tangent.
            let (linear, angular) = match integrator {
                Integrator::SemiImplicitEuler | Integrator::VelocityVerlet => (1e-14, 1e-14),
                Integrator::ImplicitMidpoint => (1e-10, 1e-10),
                Integrator::RungeKutta4 => (1e-14, 1e-5),
                Integrator::LinearlyImplicitEuler => (1e-8, 1e-2),
            };
            let mut system = build(SystemSpec {
                integrator,
                ..spec.clone()
            });
            for _ in 0..200 {
                let [p, l] = momenta(&system, &spec.masses);
                run(&mut system, 1, 0.05);
                let [p_after, l_after] = momenta(&system, &spec.masses);
                assert!((p_after - p).norm() < linear, "{integrator:?}");
                assert!(
                    (l_after - l).norm() < angular,
                    "{integrator:?}: {}",
                    l_after - l
                );
            }
        }
    }
}

#[test]
fn symplectic_integrators_keep_the_energy_for_a_hundred_thousand_steps() {
    for (integrator, dt, bound) in [
        (Integrator::SemiImplicitEuler, 0.02, 0.1),
        (Integrator::VelocityVerlet, 0.05, 0.02),
    ] {
        let mut system = build(SystemSpec {
            integrator,
            ..tumbling(0.0)
        });
        let start = system.energy();
        let mut worst = |steps: usize| {
            let mut worst = 0.0_f64;
            for _ in 0..steps {
                system.step(dt).unwrap();
                worst = worst.max((system.energy() / start - 1.0).abs());
            }
            worst
        };
        let early = worst(10_000);
        let late = worst(90_000);
        assert!(
            late < bound && late < 1.5 * early,
            "{integrator:?}: {early} {late}"
        );
    }
}

#[test]
fn implicit_midpoint_keeps_the_energy_of_a_linear_oscillator_to_the_solver() {
    let mut system = build(SystemSpec {
        integrator: Integrator::ImplicitMidpoint,
        ..oscillator(1.0, 1.0, 0.0, 0.5, 0.0)
    });
    let start = system.energy();
    run(&mut system, 1_000, 0.5);
    assert!((system.energy() / start - 1.0).abs() < 1e-9);
}

/// The amplification of one step, by closed form: the trace and the determinant of its matrix for x'' = −k x − z x'.
fn amplification(integrator: Integrator, k: f64, z: f64, h: f64) -> [f64; 2] {
    let (kh, zh) = (k * h * h, z * h);
    match integrator {
        Integrator::SemiImplicitEuler => [2.0 - kh - zh, 1.0 - zh],
        Integrator::ImplicitMidpoint => {
            let d = 1.0 + zh / 2.0 + kh / 4.0;
            [2.0 * (1.0 - kh / 4.0) / d, (1.0 - zh / 2.0 + kh / 4.0) / d]
        }
        Integrator::LinearlyImplicitEuler => {
            let d = 1.0 + zh + kh;
            [(2.0 + zh) / d, 1.0 / d]
        }
        Integrator::VelocityVerlet => [2.0 - kh, 1.0],
        Integrator::RungeKutta4 => {
            // Of z = λ h with λ² = −k: the stability polynomial at both eigenvalues.
            let real = 1.0 - kh / 2.0 + kh * kh / 24.0;
            let imaginary = kh.sqrt() * (1.0 - kh / 6.0);
            [2.0 * real, real * real + imaginary * imaginary]
        }
    }
}

#[test]
fn one_oscillator_turns_and_decays_by_the_closed_form() {
    let (k, h) = (3.0, 0.3);
    for integrator in INTEGRATORS {
        let damped = match integrator {
            // Damped by its prediction, and by a quartic: no closed form as short as these.
            Integrator::VelocityVerlet | Integrator::RungeKutta4 => 0.0,
            Integrator::SemiImplicitEuler
            | Integrator::LinearlyImplicitEuler
            | Integrator::ImplicitMidpoint => 0.4,
        };
        let mut system = build(SystemSpec {
            integrator,
            ..oscillator(2.0, 2.0 * k, 2.0 * damped, 0.3, -0.2)
        });
        let mut x = || {
            run(&mut system, 1, h);
            system.positions()[1].x - 10.0
        };
        let [trace, determinant] = amplification(integrator, k, damped, h);
        let [mut before, mut now] = [x(), x()];
        for n in 0..200 {
            let next = x();
            let expected = trace * now - determinant * before;
            assert!(
                (next - expected).abs() < 1e-9,
                "{integrator:?} {n}: {next} {expected}"
            );
            [before, now] = [now, next];
        }
    }
}

#[test]
fn no_oscillator_grows_at_the_step_that_is_promised_and_some_do_just_above() {
    for integrator in [
        Integrator::SemiImplicitEuler,
        Integrator::VelocityVerlet,
        Integrator::RungeKutta4,
    ] {
        for damping in [0.0, 0.1, 0.5, 1.0, 3.0, 10.0] {
            let grows = |factor: f64| {
                let mut system = build(SystemSpec {
                    integrator,
                    ..oscillator(1.0, 1.0, damping, 0.01, 0.0)
                });
                let dt = factor * system.largest_stable_step();
                (0..3_000).any(|_| {
                    system.step(dt).is_err() || (system.positions()[1].x - 10.0).abs() > 1.0
                })
            };
            assert!(!grows(0.95), "{integrator:?} {damping}");
            // Runge and Kutta's region is larger than the half disc that is promised.
            let beyond = if integrator == Integrator::RungeKutta4 {
                1.3
            } else {
                1.05
            };
            let undamped = damping == 0.0;
            assert!(!undamped || grows(beyond), "{integrator:?} {damping}");
        }
    }
}

#[test]
fn implicit_steps_are_stable_where_explicit_ones_are_not() {
    for integrator in [
        Integrator::LinearlyImplicitEuler,
        Integrator::ImplicitMidpoint,
    ] {
        let chain: Vec<[u32; 2]> = (0..19).map(|i| [i, i + 1]).collect();
        let mut system = build(SystemSpec {
            fixed: vec![0],
            links: vec![springs(chain, 1e8, 10.0, None)],
            gravity: Vector3::new(0.0, 0.0, -9.81),
            integrator,
            ..particles(
                (0..20)
                    .map(|i| Vector3::new(f64::from(i), 0.0, 0.0))
                    .collect(),
            )
        });
        assert_eq!(system.largest_stable_step(), f64::INFINITY);
        run(&mut system, 200, 0.01);
        let pairs = system.positions().windows(2);
        let stretch = pairs.map(|pair| ((pair[1] - pair[0]).norm() - 1.0).abs());
        assert!(stretch.fold(0.0, f64::max) < 0.01, "{integrator:?}");
        assert!(system.positions()[19].z < -10.0, "it falls");
    }
}

#[test]
fn stable_substeps_run_what_a_whole_step_would_blow_up() {
    let spec = oscillator(1.0, 1e4, 0.0, 0.1, 0.0);
    let start = build(spec.clone()).energy();
    let mut system = build(SystemSpec {
        stepping: Stepping::Stable { most: 100 },
        ..spec.clone()
    });
    run(&mut system, 1_000, 0.1);
    assert!((system.energy() / start - 1.0).abs() < 0.6);
    let mut timid = build(SystemSpec {
        stepping: Stepping::Stable { most: 9 },
        ..spec
    });
    let refused = timid.step(0.1).unwrap_err();
    assert!(
        matches!(refused, Diverged::Substeps { most: 9, .. }),
        "{refused}"
    );
    assert_eq!(timid.velocities()[1], Vector3::zeros());
}

#[test]
fn adaptive_steps_are_as_exact_as_asked_and_small_only_where_they_must_be() {
    let spec = tumbling(0.1);
    let exact = after(&spec, Integrator::RungeKutta4, 2.0, 20_000);
    for integrator in INTEGRATORS {
        let mut last = f64::INFINITY;
        for tolerance in [1e-5, 1e-7] {
            let mut system = build(SystemSpec {
                integrator,
                stepping: Stepping::Adaptive {
                    tolerance,
                    most: 100_000,
                },
                ..spec.clone()
            });
            run(&mut system, 4, 0.5);
            let error = distance(&system, &exact);
            // The error at a fixed time falls with one power of the step less than that of one substep.
            let order = match integrator {
                Integrator::SemiImplicitEuler | Integrator::LinearlyImplicitEuler => 1.0,
                Integrator::VelocityVerlet | Integrator::ImplicitMidpoint => 2.0,
                Integrator::RungeKutta4 => 4.0,
            };
            let expected = 5.0 * f64::powf(tolerance, order / (order + 1.0));
            assert!(
                error < expected && error < 0.2 * last,
                "{integrator:?}: {error}"
            );
            last = error;
        }
    }
    let mut hopeless = build(SystemSpec {
        stepping: Stepping::Adaptive {
            tolerance: 1e-9,
            most: 3,
        },
        ..spec
    });
    let refused = hopeless.step(1.0).unwrap_err();
    assert!(refused.to_string().contains("more than the 3"), "{refused}");
}
