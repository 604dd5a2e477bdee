//! Recordings on disk.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::time::Duration;

use re_log_encoding::DecoderApp;
use re_sdk::external::re_log_types::LogMsg;
use re_sdk::log::Chunk;
use re_sdk::{StoreKind, TimelineName};
use sinew_viewer::{Config, OpenError, SessionInfo, Viewer};
use support::Bar;

mod support;

fn recording_into(folder: &std::path::Path) -> Viewer {
    Viewer::start(Config {
        recordings: Some(folder.to_owned()),
        interval: Duration::ZERO,
        ..Config::default()
    })
    .unwrap()
}

#[test]
fn a_file_holds_every_step_that_was_taken_up_to_the_last_one() {
    let folder = tempfile::tempdir().unwrap();
    let viewer = recording_into(folder.path());
    let publisher = viewer.open(&SessionInfo {
        probes: vec!["end".to_owned()],
        ..support::session("bar")
    });
    let publisher = publisher.unwrap();
    let bar = Bar::new(6, 20);
    for step in 0..300 {
        let mut frame = bar.at(step);
        frame.readings = vec![frame.points[0]];
        publisher.publish(support::shown(frame));
    }
    let replaced = usize::try_from(publisher.replaced()).unwrap();
    drop(publisher);
    viewer.shutdown(Duration::from_secs(60)).unwrap();

    let file = BufReader::new(File::open(folder.path().join("bar.rrd")).unwrap());
    let mut rows = BTreeMap::<String, usize>::new();
    let step = TimelineName::from_static_str("step");
    let mut last = 0;
    let mut has_blueprint = false;
    for message in DecoderApp::decode_lazy(file) {
        match message.unwrap() {
            LogMsg::ArrowMsg(store, message) if store.kind() == StoreKind::Recording => {
                let chunk = Chunk::from_arrow_msg(&message).unwrap();
                *rows.entry(chunk.entity_path().to_string()).or_default() += 1;
                if let Some(steps) = chunk.timelines().get(&step) {
                    last = last.max(steps.times_raw()[0]);
                }
            }
            LogMsg::BlueprintActivationCommand(_) => has_blueprint = true,
            LogMsg::ArrowMsg(..) | LogMsg::SetStoreInfo(_) => {}
        }
    }
    assert_eq!(last, 299);
    assert!(has_blueprint);
    let taken = 300 - replaced;
    assert_eq!((rows["/mesh"], rows["/points"]), (taken, taken));
    assert_eq!(rows["/plots/readings/0"], taken);
    // One static row more: the line's name and colour.
    assert_eq!(
        (rows["/plots/step_ms"], rows["/plots/latency_ms"]),
        (taken + 1, taken + 1)
    );
}

#[test]
fn an_id_that_would_leave_the_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let viewer = recording_into(folder.path());
    for id in ["", ".", "..", "../x", "a/b", "a\\b", ".hidden", "ü"] {
        let refusal = viewer.open(&support::session(id));
        assert!(matches!(refusal, Err(OpenError::Id(_))), "{id:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    assert_eq!(viewer.stats().recordings, 0);
}

#[test]
fn a_folder_that_is_gone_is_an_error_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("recordings");
    let viewer = recording_into(&inner);
    std::fs::remove_dir(&inner).unwrap();
    let refusal = viewer.open(&support::session("bar"));
    let refusal = refusal.err().unwrap().to_string();
    assert!(refusal.contains("bar.rrd"), "{refusal}");
    assert_eq!(viewer.stats().recordings, 0);
}
