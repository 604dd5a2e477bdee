//! Sweep files: what they make, and what is refused.

use std::{
    fs,
    path::{Path, PathBuf},
};

use sinew_client::sweep::{Colour, Sweep, View};
use sinew_proto::v1::{GeodesicMetric, GradedMetric, elastic_solid::Metric, filter, motion_rule};

const SCENE: &str = r#"
title = "Two masses"
[motion.mass_spring]
positions.values = [0, 0, 0, 1, 0, 0]
[mesh.lattice]
spacing = 0.1
radius = 0.3
[mapping]
filter.keep.k = 3
rule.mean = {}
"#;

/// A folder of its own with a scene and a sweep.
fn written(test: &str, sweep: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("sinew-sweep-{}-{test}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join("scene.toml"), SCENE).expect("a file");
    let path = folder.join("sweep.toml");
    fs::write(&path, sweep).expect("a file");
    path
}

#[test]
fn each_row_meets_each_column_and_leaves_the_rest_of_the_scene_s_mapping() {
    let path = written(
        "grid",
        r#"
scene = "scene.toml"
frames = 5
colour = "points"
[[rows]]
label = "mean"
[[rows]]
label = "direct"
mapping.rule.direct = {}
[[columns]]
label = "as it is"
[[columns]]
label = "minimum"
mapping.filter.minimum = {}
"#,
    );
    let sweep = Sweep::load(&path).unwrap();
    assert_eq!(
        (&*sweep.title, sweep.frames, sweep.columns),
        ("Two masses", 5, 2)
    );
    assert_eq!(sweep.colour, Colour::Points);
    let labels: Vec<&str> = sweep.views.iter().map(|view| &*view.label).collect();
    assert_eq!(
        labels,
        [
            "mean, as it is",
            "mean, minimum",
            "direct, as it is",
            "direct, minimum"
        ]
    );
    let is_direct = |i: usize| {
        let rule = sweep.views[i].mapping.rule.as_ref().unwrap().kind.as_ref();
        matches!(rule, Some(motion_rule::Kind::Direct(_)))
    };
    let keeps = |i: usize| {
        sweep.views[i]
            .mapping
            .filter
            .as_ref()
            .unwrap()
            .kind
            .clone()
            .unwrap()
    };
    assert_eq!([0, 1, 2, 3].map(is_direct), [false, false, true, true]);
    assert!(matches!(keeps(2), filter::Kind::Keep(keep) if keep.k == 3));
    assert!(matches!(keeps(3), filter::Kind::Minimum(_)));
}

#[test]
fn a_view_has_the_rules_of_its_column_or_else_of_its_row_or_else_of_the_scene() {
    let path = written(
        "rules",
        r#"
scene = "scene.toml"
[[rows]]
label = "as it is"
[[rows]]
label = "edges"
[[rows.rules]]
measure.edges = {}
threshold = 0.5
[[columns]]
label = "as the row"
[[columns]]
label = "never"
rules = []
[[columns]]
label = "early"
[[columns.rules]]
measure.edges = {}
threshold = 0.1
"#,
    );
    let sweep = Sweep::load(&path).unwrap();
    let thresholds =
        |view: &View| -> Vec<f64> { view.rules.iter().map(|rule| rule.threshold).collect() };
    let thresholds: Vec<Vec<f64>> = sweep.views.iter().map(thresholds).collect();
    assert_eq!(
        thresholds,
        [vec![], vec![], vec![0.1], vec![0.5], vec![], vec![0.1]]
    );
}

#[test]
fn what_is_no_sweep_is_refused_with_its_field() {
    let refusals = [
        ("none", "scene = \"scene.toml\"", "rows: is empty"),
        (
            "frames",
            "scene = \"scene.toml\"\nframes = 0\n[[rows]]\nlabel = \"a\"",
            "frames: is 0",
        ),
        (
            "name",
            "scene = \"scene.toml\"\n[[row]]\nlabel = \"a\"",
            "unknown field `row`",
        ),
        (
            "rule",
            "scene = \"scene.toml\"\n[[rows]]\nlabel = \"a\"\nmapping.rule.men = {}",
            "rows[0].mapping.rule",
        ),
        (
            "scene",
            "scene = \"missing.toml\"\n[[rows]]\nlabel = \"a\"",
            "missing.toml",
        ),
        (
            "colour",
            "scene = \"scene.toml\"\ncolour = \"red\"\n[[rows]]\nlabel = \"a\"",
            "colour",
        ),
    ];
    for (test, text, expected) in refusals {
        let error = Sweep::load(&written(test, text)).unwrap_err().to_string();
        assert!(error.contains(expected), "{test}: {error}");
    }
    let many: String = (0..65)
        .map(|i| format!("[[rows]]\nlabel = \"{i}\"\n"))
        .collect();
    let error =
        Sweep::load(&written("many", &format!("scene = \"scene.toml\"\n{many}"))).unwrap_err();
    assert!(error.to_string().contains("65 views"), "{error}");
}

#[test]
fn the_elastic_figures_show_one_body_by_three_measures_of_who_is_near() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/elastic");
    for figure in ["two-bars-2d", "two-bars-3d", "pants", "octopus"] {
        let path = folder.join(format!("figure-{figure}.toml"));
        let sweep = Sweep::load(&path).unwrap();
        assert!(matches!(sweep.colour, Colour::Displacement(end) if end > 0.0));
        let metrics = sweep.views.iter().map(|view| view.elastic.metric);
        assert_eq!(
            metrics.collect::<Vec<_>>(),
            [
                Some(Metric::Geodesic(GeodesicMetric { exponent: 1.0 })),
                Some(Metric::Geodesic(GeodesicMetric { exponent: 15.0 })),
                Some(Metric::Graded(GradedMetric::default())),
            ]
        );
    }
}

#[test]
fn scales_without_length_and_solids_where_there_is_none_are_refused_by_name() {
    for (line, field) in [
        ("colour.displacement = 0", "colour.displacement"),
        ("rows = [{ label = \"a\", elastic.damping = 1 }]", "elastic"),
    ] {
        let rows = if line.starts_with("rows") {
            ""
        } else {
            "[[columns]]\nlabel = \"b\"\n"
        };
        let path = written(field, &format!("scene = \"scene.toml\"\n{line}\n{rows}"));
        let error = Sweep::load(&path).unwrap_err().to_string();
        assert!(error.contains(field), "{error}");
    }
}
