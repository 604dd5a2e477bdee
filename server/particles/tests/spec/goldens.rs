//! Against the independent reference: see `data/README.md`.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use sinew_particles::{FrameSpec, Integrator, LinkLaw, Links, System, SystemSpec};

use crate::{build, elastic, particles, run, springs};

pub(crate) fn cases(text: &str) -> Vec<Value> {
    let golden: Value = serde_json::from_str(text).unwrap();
    golden["cases"].as_array().unwrap().clone()
}

#[test]
fn one_mass_on_a_damped_spring_follows_the_golden_samples() {
    for case in cases(include_str!("data/D01_oscillator.json")) {
        let number = |name: &str| case["in"][name].as_f64().unwrap();
        let exact: Vec<f64> = serde_json::from_value(case["out"]["X"].clone()).unwrap();
        let size = exact.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
        // The anchor is far enough for the mass never to reach it: there the force would change its sign.
        let anchor = 4.0 * size;
        let x = |x: f64| Vector3::new(x, 0.0, 0.0);
        let mut system = build(SystemSpec {
            velocities: vec![Vector3::zeros(), x(number("x0") - number("xm1"))],
            masses: vec![1.0, number("M")],
            fixed: vec![0],
            links: vec![springs(vec![[0, 1]], number("K"), number("Z"), anchor)],
            ..particles(vec![Vector3::zeros(), x(anchor + number("x0"))])
        });
        for expected in &exact[1..] {
            system.step(1.0).unwrap();
            let x = system.positions()[1].x - anchor;
            assert!(
                (x - expected).abs() < 1e-9 + 1e-8 * size,
                "{x} against {expected}"
            );
        }
        if system.largest_stable_step() >= 1.0 + 1e-9 {
            assert_eq!(case["out"]["stable"], true);
        }
    }
}

fn chain(masses: usize, mass: f64, stiffness: f64, damping: f64) -> SystemSpec {
    let n = masses + 2;
    let last = u32::try_from(n - 1).unwrap();
    // Every other particle displaced: the shape that a large step excites first.
    let bump = |i: usize| if i % 2 == 1 { 1e-3 } else { 0.0 };
    let at = |i: usize| i as f64 + if i + 1 < n { bump(i) } else { 0.0 };
    SystemSpec {
        masses: vec![mass; n],
        fixed: vec![0, last],
        links: vec![springs(
            (0..last).map(|i| [i, i + 1]).collect(),
            stiffness,
            damping,
            1.0,
        )],
        ..particles((0..n).map(|i| Vector3::new(at(i), 0.0, 0.0)).collect())
    }
}

#[test]
fn the_largest_stable_step_never_promises_more_than_the_spectral_radius() {
    let mut promised = 0;
    for case in cases(include_str!("data/D03_chain_stability.json")) {
        let number = |name: &str| case["in"][name].as_f64().unwrap();
        let masses = usize::try_from(case["in"]["N"].as_u64().unwrap()).unwrap();
        let spec = chain(masses, number("M"), number("K"), number("Z"));
        if build(spec).largest_stable_step() >= 1.0 {
            assert_eq!(case["out"]["stable"], true, "{case}");
            promised += 1;
        }
    }
    assert!(promised >= 2, "too timid to be of use");
}

#[test]
fn a_long_chain_is_stable_just_below_the_largest_stable_step_and_not_just_above() {
    for damping in [0.0, 3.0] {
        let stretch_after = |factor: f64| {
            let mut system = build(chain(200, 0.3, 50.0, damping));
            let dt = factor * system.largest_stable_step();
            for _ in 0..2_000 {
                if system.step(dt).is_err() {
                    return f64::INFINITY;
                }
            }
            let rest = system.positions().iter().zip(0..);
            rest.map(|(x, i)| (x.x - f64::from(i)).abs())
                .fold(0.0, f64::max)
        };
        assert!(stretch_after(0.999) < 1.0, "damping {damping}");
        assert!(stretch_after(1.02) > 1.0, "damping {damping}");
    }
}

fn vectors(value: &Value) -> Vec<Vector3<f64>> {
    let rows: Vec<[f64; 3]> = serde_json::from_value(value.clone()).unwrap();
    rows.into_iter().map(Vector3::from).collect()
}

/// The law of a golden link, with whatever columns it has.
fn law(case: &Value) -> LinkLaw {
    let params = &case["in"]["params"];
    let number = |name: &str| params[name].as_f64().unwrap_or(0.0);
    let elastic = elastic(1, number("K"), number("Z"), number("L0"));
    match case["in"]["type"].as_str().unwrap() {
        "RES" | "FRO" | "REF" => LinkLaw::Spring(elastic),
        "BUT" => LinkLaw::Contact(elastic),
        "PLA" => LinkLaw::Plastic {
            elastic,
            yields: vec![number("yield")],
        },
        "FRA" => LinkLaw::Breaking {
            elastic,
            elongations: vec![number("crit")],
        },
        "DRY" => LinkLaw::Friction {
            stiffness: vec![number("K")],
            limits: vec![number("mu")],
        },
        other => panic!("{other}"),
    }
}

#[test]
fn each_link_follows_its_golden_samples() {
    for case in cases(include_str!("data/D02_links.json")) {
        let (x, before) = (vectors(&case["in"]["x"]), vectors(&case["in"]["xm"]));
        let gravity = Vector3::from_row_slice(&[0.0, -0.001, 0.0]);
        let friction = case["in"]["type"] == "DRY";
        let moved = x.iter().zip(&before).map(|(x, before)| x - before);
        let spec = SystemSpec {
            masses: serde_json::from_value(case["in"]["masses"].clone()).unwrap(),
            gravity,
            links: vec![Links {
                ends: vec![[0, 1]],
                law: law(&case),
            }],
            ..particles(x.clone())
        };
        // The reference's friction sticks where it was one sample before: there it exerts no force.
        let mut system = if friction {
            let velocities = moved.map(|v| v - gravity).collect();
            let mut system = build(SystemSpec {
                positions: before,
                velocities,
                ..spec
            });
            run(&mut system, 1, 1.0);
            system
        } else {
            let velocities = moved.collect();
            build(SystemSpec { velocities, ..spec })
        };
        // The reference damps by the difference of two lengths, which brakes rotation too; ours by the rate of length.
        let r = x[1] - x[0];
        let r_before = vectors(&case["in"]["xm"]);
        let r_before = r_before[1] - r_before[0];
        let excess = (r - r_before).dot(&r) / r.norm() - (r.norm() - r_before.norm());
        let damping = case["in"]["params"]["Z"].as_f64().unwrap_or(0.0);
        let found = system.link_forces(0)[0];
        let force = vectors(&Value::Array(vec![
            case["out"]["force_on_b_first_sample"].clone(),
        ]))[0];
        let as_damped = if force == Vector3::zeros() {
            found
        } else {
            found + r / r.norm() * (damping * excess)
        };
        assert!((as_damped - force).norm() < 1e-12, "{case}: {found}");
        let apart = 10.0 * damping * excess.abs();
        for sample in case["out"]["x_after_1_2_3"].as_array().unwrap() {
            run(&mut system, 1, 1.0);
            for (x, exact) in system.positions().iter().zip(vectors(sample)) {
                let error = (x - exact).norm();
                assert!(error < 1e-10 * exact.norm() + apart, "{case}: {x} {exact}");
            }
        }
        if case["out"]["link_state"]["broken"] == true {
            assert_eq!(system.broken_links(0), [true]);
        }
    }
}

#[test]
fn a_free_body_turns_as_the_golden_one_by_each_method() {
    let quaternion = |value: &Value| {
        let [w, i, j, k]: [f64; 4] = serde_json::from_value(value.clone()).unwrap();
        UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k))
    };
    let mut compared = 0;
    for case in cases(include_str!("data/A08_free_rotation.json")) {
        let integrator = match case["in"]["method"].as_str().unwrap() {
            "lie_euler" => Integrator::SemiImplicitEuler,
            "split" => Integrator::VelocityVerlet,
            "rk4" => Integrator::RungeKutta4,
            "implicit_midpoint" => Integrator::ImplicitMidpoint,
            _ => continue,
        };
        let given = &case["in"];
        let one = |name: &str| vectors(&Value::Array(vec![given[name].clone()]))[0];
        let (start, moments, momentum) = (quaternion(&given["q0"]), one("I"), one("L"));
        let in_body = start.inverse_transform_vector(&momentum);
        let mut system: System = build(SystemSpec {
            frames: Some(FrameSpec {
                orientations: vec![start],
                spins: vec![start * in_body.component_div(&moments)],
                moments: vec![moments],
                damping: 0.0,
            }),
            integrator,
            ..particles(vec![Vector3::zeros()])
        });
        let steps = usize::try_from(given["steps"].as_u64().unwrap()).unwrap();
        run(&mut system, steps, given["dt"].as_f64().unwrap());
        let found = system.orientations().unwrap()[0];
        let angle = found.angle_to(&quaternion(&case["out"]["q"]));
        assert!(angle < 1e-9, "{integrator:?}: {angle}");
        let energy = case["out"]["energy"].as_f64().unwrap();
        assert!((system.energy() / energy - 1.0).abs() < 1e-9);
        compared += 1;
    }
    assert_eq!(compared, 8);
}
