//! What a source may say of itself and of its frames: units, axes, epochs, frames that come twice or out of order.

use sinew_proto::v1::{self, Axes, UpAxis, stream_motion_request::Item, stream_motion_response};
use sinew_tests::{TestServer, live, refused, scenes};
use tonic::Code;

fn pose(i: u64) -> Vec<[f64; 3]> {
    scenes::bent(8, i as f64 * 0.01)
}

#[test]
fn units_and_axes_are_converted_at_the_door() {
    // Where a source's axes lie in a world that has z up, and one that has y up.
    type Turn = fn([f64; 3]) -> [f64; 3];
    let cases: [(Axes, UpAxis, Turn); 9] = [
        (Axes::Unspecified, UpAxis::Y, |p| p),
        (Axes::ZUpRightHanded, UpAxis::Z, |p| p),
        (Axes::YUpRightHanded, UpAxis::Y, |p| p),
        // Up is up, x is x, and the third axis makes it right-handed.
        (Axes::YUpRightHanded, UpAxis::Z, |[x, y, z]| [x, z, -y]),
        (Axes::ZUpRightHanded, UpAxis::Y, |[x, y, z]| [x, -z, y]),
        (Axes::ZUpLeftHanded, UpAxis::Z, |[x, y, z]| [x, -y, z]),
        (Axes::YUpLeftHanded, UpAxis::Y, |[x, y, z]| [x, y, -z]),
        (Axes::YUpLeftHanded, UpAxis::Z, |[x, y, z]| [x, z, y]),
        (Axes::ZUpLeftHanded, UpAxis::Y, |[x, y, z]| [x, z, y]),
    ];
    live(async {
        let server = TestServer::start().await;
        for (i, (axes, up, source_of)) in cases.into_iter().enumerate() {
            for (unit, per_metre) in [(0.0, 1.0), (0.5, 2.0), (0.25, 4.0)] {
                let mut scene = scenes::small();
                scene.set_up(up);
                let plain = server.create("plain", scene.clone()).await;
                let turned = server.create("turned", scene).await;
                let hello = v1::Hello {
                    unit_metres: unit,
                    axes: axes.into(),
                    ..v1::Hello::default()
                };
                let mut to_plain = plain.source().await;
                let mut to_turned = turned.source_by(hello).await.unwrap();
                let expected = plain.step_to(&mut to_plain, &pose(1)).await;
                let seen: Vec<_> = pose(1)
                    .into_iter()
                    .map(|p| source_of(p).map(|x| x * per_metre))
                    .collect();
                let found = turned.step_to(&mut to_turned, &seen).await;
                assert_eq!(found, expected, "case {i}, unit {unit}");
                plain.delete().await.unwrap();
                turned.delete().await.unwrap();
            }
        }
    });
}

#[test]
fn a_hello_that_says_what_cannot_be_is_refused() {
    let hello = v1::Hello::default;
    let cases = [
        (
            v1::Hello {
                unit_metres: -1.0,
                ..hello()
            },
            "VALUE_OUT_OF_RANGE",
            "hello.unit_metres",
        ),
        (
            v1::Hello {
                unit_metres: f64::NAN,
                ..hello()
            },
            "VALUE_OUT_OF_RANGE",
            "hello.unit_metres",
        ),
        (
            v1::Hello {
                rate_hz: f64::INFINITY,
                ..hello()
            },
            "VALUE_OUT_OF_RANGE",
            "hello.rate_hz",
        ),
        (
            v1::Hello {
                rate_hz: 1e-3,
                ..hello()
            },
            "VALUE_OUT_OF_RANGE",
            "hello.rate_hz",
        ),
        (
            v1::Hello {
                axes: 77,
                ..hello()
            },
            "ENUM_UNKNOWN",
            "hello.axes",
        ),
        (
            v1::Hello {
                delivery: 77,
                ..hello()
            },
            "ENUM_UNKNOWN",
            "hello.delivery",
        ),
    ];
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        for (hello, reason, field) in cases {
            let refusal = refused(
                session.source_by(hello).await,
                Code::InvalidArgument,
                reason,
            );
            assert_eq!(refusal.field.as_deref(), Some(field));
        }
        // None of them took the place.
        session.source().await.close().await.unwrap();
    });
}

#[test]
fn a_source_of_a_higher_epoch_takes_over_and_one_of_a_lower_is_stale() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let of = |stream_epoch| v1::Hello {
            stream_epoch,
            ..v1::Hello::default()
        };
        let mut first = session.source_by(of(3)).await.unwrap();
        first.send(&pose(1)).await;
        first.acked(1).await.unwrap();
        for epoch in [0, 3] {
            refused(
                session.source_by(of(epoch)).await,
                Code::FailedPrecondition,
                "MOTION_SOURCE_BUSY",
            );
        }
        refused(
            session.source_by(of(2)).await,
            Code::FailedPrecondition,
            "MOTION_EPOCH_STALE",
        );
        let mut second = session.source_by(of(4)).await.unwrap();
        refused(first.ending().await, Code::Aborted, "MOTION_SUPERSEDED");
        // Its sequences are its own, and what the first was told to have its place has it.
        second.send(&pose(2)).await;
        second.acked(1).await.unwrap();
        session.step(2).await.unwrap();
        second.close().await.unwrap();
        refused(
            session.source_by(of(3)).await,
            Code::FailedPrecondition,
            "MOTION_EPOCH_STALE",
        );
        session
            .source_by(of(4))
            .await
            .unwrap()
            .close()
            .await
            .unwrap();
    });
}

#[test]
fn frames_out_of_order_or_twice_lead_to_the_same_state_as_long_as_they_wait() {
    live(async {
        let server = TestServer::start().await;
        let straight = server.create("straight", scenes::small()).await;
        let shuffled = server.create("shuffled", scenes::small()).await;
        let mut one = straight.source().await;
        for i in 1..=8 {
            one.send(&pose(i)).await;
        }
        one.acked(8).await.unwrap();
        let mut other = shuffled.source().await;
        for i in [2, 1, 4, 4, 3, 8, 5, 2, 7, 6, 8] {
            other.send_item(other.frame(i, &pose(i), &[])).await;
        }
        other.reached().await;
        let expected = straight.step(8).await.unwrap();
        assert_eq!(shuffled.step(8).await.unwrap(), expected);

        // What is late now is dropped, and what came twice is still known.
        for i in [12, 8, 11, 14, 13] {
            other.send_item(other.frame(i, &pose(i), &[])).await;
            other.acked(i).await.unwrap();
            if i == 12 {
                shuffled.step(1).await.unwrap();
            }
        }
        other.send_item(other.frame(15, &pose(15), &[])).await;
        let ack = other.ack_where(|ack| ack.sequence == 15).await.unwrap();
        assert_eq!(ack.duplicates, 4);
        other.reached().await;
        let expected = "more steps than the frames 13, 14 and 15";
        assert_eq!(shuffled.step(3).await.unwrap().step, 12, "{expected}");
        refused(
            shuffled.step(1).await,
            Code::FailedPrecondition,
            "MOTION_STARVED",
        );
        other.send_item(other.frame(16, &pose(16), &[])).await;
        let ack = other.ack_where(|ack| ack.sequence == 16).await.unwrap();
        assert_eq!((ack.late, ack.reordered), (1, 6), "{ack:?}");
    });
}

#[test]
fn a_frame_further_behind_than_any_disorder_comes_from_a_source_that_started_over() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        session.run().await.unwrap();
        let mut source = session.source().await;
        for i in 10..=74 {
            source.send_item(source.frame(i, &pose(i), &[])).await;
        }
        source.send_item(source.frame(9, &pose(9), &[])).await;
        refused(
            source.ending().await,
            Code::FailedPrecondition,
            "MOTION_BACKWARDS",
        );
    });
}

#[test]
fn a_ping_is_answered_by_the_sessions_clock_while_nothing_else_moves() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut source = session.source().await;
        let mut last = 0.0;
        for i in 0..5 {
            let sent_seconds = f64::from(i) * 7.0;
            let ping = v1::Ping {
                sent_seconds,
                returned_seconds: (i > 0).then_some(sent_seconds - 1.0),
            };
            source.send_item(Item::Ping(ping)).await;
            let pong = loop {
                if let Some(stream_motion_response::Item::Pong(pong)) = source.told().await.unwrap()
                {
                    break pong;
                }
            };
            assert_eq!(pong.sent_seconds, sent_seconds);
            assert!(last < pong.received_seconds && pong.received_seconds <= pong.answered_seconds);
            last = pong.answered_seconds;
        }
        let garbled = v1::Ping {
            sent_seconds: f64::NAN,
            ..v1::Ping::default()
        };
        source.send_item(Item::Ping(garbled)).await;
        let refusal = refused(
            source.ending().await,
            Code::InvalidArgument,
            "VALUE_NOT_FINITE",
        );
        assert_eq!(refusal.field.as_deref(), Some("ping.sent_seconds"));
    });
}
