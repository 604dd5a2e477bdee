//! Scenes: external points, meshes, mappings, and what holds them together.

use sinew_proto::v1::{DistanceWeighting, Indices, Scene, Weighting, weighting};
use sinew_tests::{live, scenes as posted};
use tonic::Code;

use super::{Case, Witness, each};

fn set_rest(scene: &mut Scene, entry: usize, value: f64) {
    let mut rest = posted::rest(8);
    rest[entry][1] = value;
    posted::points(scene).rest_positions = Some(posted::reals(rest.as_flattened()));
}

#[test]
fn a_scene_without_its_parts() {
    live(async {
        let witness = Witness::start().await;
        let nothing = sinew_proto::v1::CreateSessionRequest::default();
        let refusal = witness
            .refuses(nothing, Code::InvalidArgument, "FIELD_MISSING")
            .await;
        assert_eq!(refusal.field.as_deref(), Some("scene"));
    });
    each(
        posted::small,
        &[
            (|s| s.motion = None, "FIELD_MISSING", "scene.motion"),
            (
                |s| s.motion.as_mut().unwrap().source = None,
                "FIELD_MISSING",
                "scene.motion",
            ),
            (|s| s.mesh = None, "FIELD_MISSING", "scene.mesh"),
            (
                |s| s.mesh.as_mut().unwrap().source = None,
                "FIELD_MISSING",
                "scene.mesh",
            ),
            (
                |s| s.title = "é".repeat(201),
                "TITLE_TOO_LONG",
                "scene.title",
            ),
        ],
    );
}

#[test]
fn numbers_that_no_enum_has() {
    each(
        posted::small,
        &[
            (|s| s.pace = 99, "ENUM_UNKNOWN", "scene.pace"),
            (|s| s.up = -1, "ENUM_UNKNOWN", "scene.up"),
            (
                |s| weight(s).kernel = 99,
                "ENUM_UNKNOWN",
                "scene.mapping.weighting.distance.kernel",
            ),
        ],
    );
    each(
        || posted::sheet(3),
        &[(
            |s| posted::lattice(s).shape = 99,
            "ENUM_UNKNOWN",
            "scene.mesh.lattice.shape",
        )],
    );
}

#[test]
fn time_steps_that_are_none() {
    const FIELD: &str = "scene.time_step_seconds";
    let cases: [Case; 4] = [
        (|s| s.time_step_seconds = -0.01, "VALUE_OUT_OF_RANGE", FIELD),
        (
            |s| s.time_step_seconds = f64::NAN,
            "VALUE_OUT_OF_RANGE",
            FIELD,
        ),
        (
            |s| s.time_step_seconds = f64::INFINITY,
            "VALUE_OUT_OF_RANGE",
            FIELD,
        ),
        (
            |s| s.time_step_seconds = f64::NEG_INFINITY,
            "VALUE_OUT_OF_RANGE",
            FIELD,
        ),
    ];
    each(posted::small, &cases);
    each(|| posted::sheet(3), &cases);
}

#[test]
fn external_points_that_cannot_be() {
    each(
        posted::small,
        &[
            (
                |s| set_rest(s, 3, f64::NAN),
                "VALUE_NOT_FINITE",
                "scene.motion.external.rest_positions[3]",
            ),
            (
                |s| set_rest(s, 7, f64::INFINITY),
                "VALUE_NOT_FINITE",
                "scene.motion.external.rest_positions[7]",
            ),
            // Finite, but nothing that could travel as binary32.
            (
                |s| set_rest(s, 2, 1e40),
                "VALUE_OUT_OF_RANGE",
                "scene.motion.external.rest_positions[2]",
            ),
            (
                |s| posted::points(s).labels.truncate(7),
                "LENGTH_MISMATCH",
                "scene.motion.external.rest_positions",
            ),
            (
                |s| posted::points(s).rest_positions = Some(posted::reals(&[0.0; 23])),
                "LENGTH_MISMATCH",
                "scene.motion.external.rest_positions",
            ),
            (
                |s| posted::points(s).rest_positions = None,
                "LENGTH_MISMATCH",
                "scene.motion.external.rest_positions",
            ),
            (
                |s| posted::points(s).labels.clear(),
                "FIELD_MISSING",
                "scene.motion.external.labels",
            ),
            (
                |s| posted::points(s).labels[5] = String::new(),
                "LABEL_EMPTY",
                "scene.motion.external.labels[5]",
            ),
            (
                |s| posted::points(s).labels[5] = "p2".to_owned(),
                "LABEL_DUPLICATE",
                "scene.motion.external.labels[5]",
            ),
            (
                |s| posted::points(s).absent = Some(Indices::pack(&[0, 8])),
                "INDEX_OUT_OF_RANGE",
                "scene.motion.external.absent[1]",
            ),
            (
                |s| posted::points(s).absent = Some(Indices::pack(&[0, 1, 2, 3, 4, 5, 6, 7])),
                "MAPPING_REFUSED",
                "scene.mapping.points",
            ),
            (
                |s| posted::points(s).file = "walk.c3d".to_owned(),
                "FILE_NOT_RESOLVED",
                "scene.motion.external.file",
            ),
            (
                |s| posted::points(s).file_unit_metres = 0.01,
                "FILE_NOT_RESOLVED",
                "scene.motion.external.file_unit_metres",
            ),
        ],
    );
}

#[test]
fn rates_that_are_none() {
    const FIELD: &str = "scene.motion.external.rate_hz";
    each(
        posted::small,
        &[
            (
                |s| posted::points(s).rate_hz = 0.0,
                "VALUE_OUT_OF_RANGE",
                FIELD,
            ),
            (
                |s| posted::points(s).rate_hz = -120.0,
                "VALUE_OUT_OF_RANGE",
                FIELD,
            ),
            (
                |s| posted::points(s).rate_hz = f64::NAN,
                "VALUE_OUT_OF_RANGE",
                FIELD,
            ),
            (
                |s| posted::points(s).rate_hz = f64::INFINITY,
                "VALUE_OUT_OF_RANGE",
                FIELD,
            ),
        ],
    );
}

#[test]
fn columns_in_two_forms_or_with_half_a_number() {
    const REST: &str = "scene.motion.external.rest_positions";
    each(
        posted::small,
        &[
            (
                |s| {
                    posted::points(s)
                        .rest_positions
                        .as_mut()
                        .unwrap()
                        .values
                        .push(1.0)
                },
                "COLUMN_GARBLED",
                REST,
            ),
            (
                |s| {
                    let rest = posted::points(s).rest_positions.as_mut().unwrap();
                    rest.f64 = rest.f64.slice(..rest.f64.len() - 1);
                },
                "COLUMN_GARBLED",
                REST,
            ),
            (
                |s| {
                    posted::mesh(s)
                        .connectivity
                        .as_mut()
                        .unwrap()
                        .values
                        .push(1)
                },
                "COLUMN_GARBLED",
                "scene.mesh.grid.connectivity",
            ),
            (
                |s| {
                    let offsets = posted::mesh(s).offsets.as_mut().unwrap();
                    offsets.u32 = offsets.u32.slice(1..);
                },
                "COLUMN_GARBLED",
                "scene.mesh.grid.offsets",
            ),
        ],
    );
}

fn weight(scene: &mut Scene) -> &mut DistanceWeighting {
    let weighting = scene
        .mapping
        .as_mut()
        .unwrap()
        .weighting
        .get_or_insert(Weighting {
            kind: Some(weighting::Kind::Distance(DistanceWeighting::default())),
            ..Weighting::default()
        });
    match weighting.kind.as_mut() {
        Some(weighting::Kind::Distance(distance)) => distance,
        Some(weighting::Kind::Flood(_)) | None => panic!("the kind was given"),
    }
}

#[test]
fn mappings_onto_points_that_are_missing_and_scales_that_are_none() {
    each(
        posted::small,
        &[
            (
                |s| s.mapping.as_mut().unwrap().points = vec!["p1".to_owned(), "p8".to_owned()],
                "LABEL_UNKNOWN",
                "scene.mapping.points[1]",
            ),
            (
                |s| {
                    posted::points(s).absent = Some(Indices::pack(&[4]));
                    s.mapping.as_mut().unwrap().points = vec!["p4".to_owned()];
                },
                "POINT_ABSENT",
                "scene.mapping.points[0]",
            ),
            (
                |s| weight(s).scale = -1.0,
                "MAPPING_REFUSED",
                "scene.mapping.weighting.distance.scale",
            ),
            (
                |s| weight(s).scale = f64::NAN,
                "MAPPING_REFUSED",
                "scene.mapping.weighting.distance.scale",
            ),
            (
                |s| weight(s).scale = f64::INFINITY,
                "MAPPING_REFUSED",
                "scene.mapping.weighting.distance.scale",
            ),
        ],
    );
}
