//! How a session's mapping is changed.

use sinew_proto::{
    FieldMask,
    v1::{
        self, DistanceWeighting, Filter, KeepK, Kernel, Mapping, Scene, Session,
        UpdateMappingRequest, Weighting, filter, weighting,
    },
};
use sinew_tests::{TestServer, TestSession, live, refused, scenes, scenes::Rule, vertices};
use tonic::Code;

use crate::determinism::same_on_any_number_of_threads;

fn change(mapping: Mapping) -> UpdateMappingRequest {
    UpdateMappingRequest {
        mapping: Some(mapping),
        ..UpdateMappingRequest::default()
    }
}

fn masked(mapping: Mapping, paths: &[&str]) -> UpdateMappingRequest {
    let paths = paths.iter().map(|&path| path.to_owned()).collect();
    UpdateMappingRequest {
        update_mask: Some(FieldMask { paths }),
        ..change(mapping)
    }
}

fn blended(mapping: Mapping, blend_seconds: f64) -> UpdateMappingRequest {
    UpdateMappingRequest {
        blend_seconds,
        ..change(mapping)
    }
}

fn keep(k: u32) -> Option<Filter> {
    let kind = Some(filter::Kind::Keep(KeepK { k }));
    Some(Filter { kind })
}

fn inverse_square() -> Option<Weighting> {
    let kernel = Kernel::InverseSquare.into();
    let distance = DistanceWeighting {
        kernel,
        ..DistanceWeighting::default()
    };
    let kind = Some(weighting::Kind::Distance(distance));
    Some(Weighting {
        kind,
        ..Weighting::default()
    })
}

#[test]
fn a_running_session_blends_to_another_rule_without_a_jump() {
    live(async {
        const SECONDS: f64 = 0.2;
        let server = TestServer::start().await;
        let session = server
            .create("tissue", scenes::block(20, 4, Rule::Mean))
            .await;
        let mut source = session.source().await;
        let mut watcher = session.watch().await;
        session.run().await.unwrap();
        // The points stand still, so that nothing but the blend moves the mesh.
        let pose = scenes::bent(20, 0.8);
        let mut shown = Vec::new();
        for step in 1..=30 {
            if step == 6 {
                let request = blended(scenes::mapping(Rule::Rigid), SECONDS);
                let told = session.remap(request).await.unwrap();
                assert_eq!(told.step, 5);
            }
            source.send(&pose).await;
            shown.push(watcher.until(step).await);
        }
        let first = shown[0].clone();
        let (old, new) = (vertices(&shown[4]), vertices(&shown[29]));
        assert!(farthest(&old, &new) > 0.01, "the rules agree on this pose");
        let mut before = old.clone();
        for frame in &shown[5..] {
            let kept = (frame.epoch, frame.topology_version, frame.layout_hash);
            assert_eq!(
                kept,
                (first.epoch, first.topology_version, first.layout_hash)
            );
            let t = ((frame.time_seconds - 0.05) / SECONDS).clamp(0.0, 1.0);
            let s = t * t * (3.0 - 2.0 * t);
            let expected: Vec<[f64; 3]> = std::iter::zip(&old, &new)
                .map(|(a, b)| [0, 1, 2].map(|i| (1.0 - s) * a[i] + s * b[i]))
                .collect();
            let now = vertices(frame);
            assert!(
                farthest(&now, &expected) < 1e-12,
                "at {} s",
                frame.time_seconds
            );
            // The steepest slope of the blend is 1.5.
            let most = 1.5 * (0.01 / SECONDS) * farthest(&old, &new);
            assert!(farthest(&now, &before) <= most * (1.0 + 1e-9));
            before = now;
        }
    });
}

fn farthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    std::iter::zip(a.as_flattened(), b.as_flattened())
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn a_network_that_runs_changes_its_mapping_between_two_steps() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(5)).await;
        let mut watcher = session.watch().await;
        session.run().await.unwrap();
        let before = watcher.until(3).await.step;
        let told = session
            .remap(blended(scenes::mapping(Rule::Rigid), 0.05))
            .await
            .unwrap();
        assert!(told.step >= before);
        watcher.until(told.step + 100).await;
        session.pause().await.unwrap();
        let explained = session.explain(0).await.unwrap();
        assert_eq!(explained.rule, "shape_matching");
        assert_eq!(explained.mapping_step, told.step);
    });
}

/// What a new subscriber sees.
async fn now_shown(session: &TestSession) -> (u64, Vec<[f64; 3]>) {
    let frame = session.watch().await.keyframe().await.frame.unwrap();
    (frame.step, vertices(&frame))
}

#[test]
fn without_a_blend_the_next_step_is_the_new_mappings() {
    live(async {
        let server = TestServer::start().await;
        let scene = |rule| scenes::block(20, 4, rule);
        let changed = server.create("changed", scene(Rule::Rigid)).await;
        let reference = server.create("reference", scene(Rule::Mean)).await;
        let (mut a, mut b) = (changed.source().await, reference.source().await);
        for i in 1..=3 {
            let pose = scenes::bent(20, 0.1 * f64::from(i));
            let other = changed.step_to(&mut a, &pose).await;
            assert_ne!(other, reference.step_to(&mut b, &pose).await);
        }
        let shown = now_shown(&changed).await;
        changed
            .remap(change(scenes::mapping(Rule::Mean)))
            .await
            .unwrap();
        assert_eq!(now_shown(&changed).await, shown);
        let pose = scenes::bent(20, 0.4);
        let next = changed.step_to(&mut a, &pose).await;
        assert_eq!(next, reference.step_to(&mut b, &pose).await);
    });
}

#[test]
fn the_digest_tells_mappings_and_blends_apart() {
    live(async {
        let server = TestServer::start().await;
        let session = server
            .create("changed", scenes::block(20, 4, Rule::Mean))
            .await;
        let mut seen = vec![session.digest().await];
        for request in [
            change(scenes::mapping(Rule::Rigid)),
            blended(scenes::mapping(Rule::Mean), 1.0),
            change(scenes::mapping(Rule::Rigid)),
            blended(scenes::mapping(Rule::Mean), 2.0),
            change(scenes::mapping(Rule::Mean)),
        ] {
            seen.push(session.remap(request).await.unwrap().digest);
        }
        // A change at once ends a blend; a session is then like one that had the mapping from its start.
        assert_eq!((&seen[1], &seen[0]), (&seen[3], &seen[5]));
        seen.truncate(5);
        seen.remove(3);
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), 4);
    });
}

#[test]
fn an_etag_is_good_for_one_change() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let first = session.get().await.unwrap();
        let with = |etag: &str, rule| UpdateMappingRequest {
            etag: etag.to_owned(),
            ..change(scenes::mapping(rule))
        };
        let second = session.remap(with(&first.etag, Rule::Rigid)).await.unwrap();
        assert_ne!(second.etag, first.etag);
        for stale in [&first.etag, "nonsense"] {
            let answer = session.remap(with(stale, Rule::Mean)).await;
            refused(answer, Code::Aborted, "ETAG_MISMATCH");
            assert_eq!(session.get().await.unwrap(), second);
        }
        // The mapping as it was has the etag that it had.
        let third = session.remap(with(&second.etag, Rule::Mean)).await.unwrap();
        assert_eq!((&third.etag, third.mapping), (&first.etag, first.mapping));
        let listed = server
            .sessions()
            .list_sessions(v1::ListSessionsRequest::default())
            .await;
        let [listed] = &listed.unwrap().into_inner().sessions[..] else {
            panic!("one session is listed")
        };
        assert_eq!((&listed.etag, &listed.mapping), (&third.etag, &None));
    });
}

#[test]
fn a_mask_names_what_is_replaced() {
    live(async {
        let server = TestServer::start().await;
        let base = Mapping {
            weighting: inverse_square(),
            filter: keep(3),
            points: vec!["p1".to_owned(), "p2".to_owned()],
            ..scenes::mapping(Rule::Rigid)
        };
        let update = Mapping {
            filter: keep(5),
            points: Vec::new(),
            ..scenes::mapping(Rule::Mean)
        };
        let cases: [(&[&str], Mapping); 6] = [
            (
                &[],
                Mapping {
                    filter: keep(5),
                    rule: update.rule,
                    ..base.clone()
                },
            ),
            (
                &["filter"],
                Mapping {
                    filter: keep(5),
                    ..base.clone()
                },
            ),
            (
                &["weighting", "rule"],
                Mapping {
                    weighting: None,
                    rule: update.rule,
                    ..base.clone()
                },
            ),
            (
                &["points"],
                Mapping {
                    points: Vec::new(),
                    ..base.clone()
                },
            ),
            (&["*"], update.clone()),
            (&["points", "*", "points"], update.clone()),
        ];
        for (paths, expected) in cases {
            let scene = Scene {
                mapping: Some(base.clone()),
                ..scenes::small()
            };
            let session = server.create("", scene).await;
            let request = masked(update.clone(), paths);
            let told = session.remap(request).await.unwrap();
            assert_eq!(told.mapping.as_ref(), Some(&expected), "{paths:?}");
            // What the session says is what it does.
            let scene = Scene {
                mapping: Some(expected),
                ..scenes::small()
            };
            let twin = server.create("", scene).await.get().await.unwrap();
            assert_eq!((told.etag, told.digest), (twin.etag, twin.digest));
        }
    });
}

#[test]
fn changes_at_once_of_different_fields_are_all_kept() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let all = Mapping {
            weighting: inverse_square(),
            filter: keep(3),
            points: vec!["p1".to_owned(), "p2".to_owned()],
            ..scenes::mapping(Rule::Rigid)
        };
        let ask = |path: &str| {
            let (session, request) = (session.clone(), masked(all.clone(), &[path]));
            tokio::spawn(async move { session.remap(request).await })
        };
        let asked = ["weighting", "filter", "rule", "points"].map(ask);
        for answer in asked {
            answer.await.unwrap().unwrap();
        }
        assert_eq!(session.get().await.unwrap().mapping, Some(all));
    });
}

/// A request that is refused, by which reason, and the field to blame.
fn refusals() -> Vec<(UpdateMappingRequest, &'static str, &'static str)> {
    let rigid = || scenes::mapping(Rule::Rigid);
    let nobody = Mapping {
        points: vec!["p0".to_owned(), "nobody".to_owned()],
        ..rigid()
    };
    let scaled = |kernel, scale| {
        let kind = Some(weighting::Kind::Distance(DistanceWeighting {
            kernel,
            scale,
        }));
        Mapping {
            weighting: Some(Weighting {
                kind,
                ..Weighting::default()
            }),
            ..rigid()
        }
    };
    let mut refusals = vec![
        (Default::default(), "FIELD_MISSING", "mapping"),
        (masked(rigid(), &["Rule"]), "FIELD_UNKNOWN", "update_mask"),
        (
            masked(rigid(), &["rule", "filter.keep"]),
            "FIELD_UNKNOWN",
            "update_mask",
        ),
        (change(nobody), "LABEL_UNKNOWN", "mapping.points[1]"),
        (
            change(scaled(0, -1.0)),
            "MAPPING_REFUSED",
            "mapping.weighting.distance.scale",
        ),
        (
            change(scaled(99, 1.0)),
            "ENUM_UNKNOWN",
            "mapping.weighting.distance.kernel",
        ),
    ];
    for seconds in [-1e-9, f64::NAN, f64::INFINITY, 1e6] {
        refusals.push((
            blended(rigid(), seconds),
            "VALUE_OUT_OF_RANGE",
            "blend_seconds",
        ));
    }
    refusals
}

#[test]
fn what_is_refused_or_only_validated_changes_nothing() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let before: Session = session.get().await.unwrap();
        for (request, reason, field) in refusals() {
            for validate_only in [true, false] {
                let answer = session
                    .remap(UpdateMappingRequest {
                        validate_only,
                        ..request.clone()
                    })
                    .await;
                let refusal = refused(answer, Code::InvalidArgument, reason);
                assert_eq!(refusal.field.as_deref(), Some(field));
                assert_eq!(session.get().await.unwrap(), before);
            }
        }
        let request = change(scenes::mapping(Rule::Rigid));
        let told = session
            .remap(UpdateMappingRequest {
                validate_only: true,
                ..request.clone()
            })
            .await
            .unwrap();
        assert_eq!(session.get().await.unwrap(), before);
        let made = session.remap(request).await.unwrap();
        assert_eq!((made.etag, made.mapping), (told.etag, told.mapping));
    });
}

#[test]
fn a_session_that_blends_refuses_a_blend_and_takes_a_change_at_once() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(4)).await;
        let rigid = || scenes::mapping(Rule::Rigid);
        session.remap(blended(rigid(), 0.01)).await.unwrap();
        session.step(9).await.unwrap();
        let before = session.get().await.unwrap();
        for validate_only in [true, false] {
            let request = UpdateMappingRequest {
                validate_only,
                ..blended(scenes::mapping(Rule::Mean), 0.01)
            };
            let answer = session.remap(request).await;
            refused(answer, Code::FailedPrecondition, "MAPPING_BLENDING");
            assert_eq!(session.get().await.unwrap(), before);
        }
        session.step(1).await.unwrap();
        let again = blended(scenes::mapping(Rule::Mean), 0.01);
        session.remap(again).await.unwrap();
        session.remap(change(rigid())).await.unwrap();
        session.remap(blended(rigid(), 0.01)).await.unwrap();
    });
}

#[test]
fn a_faulted_session_is_neither_remapped_nor_explained() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::explosive()).await;
        session.step(10_000).await.unwrap_err();
        let answer = session.remap(change(scenes::mapping(Rule::Rigid))).await;
        refused(answer, Code::FailedPrecondition, "SIM_DIVERGED");
        let answer = session.explain(0).await;
        refused(answer, Code::FailedPrecondition, "SIM_DIVERGED");
    });
}

#[test]
fn a_change_in_the_middle_is_the_same_on_any_number_of_threads() {
    same_on_any_number_of_threads(async |server| {
        let session = server
            .create("tissue", scenes::block(40, 30, Rule::Rigid))
            .await;
        let mut source = session.source().await;
        let mut digests = vec![session.digest().await];
        for i in 1..=12 {
            if i == 4 {
                let mapping = Mapping {
                    filter: keep(5),
                    ..scenes::mapping(Rule::Mean)
                };
                session.remap(blended(mapping, 0.05)).await.unwrap();
            }
            let pose = scenes::bent(40, 0.05 * f64::from(i));
            digests.push(session.step_to(&mut source, &pose).await);
        }
        digests
    });
}
