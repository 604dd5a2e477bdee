//! Against the independent reference: see `data/README.md`.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::Vector3;
use serde_json::Value;
use sinew_particles::{Network, NetworkSpec};

fn cases(text: &str) -> Vec<Value> {
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
        let mut network = Network::new(NetworkSpec {
            positions: vec![
                Vector3::zeros(),
                Vector3::new(anchor + number("x0"), 0.0, 0.0),
            ],
            velocities: vec![
                Vector3::zeros(),
                Vector3::new(number("x0") - number("xm1"), 0.0, 0.0),
            ],
            masses: vec![1.0, number("M")],
            fixed: vec![0],
            springs: vec![[0, 1]],
            stiffness: vec![number("K")],
            damping: vec![number("Z")],
            rest_lengths: Some(vec![anchor]),
            gravity: Vector3::zeros(),
        })
        .unwrap();
        for expected in &exact[1..] {
            network.step(1.0).unwrap();
            let x = network.positions()[1].x - anchor;
            assert!(
                (x - expected).abs() < 1e-9 + 1e-8 * size,
                "{x} against {expected}"
            );
        }
        if network.largest_stable_step() >= 1.0 + 1e-9 {
            assert_eq!(case["out"]["stable"], true);
        }
    }
}

fn chain(masses: usize, mass: f64, stiffness: f64, damping: f64) -> NetworkSpec {
    let n = masses + 2;
    let last = u32::try_from(n - 1).unwrap();
    // Every other particle displaced: the shape that a large step excites first.
    let bump = |i: usize| if i % 2 == 1 { 1e-3 } else { 0.0 };
    let at = |i: usize| i as f64 + if i + 1 < n { bump(i) } else { 0.0 };
    NetworkSpec {
        positions: (0..n).map(|i| Vector3::new(at(i), 0.0, 0.0)).collect(),
        velocities: vec![Vector3::zeros(); n],
        masses: vec![mass; n],
        fixed: vec![0, last],
        springs: (0..last).map(|i| [i, i + 1]).collect(),
        stiffness: vec![stiffness; n - 1],
        damping: vec![damping; n - 1],
        rest_lengths: Some(vec![1.0; n - 1]),
        gravity: Vector3::zeros(),
    }
}

#[test]
fn the_largest_stable_step_never_promises_more_than_the_spectral_radius() {
    let mut promised = 0;
    for case in cases(include_str!("data/D03_chain_stability.json")) {
        let number = |name: &str| case["in"][name].as_f64().unwrap();
        let masses = usize::try_from(case["in"]["N"].as_u64().unwrap()).unwrap();
        let spec = chain(masses, number("M"), number("K"), number("Z"));
        if Network::new(spec).unwrap().largest_stable_step() >= 1.0 {
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
            let mut network = Network::new(chain(200, 0.3, 50.0, damping)).unwrap();
            let dt = factor * network.largest_stable_step();
            for _ in 0..2_000 {
                if network.step(dt).is_err() {
                    return f64::INFINITY;
                }
            }
            let rest = network.positions().iter().zip(0..);
            rest.map(|(x, i)| (x.x - f64::from(i)).abs())
                .fold(0.0, f64::max)
        };
        assert!(stretch_after(0.999) < 1.0, "damping {damping}");
        assert!(stretch_after(1.02) > 1.0, "damping {damping}");
    }
}
