//! A bar of cubes that twists and bends, made by hand, and a server that shows it.
#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    reason = "each test, the example and the bench use a part of it"
)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use std::net::SocketAddr;
use std::sync::Arc;

use nalgebra::Vector3;
use sinew_engine::{Frame, Layout, PointState, UpAxis};
use sinew_mesh::Cells;
use sinew_viewer::{SessionInfo, Shown, Viewer};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

const POINTS: u32 = 12;
const LENGTH: f64 = 1.6; // m
const WIDTH: f64 = 0.36; // m

/// A bar of `side` × `side` × `long` cubes along +z.
pub struct Bar {
    pub layout: Arc<Layout>,
    rest: Vec<Vector3<f64>>,
}

impl Bar {
    pub fn new(side: u32, long: u32) -> Self {
        Self::with_version(side, long, 0)
    }

    pub fn with_version(side: u32, long: u32, topology_version: u64) -> Self {
        let across = side + 1;
        let vertex = |x: u32, y: u32, z: u32| x + across * (y + across * z);
        let mut rest = Vec::new();
        for z in 0..=long {
            for y in 0..=side {
                for x in 0..=side {
                    let [x, y, z, side, long] = [x, y, z, side, long].map(f64::from);
                    let [x, y] = [x, y].map(|x| (x / side - 0.5) * WIDTH);
                    rest.push(Vector3::new(x, y, z / long * LENGTH));
                }
            }
        }
        let mut connectivity = Vec::new();
        for z in 0..long {
            for y in 0..side {
                for x in 0..side {
                    for z in [z, z + 1] {
                        for [dx, dy] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                            connectivity.push(vertex(x + dx, y + dy, z));
                        }
                    }
                }
            }
        }
        let cells = side * side * long;
        let dominant = |v: &Vector3<f64>| {
            let nearest = (v.z / LENGTH * f64::from(POINTS - 1)).round();
            (0..POINTS).find(|&p| f64::from(p) == nearest).unwrap()
        };
        let layout = Layout {
            epoch: 1,
            topology_version,
            hash: 0,
            dominant: rest.iter().map(dominant).collect(),
            cells: Arc::new(Cells {
                types: vec![12; cells as usize],
                connectivity,
                offsets: (0..=cells).map(|cell| 8 * cell).collect(),
                ..Cells::default()
            }),
        };
        let layout = Arc::new(layout);
        Self { layout, rest }
    }

    /// The bar at 60 steps a second.
    pub fn at(&self, step: u64) -> Frame {
        let time = step as f64 / 60.0;
        let move_one = |v: Vector3<f64>| {
            let along = v.z / LENGTH;
            let (sin, cos) = (1.9 * along * (1.1 * time).sin()).sin_cos();
            let bend = 0.35 * along * along * (0.7 * time).cos();
            let thick = 1.0 - 0.35 * (std::f64::consts::PI * along).sin();
            let (x, y) = (v.x * thick, v.y * thick);
            Vector3::new(cos * x - sin * y + bend, sin * x + cos * y, v.z)
        };
        let axis = |point| Vector3::z() * (LENGTH * f64::from(point) / f64::from(POINTS - 1));
        Frame {
            sequence: step,
            layout: Arc::clone(&self.layout),
            step,
            time_seconds: time,
            capture_time_seconds: None,
            motion_sequence: None,
            points: (0..POINTS).map(axis).map(move_one).collect(),
            orientations: Vec::new(),
            point_states: vec![PointState::Valid; POINTS as usize],
            doubts: Vec::new(),
            vertices: self.rest.iter().copied().map(move_one).collect(),
            measures: Vec::new(),
            readings: Vec::new(),
            change: None,
        }
    }
}

pub fn shown(frame: Frame) -> Shown {
    let wobble = (frame.time_seconds * 3.0).sin();
    Shown {
        frame: Arc::new(frame),
        step_seconds: 0.0012 + 0.0003 * wobble,
        latency_seconds: Some(0.004 + 0.0008 * wobble),
    }
}

pub fn session(id: &str) -> SessionInfo {
    SessionInfo {
        id: id.to_owned(),
        title: "A bar that twists".to_owned(),
        labels: (0..POINTS).map(|point| format!("P{point}")).collect(),
        probes: Vec::new(),
        up: UpAxis::Z,
    }
}

/// Serves the feed over gRPC and grpc-web, the pages, and `more`, on one port of the loopback.
pub async fn serve(
    viewer: &Viewer,
    address: &str,
    more: axum::Router,
) -> (SocketAddr, JoinHandle<()>) {
    let feed = tonic::service::Routes::new(viewer.feed()).into_axum_router();
    let feed = feed.layer(tonic_web::GrpcWebLayer::new());
    let app = viewer.pages().merge(more).fallback_service(feed);
    let listener = TcpListener::bind(address).await.unwrap();
    let address = listener.local_addr().unwrap();
    let server = tokio::spawn(async move { axum::serve(listener, app).await.unwrap() });
    (address, server)
}
