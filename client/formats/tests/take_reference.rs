//! Real captures against the numbers that other programs read in them (`data/take/reference.json`, made by
//! `reference.py` beside it): those in this repository always, those of the shared data where it is present.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use serde_json::Value;
use sinew_formats::take::{self, Format, Options, Take, Up};

fn committed() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/take")
}

fn shared() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/mocap");
    if !folder.is_dir() {
        eprintln!("skipped: no shared data at {}", folder.display());
        return None;
    }
    Some(folder)
}

fn references() -> serde_json::Map<String, Value> {
    let text = std::fs::read(committed().join("reference.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

fn count(reference: &Value, key: &str) -> usize {
    usize::try_from(reference[key].as_u64().unwrap()).unwrap()
}

fn assert_matches(take: &Take, reference: &Value, name: &str) {
    let frames = count(reference, "frames");
    assert_eq!(take.frames(), frames, "{name}");
    assert_eq!(take.labels().len(), count(reference, "points"), "{name}");
    let near = |value: f64, key: &str| {
        let Some(expected) = reference[key].as_f64() else {
            return; // not every program tells
        };
        assert!(
            (value - expected).abs() <= 1e-6,
            "{name}: {key} is {value}, not {expected}"
        );
    };
    near(take.rate_hz(), "rate_hz");
    near(take.first_time_seconds(), "first_time_seconds");
    for (label, expected) in take
        .labels()
        .iter()
        .zip(reference["labels"].as_array().unwrap())
    {
        assert_eq!(label, expected.as_str().unwrap(), "{name}");
    }

    let gaps = take.gaps();
    let missing = gaps.iter().map(|gap| gap.missing).sum::<usize>();
    assert_eq!(missing, count(reference, "missing"), "{name}");
    let never = gaps.iter().filter(|gap| gap.missing == frames).count();
    assert_eq!(never, count(reference, "never_seen"), "{name}");
    let sometimes = gaps.iter().filter(|gap| gap.missing > 0).count() - never;
    assert_eq!(sometimes, count(reference, "points_with_gaps"), "{name}");
    let longest = gaps.iter().map(|gap| gap.longest).max().unwrap();
    assert_eq!(longest, count(reference, "longest_gap"), "{name}");

    for sample in reference["samples"].as_array().unwrap() {
        let index = |i: usize| usize::try_from(sample[i].as_u64().unwrap()).unwrap();
        let (frame, point) = (index(0), index(1));
        let (positions, visible) = take.frame(frame);
        assert_eq!(
            visible[point],
            !sample[2].is_null(),
            "{name}: frame {frame}, point {point}"
        );
        for axis in 0..3 {
            if let Some(expected) = sample[2][axis].as_f64() {
                let value = positions[point][axis];
                assert!(
                    (value - expected).abs() <= 1e-6,
                    "{name}: frame {frame}, point {point}, axis {axis}: {value} m, not {expected} m"
                );
            }
        }
    }
}

#[test]
fn the_captures_in_this_repository_read_as_other_programs_read_them() {
    let references = references();
    let mut compared = 0;
    for (name, reference) in &references {
        let path = committed().join(name);
        if path.exists() {
            assert_matches(
                &take::read(&path, &Options::default()).unwrap(),
                reference,
                name,
            );
            compared += 1;
        }
    }
    assert_eq!(compared, 12);
}

#[test]
fn every_shared_capture_reads_as_other_programs_read_it() {
    let Some(shared) = shared() else { return };
    let references = references();
    let mut compared = 0;
    for format in [Format::C3d, Format::Trc, Format::Bvh] {
        let folder = std::fs::read_dir(shared.join(format.extensions()[0])).unwrap();
        for path in folder.map(|entry| entry.unwrap().path()) {
            let name = path.file_name().unwrap().to_str().unwrap();
            let reference = references
                .get(name)
                .unwrap_or_else(|| panic!("no reference for {name}"));
            let take = take::read(&path, &Options::default()).unwrap();
            eprintln!("{name}: {:?}", take.warnings());
            assert_eq!(take.format(), Some(format));
            assert_matches(&take, reference, name);
            compared += 1;
        }
    }
    assert_eq!(compared, 20);
    for name in TABLES {
        let take = take::read(shared.join("..").join(name), &Options::default()).unwrap();
        let name = name.rsplit('/').next().unwrap();
        assert_matches(&take, &references[name], name);
    }
}

/// Those beside C3D, TRC and BVH that hold points.
const TABLES: [&str; 7] = [
    "mocap/csv/motive123_markers.csv",
    "mocap/csv/qualisys_2markers.tsv",
    "mocap/csv/vicon_nexus_pyomeca.csv",
    "particles/gen_crack2d.lammpstrj",
    "particles/helium.xyz",
    "particles/nacl.lammpstrj",
    "particles/polymer.lammpstrj",
];

/// (file, frames, points, rate in Hz, missing in hundredths of a percent, points with gaps, points never seen), from
/// the manifest of the shared data, whose author read the files with a third reader.
const MANIFEST: [(&str, usize, usize, f64, f64, usize, usize); 20] = [
    ("bvh/freebvh.bvh", 69, 70, 30.0, 0.0, 0, 0),
    ("bvh/mocapbank.bvh", 455, 24, 30.0, 0.0, 0, 0),
    ("bvh/pymo_AV_8Walk.bvh", 1064, 30, 120.0, 0.0, 0, 0),
    ("c3d/cmu_02_01.c3d", 343, 41, 120.0, 0.0, 0, 0),
    (
        "c3d/derived_momentum_sgi_int.c3d",
        89,
        36,
        50.0,
        7.12,
        27,
        0,
    ),
    (
        "c3d/derived_momentum_sgi_real.c3d",
        89,
        36,
        50.0,
        7.12,
        27,
        0,
    ),
    (
        "c3d/ktk_optitrack_walking_dec.c3d",
        3361,
        12,
        160.0,
        7.43,
        12,
        0,
    ),
    ("c3d/ktk_racing_full.c3d", 700, 46, 69.993, 19.83, 13, 6),
    ("c3d/momentum_TESTDPI.c3d", 450, 26, 50.0, 1.93, 10, 0),
    ("c3d/momentum_dec_int.c3d", 89, 36, 50.0, 7.12, 27, 0),
    ("c3d/momentum_dec_real.c3d", 89, 36, 50.0, 7.12, 27, 0),
    ("c3d/momentum_pc_int.c3d", 89, 36, 50.0, 7.12, 27, 0),
    ("c3d/momentum_pc_real.c3d", 89, 36, 50.0, 7.12, 27, 0),
    ("c3d/opensim_walking2.c3d", 1249, 44, 250.0, 50.16, 44, 0),
    ("trc/opensim_abdbonepin.trc", 1991, 11, 100.0, 0.0, 0, 0),
    (
        "trc/opensim_blanks_for_missing.trc",
        464,
        40,
        250.0,
        80.85,
        40,
        0,
    ),
    ("trc/opensim_crlf.trc", 10, 41, 60.0, 0.0, 0, 0),
    ("trc/opensim_nan_cases.trc", 5, 14, 250.0, 7.14, 0, 1),
    (
        "trc/opensim_nan_with_spaces.trc",
        427,
        42,
        100.0,
        0.12,
        4,
        0,
    ),
    ("trc/opensim_walk_free_01.trc", 73, 41, 60.0, 0.0, 0, 0),
];

#[test]
fn every_shared_capture_has_the_counts_of_the_manifest() {
    let Some(shared) = shared() else { return };
    for (name, frames, points, rate, percent, with_gaps, never_seen) in MANIFEST {
        let take = take::read(shared.join(name), &Options::default()).unwrap();
        assert_eq!(
            (take.frames(), take.labels().len()),
            (frames, points),
            "{name}"
        );
        assert!((take.rate_hz() - rate).abs() < 5e-4, "{name}");
        let gaps = take.gaps();
        let shares = gaps.iter().map(|gap| gap.missing_share(frames));
        let missing = 100.0 * shares.sum::<f64>() / f64::from(u32::try_from(points).unwrap());
        assert!(
            (missing - percent).abs() <= 5e-3,
            "{name}: {missing} % missing"
        );
        let never = gaps.iter().filter(|gap| gap.missing == frames).count();
        let ever = gaps.iter().filter(|gap| gap.missing > 0).count();
        assert_eq!((ever - never, never), (with_gaps, never_seen), "{name}");
    }
}

#[test]
fn the_same_trial_is_the_same_in_every_encoding() {
    let read = |name: &str| take::read(committed().join(name), &Options::default()).unwrap();
    let [sgi, dec, integers] = [
        "derived_momentum_sgi_real.c3d",
        "momentum_dec_real.c3d",
        "momentum_pc_int.c3d",
    ]
    .map(read);
    assert_eq!(sgi.visible(), dec.visible());
    assert_eq!(sgi.positions(), dec.positions());
    assert_eq!(sgi.visible(), integers.visible());
    for (real, integer) in sgi.positions().iter().zip(integers.positions()) {
        // Its writer cut to whole steps, of POINT:SCALE = 0.2812 mm.
        assert!((real - integer).amax() < 0.2813e-3, "{real} {integer}");
    }
}

#[test]
fn the_vertical_axis_is_the_one_along_which_a_walker_stands() {
    let walker = take::read(committed().join("cmu_02_01.c3d"), &Options::default()).unwrap();
    assert_eq!(walker.up(), Some(Up::Z));
    let heights = walker
        .reference()
        .positions
        .iter()
        .map(|p| p.z)
        .collect::<Vec<_>>();
    let (low, high) = heights
        .iter()
        .fold((f64::MAX, f64::MIN), |(a, b), &z| (a.min(z), b.max(z)));
    assert!(
        (-0.1..0.2).contains(&low) && (1.4..2.0).contains(&high),
        "{low} to {high} m"
    );
}

#[test]
fn odd_headers_are_read_with_a_warning() {
    let Some(shared) = shared() else { return };
    for (name, words) in [
        (
            "trc/opensim_abdbonepin.trc",
            "NumFrames is 3514, but there are 1991 rows",
        ),
        (
            "trc/opensim_walk_free_01.trc",
            "NumFrames is 900, but there are 73 rows",
        ),
        ("bvh/mocapbank.bvh", "centimetres assumed"),
    ] {
        let take = take::read(shared.join(name), &Options::default()).unwrap();
        let warnings = take.warnings();
        assert!(
            warnings.iter().any(|warning| warning.contains(words)),
            "{name}: {warnings:?}"
        );
    }
}
