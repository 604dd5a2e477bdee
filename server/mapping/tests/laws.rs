//! What any mapping obeys, whatever the vertices and points.

#![expect(clippy::unwrap_used, reason = "a helper of tests may panic as they do")]

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use sinew_mapping::{
    Binding, Filter, Fit, Kernel, Recipe, Reference, Rule, ShapeMatching, Weighting, bind,
};

fn recipe(kernel: Kernel, scale: Option<f64>, k: usize, rule: Rule) -> Recipe {
    Recipe {
        weighting: Weighting {
            kernel,
            scale,
            ..Weighting::default()
        },
        filter: Filter::KeepK(k),
        rule,
        reference: Reference::Initial,
    }
}

fn posed(binding: &mut Binding, points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut out = vec![Vector3::zeros(); binding.dominant().len()];
    binding.pose(points, &mut out).unwrap();
    out
}

fn moved(motion: &Isometry3<f64>, positions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let apply = |x: &Vector3<f64>| motion.rotation * x + motion.translation.vector;
    positions.iter().map(apply).collect()
}

fn cloud(size: impl Into<prop::collection::SizeRange>) -> impl Strategy<Value = Vec<Vector3<f64>>> {
    prop::collection::vec(
        prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from),
        size,
    )
}

/// A cloud on a coarse lattice: full of equal distances and coincident points.
fn lattice(
    size: impl Into<prop::collection::SizeRange>,
) -> impl Strategy<Value = Vec<Vector3<f64>>> {
    let site = prop::array::uniform3(-2_i8..=2).prop_map(|site| Vector3::from(site).map(f64::from));
    prop::collection::vec(site, size)
}

fn any_kernel() -> impl Strategy<Value = Kernel> {
    prop_oneof![Just(Kernel::Gaussian), Just(Kernel::InverseSquare)]
}

fn any_rule() -> impl Strategy<Value = Rule> {
    prop_oneof![
        Just(Rule::WeightedMean),
        Just(Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)))
    ]
}

fn any_isometry() -> impl Strategy<Value = Isometry3<f64>> {
    let vector = || prop::array::uniform3(-3.0..3.0).prop_map(Vector3::from);
    (vector(), vector()).prop_map(|(shift, turn)| Isometry3::new(shift, turn))
}

proptest! {
    #[test]
    fn weights_are_a_partition_of_unity(
        vertices in cloud(1..40),
        points in prop_oneof![cloud(1..60), lattice(1..60)],
        kernel in any_kernel(),
        scale in prop_oneof![Just(None), (1e-6..10.0).prop_map(Some)],
        k in 1_usize..20,
    ) {
        let usable = vec![true; points.len()];
        let recipe = recipe(kernel, scale, k, Rule::WeightedMean);
        let binding = bind(&vertices, &points, &usable, &recipe).unwrap();
        for vertex in 0..vertices.len() {
            let row: Vec<(u32, f64)> = binding.weights(vertex);
            prop_assert_eq!(row.len(), k.min(points.len()));
            prop_assert!(row.iter().all(|&(_, weight)| (0.0..=1.0).contains(&weight)));
            prop_assert!((row.iter().map(|&(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_kept_points_are_those_of_a_full_sort_ties_to_the_lower_index(
        vertices in lattice(1..20),
        points in prop_oneof![lattice(1..150), cloud(1..150)],
        usable in prop::collection::vec(prop::bool::weighted(0.8), 150),
        k in 1_usize..40,
    ) {
        let usable = &usable[..points.len()];
        let recipe = recipe(Kernel::Gaussian, Some(1.0), k, Rule::WeightedMean);
        let Ok(binding) = bind(&vertices, &points, usable, &recipe) else {
            prop_assert!(!usable.contains(&true));
            return Ok(());
        };
        for (vertex, x) in vertices.iter().enumerate() {
            let mut sorted: Vec<(f64, u32)> = (0..)
                .zip(points.iter().zip(usable))
                .filter(|(_, (_, usable))| **usable)
                .map(|(j, (p, _))| ((p - x).norm_squared(), j))
                .collect();
            sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let expected: Vec<u32> = sorted.iter().take(k).map(|&(_, j)| j).collect();
            let kept: Vec<u32> = binding.weights(vertex).into_iter().map(|(j, _)| j).collect();
            prop_assert_eq!(kept, expected);
        }
    }

    #[test]
    fn the_dominant_point_has_the_greatest_weight_ties_to_the_lower_index(
        vertices in lattice(1..20),
        points in lattice(1..30),
        kernel in any_kernel(),
        // The large one makes all weights the same, whatever the distances.
        scale in prop_oneof![Just(None), Just(Some(1e10))],
    ) {
        let usable = vec![true; points.len()];
        let recipe = recipe(kernel, scale, 12, Rule::WeightedMean);
        let binding = bind(&vertices, &points, &usable, &recipe).unwrap();
        for (vertex, &dominant) in binding.dominant().iter().enumerate() {
            let mut row: Vec<(u32, f64)> = binding.weights(vertex);
            row.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            prop_assert_eq!(dominant, row[0].0);
        }
    }

    #[test]
    fn every_mapping_follows_a_translation_exactly(
        vertices in cloud(1..30),
        points in prop_oneof![cloud(1..20), lattice(1..20)],
        kernel in any_kernel(),
        rule in any_rule(),
        shift in prop::array::uniform3(-5.0..5.0),
    ) {
        let usable = vec![true; points.len()];
        let mut binding = bind(&vertices, &points, &usable, &recipe(kernel, None, 6, rule)).unwrap();
        let motion = Isometry3::from_parts(
            Translation3::from(Vector3::from(shift)),
            UnitQuaternion::identity(),
        );
        let expected = moved(&motion, &vertices);
        for (x, expected) in posed(&mut binding, &moved(&motion, &points)).iter().zip(expected) {
            prop_assert!((x - expected).norm() < 1e-13 * 10.0, "{x} {expected}");
        }
    }

    #[test]
    fn shape_matching_follows_a_rigid_motion_exactly(
        vertices in cloud(1..30),
        points in cloud(4..20),
        flatten in prop::bool::ANY,
        motion in any_isometry(),
    ) {
        // Coplanar points leave nothing open either.
        let flat = |p: &Vector3<f64>| Vector3::new(p.x, p.y, 0.3 * p.x - 0.2 * p.y);
        let points: Vec<_> = if flatten { points.iter().map(flat).collect() } else { points };
        let usable = vec![true; points.len()];
        let recipe = recipe(Kernel::Gaussian, None, usize::MAX, Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)));
        let mut binding = bind(&vertices, &points, &usable, &recipe).unwrap();
        let expected = moved(&motion, &vertices);
        for (x, expected) in posed(&mut binding, &moved(&motion, &points)).iter().zip(expected) {
            prop_assert!((x - expected).norm() < 1e-9, "{x} {expected}");
        }
    }

    #[test]
    fn shape_matching_gives_a_proper_rotation_for_any_motion(
        rest in prop_oneof![cloud(1..9), lattice(1..9)],
        now in prop_oneof![cloud(9), lattice(9)],
        then in prop_oneof![cloud(9), lattice(9)],
    ) {
        let usable = vec![true; rest.len()];
        let recipe = recipe(Kernel::Gaussian, None, usize::MAX, Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)));
        let axes = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
        let mut binding = bind(&axes, &rest, &usable, &recipe).unwrap();
        for points in [&now, &then] {
            let [o, x, y, z] = posed(&mut binding, &points[..rest.len()])[..] else { unreachable!() };
            let turned = nalgebra::Matrix3::from_columns(&[x - o, y - o, z - o]);
            prop_assert!((turned.transpose() * turned - nalgebra::Matrix3::identity()).amax() < 1e-12);
            prop_assert!((turned.determinant() - 1.0).abs() < 1e-12);
            let last = binding.rotations()[0].to_rotation_matrix();
            prop_assert!((turned - last.matrix()).amax() < 1e-12);
        }
    }

    #[test]
    fn shape_matching_leaves_no_better_rotation(
        rest in prop_oneof![cloud(2..9), lattice(2..9)],
        now in prop_oneof![cloud(9), lattice(9)],
        other in any_isometry(),
    ) {
        let now = &now[..rest.len()];
        let usable = vec![true; rest.len()];
        let recipe = recipe(Kernel::Gaussian, None, usize::MAX, Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)));
        let mut binding = bind(&[Vector3::zeros()], &rest, &usable, &recipe).unwrap();
        posed(&mut binding, now);
        let centred = |points: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            points.iter().map(|p| p - mean).collect()
        };
        let (rest, now) = (centred(&rest), centred(now));
        let misfit = |rotation: &UnitQuaternion<f64>| -> f64 {
            rest.iter().zip(&now).map(|(rest, now)| (now - rotation * rest).norm_squared()).sum()
        };
        let found = binding.rotations()[0];
        prop_assert!(misfit(&found) <= misfit(&other.rotation) + 1e-9);
        // Nor a better one close by.
        let near = UnitQuaternion::identity().slerp(&other.rotation, 1e-3) * found;
        prop_assert!(misfit(&found) <= misfit(&near) + 1e-9);
    }
}

#[test]
fn a_vertex_on_a_point_follows_exactly_that_point_by_inverse_square() {
    let points = [Vector3::zeros(), Vector3::x(), Vector3::new(0.3, 0.7, 0.1)];
    let recipe = recipe(Kernel::InverseSquare, None, 3, Rule::WeightedMean);
    let mut binding = bind(&points, &points, &[true; 3], &recipe).unwrap();
    let now = [
        Vector3::new(0.1, 0.2, 0.3),
        Vector3::new(9.0, 0.0, -1.0),
        Vector3::repeat(4.0),
    ];
    for (vertex, x) in posed(&mut binding, &now).iter().enumerate() {
        let expected = points[vertex] + (now[vertex] - points[vertex]);
        assert_eq!(*x, expected);
    }
}

#[test]
fn a_vertex_a_thousand_sizes_away_follows_the_nearest_point() {
    let points = [Vector3::zeros(), Vector3::x()];
    let far = [Vector3::new(1e3, 0.0, 0.0), Vector3::new(-1e90, 1e90, 0.0)];
    let recipe = recipe(Kernel::Gaussian, Some(0.5), 2, Rule::WeightedMean);
    let mut binding = bind(&far, &points, &[true; 2], &recipe).unwrap();
    let lifted = [Vector3::zeros(), Vector3::new(1.0, 1.0, 0.0)];
    assert_eq!(posed(&mut binding, &lifted)[0], far[0] + Vector3::y());
    assert!(
        binding
            .weights(1)
            .into_iter()
            .all(|(_, weight)| weight.is_finite())
    );
}

#[test]
fn an_unusable_point_is_never_chosen_and_its_rest_position_never_read() {
    let points = [Vector3::repeat(f64::NAN), Vector3::x(), Vector3::y()];
    for rule in [
        Rule::WeightedMean,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    ] {
        let recipe = recipe(Kernel::Gaussian, None, 8, rule);
        let vertices = [Vector3::zeros(), Vector3::z()];
        let mut binding = bind(&vertices, &points, &[false, true, true], &recipe).unwrap();
        for vertex in 0..2 {
            assert!(
                binding
                    .weights(vertex)
                    .into_iter()
                    .map(|(j, _)| j)
                    .eq([1, 2])
            );
        }
        let lift = |p: Vector3<f64>| p + Vector3::z();
        let now = [Vector3::repeat(f64::NAN), lift(points[1]), lift(points[2])];
        for (x, vertex) in posed(&mut binding, &now).iter().zip(vertices) {
            assert!((x - lift(vertex)).norm() < 1e-15);
        }
    }
}

#[test]
fn without_a_scale_the_gaussian_takes_the_spacing_of_the_places() {
    let e = Vector3::x();
    // Places 0, 1 and 3 (one of them twice): spacings 1, 1 and 2.
    let points = [Vector3::zeros(), e, e, 3.0 * e];
    let rows = |scale| {
        let recipe = recipe(Kernel::Gaussian, scale, 4, Rule::WeightedMean);
        let binding = bind(&[0.2 * e], &points, &[true; 4], &recipe).unwrap();
        binding.weights(0)
    };
    assert_eq!(rows(None), rows(Some(4.0 / 3.0)));
}

#[test]
fn coincident_points_share_alike() {
    let points = [Vector3::repeat(0.25); 4];
    let binding = |kernel| {
        let recipe = recipe(kernel, None, 4, Rule::WeightedMean);
        bind(&[Vector3::zeros(), points[0]], &points, &[true; 4], &recipe).unwrap()
    };
    for kernel in [Kernel::Gaussian, Kernel::InverseSquare] {
        for vertex in 0..2 {
            let expected = [(0, 0.25), (1, 0.25), (2, 0.25), (3, 0.25)];
            assert!(binding(kernel).weights(vertex) == expected);
        }
    }
}

#[test]
fn points_as_far_as_numbers_go_leave_the_rotation_as_it_was() {
    let rest = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
    let recipe = recipe(
        Kernel::Gaussian,
        None,
        4,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    );
    let mut binding = bind(&[Vector3::zeros()], &rest, &[true; 4], &recipe).unwrap();
    for far in [1e150, 1e200, f64::MAX] {
        posed(
            &mut binding,
            &rest.map(|p| (p * 2.0 - Vector3::repeat(1.0)) * far),
        );
        let rotation = binding.rotations()[0];
        assert!(rotation.angle() < 1e-12, "{far}: {rotation}");
    }
}

#[test]
fn two_points_swinging_never_twist_about_their_line() {
    // Small turns about axes square to the line: the smallest rotations compose to the same as the rule must give.
    let points = [Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0)];
    let recipe = recipe(
        Kernel::Gaussian,
        None,
        2,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    );
    let mut binding = bind(&[Vector3::y()], &points, &[true; 2], &recipe).unwrap();
    let mut expected = Rotation3::identity();
    let mut direction = points[1];
    for step in 0..500 {
        let t = f64::from(step) * 0.02;
        let next = Vector3::new(
            t.cos(),
            t.sin() * (0.7 * t).cos(),
            t.sin() * (0.7 * t).sin(),
        );
        expected = Rotation3::rotation_between(&direction, &next).unwrap() * expected;
        direction = next;
        posed(&mut binding, &[points[0], next]);
        let found = binding.rotations()[0].to_rotation_matrix();
        assert!(
            (found.matrix() - expected.matrix()).amax() < 1e-10,
            "step {step}"
        );
    }
}

#[test]
fn a_set_that_passes_through_a_line_keeps_its_last_twist() {
    let rest = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
    let recipe = recipe(
        Kernel::Gaussian,
        None,
        4,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    );
    let mut binding = bind(&[Vector3::zeros()], &rest, &[true; 4], &recipe).unwrap();
    let turn = Rotation3::from_euler_angles(0.4, -0.8, 1.9);
    posed(&mut binding, &rest.map(|p| turn * p));
    let before = binding.rotations()[0];
    posed(&mut binding, &[Vector3::repeat(0.7); 4]);
    assert_eq!(binding.rotations()[0], before);
}

#[test]
fn a_coefficient_multiplies_the_distances_that_filter_and_kernel_see() {
    let points = [Vector3::zeros(), 3.0 * Vector3::x(), 4.0 * Vector3::y()];
    let bound = |coefficients: [f64; 3], k| {
        let weighting = Weighting {
            kernel: Kernel::InverseSquare,
            coefficients: coefficients.to_vec(),
            ..Weighting::default()
        };
        let recipe = Recipe {
            weighting,
            ..recipe(Kernel::Gaussian, None, k, Rule::WeightedMean)
        };
        let binding = bind(&[Vector3::x()], &points, &[true; 3], &recipe).unwrap();
        binding.weights(0)
    };
    // At distances 1, 2 and √17; as inverse squares 1, 1/4 and 1/17.
    assert_eq!(bound([1.0; 3], 2), [(0, 0.8), (1, 0.2)]);
    assert_eq!(bound([2.0, 1.0, 1.0], 2), [(0, 0.5), (1, 0.5)]);
    assert_eq!(bound([8.0, 1.0, 1.0], 1), [(1, 1.0)]);
    assert_eq!(bound([1.0, 1.0, 0.0], 3)[0], (2, 1.0));
}
