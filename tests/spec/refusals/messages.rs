//! Bytes that are no messages, messages that are too large, and deadlines.

use bytes::Bytes;
use prost::Message as _;
use sinew_proto::v1::{
    CreateSessionRequest, StreamMotionRequest, StreamMotionResponse, UploadAssetRequest,
    stream_motion_request, stream_motion_response, upload_asset_request,
};
use sinew_tests::{hello, live, refused, scenes as posted, wire};
use tonic::Code;

use super::Witness;

const METHODS: [&str; 10] = [
    "sinew.v1.SessionService/CreateSession",
    "sinew.v1.SessionService/GetSession",
    "sinew.v1.SessionService/ListSessions",
    "sinew.v1.SessionService/DeleteSession",
    "sinew.v1.SessionService/Run",
    "sinew.v1.SessionService/Pause",
    "sinew.v1.SessionService/Step",
    "sinew.v1.MeshService/Subscribe",
    "sinew.v1.MotionService/StreamMotion",
    "sinew.v1.AssetService/UploadAsset",
];

/// 150 groups, each within the one before, in a field that no message has.
fn deep() -> Vec<u8> {
    const FIELD: u32 = 1000;
    let mut bytes = Vec::new();
    for wire_type in [3, 4] {
        for _ in 0..150 {
            prost::encoding::encode_varint(u64::from(FIELD << 3 | wire_type), &mut bytes);
        }
    }
    bytes
}

/// A good request for a session, without its last bytes.
fn truncated() -> Vec<u8> {
    let request = posted::creation(posted::small()).encode_to_vec();
    request[..request.len() - 5].to_vec()
}

#[test]
fn every_method_refuses_what_is_no_message() {
    live(async {
        let witness = Witness::start().await;
        let address = witness.server.address();
        for method in METHODS {
            for (what, bytes) in [
                ("garbage", vec![0xFF; 64]),
                ("a field of wire type 7", vec![0x0F, 1]),
                ("a length beyond the end", vec![0x0A, 100, 1, 2, 3]),
                ("text that is no UTF-8", vec![0x0A, 2, 0xC3, 0x28]),
                ("150 levels", deep()),
            ] {
                let answer = wire::call(address, method, &[], wire::framed(&bytes)).await;
                let Err(refusal) = answer else {
                    panic!("{method} takes {what}");
                };
                let found = (refusal.code, refusal.reason.as_str());
                assert_eq!(
                    found,
                    (Code::InvalidArgument, "MESSAGE_GARBLED"),
                    "{method}, {what}"
                );
                witness.nothing_changed(what).await;
            }
        }
    });
}

#[test]
fn a_truncated_request_is_refused() {
    live(async {
        let witness = Witness::start().await;
        let (address, method) = (witness.server.address(), METHODS[0]);
        let whole = wire::framed(&truncated());
        // The frame may end where the message does, or claim what never comes.
        let cut = wire::claimed(&truncated(), truncated().len() + 5);
        for body in [whole, cut] {
            let answer = wire::call(address, method, &[], body).await;
            refused(answer, Code::InvalidArgument, "MESSAGE_GARBLED");
            witness.nothing_changed("a truncated request").await;
        }
    });
}

#[test]
fn a_message_over_the_limit_is_refused() {
    live(async {
        let witness = Witness::start().await;
        let large = CreateSessionRequest {
            request_id: "r".repeat(5 << 20),
            ..CreateSessionRequest::default()
        };
        let answer = witness.server.try_create(large).await;
        refused(answer, Code::ResourceExhausted, "MESSAGE_TOO_LARGE");
        witness.nothing_changed("a large request").await;

        // The claim alone is enough, and takes no memory.
        for method in METHODS {
            let claim = wire::claimed(&[0; 10], u32::MAX as usize);
            let answer = wire::call(witness.server.address(), method, &[], claim).await;
            refused(answer, Code::ResourceExhausted, "MESSAGE_TOO_LARGE");
            witness.nothing_changed(method).await;
        }
    });
}

#[test]
fn a_stream_that_begins_well_is_refused_where_it_goes_wrong() {
    live(async {
        let witness = Witness::start().await;
        let opening = StreamMotionRequest {
            item: Some(hello(&witness.session.name, &[])),
        };
        let header = UploadAssetRequest {
            item: Some(upload_asset_request::Item::Header(Default::default())),
        };
        for (method, first) in [
            (METHODS[8], opening.encode_to_vec()),
            (METHODS[9], header.encode_to_vec()),
        ] {
            let first = wire::framed(&first);
            for (rest, code, reason) in [
                (
                    wire::framed(&[0xFF; 9]),
                    Code::InvalidArgument,
                    "MESSAGE_GARBLED",
                ),
                (
                    wire::framed(&deep()),
                    Code::InvalidArgument,
                    "MESSAGE_GARBLED",
                ),
                (
                    wire::claimed(&[], 5 << 20),
                    Code::ResourceExhausted,
                    "MESSAGE_TOO_LARGE",
                ),
            ] {
                let body = Bytes::from([&first[..], &rest[..]].concat());
                let answer = wire::call(witness.server.address(), method, &[], body).await;
                refused(answer, code, reason);
                witness.nothing_changed(reason).await;
            }
        }
    });
}

#[test]
fn the_hello_is_answered_first_however_fast_frames_follow_it() {
    live(async {
        let witness = Witness::start().await;
        let mut source = witness.session.source().await;
        let mut body = Vec::new();
        let mut say = |item: stream_motion_request::Item| {
            let item = Some(item);
            body.extend_from_slice(&wire::framed(&StreamMotionRequest { item }.encode_to_vec()));
        };
        say(hello(&witness.session.name, &[]));
        source.sequence = 1;
        say(source.frame(1, &posted::rest(8), &[]));
        source.close().await.unwrap();
        let body = Bytes::from(body);
        for _ in 0..50 {
            let answer = wire::call(witness.server.address(), METHODS[8], &[], body.clone());
            let answer = answer.await.unwrap();
            let length = u32::from_be_bytes(answer[1..5].try_into().unwrap()) as usize;
            let first = StreamMotionResponse::decode(&answer[5..5 + length]).unwrap();
            let accepted = matches!(first.item, Some(stream_motion_response::Item::Accepted(_)));
            assert!(accepted, "{first:?} came first");
            witness.session.step(1).await.unwrap();
        }
    });
}

#[test]
fn deadlines_that_are_none_and_deadlines_that_passed() {
    live(async {
        let witness = Witness::start().await;
        let request = posted::creation(posted::block(40, 20, posted::Rule::Rigid));
        let body = wire::framed(&request.encode_to_vec());
        let create = async |deadline: &str| {
            let headers = [("grpc-timeout", deadline)];
            wire::call(witness.server.address(), METHODS[0], &headers, body.clone()).await
        };
        for garbled in [
            "",
            "1",
            "S",
            "-1S",
            "1s",
            "1.5S",
            "123456789S",
            "0x1S",
            "1S1S",
            "é",
        ] {
            let refusal = refused(
                create(garbled).await,
                Code::InvalidArgument,
                "DEADLINE_GARBLED",
            );
            assert_eq!(refusal.field.as_deref(), Some("grpc-timeout"), "{garbled}");
            witness.nothing_changed(garbled).await;
        }
        for passed in ["0S", "1n", "99u"] {
            refused(
                create(passed).await,
                Code::DeadlineExceeded,
                "DEADLINE_EXCEEDED",
            );
            witness.nothing_changed(passed).await;
        }
        create("99999999H").await.unwrap();
    });
}
