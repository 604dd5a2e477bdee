//! Particles and links of simulated networks, read one by one.

use sinew_proto::v1::{
    self, Indices, Integrator, LinkIndex, LinkSelection, Modules, Precision, Probe,
    ReadModulesRequest, Reals, Scene, links, probe,
};
use sinew_tests::{TestServer, live, refused, scenes};
use tonic::Code;

use crate::particles::{given, scene};

type Vector = [f64; 3];

fn vectors(column: &Option<Reals>) -> Vec<Vector> {
    let numbers = column.as_ref().unwrap().unpack().unwrap();
    numbers.as_chunks::<3>().0.to_vec()
}

fn indices(column: &Option<Indices>) -> Vec<u32> {
    column.as_ref().unwrap().unpack().unwrap()
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

/// All modules, in the engine's own precision.
fn all() -> ReadModulesRequest {
    ReadModulesRequest {
        precision: Precision::F64.into(),
        ..ReadModulesRequest::default()
    }
}

fn named(particles: &[u32], batch: u32, links: &[u32]) -> ReadModulesRequest {
    ReadModulesRequest {
        particles: Some(Indices::pack(particles)),
        links: vec![LinkSelection {
            batch,
            links: Some(Indices::pack(links)),
        }],
        ..all()
    }
}

const WEIGHT: f64 = 0.05 * 9.81;

/// The chain of the repository, with so much drag that it comes to hang, N s/m.
fn chain(damping: f64) -> Scene {
    let mut scene = scene("hanging_chain");
    given(&mut scene).damping = damping;
    scene
}

#[test]
fn each_link_of_a_hanging_chain_carries_what_hangs_below_it() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("chain", chain(0.2)).await;
        for _ in 0..3 {
            session.step(10_000).await.unwrap();
        }
        let read = session.read_modules(all()).await.unwrap();
        assert_eq!((read.step, read.links.len()), (30_000, 1));
        let forces = vectors(&read.links[0].forces);
        assert_eq!(forces.len(), 20);
        for (link, force) in forces.iter().enumerate() {
            let below = (20 - link) as f64 * WEIGHT;
            assert!(
                (force[2] - below).abs() < 1e-9,
                "{link}: {force:?}, {below}"
            );
            assert!(force[0].abs() < 1e-9 && force[1] == 0.0);
        }
        // Every mass rests: links hold its weight. The first is fixed, and all of it hangs on it.
        let loads = vectors(&read.forces);
        assert!((loads[0][2] + 20.0 * WEIGHT).abs() < 1e-9);
        for load in &loads[1..] {
            assert!((load[2] - WEIGHT).abs() < 1e-9, "{load:?}");
        }
    });
}

#[test]
fn links_of_a_chain_in_motion_pull_by_the_law_of_damped_springs() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("chain", chain(0.01)).await;
        session.step(700).await.unwrap();
        let Modules {
            positions,
            velocities,
            forces,
            torques,
            links,
            ..
        } = session.read_modules(all()).await.unwrap();
        let (x, v) = (vectors(&positions), vectors(&velocities));
        assert_eq!(torques, None);
        // The drag on every particle, then all that links do.
        let mut expected: Vec<Vector> = v.iter().map(|v| v.map(|v| -0.01 * v)).collect();
        let ends = indices(&links[0].ends);
        for ([a, b], found) in ends
            .as_chunks::<2>()
            .0
            .iter()
            .zip(vectors(&links[0].forces))
        {
            let [a, b] = [*a as usize, *b as usize];
            let r = minus(x[b], x[a]);
            let length = dot(r, r).sqrt();
            let rate = dot(minus(v[b], v[a]), r) / length;
            let force = -500.0 * (length - 0.1) - 0.05 * rate;
            for axis in 0..3 {
                let along = force * r[axis] / length;
                assert!((found[axis] - along).abs() < 1e-10, "{found:?}");
                expected[b][axis] += along;
                expected[a][axis] -= along;
            }
        }
        for (found, expected) in vectors(&forces).into_iter().zip(expected) {
            let off = minus(found, expected);
            assert!(dot(off, off).sqrt() < 1e-9, "{found:?} {expected:?}");
        }
    });
}

#[test]
fn broken_links_are_told_and_pull_no_more() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("net", scene("breaking_net")).await;
        let whole = session.read_modules(named(&[], 0, &[])).await.unwrap();
        assert!(indices(&whole.links[0].broken).is_empty());
        session.step(900).await.unwrap();
        let torn = session.read_modules(named(&[], 0, &[])).await.unwrap();
        let broken = indices(&torn.links[0].broken);
        assert!(!broken.is_empty() && broken.len() < indices(&torn.links[0].links).len());
        let forces = vectors(&torn.links[0].forces);
        for &link in &broken {
            assert_eq!(forces[link as usize], [0.0; 3]);
        }
        // Some alone, in the order asked for, one of them twice.
        let some = [broken[1], 0, broken[0], 0];
        let read = session.read_modules(named(&[65], 0, &some)).await.unwrap();
        assert_eq!(indices(&read.links[0].links), some);
        let picked = some.map(|link| forces[link as usize]);
        assert_eq!(vectors(&read.links[0].forces), picked);
        assert_eq!(indices(&read.links[0].broken), [broken[1], broken[0]]);
        assert_eq!(indices(&read.particles), [65]);
    });
}

/// Laws, and what acts on the second end, along x, 1.5 m from the first, led there from 1 m at 1 m/s.
fn laws() -> [(links::Law, f64); 8] {
    let column = |value: f64| Some(scenes::reals(&[value]));
    let elastic = |stiffness: f64, damping: f64| v1::Elastic {
        stiffness: column(stiffness),
        damping: column(damping),
        rest_lengths: column(1.0),
    };
    let plastic = v1::Plastic {
        stiffness: column(10.0),
        damping: None,
        rest_lengths: column(1.0),
        yields: column(0.1),
    };
    let breaking = v1::Breaking {
        stiffness: column(10.0),
        damping: None,
        rest_lengths: column(1.0),
        elongations: column(0.4),
    };
    let friction = v1::DryFriction {
        stiffness: column(10.0),
        limits: column(3.0),
    };
    let table = v1::ForceTable {
        lengths: Some(scenes::reals(&[1.0, 1.4, 2.0])),
        forces: Some(scenes::reals(&[0.0, -2.0, -8.0])),
    };
    [
        (links::Law::Spring(elastic(10.0, 0.0)), -5.0),
        (links::Law::Spring(elastic(0.0, 3.0)), -3.0),
        (links::Law::Spring(elastic(10.0, 3.0)), -8.0),
        (links::Law::Contact(elastic(10.0, 3.0)), 0.0),
        (links::Law::Breaking(breaking), 0.0),
        (links::Law::Plastic(plastic), -1.0),
        (links::Law::Friction(friction), -3.0),
        (links::Law::Table(table), -3.0),
    ]
}

/// A fixed particle and one that is led away from it, with a link of each law between them.
pub(crate) fn each_law() -> Scene {
    let link = |(law, _)| v1::Links {
        ends: Some(Indices::pack(&[0, 1])),
        law: Some(law),
    };
    let mut scene = scenes::sheet(3);
    scene.motion = Some(v1::Motion {
        source: Some(v1::motion::Source::Particles(v1::Particles {
            positions: Some(scenes::reals(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0])),
            fixed: Some(Indices::pack(&[0])),
            driven: vec![v1::Driven {
                particle: 1,
                path: Some(v1::Track {
                    times: Some(scenes::reals(&[0.0, 1.0])),
                    values: Some(scenes::reals(&[1.0, 0.0, 0.0, 2.0, 0.0, 0.0])),
                }),
            }],
            links: laws().into_iter().map(link).collect(),
            ..v1::Particles::default()
        })),
    });
    scene
}

#[test]
fn each_kind_of_link_of_a_scene_reads_by_its_law() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("all", each_law()).await;
        session.step(500).await.unwrap();
        let read = session.read_modules(all()).await.unwrap();
        for (links, (law, expected)) in read.links.iter().zip(laws()) {
            let force = vectors(&links.forces)[0];
            assert!((force[0] - expected).abs() < 1e-9, "{law:?}: {force:?}");
        }
        let broken = |links: &&v1::LinkModules| !indices(&links.broken).is_empty();
        let batches = read.links.iter().filter(broken).map(|links| links.batch);
        assert_eq!(batches.collect::<Vec<_>>(), [4]);
    });
}

#[test]
fn reading_changes_nothing() {
    live(async {
        let server = TestServer::start().await;
        let mut scene = scene("oscillating_cluster");
        given(&mut scene).integrator = Integrator::ImplicitMidpoint.into();
        let read = server.create("read", scene.clone()).await;
        let alone = server.create("alone", scene).await;
        for _ in 0..60 {
            read.step(3).await.unwrap();
            alone.step(3).await.unwrap();
            let modules = read.read_modules(all()).await.unwrap();
            assert!(modules.links.is_empty());
        }
        assert_eq!(read.digest().await, alone.digest().await);
    });
}

fn probing(probes: &[(&str, probe::Module)]) -> Scene {
    let probe = |(name, module): &(&str, probe::Module)| Probe {
        name: (*name).to_owned(),
        module: Some(*module),
    };
    Scene {
        probes: probes.iter().map(probe).collect(),
        ..chain(0.01)
    }
}

const fn link(batch: u32, link: u32) -> probe::Module {
    probe::Module::Link(LinkIndex { batch, link })
}

#[test]
fn probes_are_read_into_every_frame() {
    live(async {
        let server = TestServer::start().await;
        let probes = [("top", link(0, 0)), ("end", probe::Module::Particle(20))];
        let session = server.create("chain", probing(&probes)).await;
        let plain = server.create("plain", probing(&[])).await;
        let mut watcher = session.watch().await;
        let mut frame = watcher.keyframe().await.frame.unwrap();
        for _ in 0..20 {
            let read = session.read_modules(named(&[20], 0, &[0])).await.unwrap();
            let expected = [
                vectors(&read.links[0].forces)[0],
                vectors(&read.positions)[0],
            ];
            assert_eq!(
                (vectors(&frame.readings), frame.step),
                (expected.to_vec(), read.step)
            );
            session.step(1).await.unwrap();
            frame = watcher.frame().await;
        }
        plain.step(20).await.unwrap();
        assert_eq!(session.digest().await, plain.digest().await);
        let frame = plain.watch().await.keyframe().await.frame.unwrap();
        assert_eq!(frame.readings, None);
    });
}

#[test]
fn modules_that_are_not_there_are_refused_by_name() {
    let cases = [
        (
            named(&[0, 21], 0, &[]),
            "INDEX_OUT_OF_RANGE",
            "particles[1]",
        ),
        (named(&[], 1, &[]), "INDEX_OUT_OF_RANGE", "links[0].batch"),
        (
            named(&[], 0, &[3, 20]),
            "INDEX_OUT_OF_RANGE",
            "links[0].links[1]",
        ),
        (named(&[7; 32_749], 0, &[]), "TOO_MANY_MODULES", "particles"),
        (
            ReadModulesRequest {
                precision: 9,
                ..all()
            },
            "ENUM_UNKNOWN",
            "precision",
        ),
    ];
    live(async {
        let server = TestServer::start().await;
        let session = server.create("chain", chain(0.01)).await;
        for (request, reason, field) in cases {
            let answer = session.read_modules(request).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            assert_eq!(refusal.field.as_deref(), Some(field), "{refusal:?}");
        }
        let most = session
            .read_modules(named(&[7; 32_748], 0, &[]))
            .await
            .unwrap();
        assert_eq!(vectors(&most.positions).len(), 32_748);
        let streamed = server.create("streamed", scenes::small()).await;
        let answer = streamed.read_modules(all()).await;
        refused(answer, Code::FailedPrecondition, "MOTION_EXTERNAL");
        let answer = server.session("nobody").read_modules(all()).await;
        refused(answer, Code::NotFound, "SESSION_UNKNOWN");
    });
}

#[test]
fn probes_of_nothing_are_refused_by_their_path() {
    let particle = probe::Module::Particle;
    let streamed = Scene {
        probes: probing(&[("a", particle(0))]).probes,
        ..scenes::small()
    };
    let mut bare = probing(&[("a", particle(0))]);
    bare.probes[0].module = None;
    let many = vec![("a", particle(0)); 65];
    let cases = [
        (probing(&[("", particle(0))]), "FIELD_MISSING", "[0].name"),
        (
            probing(&[("a", particle(0)), ("a", particle(1))]),
            "LABEL_DUPLICATE",
            "[1].name",
        ),
        (
            probing(&[("a", particle(21))]),
            "INDEX_OUT_OF_RANGE",
            "[0].particle",
        ),
        (
            probing(&[("a", link(1, 0))]),
            "INDEX_OUT_OF_RANGE",
            "[0].link.batch",
        ),
        (
            probing(&[("a", link(0, 20))]),
            "INDEX_OUT_OF_RANGE",
            "[0].link.link",
        ),
        (bare, "FIELD_MISSING", "[0].module"),
        (streamed, "CONFLICT", "[0]"),
        (probing(&many), "VALUE_OUT_OF_RANGE", ""),
    ];
    live(async {
        let server = TestServer::start().await;
        for (scene, reason, field) in cases {
            let answer = server.try_create(scenes::creation(scene)).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            let path = format!("scene.probes{field}");
            assert_eq!(refusal.field, Some(path), "{}", refusal.message);
        }
    });
}
