//! The service on loopback, beside what the transport could carry at best. Prints its own table:
//! `cargo bench -p sinew-server`.

use std::{
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
    time::{Duration, Instant},
};

use prost::Message as _;
use sha2::{Digest as _, Sha256};
use sinew_mesh::{Grid, shapes};
use sinew_proto::v1::{
    self, mesh_service_client::MeshServiceClient, motion_service_client::MotionServiceClient,
    session_service_client::SessionServiceClient, subscribe_response::Item,
};
use sinew_server::{Config, Server};
use tonic::transport::{Channel, Endpoint};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Vertices per axis of the cube: 46³ = 97,336.
const SIDE: usize = 46;
const POINTS: u32 = 40;
const ROUNDS: usize = 5;

fn main() -> Result<()> {
    // cargo passes `--bench`; a plain test run measures nothing.
    if !std::env::args().any(|arg| arg == "--bench") {
        return Ok(());
    }
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?
        .block_on(measure())
}

async fn measure() -> Result<()> {
    let server = Server::start(Config {
        listen: ([127, 0, 0, 1], 0).into(),
        ..Config::default()
    })
    .await?;
    let channel = Endpoint::from_shared(format!("http://{}", server.address()))?
        .tcp_nodelay(true)
        .initial_stream_window_size(4 << 20)
        .initial_connection_window_size(256 << 20)
        .max_frame_size(1 << 20)
        .connect()
        .await?;
    let grid = shapes::hexahedra(SIDE - 1, SIDE - 1, SIDE - 1);
    let vertices = grid.positions.len();
    let asset = upload(&channel, &grid).await?;
    println!("{vertices} vertices, {POINTS} points, k = 8, weighted mean, f32 frames");

    let before = resident()?;
    let mut sessions = SessionServiceClient::new(channel.clone());
    create(&mut sessions, "memory", external(), &asset, 8).await?;
    let per_vertex = (resident()? - before) as f64 / vertices as f64;
    println!(
        "memory of a fresh session: {per_vertex:.0} bytes per vertex (resident set, absolute)"
    );
    delete(&mut sessions, "memory").await?;

    throughput(&channel, &asset, vertices, 1).await?;
    throughput(&channel, &asset, vertices, 8).await?;
    held(&channel, &asset, vertices).await?;
    server.shutdown().await;
    Ok(())
}

/// Frames per second of Subscribe against a raw socket that moves the same bytes. With k = 1 the step is
/// cheap, so that the stream is what is measured; with k = 8 the two cores pose as well as stream.
async fn throughput(channel: &Channel, asset: &str, vertices: usize, keep: u32) -> Result<()> {
    let mut sessions = SessionServiceClient::new(channel.clone());
    create(&mut sessions, "unpaced", swing(), asset, keep).await?;
    let mut ratios = Vec::new();
    for _ in 0..ROUNDS {
        let (frames, missed, seconds) =
            subscribe(channel, "unpaced", Duration::from_secs(3)).await?;
        let rate = frames as f64 / seconds;
        let raw = tokio::task::spawn_blocking(move || raw_tcp(vertices * 12, 1500)).await??;
        ratios.push(rate / raw);
        println!(
            "k = {keep}: Subscribe {rate:.0} frames/s ({missed} steps passed over), raw TCP {raw:.0} frames/s, \
             ratio {:.2}",
            rate / raw
        );
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "k = {keep}: median ratio of Subscribe to raw TCP: {:.2}",
        ratios[ROUNDS / 2]
    );
    delete(&mut sessions, "unpaced").await
}

/// A 120 Hz stream held for ten seconds.
async fn held(channel: &Channel, asset: &str, vertices: usize) -> Result<()> {
    const FRAMES: u64 = 1200;
    let mut sessions = SessionServiceClient::new(channel.clone());
    create(&mut sessions, "held", external(), asset, 8).await?;
    let reader = tokio::spawn({
        let channel = channel.clone();
        async move {
            follow(&channel, "held", FRAMES)
                .await
                .map_err(|error| error.to_string())
        }
    });
    let mut clock = tokio::time::interval(Duration::from_nanos(1_000_000_000 / 120));
    let (sender, frames) = tokio::sync::mpsc::channel(4);
    let hello = v1::Hello {
        session: "sessions/held".into(),
        ..v1::Hello::default()
    };
    sender
        .send(v1::stream_motion_request::Item::Hello(hello))
        .await?;
    let requests = tokio_stream::wrappers::ReceiverStream::new(frames);
    let requests = tokio_stream::StreamExt::map(requests, |item| v1::StreamMotionRequest {
        item: Some(item),
    });
    let mut acks = MotionServiceClient::new(channel.clone())
        .stream_motion(requests)
        .await?
        .into_inner();
    let drain = tokio::spawn(async move { while let Ok(Some(_)) = acks.message().await {} });
    let start = Instant::now();
    for sequence in 1..=FRAMES {
        clock.tick().await;
        sender
            .send(v1::stream_motion_request::Item::Frame(moved(sequence)))
            .await?;
    }
    drop(sender);
    let (received, mut latencies) = reader.await??;
    let rate = FRAMES as f64 / start.elapsed().as_secs_f64();
    drain.await?;
    latencies.sort_by(f64::total_cmp);
    let at = |percent: usize| latencies[(latencies.len() - 1) * percent / 100] * 1e3;
    println!(
        "120 Hz, {vertices} vertices: {FRAMES} sent, {received} received, {rate:.1} Hz held; receipt to client \
         p50 {:.2} ms, p99 {:.2} ms (absolute)",
        at(50),
        at(99)
    );
    delete(&mut sessions, "held").await
}

async fn follow(channel: &Channel, id: &str, last: u64) -> Result<(u64, Vec<f64>)> {
    let mut stream = open(channel, id).await?;
    let (mut received, mut latencies) = (0, Vec::new());
    while let Some(response) = stream.message().await? {
        let frame = match response.item {
            Some(Item::Frame(frame)) => frame,
            Some(Item::Keyframe(keyframe)) => keyframe.frame.unwrap_or_default(),
            Some(Item::Patch(_) | Item::Events(_) | Item::Chunk(_) | Item::Goodbye(_)) | None => {
                continue;
            }
        };
        if let (Some(sequence), Some(timing)) = (frame.motion_sequence, frame.timing) {
            received += 1;
            latencies.push((now() - timing.received) as f64 * 1e-9);
            if sequence == last {
                break;
            }
        }
    }
    Ok((received, latencies))
}

async fn open(channel: &Channel, id: &str) -> Result<tonic::Streaming<v1::SubscribeResponse>> {
    let request = v1::SubscribeRequest {
        session: format!("sessions/{id}"),
        content: v1::Content::Mesh.into(),
        keyframe_interval_seconds: 3600.0,
        max_message_bytes: 60 << 20,
        ..v1::SubscribeRequest::default()
    };
    let mut client = MeshServiceClient::new(channel.clone()).max_decoding_message_size(64 << 20);
    Ok(client.subscribe(request).await?.into_inner())
}

async fn subscribe(channel: &Channel, id: &str, time: Duration) -> Result<(u64, u64, f64)> {
    let mut stream = open(channel, id).await?;
    stream.message().await?; // the keyframe
    let start = Instant::now();
    let (mut frames, mut first, mut last) = (0_u64, None, 0);
    while start.elapsed() < time {
        let Some(v1::SubscribeResponse {
            item: Some(Item::Frame(frame)),
        }) = stream.message().await?
        else {
            return Err("the stream ended".into());
        };
        frames += 1;
        first.get_or_insert(frame.sequence);
        last = frame.sequence;
    }
    let missed = last - first.unwrap_or(last) + 1 - frames;
    Ok((frames, missed, start.elapsed().as_secs_f64()))
}

/// Frames per second through one loopback socket, without any protocol.
fn raw_tcp(bytes: usize, frames: usize) -> std::io::Result<f64> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    let writer = std::thread::spawn(move || -> std::io::Result<()> {
        let (mut socket, _) = listener.accept()?;
        let frame = vec![1; bytes];
        (0..frames).try_for_each(|_| socket.write_all(&frame))
    });
    let mut socket = TcpStream::connect(address)?;
    let mut frame = vec![0; bytes];
    socket.read_exact(&mut frame)?;
    let start = Instant::now();
    for _ in 1..frames {
        socket.read_exact(&mut frame)?;
    }
    let rate = (frames - 1) as f64 / start.elapsed().as_secs_f64();
    writer
        .join()
        .map_err(|_| std::io::Error::other("the writer panicked"))??;
    Ok(rate)
}

/// Points of a helix through the unit cube.
fn helix() -> Vec<f64> {
    let at = |i: u32| {
        let turn = f64::from(i) * 0.7;
        [
            0.5 + 0.4 * turn.cos(),
            0.5 + 0.4 * turn.sin(),
            f64::from(i) / f64::from(POINTS - 1),
        ]
    };
    (0..POINTS).flat_map(at).collect()
}

fn external() -> v1::Motion {
    let points = v1::ExternalPoints {
        labels: (0..POINTS).map(|i| format!("p{i}")).collect(),
        rest_positions: Some(v1::Reals::pack(&helix(), v1::Precision::F64)),
        rate_hz: 120.0,
        ..v1::ExternalPoints::default()
    };
    v1::Motion {
        source: Some(v1::motion::Source::External(points)),
    }
}

fn moved(sequence: u64) -> v1::MotionFrame {
    let sway = (sequence as f64 * 0.05).sin() * 0.1;
    let positions: Vec<f64> = helix()
        .chunks(3)
        .flat_map(|p| [p[0] + sway * p[2], p[1], p[2]])
        .collect();
    v1::MotionFrame {
        sequence,
        capture_time_seconds: sequence as f64 / 120.0,
        positions: Some(v1::Reals::pack(&positions, v1::Precision::F64)),
        ..v1::MotionFrame::default()
    }
}

/// The same points as a chain of springs that falls.
fn swing() -> v1::Motion {
    let springs: Vec<u32> = (1..POINTS).flat_map(|i| [i - 1, i]).collect();
    let network = v1::MassSpring {
        positions: Some(v1::Reals::pack(&helix(), v1::Precision::F64)),
        fixed: Some(v1::Indices::pack(&[0])),
        springs: Some(v1::Indices::pack(&springs)),
        stiffness: Some(v1::Reals {
            values: vec![50.0],
            ..v1::Reals::default()
        }),
        gravity: Some(v1::Vector3 {
            z: -1.0,
            ..v1::Vector3::default()
        }),
        ..v1::MassSpring::default()
    };
    v1::Motion {
        source: Some(v1::motion::Source::MassSpring(network)),
    }
}

async fn create(
    sessions: &mut SessionServiceClient<Channel>,
    id: &str,
    motion: v1::Motion,
    asset: &str,
    keep: u32,
) -> Result<()> {
    let mesh = v1::Mesh {
        source: Some(v1::mesh::Source::Asset(asset.to_owned())),
        ..v1::Mesh::default()
    };
    let scene = v1::Scene {
        motion: Some(motion),
        mesh: Some(mesh),
        mapping: Some(v1::Mapping {
            filter: Some(v1::Filter {
                kind: Some(v1::filter::Kind::Keep(v1::KeepK { k: keep })),
            }),
            ..v1::Mapping::default()
        }),
        // Matters to the session that moves by itself.
        pace: v1::Pace::Unpaced.into(),
        ..v1::Scene::default()
    };
    let request = v1::CreateSessionRequest {
        session_id: id.to_owned(),
        scene: Some(scene),
        run: true,
        ..v1::CreateSessionRequest::default()
    };
    sessions.create_session(request).await?;
    Ok(())
}

async fn delete(sessions: &mut SessionServiceClient<Channel>, id: &str) -> Result<()> {
    sessions
        .delete_session(v1::DeleteSessionRequest {
            name: format!("sessions/{id}"),
        })
        .await?;
    Ok(())
}

async fn upload(channel: &Channel, grid: &Grid) -> Result<String> {
    let positions: Vec<f64> = grid
        .positions
        .iter()
        .flat_map(|p| [p.x, p.y, p.z])
        .collect();
    let message = v1::UnstructuredGrid {
        positions: Some(v1::Reals::pack(&positions, v1::Precision::F64)),
        cell_types: grid.cells.types.clone().into(),
        connectivity: Some(v1::Indices::pack(&grid.cells.connectivity)),
        offsets: Some(v1::Indices::pack(&grid.cells.offsets)),
        ..v1::UnstructuredGrid::default()
    };
    let content = message.encode_to_vec();
    let header = v1::AssetHeader {
        size: content.len() as u64,
        sha256: Sha256::digest(&content).to_vec().into(),
    };
    let mut items = vec![v1::upload_asset_request::Item::Header(header)];
    items.extend(content.chunks(1 << 20).map(|data| {
        let crc32c = crc32c::crc32c(data);
        v1::upload_asset_request::Item::Chunk(v1::AssetChunk {
            data: data.to_vec().into(),
            crc32c,
        })
    }));
    let requests = tokio_stream::iter(
        items
            .into_iter()
            .map(|item| v1::UploadAssetRequest { item: Some(item) }),
    );
    let mut client = v1::asset_service_client::AssetServiceClient::new(channel.clone());
    Ok(client.upload_asset(requests).await?.into_inner().name)
}

/// Resident memory of this process, bytes.
fn resident() -> Result<usize> {
    let pages = std::fs::read_to_string("/proc/self/statm")?;
    let resident: usize = pages
        .split_whitespace()
        .nth(1)
        .ok_or("statm has no second field")?
        .parse()?;
    Ok(resident * 4096)
}

fn now() -> u64 {
    std::time::SystemTime::now()
        .duration_since(std::time::SystemTime::UNIX_EPOCH)
        .map_or(0, |since| {
            u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
        })
}
