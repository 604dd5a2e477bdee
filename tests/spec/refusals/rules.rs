//! Rules of topology: what each value must be, and what a rule must fit.

use sinew_proto::v1::{self, Indices, Scene};
use sinew_tests::scenes as posted;

use super::each;

/// A scene with rules, as a scene file has them; the first is what the cases change.
fn ruled() -> Scene {
    let rules = r#"[
        {"measure": {"edges": {}}, "threshold": 0.5, "hysteresis": 0.1, "action": {"open": {}}},
        {"measure": {"points": {"pairs": [{"a": "p0", "b": "p1"}]}}, "threshold": 0.5}
    ]"#;
    Scene {
        rules: serde_json::from_str(rules).unwrap(),
        ..posted::small()
    }
}

fn first(scene: &mut Scene) -> &mut v1::TopologyRule {
    &mut scene.rules[0]
}

fn limits(scene: &mut Scene) -> &mut v1::Limits {
    first(scene).limits.get_or_insert_default()
}

fn region(scene: &mut Scene, min: f64, max: Option<f64>) {
    let corner = |x| v1::Vector3 { x, y: x, z: x };
    limits(scene).region = Some(v1::Region {
        min: Some(corner(min)),
        max: max.map(corner),
    });
}

/// Makes the first rule one that is read from this.
fn measured(scene: &mut Scene, measure: &str) {
    first(scene).measure = Some(serde_json::from_str(measure).unwrap());
}

fn pair(scene: &mut Scene, b: &str) {
    let kind = scene.rules[1].measure.as_mut().unwrap().kind.as_mut();
    let Some(v1::measure::Kind::Points(points)) = kind else {
        panic!("the second rule is of points")
    };
    points.pairs[0].b = b.to_owned();
}

#[test]
fn levels_that_are_none() {
    const THRESHOLD: &str = "scene.rules[0].threshold";
    each(
        ruled,
        &[
            (
                |s| first(s).threshold = 0.0,
                "VALUE_OUT_OF_RANGE",
                THRESHOLD,
            ),
            (
                |s| first(s).threshold = -1.0,
                "VALUE_OUT_OF_RANGE",
                THRESHOLD,
            ),
            (
                |s| first(s).threshold = f64::NAN,
                "VALUE_OUT_OF_RANGE",
                THRESHOLD,
            ),
            (
                |s| {
                    measured(s, r#"{"edges": {"strain": "STRAIN_COMPRESSION"}}"#);
                    first(s).threshold = 1.1;
                },
                "VALUE_OUT_OF_RANGE",
                THRESHOLD,
            ),
            (
                |s| first(s).hysteresis = 0.6,
                "VALUE_OUT_OF_RANGE",
                "scene.rules[0].hysteresis",
            ),
            (
                |s| first(s).hysteresis = f64::NAN,
                "VALUE_OUT_OF_RANGE",
                "scene.rules[0].hysteresis",
            ),
        ],
    );
}

#[test]
fn measures_of_nothing() {
    each(
        ruled,
        &[
            (
                |s| first(s).measure = None,
                "FIELD_MISSING",
                "scene.rules[0].measure",
            ),
            (
                |s| {
                    let volumes = v1::PartMeasure { strain: 9 };
                    let kind = Some(v1::measure::Kind::Volumes(volumes));
                    first(s).measure = Some(v1::Measure { kind });
                },
                "ENUM_UNKNOWN",
                "scene.rules[0].measure.volumes.strain",
            ),
            (
                |s| measured(s, r#"{"fit": {}}"#),
                "RULE_UNFIT",
                "scene.rules[0].measure.fit",
            ),
            (
                |s| measured(s, r#"{"points": {"within": 1}}"#),
                "RULE_UNFIT",
                "scene.rules[0].action",
            ),
            (
                |s| first(s).action = Some(serde_json::from_str(r#"{"separate": {}}"#).unwrap()),
                "RULE_UNFIT",
                "scene.rules[0].action",
            ),
            (
                |s| s.rules[1].measure = Some(serde_json::from_str(r#"{"points": {}}"#).unwrap()),
                "VALUE_OUT_OF_RANGE",
                "scene.rules[1].measure.points.within",
            ),
            (
                |s| pair(s, "elbow"),
                "LABEL_UNKNOWN",
                "scene.rules[1].measure.points.pairs[0]",
            ),
            (
                |s| pair(s, "p0"),
                "POINTS_COINCIDE",
                "scene.rules[1].measure.points.pairs[0]",
            ),
        ],
    );
}

#[test]
fn limits_that_hold_nothing() {
    const SEAM: &str = "scene.rules[0].limits.seam";
    each(
        ruled,
        &[
            (
                |s| region(s, 5.0, Some(6.0)),
                "RULE_EMPTY",
                "scene.rules[0].limits",
            ),
            (
                |s| region(s, 0.0, None),
                "FIELD_MISSING",
                "scene.rules[0].limits.region.max",
            ),
            (
                |s| region(s, f64::NAN, Some(1.0)),
                "VALUE_NOT_FINITE",
                "scene.rules[0].limits.region.min",
            ),
            (
                |s| limits(s).from_seconds = Some(-1.0),
                "VALUE_OUT_OF_RANGE",
                "scene.rules[0].limits.from_seconds",
            ),
            (
                |s| {
                    limits(s).from_seconds = Some(2.0);
                    limits(s).until_seconds = Some(1.0);
                },
                "VALUE_OUT_OF_RANGE",
                "scene.rules[0].limits.until_seconds",
            ),
            (
                |s| limits(s).seam = Some(Indices::pack(&[0, 1, 2])),
                "LENGTH_MISMATCH",
                SEAM,
            ),
            (
                |s| limits(s).seam = Some(Indices::pack(&[0, 1, 0, 8])),
                "INDEX_OUT_OF_RANGE",
                "scene.rules[0].limits.seam[1]",
            ),
            // Opposite corners of the eight cubes.
            (
                |s| limits(s).seam = Some(Indices::pack(&[0, 7])),
                "NO_SHARED_FACE",
                "scene.rules[0].limits.seam[0]",
            ),
        ],
    );
}

#[test]
fn a_mesh_that_no_rule_can_tear() {
    each(
        ruled,
        &[(
            // One quad.
            |s| {
                let mesh = posted::mesh(s);
                mesh.cell_types = vec![9].into();
                mesh.connectivity = Some(Indices::pack(&[0, 1, 4, 3]));
                mesh.offsets = Some(Indices::pack(&[0, 4]));
            },
            "MESH_NOT_A_BODY",
            "scene.mesh",
        )],
    );
}
