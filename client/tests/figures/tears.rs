//! The figures of the paper on motion/geometry mapping that tear, through a server: each shows what it is said to show.

use sinew_client::{Client, SceneFile};
use sinew_proto::v1::{self, event::Kind};

use crate::{load, scenes, start};

/// What a scene came to.
struct Torn {
    /// Of the mesh at rest and at the end.
    vertices: [u32; 2],
    cells: [u32; 2],
    events: Vec<v1::Event>,
}

impl Torn {
    fn steps_of(&self, is: fn(&Kind) -> bool) -> Vec<u64> {
        let events = self.events.iter();
        let of_kind = events.filter(|event| event.kind.as_ref().is_some_and(is));
        of_kind.map(|event| event.step).collect()
    }

    fn tears(&self) -> Vec<u64> {
        self.steps_of(|kind| matches!(kind, Kind::Torn(_)))
    }
}

async fn torn(client: &Client, scene: v1::Scene, steps: u32) -> Torn {
    let create = v1::CreateSessionRequest {
        scene: Some(scene),
        ..v1::CreateSessionRequest::default()
    };
    let rest = client.create_session(create).await.expect("a session");
    let step = v1::StepRequest {
        name: rest.name.clone(),
        steps,
        expected_step: None,
    };
    client.step(step).await.expect("steps");
    let end = client.session(&rest.name).await.expect("a session");
    let mut events = Vec::new();
    loop {
        let list = v1::ListEventsRequest {
            session: rest.name.clone(),
            after_event: Some(events.last().map_or(0, |event: &v1::Event| event.sequence)),
            ..v1::ListEventsRequest::default()
        };
        let page = client.list_events(list).await.expect("events").events;
        if page.is_empty() {
            break;
        }
        events.extend(page);
    }
    Torn {
        vertices: [rest.vertex_count, end.vertex_count],
        cells: [rest.cell_count, end.cell_count],
        events,
    }
}

async fn scene(client: &Client, file: &str) -> v1::Scene {
    let file = SceneFile::load(&scenes().join(file)).expect("a scene");
    file.scene_for(client).await.expect("a scene")
}

/// Each view of a sweep file.
async fn views(client: &Client, file: &str) -> Vec<Torn> {
    let sweep = load(file);
    let mut views = Vec::new();
    for view in &sweep.views {
        let mut scene = sweep.scene.scene_for(client).await.expect("a scene");
        scene.mapping = Some(view.mapping.clone());
        scene.rules.clone_from(&view.rules);
        let frames = u32::try_from(sweep.frames).expect("few frames");
        views.push(torn(client, scene, frames).await);
    }
    views
}

#[tokio::test]
async fn figure_4_a_frontier_along_vertices_opens_and_one_between_them_splits_cells() {
    let (server, client) = start().await;
    let [along, between] = &views(&client, "figure-4.toml").await[..] else {
        panic!("two views")
    };
    // Two by two cubes across: nine vertices of the section become eighteen.
    assert_eq!(along.cells[0], along.cells[1]);
    assert_eq!(along.vertices[0] + 9, along.vertices[1]);
    // The four cubes between the areas become two prisms each, with a section of their own before it opens.
    assert_eq!(between.cells[0] + 4, between.cells[1]);
    assert_eq!(between.vertices[0] + 18, between.vertices[1]);
    for view in [along, between] {
        assert_eq!(view.tears().len(), 1);
        let born = view.steps_of(|kind| matches!(kind, Kind::FragmentBorn(_)));
        assert_eq!(born, view.tears(), "one piece comes loose, at once");
    }
    server.shutdown().await;
}

#[tokio::test]
async fn figure_5_ill_defined_frontiers_are_drawn_anew_until_the_bar_tears() {
    let (server, client) = start().await;
    for view in &views(&client, "figure-5.toml").await {
        assert_eq!(view.tears().len(), 1);
        let born = view.steps_of(|kind| matches!(kind, Kind::FragmentBorn(_)));
        assert_eq!(born, view.tears(), "one piece comes loose, at once");
    }
    server.shutdown().await;
}

#[tokio::test]
async fn figure_6_tetrahedra_split_through_edges_and_through_edges_and_vertices() {
    let (server, client) = start().await;
    let [edges, vertices] = &views(&client, "figure-6.toml").await[..] else {
        panic!("two views")
    };
    let split = |view: &Torn| view.cells[1] - view.cells[0];
    assert!(split(edges) > 0 && split(vertices) > 0);
    // Where the frontier meets vertices that follow both points, there is less to split.
    assert!(split(vertices) < split(edges));
    server.shutdown().await;
}

#[tokio::test]
async fn figure_9_the_higher_the_threshold_the_later_and_the_less_a_bar_tears() {
    let (server, client) = start().await;
    let mut before: Option<Vec<u64>> = None;
    for threshold in [0.45, 0.7, 0.9, 1.5] {
        let mut scene = scene(&client, "torn-bar.toml").await;
        scene.rules[0].threshold = threshold;
        let steps = torn(&client, scene, 1000).await.tears();
        if let Some(before) = before.replace(steps.clone()) {
            assert!(steps.len() <= before.len(), "{steps:?} after {before:?}");
            let first = steps.first().copied().unwrap_or(u64::MAX);
            assert!(before[0] < first, "{steps:?} after {before:?}");
        }
    }
    assert_eq!(
        before,
        Some(Vec::new()),
        "nothing tears beyond all that is reached"
    );
    server.shutdown().await;
}

#[tokio::test]
async fn figure_10_a_filled_figure_fractures_the_earlier_the_lower_the_threshold() {
    let (server, client) = start().await;
    let views = views(&client, "figure-10.toml").await;
    let first: Vec<u64> = views.iter().map(|view| view.tears()[0]).collect();
    assert!(first.is_sorted_by(|a, b| a > b), "{first:?}");
    for view in &views {
        let born = view.steps_of(|kind| matches!(kind, Kind::FragmentBorn(_)));
        assert!(born.len() >= 2, "it comes apart in pieces");
    }
    server.shutdown().await;
}

#[tokio::test]
async fn figure_11_a_block_fractures_inside_before_a_fracture_reaches_its_surface() {
    let (server, client) = start().await;
    let scene = scene(&client, "inner-fracture.toml").await;
    let torn = torn(&client, scene, 100).await;
    let inside = torn.steps_of(|kind| matches!(kind, Kind::InnerFracture(_)));
    let opened = torn.steps_of(|kind| matches!(kind, Kind::FractureOpened(_)));
    assert!(
        !inside.is_empty() && !opened.is_empty(),
        "{inside:?} {opened:?}"
    );
    assert!(inside[0] < opened[0], "{inside:?} {opened:?}");
    server.shutdown().await;
}
