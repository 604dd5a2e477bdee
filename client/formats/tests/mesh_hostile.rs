//! Whatever the bytes, the answer is a mesh or an error: no panic, no memory for what is only claimed.

#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read its data has failed"
)]

use std::path::{Path, PathBuf};

use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;
use sinew_formats::mesh::{Loaded, MeshFileError, parse};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What all tests of this file together never take; what they claim is at least a hundred times as much.
const MEBIBYTES: f32 = 100.0;

/// Every mesh of the test data with its name, except TetGen's pairs, which are read from a folder only.
fn files() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mesh");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension != "md"))
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, std::fs::read(path).unwrap())
        })
        .collect()
}

fn is_sound(answer: Result<Loaded, MeshFileError>) -> bool {
    match answer {
        Ok(loaded) => loaded.grid.check().is_ok() && !loaded.grid.cells.types.is_empty(),
        Err(error) => !error.to_string().is_empty(),
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error_or_a_sound_mesh() {
    for (name, bytes) in files() {
        for length in 0..bytes.len() {
            assert!(
                is_sound(parse(&name, &bytes[..length])),
                "{name} at {length}"
            );
        }
    }
}

#[test]
fn claimed_counts_are_refused_before_memory_is_taken() {
    let vtk = "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n";
    let gmsh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n";
    let cases = [
        ("a.vtk", format!("{vtk}POINTS 4000000000 double\n")),
        ("a.vtk", format!("{vtk}POINTS -1 double\n")),
        ("a.vtk", format!("{vtk}POINTS 9223372036854775807 double\n")),
        ("a.vtk", format!("{vtk}CELLS 4000000000 4000000000\n")),
        ("a.vtk", format!("{vtk}CELLS 4000000000 1\nOFFSETS vtktypeint64\n")),
        ("a.vtk", format!("{vtk}FIELD f 1\na 4000000000 4000000000 int\n")),
        ("a.msh", format!("{gmsh}4000000000\n")),
        ("a.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices\n4000000000\n".into()),
        ("a.mesh", "MFEM mesh v1.0\ndimension\n3\nelements\n0\nvertices\n4000000000\n3\n".into()),
        ("a.off", "OFF\n4000000000 4000000000 0\n".into()),
        ("a.off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n".into()),
        ("a.hedra", "4000000000 4000000000 4000000000\n".into()),
        ("a.ovm", "OVM ASCII\nVertices\n4000000000\n".into()),
        ("a.veg", "*VERTICES\n4000000000 3 0 0\n".into()),
        (
            "a.ply",
            "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n".into(),
        ),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement face 1\nproperty list uint int vertex_index\nend_header\n4000000000 1\n".into(),
        ),
    ];
    for (name, text) in cases {
        let error = parse(name, text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(" are claimed, but "), "{error}");
    }
    let mut stl = vec![0; 80];
    stl.extend(4_000_000_000_u32.to_le_bytes());
    let error = parse("a.stl", &stl).unwrap_err().to_string();
    assert_eq!(
        error,
        "a.stl, byte 80: 4000000000 triangles are claimed, but only 0 bytes follow"
    );
    assert!(MEMORY.peak_usage_as_mb() < MEBIBYTES);
}

/// A VTU whose points are the given base64 text.
fn vtu(compressor: &str, base64: &str) -> String {
    format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt32\"{compressor}>\n\
         <UnstructuredGrid><Piece NumberOfPoints=\"4000000000\" NumberOfCells=\"1\"><Points>\n\
         <DataArray type=\"Float64\" Name=\"p\" NumberOfComponents=\"3\" format=\"binary\">{base64}</DataArray>\n\
         </Points></Piece></UnstructuredGrid></VTKFile>"
    )
}

#[test]
fn lengths_within_binary_arrays_are_refused_before_memory_is_taken() {
    let zlib = " compressor=\"vtkZLibDataCompressor\"";
    // A length of 2^32 - 1; as many blocks; one block of 2^32 - 1 bytes out of 8.
    for (text, wanted) in [
        (vtu("", "/////w=="), "4294967295 bytes are claimed"),
        (
            vtu(zlib, "/////wAAAAAAAAAA"),
            "4294967295 compressed blocks are claimed",
        ),
        (
            vtu(zlib, "AQAAAP////8AAAAACAAAAA==eJwDAAAAAAE="),
            "8 bytes cannot hold a block of 4294967295",
        ),
        (
            vtu("", "AAAAAA=="),
            "4000000000 points are claimed, but there are 0 coordinates",
        ),
    ] {
        let error = parse("a.vtu", text.as_bytes()).unwrap_err().to_string();
        assert!(
            error.starts_with("a.vtu, line 3: ") && error.contains(wanted),
            "{error}"
        );
    }
    assert!(MEMORY.peak_usage_as_mb() < MEBIBYTES);
}

#[test]
fn nesting_without_end_is_no_stack_overflow() {
    let xml = "<VTKFile>".repeat(200_000);
    assert!(parse("a.vtu", xml.as_bytes()).is_err());
    let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    let json = "[".repeat(200_000);
    glb.extend(u32::try_from(json.len()).unwrap().to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(json.bytes());
    assert!(parse("a.glb", &glb).is_err());
}

#[test]
fn a_large_face_repeated_by_polyhedra_is_refused() {
    let ring = " 1".repeat(1000);
    let uses = " 1".repeat(1000);
    let hedra = format!("1 1 2 0 0 0\n1000{ring}\n1000{uses}\n1000{uses}\n");
    let error = parse("a.hedra", hedra.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("named by more than two polyhedra"),
        "{error}"
    );
    assert!(MEMORY.peak_usage_as_mb() < MEBIBYTES);
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 64,
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..ProptestConfig::default()
    })]

    #[test]
    fn flipped_bytes_are_an_error_or_a_sound_mesh(
        flips in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)
    ) {
        for (name, mut bytes) in files() {
            for (place, value) in &flips {
                let place = place.index(bytes.len());
                bytes[place] = *value;
            }
            prop_assert!(is_sound(parse(&name, &bytes)), "{}", name);
        }
    }

    #[test]
    fn any_bytes_under_any_name_are_an_error_or_a_sound_mesh(
        bytes in proptest::collection::vec(any::<u8>(), 0..256),
        text in "[0-9 \n.$*a-fA-F-]{0,64}",
    ) {
        for format in sinew_formats::mesh::Format::ALL {
            let name = format!("a.{}", format.extensions()[0]);
            prop_assert!(is_sound(parse(&name, &bytes)), "{}", name);
            prop_assert!(is_sound(parse(&name, text.as_bytes())), "{}", name);
        }
    }
}
