//! What a scene file can say about how points drive the mesh, and what comes of it.

use sinew_proto::v1::{self, Mapping, Scene, motion_rule::Kind};
use sinew_tests::{TestServer, live, scenes, vertices};
use tonic::Code;

const POINTS: usize = 14;

/// A scene of few vertices with this mapping, as a scene file has it.
fn scene(mapping: &str) -> Scene {
    Scene {
        mapping: Some(serde_json::from_str::<Mapping>(mapping).unwrap()),
        ..scenes::block(POINTS, 2, scenes::Rule::Mean)
    }
}

type Field = fn([f64; 3]) -> [f64; 3];

fn translation([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x + 0.5, y - 2.0, z + 0.25]
}

fn rigid([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = 2.0_f64.sin_cos();
    [cos * x - sin * y + 1.0, sin * x + cos * y, z - 3.0]
}

fn affine([x, y, z]: [f64; 3]) -> [f64; 3] {
    [1.5 * x + y, 0.5 * y - z, x + 2.0 * z - 1.0]
}

fn quadratic([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x + y * z, y - x * x, z + 0.5 * x * y - z * z]
}

/// Each holds the one before it.
const FIELDS: [Field; 4] = [translation, rigid, affine, quadratic];

/// The greatest error of a vertex, m, where the points follow a field.
async fn error(server: &TestServer, mapping: &str, field: Field) -> f64 {
    let session = server.create("", scene(mapping)).await;
    let mut watcher = session.watch().await;
    watcher.keyframe().await;
    let rest = vertices(watcher.last());
    let mut source = session.source().await;
    let now: Vec<_> = scenes::rest(POINTS).into_iter().map(field).collect();
    source.send(&now).await;
    source.acked(1).await.unwrap();
    session.step(1).await.unwrap();
    let posed = vertices(&watcher.frame().await);
    let distance = |(x, x0): (&[f64; 3], &[f64; 3])| {
        let expected = field(*x0);
        (0..3)
            .map(|axis| (x[axis] - expected[axis]).abs())
            .fold(0.0, f64::max)
    };
    posed.iter().zip(&rest).map(distance).fold(0.0, f64::max)
}

/// Holds that each mapping reproduces so many of the fields, and no more.
fn reproduce(mappings: &[(usize, &str)]) {
    live(async {
        let server = TestServer::start().await;
        for &(exact, mapping) in mappings {
            for (level, field) in FIELDS.into_iter().enumerate() {
                let error = error(&server, mapping, field).await;
                if level < exact {
                    assert!(error < 1e-9, "{mapping}, field {level}: {error:.1e}");
                } else {
                    assert!(error > 1e-4, "{mapping}, field {level}: only {error:.1e}");
                }
            }
        }
    });
}

#[test]
fn every_rule_of_a_scene_file_reproduces_its_fields_and_no_more() {
    // A filter that keeps all, but where the default does.
    let rules = [
        (1, r#"{"rule": {"direct": {}}}"#),
        (1, r#"{"rule": {"mean": {}}, "filter": {"keep": {"k": 3}}}"#),
        (1, r#"{"rule": {"weightedMean": {}}}"#),
        (3, r#"{"rule": {"barycentric": {}}}"#),
        (2, r#"{"rule": {"shapeMatching": {}}}"#),
        (3, r#"{"rule": {"linearShapeMatching": {}}}"#),
        (2, r#"{"rule": {"linearShapeMatching": {"beta": 0.5}}}"#),
        (2, r#"{"rule": {"linearShapeMatching": {"beta": 0}}}"#),
        (
            4,
            r#"{"rule": {"quadraticShapeMatching": {}}, "filter": {"keep": {"k": 14}}}"#,
        ),
        (
            2,
            r#"{"rule": {"quadraticShapeMatching": {"beta": 0.5}}, "filter": {"keep": {"k": 14}}}"#,
        ),
        (3, r#"{"rule": {"radialBasis": {}}}"#),
        (3, r#"{"rule": {"movingLeastSquares": {}}}"#),
        (
            2,
            r#"{"rule": {"movingLeastSquares": {"fit": "MOVING_FIT_RIGID"}}}"#,
        ),
        (
            2,
            r#"{"rule": {"shapeMatching": {"weights": "FIT_WEIGHTS_CLUSTER_MEAN"}}}"#,
        ),
        (
            3,
            r#"{"rule": {"linearShapeMatching": {"weights": "FIT_WEIGHTS_CLUSTER_MEAN"}},
                "reference": "REFERENCE_PREVIOUS"}"#,
        ),
        (
            4,
            r#"{"rule": {"quadraticShapeMatching": {"weights": "FIT_WEIGHTS_CLUSTER_MEAN"}},
                "filter": {"keep": {"k": 14}}}"#,
        ),
    ];
    reproduce(&rules);
}

#[test]
fn every_radial_function_and_polynomial_of_a_scene_file_does_what_it_says() {
    let functions = [
        ("GAUSSIAN", 0),
        ("SHIFTED_LOG", 1),
        ("MULTIQUADRIC", 1),
        ("INVERSE_MULTIQUADRIC", 0),
        ("INVERSE_QUADRATIC", 0),
        ("WENDLAND", 0),
        ("THIN_PLATE", 2),
        ("CUBIC", 2),
        ("LINEAR", 1),
    ];
    live(async {
        let server = TestServer::start().await;
        for (function, needs) in functions {
            for (order, polynomial, exact) in [(0, "NONE", 0), (1, "CONSTANT", 1), (2, "LINEAR", 3)]
            {
                let mapping = format!(
                    r#"{{"rule": {{"radialBasis": {{"function": "RADIAL_FUNCTION_{function}",
                        "polynomial": "POLYNOMIAL_{polynomial}"}}}}}}"#
                );
                if order < needs {
                    let field = "scene.mapping.rule.radial_basis.polynomial";
                    refused(&server, scene(&mapping), "MAPPING_REFUSED", field).await;
                } else if exact > 0 {
                    let field = FIELDS[exact - 1];
                    assert!(error(&server, &mapping, field).await < 1e-9, "{mapping}");
                } else {
                    assert!(
                        error(&server, &mapping, translation).await > 1e-4,
                        "{mapping}"
                    );
                }
            }
        }
    });
}

/// The points that a vertex keeps, as the service says, the strongest first.
async fn kept(server: &TestServer, session: &str, vertex: u32) -> Vec<v1::Influence> {
    let request = v1::ExplainRequest {
        name: session.to_owned(),
        vertex,
    };
    let told = server.sessions().explain(request).await.unwrap();
    told.into_inner().points
}

/// The number of points that each vertex keeps, by their ranks and distances alone.
fn counts(kept: impl Fn(usize, f64) -> bool, rest: &[[f64; 3]]) -> Vec<usize> {
    let points = scenes::rest(POINTS);
    let count = |x: &[f64; 3]| {
        let distance = |p: &[f64; 3]| (0..3).map(|i| (p[i] - x[i]).powi(2)).sum::<f64>().sqrt();
        let mut distances: Vec<f64> = points.iter().map(distance).collect();
        distances.sort_by(f64::total_cmp);
        let kept = distances
            .iter()
            .enumerate()
            .filter(|(rank, d)| kept(*rank, **d));
        kept.count()
    };
    rest.iter().map(count).collect()
}

#[test]
fn every_filter_of_a_scene_file_keeps_the_points_that_it_says() {
    type Kept = fn(usize, f64) -> bool;
    let filters: [(&str, Kept); 5] = [
        (r#"{"filter": {"minimum": {}}}"#, |rank, _| rank < 1),
        (r#"{"filter": {"keep": {"k": 5}}}"#, |rank, _| rank < 5),
        (
            r#"{"filter": {"interval": {"nearest": 0.3, "farthest": 0.9}}}"#,
            |_, d| (0.3..=0.9).contains(&d),
        ),
        (
            r#"{"filter": {"keepAtLeast": {"k": 2, "within": 0.5}}}"#,
            |rank, d| rank < 2 || d <= 0.5,
        ),
        (r#"{"filter": {"keepAtLeast": {}}}"#, |rank, _| rank < 8),
    ];
    live(async {
        let server = TestServer::start().await;
        for (filter, keeps) in filters {
            let session = server.create("", scene(filter)).await;
            let mut watcher = session.watch().await;
            watcher.keyframe().await;
            let counts = counts(keeps, &vertices(watcher.last()));
            for (vertex, expected) in (0..).zip(counts) {
                let points = kept(&server, &session.name, vertex).await;
                assert_eq!(points.len(), expected, "{filter}, vertex {vertex}");
                let sum: f64 = points.iter().map(|point| point.weight).sum();
                assert!((sum - 1.0).abs() < 1e-12);
            }
            assert!(error(&server, filter, translation).await < 1e-9, "{filter}");
        }
    });
}

#[test]
fn coefficients_of_a_scene_file_move_the_borders_between_points() {
    live(async {
        let server = TestServer::start().await;
        let owned_by_first = async |first: f64| {
            let mut values = vec!["1".to_owned(); POINTS];
            values[0] = first.to_string();
            let values = values.join(", ");
            let mapping = format!(
                r#"{{"weighting": {{"coefficients": {{"values": [{values}]}}}},
                    "rule": {{"direct": {{}}}}}}"#
            );
            assert!(error(&server, &mapping, translation).await < 1e-9);
            let session = server.create("", scene(&mapping)).await;
            let mut owned = 0;
            for vertex in 0..27 {
                let kept = kept(&server, &session.name, vertex).await;
                owned += usize::from(kept[0].index == 0);
            }
            owned
        };
        let (alone, fair, all) = (
            owned_by_first(1e6).await,
            owned_by_first(1.0).await,
            owned_by_first(0.0).await,
        );
        assert_eq!(alone, 0);
        assert!(0 < fair && fair < 27, "{fair}");
        assert_eq!(all, 27);
    });
}

async fn refused(server: &TestServer, scene: Scene, reason: &str, field: &str) {
    let before = server.names().await;
    let mapping = format!("{:?}", scene.mapping);
    let answer = server.try_create(scenes::creation(scene)).await;
    let refusal = sinew_tests::refused(answer, Code::InvalidArgument, reason);
    assert_eq!(refusal.field.as_deref(), Some(field), "{mapping}");
    assert_eq!(server.names().await, before, "{mapping}");
}

/// Fields below `scene.mapping`, and mappings that are refused for them.
const REFUSED: [(&str, &str); 17] = [
    // No four of three points, or of four in a plane, span a volume.
    (
        "rule.barycentric",
        r#"{"rule": {"barycentric": {}}, "filter": {"keep": {"k": 3}}}"#,
    ),
    (
        "rule.barycentric",
        r#"{"rule": {"barycentric": {}}, "points": ["p0", "p1", "p2"]}"#,
    ),
    (
        "rule.linear_shape_matching.beta",
        r#"{"rule": {"linearShapeMatching": {"beta": 1.5}}}"#,
    ),
    (
        "rule.quadratic_shape_matching.beta",
        r#"{"rule": {"quadraticShapeMatching": {"beta": -0.5}}}"#,
    ),
    (
        "rule.quadratic_shape_matching.beta",
        r#"{"rule": {"quadraticShapeMatching": {"beta": "NaN"}}}"#,
    ),
    (
        "rule.radial_basis.scale",
        r#"{"rule": {"radialBasis": {"scale": -1}}}"#,
    ),
    (
        "rule.radial_basis.scale",
        r#"{"rule": {"radialBasis": {"scale": "Infinity"}}}"#,
    ),
    (
        "weighting.coefficients",
        r#"{"weighting": {"coefficients": {"values": [1, 1]}}}"#,
    ),
    (
        "weighting.coefficients[13]",
        r#"{"weighting": {"coefficients": {"values": [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1]}}}"#,
    ),
    (
        "filter.interval",
        r#"{"filter": {"interval": {"nearest": 0.5, "farthest": 0.4}}}"#,
    ),
    (
        "filter.interval",
        r#"{"filter": {"interval": {"nearest": -0.5, "farthest": 0.4}}}"#,
    ),
    (
        "filter.interval",
        r#"{"filter": {"interval": {"nearest": "NaN", "farthest": 1}}}"#,
    ),
    // No point is so near to every vertex, nor so far.
    (
        "filter.interval",
        r#"{"filter": {"interval": {"farthest": 0.01}}}"#,
    ),
    (
        "filter.interval",
        r#"{"filter": {"interval": {"nearest": 5, "farthest": 9}}}"#,
    ),
    (
        "filter.keep_at_least",
        r#"{"filter": {"keepAtLeast": {"within": -1}}}"#,
    ),
    (
        "filter.keep_at_least",
        r#"{"filter": {"keepAtLeast": {"within": "Infinity"}}}"#,
    ),
    // So wide that the points cannot be told apart.
    (
        "rule.radial_basis",
        r#"{"rule": {"radialBasis": {"function": "RADIAL_FUNCTION_GAUSSIAN", "scale": 100}}}"#,
    ),
];

#[test]
fn mappings_without_an_answer_are_refused_by_field_and_reason() {
    live(async {
        let server = TestServer::start().await;
        for (field, mapping) in REFUSED {
            let field = format!("scene.mapping.{field}");
            refused(&server, scene(mapping), "MAPPING_REFUSED", &field).await;
        }
        let unknown = |kind| {
            let mut scene = scene("{}");
            scene.mapping.as_mut().unwrap().rule = Some(v1::MotionRule { kind: Some(kind) });
            scene
        };
        let weights = Kind::ShapeMatching(v1::ShapeMatching { weights: 99 });
        let field = "scene.mapping.rule.shape_matching.weights";
        refused(&server, unknown(weights), "ENUM_UNKNOWN", field).await;
        let fit = Kind::MovingLeastSquares(v1::MovingLeastSquares { fit: 99 });
        let field = "scene.mapping.rule.moving_least_squares.fit";
        refused(&server, unknown(fit), "ENUM_UNKNOWN", field).await;
        let mut reference = scene("{}");
        reference.mapping.as_mut().unwrap().reference = 99;
        refused(
            &server,
            reference,
            "ENUM_UNKNOWN",
            "scene.mapping.reference",
        )
        .await;
        for (field, basis) in [
            (
                "function",
                v1::RadialBasis {
                    function: 99,
                    ..v1::RadialBasis::default()
                },
            ),
            (
                "polynomial",
                v1::RadialBasis {
                    polynomial: 99,
                    ..v1::RadialBasis::default()
                },
            ),
        ] {
            let field = format!("scene.mapping.rule.radial_basis.{field}");
            let scene = unknown(Kind::RadialBasis(basis));
            refused(&server, scene, "ENUM_UNKNOWN", &field).await;
        }
    });
}

/// How far the mesh is from rest, m, where its points have turned once in four frames.
async fn left_by_a_full_turn(server: &TestServer, reference: v1::Reference) -> f64 {
    let mut scene = scene("{}");
    scene.mapping.as_mut().unwrap().reference = reference.into();
    let session = server.create("", scene).await;
    let mut watcher = session.watch().await;
    watcher.keyframe().await;
    let rest = vertices(watcher.last());
    let mut source = session.source().await;
    for quarter in 1..=4 {
        let (sin, cos) = (f64::from(quarter) * std::f64::consts::FRAC_PI_2).sin_cos();
        let turn = |[x, y, z]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
        let now: Vec<_> = scenes::rest(POINTS).into_iter().map(turn).collect();
        source.send(&now).await;
    }
    source.acked(4).await.unwrap();
    session.step(4).await.unwrap();
    let mut posed = Vec::new();
    for _ in 0..4 {
        posed = vertices(&watcher.frame().await);
    }
    let told = session.explain(0).await.unwrap();
    assert_eq!(told.reference(), reference);
    let coordinates = posed.as_flattened().iter().zip(rest.as_flattened());
    coordinates
        .map(|(x, x0)| (x - x0).abs())
        .fold(0.0, f64::max)
}

#[test]
fn a_weighted_mean_from_the_previous_frame_does_not_come_back_with_its_points() {
    live(async {
        let server = TestServer::start().await;
        assert!(left_by_a_full_turn(&server, v1::Reference::Initial).await < 1e-12);
        assert!(left_by_a_full_turn(&server, v1::Reference::Previous).await > 1e-2);
    });
}

#[test]
fn every_preset_reproduces_its_fields_and_no_more() {
    reproduce(&[
        (3, r#"{"preset": "PRESET_MKN04"}"#),
        (3, r#"{"preset": "PRESET_PKA05"}"#),
        (1, r#"{"preset": "PRESET_MHHR07"}"#),
        (2, r#"{"preset": "PRESET_RJ07"}"#),
        (3, r#"{"preset": "PRESET_ACF07"}"#),
        (2, r#"{"preset": "PRESET_SOG08"}"#),
        (3, r#"{"preset": "PRESET_AOW08"}"#),
    ]);
}

#[test]
fn a_preset_says_what_the_mapping_does_not() {
    live(async {
        let server = TestServer::start().await;
        // One volume, which holds all the points.
        let one = |mapping: &str| Scene {
            mesh: scenes::block(POINTS, 1, scenes::Rule::Mean).mesh,
            ..scene(mapping)
        };
        for (mapping, rule, points) in [
            (r#"{"preset": "PRESET_MHTG05"}"#, "shape_matching", POINTS),
            (r#"{"preset": "PRESET_MKN04"}"#, "moving_least_squares", 10),
            (r#"{"preset": "PRESET_MHHR07"}"#, "direct", 1),
            (
                r#"{"preset": "PRESET_MHHR07", "rule": {"mean": {}}}"#,
                "mean",
                1,
            ),
            (
                r#"{"preset": "PRESET_MKN04", "rule": {"mean": {}}, "filter": {"keep": {"k": 5}}}"#,
                "mean",
                5,
            ),
        ] {
            let session = server.create("", one(mapping)).await;
            let told = session.explain(0).await.unwrap();
            assert_eq!(
                (&*told.rule, told.points.len()),
                (rule, points),
                "{mapping}"
            );
        }
    });
}
