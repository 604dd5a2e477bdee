//! What acts between any two particles.

use nalgebra::{UnitQuaternion, Vector3};
use sinew_particles::{
    Attraction, AttractionLaw, EndingKind, Form, FrameSpec, Gradient, Normalisation, PairSpec,
    Repulsion, Stepping, SystemSpec, Weighting,
};

use crate::{build, particles, run};

pub(crate) fn x(x: f64) -> Vector3<f64> {
    Vector3::new(x, 0.0, 0.0)
}

pub(crate) fn attraction(law: AttractionLaw) -> Option<Attraction> {
    Some(Attraction {
        law,
        ending: EndingKind::Sharp,
        table: None,
    })
}

/// Every pair of `n` particles.
pub(crate) fn all(n: u32) -> Vec<[u32; 2]> {
    (0..n).flat_map(|b| (0..b).map(move |a| [a, b])).collect()
}

/// Particles that all attract each other, at any distance.
pub(crate) fn attracted(positions: Vec<Vector3<f64>>, law: AttractionLaw) -> SystemSpec {
    SystemSpec {
        pairs: Some(PairSpec {
            attraction: attraction(law),
            bonds: Some(all(u32::try_from(positions.len()).unwrap())),
            ..PairSpec::default()
        }),
        ..particles(positions)
    }
}

pub(crate) fn bodies(
    orientations: Vec<UnitQuaternion<f64>>,
    moments: Vector3<f64>,
) -> Option<FrameSpec> {
    Some(FrameSpec {
        spins: vec![Vector3::zeros(); orientations.len()],
        moments: vec![moments; orientations.len()],
        orientations,
        damping: 0.0,
    })
}

#[test]
fn a_table_is_as_exact_as_asked_and_says_so() {
    let laws = [
        AttractionLaw::LennardJones {
            stiffness: 3.0,
            rest_length: 1.1,
            exponent: 4,
        },
        AttractionLaw::TwelveSix {
            depth: 1.0,
            size: 1.0,
        },
        AttractionLaw::Cohesion {
            stiffness: 3.0,
            rest_length: 1.1,
            sharpness: 10.0,
        },
    ];
    for law in laws {
        let mut last = 0;
        for asked in [1e-3, 1e-6, 1e-9] {
            let pair = |r: f64, table: Option<f64>| {
                build(SystemSpec {
                    pairs: Some(PairSpec {
                        attraction: Some(Attraction {
                            law: law.clone(),
                            ending: EndingKind::Shifted,
                            table,
                        }),
                        reach: 2.5,
                        ..PairSpec::default()
                    }),
                    ..particles(vec![Vector3::zeros(), x(r)])
                })
            };
            let (pieces, error) = pair(1.0, Some(asked)).attraction_table().unwrap();
            assert!(error <= asked && pieces > last, "{law:?}: {pieces} {error}");
            last = pieces;
            let force = |r, table| pair(r, table).loads()[0][1].x;
            let greatest = (0..300).map(|k| -force(0.9 + 0.005 * f64::from(k), None));
            let greatest = greatest.fold(0.0, f64::max);
            for k in 0..500 {
                let r = 0.3 + 0.0043 * f64::from(k);
                let exact = force(r, None);
                let off = (force(r, Some(asked)) - exact).abs();
                assert!(
                    off <= 2.0 * asked * exact.abs().max(greatest),
                    "{law:?} at {r}: {off}"
                );
            }
        }
    }
}

#[test]
fn repulsion_is_monotone_up_to_a_sharpness_of_16_thirds_and_not_above() {
    let falls_everywhere = |sharpness: f64| {
        let force = |r: f64| {
            let law = AttractionLaw::Cohesion {
                stiffness: 1.0,
                rest_length: 1.0,
                sharpness,
            };
            build(attracted(vec![Vector3::zeros(), x(r)], law)).loads()[0][1].x
        };
        let forces: Vec<f64> = (200..300).map(|k| force(1e-3 * f64::from(k))).collect();
        forces.windows(2).all(|pair| pair[1] < pair[0])
    };
    assert!(falls_everywhere(16.0 / 3.0 - 1e-3));
    assert!(!falls_everywhere(16.0 / 3.0 + 1e-2));
}

#[test]
fn a_pair_may_pass_through_itself_but_no_number_is_lost() {
    let law = AttractionLaw::Cohesion {
        stiffness: 1.0,
        rest_length: 1.0,
        sharpness: 42.0,
    };
    let mut system = build(SystemSpec {
        velocities: vec![x(0.05), x(-0.05)],
        ..attracted(vec![x(-0.8), x(0.8)], law)
    });
    for _ in 0..400 {
        run(&mut system, 1, 0.1);
        assert!(system.positions()[0].norm() < 10.0);
    }
    assert!(system.positions()[0].x > system.positions()[1].x, "through");
}

#[test]
fn coincident_bodies_and_antiparallel_normals_stay_finite() {
    for gap in [0.0, 1e-9] {
        let flipped = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::PI);
        let mut system = build(SystemSpec {
            frames: bodies(
                vec![UnitQuaternion::identity(), flipped],
                Vector3::repeat(0.1),
            ),
            pairs: Some(PairSpec {
                attraction: attraction(AttractionLaw::Cohesion {
                    stiffness: 1.0,
                    rest_length: 1.0,
                    sharpness: 4.0,
                }),
                form: Some(Form {
                    form: 1e-9,
                    coplanarity: 1e-9,
                    conormality: 1.0,
                    cocircularity: 1e-9,
                    curvatures: vec![[0.0; 2]; 2],
                    weighting: Weighting::Wendland { reach: 3.0 },
                    normalisation: Normalisation::SquaredDistance,
                    gradient: Gradient::Whole,
                }),
                reach: 3.0,
                repulsion: Some(Repulsion {
                    strength: 1.0,
                    length: 0.1,
                    reach: 2.0,
                }),
                ..PairSpec::default()
            }),
            ..particles(vec![Vector3::zeros(), x(gap)])
        });
        run(&mut system, 100, 1e-3);
        assert!(system.positions()[1].norm() > gap, "pushed apart");
    }
}

#[test]
fn lennard_jones_far_inside_is_substepped_or_refused_but_never_no_number() {
    let law = AttractionLaw::LennardJones {
        stiffness: 1.0,
        rest_length: 1.0,
        exponent: 4,
    };
    let spec = attracted(vec![Vector3::zeros(), x(0.3)], law);
    let mut whole = build(spec.clone());
    while whole.positions()[1].x < 100.0 {
        run(&mut whole, 1, 0.1);
    }
    let energy_after = |stepping: Stepping| {
        let mut system = build(SystemSpec {
            stepping,
            ..spec.clone()
        });
        let start = system.energy();
        run(&mut system, 100, 0.1);
        system.energy() / start
    };
    // The first substep sees the wall at its steepest; the tolerance sees what it does.
    let stable = energy_after(Stepping::Stable { most: 10_000 });
    assert!((stable - 1.0).abs() < 0.2, "{stable}");
    let adaptive = energy_after(Stepping::Adaptive {
        tolerance: 1e-7,
        most: 100_000,
    });
    assert!((adaptive - 1.0).abs() < 1e-2, "{adaptive}");
}

#[test]
fn every_particle_in_one_cell_and_one_infinitely_far_are_served_alike() {
    let law = AttractionLaw::Cohesion {
        stiffness: 1.0,
        rest_length: 1.0,
        sharpness: 4.0,
    };
    let at =
        |i: u32| Vector3::new(f64::from(i % 7), f64::from(i / 7 % 7), f64::from(i / 49)) * 1e-3;
    let mut places: Vec<_> = (0..300).map(at).collect();
    places.push(Vector3::repeat(1e200));
    let mut spec = attracted(places, law);
    let pairs = spec.pairs.as_mut().unwrap();
    (pairs.bonds, pairs.reach) = (None, 5.0);
    let system = build(spec);
    let forces = system.loads()[0].clone();
    assert_eq!(forces[300], Vector3::zeros());
    let total: Vector3<f64> = forces.iter().sum();
    let size: f64 = forces.iter().map(|f| f.norm()).sum();
    assert!(total.norm() < 1e-12 * size);
}
