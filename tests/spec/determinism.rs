//! The same scene and the same inputs give the same digest, on any number of threads. These tests hold for ever.

use sinew_proto::v1::Scene;
use sinew_tests::{TestServer, live, scenes, scenes::Rule};

/// Enough vertices (29,791) for the mapping to share its work between threads.
const CUBES: usize = 30;
const POINTS: usize = 40;
const FRAMES: u64 = 12;

/// Runs `scenario` on servers with 1, 2 and 8 threads, and once more: all its digests must agree.
pub(crate) fn same_on_any_number_of_threads(scenario: impl AsyncFn(&TestServer) -> Vec<String>) {
    live(async {
        let mut expected = None;
        for threads in [1, 2, 8, 2] {
            let server = TestServer::with(|config| config.threads = threads).await;
            let digests = scenario(&server).await;
            let changing = digests.windows(2).all(|pair| pair[0] != pair[1]);
            assert!(changing, "the state stands still: {digests:?}");
            let expected = expected.get_or_insert_with(|| digests.clone());
            assert_eq!(digests, *expected, "on {threads} threads");
        }
    });
}

/// Streams a motion that bends and twists the points, some of them occluded now and then; a digest for each frame.
async fn streamed(server: &TestServer, scene: Scene) -> Vec<String> {
    let session = server.create("tissue", scene).await;
    let mut source = session.source().await;
    let mut digests = vec![session.digest().await];
    for i in 1..=FRAMES {
        let angle = 0.05 * i as f64;
        let twist = |p: &[f64; 3]| {
            let (sin, cos) = (angle * p[2]).sin_cos();
            [
                cos * p[0] - sin * p[1],
                sin * p[0] + cos * p[1],
                p[2] + 0.1 * angle * p[0] * p[0],
            ]
        };
        let pose: Vec<_> = scenes::rest(POINTS).iter().map(twist).collect();
        let flags: Vec<u8> = (0..POINTS as u64)
            .map(|p| u8::from((p + i) % 7 == 0))
            .collect();
        let sequence = source.send_flagged(&pose, &flags).await;
        source.acked(sequence).await.unwrap();
        digests.push(session.step(1).await.unwrap().digest);
    }
    digests
}

#[test]
fn weighted_means_of_streamed_points() {
    same_on_any_number_of_threads(async |server| {
        streamed(server, scenes::block(POINTS, CUBES, Rule::Mean)).await
    });
}

#[test]
fn shape_matching_of_streamed_points() {
    same_on_any_number_of_threads(async |server| {
        streamed(server, scenes::block(POINTS, CUBES, Rule::Rigid)).await
    });
}

#[test]
fn a_network_of_springs_and_the_mesh_that_it_drives() {
    same_on_any_number_of_threads(async |server| {
        // 4,096 masses with 16,128 spring ends: enough for the network to share its work, too.
        let mut scene = scenes::sheet(64);
        scene.mesh = scenes::block(POINTS, CUBES, Rule::Rigid).mesh;
        scene.mapping = scenes::block(POINTS, CUBES, Rule::Rigid).mapping;
        let session = server.create("sheet", scene).await;
        let mut digests = vec![session.digest().await];
        for _ in 0..4 {
            digests.push(session.step(5).await.unwrap().digest);
        }
        digests
    });
}

#[test]
fn any_difference_in_the_scene_is_a_difference_in_the_digest() {
    live(async {
        let server = TestServer::start().await;
        let plain = server.create("", scenes::small()).await.digest().await;
        let again = server.create("", scenes::small()).await.digest().await;
        assert_eq!(plain, again);
        let changes: [fn(&mut Scene); 3] = [
            |s| {
                let mut rest = scenes::rest(8);
                rest[0][0] += 1e-15;
                scenes::points(s).rest_positions = Some(scenes::reals(rest.as_flattened()));
            },
            |s| scenes::points(s).absent = Some(sinew_proto::v1::Indices::pack(&[7])),
            |s| *scenes::mesh(s) = scenes::grid(&sinew_mesh::shapes::tetrahedra(2, 2, 2)),
        ];
        for change in changes {
            let mut scene = scenes::small();
            change(&mut scene);
            assert_ne!(server.create("", scene).await.digest().await, plain);
        }
    });
}
