//! Why a vertex is where it is.

use sinew_proto::v1::{Filter, KeepK, Mapping, UpdateMappingRequest, filter};
use sinew_tests::{TestServer, live, refused, scenes, scenes::Rule, vertices};
use tonic::Code;

fn keep(k: u32) -> Option<Filter> {
    let kind = Some(filter::Kind::Keep(KeepK { k }));
    Some(Filter { kind })
}

fn change(mapping: Mapping) -> UpdateMappingRequest {
    UpdateMappingRequest {
        mapping: Some(mapping),
        ..UpdateMappingRequest::default()
    }
}

#[test]
fn an_explanation_names_the_nearest_points_and_their_shares() {
    live(async {
        let server = TestServer::start().await;
        let now = scenes::bent(20, 0.5);
        let mut scene = scenes::block(20, 2, Rule::Mean);
        scene.mapping.as_mut().unwrap().filter = keep(4);
        let session = server.create("tissue", scene).await;
        let mut source = session.source().await;
        session.step_to(&mut source, &now).await;
        let frame = session.watch().await.keyframe().await.frame.unwrap();
        let rest = scenes::rest(20);
        for (vertex, at) in (0..).zip(vertices(&frame)) {
            let told = session.explain(vertex).await.unwrap();
            let v = told.rest_position.unwrap();
            let x = told.position.unwrap();
            assert_eq!(([x.x, x.y, x.z], told.step), (at, 1));
            assert_eq!((told.vertex, told.rule.as_str()), (vertex, "weighted_mean"));
            assert_eq!((told.cluster, told.mapping_step), (None, 0));

            let mut nearest: Vec<(f64, u32)> = (0..)
                .zip(&rest)
                .map(|(j, p)| ((v.x - p[0]).hypot(v.y - p[1]).hypot(v.z - p[2]), j))
                .collect();
            nearest.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let found: Vec<u32> = told.points.iter().map(|point| point.index).collect();
            let expected: Vec<u32> = nearest[..4].iter().map(|near| near.1).collect();
            assert_eq!(found, expected);
            for (point, near) in told.points.iter().zip(&nearest) {
                assert_eq!(point.label, format!("p{}", point.index));
                assert!((point.rest_distance - near.0).abs() < 1e-12);
            }
            let sum: f64 = told.points.iter().map(|point| point.weight).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            // x = x0 + sum of the shares of the displacements
            let moved = [v.x, v.y, v.z].into_iter().enumerate().map(|(axis, x0)| {
                let shares = told.points.iter().map(|point| {
                    let j = point.index as usize;
                    point.weight * (now[j][axis] - rest[j][axis])
                });
                x0 + shares.sum::<f64>()
            });
            for (moved, at) in moved.zip(at) {
                assert!((moved - at).abs() < 1e-12);
            }
        }
    });
}

#[test]
fn an_explanation_names_the_cluster_and_the_last_change() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut source = session.source().await;
        session.step_to(&mut source, &scenes::bent(8, 0.5)).await;
        let mapping = Mapping {
            filter: keep(3),
            ..scenes::mapping(Rule::Rigid)
        };
        session.remap(change(mapping)).await.unwrap();
        let mut told = Vec::new();
        for vertex in 0..27 {
            told.push(session.explain(vertex).await.unwrap());
        }
        let points = |vertex: u32| {
            let points = told[vertex as usize].points.iter();
            let mut points: Vec<u32> = points.map(|point| point.index).collect();
            points.sort();
            points
        };
        for (vertex, why) in (0..).zip(&told) {
            assert_eq!((why.rule.as_str(), why.mapping_step), ("shape_matching", 1));
            let same: Vec<u32> = (0..27).filter(|&v| points(v) == points(vertex)).collect();
            let cluster = why.cluster.unwrap();
            assert_eq!(cluster.first_vertex, same[0]);
            assert_eq!(cluster.vertex_count as usize, same.len());
        }
    });
}

#[test]
fn no_session_and_no_vertex_are_told_apart() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        for vertex in [27, u32::MAX] {
            let answer = session.explain(vertex).await;
            let refusal = refused(answer, Code::InvalidArgument, "INDEX_OUT_OF_RANGE");
            assert_eq!(refusal.field.as_deref(), Some("vertex"));
            assert!(refusal.message.contains("27 vertices"), "{refusal:?}");
        }
        let nobody = server.session("nobody");
        refused(nobody.explain(0).await, Code::NotFound, "SESSION_UNKNOWN");
        let answer = nobody.remap(change(scenes::mapping(Rule::Mean))).await;
        refused(answer, Code::NotFound, "SESSION_UNKNOWN");
    });
}
