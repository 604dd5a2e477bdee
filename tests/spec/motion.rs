//! Motion that clients stream in.

use sinew_proto::v1::{self, Indices, PointState};
use sinew_tests::{
    Source, TestServer, TestSession, live, refused, scenes, scenes::Rule, vertices, wire::Http1,
};
use tonic::Code;

const VALID: u8 = PointState::Valid as u8;
const LOST: u8 = PointState::Lost as u8;
const ABSENT: u8 = PointState::Absent as u8;

/// A motion of `n` points that never repeats: frame `i`.
fn pose(n: usize, i: u64) -> Vec<[f64; 3]> {
    let t = i as f64 * 0.01;
    let moved = |p: &[f64; 3]| [p[0] + t.sin(), p[1] * (1.0 + 0.3 * t.cos()), p[2] - 0.2 * t];
    scenes::rest(n).iter().map(moved).collect()
}

#[test]
fn the_hello_is_answered_by_the_number_of_points_and_the_queues_room() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let source = session.source().await;
        assert_eq!(source.accepted.point_count, 8);
        assert!(source.accepted.queue_capacity > 0);
    });
}

#[test]
fn points_in_another_order_give_the_same_state() {
    live(async {
        let server = TestServer::start().await;
        let scene = || scenes::block(8, 2, Rule::Rigid);
        let straight = server.create("straight", scene()).await;
        let permuted = server.create("permuted", scene()).await;
        let order = [3, 7, 0, 6, 1, 5, 2, 4];
        let labels: Vec<_> = order.iter().map(|i| format!("p{i}")).collect();
        let mut one = straight.source().await;
        let mut other = permuted.source_in_order(&labels).await.unwrap();
        for i in 1..=10 {
            let (pose, flag) = (pose(8, i), |point: usize| u8::from(point == 5));
            one.send_flagged(&pose, &std::array::from_fn::<_, 8, _>(flag))
                .await;
            let shuffled = order.map(|point| pose[point]);
            other.send_flagged(&shuffled, &order.map(flag)).await;
        }
        one.acked(10).await.unwrap();
        other.acked(10).await.unwrap();
        let expected = straight.step(10).await.unwrap();
        assert_eq!(permuted.step(10).await.unwrap(), expected);
    });
}

#[test]
fn an_occluded_point_goes_with_the_others_and_so_does_what_it_alone_drives() {
    live(async {
        let server = TestServer::start().await;
        let mut scene = scenes::small();
        // Each vertex follows its nearest point alone.
        let keep = v1::KeepK { k: 1 };
        scene.mapping.as_mut().unwrap().filter = Some(v1::Filter {
            kind: Some(v1::filter::Kind::Keep(keep)),
        });
        let session = server.create("tissue", scene).await;
        let mut watcher = session.watch().await;
        watcher.keyframe().await;
        let rest = vertices(watcher.last());
        let mut source = session.source().await;
        session.run().await.unwrap();

        let carried = |i: u32| [0.01 * f64::from(i), 0.0, -0.005 * f64::from(i)];
        let moved = |places: &[[f64; 3]], i: u32| -> Vec<[f64; 3]> {
            let by = carried(i);
            let add = |p: &[f64; 3]| std::array::from_fn(|k| p[k] + by[k]);
            places.iter().map(add).collect()
        };
        let lost = 3;
        for i in 1..200 {
            let truth = moved(&scenes::rest(8), i);
            let mut seen = truth.clone();
            // Whatever stands in its place, the origin first of all, is ignored.
            let nonsense = [[0.0; 3], [f64::NAN; 3], [f64::INFINITY, -1e300, 0.0]];
            // By then it is known that all go together.
            let hidden = (120..180).contains(&i);
            if hidden {
                seen[lost] = nonsense[i as usize % 3];
            }
            let flags: [u8; 8] = std::array::from_fn(|p| u8::from(hidden && p == lost));
            source.send_flagged(&seen, &flags).await;
            let frame = watcher.frame().await;
            assert_eq!(frame.point_states[lost] != VALID, (120..189).contains(&i));
            let others = (0..8).filter(|p| *p != lost);
            assert!(others.into_iter().all(|p| frame.point_states[p] == VALID));
            let points = frame.points.as_ref().unwrap().unpack().unwrap();
            close(points.as_chunks::<3>().0, &truth);
            close(&vertices(&frame), &moved(&rest, i));
        }
    });
}

/// Whether places agree to what single precision keeps of them.
fn close(found: &[[f64; 3]], expected: &[[f64; 3]]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
    }
}

#[test]
fn what_is_occluded_or_unlabelled_drives_nothing_and_what_is_filled_in_does() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut watcher = session.watch().await;
        watcher.keyframe().await;
        let mut source = session.source().await;
        session.run().await.unwrap();
        source
            .send_flagged(&pose(8, 1), &[0, 1, 2, 3, 4, 8, 12, 0xF0])
            .await;
        let frame = watcher.frame().await;
        assert_eq!(
            &frame.point_states[..],
            [VALID, LOST, LOST, LOST, VALID, VALID, VALID, VALID]
        );
    });
}

#[test]
fn a_point_absent_at_rest_drives_nothing_wherever_it_goes() {
    live(async {
        let server = TestServer::start().await;
        let mut scene = scenes::small();
        scenes::points(&mut scene).absent = Some(Indices::pack(&[2, 5]));
        // Its rest position is ignored, even where it is none.
        let mut rest = scenes::rest(8);
        rest[2] = [f64::NAN; 3];
        scenes::points(&mut scene).rest_positions = Some(scenes::reals(rest.as_flattened()));
        let near = server.create("near", scene.clone()).await;
        let far = server.create("far", scene).await;
        let (mut of_near, mut of_far) = (near.watch().await, far.watch().await);
        let states = [VALID, VALID, ABSENT, VALID, VALID, ABSENT, VALID, VALID];
        assert_eq!(
            of_near.keyframe().await.frame.unwrap().point_states,
            &states[..]
        );
        of_far.keyframe().await;
        let (mut to_near, mut to_far) = (near.source().await, far.source().await);
        near.run().await.unwrap();
        far.run().await.unwrap();
        to_near.send(&pose(8, 1)).await;
        let mut away = pose(8, 1);
        away[2] = [1e6; 3];
        away[5] = [-1e6; 3];
        to_far.send(&away).await;
        let (found, expected) = (of_far.frame().await, of_near.frame().await);
        assert_eq!(vertices(&found), vertices(&expected));
        assert_eq!(&found.point_states[..], states);
    });
}

#[test]
fn steps_of_queued_frames_and_a_run_lead_to_the_same_state() {
    live(async {
        let server = TestServer::start().await;
        let scene = || scenes::block(8, 2, Rule::Rigid);
        let stepped = server.create("stepped", scene()).await;
        let mut source = stepped.source().await;
        for i in 1..=30 {
            source.send(&pose(8, i)).await;
        }
        source.acked(30).await.unwrap();
        assert_eq!(stepped.get().await.unwrap().step, 0);
        let expected = stepped.step(30).await.unwrap();

        let running = server.create("running", scene()).await;
        running.run().await.unwrap();
        let mut watcher = running.watch().await;
        let mut source = running.source().await;
        for i in 1..=30 {
            source.send(&pose(8, i)).await;
        }
        watcher.until(30).await;
        let found = running.get().await.unwrap();
        assert_eq!((found.step, found.digest), (30, expected.digest));
    });
}

#[test]
fn more_steps_than_frames_that_wait_are_refused_and_none_is_taken() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        refused(
            session.step(1).await,
            Code::FailedPrecondition,
            "MOTION_STARVED",
        );
        let mut source = session.source().await;
        source.send(&pose(8, 1)).await;
        source.acked(1).await.unwrap();
        let before = session.digest().await;
        refused(
            session.step(2).await,
            Code::FailedPrecondition,
            "MOTION_STARVED",
        );
        assert_eq!(session.digest().await, before);
        assert_eq!(session.step(1).await.unwrap().step, 1);
    });
}

#[test]
fn a_second_source_is_refused_until_the_first_has_ended() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let first = session.source().await;
        let second = session.source_in_order(&[]).await;
        refused(second, Code::FailedPrecondition, "MOTION_SOURCE_BUSY");
        first.close().await.unwrap();
        // A new stream starts over: its sequences are its own.
        let mut third = session.source().await;
        third.send(&pose(8, 1)).await;
        third.acked(1).await.unwrap();
    });
}

#[test]
fn a_source_that_leaves_without_a_word_makes_room_for_another() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let leaver = session.source().await;
        drop(leaver);
        source_when_free(&session).await.close().await.unwrap();

        // So does one whose frames find no place.
        let mut leaver = session.source().await;
        let room = u64::from(leaver.accepted.queue_capacity);
        for i in 1..=room + 1 {
            leaver.send(&pose(8, i)).await;
        }
        let mut http = Http1::connect(server.address()).await;
        let received = format!("sinew_motion_frames_total {}\n", room + 1);
        while !http.get("/metrics").await.text().contains(&received) {}
        drop(leaver);
        source_when_free(&session).await.close().await.unwrap();
        // What was acknowledged is kept.
        session.step(u32::try_from(room).unwrap()).await.unwrap();
    });
}

/// A source, as soon as the server has heard that the one before left.
async fn source_when_free(session: &TestSession) -> Source {
    loop {
        match session.source_in_order(&[]).await {
            Ok(source) => return source,
            Err(refusal) => assert_eq!(refusal.reason, "MOTION_SOURCE_BUSY"),
        }
    }
}

#[test]
fn a_full_queue_holds_the_source_back_and_loses_nothing() {
    const FRAMES: u64 = 500;
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut source = session.source().await;
        let room = u64::from(source.accepted.queue_capacity);
        assert!(room < FRAMES);
        // The queue's room is acknowledged, and no more while the session is paused.
        for i in 1..=room {
            source.send(&pose(8, i)).await;
        }
        source.acked(room).await.unwrap();

        let session_of_sender = session.clone();
        let sender = tokio::spawn(async move {
            for i in room + 1..=FRAMES {
                source.send(&pose(8, i)).await;
            }
            source.acked(FRAMES).await.unwrap();
            source.close().await.unwrap();
            session_of_sender
        });
        let stepped = session.step(u32::try_from(room).unwrap()).await.unwrap();
        assert_eq!(stepped.step, room);
        let mut watcher = session.watch().await;
        session.run().await.unwrap();
        let mut last = 0;
        while last < FRAMES {
            let frame = watcher.positions().await.unwrap().unwrap();
            // Taken in order, one step for each, whatever this reader missed.
            assert_eq!(frame.motion_sequence, Some(frame.step));
            last = frame.step;
        }
        let session = sender.await.unwrap();
        assert_eq!(session.get().await.unwrap().step, FRAMES);

        // The same frames, one by one, give the same state.
        let calm = server.create("calm", scenes::small()).await;
        calm.run().await.unwrap();
        let mut watcher = calm.watch().await;
        let mut source = calm.source().await;
        for i in 1..=FRAMES {
            source.send(&pose(8, i)).await;
            watcher.until(i).await;
        }
        assert_eq!(calm.digest().await, session.digest().await);
    });
}

#[test]
fn a_source_that_is_held_back_holds_back_nothing_else_on_its_connection() {
    const FRAMES: u32 = 600;
    live(async {
        let server = TestServer::start().await;
        let session = server
            .create("tissue", scenes::block(40, 2, Rule::Mean))
            .await;
        let mut source = session.source().await;
        // About 600 KB, far more than a stream may send ahead.
        let sender = tokio::spawn(async move {
            for i in 1..=FRAMES {
                source.send(&pose(40, i.into())).await;
            }
            source.close().await.unwrap();
        });
        let mut step = 0;
        while step < u64::from(FRAMES) {
            match session.step(1).await {
                Ok(stepped) => step = stepped.step,
                Err(refusal) => assert_eq!(refusal.reason, "MOTION_STARVED"),
            }
        }
        sender.await.unwrap();
    });
}

#[test]
fn motion_waits_through_a_pause() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut watcher = session.watch().await;
        let mut source = session.source().await;
        session.run().await.unwrap();
        source.send(&pose(8, 1)).await;
        watcher.until(1).await;
        session.pause().await.unwrap();
        source.send(&pose(8, 2)).await;
        source.acked(2).await.unwrap();
        assert_eq!(session.get().await.unwrap().step, 1);
        session.run().await.unwrap();
        assert_eq!(watcher.until(2).await.motion_sequence, Some(2));
    });
}

#[test]
fn a_session_that_makes_its_own_motion_takes_no_positions() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let mut source = session.source_in_order(&[]).await.unwrap();
        source.send(&scenes::rest(9)).await;
        let answer = source.ending().await;
        refused(answer, Code::FailedPrecondition, "MOTION_NOT_EXTERNAL");
        let live = v1::Hello {
            delivery: v1::Delivery::Live.into(),
            ..v1::Hello::default()
        };
        let answer = session.source_by(live).await;
        refused(answer, Code::FailedPrecondition, "MOTION_NOT_EXTERNAL");
    });
}

#[test]
fn a_stream_of_motion_ends_with_its_session() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut source = session.source().await;
        session.delete().await.unwrap();
        refused(source.ending().await, Code::Aborted, "SESSION_ENDED");
    });
}
