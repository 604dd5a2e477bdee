//! Spoilt files: a take or a refusal, never a panic, and memory within a small multiple of the file's size.
//!
//! One test only, for the allocator counts for the whole process.

use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use sinew_formats::take::{self, Options};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// A sample takes 25 bytes of memory and at least one in the file; labels and their index take the rest.
const BYTES_PER_BYTE: usize = 32;
const SLACK: usize = 64 * 1024;

const FILES: [(&str, &[u8]); 14] = [
    ("a.c3d", include_bytes!("data/take/cmu_02_01.c3d")),
    ("b.c3d", include_bytes!("data/take/momentum_pc_int.c3d")),
    ("c.c3d", include_bytes!("data/take/momentum_dec_real.c3d")),
    (
        "d.c3d",
        include_bytes!("data/take/derived_momentum_sgi_real.c3d"),
    ),
    ("e.trc", include_bytes!("data/take/opensim_crlf.trc")),
    ("f.trc", include_bytes!("data/take/opensim_nan_cases.trc")),
    ("g.bvh", include_bytes!("data/take/freebvh_cut.bvh")),
    ("h.csv", include_bytes!("data/take/small_motive.csv")),
    ("i.csv", include_bytes!("data/take/small_nexus.csv")),
    ("j.tsv", include_bytes!("data/take/small_qualisys.tsv")),
    ("k.mot", include_bytes!("data/take/small_walk.mot")),
    (
        "l.lammpstrj",
        include_bytes!("data/take/small_melt.lammpstrj"),
    ),
    ("m.xyz", include_bytes!("data/take/small_water.xyz")),
    ("n.gsd", include_bytes!("data/take/small_crystal.gsd")),
];

/// Reads `bytes`, watching the memory that it takes; true if a take came out.
fn assert_modest(name: &str, bytes: &[u8]) -> bool {
    let held = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let take = take::parse(name, bytes, &Options::default());
    let used = ALLOCATOR.peak_usage().saturating_sub(held);
    assert!(
        used <= BYTES_PER_BYTE * bytes.len() + SLACK,
        "{name}: {used} bytes of memory for a file of {}",
        bytes.len()
    );
    if let Ok(take) = &take {
        assert!(
            take.positions().iter().flatten().all(|x| x.is_finite()),
            "{name}"
        );
    }
    take.is_ok()
}

/// Lies that are cheap to write and dear to believe.
fn bombs() -> Vec<(&'static str, Vec<u8>)> {
    let mut points = FILES[1].1.to_vec();
    points[2..4].fill(0xff);
    points[6..10].copy_from_slice(&[1, 0, 0xff, 0xff]);
    let mut frames = FILES[13].1.to_vec();
    let entry = |index: usize| 256 + 32 * index; // of the index: frame, rows, …
    frames[entry(2) + 8] = 47;
    frames[entry(15)] = 120;
    let short_rows = format!(
        "PathFileType\nDataRate\tUnits\n1\tm\nFrame#\tTime{}\n\n{}",
        "\ta\t\t".repeat(20_000),
        "1\t0\n".repeat(20_000)
    );
    let ends = format!(
        "HIERARCHY ROOT {} {{ OFFSET 0 0 0 CHANNELS 1 Xrotation {} }}\nMOTION\nFrames: 9\nFrame Time: 1\n{}",
        "r".repeat(200),
        "End Site{OFFSET 0 0 0}\n".repeat(10_000),
        "0\n".repeat(100_000)
    );
    let channels =
        "HIERARCHY ROOT r { OFFSET 0 0 0 CHANNELS 18446744073709551615 Xrotation }".to_owned();
    let long_name = format!(
        "HIERARCHY ROOT {} \n{{ OFFSET 0 0 0 CHANNELS 1 Xrotation {} }}\nMOTION\nFrames: 1\nFrame Time: 1\n0\n",
        "r".repeat(100_000),
        "End Site{OFFSET 0 0 0}\n".repeat(5_000)
    );
    vec![
        ("points.c3d", points),
        ("frames.gsd", frames),
        ("short.trc", short_rows.into_bytes()),
        ("ends.bvh", ends.into_bytes()),
        ("channels.bvh", channels.into_bytes()),
        ("name.bvh", long_name.into_bytes()),
    ]
}

/// Files that are true, and all of whose bytes are labels.
fn crowds() -> Vec<String> {
    let header = "PathFileType\nDataRate\tUnits\n1\tm\nFrame#\tTime";
    ["a\t\t", "\t\t"]
        .map(|label| {
            format!(
                "{header}{}\tz\n\n1\t0\n",
                format!("\t{label}").repeat(50_000)
            )
        })
        .to_vec()
}

#[test]
fn a_spoilt_file_gives_a_take_or_a_refusal_and_never_costs_much() {
    for (name, bytes) in FILES {
        assert!(assert_modest(name, bytes), "{name}");
        let dense = (0..2048).chain((2048..bytes.len()).step_by(997));
        for end in dense.filter(|&end| end < bytes.len()) {
            assert_modest(name, &bytes[..end]);
        }
    }
    for text in crowds() {
        assert!(assert_modest("crowd.trc", text.as_bytes()));
    }
    for (name, bytes) in bombs() {
        assert!(!assert_modest(name, &bytes), "{name} was believed");
    }

    // Most flips go to the first bytes, where the counts and pointers stand.
    let at = prop_oneof![0_usize..64, 0_usize..9000, any::<usize>()];
    let flips = prop::collection::vec((at, any::<u8>()), 1..12);
    let mut runner = TestRunner::new(Config {
        cases: 1500,
        failure_persistence: None,
        ..Config::default()
    });
    let files = 0..FILES.len();
    let outcome = runner.run(&(files, flips), |(file, flips)| {
        let (name, mut bytes) = (FILES[file].0, FILES[file].1.to_vec());
        for (at, value) in flips {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        assert_modest(name, &bytes);
        Ok(())
    });
    outcome.unwrap();
}
