//! Bodies that turn.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use sinew_particles::{FrameSpec, Integrator, System, SystemSpec};

use crate::{INTEGRATORS, build, particles, run};

fn body(moments: [f64; 3], spin: Vector3<f64>, integrator: Integrator) -> SystemSpec {
    SystemSpec {
        frames: Some(FrameSpec {
            orientations: vec![UnitQuaternion::identity()],
            spins: vec![spin],
            moments: vec![moments.into()],
            damping: 0.0,
        }),
        integrator,
        ..particles(vec![Vector3::zeros()])
    }
}

fn orientation(system: &System) -> UnitQuaternion<f64> {
    system.orientations().unwrap()[0]
}

#[test]
fn a_fast_spinning_frame_stays_of_length_one_and_turns_by_its_spin() {
    let axis = Unit::new_normalize(Vector3::new(1.0, -2.0, 0.5));
    for integrator in INTEGRATORS {
        let spin = axis.into_inner() * 300.0;
        let mut system = build(body([0.1; 3], spin, integrator));
        run(&mut system, 100_000, 1e-3);
        let q = orientation(&system);
        assert!((q.coords.norm() - 1.0).abs() < 1e-15, "{integrator:?}");
        let turned = UnitQuaternion::from_axis_angle(&axis, 300.0 * 100.0);
        // Classical Runge and Kutta lag by (ω dt)⁵/1920 a step; the others turn an isotropic body exactly.
        let runge_kutta = integrator == Integrator::RungeKutta4;
        let lag = if runge_kutta {
            1e5 * 0.3_f64.powi(5) / 1920.0
        } else {
            1e-8
        };
        assert!(
            q.angle_to(&turned) < lag,
            "{integrator:?}: {}",
            q.angle_to(&turned)
        );
        let momentum = system.angular_momenta()[0];
        assert!((momentum - spin * 0.1).norm() < 1e-12 * spin.norm());
    }
}

#[test]
fn a_body_about_its_middle_axis_flips_and_keeps_its_energy() {
    let spin = Vector3::new(1e-3, 1.0, 0.0);
    let mut system = build(body([1.0, 2.0, 3.0], spin, Integrator::VelocityVerlet));
    let start = system.energy();
    let (mut flips, mut up, mut worst) = (0, true, 0.0_f64);
    for _ in 0..20_000 {
        system.step(0.01).unwrap();
        let along = (orientation(&system) * Vector3::y()).y;
        if along.abs() > 0.5 && (along > 0.0) != up {
            (flips, up) = (flips + 1, !up);
        }
        worst = worst.max((system.energy() / start - 1.0).abs());
    }
    assert!(flips >= 4, "{flips}");
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn a_free_body_is_turned_with_the_order_of_each_integrator() {
    let end = |integrator, steps: u32| {
        let spin = Vector3::new(0.4, 1.0, -0.7);
        let mut system = build(body([1.0, 1.6, 2.3], spin, integrator));
        run(&mut system, steps as usize, 2.0 / f64::from(steps));
        orientation(&system)
    };
    let exact = end(Integrator::RungeKutta4, 20_000);
    for (integrator, order) in [
        (Integrator::SemiImplicitEuler, 1.0),
        (Integrator::VelocityVerlet, 2.0),
        (Integrator::RungeKutta4, 4.0),
        (Integrator::LinearlyImplicitEuler, 1.0),
        (Integrator::ImplicitMidpoint, 2.0),
    ] {
        let error = |steps| end(integrator, steps).angle_to(&exact);
        let found = (error(50) / error(100)).log2();
        assert!((found - order).abs() < 0.2, "{integrator:?}: {found}");
    }
}

#[test]
fn drag_stops_a_spin_by_its_exponential() {
    for integrator in INTEGRATORS {
        let mut spec = body([0.5; 3], Vector3::x(), integrator);
        spec.frames.as_mut().unwrap().damping = 0.2;
        let mut system = build(spec);
        run(&mut system, 10_000, 1e-3);
        let left = system.angular_momenta()[0].x / 0.5;
        assert!(
            (left / (-0.4_f64 * 10.0).exp() - 1.0).abs() < 2e-3,
            "{integrator:?}: {left}"
        );
    }
}
