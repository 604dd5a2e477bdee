//! What subscribers see.

use prost::Message as _;
use sinew_mesh::Cells;
use sinew_proto::v1::{
    Content, Frame, Indices, Keyframe, Precision, Reals, SubscribeRequest, SubscribeResponse,
    UnstructuredGrid, subscribe_response::Item,
};
use sinew_tests::{TestServer, Watcher, live, scenes, scenes::Rule, vertices};

fn cells(grid: &UnstructuredGrid) -> Cells {
    let column = |given: &Option<Indices>| {
        let column = given.as_ref().map(Indices::unpack);
        column.map_or(Vec::new(), Result::unwrap)
    };
    Cells {
        types: grid.cell_types.to_vec(),
        connectivity: column(&grid.connectivity),
        offsets: column(&grid.offsets),
        faces: column(&grid.faces),
        face_offsets: column(&grid.face_offsets),
    }
}

/// All of a frame that does not depend on who reads it.
fn content(frame: &Frame) -> Frame {
    let mut frame = frame.clone();
    frame.timing.as_mut().unwrap().sent = 0;
    frame
}

/// An item without the moment when it was made for its reader.
fn undated(mut item: Item) -> Item {
    let frame = match &mut item {
        Item::Keyframe(keyframe) => keyframe.frame.as_mut(),
        Item::Frame(frame) => Some(frame),
        Item::Patch(patch) => patch.frame.as_mut(),
        Item::Events(_) | Item::Goodbye(_) | Item::Chunk(_) => None,
    };
    if let Some(frame) = frame {
        *frame = content(frame);
    }
    item
}

fn largest_distance(found: &[[f64; 3]], expected: &[[f64; 3]]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let pairs = found.as_flattened().iter().zip(expected.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_keyframe_comes_first_and_holds_the_scene_at_rest() {
    live(async {
        let server = TestServer::start().await;
        let mut scene = scenes::small();
        let posted = scenes::mesh(&mut scene).clone();
        let session = server.create("tissue", scene).await;
        let Keyframe {
            grid,
            labels,
            frame,
        } = session.watch().await.keyframe().await;
        let (grid, frame) = (grid.unwrap(), frame.unwrap());
        assert_eq!(cells(&grid), cells(&posted));
        assert!(grid.positions.is_none());
        assert_eq!(labels, scenes::labels(8));
        assert_eq!(
            (frame.sequence, frame.step, frame.time_seconds),
            (1, 0, 0.0)
        );
        assert_eq!(frame.vertices, posted.positions);
        assert_eq!(
            frame.points,
            Some(scenes::reals(scenes::rest(8).as_flattened()))
        );
        assert_eq!(&frame.point_states[..], [1; 8]);
        assert_eq!(
            (frame.capture_time_seconds, frame.motion_sequence),
            (None, None)
        );
    });
}

#[test]
fn every_frame_names_the_layout_that_the_keyframes_cells_hash_to() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let mut watcher = session.watch().await;
        let Keyframe { grid, frame, .. } = watcher.keyframe().await;
        let (grid, first) = (grid.unwrap(), frame.unwrap());
        assert_eq!(first.layout_hash, cells(&grid).hash());
        for step in 1..5 {
            session.step(1).await.unwrap();
            let frame = watcher.frame().await;
            assert_eq!((frame.step, frame.sequence), (step, first.sequence + step));
            let layout = |f: &Frame| (f.epoch, f.topology_version, f.layout_hash, f.vertex_count);
            assert_eq!(layout(&frame), layout(&first));
        }
    });
}

#[test]
fn meshes_of_another_layout_have_another_hash() {
    live(async {
        let server = TestServer::start().await;
        let mut hashes = Vec::new();
        for cubes in [1, 2, 3] {
            let session = server.create("", scenes::block(8, cubes, Rule::Mean)).await;
            hashes.push(
                session
                    .watch()
                    .await
                    .keyframe()
                    .await
                    .frame
                    .unwrap()
                    .layout_hash,
            );
        }
        assert!(hashes[0] != hashes[1] && hashes[1] != hashes[2] && hashes[0] != hashes[2]);
    });
}

#[test]
fn two_subscribers_see_the_same_bits_at_the_same_sequence() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(4)).await;
        let (mut alice, mut bob) = (session.watch().await, session.watch().await);
        assert_eq!(alice.keyframe().await.grid, bob.keyframe().await.grid);
        assert_eq!(content(alice.last()), content(bob.last()));
        for _ in 0..20 {
            session.step(1).await.unwrap();
            assert_eq!(content(&alice.frame().await), content(&bob.frame().await));
        }
    });
}

#[test]
fn who_subscribes_before_during_or_after_a_run_ends_at_the_same_state() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(4)).await;
        let mut before = session.watch().await;
        session.run().await.unwrap();
        before.until(10).await;
        let mut during = session.watch().await;
        let joined = during.keyframe().await.frame.unwrap();
        assert!(joined.step >= 10);
        let end = session.pause().await.unwrap().step;
        let mut after = session.watch().await;
        let last = after.keyframe().await.frame.unwrap();
        assert_eq!((last.step, last.sequence), (end, end + 1));
        for watcher in [&mut before, &mut during] {
            // Whatever it missed on the way, the newest state reaches it.
            if watcher.last().step < end {
                watcher.until(end).await;
            }
            assert_eq!(content(watcher.last()), content(&last));
        }
    });
}

#[test]
fn sequences_only_grow_and_count_the_steps() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let mut watcher = session.watch().await;
        session.run().await.unwrap();
        let mut last = 0;
        while last < 300 {
            let frame = watcher.positions().await.unwrap().unwrap();
            assert!(frame.sequence > last, "{} follows {last}", frame.sequence);
            assert_eq!(frame.sequence, frame.step + 1);
            last = frame.sequence;
        }
    });
}

#[test]
fn a_translation_of_all_points_moves_every_vertex_by_it() {
    live(async {
        let server = TestServer::start().await;
        for rule in [Rule::Mean, Rule::Rigid] {
            let session = server.create("", scenes::block(40, 4, rule)).await;
            let mut watcher = session.watch().await;
            watcher.keyframe().await;
            let rest = vertices(watcher.last());
            let mut source = session.source().await;
            session.run().await.unwrap();
            for by in [[0.25, -1.5, 3.0], [-7.0, 0.1, 1e-3], [0.0; 3]] {
                source
                    .send(&scenes::translated(&scenes::rest(40), by))
                    .await;
                let found = vertices(&watcher.frame().await);
                let error = largest_distance(&found, &scenes::translated(&rest, by));
                assert!(error < 1e-12, "{rule:?} by {by:?}: {error:e} m");
            }
        }
    });
}

#[test]
fn shape_matching_follows_a_rigid_motion_exactly() {
    live(async {
        let server = TestServer::start().await;
        let session = server
            .create("block", scenes::block(40, 4, Rule::Rigid))
            .await;
        let mut watcher = session.watch().await;
        watcher.keyframe().await;
        let rest = vertices(watcher.last());
        let mut source = session.source().await;
        session.run().await.unwrap();
        // Half a turn about an axis through no point, in steps, while it moves on.
        for i in 1..=20 {
            let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 20.0).sin_cos();
            let shift = [0.1 * f64::from(i), 2.0, -1.0];
            let motion = |p: &[f64; 3]| {
                let [x, y, z] = *p;
                [
                    cos * x - sin * y + shift[0],
                    sin * x + cos * y + shift[1],
                    z + shift[2],
                ]
            };
            let points: Vec<_> = scenes::rest(40).iter().map(motion).collect();
            source.send(&points).await;
            let found = vertices(&watcher.frame().await);
            let expected: Vec<_> = rest.iter().map(motion).collect();
            let error = largest_distance(&found, &expected);
            assert!(error < 1e-12, "at {i}/20 of half a turn: {error:e} m");
        }
    });
}

#[test]
fn a_frame_tells_of_the_motion_behind_it() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut watcher = session.watch().await;
        watcher.keyframe().await;
        let mut source = session.source().await;
        session.run().await.unwrap();
        for sequence in 1..=3 {
            source.send(&scenes::rest(8)).await;
            let frame = watcher.frame().await;
            assert_eq!(frame.motion_sequence, Some(sequence));
            assert_eq!(frame.capture_time_seconds, Some(sequence as f64 / 100.0));
            let timing = frame.timing.unwrap();
            let order = [
                timing.received,
                timing.step_started,
                timing.published,
                timing.sent,
            ];
            assert!(order[0] > 0 && order.is_sorted(), "{timing:?}");
        }
    });
}

#[test]
fn a_reader_gets_the_content_it_asked_for_and_no_other() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        for (asked, mesh, points) in [
            (Content::Unspecified, true, true),
            (Content::MeshAndPoints, true, true),
            (Content::Mesh, true, false),
            (Content::Points, false, true),
        ] {
            let request = SubscribeRequest {
                content: asked.into(),
                ..session.subscription()
            };
            let mut watcher = session.subscribe(request).await.unwrap();
            let keyframe = watcher.keyframe().await;
            session
                .source()
                .await
                .send_and_close(&scenes::rest(8))
                .await;
            session.step(1).await.unwrap();
            let frame = watcher.frame().await;
            assert_eq!(keyframe.grid.is_some(), mesh, "{asked:?}");
            for frame in [keyframe.frame.unwrap(), frame] {
                assert_eq!(frame.vertices.is_some(), mesh, "{asked:?}");
                assert_eq!(frame.points.is_some(), points, "{asked:?}");
                assert_eq!(!frame.point_states.is_empty(), points, "{asked:?}");
                assert_eq!(frame.vertex_count, 27);
            }
        }
    });
}

#[test]
fn f32_is_f64_rounded_once_and_the_default() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(4)).await;
        let mut exact = session.watch().await;
        exact.keyframe().await;
        for precision in [Precision::F32, Precision::Unspecified] {
            let request = SubscribeRequest {
                precision: precision.into(),
                ..session.subscription()
            };
            let mut rounded = session.subscribe(request).await.unwrap();
            rounded.keyframe().await;
            for _ in 0..4 {
                session.step(3).await.unwrap();
                let step = session.get().await.unwrap().step;
                exact.until(step).await;
                rounded.until(step).await;
                for (f32, f64) in [
                    (&rounded.last().vertices, &exact.last().vertices),
                    (&rounded.last().points, &exact.last().points),
                ] {
                    let (f32, f64) = (f32.as_ref().unwrap(), f64.as_ref().unwrap());
                    assert!(f32.f64.is_empty() && f64.f32.is_empty());
                    let once = Reals::pack(&f64.unpack().unwrap(), Precision::F32);
                    assert_eq!(*f32, once);
                }
            }
        }
    });
}

/// Reads messages as they come until they make one item.
async fn group(watcher: &mut Watcher) -> Vec<SubscribeResponse> {
    let mut group = Vec::new();
    loop {
        let message = watcher.message().await.unwrap().unwrap();
        let more = matches!(&message.item, Some(Item::Chunk(c)) if c.index + 1 < c.count);
        group.push(message);
        if !more {
            return group;
        }
    }
}

#[test]
fn items_too_large_for_a_reader_come_in_chunks_that_join_to_the_same_item() {
    const LIMIT: u32 = 65_536;
    live(async {
        let server = TestServer::start().await;
        let session = server
            .create("block", scenes::block(8, 20, Rule::Mean))
            .await;
        let mut whole = session.watch().await;
        let narrow = SubscribeRequest {
            max_message_bytes: LIMIT,
            ..session.subscription()
        };
        let mut chunked = session.subscribe(narrow).await.unwrap();
        let keyframe = whole.keyframe().await;
        session
            .source()
            .await
            .send_and_close(&scenes::rest(8))
            .await;
        session.step(1).await.unwrap();
        let frame = whole.frame().await;

        for expected in [Item::Keyframe(keyframe), Item::Frame(frame)] {
            let group = group(&mut chunked).await;
            assert!(group.len() > 3, "{} messages", group.len());
            let mut joined = Vec::new();
            for (i, message) in group.iter().enumerate() {
                assert!(message.encoded_len() <= LIMIT as usize);
                let Some(Item::Chunk(chunk)) = &message.item else {
                    panic!("message {i} of a group is {message:?}");
                };
                assert_eq!(
                    (chunk.index as usize, chunk.count as usize),
                    (i, group.len())
                );
                joined.extend_from_slice(&chunk.data);
            }
            let joined = SubscribeResponse::decode(&joined[..]).unwrap();
            assert_eq!(undated(joined.item.unwrap()), undated(expected));
        }
    });
}

#[test]
fn a_keyframe_comes_again_after_its_interval() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let often = SubscribeRequest {
            keyframe_interval_seconds: 1.0,
            ..session.subscription()
        };
        let mut watcher = session.subscribe(often).await.unwrap();
        let first = watcher.keyframe().await;
        session.run().await.unwrap();
        let mut frames = 0;
        let again = loop {
            match watcher.item().await.unwrap().unwrap() {
                Item::Keyframe(keyframe) => break keyframe,
                Item::Frame(_) => frames += 1,
                item @ (Item::Patch(_) | Item::Events(_) | Item::Goodbye(_) | Item::Chunk(_)) => {
                    panic!("only positions change: {item:?}")
                }
            }
        };
        assert!(frames > 0, "every item is a keyframe");
        assert_eq!((again.grid, again.labels), (first.grid, first.labels));
        assert_eq!(
            again.frame.unwrap().layout_hash,
            first.frame.unwrap().layout_hash
        );
    });
}
