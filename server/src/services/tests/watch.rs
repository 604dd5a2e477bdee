//! Credits and modes.

use futures::channel::mpsc;
use sinew_client::{ClientError, Update};
use sinew_proto::v1::{
    self, SubscribeResponse, WatchMode, WatchOpen, WatchRequest,
    mesh_service_client::MeshServiceClient, subscribe_response::Item, watch_request,
};
use tonic::Streaming;
use tonic_types::StatusExt as _;

use super::{
    live,
    script::{NAME, Script, assert_mirrored},
};

/// A reader that gives credit as it likes.
struct Hand {
    asks: mpsc::Sender<WatchRequest>,
    items: Streaming<SubscribeResponse>,
}

impl Hand {
    async fn open(script: &Script, mode: WatchMode) -> Self {
        let (mut asks, requests) = mpsc::channel(8);
        let open = WatchOpen {
            subscription: Some(script.subscription()),
            mode: mode.into(),
        };
        let open = watch_request::Item::Open(open);
        asks.try_send(WatchRequest { item: Some(open) }).unwrap();
        let url = format!("http://{}", script.server.address());
        let mut client = MeshServiceClient::connect(url).await.unwrap();
        let items = client.watch(requests).await.unwrap().into_inner();
        Self { asks, items }
    }

    fn ask(&mut self, item: watch_request::Item) {
        let request = WatchRequest { item: Some(item) };
        self.asks.try_send(request).unwrap();
    }

    fn credit(&mut self, frames: u32) {
        self.ask(watch_request::Item::Credit(v1::Credit { frames }));
    }

    async fn item(&mut self) -> Item {
        self.items.message().await.unwrap().unwrap().item.unwrap()
    }

    /// The step of the next item, which has positions.
    async fn step(&mut self) -> u64 {
        match self.item().await {
            Item::Keyframe(keyframe) => keyframe.frame.unwrap().step,
            Item::Frame(frame) => frame.step,
            other @ (Item::Patch(_) | Item::Events(_) | Item::Goodbye(_) | Item::Chunk(_)) => {
                panic!("positions were expected, {other:?} came")
            }
        }
    }

    async fn refusal(&mut self) -> String {
        let status = self.items.message().await.unwrap_err();
        status
            .get_error_details()
            .error_info()
            .unwrap()
            .reason
            .clone()
    }
}

#[test]
fn without_credit_three_frames_come_and_events_go_on() {
    live(async {
        let mut script = Script::start(3).await;
        let mut hand = Hand::open(&script, WatchMode::Latest).await;
        assert_eq!(hand.step().await, 0);
        for step in [1, 2] {
            script.step();
            assert_eq!(hand.step().await, step);
        }
        // No credit is left: of this step its event comes, and of the next ones.
        for sequence in 1..=3 {
            script.tear(1);
            let Item::Events(events) = hand.item().await else {
                panic!("an event was expected");
            };
            assert_eq!(events.events[0].sequence, sequence);
        }
        script.step();
        hand.credit(2);
        // Of all that happened meanwhile: how the mesh came to be what it is, and its newest positions. Step and credit go
        // different ways: where the credit is first, the last patch has positions too.
        for version in 1..=3 {
            let Item::Patch(patch) = hand.item().await else {
                panic!("a patch was expected");
            };
            assert_eq!(patch.to_version, version);
            assert!(version == 3 || patch.frame.unwrap().vertices.is_none());
        }
        assert_eq!(hand.step().await, 6);
    });
}

/// A minute of steps at 100 Hz, each of which is published without waiting for anybody.
#[test]
fn who_reads_nothing_for_a_minute_loses_frames_and_never_an_event() {
    live(async {
        let mut script = Script::start(3).await;
        let watched = script
            .client
            .watch(script.subscription(), WatchMode::Latest);
        let mut watch = watched.await.unwrap();
        let mut subscription = script.subscribe().await;
        let whole = script.whole();
        for step in 0..6_000 {
            match step % 300 {
                0 if script.whole() > 0 => script.tear(1),
                _ => script.step(),
            }
        }
        let mut sequences = Vec::new();
        while watch.subscription().mirror().shown() != Some(script.frame.step + 1) {
            if let Some(Update::Events(events)) = watch.next().await.unwrap() {
                sequences.extend(events.iter().map(|event| event.sequence));
            }
        }
        let all: Vec<u64> = (1..=script.last_event()).collect();
        assert!(all.len() >= whole);
        assert_eq!(sequences, all);
        assert!(watch.subscription().counts().missed > 5_000);
        assert_mirrored(watch.subscription(), &script);
        // One without credits has the transport's windows full of old frames, and misses the same.
        let updates = script.catch_up(&mut subscription).await;
        let events = updates.iter().flat_map(|update| match update {
            Update::Events(events) => events.as_slice(),
            Update::Keyframe(_) | Update::Frame(_) | Update::Patch(_) | Update::Goodbye(_) => &[],
        });
        assert!(events.map(|event| event.sequence).eq(all));
        assert!(subscription.counts().missed > 0);
        assert_mirrored(&subscription, &script);
    });
}

#[test]
fn a_resync_brings_a_keyframe() {
    live(async {
        let mut script = Script::start(2).await;
        let mut hand = Hand::open(&script, WatchMode::Latest).await;
        assert!(matches!(hand.item().await, Item::Keyframe(_)));
        hand.ask(watch_request::Item::Resync(v1::Resync {}));
        // The request and the step go different ways: one of the next frames is the keyframe.
        loop {
            script.step();
            hand.credit(1);
            if let Item::Keyframe(keyframe) = hand.item().await {
                assert_eq!(keyframe.frame.unwrap().step, script.frame.step);
                break;
            }
        }
    });
}

#[test]
fn lossless_gets_every_frame_or_hears_that_it_is_too_slow() {
    live(async {
        let mut script = Script::start(2).await;
        let watched = script
            .client
            .watch(script.subscription(), WatchMode::Lossless);
        let mut watch = watched.await.unwrap();
        watch.next().await.unwrap();
        for _ in 0..5 {
            for _ in 0..8 {
                script.step();
            }
            while watch.subscription().mirror().shown() != Some(script.frame.step + 1) {
                watch.next().await.unwrap();
            }
        }
        let counts = watch.subscription().counts();
        assert_eq!((counts.received, counts.missed), (41, 0));

        let mut hand = Hand::open(&script, WatchMode::Lossless).await;
        assert_eq!(hand.step().await, 40);
        script.tear(1);
        let mut steps = vec![40];
        let reason = loop {
            script.step();
            tokio::task::yield_now().await;
            if script.frame.step > 200 {
                // What it took before it was too slow comes first, in order.
                match hand.items.message().await {
                    Ok(message) => match message.unwrap().item.unwrap() {
                        Item::Frame(frame) => steps.push(frame.step),
                        Item::Patch(patch) => steps.push(patch.frame.unwrap().step),
                        Item::Events(_) => {}
                        other @ (Item::Keyframe(_) | Item::Goodbye(_) | Item::Chunk(_)) => {
                            panic!("{other:?}")
                        }
                    },
                    Err(status) => {
                        break status
                            .get_error_details()
                            .error_info()
                            .unwrap()
                            .reason
                            .clone();
                    }
                }
            }
        };
        assert_eq!(reason, "SUBSCRIBER_TOO_SLOW");
        assert!(
            steps.windows(2).all(|pair| pair[1] == pair[0] + 1),
            "{steps:?}"
        );

        // And goes on from the last event that it saw.
        let request = v1::SubscribeRequest {
            after_event: Some(0),
            ..script.subscription()
        };
        let again = script.client.watch(request, WatchMode::Lossless).await;
        let events = again.unwrap().next().await.unwrap();
        assert!(matches!(events, Some(Update::Events(_))));
    });
}

#[test]
fn a_reader_of_events_alone_gets_nothing_else() {
    live(async {
        let mut script = Script::start(4).await;
        let watched = script
            .client
            .watch(script.subscription(), WatchMode::EventsOnly);
        let mut watch = watched.await.unwrap();
        for _ in 0..10 {
            script.step();
            script.tear(1);
        }
        while watch.subscription().last_event() != Some(script.last_event()) {
            let update = watch.next().await.unwrap();
            assert!(matches!(update, Some(Update::Events(_))), "{update:?}");
        }
        script.client.delete_session(NAME).await.unwrap();
        let Some(Update::Goodbye(goodbye)) = watch.next().await.unwrap() else {
            panic!("a goodbye was expected");
        };
        assert_eq!(goodbye.last_event, script.last_event());
    });
}

#[test]
fn requests_out_of_order_or_range_are_refused() {
    live(async {
        let script = Script::start(1).await;
        let open = || {
            watch_request::Item::Open(WatchOpen {
                subscription: Some(script.subscription()),
                mode: WatchMode::EventsOnly.into(),
            })
        };
        let mut hand = Hand::open(&script, WatchMode::EventsOnly).await;
        hand.ask(open());
        assert_eq!(hand.refusal().await, "WATCH_OPEN_REPEATED");
        for frames in [0, 65] {
            let mut hand = Hand::open(&script, WatchMode::EventsOnly).await;
            hand.credit(frames);
            assert_eq!(hand.refusal().await, "VALUE_OUT_OF_RANGE");
        }
        let url = format!("http://{}", script.server.address());
        let mut client = MeshServiceClient::connect(url).await.unwrap();
        let resync = watch_request::Item::Resync(v1::Resync {});
        let first = futures::stream::iter([WatchRequest { item: Some(resync) }]);
        let status = client.watch(first).await.unwrap_err();
        let error = ClientError::from(status);
        assert_eq!(error.refusal().unwrap().reason, "WATCH_OPEN_MISSING");
    });
}
