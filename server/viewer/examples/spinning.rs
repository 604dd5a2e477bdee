//! Shows a bar that twists, with no engine behind it: `cargo run -p sinew-viewer --example spinning [ADDRESS] [FOLDER]`.
#![allow(clippy::unwrap_used, reason = "an example may end")]

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::Json;
use axum::routing::get;
use sinew_engine::PointState;
use sinew_viewer::{Config, Viewer};

#[path = "../tests/support/mod.rs"]
mod support;

#[tokio::main]
async fn main() {
    let mut arguments = std::env::args().skip(1);
    let address = arguments.next().unwrap_or("127.0.0.1:0".to_owned());
    let recordings = arguments.next().map(Into::into);
    let viewer = Viewer::start(Config {
        recordings,
        ..Config::default()
    })
    .unwrap();
    let bar = support::Bar::new(10, 44);
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let step = Arc::new(AtomicU64::new(0));
    let vertices = bar.at(0).vertices.len();
    let sessions = get({
        let step = Arc::clone(&step);
        async move || {
            let step = step.load(Ordering::Relaxed).to_string();
            Json(serde_json::json!({"sessions": [{
                "name": "sessions/bar", "state": "SESSION_STATE_RUNNING", "step": step,
                "title": "A bar that twists", "pointCount": 12, "vertexCount": vertices,
            }]}))
        }
    });
    let more = axum::Router::new().route("/api/sessions", sessions);
    let (address, _server) = support::serve(&viewer, &address, more).await;
    println!("http://{address}/");
    println!("rerun rerun+http://{address}/proxy");
    let mut clock = tokio::time::interval(Duration::from_secs_f64(1.0 / 60.0));
    loop {
        tokio::select! {
            _ = clock.tick() => {}
            _ = tokio::signal::ctrl_c() => break,
        }
        let now = step.fetch_add(1, Ordering::Relaxed);
        let mut frame = bar.at(now);
        if now % 240 > 180 {
            frame.point_states[7] = PointState::Held;
        }
        publisher.publish(support::shown(frame));
    }
    drop(publisher);
    viewer.shutdown(Duration::from_secs(5)).unwrap();
}
