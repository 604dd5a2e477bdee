//! Sets of points that leave something open, or nearly.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use sinew_mapping::{
    Binding, Filter, Fit, FitWeights, MAX_BASIS, MappingError, MovingFit, Polynomial, RadialBasis,
    RadialFunction, Recipe, Reference, Rule, ShapeMatching, Weighting, bind,
};

fn basis(function: RadialFunction, scale: Option<f64>) -> Rule {
    Rule::RadialBasis(RadialBasis {
        function,
        scale,
        polynomial: Polynomial::Linear,
    })
}

fn weighted(fit: Fit) -> Rule {
    let weights = FitWeights::ClusterMean;
    Rule::ShapeMatching(ShapeMatching { fit, weights })
}

/// Every rule that needs no volume.
fn rules() -> [Rule; 13] {
    [
        Rule::Direct,
        Rule::Mean,
        Rule::WeightedMean,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 })),
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 })),
        weighted(Fit::Rigid),
        weighted(Fit::Quadratic { beta: 1.0 }),
        Rule::MovingLeastSquares(MovingFit::Affine),
        Rule::MovingLeastSquares(MovingFit::Rigid),
        basis(RadialFunction::Cubic, None),
        basis(RadialFunction::Gaussian, None),
        basis(RadialFunction::Multiquadric, None),
    ]
}

fn bound(
    rule: Rule,
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
) -> Result<Binding, MappingError> {
    let recipe = Recipe {
        weighting: Weighting::default(),
        filter: Filter::KeepK(usize::MAX),
        rule,
        reference: Reference::Initial,
    };
    bind(vertices, points, &vec![true; points.len()], &recipe)
}

fn posed(
    rule: Rule,
    vertices: &[Vector3<f64>],
    rest: &[Vector3<f64>],
    now: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let mut out = vec![Vector3::zeros(); vertices.len()];
    let mut binding = bound(rule, vertices, rest).unwrap();
    binding.pose(now, &mut out).unwrap();
    out
}

fn corners() -> Vec<Vector3<f64>> {
    let bit = |i: u32, axis: u32| f64::from(i >> axis & 1);
    (0..8)
        .map(|i| Vector3::new(bit(i, 0), bit(i, 1), bit(i, 2)))
        .collect()
}

/// One point, two, three in a line, four and seven in a plane, coincident ones, ones nearly so.
fn degenerate() -> [Vec<Vector3<f64>>; 7] {
    let e = Vector3::new(0.3, 0.5, -0.2);
    let f = Vector3::new(0.4, -0.1, 0.35);
    let plane = |n: u32| -> Vec<Vector3<f64>> {
        let place = |i: u32| e * f64::from(i * i % 5) + f * f64::from(i);
        (0..n).map(place).collect()
    };
    let near = Vector3::new(1e-12, -1e-12, 1e-12);
    [
        vec![e],
        vec![e, f],
        vec![e, 2.0 * e, 4.0 * e],
        plane(4),
        plane(7),
        vec![e; 3],
        corners().iter().flat_map(|p| [*p, p + near]).collect(),
    ]
}

#[test]
fn degenerate_sets_follow_a_translation_and_stay_finite_in_any_motion() {
    let shift = Vector3::new(0.4, -1.0, 2.0);
    let turn = Rotation3::from_euler_angles(0.3, 2.0, -1.0);
    let vertices = corners();
    for (case, rest) in degenerate().iter().enumerate() {
        for rule in rules() {
            let moved: Vec<_> = rest.iter().map(|p| p + shift).collect();
            for (x, x0) in posed(rule, &vertices, rest, &moved).iter().zip(&vertices) {
                let error = (x - x0 - shift).norm();
                assert!(error < 1e-9, "case {case}, {rule:?}: {error:.1e}");
            }
            let bend = |p: &Vector3<f64>| turn * p + Vector3::new(p.y * p.y, 0.0, p.x);
            let bent: Vec<_> = rest.iter().map(bend).collect();
            for x in posed(rule, &vertices, rest, &bent) {
                assert!(x.norm() < 100.0, "case {case}, {rule:?}: {x}");
            }
        }
    }
}

#[test]
fn what_is_as_far_from_all_of_five_thousand_points_follows_their_mean() {
    let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    let sphere = |i: u32| {
        let (height, angle) = (f64::from(i) / 2500.0 - 0.9998, golden * f64::from(i));
        let radius = (1.0 - height * height).sqrt();
        Vector3::new(radius * angle.cos(), radius * angle.sin(), height)
    };
    let rest: Vec<_> = (0..5000).map(sphere).collect();
    let vertices = [Vector3::zeros(), Vector3::new(0.2, 0.1, -0.3)];
    let bend = |p: &Vector3<f64>| p + Vector3::new(p.y * p.z, p.x * p.x, 0.1 * p.z);
    let now: Vec<_> = rest.iter().map(bend).collect();
    let moves = rest.iter().zip(&now).map(|(p, q)| q - p);
    let mean = moves.sum::<Vector3<f64>>() / 5000.0;
    let weighted = posed(Rule::WeightedMean, &vertices, &rest, &now);
    assert!((weighted[0] - mean).norm() < 1e-12);
    let shift = Vector3::new(0.4, -1.0, 2.0);
    let moved: Vec<_> = rest.iter().map(|p| p + shift).collect();
    for rule in rules() {
        if !matches!(rule, Rule::RadialBasis(_)) {
            for (x, x0) in posed(rule, &vertices, &rest, &moved).iter().zip(&vertices) {
                assert!((x - x0 - shift).norm() < 1e-9, "{rule:?}");
            }
        }
    }
}

#[test]
fn points_in_a_plane_do_not_flatten_what_is_around_them() {
    let [.., plane, _, _] = degenerate();
    let turn = Rotation3::from_euler_angles(0.3, 2.0, -1.0);
    let moved: Vec<_> = plane.iter().map(|p| turn * p).collect();
    let vertices = corners();
    for rule in [
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 })),
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 })),
        weighted(Fit::Quadratic { beta: 1.0 }),
        Rule::MovingLeastSquares(MovingFit::Rigid),
    ] {
        for (x, x0) in posed(rule, &vertices, &plane, &moved).iter().zip(&vertices) {
            assert!((x - turn * x0).norm() < 1e-9, "{rule:?}: {x}");
        }
    }
}

#[test]
fn a_plane_along_the_axes_with_rounding_across_it_does_not_blow_up() {
    let step = [0.0, 1.0, 2.0, 3.0];
    let place = |i: usize| Vector3::new(step[i % 4], step[i / 4], [0.0, 1e-17, 2e-16][i % 3]);
    let rest: Vec<_> = (0..16).map(place).collect();
    let bend = |p: &Vector3<f64>| p + Vector3::new(0.0, 0.0, 0.2 * p.x * p.y);
    let now: Vec<_> = rest.iter().map(bend).collect();
    let vertices = [Vector3::new(1.5, 1.5, 0.5), Vector3::new(0.5, 2.5, -0.5)];
    let rule = Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 }));
    for x in posed(rule, &vertices, &rest, &now) {
        assert!(x.norm() < 10.0, "{x}");
    }
}

#[test]
fn coincident_points_with_one_motion_are_interpolated() {
    let [.., nearly] = degenerate();
    let bend = |p: &Vector3<f64>| p + Vector3::new(p.y * p.z, p.x, 0.0);
    let now: Vec<_> = nearly.iter().map(bend).collect();
    for rule in [
        basis(RadialFunction::Cubic, None),
        basis(RadialFunction::Gaussian, None),
        Rule::Barycentric,
    ] {
        for (x, expected) in posed(rule, &nearly, &nearly, &now).iter().zip(&now) {
            assert!((x - expected).norm() < 1e-9, "{rule:?}: {x} {expected}");
        }
    }
}

#[test]
fn a_mirror_image_is_turned_by_the_rigid_rule_and_followed_by_the_affine_ones() {
    let rest: Vec<_> = (corners().iter())
        .map(|p| p.component_mul(&Vector3::new(1.0, 2.0, 3.0)))
        .chain([Vector3::new(0.2, 0.9, 1.1), Vector3::new(0.7, 0.3, 2.0)])
        .collect();
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    let now: Vec<_> = rest.iter().map(|p| mirror * p).collect();
    let axes = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
    for (rule, volume) in [
        (Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)), 1.0),
        (
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 })),
            -1.0,
        ),
        (
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 })),
            -1.0,
        ),
        (weighted(Fit::Rigid), 1.0),
        (weighted(Fit::Linear { beta: 1.0 }), -1.0),
        (Rule::Barycentric, -1.0),
        (basis(RadialFunction::Cubic, None), -1.0),
    ] {
        let [o, x, y, z] = posed(rule, &axes, &rest, &now)[..] else {
            unreachable!()
        };
        let map = Matrix3::from_columns(&[x - o, y - o, z - o]);
        assert!((map.determinant() - volume).abs() < 1e-9, "{rule:?}");
    }
}

#[test]
fn a_half_turn_of_one_end_against_the_other_is_finite_and_interpolated() {
    let rest: Vec<_> = corners()
        .iter()
        .flat_map(|p| [*p, p + 2.0 * Vector3::z()])
        .collect();
    let twist = |p: &Vector3<f64>| {
        Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI * p.z / 3.0) * p
    };
    let now: Vec<_> = rest.iter().map(twist).collect();
    for rule in rules() {
        for (x, expected) in posed(rule, &rest, &rest, &now).iter().zip(&now) {
            assert!(x.norm() < 10.0, "{rule:?}: {x}");
            if matches!(rule, Rule::Direct | Rule::RadialBasis(_)) {
                assert!((x - expected).norm() < 1e-9, "{rule:?}");
            }
        }
    }
}

#[test]
fn a_vertex_a_thousand_sizes_away_has_finite_weights_and_follows_affine_maps() {
    let rest = [
        corners(),
        vec![Vector3::new(0.3, 0.6, 0.4), Vector3::new(0.8, 0.1, 0.7)],
    ]
    .concat();
    let far = [Vector3::new(1e3, -500.0, 200.0)];
    let map = |p: &Vector3<f64>| Vector3::new(1.5 * p.x + p.y, p.z - p.y, 0.5 * p.x) + far[0];
    let now: Vec<_> = rest.iter().map(map).collect();
    for rule in rules() {
        assert!(posed(rule, &far, &rest, &now)[0].norm() < 1e4, "{rule:?}");
    }
    for rule in [
        Rule::Barycentric,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 })),
        weighted(Fit::Linear { beta: 1.0 }),
        Rule::MovingLeastSquares(MovingFit::Affine),
        basis(RadialFunction::Gaussian, None),
        basis(RadialFunction::Cubic, None),
    ] {
        let error = (posed(rule, &far, &rest, &now)[0] - map(&far[0])).norm() / far[0].norm();
        assert!(error < 1e-6, "{rule:?}: {error:.1e}");
    }
}

#[test]
fn vertices_whose_points_span_no_volume_are_named() {
    let [.., plane, _, _] = degenerate();
    let error = bound(Rule::Barycentric, &corners(), &plane).unwrap_err();
    let vertices = (0..8).collect();
    assert_eq!(error, MappingError::Flat { vertices });
    assert!(error.to_string().contains("vertices 0, 1, 2, 3"), "{error}");
    // A volume so small that, seen from the vertex, it is none.
    let far = [Vector3::new(1e100, 0.0, 0.0)];
    let tiny: Vec<_> = corners().iter().map(|p| p * 1e-300).collect();
    let error = bound(Rule::Barycentric, &far, &tiny).unwrap_err();
    assert_eq!(error, MappingError::Flat { vertices: vec![0] });
    let error = bound(Rule::Barycentric, &plane[..1], &plane[..3]).unwrap_err();
    assert!(error.to_string().contains("at vertex 0:"), "{error}");
}

#[test]
fn an_interpolation_that_would_be_noise_is_refused_with_its_condition_number() {
    let grid: Vec<_> = (0..27_u8)
        .map(|i| Vector3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) * 0.5)
        .collect();
    let wide = basis(RadialFunction::Gaussian, Some(20.0));
    let error = bound(wide, &corners(), &grid).unwrap_err();
    let MappingError::Condition {
        vertex: 0,
        condition,
    } = error
    else {
        panic!("{error}");
    };
    assert!(condition > 1e12);
    assert!(error.to_string().contains("condition number"), "{error}");
}

#[test]
fn a_function_with_too_low_a_polynomial_is_refused() {
    let needs = [
        (RadialFunction::Gaussian, Polynomial::None),
        (RadialFunction::InverseMultiquadric, Polynomial::None),
        (RadialFunction::InverseQuadratic, Polynomial::None),
        (RadialFunction::Wendland, Polynomial::None),
        (RadialFunction::ShiftedLog, Polynomial::Constant),
        (RadialFunction::Multiquadric, Polynomial::Constant),
        (RadialFunction::Linear, Polynomial::Constant),
        (RadialFunction::ThinPlate, Polynomial::Linear),
        (RadialFunction::Cubic, Polynomial::Linear),
    ];
    for (function, needed) in needs {
        for found in [Polynomial::None, Polynomial::Constant, Polynomial::Linear] {
            let rule = Rule::RadialBasis(RadialBasis {
                function,
                scale: None,
                polynomial: found,
            });
            let refusal = bound(rule, &corners(), &corners()).err();
            let expected = (found < needed).then_some(MappingError::Polynomial {
                function,
                found,
                needed,
            });
            assert_eq!(refusal, expected);
        }
    }
}

#[test]
fn more_points_than_an_interpolation_may_have_are_refused_and_shares_that_are_none() {
    let points = vec![Vector3::zeros(); MAX_BASIS + 1];
    let error = bound(basis(RadialFunction::Cubic, None), &points[..1], &points).unwrap_err();
    let points = MAX_BASIS + 1;
    assert_eq!(error, MappingError::ManyPoints { points });
    for beta in [-0.1, 1.1, f64::NAN] {
        for rule in [
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta })),
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta })),
        ] {
            let error = bound(rule, &corners(), &corners()).unwrap_err();
            assert!(matches!(error, MappingError::Beta { .. }), "{error}");
        }
    }
}

#[test]
fn weights_beyond_the_numbers_there_are_are_refused() {
    let far = [Vector3::new(1e100, 0.0, 0.0)];
    let tiny: Vec<_> = corners().iter().map(|p| p * 1e-60).collect();
    let error = bound(basis(RadialFunction::Cubic, None), &far, &tiny).unwrap_err();
    assert_eq!(error, MappingError::Overflow { vertex: 0 });
}

#[test]
fn the_scale_of_a_power_makes_no_difference() {
    let rest: Vec<_> = (corners().into_iter())
        .chain([Vector3::new(0.3, 0.6, 0.4), Vector3::new(0.8, 0.1, 0.7)])
        .collect();
    let bend = |p: &Vector3<f64>| p + Vector3::new(p.y * p.z, p.x * p.x, 0.0);
    let now: Vec<_> = rest.iter().map(bend).collect();
    let vertices = [Vector3::new(0.4, 0.2, 0.9), Vector3::new(-0.3, 1.2, 0.5)];
    for function in [
        RadialFunction::ThinPlate,
        RadialFunction::Cubic,
        RadialFunction::Linear,
    ] {
        let at = |scale| posed(basis(function, Some(scale)), &vertices, &rest, &now);
        for (small, large) in at(0.01).iter().zip(at(50.0)) {
            assert!((small - large).norm() < 1e-10, "{function:?}");
        }
    }
}

fn cloud(size: impl Into<prop::collection::SizeRange>) -> impl Strategy<Value = Vec<Vector3<f64>>> {
    let place = prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from);
    prop::collection::vec(place, size)
}

proptest! {
    #[test]
    fn weights_of_any_cloud_are_a_partition_of_unity(
        vertices in cloud(1..10),
        points in cloud(1..20),
    ) {
        for rule in [Rule::Direct, Rule::Mean, Rule::Barycentric] {
            let Ok(binding) = bound(rule, &vertices, &points) else {
                prop_assert!(rule == Rule::Barycentric);
                continue;
            };
            for (vertex, x) in vertices.iter().enumerate() {
                let row: Vec<(u32, f64)> = binding.weights(vertex);
                let size: f64 = row.iter().map(|(_, weight)| weight.abs()).sum();
                let sum: f64 = row.iter().map(|(_, weight)| weight).sum();
                prop_assert!((sum - 1.0).abs() < 1e-12 * size.max(1.0));
                if rule == Rule::Barycentric {
                    let place: Vector3<f64> = row.iter().map(|&(j, w)| points[j as usize] * w).sum();
                    prop_assert!((place - x).norm() < 1e-12 * size.max(1.0));
                }
            }
        }
    }
}
