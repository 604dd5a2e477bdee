//! What late and careful readers ask for.

use sinew_proto::v1::{Content, GetKeyframeRequest, ListEventsRequest, ListEventsResponse};
use sinew_tests::{Refusal, TestServer, live, scenes, scenes::Rule};
use tonic::Code;

#[test]
fn a_keyframe_asked_for_is_the_one_that_a_stream_begins_with() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        session.step(5).await.unwrap();
        let streamed = session.watch().await.keyframe().await;
        let request = GetKeyframeRequest {
            session: session.name.clone(),
            precision: session.subscription().precision,
            ..GetKeyframeRequest::default()
        };
        let asked = server.meshes().get_keyframe(request.clone()).await;
        let mut asked = asked.unwrap().into_inner();
        asked.frame.as_mut().unwrap().timing = streamed.frame.as_ref().unwrap().timing;
        assert_eq!(asked, streamed);

        let points = GetKeyframeRequest {
            content: Content::Points.into(),
            ..request
        };
        let points = server.meshes().get_keyframe(points).await.unwrap();
        assert_eq!(points.into_inner().grid, None);
    });
}

#[test]
fn a_keyframe_too_large_for_its_reader_is_refused_with_its_size() {
    live(async {
        let server = TestServer::start().await;
        let session = server
            .create("block", scenes::block(8, 20, Rule::Mean))
            .await;
        let mut request = GetKeyframeRequest {
            session: session.name.clone(),
            max_message_bytes: 1 << 16,
            ..GetKeyframeRequest::default()
        };
        let status = server.meshes().get_keyframe(request.clone()).await;
        let refusal = Refusal::of(status.unwrap_err());
        assert_eq!(refusal.code, Code::ResourceExhausted);
        assert_eq!(refusal.reason, "MESSAGE_TOO_LARGE");
        request.max_message_bytes = 1 << 20;
        server.meshes().get_keyframe(request).await.unwrap();
    });
}

#[test]
fn a_session_to_which_nothing_happened_has_no_events() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        session.step(5).await.unwrap();
        let request = ListEventsRequest {
            session: session.name.clone(),
            ..ListEventsRequest::default()
        };
        let page = server.meshes().list_events(request.clone()).await.unwrap();
        assert_eq!(page.into_inner(), ListEventsResponse::default());

        let refused = |request: ListEventsRequest| {
            let mut meshes = server.meshes();
            async move { Refusal::of(meshes.list_events(request).await.unwrap_err()) }
        };
        let size = refused(ListEventsRequest {
            page_size: -1,
            ..request.clone()
        });
        let size = size.await;
        assert_eq!(
            (size.code, size.field.as_deref()),
            (Code::InvalidArgument, Some("page_size"))
        );
        let token = refused(ListEventsRequest {
            page_token: "7".to_owned(),
            ..request.clone()
        });
        assert_eq!(token.await.reason, "PAGE_TOKEN_FORGED");
        let nobody = refused(ListEventsRequest {
            session: "sessions/nobody".to_owned(),
            ..request
        });
        assert_eq!(nobody.await.code, Code::NotFound);
    });
}
