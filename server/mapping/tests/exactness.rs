//! Which motions each rule reproduces, and which it does not: the table of `tests/data/README.md`'s reference.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::{Matrix3, Rotation3, Vector3};
use sinew_mapping::{
    Filter, Fit, FitWeights, MovingFit, Polynomial, RadialBasis, RadialFunction, Recipe, Reference,
    Rule, ShapeMatching, Weighting, bind,
};

type Field = fn(&Vector3<f64>) -> Vector3<f64>;

/// Each holds the one before it.
const FIELDS: [(&str, Field); 4] = [
    ("translation", |x| x + Vector3::new(0.3, -2.0, 0.7)),
    ("rigid", |x| {
        Rotation3::from_euler_angles(0.4, -1.2, 2.5) * x + Vector3::new(0.3, -2.0, 0.7)
    }),
    ("affine", |x| {
        Matrix3::new(1.2, 0.3, -0.4, 0.1, 0.7, 0.5, -0.6, 0.2, 1.4) * x + Vector3::z()
    }),
    ("quadratic", |x| {
        let bend = Vector3::new(x.x * x.y - 0.4 * x.z * x.z, x.x * x.x, x.y * (x.z + x.y));
        Rotation3::from_euler_angles(0.4, -1.2, 2.5) * x + 0.5 * bend
    }),
];

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

/// The rules, and how many of the fields they reproduce.
fn rules() -> Vec<(Rule, usize)> {
    let mut rules = vec![
        (Rule::Direct, 1),
        (Rule::Mean, 1),
        (Rule::WeightedMean, 1),
        (Rule::Barycentric, 3),
        (Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)), 2),
        (Rule::MovingLeastSquares(MovingFit::Affine), 3),
        (Rule::MovingLeastSquares(MovingFit::Rigid), 2),
        (
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 })),
            3,
        ),
        (
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 0.5 })),
            2,
        ),
        (
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 })),
            4,
        ),
        (
            Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 0.5 })),
            2,
        ),
    ];
    for (fit, exact) in [
        (Fit::Rigid, 2),
        (Fit::Linear { beta: 1.0 }, 3),
        (Fit::Quadratic { beta: 1.0 }, 4),
    ] {
        let weights = FitWeights::ClusterMean;
        rules.push((Rule::ShapeMatching(ShapeMatching { fit, weights }), exact));
    }
    for function in FUNCTIONS {
        for (polynomial, exact) in [
            (Polynomial::None, 0),
            (Polynomial::Constant, 1),
            (Polynomial::Linear, 3),
        ] {
            rules.push((
                Rule::RadialBasis(RadialBasis {
                    function,
                    scale: None,
                    polynomial,
                }),
                exact,
            ));
        }
    }
    rules
}

fn recipe(rule: Rule) -> Recipe {
    Recipe {
        weighting: Weighting::default(),
        filter: Filter::KeepK(usize::MAX),
        rule,
        reference: Reference::Initial,
    }
}

fn scattered(n: usize, start: f64) -> Vec<Vector3<f64>> {
    let step = Vector3::new(0.819_172_513, 0.671_043_606, 0.549_700_477);
    (0..n)
        .map(|i| (step * (start + i as f64)).map(f64::fract))
        .collect()
}

/// The greatest error over the greatest displacement.
fn error(rule: Rule, points: &[Vector3<f64>], vertices: &[Vector3<f64>], field: Field) -> f64 {
    let mut binding = bind(vertices, points, &vec![true; points.len()], &recipe(rule)).unwrap();
    let now: Vec<_> = points.iter().map(field).collect();
    let mut posed = vec![Vector3::zeros(); vertices.len()];
    binding.pose(&now, &mut posed).unwrap();
    let greatest = |pairs: &mut dyn Iterator<Item = f64>| pairs.fold(0.0, f64::max);
    let wrong = greatest(&mut (posed.iter().zip(vertices)).map(|(x, x0)| (x - field(x0)).norm()));
    wrong / greatest(&mut vertices.iter().map(|x| (field(x) - x).norm()))
}

#[test]
fn each_rule_reproduces_its_fields_and_no_more() {
    let points = scattered(16, 0.5);
    // Inside the points and out.
    let vertices: Vec<_> = (scattered(60, 0.1).iter())
        .map(|x| x * 2.0 - Vector3::repeat(0.5))
        .collect();
    for (rule, exact) in rules() {
        if bind(&vertices, &points, &[true; 16], &recipe(rule)).is_err() {
            assert!(matches!(rule, Rule::RadialBasis(_)), "{rule:?}");
            continue; // below the order of the function: see refusals.rs
        }
        for (level, (name, field)) in FIELDS.iter().enumerate() {
            let error = error(rule, &points, &vertices, *field);
            if level < exact {
                assert!(error < 1e-9, "{rule:?}, {name}: {error:.1e}");
            } else {
                assert!(error > 1e-4, "{rule:?}, {name}: only {error:.1e}");
            }
        }
    }
}

#[test]
fn every_rule_stays_exact_far_from_the_origin_and_at_any_size() {
    for (rule, exact) in rules() {
        for (size, shift) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e4)] {
            let place = |x: &Vector3<f64>| x * size + Vector3::repeat(shift);
            let points: Vec<_> = scattered(16, 0.5).iter().map(place).collect();
            let vertices: Vec<_> = scattered(30, 0.1).iter().map(place).collect();
            let usable = [true; 16];
            let Ok(mut binding) = bind(&vertices, &points, &usable, &recipe(rule)) else {
                continue;
            };
            let reproduced = FIELDS.iter().take(exact.min(3));
            for (name, field) in reproduced {
                // The field of the unit cube, at this size.
                let field = |x: &Vector3<f64>| {
                    field(&((x - Vector3::repeat(shift)) / size)) * size + Vector3::repeat(shift)
                };
                let now: Vec<_> = points.iter().map(field).collect();
                let mut posed = vec![Vector3::zeros(); 30];
                binding.pose(&now, &mut posed).unwrap();
                for (x, x0) in posed.iter().zip(&vertices) {
                    let error = (x - field(x0)).norm() / (size + shift);
                    assert!(error < 1e-9, "{rule:?}, {name}, size {size}: {error:.1e}");
                }
            }
        }
    }
}

#[test]
fn what_interpolates_moves_a_vertex_on_a_point_as_the_point() {
    let points = scattered(16, 0.5);
    let (_, bend) = FIELDS[3];
    for (rule, _) in rules() {
        let interpolates = matches!(
            rule,
            Rule::Direct | Rule::Barycentric | Rule::RadialBasis(_)
        );
        if interpolates && bind(&points, &points, &[true; 16], &recipe(rule)).is_ok() {
            let error = error(rule, &points, &points, bend);
            assert!(error < 1e-9, "{rule:?}: {error:.1e}");
        }
    }
}

#[test]
fn the_order_of_the_points_makes_no_difference() {
    let points = scattered(16, 0.5);
    let vertices = scattered(40, 0.1);
    let order: Vec<usize> = (0..16).map(|i| (5 * i + 3) % 16).collect();
    let shuffled: Vec<_> = order.iter().map(|&i| points[i]).collect();
    let (_, bend) = FIELDS[3];
    for (rule, _) in rules() {
        let pose = |points: &[Vector3<f64>]| {
            let filter = Filter::KeepK(12);
            let recipe = Recipe {
                filter,
                ..recipe(rule)
            };
            let mut binding = bind(&vertices, points, &[true; 16], &recipe).ok()?;
            let now: Vec<_> = points.iter().map(bend).collect();
            let mut posed = vec![Vector3::zeros(); vertices.len()];
            binding.pose(&now, &mut posed).unwrap();
            Some(posed)
        };
        let (straight, other) = (pose(&points), pose(&shuffled));
        assert_eq!(straight.is_some(), other.is_some());
        for (a, b) in straight.iter().flatten().zip(other.iter().flatten()) {
            assert!((a - b).norm() < 1e-9, "{rule:?}: {a} {b}");
        }
    }
}

#[test]
fn the_share_of_the_map_runs_from_the_rigid_motion_to_all_of_it() {
    let points = scattered(16, 0.5);
    let vertices = scattered(30, 0.1);
    let (_, bend) = FIELDS[3];
    let now: Vec<_> = points.iter().map(bend).collect();
    let pose = |rule| {
        let mut binding = bind(&vertices, &points, &[true; 16], &recipe(rule)).unwrap();
        let mut posed = vec![Vector3::zeros(); vertices.len()];
        binding.pose(&now, &mut posed).unwrap();
        posed
    };
    let rigid = pose(Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)));
    let rules: [fn(f64) -> Rule; 2] = [
        |beta| Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta })),
        |beta| Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta })),
    ];
    for rule in rules {
        let (none, part, all) = (pose(rule(0.0)), pose(rule(0.3)), pose(rule(1.0)));
        for i in 0..vertices.len() {
            assert!((none[i] - rigid[i]).norm() < 1e-13);
            assert!((part[i] - rigid[i].lerp(&all[i], 0.3)).norm() < 1e-13);
        }
    }
}
