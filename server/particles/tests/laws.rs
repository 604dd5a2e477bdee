//! Physical laws and analytic references that any network obeys.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_particles::{Network, NetworkSpec};

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
}

prop_compose! {
    /// A free network without externals, every particle on a spring to its predecessor and some more springs.
    fn isolated()(n in 2_usize..12)(
        positions in prop::collection::vec(vector(), n),
        velocities in prop::collection::vec(vector(), n),
        masses in prop::collection::vec(0.5..2.0, n),
        extra in prop::collection::vec((0..n, 1..n), 0..12),
        stiffness in 1.0..20.0,
        damping in prop_oneof![Just(0.0), 0.0..0.5],
    ) -> NetworkSpec {
        let n = positions.len();
        let index = |i: usize| u32::try_from(i).unwrap();
        let springs: Vec<[u32; 2]> = (1..n)
            .map(|i| [index(i - 1), index(i)])
            .chain(extra.into_iter().map(|(i, hop)| [index(i), index((i + hop) % n)]))
            .collect();
        NetworkSpec {
            velocities,
            masses,
            stiffness: vec![stiffness; springs.len()],
            damping: vec![damping; springs.len()],
            rest_lengths: Some(vec![0.7; springs.len()]),
            springs,
            positions,
            ..NetworkSpec::default()
        }
    }
}

fn momentum(network: &Network, masses: &[f64]) -> Vector3<f64> {
    let terms = network.velocities().iter().zip(masses);
    terms.map(|(v, &m)| v * m).sum()
}

fn angular_momentum(network: &Network, masses: &[f64]) -> Vector3<f64> {
    let moving = network.positions().iter().zip(network.velocities());
    moving.zip(masses).map(|((x, v), &m)| x.cross(v) * m).sum()
}

proptest! {
    #[test]
    fn springs_alone_conserve_both_momenta(spec in isolated()) {
        let masses = spec.masses.clone();
        let mut network = Network::new(spec).unwrap();
        let dt = 0.1 * network.largest_stable_step();
        let p = momentum(&network, &masses);
        let l = angular_momentum(&network, &masses);
        for _ in 0..500 {
            network.step(dt).unwrap();
        }
        prop_assert!((momentum(&network, &masses) - p).norm() < 1e-12);
        // The centre drifts, so positions and their rounding grow with time.
        let reach = network.positions().iter().map(|x| x.norm()).fold(1.0, f64::max);
        prop_assert!((angular_momentum(&network, &masses) - l).norm() < 1e-12 * reach * reach);
    }

    #[test]
    fn force_is_minus_the_gradient_of_energy(spec in isolated(), seed in 0_usize..36) {
        let n = spec.positions.len();
        let (particle, axis) = (seed / 3 % n, seed % 3);
        let still = NetworkSpec { velocities: vec![Vector3::zeros(); n], ..spec };
        let potential_at = |shift: f64| {
            let mut moved = still.clone();
            moved.positions[particle][axis] += shift;
            Network::new(moved).unwrap().energy()
        };
        let h = 1e-6;
        let slope = (potential_at(h) - potential_at(-h)) / (2.0 * h);

        let mass = still.masses[particle];
        let mut network = Network::new(still).unwrap();
        network.step(1.0).unwrap(); // from rest over 1 s: velocity = force / mass
        let force = network.velocities()[particle][axis] * mass;
        prop_assert!((force + slope).abs() < 1e-5 * (1.0 + force.abs()), "{force} {slope}");
    }
}

/// A mass on a spring of rest length 10 along x, anchored at the origin.
fn oscillator(mass: f64, stiffness: f64, damping: f64, x: f64, v: f64) -> Network {
    Network::new(NetworkSpec {
        positions: vec![Vector3::zeros(), Vector3::new(10.0 + x, 0.0, 0.0)],
        velocities: vec![Vector3::zeros(), Vector3::new(v, 0.0, 0.0)],
        masses: vec![1.0, mass],
        fixed: vec![0],
        springs: vec![[1, 0]],
        stiffness: vec![stiffness],
        damping: vec![damping],
        rest_lengths: Some(vec![10.0]),
        gravity: Vector3::zeros(),
    })
    .unwrap()
}

#[test]
fn an_oscillator_turns_by_the_discrete_angle_each_step() {
    let (mass, stiffness, dt) = (2.0_f64, 3.0_f64, 0.4);
    let (x0, v0) = (0.3, -0.2);
    let theta = 2.0 * (0.5 * dt * (stiffness / mass).sqrt()).asin();
    // x(n) = x0 cos nθ + b sin nθ through x(−1) = x0 − v0 dt
    let b = (x0 * theta.cos() - (x0 - v0 * dt)) / theta.sin();
    let mut network = oscillator(mass, stiffness, 0.0, x0, v0);
    for n in 1..=1000 {
        network.step(dt).unwrap();
        let angle = f64::from(n) * theta;
        let exact = x0 * angle.cos() + b * angle.sin();
        let x = network.positions()[1].x - 10.0;
        assert!((x - exact).abs() < 1e-10, "step {n}: {x} against {exact}");
    }
}

#[test]
fn undamped_energy_oscillates_but_does_not_drift() {
    let mut network = oscillator(1.0, 1.0, 0.0, 1.0, 0.0);
    let start = network.energy();
    let mut worst = |steps: usize| {
        let mut worst = 0.0_f64;
        for _ in 0..steps {
            network.step(0.05).unwrap();
            worst = worst.max((network.energy() / start - 1.0).abs());
        }
        worst
    };
    let early = worst(1_000);
    assert!(early > 1e-3, "first order: the oscillation is visible");
    assert!(worst(100_000) < 1.01 * early);
}

#[test]
fn a_hanging_mass_settles_at_the_static_extension() {
    let (mass, stiffness, g) = (0.5, 40.0, 9.81);
    let mut network = Network::new(NetworkSpec {
        positions: vec![Vector3::zeros(), Vector3::new(0.0, 0.0, -1.0)],
        velocities: vec![Vector3::zeros(); 2],
        masses: vec![1.0, mass],
        fixed: vec![0],
        springs: vec![[0, 1]],
        stiffness: vec![stiffness],
        damping: vec![3.0],
        rest_lengths: None,
        gravity: Vector3::new(0.0, 0.0, -g),
    })
    .unwrap();
    for _ in 0..2_000 {
        network.step(0.01).unwrap();
    }
    let expected = Vector3::new(0.0, 0.0, -1.0 - mass * g / stiffness);
    assert!((network.positions()[1] - expected).norm() < 1e-13);
    assert_eq!(network.positions()[0], Vector3::zeros());
}

#[test]
fn free_fall_follows_the_sum_of_the_scheme() {
    let gravity = Vector3::new(0.1, -0.2, -9.81);
    let (x0, v0) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(-1.0, 0.5, 4.0));
    let mut network = Network::new(NetworkSpec {
        positions: vec![x0],
        velocities: vec![v0],
        masses: vec![7.0],
        gravity,
        ..NetworkSpec::default()
    })
    .unwrap();
    assert_eq!(network.largest_stable_step(), f64::INFINITY);
    let dt = 1.0 / 128.0;
    for n in 1..=256_i32 {
        network.step(dt).unwrap();
        let n = f64::from(n);
        let fallen = x0 + v0 * (n * dt) + gravity * (dt * dt * n * (n + 1.0) / 2.0);
        assert!((network.positions()[0] - fallen).norm() < 1e-12);
    }
}

#[test]
fn coincident_ends_exert_no_force_and_stay_finite() {
    let mut network = Network::new(NetworkSpec {
        positions: vec![Vector3::repeat(0.5); 2],
        velocities: vec![Vector3::zeros(); 2],
        masses: vec![1.0; 2],
        springs: vec![[0, 1]],
        stiffness: vec![100.0],
        damping: vec![1.0],
        rest_lengths: Some(vec![1.0]),
        ..NetworkSpec::default()
    })
    .unwrap();
    network.step(0.01).unwrap();
    assert_eq!(network.positions(), [Vector3::repeat(0.5); 2]);
}

#[test]
fn divergence_names_the_particle_and_leaves_the_last_finite_state() {
    let mut network = oscillator(1.0, 1e6, 0.0, 0.1, 0.0);
    let dt = 10.0 * network.largest_stable_step();
    let diverged = loop {
        if let Err(diverged) = network.step(dt) {
            break diverged;
        }
    };
    assert_eq!(diverged.particle, 1);
    assert_eq!(diverged.time_step, dt);
    assert!(network.positions().iter().all(|x| x.sum().is_finite()));
    assert!(
        diverged.to_string().contains("0.002 s are stable"),
        "{diverged}"
    );
}
