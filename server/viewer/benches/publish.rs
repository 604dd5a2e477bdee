//! What showing costs: `cargo bench -p sinew-viewer`.
//!
//! For each mesh, with no viewer, one that reads and one that reads nothing beside it: the time of `publish()`, paced at
//! 60 frames a second; frames that were replaced before they were encoded; steps that a reader was too slow for; the
//! time that the publishing thread works per frame.
#![allow(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]

use std::time::{Duration, Instant};

use re_protos::sdk_comms::v1alpha1::ReadMessagesRequest;
use re_protos::sdk_comms::v1alpha1::message_proxy_service_client::MessageProxyServiceClient;
use sinew_viewer::{Config, Viewer};
use support::Bar;
use tonic::transport::Endpoint;

#[path = "../tests/support/mod.rs"]
mod support;

const FRAMES: usize = 300;

fn main() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    println!(
        "| mesh | surface vertices | viewers | publish p50 | p99 | replaced | skipped | received | CPU per frame |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (name, bar) in [
        ("46³ hexahedra", Bar::new(46, 46)),
        ("100k on the surface", Bar::new(46, 531)),
    ] {
        for (viewers, fast, stalled) in [
            ("none", 0, 0),
            ("a fast one", 1, 0),
            ("a fast and a stalled one", 1, 1),
        ] {
            let line = runtime.block_on(measure(&bar, fast, stalled));
            let surface = sinew_mesh::surface(&bar.layout.cells).vertices.len();
            println!("| {name} | {surface} | {viewers} | {line} |");
        }
    }
}

async fn measure(bar: &Bar, fast: usize, stalled: usize) -> String {
    let viewer = Viewer::start(Config::default()).unwrap();
    let (address, server) = support::serve(&viewer, "127.0.0.1:0", axum::Router::new()).await;
    let publisher = viewer.open(&support::session("bar")).unwrap();
    let mut idle = Vec::new();
    let mut readers = Vec::new();
    for index in 0..fast + stalled {
        let endpoint = Endpoint::new(format!("http://{address}")).unwrap();
        let channel = endpoint
            .http2_adaptive_window(true)
            .connect()
            .await
            .unwrap();
        let client = MessageProxyServiceClient::new(channel);
        let mut client = client.max_decoding_message_size(usize::MAX);
        let stream = client.read_messages(ReadMessagesRequest {}).await.unwrap();
        let mut stream = stream.into_inner();
        if index < fast {
            readers.push(tokio::spawn(async move {
                let mut messages = 0;
                while let Ok(Some(_)) = stream.message().await {
                    messages += 1;
                }
                messages
            }));
        } else {
            idle.push(stream);
        }
    }
    let frames: Vec<_> = (0..8).map(|step| support::shown(bar.at(step))).collect();
    let before = thread_seconds("sinew-viewer");
    let mut times = Vec::with_capacity(FRAMES);
    let mut clock = tokio::time::interval(Duration::from_secs_f64(1.0 / 60.0));
    for step in 0..FRAMES {
        clock.tick().await;
        let mut shown = frames[step % frames.len()].clone();
        let start = Instant::now();
        shown.step_seconds = 1e-3;
        publisher.publish(shown);
        times.push(start.elapsed());
    }
    let replaced = publisher.replaced();
    let worked = thread_seconds("sinew-viewer") - before;
    let skipped = viewer.stats().steps_skipped;
    drop(publisher);
    viewer.shutdown(Duration::from_secs(10)).unwrap();
    drop(idle);
    let mut received = 0;
    for reader in readers {
        received += reader.await.unwrap();
    }
    server.abort();
    times.sort_unstable();
    let [p50, p99] = [50, 99].map(|percent| times[FRAMES * percent / 100]);
    let per_frame = 1e3 * worked / FRAMES as f64;
    format!(
        "{p50:.1?} | {p99:.1?} | {replaced} | {skipped} | {received} messages | {per_frame:.2} ms"
    )
}

/// Processor time of this process's newest thread of that name, s; zero where the system does not tell.
fn thread_seconds(name: &str) -> f64 {
    const TICKS_PER_SECOND: f64 = 100.0;
    let mut tasks: Vec<u32> = std::fs::read_dir("/proc/self/task")
        .map(|tasks| {
            tasks
                .filter_map(|t| t.ok()?.file_name().to_str()?.parse().ok())
                .collect()
        })
        .unwrap_or_default();
    tasks.sort_unstable();
    for task in tasks.iter().rev() {
        let stat = std::fs::read_to_string(format!("/proc/self/task/{task}/stat"));
        let stat = stat.unwrap_or_default();
        let Some((head, tail)) = stat.rsplit_once(')') else {
            continue;
        };
        if head.ends_with(&format!("({name}")) {
            let ticks = tail.split_whitespace().skip(11).take(2);
            return ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / TICKS_PER_SECOND;
        }
    }
    0.0
}
