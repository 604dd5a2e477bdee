//! Motion as it really arrives: resampled by capture time, through loss, disorder, occlusion, swaps and jumps. The
//! sessions are paused and stepped, so that no clock has a part in it.

use sinew_proto::v1::{
    self, Delivery, MotionFrame, PointState, record_motion_response, stream_motion_request::Item,
    stream_motion_response,
};
use sinew_tests::{Source, TestServer, TestSession, live, refused, scenes, vertices};
use tonic::Code;

use crate::tearing::brittle_within;

/// Points of the body.
const POINTS: usize = 24;
/// Of the source, Hz; steps are 10 ms.
const RATE: f64 = 120.0;

/// A rigid body that sways and turns: where its points are at a time, m.
fn truth(t: f64) -> Vec<[f64; 3]> {
    let (sin, cos) = (0.5 * (3.0 * t).sin()).sin_cos();
    let turned = |[x, y, z]: [f64; 3]| {
        [
            cos * x - sin * y + 0.5 * (2.0 * t).sin(),
            sin * x + cos * y + 0.2 * t,
            z + 0.1 * (3.0 * t).cos(),
        ]
    };
    scenes::rest(POINTS).into_iter().map(turned).collect()
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// By how much a straight line between two frames misses the motion, at most, m: h² a / 8, with the greatest
/// acceleration a of any point.
fn chord(frames_apart: f64) -> f64 {
    let h = 1e-3;
    let acceleration = (1..2000).flat_map(|i| {
        let t = f64::from(i) * h;
        let [before, now, after] = [t - h, t, t + h].map(truth);
        (0..POINTS).map(move |p| {
            let second: [f64; 3] =
                std::array::from_fn(|k| (before[p][k] - 2.0 * now[p][k] + after[p][k]) / (h * h));
            distance(&second, &[0.0; 3])
        })
    });
    (frames_apart / RATE).powi(2) / 8.0 * acceleration.fold(0.0, f64::max)
}

/// How far a point goes in half a frame, at most, m: by so much may a point be off that is seen in one of two frames only.
fn half_a_frame() -> f64 {
    let h = 1e-3;
    let speeds = (0..2000).flat_map(|i| {
        let t = f64::from(i) * h;
        let (now, next) = (truth(t), truth(t + h));
        (0..POINTS).map(move |p| distance(&now[p], &next[p]) / h)
    });
    speeds.fold(0.0, f64::max) / (2.0 * RATE)
}

/// A source's frame that sees all.
fn clean(sequence: u64) -> Captured {
    let time = sequence as f64 / RATE;
    (sequence, time, truth(time), vec![0; POINTS])
}

/// Sequence, capture time, positions and flags.
type Captured = (u64, f64, Vec<[f64; 3]>, Vec<u8>);
type Script = Vec<Captured>;

fn script(frames: u64) -> Script {
    (1..=frames).map(clean).collect()
}

/// A number like any other, always the same.
fn chance(seed: u64) -> u64 {
    let mixed = (seed.wrapping_add(1)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed >> 32
}

/// Frames until it is known which points go together.
const LEARNT: u64 = 120;

/// Hides this share of the points from then on, each for a quarter of a second at a time; whatever stands there is
/// nonsense.
fn hide(script: &mut Script, share: f64, flag: u8) {
    for (sequence, _, positions, flags) in script.iter_mut().filter(|frame| frame.0 > LEARNT) {
        let turn = *sequence / 30;
        for point in 0..POINTS {
            if (((point as u64 * 5 + turn * 3) % POINTS as u64) as f64) < share * POINTS as f64 {
                flags[point] = flag;
                positions[point] = [[0.0; 3], [f64::NAN; 3], [1e9, 0.0, -1e9]][point % 3];
            }
        }
    }
}

fn hello(stream_epoch: u64) -> v1::Hello {
    v1::Hello {
        stream_epoch,
        rate_hz: RATE,
        delivery: Delivery::Live.into(),
        ..v1::Hello::default()
    }
}

fn item((sequence, time, positions, flags): &Captured) -> Item {
    Item::Frame(MotionFrame {
        sequence: *sequence,
        capture_time_seconds: *time,
        positions: Some(scenes::reals(positions.as_flattened())),
        flags: flags.clone().into(),
        source_sequence: None,
        drags: Vec::new(),
    })
}

/// Sends frames in this order, and steps as far as they reach each time that some have come.
async fn play(session: &TestSession, source: &mut Source, script: &Script) -> Vec<v1::Frame> {
    let mut watcher = session.watch().await;
    watcher.keyframe().await;
    let mut frames = Vec::new();
    for group in script.chunk_by(|a, b| (a.0 - 1) / 24 == (b.0 - 1) / 24) {
        for frame in group {
            source.send_item(item(frame)).await;
        }
        source.reached().await;
        loop {
            match session.step(1).await {
                Ok(stepped) => frames.push(watcher.until(stepped.step).await),
                Err(refusal) => {
                    assert_eq!(refusal.reason, "MOTION_STARVED");
                    break;
                }
            }
        }
    }
    frames
}

/// The greatest errors of points and vertices against the motion itself, m.
async fn errors(server: &TestServer, frames: &[v1::Frame]) -> (f64, f64) {
    let session = server
        .create("truth", scenes::block(POINTS, 2, scenes::Rule::Mean))
        .await;
    let mut watcher = session.watch().await;
    let mut source = session.source().await;
    let mut worst = (0.0_f64, 0.0_f64);
    for frame in frames {
        let truth = truth(frame.capture_time_seconds.unwrap());
        session.step_to(&mut source, &truth).await;
        let expected = watcher.until(session.get().await.unwrap().step).await;
        let points = frame.points.as_ref().unwrap().unpack().unwrap();
        let points = points.as_chunks::<3>().0.iter().zip(&truth);
        worst.0 = points.map(|(a, b)| distance(a, b)).fold(worst.0, f64::max);
        let (found, expected) = (vertices(frame), vertices(&expected));
        let pairs = found.iter().zip(&expected);
        worst.1 = pairs.map(|(a, b)| distance(a, b)).fold(worst.1, f64::max);
    }
    session.delete().await.unwrap();
    worst
}

/// Plays a script, prints its errors and holds them against a bound, m. The mesh tears where an edge grows by a fifth:
/// none of what sources do to their samples makes it.
fn holds(name: &str, script: &Script, bound: f64) -> Vec<v1::Frame> {
    live(async {
        let server = TestServer::start().await;
        let scene = brittle_within(scenes::block(POINTS, 2, scenes::Rule::Mean));
        let session = server.create("live", scene).await;
        let whole = session.get().await.unwrap().vertex_count;
        let mut source = session.source_by(hello(1)).await.unwrap();
        let frames = play(&session, &mut source, script).await;
        assert!(frames.len() > 80, "{} steps", frames.len());
        assert_eq!(
            session.get().await.unwrap().vertex_count,
            whole,
            "{name} tears"
        );
        let (points, vertices) = errors(&server, &frames).await;
        println!(
            "{name}: points within {:.3} mm, vertices within {:.3} mm; bound {:.3} mm",
            points * 1e3,
            vertices * 1e3,
            bound * 1e3
        );
        assert!(points < bound && vertices < bound, "{name}");
        frames
    })
}

fn doubted(frames: &[v1::Frame], reason: v1::DoubtReason) -> usize {
    let of = |frame: &v1::Frame| frame.point_doubts.iter().any(|d| d.reason() == reason);
    frames.iter().filter(|frame| of(frame)).count()
}

#[test]
fn steps_between_frames_are_on_the_lines_between_them() {
    let frames = holds("clean", &script(120), chord(1.0) + 1e-12);
    for (k, frame) in frames.iter().enumerate() {
        let expected = 1.0 / RATE + k as f64 * 0.01;
        assert!((frame.capture_time_seconds.unwrap() - expected).abs() < 1e-12);
    }
}

#[test]
fn disorder_and_doubles_change_nothing() {
    let straight = script(120);
    let mut shuffled: Vec<_> = straight.iter().enumerate().collect();
    // Within the groups that are sent at once, frames come up to eight places late, and some twice.
    shuffled.sort_by_key(|(i, _)| (i / 24, *i as u64 % 24 + chance(*i as u64) % 8));
    let twice = |(i, frame): (usize, &Captured)| {
        vec![frame.clone(); 1 + usize::from(chance(i as u64 + 999).is_multiple_of(5))]
    };
    let sent: Script = shuffled.into_iter().flat_map(twice).collect();
    assert!(sent.len() > 130);
    holds("disorder", &sent, chord(1.0) + 1e-12);
}

#[test]
fn single_frames_lost_leave_no_gap() {
    let mut script = script(120);
    script.retain(|(sequence, ..)| sequence % 5 != 3);
    let frames = holds("one in five lost", &script, chord(2.0) + 1e-12);
    for frame in frames {
        assert!(
            frame
                .point_states
                .iter()
                .all(|s| *s == PointState::Valid as u8)
        );
    }
}

#[test]
fn a_rate_that_changes_is_followed() {
    let mut script = script(160);
    script.retain(|(sequence, ..)| *sequence < 80 || sequence % 2 == 0);
    holds("120 Hz, then 60 Hz", &script, chord(2.0) + 1e-12);
}

#[test]
fn hidden_points_go_with_the_others_at_any_rate_of_occlusion() {
    for (share, flag) in [(0.2, 1), (0.4, 3), (0.6, 2)] {
        let mut script = script(LEARNT + 120);
        hide(&mut script, share, flag);
        // All points seen miss the motion by a chord in nearly the same direction, and so do those that they carry.
        let name = format!("{:.0} % occluded", share * 100.0);
        let bound = match share < 0.5 {
            true => 10.0 * chord(1.0),
            false => half_a_frame(), // few are left, and carry others far beyond themselves
        };
        let frames = holds(&name, &script, bound);
        for frame in frames {
            let hidden = |sequence: u64| {
                let mut at = vec![clean(sequence)];
                hide(&mut at, share, 1);
                at.remove(0).3
            };
            // Hidden in both frames around it.
            let before = frame.motion_sequence.unwrap();
            let both = hidden(before).into_iter().zip(hidden(before + 1));
            let both = both.map(|(a, b)| a & b);
            for (state, hidden) in frame.point_states.iter().zip(both) {
                assert!(hidden == 0 || *state != PointState::Valid as u8);
            }
        }
    }
}

/// The harshest: no point is seen for long, and few in two frames running.
#[test]
fn points_that_flicker_go_with_the_others() {
    for (percent, frames) in [(20, 1.0), (40, 4.0), (60, 10.0)] {
        let mut script = script(120);
        for (sequence, _, positions, flags) in &mut script {
            for point in 0..POINTS {
                if chance(*sequence * POINTS as u64 + point as u64) % 100 < percent {
                    flags[point] = 1;
                    positions[point] = [1e9; 3];
                }
            }
        }
        holds(
            &format!("{percent} % flicker"),
            &script,
            frames * half_a_frame(),
        );
    }
}

#[test]
fn a_marker_that_jumps_away_is_not_followed() {
    let mut script = script(120);
    for (_, _, positions, _) in &mut script[40..52] {
        positions[5][0] += 1.5;
        positions[11][2] -= 1.0;
    }
    let frames = holds("two markers jump for 0.1 s", &script, half_a_frame());
    assert!(doubted(&frames, v1::DoubtReason::Speed) >= 9);
}

#[test]
fn markers_under_each_others_names_are_told_apart() {
    let mut script = script(120);
    let rest = scenes::rest(POINTS);
    let far = (1..POINTS)
        .max_by(|a, b| distance(&rest[0], &rest[*a]).total_cmp(&distance(&rest[0], &rest[*b])));
    for (_, _, positions, _) in &mut script[50..] {
        positions.swap(0, far.unwrap());
    }
    let frames = holds("two markers swapped for good", &script, half_a_frame());
    assert!(doubted(&frames, v1::DoubtReason::Swap) >= 1);
}

#[test]
fn a_source_that_comes_back_is_followed_again() {
    live(async {
        let server = TestServer::start().await;
        let scene = scenes::block(POINTS, 2, scenes::Rule::Mean);
        let session = server.create("live", scene).await;
        let whole = script(200);
        let mut first = session.source_by(hello(1)).await.unwrap();
        let mut frames = play(&session, &mut first, &whole[..72].to_vec()).await;
        // It comes back with a higher epoch, before the first is known to be gone.
        let mut second = session.source_by(hello(2)).await.unwrap();
        refused(first.ending().await, Code::Aborted, "MOTION_SUPERSEDED");
        frames.extend(play(&session, &mut second, &whole[120..].to_vec()).await);
        let taken_back = frames
            .iter()
            .skip(72)
            .map(|f| f.capture_time_seconds.unwrap());
        assert!(taken_back.clone().count() > 40);
        // In between nothing was seen; afterwards no point is anywhere else than where it is seen.
        let settled: Vec<_> = frames
            .into_iter()
            .filter(|f| !(0.6..1.25).contains(&f.capture_time_seconds.unwrap()))
            .collect();
        let (points, vertices) = errors(&server, &settled).await;
        println!(
            "back after 0.4 s: {:.3} mm, {:.3} mm",
            points * 1e3,
            vertices * 1e3
        );
        assert!(points.max(vertices) < 10.0 * chord(1.0));
    });
}

#[test]
fn without_room_frames_are_refused_and_the_source_is_told() {
    live(async {
        let server = TestServer::start().await;
        let session = server
            .create("live", scenes::block(POINTS, 2, scenes::Rule::Mean))
            .await;
        let mut source = session.source_by(hello(1)).await.unwrap();
        for frame in script(130) {
            source.send_item(item(&frame)).await;
        }
        let (mut throttled, mut ack) = (false, v1::Ack::default());
        while !(throttled && ack.refused == 10) {
            match source.told().await.unwrap().unwrap() {
                stream_motion_response::Item::Throttle(_) => throttled = true,
                stream_motion_response::Item::Ack(newer) => ack = newer,
                stream_motion_response::Item::Accepted(_)
                | stream_motion_response::Item::Pong(_) => panic!("nobody asked"),
            }
        }
        assert_eq!(
            (ack.sequence, ack.late, ack.duplicates),
            (0, 0, 0),
            "a second of frames waits"
        );
        // What waits is played, one step after the other.
        session.step(90).await.unwrap();
        let ack = source.ack_where(|ack| ack.step == 90).await.unwrap();
        assert!((107..=109).contains(&ack.sequence), "{ack:?}");
    });
}

#[test]
fn a_record_leads_to_the_same_digest_without_any_clock() {
    live(async {
        let server = TestServer::start().await;
        let scene = || scenes::block(POINTS, 2, scenes::Rule::Mean);
        let session = server.create("live", scene()).await;
        let before = session.digest().await;
        let mut record = session.record().await.unwrap();
        let mut script = script(LEARNT + 60);
        hide(&mut script, 0.4, 1);
        script.retain(|(sequence, ..)| !(140..146).contains(sequence));
        let source = session.source_by(hello(1)).await.unwrap();
        // By the clock: how the moments fall is chance, and the record holds it.
        session.run().await.unwrap();
        // The source's clock shows 0 now, and its frames come long before they are captured.
        for returned_seconds in [None, Some(1e-3)] {
            let ping = v1::Ping {
                sent_seconds: 0.0,
                returned_seconds,
            };
            source.send_item(Item::Ping(ping)).await;
        }
        for frame in &script {
            source.send_item(item(frame)).await;
        }
        source.close().await.unwrap();
        session.pause().await.unwrap();
        let end = session.get().await.unwrap();
        // On a busy machine steps long overdue are skipped.
        assert!(end.step >= 20, "{}", end.step);

        let mut items = Vec::new();
        while items.len() as u64 <= end.step {
            items.push(record.message().await.unwrap().unwrap().item.unwrap());
        }
        let again = server.create("again", scene()).await;
        let record_motion_response::Item::Start(start) = items.remove(0) else {
            panic!("a record begins with its start");
        };
        assert_eq!((start.step, start.digest), (0, before));
        let mut source = again
            .source_by(v1::Hello {
                labels: start.labels,
                ..v1::Hello::default()
            })
            .await
            .unwrap();
        let mut digest = String::new();
        for item in items {
            let record_motion_response::Item::Frame(frame) = item else {
                panic!("a record has one start");
            };
            let sequence = frame.sequence;
            source.send_item(Item::Frame(frame)).await;
            source.acked(sequence).await.unwrap();
            digest = again.step(1).await.unwrap().digest;
        }
        assert_eq!(digest, end.digest);
        session.delete().await.unwrap();
        assert_eq!(
            record.message().await.unwrap(),
            None,
            "the record ends with the session"
        );
    });
}
