//! What is shown of a mesh that comes apart.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use std::fs::File;
use std::io::BufReader;
use std::sync::Arc;
use std::time::Duration;

use nalgebra::Vector3;
use re_log_encoding::DecoderApp;
use re_sdk::external::arrow::array::Array as _;
use re_sdk::external::re_log_types::LogMsg;
use re_sdk::log::Chunk;
use re_sdk::{ComponentDescriptor, StoreKind};
use re_sdk_types::archetypes::{Mesh3D, Points3D, Scalars, TextLog};
use sinew_engine::{Change, Event, EventKind, Frame, Layout, Measured, Patch, Seam, SeamKind};
use sinew_mapping::{Filter, Recipe, Reference, Rule, Weighting, bind};
use sinew_mesh::{Cells, shapes};
use sinew_tearing::{Body, Outcome, Request, View};
use sinew_viewer::{Config, Viewer};
use support::Bar;

mod support;

/// The next step's frame, of a mesh with these cells.
fn next(last: &Frame, cells: Cells, change: Change) -> Frame {
    let vertices = last.vertices.len();
    let layout = Layout {
        epoch: 1,
        topology_version: last.layout.topology_version + 1,
        hash: cells.hash(),
        dominant: vec![0; vertices],
        cells: cells.into(),
    };
    Frame {
        layout: Arc::new(layout),
        step: last.step + 1,
        change: Some(Arc::new(change)),
        ..last.clone()
    }
}

fn event(kind: EventKind) -> Event {
    Event {
        kind,
        rule: Some(0),
        position: Vector3::new(0.5, 0.5, 0.5),
        cells: Vec::new(),
    }
}

/// Changes a body that one point drives.
fn apply(body: &mut Body, request: Request) -> Outcome {
    let recipe = Recipe {
        weighting: Weighting::default(),
        filter: Filter::KeepK(1),
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    };
    let points = [Vector3::zeros()];
    let binding = bind(body.rest(), &points, &[true], &recipe).unwrap();
    let now = body.rest().to_vec();
    let view = View {
        binding: &binding,
        points: &points,
        now: &now,
    };
    body.apply(&[request], &view)
}

/// The frame of a body before anything happened to it.
fn whole(body: &Body) -> Frame {
    let vertices = body.rest().to_vec();
    let layout = Layout {
        dominant: vec![0; vertices.len()],
        cells: body.cells().into(),
        epoch: 1,
        topology_version: 0,
        hash: 0,
    };
    Frame {
        vertices,
        layout: Arc::new(layout),
        ..Bar::new(1, 1).at(0)
    }
}

/// Two slabs of four cubes come apart face by face, and together again. Each change and a step after it.
fn frames() -> (Vec<Frame>, usize) {
    let (mut body, _) = Body::new(shapes::hexahedra(2, 2, 2)).unwrap();
    let measured = |greatest| Measured {
        rule: 0,
        greatest,
        threshold: 0.5,
    };
    let mut frame = whole(&body);
    frame.measures = vec![measured(0.0)];
    let cells = body.cells();
    let (mut frames, mut seams) = (vec![frame.clone()], Vec::new());
    for facet in [[0, 1], [2, 3], [4, 5], [6, 7]] {
        let facets = vec![facet];
        let patch = apply(&mut body, Request::Open { facets }).patch.unwrap();
        let appended = patch.vertex_parents.iter();
        let at: Vec<_> = appended.map(|&v| frame.vertices[v as usize]).collect();
        frame.vertices.extend(at);
        seams.extend(patch.seams.iter().map(|seam| Seam {
            kind: SeamKind::Closed,
            ..seam.clone()
        }));
        let change = Change {
            events: vec![event(EventKind::Torn { faces: 1 })],
            patch: Some(patch),
        };
        frame = next(&frame, body.cells(), change);
        frame.measures = vec![measured(0.6)];
        frames.push(frame.clone());
        frame.step += 1;
        frame.change = None;
        frames.push(frame.clone());
    }
    let torn = frames.len();
    let patch = Some(Patch {
        vertex_parent_offsets: vec![0],
        seams,
        ..Patch::default()
    });
    let events = vec![event(EventKind::Glued { faces: 4 })];
    frames.push(next(&frame, cells, Change { events, patch }));
    (frames, torn)
}

/// The recording of some frames.
fn recorded(frames: &[Frame], interval: Duration) -> Vec<Chunk> {
    let folder = tempfile::tempdir().unwrap();
    let viewer = Viewer::start(Config {
        recordings: Some(folder.path().to_owned()),
        interval,
        ..Config::default()
    })
    .unwrap();
    let publisher = viewer.open(&support::session("torn")).unwrap();
    for frame in frames {
        publisher.publish(support::shown(frame.clone()));
    }
    drop(publisher);
    viewer.shutdown(Duration::from_secs(60)).unwrap();
    let file = BufReader::new(File::open(folder.path().join("torn.rrd")).unwrap());
    let chunks = DecoderApp::decode_lazy(file).filter_map(|message| match message.unwrap() {
        LogMsg::ArrowMsg(store, message) if store.kind() == StoreKind::Recording => {
            Some(Chunk::from_arrow_msg(&message).unwrap())
        }
        LogMsg::ArrowMsg(..) | LogMsg::SetStoreInfo(_) | LogMsg::BlueprintActivationCommand(_) => {
            None
        }
    });
    chunks.collect()
}

/// The lengths of a component, row by row, where an entity has it.
fn lengths(chunks: &[Chunk], entity: &str, component: &ComponentDescriptor) -> Vec<usize> {
    let of = chunks
        .iter()
        .filter(|chunk| chunk.entity_path().to_string() == entity);
    let arrays = of.filter_map(|chunk| chunk.components().get_array(component.component));
    arrays
        .flat_map(|array| {
            (0..array.len())
                .map(|row| array.value(row).len())
                .collect::<Vec<_>>()
        })
        .collect()
}

/// The last of a component.
fn last(frames: &[Frame], entity: &str, component: &ComponentDescriptor) -> Option<usize> {
    // The last frame is never replaced.
    let chunks = recorded(frames, Duration::ZERO);
    lengths(&chunks, entity, component).last().copied()
}

#[test]
fn what_came_apart_is_drawn_by_itself_until_it_closes() {
    let (frames, torn) = frames();
    let triangles = Mesh3D::descriptor_triangle_indices();
    // Six sides of four squares.
    assert_eq!(last(&frames[..1], "/mesh", &triangles), Some(48));
    assert_eq!(last(&frames[..1], "/fracture", &triangles), None);
    assert_eq!(last(&frames[..2], "/fracture", &triangles), Some(4));
    assert_eq!(last(&frames[..torn], "/mesh", &triangles), Some(48));
    assert_eq!(last(&frames[..torn], "/fracture", &triangles), Some(16));
    assert_eq!(last(&frames, "/mesh", &triangles), Some(48));
    // Cleared, or never drawn where no frame between was taken.
    let closed = last(&frames, "/fracture", &triangles);
    assert!(matches!(closed, None | Some(0)), "{closed:?}");
}

#[test]
fn what_came_apart_keeps_its_colour_when_it_is_cut() {
    let (mut body, _) = Body::new(shapes::hexahedra(2, 1, 1)).unwrap();
    let mut frames = vec![whole(&body)];
    // One face opens; the cell beside it becomes eight, and all of these but one, away from the fracture, eight each.
    // The faces of that one to the outside become hexagons.
    let (one, seven) = (vec![0], (2..9).collect());
    let facets = vec![[0, 1]];
    let requests = [
        (Request::Open { facets }, 2 * 10, 2 * 2),
        (Request::Subdivide { cells: one }, 2 * (5 + 20), 2 * (1 + 4)),
        (
            Request::Subdivide { cells: seven },
            2 * (5 + 68) + 3 * 4,
            2 * (1 + 16),
        ),
    ];
    let triangles = Mesh3D::descriptor_triangle_indices();
    for (request, plain, torn) in requests {
        let patch = apply(&mut body, request).patch.unwrap();
        let mut frame = frames.last().unwrap().clone();
        frame.vertices = body.rest().to_vec();
        let events = vec![event(EventKind::Divided)];
        let patch = Some(patch);
        frames.push(next(&frame, body.cells(), Change { events, patch }));
        assert_eq!(last(&frames, "/mesh", &triangles), Some(plain));
        assert_eq!(last(&frames, "/fracture", &triangles), Some(torn));
    }
}

#[test]
fn no_event_is_left_out_however_few_frames_are_drawn() {
    let (frames, _) = frames();
    // An hour between frames: the last one is drawn, all others are replaced.
    let chunks = recorded(&frames, Duration::from_secs(3600));
    let lines = lengths(&chunks, "/events", &TextLog::descriptor_text());
    assert_eq!(lines, [1; 5]);
    let places = lengths(&chunks, "/events/places", &Points3D::descriptor_positions());
    assert_eq!(places, [1; 5]);
    let drawn = lengths(&chunks, "/mesh", &Mesh3D::descriptor_vertex_positions());
    assert!(drawn.len() < frames.len());
}

#[test]
fn measures_stand_beside_their_thresholds() {
    let (frames, _) = frames();
    let chunks = recorded(&frames[..3], Duration::ZERO);
    let plotted = lengths(&chunks, "/plots/measures/0", &Scalars::descriptor_scalars());
    assert!(!plotted.is_empty() && plotted.iter().all(|&values| values == 2));
}
