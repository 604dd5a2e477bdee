//! Laws that hold for any cloud.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use sinew_particles::{
    Dimension, Integration, Integrator, MaterialLaw, Metric, Solid, SolidSpec, System, SystemSpec,
};

use super::{LAWS, block, material, noise, shaken, statics};
use crate::{INTEGRATORS, momenta, run};

const YOUNG: f64 = 1e4;

fn spec(law: MaterialLaw) -> SolidSpec {
    SolidSpec::new(material(YOUNG, 0.3, law), 1_000.0)
}

/// Irregular, so that nothing holds by symmetry.
fn cloud() -> Vec<Vector3<f64>> {
    shaken(block([6, 5, 5], 0.1), 0.03, 7)
}

fn turn(angle: f64) -> Matrix3<f64> {
    let axis = Unit::new_normalize(Vector3::new(1.0, 2.0, -0.5));
    *Rotation3::from_axis_angle(&axis, angle).matrix()
}

fn moved(points: &[Vector3<f64>], by: &Matrix3<f64>, to: Vector3<f64>) -> Vec<Vector3<f64>> {
    points.iter().map(|x| by * x + to).collect()
}

fn most(vectors: &[Vector3<f64>]) -> f64 {
    vectors.iter().map(Vector3::amax).fold(0.0, f64::max)
}

/// What a strain of 1 would push a particle by, N.
fn scale() -> f64 {
    YOUNG * 0.1 * 0.1
}

fn plate() -> (Vec<Vector3<f64>>, SolidSpec) {
    let plane = SolidSpec {
        dimension: Dimension::Plane,
        ..spec(MaterialLaw::Linear)
    };
    (shaken(block([14, 11, 0], 0.1), 0.03, 3), plane)
}

#[test]
fn a_linear_displacement_has_its_gradient_at_every_point_of_any_cloud() {
    let by = Matrix3::new(0.3, -0.2, 0.5, 0.1, 0.7, -0.4, 0.2, 0.6, -0.1);
    let points = cloud();
    for integration in [Integration::Nodal, Integration::Consistent] {
        for metric in [
            Metric::Geodesic { exponent: 1.0 },
            Metric::Geodesic { exponent: 4.0 },
            Metric::Graded {
                gap: 1.8,
                exponent: 6.0,
            },
        ] {
            let solid = Solid::new(
                &SolidSpec {
                    integration,
                    metric,
                    ..spec(MaterialLaw::Linear)
                },
                &points,
            )
            .unwrap();
            let values = moved(&points, &by, Vector3::new(1.0, -2.0, 3.0));
            for i in 0..points.len() {
                let error = (solid.gradient(i, &values) - by).amax();
                assert!(error < 1e-10, "{integration:?} {metric:?}: {error}");
            }
        }
    }
}

/// Patch test: where the outer points follow a linear displacement, the inner ones are in balance where they follow it,
/// too.
#[test]
fn an_irregular_cloud_stretched_at_its_surface_is_stretched_evenly_inside() {
    let (points, spec) = plate();
    let mut solid = Solid::new(&spec, &points).unwrap();
    let by = Matrix3::new(0.01, 0.004, 0.0, -0.002, -0.006, 0.0, 0.0, 0.0, 0.0);
    let inside = |x: &Vector3<f64>| (0.19..1.21).contains(&x.x) && (0.19..0.91).contains(&x.y);
    let free: Vec<bool> = points.iter().map(inside).collect();
    // Displacements from those at the surface alone, through the forces that they cause.
    let held: Vec<_> = points
        .iter()
        .zip(&free)
        .map(|(x, free)| if *free { Vector3::zeros() } else { by * x })
        .collect();
    let at: Vec<_> = points.iter().zip(&held).map(|(x, u)| x + u).collect();
    let load = solid.forces(&at);
    let found = statics(&mut solid, &points, &load, &free);
    let inner = found
        .iter()
        .zip(&points)
        .zip(&free)
        .filter(|(_, free)| **free);
    let error = inner
        .map(|((u, x), _)| (u - by * x).amax())
        .fold(0.0, f64::max);
    assert!(error < 1e-10, "{error}");

    let nodal = SolidSpec {
        integration: Integration::Nodal,
        ..spec
    };
    let mut solid = Solid::new(&nodal, &points).unwrap();
    let load = solid.forces(&at);
    let found = statics(&mut solid, &points, &load, &free);
    let error = found.iter().zip(&points).map(|(u, x)| (u - by * x).amax());
    assert!(
        error.fold(0.0, f64::max) > 1e-4,
        "nodal integration alone would do"
    );
}

#[test]
fn rigid_motions_meet_no_force() {
    let points = cloud();
    for law in LAWS {
        let mut solid = Solid::new(&spec(law), &points).unwrap();
        let shifted = moved(&points, &Matrix3::identity(), Vector3::new(3.0, -1.0, 2.0));
        assert!(most(&solid.forces(&shifted)) < 1e-10 * scale(), "{law:?}");
        // Of a small turn the linear law sees the square.
        let angles: &[f64] = if law == MaterialLaw::Linear {
            &[1e-6]
        } else {
            &[0.3, 2.0, std::f64::consts::PI]
        };
        for &angle in angles {
            let turned = moved(&points, &turn(angle), Vector3::new(0.5, 0.0, 0.0));
            let force = most(&solid.forces(&turned)) / scale();
            assert!(force < 1e-10, "{law:?} turned by {angle}: {force}");
            assert!(solid.energy(&turned) < 1e-9 * scale());
        }
    }
}

#[test]
fn forces_are_minus_the_gradient_of_the_energy() {
    let points = cloud();
    let stretched = moved(
        &points,
        &Matrix3::new(1.2, 0.3, 0.0, -0.1, 0.8, 0.1, 0.2, 0.0, 1.1),
        Vector3::zeros(),
    );
    let bent = shaken(stretched, 0.01, 11);
    for law in LAWS {
        for points_of in [&points, &shaken(block([6, 5, 0], 0.1), 0.03, 5)] {
            let mut solid = Solid::new(&spec(law), points_of).unwrap();
            let bent = &bent[..points_of.len()];
            let forces = solid.forces(bent);
            let mut noise = noise(5);
            let way: Vec<_> = bent
                .iter()
                .map(|_| Vector3::from_fn(|_, _| noise()))
                .collect();
            let at = |step: f64| {
                let moved: Vec<_> = bent.iter().zip(&way).map(|(x, w)| x + w * step).collect();
                solid.energy(&moved)
            };
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            let work: f64 = forces.iter().zip(&way).map(|(f, w)| f.dot(w)).sum();
            assert!(
                (slope + work).abs() < 1e-6 * work.abs().max(scale()),
                "{law:?}: {slope} {work}"
            );
        }
    }
}

#[test]
fn all_laws_agree_on_small_displacements() {
    let points = cloud();
    let mut noise = noise(9);
    let small: Vec<_> = points
        .iter()
        .map(|x| x + Vector3::from_fn(|_, _| noise()) * 1e-8)
        .collect();
    let forces = LAWS.map(|law| Solid::new(&spec(law), &points).unwrap().forces(&small));
    let size = most(&forces[0]);
    for (law, force) in LAWS.iter().zip(&forces) {
        let difference = force.iter().zip(&forces[0]).map(|(a, b)| (a - b).amax());
        assert!(difference.fold(0.0, f64::max) < 1e-5 * size, "{law:?}");
    }
}

/// A system of a solid that was stretched, turned and let go.
fn thrown(law: MaterialLaw) -> (SystemSpec, Vec<f64>) {
    let points = cloud();
    let solid = spec(law);
    let masses = Solid::new(&solid, &points).unwrap().masses().to_vec();
    let spin = Vector3::new(0.0, 1.0, 2.0);
    let velocities = points
        .iter()
        .map(|x| spin.cross(x) + Vector3::new(x.y, 0.3, -x.x) * 0.2);
    (
        SystemSpec {
            velocities: velocities.collect(),
            positions: points,
            solid: Some(solid),
            ..SystemSpec::default()
        },
        masses,
    )
}

#[test]
fn a_free_body_keeps_its_momentum_and_its_angular_momentum() {
    for law in [
        MaterialLaw::Corotated,
        MaterialLaw::StVenantKirchhoff,
        MaterialLaw::NeoHookean,
    ] {
        let (spec, masses) = thrown(law);
        let mut system = System::new(spec).unwrap();
        let before = momenta(&system, &masses);
        let dt = 0.5 * system.largest_stable_step();
        run(&mut system, 300, dt);
        let after = momenta(&system, &masses);
        for (before, after) in before.iter().zip(&after) {
            assert!(
                (before - after).norm() < 1e-10 * before.norm(),
                "{law:?}: {before} {after}"
            );
        }
    }
}

#[test]
fn energy_is_kept_by_the_second_order_better_the_smaller_the_step() {
    let drift = |part: f64, steps: u32| {
        let (spec, _) = thrown(MaterialLaw::Corotated);
        let mut system = System::new(SystemSpec {
            integrator: Integrator::VelocityVerlet,
            ..spec
        })
        .unwrap();
        let before = system.energy();
        let dt = part * system.largest_stable_step();
        let mut worst = 0.0_f64;
        for _ in 0..steps {
            system.step(dt).unwrap();
            worst = worst.max((system.energy() / before - 1.0).abs());
        }
        worst
    };
    let [coarse, fine] = [drift(0.4, 200), drift(0.2, 400)];
    assert!(coarse < 5e-3, "{coarse}");
    assert!((3.0..5.0).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn masses_follow_density_and_volume() {
    let points = block([4, 3, 5], 0.2);
    let solid = Solid::new(&spec(MaterialLaw::Linear), &points).unwrap();
    for mass in solid.masses() {
        assert!((mass - 1_000.0 * 0.2_f64.powi(3)).abs() < 1e-9);
    }
    let volumes = SolidSpec {
        volumes: Some(vec![0.5; points.len()]),
        ..spec(MaterialLaw::Linear)
    };
    assert_eq!(
        Solid::new(&volumes, &points).unwrap().masses(),
        vec![500.0; points.len()]
    );
}

#[test]
fn a_step_just_within_the_stable_one_is_bounded_and_one_beyond_is_not() {
    let travel = |part: f64| {
        let mut noise = noise(1);
        let positions = cloud();
        let spec = SystemSpec {
            velocities: positions
                .iter()
                .map(|_| Vector3::from_fn(|_, _| 1e-6 * noise()))
                .collect(),
            positions,
            solid: Some(spec(MaterialLaw::Corotated)),
            ..SystemSpec::default()
        };
        let mut system = System::new(spec).unwrap();
        let before = system.energy();
        let dt = part * system.largest_stable_step();
        for _ in 0..2_000 {
            if system.step(dt).is_err() {
                return f64::INFINITY;
            }
        }
        system.energy() / before
    };
    assert!(travel(0.97) < 100.0, "{}", travel(0.97));
    assert!(travel(1.12) > 1e6);
}

#[test]
fn every_integrator_lets_a_body_rest_and_a_stiff_one_bears_large_implicit_steps() {
    for integrator in INTEGRATORS {
        let positions = cloud();
        let rest = positions.clone();
        let spec = SystemSpec {
            velocities: vec![Vector3::zeros(); positions.len()],
            positions,
            integrator,
            solid: Some(spec(MaterialLaw::Corotated)),
            ..SystemSpec::default()
        };
        let mut system = System::new(spec).unwrap();
        run(&mut system, 20, 1e-3);
        let error = rest
            .iter()
            .zip(system.positions())
            .map(|(a, b)| (a - b).amax());
        assert!(error.fold(0.0, f64::max) < 1e-12);
    }
    let positions = cloud();
    let mut solid = spec(MaterialLaw::Corotated);
    solid.material.young = 1e9;
    let low = positions.iter().map(|x| x.x).fold(f64::INFINITY, f64::min) + 0.1;
    let spec = SystemSpec {
        velocities: vec![Vector3::zeros(); positions.len()],
        fixed: (0..)
            .zip(&positions)
            .filter(|(_, x)| x.x < low)
            .map(|(i, _)| i)
            .collect(),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        integrator: Integrator::LinearlyImplicitEuler,
        positions,
        solid: Some(solid),
        ..SystemSpec::default()
    };
    let mut system = System::new(spec).unwrap();
    let dt = 200.0 * 2.0 / (1e9 / 1_000.0_f64).sqrt() * 0.1;
    assert!(dt > 0.01);
    run(&mut system, 10, dt);
    let sunk = system
        .positions()
        .iter()
        .map(|x| x.z)
        .fold(f64::INFINITY, f64::min);
    assert!(sunk > -0.05 && sunk < 0.1, "{sunk}");
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let travel = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut bits = Vec::new();
            for metric in [
                Metric::Geodesic { exponent: 6.0 },
                Metric::Graded {
                    gap: 1.8,
                    exponent: 6.0,
                },
            ] {
                let positions = shaken(block([40, 16, 15], 0.1), 0.02, 7);
                let solid = SolidSpec {
                    metric,
                    ..spec(MaterialLaw::NeoHookean)
                };
                let mut system = System::new(SystemSpec {
                    velocities: positions
                        .iter()
                        .map(|x| Vector3::new(x.y, -x.z, x.x) * 0.1)
                        .collect(),
                    positions,
                    solid: Some(solid),
                    ..SystemSpec::default()
                })
                .unwrap();
                run(&mut system, 3, 1e-3);
                bits.extend(
                    system
                        .positions()
                        .iter()
                        .map(|x| x.data.0[0].map(f64::to_bits)),
                );
                bits.push([system.largest_stable_step().to_bits(); 3]);
            }
            bits
        })
    };
    let alone = travel(1);
    assert_eq!(alone, travel(2));
    assert_eq!(alone, travel(5));
}
