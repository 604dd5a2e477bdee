//! Laws of everything that pairs do, at once.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use sinew_particles::{
    Attraction, AttractionLaw, EndingKind, Form, Gradient, Normalisation, PairFriction, PairSpec,
    Repulsion, SystemSpec, Weighting,
};

use crate::{
    build, momenta,
    pairs::{attracted, bodies},
    particles, run,
};

fn any_vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}

fn any_orientation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    any_vector(3.0).prop_map(UnitQuaternion::from_scaled_axis)
}

fn any_attraction(n: usize) -> impl Strategy<Value = AttractionLaw> {
    prop_oneof![
        (2_u32..7).prop_map(|exponent| AttractionLaw::LennardJones {
            stiffness: 2.0,
            rest_length: 0.9,
            exponent,
        }),
        Just(AttractionLaw::TwelveSix {
            depth: 0.4,
            size: 0.8
        }),
        (1.0..12.0).prop_map(|sharpness| AttractionLaw::Cohesion {
            stiffness: 5.0,
            rest_length: 0.9,
            sharpness,
        }),
        prop::collection::vec(prop::array::uniform3(0.6..1.4), n).prop_map(|radii| {
            AttractionLaw::DirectedCohesion {
                stiffness: 5.0,
                sharpness: 5.0,
                radii: radii.into_iter().map(Vector3::from).collect(),
            }
        }),
    ]
}

prop_compose! {
    /// Bodies at least 0.6 apart that do everything to each other, without friction.
    fn society()(n in 2_usize..6)(
        offsets in prop::collection::vec(any_vector(0.2), n),
        orientations in prop::collection::vec(any_orientation(), n),
        velocities in prop::collection::vec(any_vector(0.3), n),
        curvatures in prop::collection::vec(prop::array::uniform2(-1.0..1.5), n),
        law in any_attraction(n),
        ending in prop_oneof![Just(EndingKind::Sharp), Just(EndingKind::Shifted)],
        weighting in prop_oneof![
            Just(Weighting::One),
            Just(Weighting::Gaussian { width: 1.2 }),
            Just(Weighting::Wendland { reach: 4.0 }),
        ],
        normalisation in prop_oneof![Just(Normalisation::None), Just(Normalisation::SquaredDistance)],
        strengths in prop::array::uniform4(0.0..2.0),
        kinds in prop::collection::vec(0_u32..3, n),
    ) -> SystemSpec {
        let n = orientations.len();
        let places = offsets.iter().enumerate().map(|(i, offset)| {
            Vector3::new((i % 2) as f64, (i / 2 % 2) as f64, (i / 4) as f64) + offset
        });
        SystemSpec {
            velocities,
            masses: vec![1.3; n],
            frames: bodies(orientations, Vector3::new(0.2, 0.3, 0.25)),
            pairs: Some(PairSpec {
                attraction: Some(Attraction { law, ending, table: None }),
                form: Some(Form {
                    form: strengths[0],
                    coplanarity: strengths[1],
                    conormality: strengths[2],
                    cocircularity: strengths[3],
                    curvatures,
                    weighting,
                    normalisation,
                    gradient: Gradient::Whole,
                }),
                reach: 50.0,
                repulsion: Some(Repulsion { strength: 3.0, length: 0.5, reach: 20.0 }),
                kinds,
                ..PairSpec::default()
            }),
            ..particles(places.collect())
        }
    }
}

proptest! {
    #[test]
    fn forces_and_torques_are_the_slopes_of_the_energy(spec in society()) {
        let still = SystemSpec {
            velocities: vec![Vector3::zeros(); spec.positions.len()],
            ..spec
        };
        let [forces, torques] = build(still.clone()).loads();
        let slope = |change: &dyn Fn(&mut SystemSpec, f64)| {
            let central = |h: f64| {
                let [ahead, behind] = [h, -h].map(|h| {
                    let mut changed = still.clone();
                    change(&mut changed, h);
                    build(changed).energy()
                });
                (ahead - behind) / (2.0 * h)
            };
            // Richardson: without the error of second order, which is large where two axes nearly meet.
            (4.0 * central(1e-5) - central(2e-5)) / 3.0
        };
        for i in 0..still.positions.len() {
            for axis in 0..3 {
                let moved = slope(&|spec, h| spec.positions[i][axis] += h);
                let force = forces[i][axis];
                prop_assert!((force + moved).abs() < 1e-6 * (1.0 + force.abs()), "{force} {moved}");
                let turned = slope(&|spec, h| {
                    let mut by = Vector3::zeros();
                    by[axis] = h;
                    let frames = spec.frames.as_mut().unwrap();
                    frames.orientations[i] = UnitQuaternion::from_scaled_axis(by) * frames.orientations[i];
                });
                let torque = torques[i][axis];
                prop_assert!((torque + turned).abs() < 1e-6 * (1.0 + torque.abs()), "{torque} {turned}");
            }
        }
    }

    #[test]
    fn no_force_or_torque_between_particles_changes_a_momentum(
        spec in society(),
        friction in prop::array::uniform2(0.0..1.0),
    ) {
        let mut spec = spec;
        let [sliding, turning] = friction;
        spec.pairs.as_mut().unwrap().friction = Some(PairFriction { sliding, turning });
        let masses = spec.masses.clone();
        let mut system = build(spec);
        for _ in 0..20 {
            let [p, l] = momenta(&system, &masses);
            let size = 1.0 + system.velocities().iter().map(|v| v.norm()).fold(0.0, f64::max);
            if system.step(1e-3).is_err() {
                break; // what comes too close is another law's
            }
            let [p_after, l_after] = momenta(&system, &masses);
            prop_assert!((p_after - p).norm() < 1e-10 * size);
            prop_assert!((l_after - l).norm() < 1e-10 * size);
        }
    }

    #[test]
    fn neighbours_are_all_that_matter(
        places in prop::collection::vec(any_vector(2.0), 2..40),
        velocities in prop::collection::vec(any_vector(1.0), 40),
    ) {
        let law = AttractionLaw::Cohesion { stiffness: 2.0, rest_length: 0.7, sharpness: 8.0 };
        let n = places.len();
        let everyone = SystemSpec {
            velocities: velocities[..n].to_vec(),
            ..attracted(places, law)
        };
        // The law is below rounding at this reach.
        let mut near = everyone.clone();
        let pairs = near.pairs.as_mut().unwrap();
        (pairs.bonds, pairs.reach, pairs.skin) = (None, 2.3, Some(0.05));
        let [mut everyone, mut near] = [everyone, near].map(build);
        for _ in 0..30 {
            run(&mut everyone, 1, 0.01);
            run(&mut near, 1, 0.01);
        }
        for (a, b) in everyone.positions().iter().zip(near.positions()) {
            prop_assert!((a - b).norm() < 1e-9, "{a} {b}");
        }
    }
}
