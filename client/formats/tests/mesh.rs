//! The same little mesh comes out of every format and encoding.

#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read its data has failed"
)]

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use sinew_formats::mesh::{Format, Loaded, MeshFileError, parse, read};
use sinew_mesh::{Cells, Grid, volume};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/mesh")
        .join(name)
}

fn loaded(name: &str) -> Loaded {
    read(&file(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// The error that a text is refused with.
fn refusal(name: &str, text: &str) -> String {
    match parse(name, text.as_bytes()) {
        Ok(_) => panic!("{name} was read"),
        Err(error) => error.to_string(),
    }
}

fn grid(positions: &[[f64; 3]], types: &[u8], cells: &[&[u32]]) -> Grid {
    let mut offsets = vec![0];
    for cell in cells {
        let last = *offsets.last().unwrap();
        offsets.push(last + u32::try_from(cell.len()).unwrap());
    }
    Grid {
        positions: positions.iter().map(|&p| Vector3::from(p)).collect(),
        cells: Cells {
            types: types.to_vec(),
            connectivity: cells.concat(),
            offsets,
            ..Cells::default()
        },
    }
}

/// One cell of each kind, with the wedge as VTK winds it.
fn zoo() -> Grid {
    grid(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
            [2.0, 0.5, 0.0],
            [2.0, 0.5, 1.0],
            [0.5, 0.5, 2.0],
        ],
        &[12, 13, 14, 10],
        &[
            &[0, 1, 2, 3, 4, 5, 6, 7],
            &[1, 2, 8, 5, 6, 9],
            &[4, 5, 6, 7, 10],
            &[5, 6, 10, 9],
        ],
    )
}

const ZOO: [&str; 23] = [
    "zoo_ascii.vtk",
    "zoo_binary.vtk",
    "zoo_ascii5.vtk",
    "zoo_binary5.vtk",
    "zoo_ascii.vtu",
    "zoo_binary.vtu",
    "zoo_binary_bigendian.vtu",
    "zoo_binary_zlib64.vtu",
    "zoo_appended_raw.vtu",
    "zoo_appended_raw_zlib.vtu",
    "zoo_appended_base64.vtu",
    "zoo_appended_base64_zlib.vtu",
    "zoo_1.msh",
    "zoo_2_ascii.msh",
    "zoo_2_binary.msh",
    "zoo_2_bigendian.msh",
    "zoo_4_ascii.msh",
    "zoo_4_binary.msh",
    "zoo.mesh",
    "zoo_1.meshb",
    "zoo_3_bigendian.meshb",
    "zoo_4.meshb",
    "zoo_mfem.mesh",
];

#[test]
fn one_cell_of_each_kind_comes_out_of_every_format_alike() {
    for name in ZOO {
        assert_eq!(loaded(name).grid, zoo(), "{name}");
    }
}

#[test]
fn lines_may_end_as_on_any_system() {
    for name in [
        "zoo_ascii.vtk",
        "zoo_ascii5.vtk",
        "zoo_ascii.vtu",
        "zoo_binary.vtu",
        "zoo_1.msh",
        "zoo_2_ascii.msh",
        "zoo_4_ascii.msh",
        "zoo.mesh",
        "zoo_mfem.mesh",
    ] {
        let text = std::fs::read_to_string(file(name)).unwrap();
        let loaded = parse(name, text.replace('\n', "\r\n").as_bytes()).unwrap();
        assert_eq!(loaded.grid, zoo(), "{name}");
    }
}

#[test]
fn cells_of_every_format_enclose_their_volume_right_side_out() {
    let zoo = zoo();
    let volumes: Vec<f64> = (0..4).map(|cell| volume(&zoo, cell)).collect();
    for (found, wanted) in volumes.iter().zip([1.0, 0.5, 1.0 / 3.0, 1.0 / 6.0]) {
        assert!((found - wanted).abs() < 1e-12, "{volumes:?}");
    }
    for name in ["polyhedra.vtk", "polyhedra.hedra", "polyhedra.ovm"] {
        let grid = loaded(name).grid;
        assert!((volume(&grid, 0) - 1.0).abs() < 1e-12, "{name}");
        assert!((volume(&grid, 1) - 1.0 / 3.0).abs() < 1e-12, "{name}");
    }
}

#[test]
fn faces_and_edges_beside_volumes_are_left_out_and_counted() {
    for (name, left_out) in [
        ("zoo_2_binary.msh", 2),
        ("zoo.mesh", 2),
        ("zoo_mfem.mesh", 1),
    ] {
        let warnings = loaded(name).warnings;
        let wanted = format!("left out {left_out} faces");
        assert!(warnings[0].starts_with(&wanted), "{name}: {warnings:?}");
    }
    assert_eq!(loaded("zoo_ascii.vtk").warnings, [""; 0]);
}

#[test]
fn two_tetrahedra_come_out_of_every_format_alike() {
    let wanted = grid(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
        ],
        &[10, 10],
        &[&[0, 1, 2, 3], &[1, 4, 2, 3]],
    );
    for name in ["tets.vtk", "tets.veg", "tets.ele", "tets.node"] {
        assert_eq!(loaded(name).grid, wanted, "{name}");
    }
}

#[test]
fn polyhedra_come_out_of_every_format_alike() {
    let wanted = loaded("polyhedra.vtk").grid;
    assert_eq!(wanted.cells.types, [42, 42]);
    assert_eq!(
        wanted.cells.connectivity,
        [0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 8]
    );
    assert_eq!(wanted.cells.face_offsets, [0, 31, 53]);
    assert_eq!(loaded("polyhedra_ascii.vtu").grid, wanted);
    assert_eq!(loaded("polyhedra_raw.vtu").grid, wanted);
    assert_eq!(loaded("polyhedra_tables.vtu").grid, wanted);
    // In these two the cells share a face, and rings of turned faces start elsewhere.
    for name in ["polyhedra.hedra", "polyhedra.ovm"] {
        let found = loaded(name).grid;
        assert_eq!(found.positions, wanted.positions, "{name}");
        assert_eq!(
            found.cells.connectivity, wanted.cells.connectivity,
            "{name}"
        );
        assert_eq!(faces(&found), faces(&wanted), "{name}");
    }
}

/// The rings of every cell's faces, each started at its least vertex, sorted.
fn faces(grid: &Grid) -> Vec<Vec<Vec<u32>>> {
    let rings = |cell: sinew_mesh::Cell<'_>| {
        let mut rings: Vec<Vec<u32>> = cell
            .faces()
            .map(|face| {
                let mut ring: Vec<u32> = face.vertices().collect();
                let least = (0..ring.len()).min_by_key(|&at| ring[at]).unwrap();
                ring.rotate_left(least);
                ring
            })
            .collect();
        rings.sort();
        rings
    };
    grid.cells.iter().map(rings).collect()
}

#[test]
fn polygons_come_out_of_every_format_alike() {
    let wanted = grid(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.5, 2.0, 0.0],
            [0.5, 2.0, 0.0],
        ],
        &[5, 9, 7],
        &[&[0, 1, 5], &[1, 2, 3, 4], &[4, 3, 6, 7, 5]],
    );
    for name in [
        "house.obj",
        "house.off",
        "house_colours.off",
        "house_ascii.ply",
        "house_little.ply",
        "house_big.ply",
        "house_ascii.vtk",
        "house_binary5.vtk",
        "house.vtp",
    ] {
        assert_eq!(loaded(name).grid, wanted, "{name}");
    }
}

#[test]
fn triangles_that_repeat_their_vertices_are_welded() {
    for name in ["skin_ascii.stl", "skin_binary.stl", "skin.glb"] {
        assert_eq!(loaded(name).grid, loaded("skin.off").grid, "{name}");
    }
}

#[test]
fn of_cells_of_higher_order_the_corners_remain() {
    let tet10 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n11\n1 9 9 9\n2 0 0 0\n3 .5 0 0\n4 1 0 0\n5 0 1 0\n\
        6 0 0 1\n7 .5 .5 0\n8 0 .5 0\n9 0 0 .5\n10 0 .5 .5\n11 .5 0 .5\n$EndNodes\n$Elements\n1\n\
        1 11 2 0 0 2 4 5 6 3 7 8 9 10 11\n$EndElements\n";
    let Loaded { grid, warnings, .. } = parse("t.msh", tet10.as_bytes()).unwrap();
    // The unused vertex before them is the file's own affair.
    assert_eq!(grid.positions.len(), 5);
    assert_eq!(grid.positions[0], Vector3::new(9.0, 9.0, 9.0));
    assert_eq!(grid.cells.connectivity, [1, 2, 3, 4]);
    assert!(
        warnings[0].contains("6 vertices between them are left out"),
        "{warnings:?}"
    );

    let head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 float\n";
    let points = "0 0 0 1 0 0 0 1 0 .5 0 0 .5 .5 0 0 .5 0\n";
    let cells = "CELLS 1 7\n6 0 1 2 3 4 5\nCELL_TYPES 1\n22\n";
    let grid = parse("t.vtk", format!("{head}{points}{cells}").as_bytes())
        .unwrap()
        .grid;
    assert_eq!((grid.cells.types, grid.positions.len()), (vec![5], 3));
}

#[test]
fn cells_numbered_row_by_row_are_turned_around_and_strips_cut() {
    let head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n";
    let points = "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\n";
    let cells = |cells: &str| {
        let text = format!("{head}{points}{cells}");
        parse("t.vtk", text.as_bytes()).unwrap().grid
    };
    let voxel = cells("CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n11\n");
    assert_eq!(voxel.cells.types, [12]);
    assert_eq!(volume(&voxel, 0), 1.0);
    let pixel = cells("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n8\n");
    assert_eq!(pixel.cells.connectivity, [0, 1, 3, 2]);
    let strip = cells("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n6\n");
    assert_eq!(strip.cells.connectivity, [0, 1, 2, 2, 1, 3]);
}

#[test]
fn pieces_of_one_file_become_one_mesh() {
    let piece = |ids: &str| {
        format!(
            "<Piece NumberOfPoints=\"3\" NumberOfCells=\"1\">\n\
             <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points>\n\
             <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">{ids}</DataArray>\n\
             <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray>\n\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5</DataArray></Cells></Piece>\n"
        )
    };
    let file = |pieces: [&str; 2]| {
        let [first, second] = pieces.map(piece);
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>\n{first}{second}</UnstructuredGrid></VTKFile>"
        )
    };
    let grid = parse("a.vtu", file(["0 1 2", "0 2 1"]).as_bytes())
        .unwrap()
        .grid;
    assert_eq!(grid.cells.connectivity, [0, 1, 2, 3, 5, 4]);
    assert_eq!(
        refusal("a.vtu", &file(["0 1 2", "0 2 3"])),
        "a.vtu, line 9: cell 0: vertex 3 does not exist: there are 3, from 0"
    );
    assert_eq!(
        refusal("a.vtu", &file(["0 1 2", "0\n\n x 3"])),
        "a.vtu, line 11: expected a whole number, found “x”"
    );
}

#[test]
fn content_counts_more_than_the_name() {
    let off = std::fs::read(file("house.off")).unwrap();
    let loaded = parse("house.stl", &off).unwrap();
    assert_eq!(loaded.format, Format::Off);
    assert_eq!(
        loaded.warnings,
        ["the name is that of STL, the content OFF"]
    );
    assert_eq!(read(&file("zoo.mesh")).unwrap().format, Format::Medit);
    assert_eq!(read(&file("zoo_mfem.mesh")).unwrap().format, Format::Mfem);
    let unknown = refusal("a.xyz", "1 2 3");
    assert!(unknown.contains("known are .vtk .vtu"), "{unknown}");
    assert_eq!(unknown.matches(".mesh ").count(), 1, "{unknown}");
}

/// File, content, error.
const REFUSALS: [(&str, &str, &str); 14] = [
    (
        "a.obj",
        "v 0 0 0\nv 1 0 x\n",
        "a.obj, line 2: expected z, found “x”",
    ),
    (
        "a.obj",
        "v 0 0 0\nf 1 1 7\n",
        "a.obj, line 2: vertex number 7 does not exist: there are 1, counted from 1",
    ),
    (
        "a.obj",
        "v 0 0 0\nf 1 1\n",
        "a.obj, line 2: a face of 2 vertices",
    ),
    (
        "a.obj",
        "v 0 0 inf\n",
        "a.obj, line 1: z is inf; it must be finite",
    ),
    (
        "a.off",
        "OFF\n9 9\n0 0 0\n",
        "a.off, line 2: 9 vertices are claimed, but only 7 bytes follow",
    ),
    (
        "a.off",
        "OFF\n1 0\n0 0\n",
        "a.off, line 4: the file ends where z was expected",
    ),
    (
        "a.ply",
        "ply\nformat ascii 1.0\nelement face 1\nend_header\n2\n",
        "a.ply, line 4: the faces lack the list property vertex_indices",
    ),
    (
        "a.msh",
        "$MeshFormat\n4 0 8\n",
        "a.msh, line 2: Gmsh format “4” is not read; save the mesh as version 4.1 or 2.2",
    ),
    (
        "a.mesh",
        "MFEM NURBS mesh v1.0\n",
        "a.mesh, line 1: “MFEM NURBS mesh v1.0” is not read: only “MFEM mesh v1.0”; refine or convert the mesh with MFEM and save it as that",
    ),
    (
        "a.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n",
        "a.vtk, line 4: data set “STRUCTURED_POINTS”: only UNSTRUCTURED_GRID and POLYDATA are meshes of cells; convert the file",
    ),
    (
        "a.vtu",
        "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZ4DataCompressor\"></VTKFile>",
        "a.vtu, line 1: compressor “vtkLZ4DataCompressor”: save the file with zlib or without compression",
    ),
    (
        "a.stl",
        "short",
        "a.stl, byte 0: the header needs 80 bytes, but 5 remain",
    ),
    (
        "a.off",
        "OFF\n0 0\n",
        "a.off: no faces or volumes: 0 vertices and 0 edges or points only",
    ),
    (
        "a.ele",
        "1 4 0\n",
        "a.ele: TetGen's vertices and tetrahedra are two files; both are read from a folder only",
    ),
];

#[test]
fn errors_name_file_place_value_and_reason() {
    for (name, text, wanted) in REFUSALS {
        assert_eq!(refusal(name, text), wanted);
    }
    let missing = read(&file("none.obj"));
    assert!(matches!(missing, Err(MeshFileError::Io { .. })));
}
