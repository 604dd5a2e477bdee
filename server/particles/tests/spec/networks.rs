//! Physical laws and analytic references that any system obeys.

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_particles::{Diverged, SystemSpec};

use crate::{build, momenta, oscillator, particles, run, springs};

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
}

prop_compose! {
    /// A free system without externals, every particle on a spring to its predecessor and some more springs.
    fn isolated()(n in 2_usize..12)(
        positions in prop::collection::vec(vector(), n),
        velocities in prop::collection::vec(vector(), n),
        masses in prop::collection::vec(0.5..2.0, n),
        extra in prop::collection::vec((0..n, 1..n), 0..12),
        stiffness in 1.0..20.0,
        damping in prop_oneof![Just(0.0), 0.0..0.5],
    ) -> SystemSpec {
        let n = positions.len();
        let index = |i: usize| u32::try_from(i).unwrap();
        let springs: Vec<[u32; 2]> = (1..n)
            .map(|i| [index(i - 1), index(i)])
            .chain(extra.into_iter().map(|(i, hop)| [index(i), index((i + hop) % n)]))
            .collect();
        SystemSpec {
            velocities,
            masses,
            links: vec![self::springs(springs, stiffness, damping, 0.7)],
            ..particles(positions)
        }
    }
}

proptest! {
    #[test]
    fn springs_alone_conserve_both_momenta(spec in isolated()) {
        let masses = spec.masses.clone();
        let mut system = build(spec);
        let dt = 0.1 * system.largest_stable_step();
        let [p, l] = momenta(&system, &masses);
        run(&mut system, 500, dt);
        let [p_after, l_after] = momenta(&system, &masses);
        prop_assert!((p_after - p).norm() < 1e-12);
        // The centre drifts, so positions and their rounding grow with time.
        let reach = system.positions().iter().map(|x| x.norm()).fold(1.0, f64::max);
        prop_assert!((l_after - l).norm() < 1e-12 * reach * reach);
    }

    #[test]
    fn force_is_minus_the_gradient_of_energy(spec in isolated(), seed in 0_usize..36) {
        let n = spec.positions.len();
        let (particle, axis) = (seed / 3 % n, seed % 3);
        let still = SystemSpec { velocities: vec![Vector3::zeros(); n], ..spec };
        let potential_at = |shift: f64| {
            let mut moved = still.clone();
            moved.positions[particle][axis] += shift;
            build(moved).energy()
        };
        let h = 1e-6;
        let slope = (potential_at(h) - potential_at(-h)) / (2.0 * h);

        let mass = still.masses[particle];
        let mut system = build(still);
        run(&mut system, 1, 1.0); // from rest over 1 s: velocity = force / mass
        let force = system.velocities()[particle][axis] * mass;
        prop_assert!((force + slope).abs() < 1e-6 * (1.0 + force.abs()), "{force} {slope}");
    }
}

#[test]
fn an_oscillator_turns_by_the_discrete_angle_each_step() {
    let (mass, stiffness, dt) = (2.0_f64, 3.0_f64, 0.4);
    let (x0, v0) = (0.3, -0.2);
    let theta = 2.0 * (0.5 * dt * (stiffness / mass).sqrt()).asin();
    // x(n) = x0 cos nθ + b sin nθ through x(−1) = x0 − v0 dt
    let b = (x0 * theta.cos() - (x0 - v0 * dt)) / theta.sin();
    let mut system = build(oscillator(mass, stiffness, 0.0, x0, v0));
    for n in 1..=1000 {
        system.step(dt).unwrap();
        let angle = f64::from(n) * theta;
        let exact = x0 * angle.cos() + b * angle.sin();
        let x = system.positions()[1].x - 10.0;
        assert!((x - exact).abs() < 1e-10, "step {n}: {x} against {exact}");
    }
}

#[test]
fn undamped_energy_oscillates_but_does_not_drift() {
    let mut system = build(oscillator(1.0, 1.0, 0.0, 1.0, 0.0));
    let start = system.energy();
    let mut worst = |steps: usize| {
        let mut worst = 0.0_f64;
        for _ in 0..steps {
            system.step(0.05).unwrap();
            worst = worst.max((system.energy() / start - 1.0).abs());
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
    let mut system = build(SystemSpec {
        masses: vec![1.0, mass],
        fixed: vec![0],
        links: vec![springs(vec![[0, 1]], stiffness, 3.0, None)],
        gravity: Vector3::new(0.0, 0.0, -g),
        ..particles(vec![Vector3::zeros(), Vector3::new(0.0, 0.0, -1.0)])
    });
    for _ in 0..2_000 {
        system.step(0.01).unwrap();
    }
    let expected = Vector3::new(0.0, 0.0, -1.0 - mass * g / stiffness);
    assert!((system.positions()[1] - expected).norm() < 1e-13);
    assert_eq!(system.positions()[0], Vector3::zeros());
}

#[test]
fn free_fall_follows_the_sum_of_the_scheme() {
    let gravity = Vector3::new(0.1, -0.2, -9.81);
    let (x0, v0) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(-1.0, 0.5, 4.0));
    let mut system = build(SystemSpec {
        velocities: vec![v0],
        masses: vec![7.0],
        gravity,
        ..particles(vec![x0])
    });
    assert_eq!(system.largest_stable_step(), f64::INFINITY);
    let dt = 1.0 / 128.0;
    for n in 1..=256_i32 {
        system.step(dt).unwrap();
        let n = f64::from(n);
        let fallen = x0 + v0 * (n * dt) + gravity * (dt * dt * n * (n + 1.0) / 2.0);
        assert!((system.positions()[0] - fallen).norm() < 1e-12);
    }
}

#[test]
fn divergence_names_the_particle_and_leaves_the_last_finite_state() {
    let mut system = build(oscillator(1.0, 1e6, 0.0, 0.1, 0.0));
    let dt = 10.0 * system.largest_stable_step();
    let diverged = loop {
        if let Err(diverged) = system.step(dt) {
            break diverged;
        }
    };
    let Diverged::Particle {
        particle,
        time_step,
        ..
    } = diverged
    else {
        panic!("{diverged}")
    };
    assert_eq!((particle, time_step), (1, dt));
    assert!(system.positions().iter().all(|x| x.sum().is_finite()));
    assert!(
        diverged.to_string().contains("0.002 s are stable"),
        "{diverged}"
    );
}
