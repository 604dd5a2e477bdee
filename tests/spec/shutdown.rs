//! A server that is told to stop.

use http_body_util::BodyExt as _;
use sinew_proto::v1::GoodbyeReason;
use sinew_server::Stopped;
use sinew_tests::{
    TestServer, live, refused, scenes,
    scenes::Rule,
    wire::{self, Http1},
};
use tonic::Code;
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};

#[test]
fn every_stream_gets_its_last_item_and_a_goodbye() {
    live(async {
        let server = TestServer::start().await;
        let driven = server.create("driven", scenes::small()).await;
        let mut source = driven.source().await;
        let mut of_driven = driven.watch().await;
        driven.run().await.unwrap();
        source.send(&scenes::rest(8)).await;
        of_driven.until(1).await;

        let busy = server.create("busy", scenes::sheet(8)).await;
        let mut of_busy = busy.watch().await;
        busy.run().await.unwrap();
        of_busy.until(20).await;

        let stopping = tokio::spawn(server.shutdown());
        for watcher in [&mut of_driven, &mut of_busy] {
            let goodbye = watcher.goodbye().await;
            assert_eq!(goodbye.reason(), GoodbyeReason::Shutdown);
            assert_eq!(watcher.last().sequence, goodbye.last_sequence);
        }
        refused(source.ending().await, Code::Aborted, "SESSION_ENDED");
        assert_eq!(stopping.await.unwrap(), Stopped::Drained);
    });
}

#[test]
fn while_streams_end_the_server_says_that_it_is_not_ready() {
    live(async {
        let server = TestServer::start().await;
        let address = server.address();
        let mut http = Http1::connect(address).await;
        assert_eq!(http.get("/readyz").await.status, 200);
        let mut health = HealthClient::new(server.channel());
        let whole = HealthCheckRequest::default();
        let mut health = health.watch(whole).await.unwrap().into_inner();
        let serving = health.message().await.unwrap().unwrap();
        assert_eq!(serving.status(), ServingStatus::Serving);

        // A reader that stalls holds the server in its grace period until it reads on: keyframe and frames fill
        // what lies between, so that there is no room for the goodbye.
        let session = server
            .create("large", scenes::block(8, 20, Rule::Mean))
            .await;
        let narrow = server.narrow_channel().await;
        let mut slow = session
            .subscribe_over(narrow, session.subscription())
            .await
            .unwrap();
        for _ in 0..4 {
            let source = session.source().await;
            source.send_and_close(&scenes::rest(8)).await;
            session.step(1).await.unwrap();
        }

        let stopping = tokio::spawn(server.shutdown());
        let stopped = health.message().await.unwrap().unwrap();
        assert_eq!(stopped.status(), ServingStatus::NotServing);
        while http.get("/readyz").await.status == 200 {}
        let page = http.get("/readyz").await;
        assert_eq!(
            (page.status.as_u16(), page.text()),
            (503, "shutting down\n")
        );
        assert_eq!(http.get("/healthz").await.status, 200);
        assert!(!stopping.is_finished());

        assert_eq!(slow.goodbye().await.reason(), GoodbyeReason::Shutdown);
        drop(slow);
        assert_eq!(stopping.await.unwrap(), Stopped::Drained);
        assert!(health.message().await.unwrap().is_none());
        assert!(http.try_get("/healthz").await.is_none());
    });
}

#[test]
fn a_reader_that_never_reads_holds_the_server_no_longer_than_its_grace() {
    live(async {
        let server = TestServer::with(|config| config.grace_seconds = 0.2).await;
        let session = server
            .create("large", scenes::block(8, 20, Rule::Mean))
            .await;
        let narrow = server.narrow_channel().await;
        let stalled = session
            .subscribe_over(narrow, session.subscription())
            .await
            .unwrap();
        assert_eq!(server.shutdown().await, Stopped::GraceExpired);
        drop(stalled);
    });
}

#[test]
fn a_server_with_nothing_to_do_stops_at_once() {
    live(async {
        let server = TestServer::with(|config| config.grace_seconds = 3600.0).await;
        server.create("idle", scenes::sheet(3)).await;
        assert_eq!(server.shutdown().await, Stopped::Drained);
    });
}

#[test]
fn an_open_viewer_holds_the_server_no_longer_than_a_subscriber_does() {
    live(async {
        let server = TestServer::start().await;
        server.create("tissue", scenes::small()).await;
        let feed = "rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages";
        let viewer = wire::open(server.address(), feed, wire::framed(&[])).await;
        let reading = tokio::spawn(viewer.collect());
        assert_eq!(server.shutdown().await, Stopped::Drained);
        assert!(!reading.await.unwrap().unwrap().to_bytes().is_empty());
    });
}
