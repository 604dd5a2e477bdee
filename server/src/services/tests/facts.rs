//! Patches, events and keyframes, whoever reads them and however slowly.

use prost::Message as _;
use sinew_client::{ClientError, MeshMirror, Subscription, Update};
use sinew_engine::{Event, EventKind};
use sinew_proto::v1::{self, Content, event::Kind};

use super::{
    live,
    script::{NAME, Script, assert_mirrored},
};

/// The reason of a refusal.
fn reason(error: &ClientError) -> &str {
    &error.refusal().expect("the server refuses").reason
}

/// Sequences of the events among updates.
fn sequences(updates: &[Update]) -> Vec<u64> {
    let events = updates.iter().flat_map(|update| match update {
        Update::Events(events) => events.as_slice(),
        Update::Keyframe(_) | Update::Frame(_) | Update::Patch(_) | Update::Goodbye(_) => &[],
    });
    events.map(|event| event.sequence).collect()
}

fn patches(updates: &[Update]) -> Vec<&v1::TopologyPatch> {
    let patches = updates.iter().filter_map(|update| match update {
        Update::Patch(patch) => Some(patch),
        Update::Keyframe(_) | Update::Frame(_) | Update::Events(_) | Update::Goodbye(_) => None,
    });
    patches.collect()
}

fn keyframes(updates: &[Update]) -> usize {
    let is_keyframe = |update: &&Update| matches!(update, Update::Keyframe(_));
    updates.iter().filter(is_keyframe).count()
}

async fn opened(script: &Script) -> Subscription {
    let mut reader = script.subscribe().await;
    script.catch_up(&mut reader).await;
    assert_mirrored(&reader, script);
    reader
}

#[test]
fn a_reader_that_keeps_up_follows_every_change_without_another_keyframe() {
    live(async {
        let mut script = Script::start(3).await;
        let mut reader = opened(&script).await;
        while script.whole() > 0 {
            script.tear(1);
            let updates = script.catch_up(&mut reader).await;
            assert!(matches!(updates[..], [Update::Events(_), Update::Patch(_)]));
            assert_mirrored(&reader, &script);
            script.step();
            let updates = script.catch_up(&mut reader).await;
            assert!(matches!(updates[..], [Update::Frame(_)]));
            assert_mirrored(&reader, &script);
        }
        assert_eq!(reader.mirror().topology_version(), Some(18));
        assert_eq!(reader.counts().missed + reader.counts().unfit, 0);
        // 27 cubes in three sheets, each a fragment by now.
        let events = script
            .client
            .list_events(all_events())
            .await
            .unwrap()
            .events;
        let born = |event: &&v1::Event| matches!(event.kind, Some(Kind::FragmentBorn(_)));
        assert_eq!(events.iter().filter(born).count(), 2);
    });
}

fn all_events() -> v1::ListEventsRequest {
    v1::ListEventsRequest {
        session: NAME.to_owned(),
        after_event: Some(0),
        ..v1::ListEventsRequest::default()
    }
}

#[test]
fn a_patch_weighs_less_than_the_keyframe_that_it_spares() {
    live(async {
        let mut script = Script::start(12).await;
        let mut reader = opened(&script).await;
        script.tear(1);
        let updates = script.catch_up(&mut reader).await;
        let bare = v1::TopologyPatch {
            frame: None,
            ..patches(&updates)[0].clone()
        };
        let request = v1::GetKeyframeRequest {
            session: NAME.to_owned(),
            ..v1::GetKeyframeRequest::default()
        };
        let grid = script.client.keyframe(request).await.unwrap().grid.unwrap();
        let (patch, grid) = (bare.encoded_len(), grid.encoded_len());
        println!("one face of 1,728 cubes: {patch} bytes against {grid} of the cells");
        assert!(100 * patch < grid);
    });
}

#[test]
fn a_reader_that_missed_some_changes_gets_them_before_the_newest_positions() {
    live(async {
        let mut script = Script::start(8).await;
        let mut watch = (script.client)
            .watch(script.subscription(), v1::WatchMode::Latest)
            .await
            .unwrap();
        watch.next().await.unwrap();
        for _ in 0..20 {
            script.tear(1);
            script.step();
        }
        let mut updates = Vec::new();
        while watch.subscription().mirror().shown() != Some(script.frame.step + 1) {
            updates.push(watch.next().await.unwrap().unwrap());
            let mirror = watch.subscription().mirror();
            assert!(mirror.is_proven());
        }
        assert_mirrored(watch.subscription(), &script);
        let versions = patches(&updates).into_iter().map(|patch| patch.to_version);
        assert!(versions.eq(1..=20));
        assert_eq!(keyframes(&updates), 0);
        assert!(sequences(&updates).into_iter().eq(1..=script.last_event()));
        assert!(watch.subscription().counts().missed > 0);
    });
}

#[test]
fn a_reader_too_far_behind_gets_a_keyframe_and_still_every_event() {
    live(async {
        let mut script = Script::start(6).await;
        let watched = (script.client).watch(script.subscription(), v1::WatchMode::Latest);
        let mut watch = watched.await.unwrap();
        // Without asking for more, three frames come; the others' patches weigh more than the cells.
        watch.next().await.unwrap();
        while script.whole() > 0 {
            script.tear(1);
        }
        let mut updates = Vec::new();
        while watch.subscription().mirror().shown() != Some(script.frame.step + 1) {
            updates.push(watch.next().await.unwrap().unwrap());
        }
        let reader = watch.subscription();
        assert_mirrored(reader, &script);
        assert_eq!(keyframes(&updates), 1);
        assert!(sequences(&updates).into_iter().eq(1..=script.last_event()));
        assert_eq!(reader.mirror().topology_version(), Some(180));
    });
}

#[test]
fn readers_of_points_hear_events_and_no_topology() {
    live(async {
        let mut script = Script::start(2).await;
        let request = v1::SubscribeRequest {
            content: Content::Points.into(),
            ..script.subscription()
        };
        let mut reader = script.client.subscribe(request).await.unwrap();
        reader.next().await.unwrap();
        script.tear(2);
        let events = reader.next().await.unwrap();
        assert!(matches!(events, Some(Update::Events(_))), "{events:?}");
        let Some(Update::Frame(frame)) = reader.next().await.unwrap() else {
            panic!("a frame was expected");
        };
        assert_eq!((frame.topology_version, frame.vertices), (1, None));
        assert_eq!(frame.event_sequence, script.last_event());
    });
}

#[test]
fn who_joins_late_reads_the_mesh_and_its_history_and_goes_on_from_there() {
    live(async {
        let mut script = Script::start(4).await;
        for _ in 0..10 {
            script.tear(1);
        }
        let request = v1::GetKeyframeRequest {
            session: NAME.to_owned(),
            precision: v1::Precision::F64.into(),
            ..v1::GetKeyframeRequest::default()
        };
        let keyframe = script.client.keyframe(request).await.unwrap();
        let mut mirror = MeshMirror::default();
        mirror.keyframe(&keyframe).unwrap();
        assert_eq!(mirror.grid().unwrap(), Some(script.truth()));

        // Page after page, no event twice, none left out.
        let mut request = v1::ListEventsRequest {
            page_size: 3,
            ..all_events()
        };
        let mut seen = Vec::new();
        loop {
            let page = script.client.list_events(request.clone()).await.unwrap();
            assert!((1..=3).contains(&page.events.len()));
            assert_eq!(
                (page.oldest_sequence, page.last_sequence),
                (1, script.last_event())
            );
            seen.extend(page.events.iter().map(|event| event.sequence));
            if page.next_page_token.is_empty() {
                break;
            }
            request.page_token = page.next_page_token;
        }
        assert!(seen.into_iter().eq(1..=script.last_event()));

        // A stream from the middle of the history: what is past first, then what comes.
        let request = v1::SubscribeRequest {
            after_event: Some(4),
            ..script.subscription()
        };
        let mut reader = script.client.subscribe(request).await.unwrap();
        script.tear(1);
        let updates = script.catch_up(&mut reader).await;
        assert!(matches!(updates[0], Update::Events(_)));
        assert!(sequences(&updates).into_iter().eq(5..=script.last_event()));
        assert_mirrored(&reader, &script);
    });
}

#[test]
fn events_no_longer_kept_are_refused_and_never_left_out() {
    live(async {
        let mut script = Script::start(1).await;
        let large = |_| Event {
            kind: EventKind::Refused("too wide".to_owned()),
            rule: None,
            position: nalgebra::Vector3::zeros(),
            cells: vec![0; 1 << 18],
        };
        // 20 MiB where 16 are kept.
        for _ in 0..20 {
            script.happen((0..1).map(large).collect());
        }
        let error = script.client.list_events(all_events()).await.unwrap_err();
        assert_eq!(reason(&error), "EVENTS_TRIMMED");
        let request = v1::SubscribeRequest {
            after_event: Some(0),
            ..script.subscription()
        };
        let error = script.client.subscribe(request.clone()).await.unwrap_err();
        assert_eq!(reason(&error), "EVENTS_TRIMMED");

        let kept = v1::ListEventsRequest {
            after_event: None,
            ..all_events()
        };
        let page = script.client.list_events(kept).await.unwrap();
        assert!(page.oldest_sequence > 1 && page.last_sequence == 20);
        assert_eq!(page.events[0].sequence, page.oldest_sequence);

        let future = v1::SubscribeRequest {
            after_event: Some(21),
            ..request
        };
        let error = script.client.subscribe(future).await.unwrap_err();
        assert_eq!(reason(&error), "EVENT_UNKNOWN");
    });
}
