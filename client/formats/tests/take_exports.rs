//! Text exports of capture programs and recordings of particle simulators: small files whose every value is known, and
//! the shared ones against what their manifest counts.

use std::path::Path;

use nalgebra::Vector3;
use sinew_formats::take::{self, Options, Place, Take, TakeFileError, Up};

fn parse(name: &str, text: &str) -> Result<Take, TakeFileError> {
    take::parse(name, text.as_bytes(), &Options::default())
}

/// The line and the words of a refusal.
fn refusal(name: &str, text: &str) -> (usize, String) {
    match parse(name, text) {
        Err(TakeFileError::Malformed {
            place: Place::Line(line),
            problem,
            ..
        }) => (line, problem),
        other => panic!("{other:?}"),
    }
}

const MOTIVE: &str = "Format Version,1.23,Take Name,wave,Capture Frame Rate,240.0,Export Frame Rate,120.0,Length Units,Millimeters\n\
    \n\
    ,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,Marker,Marker,Marker,Marker\n\
    ,Name,Box,Box,Box,Box,Box,Box,Box,Box,hand,hand,hand,Unlabeled 7,Unlabeled 7,Unlabeled 7\n\
    ,ID,\"A\",\"A\",\"A\",\"A\",\"A\",\"A\",\"A\",\"A\",\"B\",\"B\",\"B\",\"C\",\"C\",\"C\"\n\
    ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position,Position,Position,Position,Position,Position\n\
    Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,X,Y,Z\n\
    0,0.0,0,0,0,1,5,5,5,0.1,10,20,30,1,1,1\n\
    1,0.008,0,0,0,1,5,5,5,0.1,,,,1,1,1\n";

#[test]
fn motive_gives_the_labelled_markers() {
    let take = parse("a.csv", MOTIVE).unwrap();
    assert_eq!(
        (take.labels(), take.rate_hz()),
        (&["hand".to_owned()][..], 120.0)
    );
    assert_eq!(take.positions()[0], Vector3::new(0.01, 0.02, 0.03));
    assert_eq!(take.visible(), [true, false]);
    assert_eq!(take.up(), Some(Up::Y));
    assert_eq!(take.warnings(), ["1 unlabelled markers were left out"]);
    let bodies = parse(
        "a.csv",
        &MOTIVE
            .replace("Marker,", "Other,")
            .replace(",Marker\n", ",Other\n"),
    );
    assert_eq!(bodies.unwrap().positions()[0], Vector3::repeat(0.005));
}

#[test]
fn nexus_reads_the_section_of_the_trajectories_and_no_other() {
    let text = "Devices\n1000\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,5\n\nTrajectories\n100\n,,Ann:hip,,,Ann:knee,,\n\
        Frame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n1,0,1,2,3,4,5,6\n2,0,1,2,3,,,\n\nModel Outputs\n100\nx\n";
    let take = parse("a.csv", text).unwrap();
    assert_eq!(take.labels(), ["Ann:hip", "Ann:knee"]);
    assert_eq!(
        (take.frames(), take.rate_hz(), take.up()),
        (2, 100.0, Some(Up::Z))
    );
    assert_eq!(take.visible(), [true, true, true, false]);
    assert_eq!(take.positions()[1], Vector3::new(4.0, 5.0, 6.0) * 0.001);
}

#[test]
fn qualisys_writes_gaps_as_zeros_and_may_leave_out_frames_and_times() {
    let head = "NO_OF_FRAMES\t2\nFREQUENCY\t50\nMARKER_NAMES\tA\tB\n";
    for (columns, lead) in [("", ""), ("Frame\tTime\tA X\tA Y\n", "1\t0.02\t")] {
        let text =
            format!("{head}{columns}{lead}1\t2\t3\t4\t5\t6\n{lead}1\t2\t3\t0.000\t0.000\t0.000\n");
        let take = parse("a.tsv", &text).unwrap();
        assert_eq!(take.visible(), [true, true, true, false]);
        assert_eq!(take.positions()[1], Vector3::new(4.0, 5.0, 6.0) * 0.001);
    }
}

#[test]
fn plain_tables_need_a_time_and_named_points() {
    let text =
        "frame;time;hand.x;hand.y;hand.z;note\n0;1.5;1;2;3;ok\n1;1.6;4;5;nan;\n2;1.7;7;8;9;\n";
    let take = parse("a.csv", text).unwrap();
    assert!((take.rate_hz() - 10.0).abs() < 1e-9);
    assert_eq!(
        (take.first_time_seconds(), take.labels()),
        (1.5, &["hand".to_owned()][..])
    );
    assert_eq!(take.visible(), [true, false, true]);
    assert_eq!(
        refusal("a.csv", "hand_x,hand_y,hand_z\n1,2,3\n").1,
        "has no column `time`, in seconds"
    );
    assert!(
        refusal("a.csv", "time,a,b\n")
            .1
            .contains("name_x, name_y, name_z")
    );
    let (line, problem) = refusal("a.csv", "time,a_x,a_y,a_z\n0,1,2,3\n1,1,two,3\n");
    assert_eq!(
        (line, &*problem),
        (3, "column 3 (a) holds \"two\", not a number")
    );
}

#[test]
fn storage_files_give_their_points_or_say_that_they_hold_none() {
    let text = "walk\nversion=1\nendheader\ntime\tpelvis_tx\tpelvis_ty\tpelvis_tz\tknee_angle\n0\t1\t2\t3\t90\n0.5\t4\t5\t6\t80\n";
    let take = parse("a.mot", text).unwrap();
    assert_eq!(
        (take.labels(), take.rate_hz()),
        (&["pelvis".to_owned()][..], 2.0)
    );
    assert_eq!(take.positions()[1], Vector3::new(4.0, 5.0, 6.0));
    assert_eq!(
        take.warnings(),
        ["1 columns are no points, and were left out"]
    );
    let (line, problem) = refusal("a.sto", "endheader\ntime\tf_vx\tf_vy\tf_vz\n0\t1\t2\t3\n");
    assert_eq!(line, 2);
    assert!(
        problem.starts_with("none of 4 columns hold points"),
        "{problem}"
    );
}

/// Two frames of three particles in a periodic box of 10.
fn dump(columns: &str, first: &str, second: &str) -> String {
    let frame = |step: u32, rows: &str| {
        format!(
            "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS pp pp ff\n0 10\n0 10\n-1 1\nITEM: ATOMS {columns}\n{rows}",
            rows.lines().count()
        )
    };
    frame(0, first) + &frame(100, second)
}

#[test]
fn lammps_particles_are_known_by_their_ids_and_followed_through_the_walls() {
    let text = dump("id x y z", "2 9.5 1 0\n1 5 5 0\n", "1 5 5 0.5\n2 0.5 1 0\n");
    let take = parse("a.lammpstrj", &text).unwrap();
    assert_eq!(take.labels(), ["p1", "p2"]);
    assert_eq!(
        take.frame(1).0,
        [Vector3::new(5.0, 5.0, 0.5), Vector3::new(10.5, 1.0, 0.0)]
    );
    let images = dump("id x y z ix iy iz", "1 1 1 0 2 0 0\n", "1 1 1 0 -1 0 0\n");
    let take = parse("a.dump", &images).unwrap();
    assert_eq!([take.positions()[0].x, take.positions()[1].x], [21.0, -9.0]);
    let scaled = dump("xs ys", "0.25 0.5\n", "0.3 0.5\n");
    let take = parse("a.dump", &scaled).unwrap();
    assert_eq!(take.positions()[0], Vector3::new(2.5, 5.0, 0.0));
}

#[test]
fn a_particle_that_goes_is_not_seen_from_then_on() {
    let text = dump("id x y", "1 1 1\n2 2 2\n", "2 2 3\n");
    let take = parse("a.dump", &text).unwrap();
    assert_eq!(take.visible(), [true, true, false, true]);
}

#[test]
fn xyz_keeps_its_number_of_particles() {
    let take = parse(
        "a.xyz",
        "2\nwater\nO 0 0 1\nH 1 0 0 extra\n2\n\nO 0 0 2\nH 1 1 0\n",
    )
    .unwrap();
    assert_eq!((take.frames(), take.labels().len()), (2, 2));
    assert_eq!(take.frame(1).0[0], Vector3::new(0.0, 0.0, 2.0));
    let (line, problem) = refusal("a.xyz", "1\n\nO 0 0 1\n2\n\nO 0 0 2\nH 1 1 0\n");
    assert_eq!(line, 4);
    assert!(
        problem.starts_with("2 particles, and 1 before"),
        "{problem}"
    );
    assert_eq!(
        refusal("a.xyz", "1\n\nO 0 zero 1\n"),
        (3, "a coordinate is \"zero\", not a number".into())
    );
    assert_eq!(
        refusal("a.xyz", "3\n\nO 0 0 1\n").1,
        "the file ends before the last particle"
    );
}

/// File, frames, points, rate, hidden samples in per cent, points with gaps: as the manifest of the shared data counts.
const SHARED: [(&str, usize, usize, f64, f64, usize); 9] = [
    ("mocap/csv/motive123_markers.csv", 1353, 18, 360.0, 8.41, 3),
    ("mocap/csv/qualisys_2markers.tsv", 720, 2, 120.0, 0.0, 0),
    (
        "mocap/csv/vicon_nexus_pyomeca.csv",
        580,
        51,
        100.0,
        1.03,
        13,
    ),
    (
        "mocap/mot/opensim_subject01_walk1_grf.mot",
        451,
        2,
        600.0,
        0.0,
        0,
    ),
    (
        "mocap/mot/opensim_subject01_walk1_ik.mot",
        211,
        1,
        60.0,
        0.0,
        0,
    ),
    ("particles/gen_crack2d.lammpstrj", 25, 1960, 60.0, 0.0, 0),
    ("particles/helium.xyz", 150, 125, 60.0, 0.0, 0),
    ("particles/nacl.lammpstrj", 6, 512, 60.0, 0.0, 0),
    ("particles/polymer.lammpstrj", 25, 1714, 60.0, 0.0, 0),
];

#[test]
fn the_shared_files_hold_what_their_manifest_counts() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        eprintln!("skipped: no shared data at {}", folder.display());
        return;
    }
    for (name, frames, points, rate_hz, hidden, with_gaps) in SHARED {
        let take = take::read(folder.join(name), &Options::default()).unwrap();
        assert_eq!(
            (take.frames(), take.labels().len()),
            (frames, points),
            "{name}"
        );
        assert!(
            (take.rate_hz() / rate_hz - 1.0).abs() < 1e-3,
            "{name}: {}",
            take.rate_hz()
        );
        let gaps = take.gaps();
        let missing: usize = gaps.iter().map(|gap| gap.missing).sum();
        let share = 100.0 * missing as f64 / (frames * points) as f64;
        assert!((share - hidden).abs() < 0.005, "{name}: {share} %");
        assert_eq!(
            gaps.iter().filter(|gap| gap.missing > 0).count(),
            with_gaps,
            "{name}"
        );
    }
    let empty = take::read(
        folder.join("mocap/csv/motive123_empty.csv"),
        &Options::default(),
    );
    let empty = empty.unwrap_err().to_string();
    assert!(
        empty.contains("line 7") && empty.contains("export with markers"),
        "{empty}"
    );
    let forces = take::read(
        folder.join("mocap/mot/opensim_walking2_grfs.sto"),
        &Options::default(),
    );
    assert!(forces.unwrap_err().to_string().contains("hold points"));
}

#[test]
fn particles_of_gsd_go_through_walls_by_their_images() {
    let bytes: &[u8] = include_bytes!("data/take/small_crystal.gsd");
    let take = take::parse("a.gsd", bytes, &Options::default()).unwrap();
    assert_eq!((take.frames(), take.labels().len()), (5, 8));
    assert_eq!(
        take.frame(3),
        take.frame(0),
        "what a frame does not hold is as in the first"
    );
    let error = take::parse("a.gsd", &bytes[..600], &Options::default()).unwrap_err();
    assert!(error.to_string().contains("is cut"), "{error}");
}
