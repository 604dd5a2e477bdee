//! The meshes of the shared folder: what inspection finds in them is what their manifest says. Skipped where the folder
//! is not beside the workspace.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use sinew_mesh::{
    Cell, CellShape, CellType, Cells, Grid, Inspection, fill, inspect, repair, surface,
};

/// The file's text, or `None` (and a note) where there is no shared folder.
fn text(file: &str) -> Option<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        println!("skipped {file}: no folder {}", folder.display());
        return None;
    }
    Some(fs::read_to_string(folder.join(file)).unwrap())
}

fn grid(positions: Vec<Vector3<f64>>, cells: Vec<(CellType, Vec<u32>)>) -> Grid {
    let mut grid = Grid {
        positions,
        cells: Cells::default(),
    };
    for (kind, vertices) in cells {
        grid.cells.push(Cell {
            kind,
            vertices: &vertices,
            face_stream: &[],
        });
    }
    assert_eq!(grid.check(), Ok(()));
    grid
}

/// As many values as there are, from a table of numbers.
fn numbers<T: std::str::FromStr>(text: &str) -> Vec<T> {
    text.split_whitespace()
        .map_while(|word| word.parse().ok())
        .collect()
}

fn points(coordinates: &[f64]) -> Vec<Vector3<f64>> {
    coordinates
        .chunks_exact(3)
        .map(Vector3::from_column_slice)
        .collect()
}

/// Just enough of legacy VTK for the files named here: tetrahedra in ASCII.
fn legacy_vtk(text: &str) -> Grid {
    let after = |word: &str| text.split_once(word).unwrap().1.split_once('\n').unwrap().1;
    let cells: Vec<u32> = numbers(after("\nCELLS"));
    let cells = cells
        .chunks_exact(5)
        .map(|cell| (CellType::Tetrahedron, cell[1..].to_vec()));
    grid(points(&numbers(after("\nPOINTS"))), cells.collect())
}

/// Just enough of VTU for the files named here: tetrahedra in ASCII, points first and connectivity second.
fn vtu(text: &str) -> Grid {
    let mut arrays = text
        .split("format=\"ascii\"")
        .skip(1)
        .map(|rest| rest.split_once('>').unwrap().1);
    let positions = points(&numbers(arrays.next().unwrap()));
    let cells: Vec<u32> = numbers(arrays.next().unwrap());
    let cells = cells
        .chunks_exact(4)
        .map(|cell| (CellType::Tetrahedron, cell.to_vec()));
    grid(positions, cells.collect())
}

/// Vertices and faces of an OBJ file, faces as triangle fans like the manifest counts them.
fn obj(text: &str) -> Grid {
    let mut positions = Vec::new();
    let mut cells = Vec::new();
    // A backslash continues a line.
    for line in text.replace("\\\r\n", "").lines() {
        if let Some(rest) = line.strip_prefix("v ") {
            positions.extend(points(&numbers(rest)));
        } else if let Some(rest) = line.strip_prefix("f ") {
            let corners = rest
                .split_whitespace()
                .map(|corner| corner.split('/').next().unwrap());
            let ring: Vec<u32> = corners
                .map(|corner| corner.trim().parse::<u32>().unwrap() - 1)
                .collect();
            cells.extend(
                (2..ring.len())
                    .map(|at| (CellType::Triangle, vec![ring[0], ring[at - 1], ring[at]])),
            );
        }
    }
    grid(positions, cells)
}

/// Coincident vertices made one, as the manifest's reader does.
fn merged(mut grid: Grid) -> Grid {
    for [again, first] in inspect(&grid).duplicate_vertices {
        for vertex in &mut grid.cells.connectivity {
            if *vertex == again {
                *vertex = first;
            }
        }
    }
    grid
}

fn assert_repairable(grid: Grid) {
    let (repaired, _) = repair(grid);
    assert_eq!(repaired.check(), Ok(()));
    let Inspection {
        inside_out,
        inverted_cells,
        zero_volume_cells,
        zero_area_cells,
        duplicate_cells,
        unused_vertices,
        miswound_edges,
        ..
    } = inspect(&repaired);
    assert!(!inside_out);
    for cells in [
        inverted_cells,
        zero_volume_cells,
        zero_area_cells,
        unused_vertices,
    ] {
        assert_eq!(cells, []);
    }
    assert_eq!(duplicate_cells, [[0; 2]; 0]);
    assert_eq!(miswound_edges, [[0; 2]; 0]);
}

/// Some 50,000 tetrahedra hold what the surface encloses, but for what is thinner than they are.
fn assert_fillable(grid: &Grid, volume: f64, file: &str) {
    let spacing = (volume * 12.0 / 50_000.0).cbrt();
    let filled = fill(CellShape::Tetrahedron, spacing, grid).unwrap();
    let found = inspect(&filled);
    assert_eq!(found.inverted_cells, [], "{file}");
    assert_eq!(found.non_manifold_faces, [[0; 0]; 0], "{file}");
    // These overlap: what both enclose is filled once, and counts twice in the signed volume.
    let overlap = file == "cinolib_two_spheres.obj";
    let least = if overlap { 0.8 } else { 0.95 };
    let share = found.volume / volume;
    assert!((least..1.02).contains(&share), "{file}: {share}");
}

/// File, reader, boundary triangles, inverted cells, zero-volume cells, non-manifold edges, unused vertices.
type Tetrahedra = (&'static str, fn(&str) -> Grid, [usize; 5]);

#[test]
fn tetrahedra_are_as_the_manifest_says() {
    let files: [Tetrahedra; 6] = [
        (
            "tet/codimipc_skirt_0.005mm_inverted.vtk",
            legacy_vtk,
            [32484, 29, 25, 0, 0],
        ),
        (
            "tet/codimipc_sphere12K.vtk",
            legacy_vtk,
            [24948, 0, 0, 0, 0],
        ),
        ("tet/codimipc_sphere1K.vtk", legacy_vtk, [2474, 0, 0, 0, 0]),
        ("tet/sofa_raptor_8418.vtu", vtu, [5750, 0, 0, 9, 3]),
        ("tet/sofa_Ossicles.vtu", vtu, [3412, 0, 0, 18, 0]),
        ("tet/sofa_seaMonster.vtu", vtu, [2280, 0, 0, 4, 0]),
    ];
    for (file, read, expected) in files {
        let Some(text) = text(&format!("volume/{file}")) else {
            continue;
        };
        let grid = read(&text);
        let found = inspect(&grid);
        let counts = [
            surface(&grid.cells).triangles.len(),
            found.inverted_cells.len(),
            found.zero_volume_cells.len(),
            found.non_manifold_edges.len(),
            found.unused_vertices.len(),
        ];
        assert_eq!(counts, expected, "{file}");
        assert_repairable(grid);
    }
}

#[test]
fn surfaces_are_as_the_manifest_says() {
    // File, open edges, non-manifold edges, zero-area faces, parts, volume where closed.
    let files = [
        ("blub_fish.obj", [0, 0, 0, 1], 1.11),
        ("cinolib_bamboo_pen.obj", [0, 0, 0, 1], 7.75e3),
        ("cinolib_two_spheres.obj", [0, 0, 0, 2], 1.03),
        ("derived_pants_casualsuit04.obj", [62, 0, 0, 1], 0.0),
        ("koala_low_resolution.obj", [0, 0, 0, 1], 56.1),
        ("makehuman_male_casualsuit04.obj", [158, 0, 0, 2], 0.0),
        ("makehuman_male_generic.obj", [0, 0, 0, 1], 65.5),
        ("makehuman_tightshelper.obj", [50, 0, 0, 1], 0.0),
        ("penguin.obj", [0, 0, 0, 1], 2.01),
        ("spot_low_resolution.obj", [0, 0, 0, 1], 0.68),
        ("trimesh_not_convex_nonmanifold.obj", [0, 12, 0, 1], 0.0),
        ("trimesh_wallhole_degenerate.obj", [0, 1, 11, 1], 0.0),
        ("wingnut.obj", [0, 0, 0, 1], 22.1),
    ];
    for (file, expected, volume) in files {
        let Some(text) = text(&format!("surface/{file}")) else {
            continue;
        };
        let grid = merged(obj(&text));
        let found = inspect(&grid);
        let counts = [
            found.open_edges.len(),
            found.non_manifold_edges.len(),
            found.zero_area_cells.len(),
            found.components,
        ];
        assert_eq!(counts, expected, "{file}");
        // The manifest gives three digits.
        assert!(
            (found.volume - volume).abs() <= 0.005 * volume,
            "{file}: {}",
            found.volume
        );
        assert_eq!(found.miswound_edges, [[0; 2]; 0], "{file}");
        if volume > 0.0 {
            assert_fillable(&grid, volume, file);
        }
        assert_repairable(grid);
    }
}
