//! Weights along paths over the mesh, from scene files and on running sessions.

use sinew_proto::v1::{self, Mapping, Scene, UpdateMappingRequest};
use sinew_tests::{TestServer, live, refused, scenes, vertices};
use tonic::Code;

const POINTS: usize = 14;
const CELLS: [&str; 4] = ["VERTEX", "EDGE", "FACE", "VOLUME"];

/// A block of 2 × 2 × 2 hexahedra with this mapping, as a scene file has it.
fn scene(mapping: &str) -> Scene {
    Scene {
        mapping: Some(parsed(mapping)),
        ..scenes::block(POINTS, 2, scenes::Rule::Mean)
    }
}

fn parsed(mapping: &str) -> Mapping {
    serde_json::from_str(mapping).expect(mapping)
}

#[test]
fn vertices_follow_the_points_in_the_volumes_around_them() {
    live(async {
        let server = TestServer::start().await;
        let mut one = scene(r#"{"filter": {"inVolume": {}}}"#);
        one.mesh = scenes::block(POINTS, 1, scenes::Rule::Mean).mesh;
        let session = server.create("", one).await;
        for vertex in 0..8 {
            assert_eq!(session.explain(vertex).await.unwrap().points.len(), POINTS);
        }
    });
}

/// The points that each vertex follows, the strongest first, with their weights.
async fn followed(server: &TestServer, mapping: &str) -> Vec<Vec<(u32, f64)>> {
    let session = server.create("", scene(mapping)).await;
    let mut all = Vec::new();
    for vertex in 0..27 {
        let told = session.explain(vertex).await.unwrap();
        let points = told.points.iter();
        all.push(points.map(|point| (point.index, point.weight)).collect());
    }
    all
}

#[test]
fn floods_over_cells_of_any_dimension_through_any_other_move_the_mesh_with_the_points() {
    live(async {
        let server = TestServer::start().await;
        for targets in CELLS {
            for arcs in CELLS {
                let mapping = format!(
                    r#"{{"weighting": {{"targets": "CELL_KIND_{targets}",
                        "flood": {{"arcs": "CELL_KIND_{arcs}", "length": {{}}}}}}}}"#
                );
                if targets == arcs {
                    let answer = server.try_create(scenes::creation(scene(&mapping))).await;
                    let refusal = refused(answer, Code::InvalidArgument, "MAPPING_REFUSED");
                    let field = "scene.mapping.weighting.flood.arcs";
                    assert_eq!(refusal.field.as_deref(), Some(field));
                    continue;
                }
                let session = server.create("", scene(&mapping)).await;
                let mut watcher = session.watch().await;
                watcher.keyframe().await;
                let rest = vertices(watcher.last());
                let mut source = session.source().await;
                let now: Vec<_> = scenes::rest(POINTS)
                    .into_iter()
                    .map(|[x, y, z]| [x + 0.5, y - 2.0, z + 0.25])
                    .collect();
                source.send(&now).await;
                source.acked(1).await.unwrap();
                session.step(1).await.unwrap();
                for (x, x0) in vertices(&watcher.frame().await).iter().zip(&rest) {
                    for (axis, by) in [0.5, -2.0, 0.25].into_iter().enumerate() {
                        assert!((x[axis] - x0[axis] - by).abs() < 1e-12, "{mapping}");
                    }
                }
            }
        }
    });
}

#[test]
fn geodesics_of_a_scene_file_lead_straight_through_its_mesh() {
    live(async {
        let server = TestServer::start().await;
        // In a convex mesh the way inside is the straight one: the same points, by the same weights.
        let with = |kind: &str| {
            format!(r#"{{"weighting": {{{kind}}}, "filter": {{"interval": {{"farthest": 1e9}}}}}}"#)
        };
        let by_way = followed(&server, &with(r#""flood": {"geodesic": {}, "scale": 0.4}"#)).await;
        let straight = followed(&server, &with(r#""distance": {"scale": 0.4}"#)).await;
        let weight = |row: &[(u32, f64)], point: u32| {
            let entry = row.iter().find(|entry| entry.0 == point);
            entry.expect("all points are kept").1
        };
        for (by_way, straight) in by_way.iter().zip(&straight) {
            for point in 0..u32::try_from(POINTS).unwrap() {
                let gap = weight(by_way, point) - weight(straight, point);
                assert!(gap.abs() < 0.05, "point {point}: {gap}");
            }
        }
    });
}

#[test]
fn roots_and_costs_of_a_scene_file_are_those_of_its_mesh() {
    live(async {
        let server = TestServer::start().await;
        let with = |flood: &str, filter: &str| {
            format!(
                r#"{{"weighting": {{"flood": {{{flood}}}}}, "filter": {{{filter}}}, "rule": {{"mean": {{}}}}}}"#
            )
        };
        let sets = async |flood: &str, filter: &str| {
            let rows = followed(&server, &with(flood, filter)).await;
            let mut sets: Vec<Vec<u32>> = Vec::new();
            for row in rows {
                let mut set: Vec<u32> = row.iter().map(|entry| entry.0).collect();
                set.sort_unstable();
                sets.push(set);
            }
            sets
        };
        let keep_three = r#""keep": {"k": 3}"#;
        let hops = sets("", keep_three).await;
        // A column of ones costs as much as hops, and so do volumes of one size.
        let ones = format!(r#""column": {{"values": [{}]}}"#, ["1"; 27].join(", "));
        assert_eq!(sets(&ones, keep_three).await, hops);
        assert_eq!(sets(r#""volume": {}"#, keep_three).await, hops);
        // So large a ball holds every vertex: then all are as near to every point, and ties go to the lower index.
        let ball = sets(r#""ball": {"radius": 1000}"#, keep_three).await;
        assert!(ball.iter().all(|set| *set == [0, 1, 2]));
        assert_eq!(
            sets("", r#""interval": {"farthest": 1e9}"#).await,
            vec![(0..14).collect::<Vec<u32>>(); 27]
        );
        // The vertices of the cube that holds a point are at no distance from it, and no others are.
        let points = scenes::rest(POINTS);
        let nearest = r#""keepAtLeast": {"k": 1}"#;
        let mut found = 0;
        for (vertex, set) in sets(r#""containing": {}"#, nearest)
            .await
            .into_iter()
            .enumerate()
        {
            let place = [vertex % 3, vertex / 3 % 3, vertex / 9].map(|i| 0.5 * i as f64);
            let beside = |p: &[f64; 3]| (0..3).all(|i| (p[i] - place[i]).abs() <= 0.5);
            let held: Vec<u32> = (0..)
                .zip(&points)
                .filter(|(_, p)| beside(p))
                .map(|(j, _)| j)
                .collect();
            if !held.is_empty() {
                assert_eq!(set, held);
                found += 1;
            }
        }
        assert!(found > 20);
        // A turn of the surface may cost so much that paths go round the edges, or nothing.
        let flat = sets(r#""curvature": {"metresPerRadian": 0}"#, keep_three).await;
        assert_eq!(flat, sets(r#""length": {}"#, keep_three).await);
    });
}

#[test]
fn coefficients_move_the_borders_of_floods() {
    live(async {
        let server = TestServer::start().await;
        let owned = async |first: f64| {
            let mut values = vec!["1".to_owned(); POINTS];
            values[0] = first.to_string();
            let values = values.join(", ");
            let mapping = format!(
                r#"{{"weighting": {{"coefficients": {{"values": [{values}]}}, "flood": {{"length": {{}}}}}},
                    "filter": {{"minimum": {{}}}}}}"#
            );
            let rows = followed(&server, &mapping).await;
            rows.iter().filter(|row| row[0].0 == 0).count()
        };
        let counts = [
            owned(1e6).await,
            owned(2.0).await,
            owned(1.0).await,
            owned(0.5).await,
            owned(0.0).await,
        ];
        assert!(counts.is_sorted(), "{counts:?}");
        assert!(counts[0] < counts[2] && counts[2] < counts[4], "{counts:?}");
        assert_eq!(counts[4], 27);
    });
}

#[test]
fn a_running_session_changes_over_to_a_flood() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("", scene("{}")).await;
        let mapping = r#"{"weighting": {"flood": {"containing": {}, "length": {}}},
            "filter": {"sequence": {"filters": [{"interval": {"farthest": 10}}, {"keep": {"k": 2}}]}}}"#;
        let request = UpdateMappingRequest {
            mapping: Some(parsed(mapping)),
            ..UpdateMappingRequest::default()
        };
        session.remap(request).await.unwrap();
        let told = session.explain(13).await.unwrap();
        assert_eq!(told.points.len(), 2);
        let sum: f64 = told.points.iter().map(|point| point.weight).sum();
        assert!((sum - 1.0).abs() < 1e-12);
        assert!(followed(&server, mapping).await[13].len() == 2);
    });
}

/// Fields below `scene.mapping`, and mappings that are refused for them.
const REFUSED: [(&str, &str); 11] = [
    (
        "weighting.flood.ball.radius",
        r#"{"weighting": {"flood": {"ball": {"radius": 0}}}}"#,
    ),
    (
        "weighting.flood.ball.radius",
        r#"{"weighting": {"flood": {"ball": {"radius": "NaN"}}}}"#,
    ),
    (
        "weighting.flood.roots",
        r#"{"weighting": {"flood": {"ball": {"radius": 1e-9}}}}"#,
    ),
    (
        "weighting.flood.arcs",
        r#"{"weighting": {"flood": {"geodesic": {}, "arcs": "CELL_KIND_EDGE"}}}"#,
    ),
    (
        "weighting.flood.scale",
        r#"{"weighting": {"flood": {"scale": -1}}}"#,
    ),
    (
        "weighting.coefficients[13]",
        r#"{"weighting": {"flood": {}, "coefficients": {"values":
                [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, "Infinity"]}}}"#,
    ),
    (
        "filter.interval",
        r#"{"weighting": {"flood": {}}, "filter": {"interval": {"nearest": 90, "farthest": 99}}}"#,
    ),
    (
        "filter.in_volume",
        r#"{"filter": {"inVolume": {}}, "points": ["p0"]}"#,
    ),
    (
        "filter.four_spanning",
        r#"{"filter": {"fourSpanning": {}}, "points": ["p0", "p1", "p2"]}"#,
    ),
    (
        "filter.four_spanning",
        r#"{"filter": {"fourSpanning": {"within": -1}}}"#,
    ),
    (
        "filter.sequence",
        r#"{"filter": {"sequence": {"filters": [{"keep": {"k": 4}}, {"interval": {"nearest": 50, "farthest": 60}}]}}}"#,
    ),
];

#[test]
fn floods_without_an_answer_are_refused_by_field() {
    live(async {
        let server = TestServer::start().await;
        for (field, mapping) in REFUSED {
            let answer = server.try_create(scenes::creation(scene(mapping))).await;
            let refusal = refused(answer, Code::InvalidArgument, "MAPPING_REFUSED");
            assert_eq!(
                refusal.field,
                Some(format!("scene.mapping.{field}")),
                "{mapping}"
            );
        }
        for (reason, field, flood) in [
            (
                "LENGTH_MISMATCH",
                "column",
                r#""column": {"values": [1, 2]}"#,
            ),
            (
                "VALUE_OUT_OF_RANGE",
                "curvature.metres_per_radian",
                r#""curvature": {"metresPerRadian": -1}"#,
            ),
        ] {
            let mapping = format!(r#"{{"weighting": {{"flood": {{{flood}}}}}}}"#);
            let answer = server.try_create(scenes::creation(scene(&mapping))).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            assert_eq!(
                refusal.field,
                Some(format!("scene.mapping.weighting.flood.{field}"))
            );
        }
        let mut unknown = scene("{}");
        unknown.mapping.as_mut().unwrap().weighting = Some(v1::Weighting {
            targets: 99,
            ..v1::Weighting::default()
        });
        let answer = server.try_create(scenes::creation(unknown)).await;
        let refusal = refused(answer, Code::InvalidArgument, "ENUM_UNKNOWN");
        assert_eq!(
            refusal.field.as_deref(),
            Some("scene.mapping.weighting.targets")
        );
    });
}
