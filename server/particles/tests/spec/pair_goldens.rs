//! What acts between any two particles, against the independent reference: see `data/README.md`.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use sinew_particles::{
    AttractionLaw, Form, FrameSpec, Gradient, Integrator, Normalisation, PairFriction, PairSpec,
    Repulsion, SystemSpec, Weighting, oscillation,
};

use crate::{
    build,
    pairs::{attracted, attraction, bodies, x},
    particles, run,
};

pub(crate) fn cases(text: &str) -> Vec<Value> {
    let golden: Value = serde_json::from_str(text).unwrap();
    golden["cases"].as_array().unwrap().clone()
}

pub(crate) fn vector(value: &Value) -> Vector3<f64> {
    let row: [f64; 3] = serde_json::from_value(value.clone()).unwrap();
    row.into()
}

pub(crate) fn vectors(value: &Value) -> Vec<Vector3<f64>> {
    value.as_array().unwrap().iter().map(vector).collect()
}

pub(crate) fn quaternions(value: &Value) -> Vec<UnitQuaternion<f64>> {
    let rows: Vec<[f64; 4]> = serde_json::from_value(value.clone()).unwrap();
    let unit = |[w, i, j, k]: [f64; 4]| UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k));
    rows.into_iter().map(unit).collect()
}

pub(crate) fn lennard_jones(given: &Value) -> AttractionLaw {
    AttractionLaw::LennardJones {
        stiffness: given["E"].as_f64().unwrap(),
        rest_length: given["r0"].as_f64().unwrap(),
        exponent: u32::try_from(given["n"].as_u64().unwrap()).unwrap(),
    }
}

/// The paper's parameters, E and α, as the stiffness and the sharpness of the law without scale.
pub(crate) fn cohesion(given: &Value) -> AttractionLaw {
    let number = |name: &str| given[name].as_f64().unwrap();
    AttractionLaw::Cohesion {
        stiffness: number("E") * number("r0"),
        rest_length: number("r0"),
        sharpness: number("alpha") * number("r0").powi(2),
    }
}

#[test]
fn radial_laws_and_their_potentials_are_the_golden_ones() {
    let lennard_jones = cases(include_str!("data/A01_lennard_jones.json"));
    let cohesions = cases(include_str!("data/A02_cohesion.json"));
    let mut compared = 0;
    for (case, law) in (lennard_jones
        .iter()
        .map(|case| (case, self::lennard_jones(&case["in"]))))
    .chain(cohesions.iter().map(|case| (case, cohesion(&case["in"]))))
    {
        let r = case["in"]["r"].as_f64().unwrap();
        let system = build(attracted(vec![Vector3::zeros(), x(r)], law));
        let (Some(force), Some(potential)) = (
            case["out"]["force"].as_f64(),
            case["out"]["potential"].as_f64(),
        ) else {
            continue;
        };
        let scale = case["in"]["E"].as_f64().unwrap() * case["in"]["r0"].as_f64().unwrap();
        let found = system.loads()[0][1].x;
        assert!(
            (found - force).abs() < 1e-11 * force.abs() + 1e-12 * scale,
            "{case} {found}"
        );
        let found = system.energy();
        assert!(
            (found - potential).abs() < 1e-9 * potential.abs() + 1e-12,
            "{case} {found}"
        );
        compared += 1;
    }
    assert!(compared > 30, "{compared}");
}

/// The pair of a golden case, with one potential.
fn oriented_pair(case: &Value, gradient: Gradient) -> SystemSpec {
    let given = &case["in"];
    let number = |name: &str| given[name].as_f64().unwrap_or(0.0);
    let kind = given["kind"].as_str().unwrap();
    let (a, b) = (vector(&given["xA"]), vector(&given["xB"]));
    let normals = [vector(&given["nA"]), vector(&given["nB"])];
    let axis = if kind == "P" {
        Vector3::z()
    } else {
        Vector3::x()
    };
    let facing = |to: &Vector3<f64>| UnitQuaternion::rotation_between(&axis, to).unwrap();
    let mut frames = normals.map(|n| facing(&n)).to_vec();
    if kind == "P" {
        // The golden one is emitted by A alone: B's axis across the pair adds nothing.
        frames[1] = facing(&(b - a).cross(&Vector3::new(0.3, -0.2, 0.9)).normalize());
    }
    let normalised = given["normalise"] == true;
    let radius = number("R");
    let strength = match kind {
        "F" if !normalised => radius * radius,
        _ => 1.0,
    };
    let if_kind = |kinds: &str| if kinds.contains(kind) { strength } else { 0.0 };
    let curvature = if kind == "F" {
        radius.recip()
    } else {
        number("kappa")
    };
    SystemSpec {
        frames: bodies(frames.clone(), Vector3::repeat(1.0)),
        pairs: Some(PairSpec {
            form: Some(Form {
                form: if_kind("KF"),
                coplanarity: if_kind("P"),
                conormality: if_kind("N"),
                cocircularity: if_kind("C"),
                curvatures: vec![[curvature; 2]; 2],
                weighting: match given["psi"].as_str().unwrap() {
                    "gauss" => Weighting::Gaussian {
                        width: number("psi_arg"),
                    },
                    "wendland" => Weighting::Wendland {
                        reach: number("psi_arg"),
                    },
                    _ => Weighting::One,
                },
                normalisation: if normalised {
                    Normalisation::SquaredDistance
                } else {
                    Normalisation::None
                },
                gradient,
            }),
            bonds: Some(vec![[0, 1]]),
            ..PairSpec::default()
        }),
        ..particles(vec![a, b])
    }
}

#[test]
fn orientation_potentials_are_the_golden_ones_with_and_without_the_weights_slope() {
    for case in cases(include_str!("data/A03_pair_potentials.json")) {
        let close = |found: Vector3<f64>, golden: &Value| {
            let golden = vector(golden);
            assert!(
                (found - golden).norm() < 1e-11 * (1.0 + golden.norm()),
                "{case}: {found}"
            );
        };
        let whole = build(oriented_pair(&case, Gradient::Whole));
        let [forces, torques] = whole.loads();
        let out = &case["out"];
        let potential = out["potential"].as_f64().unwrap();
        assert!((whole.energy() - potential).abs() < 1e-11 * (1.0 + potential));
        close(forces[0], &out["F_A"]);
        close(forces[1], &out["F_B"]);
        close(torques[0], &out["T_A"]);
        close(torques[1], &out["T_B"]);
        let [forces, torques] = build(oriented_pair(&case, Gradient::WithoutWeight)).loads();
        close(forces[1], &out["paper_variant_F_B"]);
        close(torques[0], &out["paper_variant_T_A"]);
        close(torques[1], &out["paper_variant_T_B"]);
    }
}

#[test]
fn pair_friction_is_the_golden_one() {
    for case in cases(include_str!("data/A04_friction.json")) {
        let given = &case["in"];
        let mut spec = SystemSpec {
            velocities: vec![vector(&given["vA"]), vector(&given["vB"])],
            frames: bodies(vec![UnitQuaternion::identity(); 2], Vector3::repeat(1.0)),
            pairs: Some(PairSpec {
                friction: Some(PairFriction {
                    sliding: given["c_t"].as_f64().unwrap(),
                    turning: given["c_r"].as_f64().unwrap(),
                }),
                bonds: Some(vec![[0, 1]]),
                ..PairSpec::default()
            }),
            ..particles(vec![Vector3::zeros(), vector(&given["r"])])
        };
        spec.frames.as_mut().unwrap().spins = vec![vector(&given["wA"]), vector(&given["wB"])];
        let [forces, torques] = build(spec).loads();
        for (found, name) in [
            (forces[0], "F_A"),
            (forces[1], "F_B"),
            (torques[0], "T_A"),
            (torques[1], "T_B"),
        ] {
            assert!(
                (found - vector(&case["out"][name])).norm() < 1e-11,
                "{case} {name}"
            );
        }
    }
}

#[test]
fn pairs_are_complete_or_repel_as_the_paper_rules() {
    for case in cases(include_str!("data/A05_typing_repulsion.json")) {
        let given = &case["in"];
        let repels = |strength: f64, length: f64| Repulsion {
            strength,
            length,
            reach: 50.0,
        };
        if given["r"].is_f64() {
            let number = |name: &str| given[name].as_f64().unwrap();
            let system = build(SystemSpec {
                pairs: Some(PairSpec {
                    bonds: Some(vec![]),
                    repulsion: Some(repels(number("k"), number("lam"))),
                    ..PairSpec::default()
                }),
                ..particles(vec![Vector3::zeros(), x(number("r"))])
            });
            let expected = case["out"]["repulsion"].as_f64().unwrap();
            assert!((system.loads()[0][1].x - expected).abs() < 1e-11);
            continue;
        }
        let kind = |name: &str| match given[name].as_str().unwrap() {
            "hinge" => 0,
            "a" => 1,
            _ => 2,
        };
        let object = |name: &str| u32::try_from(given[name].as_u64().unwrap()).unwrap();
        let system = build(SystemSpec {
            pairs: Some(PairSpec {
                attraction: attraction(AttractionLaw::Cohesion {
                    stiffness: 1.0,
                    rest_length: 1.0,
                    sharpness: 4.0,
                }),
                reach: 3.0,
                repulsion: Some(repels(1.0, 1.0)),
                objects: vec![object("objA"), object("objB")],
                kinds: vec![kind("typeA"), kind("typeB")],
                ..PairSpec::default()
            }),
            ..particles(vec![Vector3::zeros(), x(1.5)])
        });
        let complete = system.loads()[0][1].x < 0.0;
        assert_eq!(complete, case["out"]["kind"] == "complete", "{case}");
    }
}

#[test]
fn oscillation_is_the_golden_measure() {
    for case in cases(include_str!("data/A06_oscillation.json")) {
        let moved = vectors(&case["in"]["dx"]);
        let masses = &case["in"]["mass"];
        let masses = if masses.is_null() {
            vec![1.0; moved.len()]
        } else {
            serde_json::from_value(masses.clone()).unwrap()
        };
        let expected = case["out"]["O"].as_f64().unwrap();
        assert!((oscillation(&moved, &masses) - expected).abs() < 1e-11 * (1.0 + expected));
    }
}

#[test]
fn particles_move_as_the_golden_ones_by_each_integrator() {
    let mut compared = 0;
    for case in cases(include_str!("data/A09_integrators.json")) {
        let given = &case["in"];
        let integrator = match given["method"].as_str().unwrap() {
            "symplectic_euler" => Integrator::SemiImplicitEuler,
            "verlet" => Integrator::VelocityVerlet,
            "rk4" => Integrator::RungeKutta4,
            "implicit_midpoint" => Integrator::ImplicitMidpoint,
            _ => continue,
        };
        let law = match given["law"].as_str().unwrap() {
            "lj" => lennard_jones(&given["params"]),
            _ => cohesion(&given["params"]),
        };
        let positions = vectors(&given["x0"]);
        let mut system = build(SystemSpec {
            velocities: vectors(&given["v0"]),
            masses: vec![given["mass"].as_f64().unwrap(); positions.len()],
            damping: given["c"].as_f64().unwrap(),
            integrator,
            ..attracted(positions, law)
        });
        let steps = usize::try_from(given["steps"].as_u64().unwrap()).unwrap();
        run(&mut system, steps, given["dt"].as_f64().unwrap());
        let out = vectors(&case["out"]["x"])
            .into_iter()
            .chain(vectors(&case["out"]["v"]));
        let found = system.positions().iter().chain(system.velocities());
        for (found, expected) in found.zip(out) {
            assert!(
                (found - expected).norm() < 2e-8,
                "{integrator:?} {found} {expected}"
            );
        }
        compared += 1;
    }
    assert_eq!(compared, 32);
}

fn oriented_system(case: &Value) -> SystemSpec {
    let given = &case["in"];
    let params = &given["params"];
    let number = |name: &str| params[name].as_f64().unwrap();
    let positions = vectors(&given["x"]);
    let n = positions.len();
    let orientations = quaternions(&given["q"]);
    let moments = vector(&params["I"]);
    let spin = |(q, l): (&UnitQuaternion<f64>, Vector3<f64>)| {
        q * q.inverse_transform_vector(&l).component_div(&moments)
    };
    let spins = orientations
        .iter()
        .zip(vectors(&given["L"]))
        .map(spin)
        .collect();
    let curvatures: Vec<f64> = serde_json::from_value(params["kappa"].clone()).unwrap();
    SystemSpec {
        velocities: vectors(&given["v"]),
        masses: vec![number("mass"); n],
        damping: number("c"),
        frames: Some(FrameSpec {
            orientations,
            spins,
            moments: vec![moments; n],
            damping: number("crot"),
        }),
        pairs: Some(PairSpec {
            attraction: attraction(cohesion(params)),
            form: Some(Form {
                form: number("wF"),
                coplanarity: number("wP"),
                conormality: number("wN"),
                cocircularity: number("wC"),
                curvatures: curvatures.into_iter().map(|k| [k; 2]).collect(),
                weighting: Weighting::Wendland {
                    reach: number("psi_arg"),
                },
                normalisation: Normalisation::SquaredDistance,
                gradient: if params["drop_dpsi"] == true {
                    Gradient::WithoutWeight
                } else {
                    Gradient::Whole
                },
            }),
            friction: Some(PairFriction {
                sliding: number("c_t"),
                turning: number("c_r"),
            }),
            reach: number("rcut"),
            ..PairSpec::default()
        }),
        ..particles(positions)
    }
}

#[test]
fn an_oriented_system_moves_as_the_golden_one() {
    for case in cases(include_str!("data/A10_oriented_system.json")) {
        let given = &case["in"];
        let mut system = build(oriented_system(&case));
        let out = &case["out"];
        let [forces, torques] = system.loads();
        for (found, name) in [(forces, "force"), (torques, "torque")] {
            for (found, expected) in found.iter().zip(vectors(&out[name])) {
                assert!(
                    (found - expected).norm() < 1e-9 * (1.0 + expected.norm()),
                    "{name}"
                );
            }
        }
        let steps = given["steps"].as_u64().unwrap();
        run(
            &mut system,
            usize::try_from(steps).unwrap(),
            given["dt"].as_f64().unwrap(),
        );
        let found = system.positions().iter().zip(system.velocities());
        let expected = vectors(&out["x_end"])
            .into_iter()
            .zip(vectors(&out["v_end"]));
        for ((x, v), (x_exact, v_exact)) in found.zip(expected) {
            assert!(
                (x - x_exact).norm() < 1e-9 * (1.0 + x_exact.norm()),
                "{x} {x_exact}"
            );
            assert!(
                (v - v_exact).norm() < 1e-9 * (1.0 + v_exact.norm()),
                "{v} {v_exact}"
            );
        }
        let turned = system
            .orientations()
            .unwrap()
            .iter()
            .zip(quaternions(&out["q_end"]));
        for (q, exact) in turned {
            assert!(q.angle_to(&exact) < 1e-9);
        }
    }
}
