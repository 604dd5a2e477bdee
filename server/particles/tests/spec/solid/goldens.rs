//! Against the independent reference: see `data/README.md`.

use nalgebra::{DMatrix, Matrix3, Vector3};
use serde_json::Value;
use sinew_particles::{Dimension, Integration, MaterialLaw, Metric, Reach, Solid, SolidSpec};

use super::{material, statics};
use crate::goldens::cases;

fn number(value: &Value) -> f64 {
    let text = value.as_str().map(|text| text.parse().unwrap());
    text.unwrap_or_else(|| value.as_f64().unwrap())
}

fn vectors(value: &Value) -> Vec<Vector3<f64>> {
    let rows = value.as_array().unwrap().iter();
    let vector = |row: &Value| {
        let at = |k: usize| row.get(k).map_or(0.0, number);
        Vector3::new(at(0), at(1), at(2))
    };
    rows.map(vector).collect()
}

fn dimension(points: &Value) -> Dimension {
    match points[0].as_array().unwrap().len() {
        2 => Dimension::Plane,
        _ => Dimension::Space,
    }
}

/// The reference's method: nodal integration, one reach for all.
fn spec(input: &Value, points: &Value) -> SolidSpec {
    let exponent = input.get("gamma").map_or(1.0, number);
    let metric = match input.get("metric").and_then(Value::as_str) {
        Some("euclid") | None => Metric::Geodesic { exponent: 1.0 },
        Some("penal") => Metric::Graded {
            gap: number(&input["x0"]),
            exponent,
        },
        Some(_) => Metric::Geodesic { exponent },
    };
    let law = match input.get("model").and_then(Value::as_str) {
        Some("corotated") => MaterialLaw::Corotated,
        Some("stvk") => MaterialLaw::StVenantKirchhoff,
        Some(_) | None => MaterialLaw::Linear,
    };
    let number = |name: &str, default: f64| input.get(name).map_or(default, number);
    SolidSpec {
        dimension: dimension(points),
        metric,
        reach: Reach::Length(number("h", 0.0)),
        integration: Integration::Nodal,
        stabilisation: number("beta", 0.0),
        ..SolidSpec::new(material(number("E", 1.0), number("nu", 0.3), law), 1.0)
    }
}

fn assert_near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found} against {expected}"
    );
}

#[test]
fn the_distance_along_the_cheapest_path_is_the_golden_one_within_reach() {
    for case in cases(include_str!("../data/B01_gamma_geodesic.json")) {
        let input = &case["in"];
        let points = vectors(&input["points"]);
        let solid = Solid::new(
            &spec(
                &serde_json::json!({
                    "metric": "geodesic", "gamma": input["gamma"], "h": input["h"],
                }),
                &input["points"],
            ),
            &points,
        )
        .unwrap();
        let sources = input["sources"].as_array().unwrap().iter();
        for (row, source) in sources.enumerate() {
            let source = usize::try_from(source.as_u64().unwrap()).unwrap();
            let expected: Vec<f64> = case["out"]["length"][row]
                .as_array()
                .unwrap()
                .iter()
                .map(number)
                .collect();
            assert_seen(&solid, source, &expected, number(&input["h"]), 1e-7);
        }
    }
}

/// A row holds those within reach, and no other.
fn assert_seen(solid: &Solid, source: usize, expected: &[f64], reach: f64, tolerance: f64) {
    let mut seen = solid.neighbours(source).peekable();
    for (other, &distance) in expected.iter().enumerate() {
        // On the very border there is no weight.
        if other == source || distance >= reach * (1.0 - 1e-9) {
            continue;
        }
        let (found, length) = seen.next().unwrap();
        assert_eq!(found as usize, other, "of {source}");
        assert_near(length, distance, tolerance * reach, "distance");
    }
    assert_eq!(
        seen.find(|&(_, distance)| distance < reach * (1.0 - 1e-9)),
        None,
        "of {source}"
    );
}

#[test]
fn the_graded_distance_is_the_golden_one_within_reach() {
    for case in cases(include_str!("../data/B02_penal_geodesic.json")) {
        let input = &case["in"];
        let points = vectors(&input["points"]);
        let mut of = input.clone();
        of["metric"] = "penal".into();
        let solid = Solid::new(&spec(&of, &input["points"]), &points).unwrap();
        let source = usize::try_from(input["source"].as_u64().unwrap()).unwrap();
        let expected: Vec<f64> = case["out"]["D"]
            .as_array()
            .unwrap()
            .iter()
            .map(number)
            .collect();
        assert_seen(&solid, source, &expected, number(&input["h"]), 1e-9);
    }
}

#[test]
fn gradients_are_the_golden_ones_whatever_directions_are_seen() {
    for case in cases(include_str!("../data/B03_mls_gradient.json")) {
        let input = &case["in"];
        let points = vectors(&input["points"]);
        let solid = Solid::new(&spec(input, &input["points"]), &points).unwrap();
        let values = vectors(&input["u"]);
        for i in 0..points.len() {
            let gradient = solid.gradient(i, &values);
            let expected = &case["out"]["gradient"][i];
            let components = expected.as_array().unwrap().len();
            for a in 0..components {
                for b in 0..components {
                    let expected = number(&expected[a][b]);
                    assert_near(
                        gradient[(a, b)],
                        expected,
                        1e-9 + 1e-8 * expected.abs(),
                        "gradient",
                    );
                }
            }
        }
    }
}

#[test]
fn energies_and_forces_are_the_golden_ones() {
    for case in cases(include_str!("../data/B04_elastic_energy_force.json")) {
        let input = &case["in"];
        let [rest, now] = ["X", "x"].map(|name| vectors(&input[name]));
        let spec = SolidSpec {
            volumes: Some(vec![number(&input["vol"]); rest.len()]),
            ..spec(input, &input["X"])
        };
        let mut solid = Solid::new(&spec, &rest).unwrap();
        let energy = number(&case["out"]["energy"]);
        assert_near(solid.energy(&now), energy, 1e-9 + 1e-8 * energy, "energy");
        let expected = vectors(&case["out"]["force"]);
        let most = expected.iter().map(Vector3::amax).fold(0.0, f64::max);
        for (found, expected) in solid.forces(&now).iter().zip(&expected) {
            assert_near((found - expected).amax(), 0.0, 1e-9 + 1e-8 * most, "force");
        }
    }
}

/// The bars of figure 8 of the paper: the upper one is held, the lower one hangs from the block that joins them.
fn two_bars(input: &Value) -> (Vec<Vector3<f64>>, Vec<bool>, Vec<bool>) {
    let [s, length, height, joint] = ["s", "L", "H", "Lj"].map(|name| number(&input[name]));
    let gap = number(&input["gap_rows"]);
    let count = |length: f64| {
        let count = (length / s).round();
        (0..).map(f64::from).take_while(move |&k| k < count)
    };
    let mut points = Vec::new();
    for (low, high, width) in [
        (0.0, height, length),
        (height, height + gap * s, joint),
        (height + gap * s, 2.0 * height + gap * s, length),
    ] {
        for row in count(high - low) {
            points.extend(
                count(width).map(|k| Vector3::new((k + 0.5) * s, low + (row + 0.5) * s, 0.0)),
            );
        }
    }
    let upper = points.iter().map(|x| x.y > height + gap * s).collect();
    let lower = points.iter().map(|x| x.y < height).collect();
    (points, upper, lower)
}

#[test]
fn two_bars_stick_by_straight_distances_and_bend_by_those_along_the_body() {
    for case in cases(include_str!("../data/B05_two_bars.json")) {
        let input = &case["in"];
        let s = number(&input["s"]);
        let (points, upper, lower) = two_bars(input);
        let spec = SolidSpec {
            volumes: Some(vec![s * s; points.len()]),
            ..spec(input, &serde_json::json!([[0.0, 0.0]]))
        };
        let mut solid = Solid::new(&spec, &points).unwrap();
        let free: Vec<bool> = upper.iter().map(|upper| !upper).collect();
        let weight = |&lower: &bool| {
            Vector3::y()
                * if lower {
                    -number(&input["rho_g"]) * s * s
                } else {
                    0.0
                }
        };
        let load: Vec<_> = lower.iter().map(weight).collect();
        let moved = statics(&mut solid, &points, &load, &free);
        let end = points
            .iter()
            .zip(&lower)
            .map(|(x, &lower)| lower && x.x > number(&input["L"]) - s);
        let tip: Vec<f64> = end
            .zip(&moved)
            .filter(|(end, _)| *end)
            .map(|(_, u)| u.y)
            .collect();
        let tip = tip.iter().sum::<f64>() / tip.len() as f64;
        let expected = number(&case["out"]["tip_uy"]);
        assert_near(tip, expected, 1e-9 + 1e-6 * expected.abs(), "tip");
        let beyond = number(&input["Lj"]) + number(&input["h"]);
        let across = (0..points.len()).filter(|&i| lower[i] && points[i].x > beyond);
        let links = across
            .flat_map(|i| solid.neighbours(i))
            .filter(|(j, _)| upper[*j as usize]);
        assert_eq!(links.count() as f64, number(&case["out"]["false_links"]));
    }
}

#[test]
fn a_jump_stops_being_cheapest_at_the_golden_exponent() {
    for case in cases(include_str!("../data/B06_threshold.json")) {
        let input = &case["in"];
        let [gap, free, joint] = ["dg_over_s", "k", "n_g"].map(|name| number(&input[name]));
        let threshold = number(&case["out"]["gamma_star"]);
        // A joint at x = 0 with steps of gap/joint, and two rows from there.
        let steps = |count: f64| (0..).map(f64::from).take_while(move |&k| k <= count);
        let mut points: Vec<_> = steps(joint)
            .map(|k| Vector3::new(0.0, k * gap / joint, 0.0))
            .collect();
        for y in [0.0, gap] {
            points.extend(steps(free).skip(1).map(|k| Vector3::new(k, y, 0.0)));
        }
        let tip = steps(joint + free).count() - 1;
        let linked = |exponent: f64| {
            let spec = spec(
                &serde_json::json!({"metric": "geodesic", "gamma": exponent, "h": 1.01 * gap}),
                &serde_json::json!([[0.0, 0.0]]),
            );
            let solid = Solid::new(&spec, &points).unwrap();
            solid
                .neighbours(tip)
                .any(|(other, _)| points[other as usize].y > 0.5 * gap)
        };
        assert!(linked(threshold - 1e-4), "{input}");
        assert!(!linked(threshold + 1e-4), "{input}");
    }
}

#[test]
fn lattices_have_the_golden_modes_and_no_other_soft_one() {
    for case in cases(include_str!("../data/B07_modes.json")) {
        let input = &case["in"];
        let side = usize::try_from(input["n"].as_u64().unwrap()).unwrap();
        let at = |k: usize| (k as f64 + 0.5) * number(&input["s"]);
        let points: Vec<_> = (0..side * side)
            .map(|i| Vector3::new(at(i % side), at(i / side), 0.0))
            .collect();
        let spec = SolidSpec {
            volumes: Some(vec![number(&input["vol"]); points.len()]),
            ..spec(input, &serde_json::json!([[0.0, 0.0]]))
        };
        let mut solid = Solid::new(&spec, &points).unwrap();
        let mut stiffness = DMatrix::zeros(2 * points.len(), 2 * points.len());
        for column in 0..2 * points.len() {
            let mut moved = points.clone();
            moved[column / 2][column % 2] += 1.0;
            for (i, force) in solid.forces(&moved).iter().enumerate() {
                stiffness[(2 * i, column)] = -force.x;
                stiffness[(2 * i + 1, column)] = -force.y;
            }
        }
        let mut modes: Vec<f64> = stiffness.symmetric_eigenvalues().iter().copied().collect();
        modes.sort_by(f64::total_cmp);
        let expected = &case["out"];
        let largest = number(&expected["largest"]);
        let zeros = modes
            .iter()
            .filter(|mode| mode.abs() < 1e-8 * largest)
            .count();
        assert_eq!(zeros as f64, number(&expected["zero_modes"]));
        for k in 0..3 {
            assert_near(
                modes[3 + k],
                number(&expected["eig_4_5_6"][k]),
                1e-6 * largest,
                "mode",
            );
        }
        assert_near(modes[modes.len() - 1], largest, 1e-6 * largest, "largest");
    }
}

#[test]
fn a_rotation_of_the_whole_is_no_deformation_of_the_golden_cloud() {
    let case = &cases(include_str!("../data/B04_elastic_energy_force.json"))[0];
    let rest = vectors(&case["in"]["X"]);
    let turn: Matrix3<f64> =
        *nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI).matrix();
    let turned: Vec<_> = rest.iter().map(|x| turn * x).collect();
    for model in ["corotated", "stvk"] {
        let mut input = case["in"].clone();
        input["model"] = model.into();
        let solid = Solid::new(&spec(&input, &input["X"]), &rest).unwrap();
        assert_near(solid.energy(&turned), 0.0, 1e-12, model);
    }
}
