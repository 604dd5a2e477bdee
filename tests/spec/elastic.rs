//! Elastic solids of points, from scene to frame, and by the hand of a client.

use std::{fs, path::Path};

use sinew_proto::v1::{
    self, Drag, ElasticMaterial, ElasticSolid, Frame, Lattice, Motion, MotionFrame, Precision,
    Reals, Scene,
    elastic_solid::{Cloud, Metric, Sight},
    mesh, motion, record_motion_response,
    stream_motion_request::Item,
};
use sinew_tests::{TestServer, TestSession, live, refused, scenes};
use tonic::Code;

/// A scene of the repository, with its cloud inside as the client puts it there.
fn scene(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../client/scenes/elastic");
    let text = fs::read_to_string(folder.join(name).with_extension("toml")).unwrap();
    let mut scene: Scene = toml::from_str(&text).unwrap();
    let solid = given(&mut scene);
    let Some(Cloud::File(file)) = &solid.cloud else {
        panic!("{name} names no file");
    };
    let cloud = sinew_formats::cloud::read(&folder.join(file)).unwrap();
    let numbers: Vec<f64> = cloud
        .positions
        .iter()
        .flat_map(|x| [x.x, x.y, x.z])
        .collect();
    solid.cloud = Some(Cloud::Positions(Reals::pack(&numbers, Precision::F64)));
    scene
}

fn given(scene: &mut Scene) -> &mut ElasticSolid {
    match &mut scene.motion.as_mut().unwrap().source {
        Some(motion::Source::Elastic(solid)) => solid,
        other => panic!("{other:?}"),
    }
}

/// A block of 6 × 4 × 4 points 0.1 m apart that nothing holds.
fn jelly() -> Scene {
    let at = |k: u32| f64::from(k) * 0.1;
    let points = (0..96).flat_map(|i| [at(i % 6), at(i / 6 % 4), at(i / 24)]);
    let solid = ElasticSolid {
        cloud: Some(Cloud::Positions(scenes::reals(&points.collect::<Vec<_>>()))),
        material: Some(ElasticMaterial {
            young: 2e4,
            poisson: 0.3,
            density: 1_000.0,
            ..ElasticMaterial::default()
        }),
        damping: 5.0,
        ..ElasticSolid::default()
    };
    Scene {
        motion: Some(Motion {
            source: Some(motion::Source::Elastic(solid)),
        }),
        mesh: scenes::meshed(mesh::Source::Lattice(Lattice {
            spacing: 0.1,
            radius: 0.12,
            ..Lattice::default()
        })),
        time_step_seconds: 0.01,
        pace: v1::Pace::Unpaced.into(),
        ..Scene::default()
    }
}

/// Points, m, after the last step.
async fn points(session: &TestSession) -> Vec<[f64; 3]> {
    let subscription = v1::SubscribeRequest {
        content: v1::Content::Points.into(),
        precision: Precision::F64.into(),
        ..session.subscription()
    };
    let mut watcher = session.subscribe(subscription).await.unwrap();
    let frame: Frame = watcher.keyframe().await.frame.unwrap();
    let numbers = frame.points.unwrap().unpack().unwrap();
    numbers.as_chunks::<3>().0.to_vec()
}

/// How far the furthest of some points is from where it was.
fn furthest(before: &[[f64; 3]], after: &[[f64; 3]], of: impl Fn(&[f64; 3]) -> bool) -> f64 {
    let moved = before.iter().zip(after).filter(|(x, _)| of(x));
    let ways = moved.map(|(a, b)| (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>());
    ways.fold(0.0, f64::max).sqrt()
}

/// Builds a figure's two scenes and lets them go for a moment: exponents of 15 ask for small steps on irregular clouds.
fn figure_moves(figure: &str) {
    live(async {
        let server = TestServer::start().await;
        for name in [figure.to_owned(), format!("{figure}_radial")] {
            let mut scene = scene(&name);
            scene.time_step_seconds = 1e-3;
            given(&mut scene).gravity = Some(v1::Vector3 {
                z: -9.81,
                ..v1::Vector3::default()
            });
            let session = server.create(&name.replace('_', "-"), scene).await;
            let before = points(&session).await;
            session.step(1).await.unwrap();
            let moved = furthest(&before, &points(&session).await, |_| true);
            assert!(moved > 1e-6 && moved < 1e-3, "{name}: {moved}");
        }
    });
}

#[test]
fn the_bars_in_space_move_and_stay_in_bounds() {
    figure_moves("two_bars_3d");
}

#[test]
fn the_pants_move_and_stay_in_bounds() {
    figure_moves("pants");
}

#[test]
fn the_octopus_moves_and_stays_in_bounds() {
    figure_moves("octopus");
}

#[test]
fn the_bars_in_the_plane_move_and_stay_in_bounds() {
    figure_moves("two_bars_2d");
}

/// The bars of the paper as a lattice: the upper one is held, the lower one hangs from the block that joins them.
fn lattice_bars(exponent: f64) -> Scene {
    let mut points = Vec::new();
    for row in 0..11_u32 {
        let columns = if row == 5 { 5 } else { 40 };
        for column in 0..columns {
            points.extend([f64::from(column) * 0.1, f64::from(row) * 0.1, 0.0]);
        }
    }
    let corner = |x, y| Some(v1::Vector3 { x, y, z: 0.0 });
    let mut scene = jelly();
    let solid = given(&mut scene);
    solid.cloud = Some(Cloud::Positions(scenes::reals(&points)));
    solid.dimension = v1::SolidDimension::Plane.into();
    solid.metric = Some(Metric::Geodesic(v1::GeodesicMetric { exponent }));
    solid.sight = Some(Sight::Reach(0.25));
    solid.fixed_boxes = vec![v1::Box {
        low: corner(-1.0, 0.55),
        high: corner(9.0, 9.0),
    }];
    solid.gravity = corner(0.0, -0.01);
    solid.damping = 0.0;
    scene.time_step_seconds = 0.1;
    scene
}

#[test]
fn of_two_bars_the_lower_bends_along_the_body_and_sticks_by_straight_distances() {
    live(async {
        let server = TestServer::start().await;
        let mut sinks = Vec::new();
        for (name, exponent) in [("along", 15.0), ("straight", 1.0)] {
            let session = server.create(name, lattice_bars(exponent)).await;
            let before = points(&session).await;
            session.step(100).await.unwrap();
            let tip = |x: &[f64; 3]| x[0] > 3.85 && x[1] < 0.45;
            sinks.push(furthest(&before, &points(&session).await, tip));
        }
        assert!(sinks[0] > 0.1 && sinks[1] < 0.05 * sinks[0], "{sinks:?}");
    });
}

#[test]
fn a_body_that_breaks_at_a_stretch_falls_apart_where_it_is_pulled_apart() {
    live(async {
        let server = TestServer::start().await;
        let mut lengths = Vec::new();
        for (name, stretch) in [("whole", None), ("torn", Some(1.5))] {
            let mut scene = jelly();
            let solid = given(&mut scene);
            solid.break_at_stretch = stretch;
            // Left third to the left, right third to the right.
            let way = |i: u32| match i % 6 {
                0 | 1 => [-3.0, 0.0, 0.0],
                4 | 5 => [3.0, 0.0, 0.0],
                _ => [0.0; 3],
            };
            solid.velocities = Some(scenes::reals(&(0..96).flat_map(way).collect::<Vec<_>>()));
            let session = server.create(name, scene).await;
            session.step(200).await.unwrap();
            let ends = points(&session).await;
            lengths.push(furthest(&ends[..1], &ends[5..6], |_| true));
        }
        assert!((lengths[0] - 0.5).abs() < 0.05, "{lengths:?}");
        assert!(lengths[1] > 1.0, "{lengths:?}");
    });
}

fn drags(sequence: u64, drags: &[(&str, Option<[f64; 3]>)]) -> Item {
    let drag = |&(point, to): &(&str, Option<[f64; 3]>)| Drag {
        point: point.to_owned(),
        position: to.map(|[x, y, z]| v1::Vector3 { x, y, z }),
    };
    Item::Frame(MotionFrame {
        sequence,
        drags: drags.iter().map(drag).collect(),
        ..MotionFrame::default()
    })
}

#[test]
fn a_point_goes_where_a_client_drags_it_the_body_follows_and_a_record_replays_it_exactly() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("jelly", jelly()).await;
        let mut record = session.record().await.unwrap();
        let mut source = session.source_in_order(&[]).await.unwrap();
        // Grows with the steps, of which the first frame is late: it comes before the next.
        session.step(3).await.unwrap();
        source
            .send_item(drags(1, &[("5", Some([0.55, 0.0, 0.05]))]))
            .await;
        source
            .send_item(drags(
                30,
                &[("5", Some([0.9, 0.0, 0.0])), ("0", Some([0.0; 3]))],
            ))
            .await;
        source
            .send_item(drags(60, &[("5", None), ("0", None)]))
            .await;
        source.acked(60).await.unwrap();
        session.step(1).await.unwrap();
        assert!(
            furthest(&points(&session).await[5..6], &[[0.55, 0.0, 0.05]], |_| {
                true
            }) < 1e-9
        );
        session.step(50).await.unwrap();
        let held = points(&session).await;
        assert!(furthest(&[held[5], held[0]], &[[0.9, 0.0, 0.0], [0.0; 3]], |_| true) < 1e-9);
        assert!(held[4][0] > 0.45, "its neighbour follows: {:?}", held[4]);
        let end = session.step(300).await.unwrap();
        let free = points(&session).await;
        let length = furthest(&free[..1], &free[5..6], |_| true);
        assert!(
            (length - 0.5).abs() < 0.02,
            "released, it is itself again: {length}"
        );

        let again = server.create("again", jelly()).await;
        let mut source = again.source_in_order(&[]).await.unwrap();
        let mut digest = String::new();
        for step in 0..=354 {
            match record.message().await.unwrap().unwrap().item.unwrap() {
                record_motion_response::Item::Start(start) => assert_eq!(start.step, 0),
                record_motion_response::Item::Mapping(_)
                | record_motion_response::Item::Edits(_) => panic!("nothing was changed"),
                record_motion_response::Item::Frame(frame) => {
                    assert_eq!(frame.sequence, step);
                    source.send_item(Item::Frame(frame)).await;
                    source.acked(step).await.unwrap();
                    digest = again.step(1).await.unwrap().digest;
                }
            }
        }
        assert_eq!(digest, end.digest);
    });
}

#[test]
fn drags_of_no_point_or_to_nowhere_and_positions_are_refused() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("jelly", jelly()).await;
        for (item, reason) in [
            (drags(1, &[("96", None)]), "LABEL_UNKNOWN"),
            (
                drags(1, &[("1", Some([f64::NAN, 0.0, 0.0]))]),
                "VALUE_NOT_FINITE",
            ),
        ] {
            let mut source = session.source_in_order(&[]).await.unwrap();
            source.send_item(item).await;
            refused(source.ending().await, Code::InvalidArgument, reason);
        }
        let small = server.create("tissue", scenes::small()).await;
        let mut source = small.source().await;
        let mut both = MotionFrame::default();
        if let Item::Frame(frame) = source.frame(1, &scenes::rest(8), &[]) {
            both = frame;
        }
        both.drags.push(Drag::default());
        source.send_item(Item::Frame(both)).await;
        refused(source.ending().await, Code::InvalidArgument, "CONFLICT");
    });
}

#[test]
fn what_is_wrong_with_a_solid_is_refused_by_its_path() {
    type Spoil = fn(&mut ElasticSolid);
    let faults: [(Spoil, &str, &str); 11] = [
        (|s| s.material = None, "FIELD_MISSING", "material"),
        (
            |s| material(s).young = -1.0,
            "VALUE_OUT_OF_RANGE",
            "material.young",
        ),
        (
            |s| material(s).poisson = 0.5,
            "VALUE_OUT_OF_RANGE",
            "material.poisson",
        ),
        (
            |s| material(s).density = 0.0,
            "VALUE_OUT_OF_RANGE",
            "material.density",
        ),
        (|s| material(s).law = 9, "ENUM_UNKNOWN", "material.law"),
        (|s| s.cloud = None, "FIELD_MISSING", "positions"),
        (
            |s| s.cloud = Some(Cloud::File("a.ply".to_owned())),
            "FILE_NOT_RESOLVED",
            "file",
        ),
        (
            |s| s.sight = Some(Sight::ReachSpacings(0.5)),
            "VALUE_OUT_OF_RANGE",
            "reach_spacings",
        ),
        (
            |s| s.break_at_stretch = Some(0.5),
            "VALUE_OUT_OF_RANGE",
            "break_at_stretch",
        ),
        (
            |s| s.metric = Some(Metric::Geodesic(v1::GeodesicMetric { exponent: 0.0 })),
            "VALUE_OUT_OF_RANGE",
            "geodesic.exponent",
        ),
        (
            |s| s.fixed = Some(v1::Indices::pack(&[96])),
            "INDEX_OUT_OF_RANGE",
            "fixed[0]",
        ),
    ];
    live(async {
        let server = TestServer::start().await;
        for (spoil, reason, field) in faults {
            let mut scene = jelly();
            spoil(given(&mut scene));
            let answer = server.try_create(scenes::creation(scene)).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            let path = format!("scene.motion.elastic.{field}");
            assert!(format!("{refusal:?}").contains(&path), "{refusal:?}");
        }
        let mut uploaded = jelly();
        given(&mut uploaded).cloud = Some(Cloud::Asset("assets/none".to_owned()));
        let answer = server.try_create(scenes::creation(uploaded)).await;
        refused(answer, Code::NotFound, "ASSET_UNKNOWN");
    });
}

fn material(solid: &mut ElasticSolid) -> &mut ElasticMaterial {
    solid.material.as_mut().unwrap()
}
