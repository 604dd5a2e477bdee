//! Particles that the server simulates, from scene to frame.

use std::{fs, path::Path};

use sinew_proto::v1::{
    self, Frame, Frames, Indices, Lattice, Motion, Particles, Reals, Scene, mesh, motion,
};
use sinew_tests::{TestServer, live, refused, scenes};
use tonic::Code;

/// A scene of the repository.
pub(crate) fn scene(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../client/scenes/particles");
    let text = fs::read_to_string(folder.join(name).with_extension("toml")).unwrap();
    toml::from_str(&text).unwrap()
}

/// Points, m, of a frame.
pub(crate) fn points(frame: &Frame) -> Vec<[f64; 3]> {
    let numbers = frame.points.as_ref().unwrap().unpack().unwrap();
    numbers.as_chunks::<3>().0.to_vec()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let squares = [0, 1, 2].map(|axis| (b[axis] - a[axis]).powi(2));
    squares.iter().sum::<f64>().sqrt()
}

/// The frames of a scene after so many steps, each counted from the start.
async fn frames(server: &TestServer, name: &str, steps: &[u64]) -> Vec<Frame> {
    let session = server.create(&name.replace('_', "-"), scene(name)).await;
    let subscription = v1::SubscribeRequest {
        content: v1::Content::Points.into(),
        precision: v1::Precision::F64.into(),
        ..session.subscription()
    };
    let (mut found, mut done) = (Vec::new(), 0);
    for &to in steps {
        while done < to {
            let part = (to - done).min(1_000);
            session.step(u32::try_from(part).unwrap()).await.unwrap();
            done += part;
        }
        let mut watcher = session.subscribe(subscription.clone()).await.unwrap();
        found.push(watcher.keyframe().await.frame.unwrap());
    }
    session.delete().await.unwrap();
    found
}

#[test]
fn every_scene_of_the_repository_moves_and_stays_in_bounds() {
    live(async {
        let server = TestServer::start().await;
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../client/scenes/particles");
        let mut seen = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let found = frames(&server, &name, &[0, 1_000]).await;
            let [start, end] = [&found[0], &found[1]].map(points);
            let moved = start.iter().zip(&end).map(|(a, b)| distance(*a, *b));
            let moved = moved.fold(0.0, f64::max);
            assert!(moved > 1e-3 && moved < 50.0, "{name}: {moved}");
            seen += 1;
        }
        assert_eq!(seen, 9);
    });
}

#[test]
fn a_bar_of_plastic_links_keeps_a_bend_and_a_net_breaks() {
    live(async {
        let server = TestServer::start().await;
        let bar = frames(&server, "plastic_bar", &[0, 4_000]).await;
        let [start, end] = [&bar[0], &bar[1]].map(points);
        // Half way along, where nothing is driven.
        assert!(
            start[20][2] - end[20][2] > 0.02,
            "{:?} {:?}",
            start[20],
            end[20]
        );
        let net = frames(&server, "breaking_net", &[0, 900]).await;
        let [start, end] = [&net[0], &net[1]].map(points);
        assert!(distance(start[65], end[65]) > 1.0, "the middle falls out");
        assert!(
            distance(start[13], end[13]) < 0.2,
            "the rim holds what is left"
        );
    });
}

#[test]
fn a_spiral_is_uncoiled_and_recovers_with_its_orientations_in_every_frame() {
    live(async {
        let server = TestServer::start().await;
        let found = frames(&server, "spiral", &[0, 3_000, 13_000]).await;
        let ends = |frame: &Frame| {
            let points = points(frame);
            distance(points[0], points[9])
        };
        let [start, pulled, end] = [0, 1, 2].map(|i| ends(&found[i]));
        assert!(start < 2.6 && pulled > 9.0, "{start} {pulled}");
        assert!((end - start).abs() < 0.15, "{start} {end}");
        for frame in &found {
            let numbers = frame.orientations.as_ref().unwrap().unpack().unwrap();
            let (quaternions, odd) = numbers.as_chunks::<4>();
            assert!(odd.is_empty() && quaternions.len() == 10);
            for q in quaternions {
                let norm: f64 = q.iter().map(|x| x * x).sum();
                assert!((norm - 1.0).abs() < 1e-14, "{norm}");
            }
        }
    });
}

/// One body that spins about z once in four seconds; steps of 0.1 s.
fn spinning() -> Scene {
    let particles = Particles {
        positions: Some(scenes::reals(&[0.0, 0.0, 0.0])),
        frames: Some(Frames {
            spins: Some(scenes::reals(&[0.0, 0.0, std::f64::consts::FRAC_PI_2])),
            moments: Some(scenes::reals(&[1.0, 1.0, 1.0])),
            ..Frames::default()
        }),
        ..Particles::default()
    };
    Scene {
        motion: Some(Motion {
            source: Some(motion::Source::Particles(particles)),
        }),
        mesh: scenes::meshed(mesh::Source::Lattice(Lattice {
            spacing: 0.1,
            radius: 0.2,
            ..Lattice::default()
        })),
        time_step_seconds: 0.1,
        pace: v1::Pace::Unpaced.into(),
        ..Scene::default()
    }
}

#[test]
fn orientations_travel_as_w_x_y_z_and_points_without_any_have_none() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("top", spinning()).await;
        session.step(10).await.unwrap();
        let mut watcher = session.watch().await;
        let frame = watcher.keyframe().await.frame.unwrap();
        let turned = frame.orientations.unwrap().unpack().unwrap();
        let half = std::f64::consts::FRAC_PI_4;
        let expected = [half.cos(), 0.0, 0.0, half.sin()];
        let off = turned.iter().zip(expected).map(|(a, b)| (a - b).abs());
        assert!(
            turned.len() == 4 && off.fold(0.0, f64::max) < 1e-6,
            "{turned:?}"
        );

        let sheet = server.create("sheet", scenes::sheet(3)).await;
        let mut watcher = sheet.watch().await;
        assert_eq!(watcher.keyframe().await.frame.unwrap().orientations, None);
    });
}

/// Points of a ball of radius 1, spread by the golden angle, and the surface that they lie on.
fn ball() -> Scene {
    let at = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 200.0;
        let (sin, cos) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
        let side = (1.0 - z * z).sqrt();
        [side * cos, side * sin, z]
    };
    let positions: Vec<f64> = (0..200).flat_map(at).collect();
    let mut scene = spinning();
    let particles = given(&mut scene);
    particles.positions = Some(scenes::reals(&positions));
    particles.surface = Some(v1::Surface {
        reach: 0.7,
        ..v1::Surface::default()
    });
    particles.frames.as_mut().unwrap().spins = None;
    scene
}

#[test]
fn bodies_of_a_surface_have_its_normals_and_what_is_none_is_refused() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("ball", ball()).await;
        let mut watcher = session.watch().await;
        let frame = watcher.keyframe().await.frame.unwrap();
        let turns = frame.orientations.as_ref().unwrap().unpack().unwrap();
        for (x, [w, i, j, k]) in points(&frame).iter().zip(turns.as_chunks::<4>().0) {
            // The body's x axis in the world.
            let normal = [
                1.0 - 2.0 * (j * j + k * k),
                2.0 * (i * j + w * k),
                2.0 * (i * k - w * j),
            ];
            assert!(distance(normal, *x) < 0.02, "{normal:?} at {x:?}");
        }
        type Case = (fn(&mut v1::Surface), &'static str, &'static str);
        let faults: [Case; 3] = [
            (|s| s.reach = 0.0, "VALUE_OUT_OF_RANGE", "reach"),
            (
                |s| s.triangles = Some(Indices::pack(&[0, 1])),
                "LENGTH_MISMATCH",
                "triangles",
            ),
            (
                |s| s.file = "ball.obj".to_owned(),
                "FILE_NOT_RESOLVED",
                "file",
            ),
        ];
        for (spoil, reason, field) in faults {
            let mut scene = ball();
            spoil(given(&mut scene).surface.as_mut().unwrap());
            let answer = server.try_create(scenes::creation(scene)).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            let path = format!("scene.motion.particles.surface.{field}");
            assert!(format!("{refusal:?}").contains(&path), "{refusal:?}");
        }
    });
}

pub(crate) fn given(scene: &mut Scene) -> &mut Particles {
    match &mut scene.motion.as_mut().unwrap().source {
        Some(motion::Source::Particles(particles)) => particles,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_wrong_with_particles_is_refused_by_its_path() {
    type Spoil = fn(&mut Particles);
    let faults: [(&str, Spoil, &str, &str); 9] = [
        (
            "spiral",
            |p| p.damping = -1.0,
            "VALUE_OUT_OF_RANGE",
            "damping",
        ),
        (
            "spiral",
            |p| p.frames = None,
            "ORIENTATIONS_MISSING",
            "pairs.form",
        ),
        (
            "spiral",
            |p| p.frames.as_mut().unwrap().orientations = Some(scenes::reals(&[1.0; 7])),
            "LENGTH_MISMATCH",
            "frames.orientations",
        ),
        (
            "spiral",
            |p| p.pairs.as_mut().unwrap().bonds = Some(Indices::pack(&[0, 10])),
            "INDEX_OUT_OF_RANGE",
            "pairs.bonds[0]",
        ),
        (
            "spiral",
            |p| p.pairs.as_mut().unwrap().attraction.as_mut().unwrap().law = None,
            "FIELD_MISSING",
            "pairs.attraction.law",
        ),
        (
            "spiral",
            |p| p.integrator = 77,
            "ENUM_UNKNOWN",
            "integrator",
        ),
        (
            "spiral",
            |p| p.forces[1].force.as_mut().unwrap().times = Some(Reals::default()),
            "LENGTH_MISMATCH",
            "forces[1].force.times",
        ),
        (
            "plastic_bar",
            |p| p.driven[1].particle = p.driven[0].particle,
            "PARTICLE_MOVED_TWICE",
            "driven[1].particle",
        ),
        (
            "hanging_chain",
            |p| p.links[0].law = None,
            "FIELD_MISSING",
            "links[0].law",
        ),
    ];
    live(async {
        let server = TestServer::start().await;
        for (name, spoil, reason, field) in faults {
            let mut scene = scene(name);
            spoil(given(&mut scene));
            let answer = server.try_create(scenes::creation(scene)).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            let path = format!("scene.motion.particles.{field}");
            assert!(format!("{refusal:?}").contains(&path), "{refusal:?}");
        }
        assert!(server.names().await.is_empty());
    });
}
