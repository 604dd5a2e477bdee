//! Bad input is refused with the place, the value and the remedy.

use nalgebra::Vector3;
use sinew_mapping::{
    Dimension, Filter, Fit, MappingError, Recipe, Reference, Rule, ShapeMatching, Weighting, bind,
};

fn recipe(scale: Option<f64>, k: usize) -> Recipe {
    Recipe {
        weighting: Weighting {
            scale,
            ..Weighting::default()
        },
        filter: Filter::KeepK(k),
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    }
}

#[test]
fn no_usable_point_is_refused() {
    let error = |points: &[Vector3<f64>], usable: &[bool]| {
        bind(&[Vector3::zeros()], points, usable, &recipe(None, 4)).unwrap_err()
    };
    assert_eq!(error(&[], &[]), MappingError::NoUsablePoint { points: 0 });
    let unseen = error(&[Vector3::zeros(); 2], &[false; 2]);
    assert_eq!(unseen, MappingError::NoUsablePoint { points: 2 });
}

#[test]
fn coordinates_that_are_not_finite_or_too_large_are_refused_by_name() {
    let good = [Vector3::zeros(), Vector3::x()];
    for value in [f64::NAN, f64::INFINITY, -1e101] {
        let bad = [Vector3::zeros(), Vector3::new(0.0, value, 0.0)];
        let error = |vertices: &[Vector3<f64>], points: &[Vector3<f64>]| {
            let error = bind(vertices, points, &[true; 2], &recipe(None, 4));
            error.unwrap_err().to_string()
        };
        assert!(error(&bad, &good).starts_with("vertex 1 has the coordinate"));
        assert!(error(&good, &bad).starts_with("point 1 has the coordinate"));
    }
}

#[test]
fn a_scale_that_is_none_and_a_filter_that_keeps_none_are_refused() {
    let x = [Vector3::zeros()];
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-200] {
        let error = bind(&x, &x, &[true], &recipe(Some(scale), 1)).unwrap_err();
        assert!(matches!(error, MappingError::Scale { .. }), "{error}");
    }
    let error = bind(&x, &x, &[true], &recipe(None, 0)).unwrap_err();
    assert_eq!(error, MappingError::KeepsNone);
}

#[test]
fn distances_that_are_none_are_refused_and_vertices_left_without_a_point_named() {
    let (x, e) = (Vector3::zeros(), Vector3::x());
    let error = |filter| {
        let recipe = Recipe {
            filter,
            ..recipe(None, 1)
        };
        bind(&[x, e, 5.0 * e], &[x, e], &[true; 2], &recipe).unwrap_err()
    };
    for (nearest, farthest) in [(-1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN)] {
        let error = error(Filter::Interval { nearest, farthest });
        assert!(matches!(error, MappingError::Interval { .. }), "{error}");
    }
    for within in [-1.0, f64::NAN, f64::INFINITY] {
        let error = error(Filter::KeepAtLeast { k: 1, within });
        assert!(matches!(error, MappingError::Bound { .. }), "{error}");
    }
    let none = Filter::KeepAtLeast { k: 0, within: 9.0 };
    assert_eq!(error(none), MappingError::KeepsNone);
    let (nearest, farthest) = (0.0, 1.0);
    let error = error(Filter::Interval { nearest, farthest });
    assert_eq!(
        error,
        MappingError::KeepsNoneAt {
            targets: Dimension::Vertex,
            cells: vec![2]
        }
    );
    assert!(
        error
            .to_string()
            .starts_with("no point is left for vertex 2:")
    );
}

#[test]
fn coefficients_that_are_none_or_too_few_are_refused() {
    let x = [Vector3::zeros(), Vector3::x()];
    let error = |coefficients: &[f64]| {
        let weighting = Weighting {
            coefficients: coefficients.to_vec(),
            ..Weighting::default()
        };
        let recipe = Recipe {
            weighting,
            ..recipe(None, 1)
        };
        bind(&x, &x, &[true; 2], &recipe).unwrap_err()
    };
    for value in [-1.0, f64::NAN, f64::INFINITY, 1e31] {
        let error = error(&[1.0, value]);
        assert!(
            matches!(error, MappingError::Coefficient { point: 1, .. }),
            "{error}"
        );
    }
    assert_eq!(
        error(&[1.0]).to_string(),
        "there are 1 coefficients where 2 are expected"
    );
}

#[test]
fn more_pairs_than_a_binding_may_hold_are_refused_before_memory_is_asked_for() {
    let (vertices, points) = (
        vec![Vector3::zeros(); 20_000],
        vec![Vector3::zeros(); 10_000],
    );
    let error = bind(
        &vertices,
        &points,
        &[true; 10_000],
        &recipe(None, usize::MAX),
    )
    .unwrap_err();
    let (vertices, kept) = (20_000, 10_000);
    assert_eq!(error, MappingError::TooLarge { vertices, kept });
}

#[test]
fn slices_of_the_wrong_length_are_refused_and_nothing_is_written() {
    let x = [Vector3::zeros(), Vector3::x()];
    assert!(matches!(
        bind(&x, &x, &[true], &recipe(None, 1)),
        Err(MappingError::Length {
            found: 1,
            expected: 2,
            ..
        })
    ));
    let mut binding = bind(&x, &x, &[true; 2], &recipe(None, 1)).unwrap();
    let mut out = [Vector3::repeat(5.0); 2];
    let error = binding.pose(&x[..1], &mut out).unwrap_err();
    assert_eq!(error.to_string(), "there are 1 points where 2 are expected");
    assert!(binding.pose(&x, &mut out[..1]).is_err());
    assert_eq!(out, [Vector3::repeat(5.0); 2]);
}

#[test]
fn a_mesh_without_vertices_is_bound_and_posed() {
    for rule in [
        Rule::WeightedMean,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    ] {
        let recipe = Recipe {
            rule,
            ..recipe(None, 4)
        };
        let mut binding = bind(&[], &[Vector3::zeros()], &[true], &recipe).unwrap();
        binding.pose(&[Vector3::x()], &mut []).unwrap();
        assert!(binding.dominant().is_empty());
    }
}
