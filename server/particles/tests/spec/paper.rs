//! Scenes of the paper on oriented particles.

use nalgebra::Vector3;
use sinew_particles::{
    AttractionLaw, ExternalForce, Form, Gradient, Integrator, Normalisation, PairFriction,
    PairSpec, Repulsion, System, SystemSpec, Track, Weighting, arc_chain,
};

use crate::{
    build,
    pair_goldens::{cases, quaternions, vectors},
    pairs::{all, attracted, attraction, bodies},
    particles, run,
};

#[test]
fn arc_chains_are_the_golden_ones_and_none_is_bent_too_far() {
    for case in cases(include_str!("data/A11_spiral_rest.json")) {
        let curvatures: Vec<f64> = serde_json::from_value(case["in"]["kappa"].clone()).unwrap();
        let chain = arc_chain(&curvatures, case["in"]["ell"].as_f64().unwrap()).unwrap();
        let expected = vectors(&case["out"]["x"])
            .into_iter()
            .zip(quaternions(&case["out"]["q"]));
        for (body, (x, q)) in chain.iter().zip(expected) {
            assert!((body.translation.vector - x).norm() < 1e-11);
            assert!(body.rotation.angle_to(&q) < 1e-11);
        }
    }
    let refused = arc_chain(&[1.0, 1.0, 3.5], 1.0).unwrap_err();
    assert_eq!((refused.first, refused.curvature), (1, 2.25));
    assert!(arc_chain(&[2.0, 2.0], 1.0).is_err());
    assert!(
        arc_chain(&[-1.5, 0.0, 1.5], 1.0).is_ok(),
        "hollow, flat and round"
    );
}

#[test]
fn the_compressed_triangle_returns_or_flies_apart_as_the_golden_one() {
    for case in cases(include_str!("data/A12_triangle.json")) {
        let given = &case["in"];
        let number = |name: &str| given[name].as_f64().unwrap();
        let law = if given["law"].as_str().unwrap().starts_with("lj") {
            AttractionLaw::LennardJones {
                stiffness: 1.0,
                rest_length: 1.0,
                exponent: 4,
            }
        } else {
            AttractionLaw::Cohesion {
                stiffness: 6.645_720_331_347_978,
                rest_length: 1.0,
                sharpness: 10.0,
            }
        };
        let corner = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 3.0;
            Vector3::new(angle.cos(), angle.sin(), 0.0) * (number("p") / 3.0_f64.sqrt())
        };
        let mut system = build(SystemSpec {
            damping: number("c"),
            ..attracted((0..3).map(corner).collect(), law)
        });
        let side = |s: &System| (s.positions()[1] - s.positions()[0]).norm();
        let apart = (0..600).any(|_| {
            run(&mut system, 1, number("dt"));
            side(&system) > 6.0
        });
        assert_eq!(apart, case["out"]["diverges"] == true, "{case}");
    }
}

#[test]
fn the_spiral_recovers_its_rest_after_it_was_uncoiled() {
    // The paper's force: with the slope of the weight a pulled bond is longer by a few hundredths.
    let mut spec = spiral(0.4);
    let form = spec.pairs.as_mut().unwrap().form.as_mut().unwrap();
    form.gradient = Gradient::WithoutWeight;
    let mut system = build(spec);
    let ends = |s: &System| (s.positions()[9] - s.positions()[0]).norm();
    run(&mut system, 7_500, 0.02);
    let rest = system.positions().to_vec();
    assert!((2.42..2.52).contains(&ends(&system)), "{}", ends(&system));
    run(&mut system, 3_000, 0.02);
    assert!((9.3..9.9).contains(&ends(&system)), "{}", ends(&system));
    run(&mut system, 10_000, 0.02);
    let distances = |x: &[Vector3<f64>]| -> Vec<f64> {
        all(10)
            .iter()
            .map(|&[a, b]| (x[a as usize] - x[b as usize]).norm())
            .collect()
    };
    let now = distances(system.positions());
    let off = distances(&rest)
        .iter()
        .zip(&now)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(off < 5e-3 * 1.7, "{off}");
}

#[test]
fn bodies_keep_their_energy_for_a_hundred_thousand_steps() {
    let chain = arc_chain(&[0.24, 0.5, 0.8, 0.5], 1.05).unwrap();
    let mut spec = spiral(0.0);
    let places: Vec<_> = chain.iter().map(|body| body.translation.vector).collect();
    let mut pairs = spec.pairs.take().unwrap();
    pairs.bonds = Some(vec![[0, 1], [1, 2], [2, 3]]);
    pairs.friction = None;
    pairs.attraction = attraction(AttractionLaw::LennardJones {
        stiffness: 1.0,
        rest_length: 1.0,
        exponent: 4,
    });
    let form = pairs.form.as_mut().unwrap();
    form.curvatures = [0.2, 0.4, 0.6, 0.4].map(|k| [k; 2]).to_vec();
    let drift = |gradient: Gradient| {
        let mut pairs = pairs.clone();
        pairs.form.as_mut().unwrap().gradient = gradient;
        let mut system = build(SystemSpec {
            integrator: Integrator::VelocityVerlet,
            frames: bodies(
                chain.iter().map(|body| body.rotation).collect(),
                Vector3::repeat(0.1),
            ),
            pairs: Some(pairs),
            ..particles(places.clone())
        });
        let start = system.energy();
        let mut drift = [0.0_f64; 2];
        for step in 0..100_000 {
            run(&mut system, 1, 0.01);
            let half = usize::from(step >= 50_000);
            drift[half] = drift[half].max((system.energy() - start).abs());
        }
        drift
    };
    let [first, second] = drift(Gradient::Whole);
    assert!(first < 1e-5, "{first}");
    assert!(second < 2.0 * first, "no drift: {second} after {first}");
    // What the paper leaves out is what keeps the energy.
    assert!(drift(Gradient::WithoutWeight)[0] > 100.0 * first);
}

/// The spiral of ten: at rest for 150 s, its ends pulled apart for 60 s, then free.
fn spiral(pull: f64) -> SystemSpec {
    let curvatures: Vec<f64> = (0..10)
        .map(|i| 0.24 * (1.4_f64 / 0.24).powf(f64::from(i) / 9.0))
        .collect();
    let chain = arc_chain(&curvatures, 1.0).unwrap();
    let places: Vec<_> = chain.iter().map(|body| body.translation.vector).collect();
    let orientations = chain.iter().map(|body| body.rotation).collect();
    let along: Vector3<f64> = (places[9] - places[0]).normalize() * pull;
    let force = |particle: u32, force: Vector3<f64>| ExternalForce {
        particle,
        force: Track {
            times: vec![150.0, 160.0, 210.0, 210.02],
            values: vec![Vector3::zeros(), force, force, Vector3::zeros()],
        },
    };
    SystemSpec {
        damping: 0.02,
        forces: vec![force(0, -along), force(9, along)],
        frames: bodies(orientations, Vector3::repeat(0.1)),
        pairs: Some(PairSpec {
            attraction: attraction(AttractionLaw::Cohesion {
                stiffness: 100.0,
                rest_length: 1.0,
                sharpness: 4.0,
            }),
            form: Some(Form {
                form: 1.0,
                coplanarity: 1.0,
                conormality: 0.0,
                cocircularity: 0.0,
                curvatures: curvatures.iter().map(|&k| [k; 2]).collect(),
                weighting: Weighting::Wendland { reach: 3.0 },
                normalisation: Normalisation::SquaredDistance,
                gradient: Gradient::Whole,
            }),
            friction: Some(PairFriction {
                sliding: 1.0,
                turning: 0.1,
            }),
            bonds: Some((0..9).map(|i| [i, i + 1]).collect()),
            repulsion: Some(Repulsion {
                strength: 200.0,
                length: 0.15,
                reach: 3.0,
            }),
            ..PairSpec::default()
        }),
        ..particles(places)
    }
}

#[test]
fn what_is_promised_stable_is_stable_for_bodies_too() {
    let mut system = build(spiral(0.0));
    let dt = 0.95 * system.largest_stable_step();
    assert!(dt > 0.02, "timid: {dt}");
    let size = |s: &System| s.positions().iter().map(|x| x.norm()).fold(0.0, f64::max);
    let start = size(&system);
    run(&mut system, 20_000, dt);
    assert!(size(&system) < 1.1 * start);
}
