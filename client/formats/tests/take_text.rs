//! TRC and BVH: small files whose every value is known.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Vector3;
use sinew_formats::take::{self, Options, Place, Take, TakeFileError};

fn parse(name: &str, text: &str) -> Result<Take, TakeFileError> {
    take::parse(name, text.as_bytes(), &Options::default())
}

/// The place and the words of a refusal.
fn refusal(name: &str, text: &str) -> (Place, String) {
    match parse(name, text) {
        Err(TakeFileError::Malformed { place, problem, .. }) => (place, problem),
        other => panic!("{other:?}"),
    }
}

/// Two markers at 100 Hz, in `unit`.
fn trc(unit: &str, rows: &str) -> String {
    format!(
        "PathFileType\t4\t(X/Y/Z)\twave.trc\n\
         DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\n\
         100\t200\t{frames}\t2\t{unit}\t100\n\
         Frame#\tTime\thand\t\t\tfoot\t\t\n\
         \t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n{rows}",
        frames = rows.lines().count()
    )
}

#[test]
fn trc_reads_the_data_rate_the_first_time_and_the_unit() {
    let rows = "7\t0.06\t1\t2\t3\t4\t5\t6\n8\t0.07\t-1\t-2e1\t+3.5\t4\t5\t6\n";
    for (unit, metres) in [
        ("mm", 1e-3),
        ("cm", 1e-2),
        ("m", 1.0),
        ("in", 0.0254),
        ("Meters", 1.0),
    ] {
        let take = parse("a.trc", &trc(unit, rows)).unwrap();
        assert_eq!(take.labels(), ["hand", "foot"]);
        assert_eq!((take.rate_hz(), take.first_time_seconds()), (100.0, 0.06));
        let expected = Vector3::new(-1.0, -20.0, 3.5) * metres;
        assert!((take.frame(1).0[0] - expected).amax() < 1e-15, "{unit}");
        assert_eq!(take.warnings(), [""; 0]);
    }
}

#[test]
fn trc_knows_every_spelling_of_a_gap() {
    for gap in [
        "",
        " ",
        "nan",
        "NaN",
        "   NAN ",
        "-nan(ind)",
        "1.#QNAN",
        "-1.#IND00",
        "inf",
    ] {
        let rows = format!("1\t0\t1\t2\t3\t4\t5\t6\n2\t0.01\t{gap}\t{gap}\t{gap}\t4\t{gap}\t6\n");
        for text in [trc("mm", &rows), trc("mm", &rows).replace('\n', "\r\n")] {
            let take = parse("a.trc", &text).unwrap();
            assert_eq!(take.visible(), [true, true, false, false], "{gap:?}");
            assert_eq!(take.frame(0).0, take.frame(1).0);
        }
    }
}

#[test]
fn trc_rows_stripped_of_trailing_blanks_lack_whole_points() {
    let take = parse(
        "a.trc",
        &trc("mm", "1\t0\t1\t2\t3\n2\t0.01\t1\t2\t3\t4\t5\t6\t\t\n"),
    )
    .unwrap();
    assert_eq!(take.visible(), [true, false, true, true]);
    assert!(take.warnings()[0].contains("1 rows end early"));
    let (place, problem) = refusal("a.trc", &trc("mm", "1\t0\t1\t2\t3\t4\n"));
    assert_eq!(place, Place::Line(7));
    assert!(problem.contains("after 6 of 8 columns"), "{problem}");
}

#[test]
fn trc_counts_that_disagree_with_the_rows_are_warned_of() {
    let text = trc("mm", "1\t0\t1\t2\t3\t4\t5\t6\n3\t0.02\t1\t2\t3\t4\t5\t6\n");
    let take = parse("a.trc", &text.replace("\t2\t2\t", "\t9\t7\t")).unwrap();
    let warnings = take.warnings().join("\n");
    assert!(
        warnings.contains("NumMarkers is 7, but 2 markers"),
        "{warnings}"
    );
    assert!(
        warnings.contains("NumFrames is 9, but there are 2 rows"),
        "{warnings}"
    );
    assert!(
        warnings.contains("do not follow each other, first at line 8"),
        "{warnings}"
    );
    let late = trc("mm", "1\t0\t1\t2\t3\t4\t5\t6\n2\t0.5\t1\t2\t3\t4\t5\t6\n");
    assert!(parse("a.trc", &late).unwrap().warnings()[0].contains("span 0.5 s"));
}

#[test]
fn trc_refusals_name_the_line_and_the_value() {
    let good = trc("mm", "1\t0\t1\t2\t3\t4\t5\t6\n");
    for (from, to, line, words) in [
        ("PathFileType", "Path", 1, "PathFileType"),
        ("\n100\t200", "\n0\t200", 3, "DataRate is \"0\""),
        ("\tmm\t", "\tparsec\t", 3, "Units is \"parsec\""),
        ("\thand\t\t\tfoot", "", 4, "names no marker"),
        ("1\t0\t1", "one\t0\t1", 7, "begins with \"one\""),
        ("1\t0\t1", "1\tnoon\t1", 7, "the time is \"noon\""),
        ("\t5\t6", "\t5,5\t6", 7, "column 7 holds \"5,5\""),
        ("\t5\t6", "\t5\t6\t7", 7, "holds \"7\" after the last of 8"),
        ("1\t0\t1\t2\t3\t4\t5\t6\n", "", 6, "no rows"),
    ] {
        let (place, problem) = refusal("a.trc", &good.replacen(from, to, 1));
        assert_eq!(place, Place::Line(line), "{problem}");
        assert!(problem.contains(words), "{problem}");
    }
}

/// A root with one limb: shoulder, elbow, hand.
const LIMB: &str = "HIERARCHY\nROOT Left Shoulder\n{\n OFFSET 1 2 3\n\
    CHANNELS 4 Zrotation Xposition Yrotation Zposition\n JOINT Elbow {\n OFFSET 10 0 0\n\
    CHANNELS 3 Xrotation Zrotation Yrotation\n End Site\n {\n OFFSET 0 5 0\n }\n }\n}\n\
    MOTION\nFrames: 2\nFrame Time: 0.0333333\n";

#[test]
fn bvh_places_joints_by_rotations_in_the_order_of_the_channels() {
    let take = parse(
        "limb.bvh",
        &format!("{LIMB}90 7 90 0 90 45 0\n0 0 0 0 0 0 0\n"),
    )
    .unwrap();
    assert_eq!(take.labels(), ["Left Shoulder", "Elbow", "Elbow_end"]);
    assert_eq!(take.skeleton(), [[0, 1], [1, 2]]);
    assert_eq!(take.rate_hz(), 30.0);
    assert!(take.visible().iter().all(|&visible| visible));
    // The root stands at (7, 2, 0): two coordinates from channels, one from its offset. Its axes are Rz(90)·Ry(90):
    // x → −z, y → −x, z → y. The hand is Rx(90)·Rz(45)·(0, 5, 0) = 5·(−√½, 0, √½) from the elbow, in those axes.
    let shoulder = Vector3::new(7.0, 2.0, 0.0);
    let elbow = shoulder + Vector3::new(0.0, 0.0, -10.0);
    let hand = elbow + 5.0 * FRAC_1_SQRT_2 * Vector3::new(0.0, 1.0, 1.0);
    for (position, centimetres) in take.frame(0).0.iter().zip([shoulder, elbow, hand]) {
        assert!(
            (position * 100.0 - centimetres).amax() < 1e-12,
            "{position} {centimetres}"
        );
    }
    let rest = [[0.0, 2.0, 0.0], [10.0, 2.0, 0.0], [10.0, 7.0, 0.0]].map(Vector3::from);
    for (position, centimetres) in take.frame(1).0.iter().zip(rest) {
        assert!((position * 100.0 - centimetres).amax() < 1e-12);
    }
}

#[test]
fn bvh_bones_keep_their_length_in_every_frame() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/take/freebvh_cut.bvh"
    );
    let take = take::read(
        path,
        &Options {
            unit_scale: Some(1.0),
        },
    )
    .unwrap();
    assert_eq!(take.warnings(), [""; 0]);
    assert_eq!(take.skeleton().len(), take.labels().len() - 1);
    for &[parent, child] in take.skeleton() {
        let length = |frame: usize| {
            let positions = take.frame(frame).0;
            (positions[child] - positions[parent]).norm()
        };
        for frame in 1..take.frames() {
            assert!((length(frame) - length(0)).abs() < 1e-9);
        }
    }
}

#[test]
fn bvh_rates_are_whole_where_the_printed_frame_time_means_so() {
    for (time, rate) in [
        ("0.0333333", 30.0),
        ("0.008333", 120.0),
        ("0.0417", 24.0),
        ("0.01", 100.0),
        ("1", 1.0),
        ("0.03", 1.0 / 0.03),
        ("0.0166", 1.0 / 0.0166),
        ("0.03336670", 1.0 / 0.033_366_7),
    ] {
        let text = format!("{LIMB}0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n").replace("0.0333333", time);
        assert_eq!(parse("a.bvh", &text).unwrap().rate_hz(), rate, "{time}");
    }
}

#[test]
fn bvh_refusals_name_the_line_and_the_value() {
    let good = format!("{LIMB}0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n");
    for (from, to, line, words) in [
        ("HIERARCHY", "HIERARCHIE", 1, "HIERARCHIE"),
        ("OFFSET 1 2 3", "OFFSET 1 two 3", 4, "two"),
        ("CHANNELS 4", "CHANNELS x", 5, "CHANNELS is \"x\""),
        ("Yrotation Zposition", "Wrotation Zposition", 5, "Wrotation"),
        ("JOINT", "BONE", 6, "BONE"),
        (" OFFSET 0 5 0", "OFFSET 0 5 0\nJOINT toe", 12, "JOINT"),
        ("Frames: 2", "Frames: many", 16, "many"),
        ("0.0333333", "0", 17, "Frame Time is \"0\""),
        (
            "0 0 0 0 0 0 0\n0",
            "0 0 0 0 0 0\n0",
            18,
            "holds 6 values, but the joints have 7",
        ),
        (
            "0 0 0 0 0 0 0\n0",
            "0 0 0 0 0 0 0 0\n0",
            18,
            "holds 8 values",
        ),
        (
            "0 0 0 0 0 0 0\n0",
            "0 0 nan 0 0 0 0\n0",
            18,
            "value 3 is \"nan\"",
        ),
        ("0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n", "", 17, "no rows"),
        (
            "OFFSET 10 0 0",
            "OFFSET 1.7e308 1.7e308 0",
            18,
            "\"Elbow\" lies too far",
        ),
    ] {
        let text = good
            .replacen(from, to, 1)
            .replace("0 0 0 0 0 0 0\n", "45 0 45 0 0 0 0\n");
        let (place, problem) = refusal("a.bvh", &text);
        assert_eq!(place, Place::Line(line), "{problem}");
        assert!(problem.contains(words), "{problem}");
    }
    let take = parse("a.bvh", &good.replace("Frames: 2", "Frames: 3")).unwrap();
    assert!(take.warnings()[1].contains("Frames is 3, but there are 2 rows"));
}

#[test]
fn bvh_nesting_of_any_depth_is_no_danger() {
    let mut text = "HIERARCHY\nROOT r { OFFSET 0 0 0 CHANNELS 1 Xrotation\n".to_owned();
    for _ in 0..50_000 {
        text += "JOINT j { OFFSET 0 1 0 CHANNELS 1 Xrotation\n";
    }
    text += &"}".repeat(50_001);
    text += "\nMOTION\nFrames: 1\nFrame Time: 1\n";
    text += &"0 ".repeat(50_001);
    let take = parse("deep.bvh", &text).unwrap();
    assert_eq!(take.labels()[50_000], "j_50000");
    assert_eq!(take.positions()[50_000].y, 500.0);
}
