//! A session whose steps are written by hand.

use std::{net::SocketAddr, sync::Arc};

use nalgebra::Vector3;
use sinew_client::{Client, Subscription, Update, grid};
use sinew_engine::{
    Change, Event, EventKind, Filter, Frame, Layout, Recipe, Reference, Rule, Weighting,
};
use sinew_mesh::{Cells, Grid, shapes};
use sinew_proto::v1;
use sinew_tearing::{Answer, Body, Request, View};

use crate::{Config, Server, registry::Entry, timing::StepTiming};

pub(super) const NAME: &str = "sessions/bar";

/// A server with one session, a bar of cubes that comes apart face by face.
pub(super) struct Script {
    pub(super) server: Server,
    pub(super) client: Client,
    entry: Arc<Entry>,
    body: Body,
    /// Faces that may still open, by the cells on their sides.
    whole: Vec<[u32; 2]>,
    /// The newest state.
    pub(super) frame: Arc<Frame>,
}

impl Script {
    /// `cubes` along each axis.
    pub(super) async fn start(cubes: usize) -> Self {
        let server = Server::start(Config {
            listen: SocketAddr::from(([127, 0, 0, 1], 0)),
            ..Config::default()
        });
        let server = server.await.unwrap();
        let client = Client::connect(&server.address().to_string())
            .await
            .unwrap();
        let (body, _) = Body::new(shapes::hexahedra(cubes, cubes, cubes)).unwrap();
        let mesh = Grid {
            positions: body.rest().to_vec(),
            cells: body.cells(),
        };
        let request = v1::CreateSessionRequest {
            session_id: "bar".to_owned(),
            scene: Some(scene(&mesh)),
            ..v1::CreateSessionRequest::default()
        };
        client.create_session(request).await.unwrap();
        let entry = server.shared().registry.get(NAME).unwrap();
        let count = u32::try_from(cubes).unwrap();
        let cell = |x, y, z| x + count * (y + count * z);
        let mut whole = Vec::new();
        for z in 0..count {
            for y in 0..count {
                whole.extend((1..count).map(|x| [cell(x - 1, y, z), cell(x, y, z)]));
            }
        }
        Self {
            frame: entry.handle.outlets.latest().frame.clone(),
            server,
            client,
            entry,
            body,
            whole,
        }
    }

    pub(super) fn subscription(&self) -> v1::SubscribeRequest {
        v1::SubscribeRequest {
            session: NAME.to_owned(),
            precision: v1::Precision::F64.into(),
            ..v1::SubscribeRequest::default()
        }
    }

    pub(super) async fn subscribe(&self) -> Subscription {
        self.client.subscribe(self.subscription()).await.unwrap()
    }

    /// Faces that may still open.
    pub(super) fn whole(&self) -> usize {
        self.whole.len()
    }

    /// A step in which the mesh moves.
    pub(super) fn step(&mut self) {
        let layout = Arc::clone(&self.frame.layout);
        self.publish(layout, self.frame.vertices.clone(), None);
    }

    /// A step in which some faces open.
    pub(super) fn tear(&mut self, faces: usize) {
        let facets = self.whole.split_off(self.whole.len() - faces);
        // One point for all: where it is makes no difference to faces that are named.
        let points = [Vector3::zeros()];
        let recipe = Recipe {
            weighting: Weighting::default(),
            filter: Filter::KeepK(1),
            rule: Rule::Direct,
            reference: Reference::Initial,
        };
        let binding = sinew_mapping::bind(self.body.rest(), &points, &[true], &recipe).unwrap();
        let view = View {
            binding: &binding,
            points: &points,
            now: &self.frame.vertices,
        };
        let mut outcome = self.body.apply(&[Request::Open { facets }], &view);
        let Some(Answer::Applied(done)) = outcome.answers.pop() else {
            panic!("whole faces open")
        };
        let patch = outcome.patch.unwrap();
        let mut vertices = self.frame.vertices.clone();
        for parents in patch.vertex_parent_offsets.windows(2) {
            let parents = &patch.vertex_parents[parents[0] as usize..parents[1] as usize];
            let at = parents.iter().map(|&parent| vertices[parent as usize]);
            vertices.push(at.sum::<Vector3<f64>>() / parents.len() as f64);
        }
        let before = &self.frame.layout;
        let layout = Layout {
            epoch: before.epoch,
            topology_version: before.topology_version + 1,
            hash: patch.hash,
            cells: (before.cells)
                .patched(&patch.slots, &patch.cells, vertices.len())
                .unwrap()
                .into(),
            dominant: vec![0; vertices.len()],
        };
        let event = |kind| Event {
            kind,
            rule: Some(0),
            position: Vector3::new(1.0, 2.0, 3.0),
            cells: done.cells.clone(),
        };
        let mut events = vec![event(EventKind::Torn { faces: done.opened })];
        let effects = done.effects.iter();
        events.extend(effects.map(|effect| event(EventKind::Followed(*effect))));
        let patch = Some(patch);
        self.publish(
            Arc::new(layout),
            vertices,
            Some(Arc::new(Change { events, patch })),
        );
    }

    /// A step in which something happens that changes no topology.
    pub(super) fn happen(&mut self, events: Vec<Event>) {
        let layout = Arc::clone(&self.frame.layout);
        let patch = None;
        let change = Arc::new(Change { events, patch });
        self.publish(layout, self.frame.vertices.clone(), Some(change));
    }

    fn publish(
        &mut self,
        layout: Arc<Layout>,
        mut vertices: Vec<Vector3<f64>>,
        change: Option<Arc<Change>>,
    ) {
        vertices.iter_mut().for_each(|vertex| vertex.x += 0.01);
        let step = self.frame.step + 1;
        self.frame = Arc::new(Frame {
            layout,
            sequence: step,
            step,
            time_seconds: step as f64 * 0.01,
            vertices,
            change,
            ..Frame::clone(&self.frame)
        });
        let timing = StepTiming::default();
        (self.entry.handle.outlets).publish(Arc::clone(&self.frame), timing);
    }

    /// The newest mesh.
    pub(super) fn truth(&self) -> Grid {
        Grid {
            positions: self.frame.vertices.clone(),
            cells: Cells::clone(&self.frame.layout.cells),
        }
    }

    /// Sequence of the last event.
    pub(super) fn last_event(&self) -> u64 {
        self.entry.handle.outlets.event_range().1
    }

    /// Reads until the newest mesh is shown, and all that came.
    pub(super) async fn catch_up(&self, reader: &mut Subscription) -> Vec<Update> {
        let mut updates = Vec::new();
        while reader.mirror().shown() != Some(self.frame.step + 1) {
            updates.push(reader.next().await.unwrap().unwrap());
        }
        updates
    }
}

/// The mesh, driven by one point: the script alone moves it.
fn scene(mesh: &Grid) -> v1::Scene {
    let points = v1::ExternalPoints {
        labels: vec!["hand".to_owned()],
        rest_positions: Some(v1::Reals::pack(&[0.5; 3], v1::Precision::F64)),
        rate_hz: 100.0,
        ..v1::ExternalPoints::default()
    };
    v1::Scene {
        motion: Some(v1::Motion {
            source: Some(v1::motion::Source::External(points)),
        }),
        mesh: Some(v1::Mesh {
            source: Some(v1::mesh::Source::Grid(grid::to_proto(mesh))),
            ..v1::Mesh::default()
        }),
        ..v1::Scene::default()
    }
}

/// Whether the reader holds the newest mesh, bit for bit.
pub(super) fn assert_mirrored(reader: &Subscription, script: &Script) {
    let mirror = reader.mirror();
    assert_eq!(mirror.grid().unwrap(), Some(script.truth()));
    assert!(mirror.is_proven());
}
