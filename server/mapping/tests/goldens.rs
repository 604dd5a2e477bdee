//! Whole mappings against the independent reference: see `data/README.md`.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::Vector3;
use serde_json::Value;
use sinew_mapping::{Filter, Kernel, Recipe, Rule, Weighting, bind};

fn vectors(value: &Value) -> Vec<Vector3<f64>> {
    let rows: Vec<[f64; 3]> = serde_json::from_value(value.clone()).unwrap();
    rows.into_iter().map(Vector3::from).collect()
}

fn recipe(case: &Value) -> Recipe {
    let weighted = |kernel, scale| Recipe {
        weighting: Weighting::Distance {
            kernel,
            scale: Some(scale),
        },
        filter: Filter::KeepK(usize::MAX),
        rule: Rule::WeightedMean,
    };
    let scale = case["s"].as_f64().unwrap_or(1.0);
    match (
        case["mapping"].as_str(),
        case["phi"].as_str(),
        case["mode"].as_str(),
    ) {
        // Weights that do not fall with distance are all alike.
        (Some("mean"), _, _) => weighted(Kernel::Gaussian, 1e10),
        // The golden has exp(−(r/s)²), without our half.
        (_, Some("gauss"), _) => weighted(Kernel::Gaussian, scale / 2.0_f64.sqrt()),
        (_, Some("inv2"), _) => weighted(Kernel::InverseSquare, scale),
        (_, _, Some("rigid")) => Recipe {
            rule: Rule::ShapeMatching,
            ..weighted(Kernel::Gaussian, 1.0)
        },
        _ => panic!("no recipe for {case}"),
    }
}

fn agrees(text: &str) -> usize {
    let golden: Value = serde_json::from_str(text).unwrap();
    let cases = golden["cases"].as_array().unwrap();
    for case in cases {
        let (rest, now) = (vectors(&case["in"]["P0"]), vectors(&case["in"]["P1"]));
        let vertices = vectors(&case["in"]["X"]);
        let usable = vec![true; rest.len()];
        let mut binding = bind(&vertices, &rest, &usable, &recipe(&case["in"])).unwrap();
        let mut posed = vec![Vector3::zeros(); vertices.len()];
        binding.pose(&now, &mut posed).unwrap();
        for (x, expected) in posed.iter().zip(vectors(&case["out"]["X1"])) {
            let error = (x - expected).amax();
            assert!(error < 1e-12, "{} {error}: {x} {expected}", case["in"]);
        }
    }
    cases.len()
}

#[test]
fn mean_weighted_mean_and_shape_matching_agree_with_the_golden() {
    assert_eq!(agrees(include_str!("data/C04_mappings.json")), 12);
}

#[test]
fn degenerate_shapes_agree_with_the_golden() {
    assert_eq!(agrees(include_str!("data/C05_shape_degenerate.json")), 6);
}
