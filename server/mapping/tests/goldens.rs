//! Whole mappings against the independent reference: see `data/README.md`.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::Vector3;
use serde_json::Value;
use sinew_mapping::{
    Filter, Fit, Kernel, Polynomial, RadialBasis, RadialFunction, Recipe, Reference, Rule,
    ShapeMatching, Weighting, bind,
};

fn vectors(value: &Value) -> Vec<Vector3<f64>> {
    let rows: Vec<[f64; 3]> = serde_json::from_value(value.clone()).unwrap();
    rows.into_iter().map(Vector3::from).collect()
}

fn radial(case: &Value) -> Rule {
    let function = match case["phi"].as_str().unwrap() {
        "gaussian" => RadialFunction::Gaussian,
        "shifted_log" => RadialFunction::ShiftedLog,
        "multiquadric" => RadialFunction::Multiquadric,
        "inverse_multiquadric" => RadialFunction::InverseMultiquadric,
        "inverse_quadratic" => RadialFunction::InverseQuadratic,
        "wendland_c2" => RadialFunction::Wendland,
        "thin_plate" => RadialFunction::ThinPlate,
        "cubic" => RadialFunction::Cubic,
        "linear" => RadialFunction::Linear,
        other => panic!("no function {other}"),
    };
    assert_eq!(case["poly"], "linear");
    Rule::RadialBasis(RadialBasis {
        function,
        scale: case["s"].as_f64(),
        polynomial: Polynomial::Linear,
    })
}

fn recipe(case: &Value) -> Recipe {
    let of = |rule| Recipe {
        weighting: Weighting::default(),
        filter: Filter::KeepK(usize::MAX),
        rule,
        reference: Reference::Initial,
    };
    let weighted = |kernel, scale| Recipe {
        weighting: Weighting {
            kernel,
            scale: Some(scale),
            ..Weighting::default()
        },
        ..of(Rule::WeightedMean)
    };
    let scale = case["s"].as_f64().unwrap_or(1.0);
    let beta = case["beta"].as_f64().unwrap_or(1.0);
    let text = |field: &str| case[field].as_str().unwrap_or_default();
    match (text("mapping"), text("phi"), text("mode")) {
        ("mean", ..) => of(Rule::Mean),
        ("barycentric", ..) => of(Rule::Barycentric),
        ("rbf", ..) => of(radial(case)),
        // The golden has exp(−(r/s)²), without our half.
        (_, "gauss", _) => weighted(Kernel::Gaussian, scale / 2.0_f64.sqrt()),
        (_, "inv2", _) => weighted(Kernel::InverseSquare, scale),
        (.., "rigid") => of(Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid))),
        (.., "linear") => of(Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear {
            beta,
        }))),
        (.., "quadratic") => of(Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic {
            beta,
        }))),
        _ => panic!("no recipe for {case}"),
    }
}

fn agrees(text: &str) -> usize {
    let golden: Value = serde_json::from_str(text).unwrap();
    let cases = golden["cases"].as_array().unwrap().iter();
    // Weights of their own come from no weighting: they are for the stage alone, `src/goldens.rs`.
    let cases: Vec<&Value> = cases.filter(|case| case["in"]["w"].is_null()).collect();
    for case in &cases {
        let (rest, now) = (vectors(&case["in"]["P0"]), vectors(&case["in"]["P1"]));
        let vertices = vectors(&case["in"]["X"]);
        let usable = vec![true; rest.len()];
        let mut binding = bind(&vertices, &rest, &usable, &recipe(&case["in"])).unwrap();
        let mut posed = vec![Vector3::zeros(); vertices.len()];
        binding.pose(&now, &mut posed).unwrap();
        for (x, expected) in posed.iter().zip(vectors(&case["out"]["X1"])) {
            let error = (x - expected).amax();
            // The systems of an interpolation lose some digits, here and in the reference.
            let bound = if case["in"]["mapping"] == "rbf" {
                1e-9
            } else {
                1e-11
            };
            assert!(error < bound, "{} {error}: {x} {expected}", case["in"]);
        }
    }
    cases.len()
}

#[test]
fn every_rule_agrees_with_the_golden() {
    assert_eq!(agrees(include_str!("data/C04_mappings.json")), 45);
}

#[test]
fn degenerate_shapes_agree_with_the_golden() {
    assert_eq!(agrees(include_str!("data/C05_shape_degenerate.json")), 7);
}
