//! Every value is checked, and the error names its column, its entry, the value and the remedy.

use nalgebra::{UnitQuaternion, Vector3};
use sinew_particles::{
    Attraction, AttractionLaw, Dimension, Driven, EndingKind, ExternalForce, Form, FrameSpec,
    Gradient, LinkLaw, Links, Material, MaterialLaw, Metric, Normalisation, PairFriction, PairSpec,
    Reach, Repulsion, SolidSpec, Stepping, System, SystemSpec, Track, Weighting,
};

use crate::{build, elastic, particles, run, springs};

fn sound() -> SystemSpec {
    SystemSpec {
        fixed: vec![0],
        links: vec![
            springs(vec![[0, 1], [1, 2]], 1.0, 0.5, 1.0),
            Links {
                ends: vec![[0, 2]],
                law: LinkLaw::Table {
                    lengths: vec![0.0, 1.0],
                    forces: vec![1.0, 0.0],
                },
            },
            Links {
                ends: vec![[1, 2]],
                law: LinkLaw::Friction {
                    stiffness: vec![1.0],
                    limits: vec![1.0],
                },
            },
            Links {
                ends: vec![[1, 2]],
                law: LinkLaw::Breaking {
                    elastic: elastic(1, 1.0, 0.0, None),
                    elongations: vec![0.1],
                },
            },
        ],
        driven: vec![Driven {
            particle: 2,
            path: Track {
                times: vec![0.0, 1.0],
                values: vec![Vector3::y(), Vector3::x()],
            },
        }],
        forces: vec![ExternalForce {
            particle: 1,
            force: Track::constant(Vector3::z()),
        }],
        frames: Some(FrameSpec {
            orientations: vec![UnitQuaternion::identity(); 3],
            spins: vec![Vector3::zeros(); 3],
            moments: vec![Vector3::repeat(1.0); 3],
            damping: 0.0,
        }),
        ..particles(vec![Vector3::zeros(), Vector3::x(), Vector3::y()])
    }
}

#[test]
fn a_sound_specification_is_accepted_and_so_is_an_empty_one() {
    build(sound());
    run(&mut build(SystemSpec::default()), 1, 1.0);
}

/// The springs of a sound specification.
fn sprung(spec: &mut SystemSpec) -> &mut sinew_particles::Elastic {
    let LinkLaw::Spring(elastic) = &mut spec.links[0].law else {
        panic!("not springs")
    };
    elastic
}

type Spoil = fn(&mut SystemSpec);

const FAULTS: [(Spoil, &str); 33] = [
    (
        |s| s.velocities.truncate(2),
        "`velocities` has 2 entries where there are 3 particles: give one for each",
    ),
    (|s| s.masses.push(1.0), "`masses` has 4 entries"),
    (
        |s| sprung(s).stiffness.clear(),
        "`links[0].spring.stiffness` has 0 entries where there are 2 links",
    ),
    (
        |s| sprung(s).damping.truncate(1),
        "`links[0].spring.damping` has 1 entries",
    ),
    (
        |s| sprung(s).rest_lengths = Some(vec![]),
        "`links[0].spring.rest_lengths` has 0 entries",
    ),
    (
        |s| s.positions[2].y = f64::NAN,
        "`positions[2]` is NaN: it must be finite",
    ),
    (
        |s| s.velocities[1].z = f64::INFINITY,
        "`velocities[1]` is inf",
    ),
    (
        |s| s.masses[1] = 0.0,
        "`masses[1]` is 0: it must be finite and above 0",
    ),
    (
        |s| sprung(s).stiffness[1] = -2.5,
        "`links[0].spring.stiffness[1]` is -2.5: it must be finite and not below 0",
    ),
    (
        |s| sprung(s).damping[0] = f64::NAN,
        "`links[0].spring.damping[0]` is NaN",
    ),
    (
        |s| sprung(s).rest_lengths = Some(vec![1.0, -1.0]),
        "`links[0].spring.rest_lengths[1]` is -1",
    ),
    (
        |s| s.gravity.x = f64::NAN,
        "`gravity` is NaN: it must be finite in every component",
    ),
    (|s| s.damping = -1.0, "`damping` is -1"),
    (
        |s| s.fixed.push(3),
        "`fixed[1]` names particle 3, but there are 3: count from 0",
    ),
    (
        |s| s.links[0].ends[1] = [2, 9],
        "`links[0].ends[1]` names particle 9",
    ),
    (
        |s| s.links[2].ends[0] = [1, 1],
        "`links[2].ends[0]` joins particle 1 to itself",
    ),
    (
        |s| s.driven[0].particle = 0,
        "`driven[0].particle` names particle 0, which is fixed: let one of them go",
    ),
    (
        |s| s.driven.push(s.driven[0].clone()),
        "`driven[1].particle` names particle 2, which is driven already",
    ),
    (
        |s| s.driven[0].particle = 7,
        "`driven[0].particle` names particle 7",
    ),
    (
        |s| s.driven[0].path.times[1] = 0.0,
        "`driven[0].path.times[1]` is 0: it must be finite and above the time before it",
    ),
    (
        |s| s.driven[0].path = Track::default(),
        "`driven[0].path.times` has 0 entries where there are 1 keys",
    ),
    (
        |s| s.forces[0].force.values[0].x = f64::NAN,
        "`forces[0].force.values[0]` is NaN",
    ),
    (
        |s| s.forces[0].particle = 3,
        "`forces[0].particle` names particle 3",
    ),
    (
        |s| {
            s.links[1].law = LinkLaw::Table {
                lengths: vec![1.0],
                forces: vec![0.0],
            }
        },
        "`links[1].table.lengths` has 1 entries where there are 2 ends of a segment",
    ),
    (
        |s| {
            s.links[1].law = LinkLaw::Table {
                lengths: vec![1.0, 1.0],
                forces: vec![0.0; 2],
            }
        },
        "`links[1].table.lengths[1]` is 1: it must be finite, not below 0 and above the one before it",
    ),
    (
        |s| {
            s.links[1].law = LinkLaw::Table {
                lengths: vec![0.0, 1.0],
                forces: vec![0.0],
            }
        },
        "`links[1].table.forces` has 1 entries",
    ),
    (
        |s| {
            s.links[2].law = LinkLaw::Friction {
                stiffness: vec![0.0],
                limits: vec![1.0],
            }
        },
        "`links[2].friction.stiffness[0]` is 0: it must be finite and above 0",
    ),
    (
        |s| {
            s.links[3].law = LinkLaw::Breaking {
                elastic: elastic(1, 1.0, 0.0, None),
                elongations: vec![],
            }
        },
        "`links[3].breaking.elongations` has 0 entries",
    ),
    (
        |s| s.frames.as_mut().unwrap().moments[2].y = 0.0,
        "`frames.moments[2][1]` is 0",
    ),
    (
        |s| {
            let half = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.5, 0.0, 0.0, 0.0));
            s.frames.as_mut().unwrap().orientations[1] = half;
        },
        "`frames.orientations[1]` is 0.5: it must be of length 1",
    ),
    (
        |s| s.frames.as_mut().unwrap().spins.truncate(1),
        "`frames.spins` has 1 entries",
    ),
    (
        |s| s.stepping = Stepping::Stable { most: 0 },
        "`stepping.most` is 0: it must be at least 1",
    ),
    (
        |s| {
            s.stepping = Stepping::Adaptive {
                tolerance: 0.0,
                most: 9,
            }
        },
        "`stepping.tolerance` is 0",
    ),
];

#[test]
fn each_fault_is_refused_by_name() {
    for (spoil, message) in FAULTS {
        let mut spec = sound();
        spoil(&mut spec);
        let error = System::new(spec).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn a_fixed_particle_keeps_its_place_whatever_velocity_it_was_given() {
    let mut spec = sound();
    spec.velocities[0] = Vector3::repeat(5.0);
    let mut system = build(spec);
    run(&mut system, 2, 0.1);
    assert_eq!(system.positions()[0], Vector3::zeros());
    assert_eq!(system.velocities()[0], Vector3::zeros());
}

type SpoilPairs = fn(&mut PairSpec);

const FAULTS_OF_PAIRS: [(SpoilPairs, &str); 12] = [
    (|p| p.reach = 0.0, "`pairs.reach` is 0"),
    (|p| p.skin = Some(-1.0), "`pairs.skin` is -1"),
    (
        |p| p.bonds = Some(vec![[0, 3]]),
        "`pairs.bonds[0]` names particle 3",
    ),
    (
        |p| p.objects.truncate(1),
        "`pairs.objects` has 1 entries where there are 3 particles",
    ),
    (|p| p.kinds.push(1), "`pairs.kinds` has 4 entries"),
    (
        |p| p.attraction.as_mut().unwrap().table = Some(0.0),
        "`pairs.attraction.table` is 0",
    ),
    (
        |p| {
            p.attraction.as_mut().unwrap().law = AttractionLaw::LennardJones {
                stiffness: 1.0,
                rest_length: 1.0,
                exponent: 1,
            };
        },
        "`pairs.attraction.lennard_jones.exponent` is 1: it must be 2 to 64",
    ),
    (
        |p| {
            p.attraction.as_mut().unwrap().law = AttractionLaw::DirectedCohesion {
                stiffness: 1.0,
                sharpness: 1.0,
                radii: vec![Vector3::repeat(1.0); 2],
            };
        },
        "`pairs.attraction.directed_cohesion.radii` has 2 entries",
    ),
    (
        |p| p.form.as_mut().unwrap().coplanarity = -1.0,
        "`pairs.form.coplanarity` is -1",
    ),
    (
        |p| p.form.as_mut().unwrap().curvatures[1][1] = f64::NAN,
        "`pairs.form.curvatures[1][1]` is NaN",
    ),
    (
        |p| p.friction.as_mut().unwrap().turning = f64::INFINITY,
        "`pairs.friction.turning` is inf",
    ),
    (
        |p| p.repulsion.as_mut().unwrap().length = 0.0,
        "`pairs.repulsion.length` is 0",
    ),
];

fn sound_pairs() -> PairSpec {
    PairSpec {
        attraction: Some(Attraction {
            law: AttractionLaw::Cohesion {
                stiffness: 1.0,
                rest_length: 1.0,
                sharpness: 4.0,
            },
            ending: EndingKind::Shifted,
            table: Some(1e-6),
        }),
        form: Some(Form {
            form: 1.0,
            coplanarity: 0.0,
            conormality: 0.0,
            cocircularity: 0.0,
            curvatures: vec![[0.0; 2]; 3],
            weighting: Weighting::Wendland { reach: 2.0 },
            normalisation: Normalisation::SquaredDistance,
            gradient: Gradient::Whole,
        }),
        friction: Some(PairFriction {
            sliding: 1.0,
            turning: 0.0,
        }),
        reach: 2.0,
        repulsion: Some(Repulsion {
            strength: 1.0,
            length: 0.1,
            reach: 1.0,
        }),
        objects: vec![0, 0, 1],
        kinds: vec![0, 1, 1],
        ..PairSpec::default()
    }
}

#[test]
fn each_fault_of_pairs_is_refused_by_name() {
    let with = |pairs: PairSpec| SystemSpec {
        pairs: Some(pairs),
        ..sound()
    };
    build(with(sound_pairs()));
    for (spoil, message) in FAULTS_OF_PAIRS {
        let mut pairs = sound_pairs();
        spoil(&mut pairs);
        let error = System::new(with(pairs)).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
    }
    let unframed = SystemSpec {
        frames: None,
        ..with(sound_pairs())
    };
    let error = System::new(unframed).unwrap_err().to_string();
    assert!(
        error.starts_with("`pairs.form` needs orientations"),
        "{error}"
    );
    let crowd = SystemSpec {
        pairs: Some(PairSpec {
            attraction: sound_pairs().attraction,
            reach: 1.0,
            ..PairSpec::default()
        }),
        ..particles(vec![Vector3::zeros(); 8_000])
    };
    let error = System::new(crowd).unwrap_err().to_string();
    assert!(error.contains("more pairs within reach"), "{error}");
}

#[test]
fn every_value_of_a_solid_is_checked() {
    let solid = || {
        let rubber = Material {
            young: 1e4,
            poisson: 0.3,
            law: MaterialLaw::NeoHookean,
        };
        SolidSpec::new(rubber, 1_000.0)
    };
    let metric = |gap, exponent| Metric::Graded { gap, exponent };
    let mut cases: Vec<(&str, SolidSpec)> = Vec::new();
    let mut case = |field, change: &dyn Fn(&mut SolidSpec)| {
        let mut wrong = solid();
        change(&mut wrong);
        cases.push((field, wrong));
    };
    case("solid.material.young", &|s| s.material.young = 0.0);
    case("solid.material.poisson", &|s| s.material.poisson = 0.5);
    case("solid.material.poisson", &|s| s.material.poisson = -0.1);
    case("solid.density", &|s| s.density = f64::NAN);
    case("solid.volumes", &|s| s.volumes = Some(vec![1.0]));
    case("solid.volumes[2]", &|s| {
        s.volumes = Some(vec![1.0, 1.0, 0.0])
    });
    case("solid.metric.graded.gap", &|s| s.metric = metric(0.0, 6.0));
    case("solid.metric.graded.exponent", &|s| {
        s.metric = metric(1.8, 0.5)
    });
    case("solid.metric.geodesic.exponent", &|s| {
        s.metric = Metric::Geodesic {
            exponent: f64::INFINITY,
        }
    });
    case("solid.reach", &|s| s.reach = Reach::Length(-1.0));
    case("solid.reach_spacings", &|s| s.reach = Reach::Spacings(1.0));
    case("solid.stabilisation", &|s| s.stabilisation = -0.1);
    case("solid.damping", &|s| s.damping = -1.0);
    case("solid.break_at_stretch", &|s| {
        s.break_at_stretch = Some(1.0)
    });
    case("positions[1].z", &|s| s.dimension = Dimension::Plane);
    for (field, wrong) in cases {
        let spec = SystemSpec {
            masses: Vec::new(),
            solid: Some(wrong),
            ..particles(vec![Vector3::zeros(), Vector3::z(), Vector3::y()])
        };
        assert_eq!(System::new(spec).unwrap_err().field, field);
    }
    let whole = SystemSpec {
        masses: Vec::new(),
        solid: Some(solid()),
        ..particles(vec![Vector3::zeros(), Vector3::z(), Vector3::y()])
    };
    assert!(System::new(whole).is_ok());
    let massless = SystemSpec {
        masses: Vec::new(),
        ..particles(vec![Vector3::zeros()])
    };
    assert_eq!(System::new(massless).unwrap_err().field, "masses");
}
