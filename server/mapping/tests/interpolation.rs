//! What an interpolation of all points is.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde_json::Value;
use sinew_mapping::{
    Binding, Filter, MappingError, Polynomial, RadialBasis, RadialFunction, Recipe, Reference,
    Rule, Weighting, bind,
};

const FUNCTIONS: [RadialFunction; 9] = [
    RadialFunction::Gaussian,
    RadialFunction::ShiftedLog,
    RadialFunction::Multiquadric,
    RadialFunction::InverseMultiquadric,
    RadialFunction::InverseQuadratic,
    RadialFunction::Wendland,
    RadialFunction::ThinPlate,
    RadialFunction::Cubic,
    RadialFunction::Linear,
];

fn scattered(n: usize, start: f64) -> Vec<Vector3<f64>> {
    let step = Vector3::new(0.819_172_513, 0.671_043_606, 0.549_700_477);
    (0..n)
        .map(|i| (step * (start + i as f64)).map(f64::fract))
        .collect()
}

fn bound(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    function: RadialFunction,
    scale: Option<f64>,
) -> Result<Binding, MappingError> {
    let recipe = Recipe {
        weighting: Weighting::default(),
        filter: Filter::KeepK(usize::MAX),
        rule: Rule::RadialBasis(RadialBasis {
            function,
            scale,
            polynomial: Polynomial::Linear,
        }),
        reference: Reference::Initial,
    };
    bind(vertices, points, &vec![true; points.len()], &recipe)
}

fn posed(binding: &mut Binding, now: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut out = vec![Vector3::zeros(); binding.dominant().len()];
    binding.pose(now, &mut out).unwrap();
    out
}

fn bend(p: &Vector3<f64>) -> Vector3<f64> {
    let angle = 0.8 * p.x;
    Vector3::new(
        angle.sin() * (2.0 - p.y),
        p.y - angle.cos(),
        p.z + 0.3 * p.x * p.y,
    )
}

#[test]
fn coefficients_and_weights_are_the_same_interpolation() {
    let points = scattered(60, 0.5);
    let now: Vec<_> = points.iter().map(bend).collect();
    for function in FUNCTIONS {
        let vertices = scattered(101, 0.1); // not a whole number of vector registers
        let mut binding = bound(&vertices, &points, function, None).unwrap();
        let out = posed(&mut binding, &now);
        for (vertex, (x, x0)) in out.iter().zip(&vertices).enumerate() {
            let weights = binding.weights(vertex);
            let moved = |&(j, w): &(u32, f64)| (now[j as usize] - points[j as usize]) * w;
            let expected: Vector3<f64> = weights.iter().map(moved).sum();
            let size: f64 = weights.iter().map(|(_, w)| w.abs()).sum();
            let error = (x - x0 - expected).norm() / size.max(1.0);
            assert!(error < 1e-10, "{function:?}, vertex {vertex}: {error:.1e}");
        }
    }
}

#[test]
fn scipy_interpolates_alike() {
    let file: Value = serde_json::from_str(include_str!("data/scipy_interpolation.json")).unwrap();
    let vertices = scattered(9, 0.1);
    for case in file["cases"].as_array().unwrap() {
        let n = usize::try_from(case["points"].as_u64().unwrap()).unwrap();
        let function = match case["phi"].as_str().unwrap() {
            "gaussian" => RadialFunction::Gaussian,
            "multiquadric" => RadialFunction::Multiquadric,
            "inverse_multiquadric" => RadialFunction::InverseMultiquadric,
            "inverse_quadratic" => RadialFunction::InverseQuadratic,
            "thin_plate" => RadialFunction::ThinPlate,
            "cubic" => RadialFunction::Cubic,
            "linear" => RadialFunction::Linear,
            other => panic!("no function {other}"),
        };
        let points = scattered(n, 0.5);
        let now: Vec<_> = points.iter().map(bend).collect();
        let scale = Some(1.5 * (n as f64).recip().cbrt());
        let out = posed(
            &mut bound(&vertices, &points, function, scale).unwrap(),
            &now,
        );
        let expected: Vec<[f64; 3]> =
            serde_json::from_value(case["displacements"].clone()).unwrap();
        for ((x, x0), expected) in out.iter().zip(&vertices).zip(expected) {
            let error = (x - x0 - Vector3::from(expected)).norm();
            assert!(error < 1e-10, "{function:?}, {n} points: {error:.1e}");
        }
    }
}

#[test]
fn thousands_of_points_are_interpolated() {
    let points = scattered(2100, 0.5);
    let now: Vec<_> = points.iter().map(bend).collect();
    let mut binding = bound(&points[..50], &points, RadialFunction::Linear, None).unwrap();
    for (x, expected) in posed(&mut binding, &now).iter().zip(&now) {
        assert!((x - expected).norm() < 1e-9);
    }
}

/// A sheet tells nothing of the slope across it: of the solutions, the least has none.
#[test]
fn a_sheet_of_points_moves_what_is_off_it_as_what_is_on_it() {
    let tilt = Rotation3::from_euler_angles(0.4, -0.7, 0.2);
    let flat = |x: &Vector3<f64>| Vector3::new(x.x, x.y, 0.0);
    let sheet: Vec<_> = scattered(300, 0.5).iter().map(|x| tilt * flat(x)).collect();
    let vertices: Vec<_> = scattered(20, 0.1).iter().map(|x| tilt * x).collect();
    let map = Matrix3::new(1.2, 0.3, 0.0, 0.1, 0.7, 0.0, -0.6, 0.2, 0.0);
    let moved = |x: &Vector3<f64>| x + tilt * (map * (tilt.inverse() * x));
    let now: Vec<_> = sheet.iter().map(moved).collect();
    for function in FUNCTIONS {
        let mut binding = bound(&vertices, &sheet, function, Some(0.1)).unwrap();
        for (x, x0) in posed(&mut binding, &now).iter().zip(&vertices) {
            assert!((x - moved(x0)).norm() < 1e-9, "{function:?}");
        }
    }
}
