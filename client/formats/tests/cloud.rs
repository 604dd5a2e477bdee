//! Clouds of points from every format, and from no broken one.

#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read its data has failed"
)]

use std::{io::Write as _, path::Path};

use flate2::{Compression, write::GzEncoder};
use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_formats::cloud::{Format, parse, read};

const POINTS: [Vector3<f64>; 3] = [
    Vector3::new(0.0, 0.0, 0.5),
    Vector3::new(1.0, -0.25, 0.0),
    Vector3::new(0.0, 1.0, 2.0),
];

/// The points in classic BGEO: with a vector, an integer and one of two names for each.
fn bgeo() -> Vec<u8> {
    let mut file = b"BgeoV".to_vec();
    for number in [5, 3, 0, 0, 0, 3, 0, 0, 0] {
        file.extend(i32::to_be_bytes(number));
    }
    let attribute = |file: &mut Vec<u8>, name: &[u8], size: u16, kind: i32| {
        file.extend(u16::try_from(name.len()).unwrap().to_be_bytes());
        file.extend(name);
        file.extend(size.to_be_bytes());
        file.extend(kind.to_be_bytes());
    };
    attribute(&mut file, b"v", 3, 5);
    file.extend([0; 12]);
    attribute(&mut file, b"id", 1, 1);
    file.extend([0; 4]);
    attribute(&mut file, b"part", 1, 4);
    file.extend(2_i32.to_be_bytes());
    for name in [b"leg", b"arm"] {
        file.extend(3_u16.to_be_bytes());
        file.extend(name);
    }
    for point in POINTS {
        for number in [point.x, point.y, point.z, 1.0, 7.0, 8.0, 9.0] {
            #[expect(clippy::cast_possible_truncation, reason = "exact in binary32")]
            file.extend((number as f32).to_be_bytes());
        }
        file.extend([0, 0, 0, 1, 0, 0, 0, 1]);
    }
    file
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0.5\n1 -0.25 0\n0 1 2\n".to_vec(),
        ),
        ("a.csv", b"id,x,y,z\n7,0,0,0.5\n8,1,-0.25,0\n9,0,1,2\n".to_vec()),
        ("b.csv", b"# of a scanner\n0; 0; 0.5\n1; -0.25; 0\n0; 1; 2".to_vec()),
        ("a.xyz", b"3\nwater\nO 0 0 0.5\nH 1 -0.25 0\nH 0 1 2\n".to_vec()),
        ("b.xyz", b"0 0 0.5 255 0 0\n1 -0.25 0 255 0 0\n0 1 2 0 0 0\n".to_vec()),
        ("a.bgeo", bgeo()),
        ("b.bgeo", packed(&bgeo())),
    ]
}

#[test]
fn every_format_gives_the_same_points() {
    for (name, bytes) in files() {
        let cloud = parse(name, &bytes).unwrap();
        assert_eq!(cloud.positions, POINTS, "{name}");
        assert_eq!(Some(cloud.format), Format::of(Path::new(name)));
    }
}

#[test]
fn two_columns_lie_in_the_plane() {
    let cloud = parse("a.csv", b"x,y\r\n1,2\r\n3,4\r\n").unwrap();
    assert_eq!(
        cloud.positions,
        [Vector3::new(1.0, 2.0, 0.0), Vector3::new(3.0, 4.0, 0.0)]
    );
}

#[test]
fn a_file_cut_anywhere_is_an_error_or_has_no_point_too_many() {
    for (name, bytes) in files() {
        for length in 0..bytes.len() {
            if let Ok(cloud) = parse(name, &bytes[..length]) {
                assert!(
                    (1..=3).contains(&cloud.positions.len()),
                    "{name} at {length}"
                );
            }
        }
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    for (name, bytes, expected) in [
        (
            "a.csv",
            &b"x,y\n1,2\n3,nan\n"[..],
            "a.csv, line 3: “3,nan” has no finite number for y",
        ),
        ("a.csv", b"x,y\n", "a.csv: holds no point"),
        (
            "a.xyz",
            b"4\nc\nH 0 0 0\n",
            "a.xyz, line 3: 4 points are claimed, and 1 follow; the file is cut",
        ),
        (
            "a.bgeo",
            b"PGEOMETRY",
            "a.bgeo, byte 0: this is no classic BGEO; save it as Houdini 11 does",
        ),
        (
            "a.las",
            b"",
            "a.las: the extension is not that of a cloud; known are ply, csv, xyz, bgeo",
        ),
    ] {
        let error = parse(name, bytes).unwrap_err().to_string();
        assert_eq!(error, expected);
    }
    let mut claimed = bgeo();
    claimed[9..13].copy_from_slice(&i32::MAX.to_be_bytes());
    let error = parse("a.bgeo", &claimed).unwrap_err().to_string();
    assert!(error.contains("2147483647 points are claimed"), "{error}");
}

#[test]
fn the_shared_clouds_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/pointcloud");
    if !folder.exists() {
        eprintln!("skipped: no {}", folder.display());
        return;
    }
    for (name, count) in [
        ("gen_bars2d.csv", 2_220),
        ("gen_bars3d.ply", 4_896),
        ("gen_octopus.ply", 8_267),
        ("splishsplash_beam_r_0.025.bgeo", 8_982),
        ("splishsplash_particle_grid.bgeo", 400),
    ] {
        assert_eq!(
            read(&folder.join(name)).unwrap().positions.len(),
            count,
            "{name}"
        );
    }
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        file in 0..7_usize,
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
    ) {
        let (name, mut spoilt) = files().swap_remove(file);
        parse(name, &bytes).ok();
        let at = at.index(spoilt.len());
        spoilt[at] = byte;
        parse(name, &spoilt).ok();
    }
}
