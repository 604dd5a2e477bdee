//! What viewers get, whatever they do.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use re_log_encoding::{CachingApplicationIdInjector, ToApplication as _};
use re_protos::sdk_comms::v1alpha1 as proto;
use re_protos::sdk_comms::v1alpha1::message_proxy_service_client::MessageProxyServiceClient;
use re_sdk::external::re_log_types::LogMsg;
use re_sdk::log::Chunk;
use re_sdk::{StoreKind, TimelineName};
use re_sdk_types::archetypes::{Mesh3D, Points3D};
use sinew_engine::PointState;
use sinew_viewer::{Config, Publisher, Viewer};
use support::Bar;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Streaming};

mod support;

const HISTORY: u64 = 400_000;

fn small() -> Config {
    Config {
        history_bytes: HISTORY,
        viewer_buffer_bytes: HISTORY / 4,
        interval: Duration::ZERO,
        ..Config::default()
    }
}

async fn start(config: Config) -> (Viewer, SocketAddr) {
    let viewer = Viewer::start(config).unwrap();
    let (address, _) = support::serve(&viewer, "127.0.0.1:0", axum::Router::new()).await;
    (viewer, address)
}

async fn client(address: SocketAddr) -> MessageProxyServiceClient<Channel> {
    let endpoint = Endpoint::new(format!("http://{address}")).unwrap();
    let channel = endpoint.connect().await.unwrap();
    MessageProxyServiceClient::new(channel).max_decoding_message_size(usize::MAX)
}

/// A viewer that knows what it would draw.
struct Watcher {
    messages: Streaming<proto::ReadMessagesResponse>,
    applications: CachingApplicationIdInjector,
    drawn: Drawn,
}

/// What a viewer would draw, were it to follow the steps.
#[derive(Default)]
struct Drawn {
    step: Option<i64>,
    triangles: Vec<u32>,
    colours: usize,
    labels: usize,
    points: usize,
    has_capture_time: bool,
    has_blueprint: bool,
    whole_meshes: usize,
    rows: BTreeMap<String, usize>,
}

impl Drawn {
    fn see(&mut self, message: &LogMsg) {
        let LogMsg::ArrowMsg(store, message) = message else {
            self.has_blueprint |= matches!(message, LogMsg::BlueprintActivationCommand(_));
            return;
        };
        if store.kind() == StoreKind::Blueprint {
            return;
        }
        let chunk = Chunk::from_arrow_msg(message).unwrap();
        let entity = chunk.entity_path().to_string();
        *self.rows.entry(entity.clone()).or_default() += chunk.num_rows();
        let length = |component: re_sdk::ComponentDescriptor| {
            let list = chunk.components().get_array(component.component)?;
            Some(list.value(0).len())
        };
        if entity == "/mesh" {
            let positions = length(Mesh3D::descriptor_vertex_positions()).unwrap();
            assert_eq!(length(Mesh3D::descriptor_vertex_normals()), Some(positions));
            let captured = chunk
                .timelines()
                .contains_key(&TimelineName::from_static_str("capture_time"));
            if let Some(colours) = length(Mesh3D::descriptor_vertex_colors()) {
                self.colours = colours;
                self.triangles = triangles(&chunk);
                self.whole_meshes += 1;
                self.has_capture_time = captured;
            }
            assert!(
                self.has_capture_time || !captured,
                "positions on a timeline that has no triangles"
            );
            assert_eq!(
                self.colours, positions,
                "positions of one mesh with the colours of another"
            );
            assert!(!self.triangles.is_empty(), "positions before any triangles");
            let most = self.triangles.iter().max().unwrap();
            assert_eq!(
                *most as usize + 1,
                positions,
                "positions of one mesh with triangles of another"
            );
        }
        if entity == "/points" {
            let positions = length(Points3D::descriptor_positions()).unwrap();
            if let Some(labels) = length(Points3D::descriptor_labels()) {
                self.labels = labels;
            }
            assert_eq!(
                self.labels, positions,
                "positions of some points with the labels of others"
            );
            self.points = positions;
            let steps = &chunk.timelines()[&TimelineName::from_static_str("step")];
            let step = steps.times_raw()[0];
            assert!(
                self.step.is_none_or(|before| before <= step),
                "time goes back"
            );
            self.step = Some(step);
        }
    }
}

fn triangles(chunk: &Chunk) -> Vec<u32> {
    use re_sdk::external::arrow::array::{Array as _, FixedSizeListArray, UInt32Array};
    let component = Mesh3D::descriptor_triangle_indices().component;
    let list = chunk.components().get_array(component).unwrap().value(0);
    let list = list.as_any().downcast_ref::<FixedSizeListArray>().unwrap();
    let flat = list.values().as_any().downcast_ref::<UInt32Array>();
    flat.unwrap().values().to_vec()
}

impl Watcher {
    async fn join(address: SocketAddr) -> Self {
        let mut client = client(address).await;
        let messages = client.read_messages(proto::ReadMessagesRequest {});
        Self {
            messages: messages.await.unwrap().into_inner(),
            applications: CachingApplicationIdInjector::default(),
            drawn: Drawn::default(),
        }
    }

    /// The next message, or `None` at the end of the stream.
    async fn next(&mut self) -> Option<()> {
        let message = self.messages.message().await.unwrap()?.log_msg.unwrap();
        let message = message.to_application((&mut self.applications, None));
        self.drawn.see(&message.unwrap());
        Some(())
    }

    async fn watch_until(&mut self, step: u64) {
        while self.drawn.step.is_none_or(|seen| seen < step as i64) {
            self.next().await.unwrap();
        }
    }
}

/// Publishes one step and sees it arrive, so that no step is replaced before it is taken.
async fn show(publisher: &Publisher, bar: &Bar, step: u64, to: &mut Watcher) {
    publisher.publish(support::shown(bar.at(step)));
    to.watch_until(step).await;
}

#[tokio::test]
async fn a_stalled_viewer_holds_up_neither_the_session_nor_another_viewer_nor_memory() {
    let (viewer, address) = start(small()).await;
    let bar = Bar::new(8, 20);
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let stalled = Watcher::join(address).await;
    let mut fast = Watcher::join(address).await;
    // Far more than HTTP/2 windows and socket buffers take: past them, the stalled viewer's stream is not polled.
    for step in 0..600 {
        show(&publisher, &bar, step, &mut fast).await;
        let one_step = HISTORY / 4;
        let held = viewer.stats().held_bytes;
        assert!(
            held <= HISTORY + HISTORY / 8 + one_step,
            "{held} bytes at step {step}"
        );
    }
    assert_eq!(publisher.replaced(), 0);
    assert_eq!(fast.drawn.rows["/mesh"], 600);
    assert_eq!(viewer.stats().viewers, 2);
    // It wakes up, and what it then draws is right all the way; Drawn asserts it.
    let mut late = stalled;
    late.watch_until(599).await;
    assert!(late.drawn.rows["/mesh"] < 600);
    assert!(viewer.stats().steps_skipped > 0);
}

#[tokio::test]
async fn publishing_returns_though_nobody_takes_the_frames() {
    let (viewer, address) = start(small()).await;
    let bar = Bar::new(8, 20);
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let _stalled = Watcher::join(address).await;
    for step in 0..500 {
        publisher.publish(support::shown(bar.at(step)));
    }
    let mut late = Watcher::join(address).await;
    late.watch_until(499).await;
    assert_eq!(late.drawn.whole_meshes, 1);
}

#[tokio::test]
async fn meshes_and_points_stay_whole_through_topology_changes_occlusions_and_stalls() {
    let (viewer, address) = start(small()).await;
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let stalled = Watcher::join(address).await;
    let mut fast = Watcher::join(address).await;
    for change in 0..20_u64 {
        let bar = Bar::with_version(4 + u32::try_from(change % 5).unwrap(), 20, change);
        for step in 25 * change..25 * (change + 1) {
            let mut frame = bar.at(step);
            if step % 9 == 0 {
                frame.point_states[3] = PointState::Absent;
            }
            frame.capture_time_seconds = (step >= 410).then_some(step as f64);
            publisher.publish(support::shown(frame));
            fast.watch_until(step).await;
            let absent = usize::from(step % 9 == 0);
            assert_eq!(fast.drawn.points, 12 - absent, "step {step}");
        }
        // Joins in the middle: gets a consistent mesh from the first message on.
        let mut late = Watcher::join(address).await;
        late.watch_until(25 * (change + 1) - 1).await;
        assert!(late.drawn.has_blueprint);
        assert!(late.drawn.rows["/mesh"] > 1, "no history");
    }
    let mut late = stalled;
    late.watch_until(499).await;
}

#[tokio::test]
async fn without_readers_nothing_is_encoded_and_whoever_joins_sees_the_last_step() {
    let (viewer, address) = start(small()).await;
    let bar = Bar::new(4, 20);
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let before = viewer.stats().held_bytes;
    for step in 0..20 {
        publisher.publish(support::shown(bar.at(step)));
    }
    assert_eq!(viewer.stats().held_bytes, before);
    let mut viewer = Watcher::join(address).await;
    viewer.watch_until(19).await;
    assert_eq!(viewer.drawn.rows["/mesh"], 1);
}

#[tokio::test]
async fn a_page_gets_its_own_session_only() {
    let (viewer, address) = start(small()).await;
    let bar = Bar::new(4, 20);
    let one = viewer.open(&support::session("one")).unwrap();
    let two = viewer.open(&support::session("two")).unwrap();
    let mut request = tonic::Request::new(proto::ReadMessagesRequest {});
    let page = format!("http://{address}/sessions/two?renderer=webgl");
    request
        .metadata_mut()
        .insert("referer", page.parse().unwrap());
    let messages = client(address).await.read_messages(request).await.unwrap();
    let mut messages = messages.into_inner();
    one.publish(support::shown(bar.at(1)));
    two.publish(support::shown(bar.at(2)));
    viewer.shutdown(Duration::from_secs(60)).unwrap();
    let mut applications = CachingApplicationIdInjector::default();
    let mut recordings = Vec::new();
    while let Some(message) = messages.message().await.unwrap() {
        let message = message.log_msg.unwrap();
        let message = message.to_application((&mut applications, None)).unwrap();
        if message.store_id().kind() == StoreKind::Recording {
            recordings.push(message.store_id().recording_id().to_string());
        }
    }
    assert!(recordings.len() > 5);
    assert!(
        recordings.iter().all(|id| id.starts_with("two@")),
        "{recordings:?}"
    );
}

#[tokio::test]
async fn a_session_that_ends_frees_its_history_once_its_viewers_have_the_last_step() {
    let (viewer, address) = start(small()).await;
    let bar = Bar::new(8, 20);
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let mut fast = Watcher::join(address).await;
    for step in 0..50 {
        show(&publisher, &bar, step, &mut fast).await;
    }
    assert_eq!(viewer.stats().recordings, 1);
    publisher.publish(support::shown(bar.at(50)));
    drop(publisher);
    fast.watch_until(50).await;
    // The end comes after the last step, on the publishing thread: closing waits for that thread.
    viewer.shutdown(Duration::from_secs(60)).unwrap();
    while fast.next().await.is_some() {}
    let stats = viewer.stats();
    assert_eq!((stats.recordings, stats.held_bytes), (0, 0));
}

#[tokio::test]
async fn sessions_that_come_and_go_do_not_pile_up_before_a_stalled_viewer() {
    let (viewer, address) = start(small()).await;
    let bar = Bar::new(8, 20);
    let _stalled = Watcher::join(address).await;
    let mut most = 0;
    for turn in 0..200 {
        let publisher = viewer.open(&support::session("bar")).unwrap();
        publisher.publish(support::shown(bar.at(turn)));
        drop(publisher);
        most = most.max(viewer.stats().recordings);
    }
    viewer.shutdown(Duration::from_secs(60)).unwrap();
    assert!(viewer.stats().recordings <= 8, "{:?}", viewer.stats());
}

#[tokio::test]
async fn writing_is_refused() {
    let (viewer, address) = start(small()).await;
    let mut client = client(address).await;
    let log_msg = None;
    let garbage = futures::stream::iter([proto::WriteMessagesRequest { log_msg }]);
    let refusal = client.write_messages(garbage).await.unwrap_err();
    assert_eq!(refusal.code(), Code::PermissionDenied);
    let table = proto::WriteTableRequest {
        id: None,
        data: None,
    };
    let refusal = client.write_table(table).await.unwrap_err();
    assert_eq!(refusal.code(), Code::PermissionDenied);
    assert_eq!(viewer.stats().recordings, 0);
    let mut watcher = Watcher::join(address).await;
    let publisher = viewer.open(&support::session("bar")).unwrap();
    show(&publisher, &Bar::new(4, 20), 1, &mut watcher).await;
}

#[tokio::test]
async fn one_viewer_too_many_is_told_so() {
    let config = Config {
        viewers: 1,
        ..small()
    };
    let (_viewer, address) = start(config).await;
    let _first = Watcher::join(address).await;
    let second = client(address).await;
    let refusal = { second }
        .read_messages(proto::ReadMessagesRequest {})
        .await;
    assert_eq!(refusal.unwrap_err().code(), Code::ResourceExhausted);
}
