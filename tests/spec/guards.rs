//! How long a step may be, and what becomes of one that is longer.

use sinew_proto::v1::{
    self, AdaptiveSubsteps, Elastic, Indices, Integrator, Lattice, Links, Motion, Particles, Scene,
    StableSubsteps, Stepping, links, mesh, motion, stepping,
};
use sinew_tests::{TestServer, TestSession, live, refused, scenes};
use tonic::Code;

use crate::particles::{given, points, scene};

/// 10 /s: one mass of 1 kg on a spring of 100 N/m, from 0.1 m beside its rest.
const TURN: f64 = 10.0;
/// The largest step that is stable, s.
const LIMIT: f64 = 2.0 / TURN;

fn oscillator(
    time_step_seconds: f64,
    integrator: Integrator,
    kind: Option<stepping::Kind>,
) -> Scene {
    let particles = Particles {
        positions: Some(scenes::reals(&[0.0, 0.0, 0.0, 1.1, 0.0, 0.0])),
        fixed: Some(Indices::pack(&[0])),
        links: vec![Links {
            ends: Some(Indices::pack(&[0, 1])),
            law: Some(links::Law::Spring(Elastic {
                stiffness: Some(scenes::reals(&[TURN * TURN])),
                rest_lengths: Some(scenes::reals(&[1.0])),
                ..Elastic::default()
            })),
        }],
        integrator: integrator.into(),
        stepping: Some(Stepping { kind }),
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
        time_step_seconds,
        pace: v1::Pace::Unpaced.into(),
        ..Scene::default()
    }
}

/// How far the mass is from its rest, m.
async fn stretch(session: &TestSession) -> f64 {
    let frame = session.watch().await.keyframe().await.frame.unwrap();
    points(&frame)[1][0] - 1.0
}

#[test]
fn a_step_of_95_per_cent_of_the_limit_is_bounded_and_one_of_105_is_warned_of_and_ends_the_session()
{
    live(async {
        let server = TestServer::start().await;
        let euler = Integrator::SemiImplicitEuler;
        let below = server
            .create("below", oscillator(0.95 * LIMIT, euler, None))
            .await;
        assert!(below.get().await.unwrap().warnings.is_empty());
        for _ in 0..10 {
            below.step(1_000).await.unwrap();
            assert!(stretch(&below).await.abs() < 0.5);
        }
        let above = server
            .create("above", oscillator(1.05 * LIMIT, euler, None))
            .await;
        let warnings = above.get().await.unwrap().warnings;
        assert!(
            warnings[0].contains("is 2.100e-1 s") && warnings[0].contains("about 2.000e-1 s"),
            "{warnings:?}"
        );
        refused(
            above.step(1_000).await,
            Code::FailedPrecondition,
            "SIM_DIVERGED",
        );
    });
}

#[test]
fn steps_beyond_the_limit_are_divided_or_solved_for_where_the_scene_asks_for_it() {
    live(async {
        let server = TestServer::start().await;
        let most = 100;
        let stable = Some(stepping::Kind::Stable(StableSubsteps { most }));
        let cases = [
            ("substeps", Integrator::SemiImplicitEuler, stable),
            ("midpoint", Integrator::ImplicitMidpoint, None),
            ("linear", Integrator::LinearlyImplicitEuler, None),
        ];
        for (name, integrator, kind) in cases {
            let session = server
                .create(name, oscillator(5.0 * LIMIT, integrator, kind))
                .await;
            assert!(session.get().await.unwrap().warnings.is_empty(), "{name}");
            for _ in 0..10 {
                session.step(100).await.unwrap();
                let off = stretch(&session).await;
                assert!(off.abs() < 0.2, "{name}: {off}");
            }
        }
        let few = Some(stepping::Kind::Stable(StableSubsteps { most: 9 }));
        let scene = oscillator(5.0 * LIMIT, Integrator::SemiImplicitEuler, few);
        let session = server.create("few", scene).await;
        let refusal = refused(
            session.step(1).await,
            Code::FailedPrecondition,
            "SIM_DIVERGED",
        );
        assert!(refusal.message.contains("more than the 9"), "{refusal:?}");
    });
}

#[test]
fn adaptive_steps_follow_the_closed_form_as_closely_as_they_are_asked_to() {
    live(async {
        let server = TestServer::start().await;
        let mut errors = Vec::new();
        for (name, tolerance) in [("coarse", 1e-6), ("fine", 1e-10)] {
            let most = 100_000;
            let adaptive = AdaptiveSubsteps { tolerance, most };
            let kind = Some(stepping::Kind::Adaptive(adaptive));
            let scene = oscillator(0.5, Integrator::RungeKutta4, kind);
            let session = server.create(name, scene).await;
            session.step(4).await.unwrap();
            errors.push((stretch(&session).await - 0.1 * (TURN * 2.0).cos()).abs());
        }
        assert!(errors[0] < 1e-3 && errors[1] < 1e-7, "{errors:?}");
        assert!(errors[1] < 1e-2 * errors[0], "{errors:?}");
    });
}

#[test]
fn the_error_of_a_table_is_told_and_its_motion_is_that_of_the_law() {
    live(async {
        let server = TestServer::start().await;
        let exact = scene("oscillating_cluster");
        let mut tabulated = exact.clone();
        let pairs = given(&mut tabulated).pairs.as_mut().unwrap();
        pairs.attraction.as_mut().unwrap().table = 1e-8;
        let mut ends = Vec::new();
        for (name, scene, told) in [("exact", exact, 0), ("table", tabulated, 1)] {
            let session = server.create(name, scene).await;
            let warnings = session.get().await.unwrap().warnings;
            let tables = warnings.iter().filter(|w| w.contains("is a table of"));
            assert_eq!(tables.count(), told, "{warnings:?}");
            session.step(200).await.unwrap();
            let frame = session.watch().await.keyframe().await.frame.unwrap();
            ends.push(points(&frame));
        }
        for (exact, table) in ends[0].iter().zip(&ends[1]) {
            for axis in 0..3 {
                assert!((exact[axis] - table[axis]).abs() < 1e-6);
            }
        }
    });
}
