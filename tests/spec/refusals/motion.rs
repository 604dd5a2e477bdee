//! Streams of motion.

use sinew_proto::v1::{MotionFrame, Reals, stream_motion_request::Item};
use sinew_tests::{Source, hello, live, refused, scenes as posted};
use tonic::Code;

use super::Witness;

#[test]
fn a_frame_before_the_hello() {
    live(async {
        let witness = Witness::start().await;
        let frame = Item::Frame(MotionFrame::default());
        let answer = Source::open(witness.server.motion(), frame).await;
        refused(answer, Code::InvalidArgument, "MOTION_HELLO_MISSING");
        witness.nothing_changed("a frame before the hello").await;
    });
}

#[test]
fn a_second_hello() {
    live(async {
        let witness = Witness::start().await;
        let mut source = witness.session.source().await;
        source.send_item(hello(&witness.session.name, &[])).await;
        refused(
            source.ending().await,
            Code::InvalidArgument,
            "MOTION_HELLO_REPEATED",
        );
        witness.nothing_changed("a second hello").await;
    });
}

#[test]
fn labels_that_do_not_name_every_point_once() {
    let labels = |change: fn(&mut Vec<String>)| {
        let mut labels = posted::labels(8);
        change(&mut labels);
        labels
    };
    let cases = [
        (
            labels(|l| l[2] = "p8".to_owned()),
            "LABEL_UNKNOWN",
            "hello.labels[2]",
        ),
        (
            labels(|l| l[7] = "p0".to_owned()),
            "LABEL_DUPLICATE",
            "hello.labels[7]",
        ),
        (labels(|l| l.truncate(7)), "LABEL_MISSING", "hello.labels"),
        (
            labels(|l| l.push("p8".to_owned())),
            "LABEL_UNKNOWN",
            "hello.labels[8]",
        ),
    ];
    live(async {
        let witness = Witness::start().await;
        for (labels, reason, field) in cases {
            let answer = witness.session.source_in_order(&labels).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            assert_eq!(refusal.field.as_deref(), Some(field));
            witness.nothing_changed(reason).await;
        }
    });
}

/// A good frame.
fn frame() -> MotionFrame {
    MotionFrame {
        sequence: 7,
        capture_time_seconds: 7.0,
        positions: Some(posted::reals(posted::rest(8).as_flattened())),
        flags: vec![0; 8].into(),
        source_sequence: None,
        drags: Vec::new(),
    }
}

fn place(frame: &mut MotionFrame, point: usize, value: f64) {
    let mut positions = posted::rest(8);
    positions[point][2] = value;
    frame.positions = Some(posted::reals(positions.as_flattened()));
}

#[test]
fn frames_that_are_none() {
    type Case = (fn(&mut MotionFrame), &'static str, &'static str);
    let cases: [Case; 10] = [
        (
            |f| f.positions = Some(posted::reals(&[0.0; 21])),
            "MOTION_WRONG_LENGTH",
            "frame.positions",
        ),
        (
            |f| f.positions = None,
            "MOTION_WRONG_LENGTH",
            "frame.positions",
        ),
        (
            |f| f.positions = Some(posted::reals(&[0.0; 23])),
            "LENGTH_MISMATCH",
            "frame.positions",
        ),
        (
            |f| f.flags = vec![0; 7].into(),
            "MOTION_WRONG_LENGTH",
            "frame.flags",
        ),
        (
            |f| place(f, 3, f64::NAN),
            "VALUE_NOT_FINITE",
            "frame.positions[3]",
        ),
        (
            |f| place(f, 0, f64::NEG_INFINITY),
            "VALUE_NOT_FINITE",
            "frame.positions[0]",
        ),
        (
            |f| place(f, 7, 1e300),
            "VALUE_NOT_FINITE",
            "frame.positions[7]",
        ),
        (
            |f| f.capture_time_seconds = f64::NAN,
            "VALUE_NOT_FINITE",
            "frame.capture_time_seconds",
        ),
        (
            |f| f.capture_time_seconds = f64::INFINITY,
            "VALUE_NOT_FINITE",
            "frame.capture_time_seconds",
        ),
        (
            |f| {
                f.positions = Some(Reals {
                    values: vec![0.0; 24],
                    ..posted::reals(&[0.0; 24])
                });
            },
            "COLUMN_GARBLED",
            "frame.positions",
        ),
    ];
    live(async {
        let witness = Witness::start().await;
        for (change, reason, field) in cases {
            let mut source = witness.session.source().await;
            let mut frame = frame();
            change(&mut frame);
            source.send_item(Item::Frame(frame)).await;
            let refusal = refused(source.ending().await, Code::InvalidArgument, reason);
            assert_eq!(refusal.field.as_deref(), Some(field));
            witness.nothing_changed(field).await;
        }
    });
}

#[test]
fn frames_that_go_backwards() {
    live(async {
        let witness = Witness::start().await;
        for (sequence, time) in [(6, 8.0), (0, 8.0), (8, 6.999)] {
            let mut source = witness.session.source().await;
            source.send_item(Item::Frame(frame())).await;
            source.acked(7).await.unwrap();
            let after = MotionFrame {
                sequence,
                capture_time_seconds: time,
                ..frame()
            };
            source.send_item(Item::Frame(after)).await;
            refused(
                source.ending().await,
                Code::FailedPrecondition,
                "MOTION_BACKWARDS",
            );
            witness.nothing_changed("a frame backwards").await;
        }
        // The three good frames before them have their places still.
        witness.session.step(3).await.unwrap();
    });
}

#[test]
fn what_came_before_a_bad_frame_is_kept() {
    live(async {
        let witness = Witness::start().await;
        let mut source = witness.session.source().await;
        for _ in 0..5 {
            source.send(&posted::rest(8)).await;
        }
        source.send(&posted::rest(7)).await;
        let refusal = refused(
            source.ending().await,
            Code::InvalidArgument,
            "MOTION_WRONG_LENGTH",
        );
        assert_eq!(refusal.field.as_deref(), Some("frame.positions"));
        assert_eq!(witness.session.step(5).await.unwrap().step, 6);
    });
}
