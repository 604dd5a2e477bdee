//! The cells of every dimension against the independent reference and the geometry.

use std::sync::Arc;

use nalgebra::Vector3;
use sinew_mesh::{Cell, CellType, Cells, Complex, Dimension, Grid, MOST_NEIGHBOURS, shapes};

const DIMENSIONS: [Dimension; 4] = [
    Dimension::Vertex,
    Dimension::Edge,
    Dimension::Face,
    Dimension::Volume,
];

fn complex(grid: &Grid) -> Complex {
    Complex::new(Arc::new(grid.cells.clone()), grid.positions.len())
}

fn number(value: &serde_json::Value) -> usize {
    serde_json::from_value(value.clone()).expect("a number of cells")
}

#[test]
fn the_graphs_of_a_cube_of_tetrahedra_agree_with_the_golden() {
    let complex = complex(&shapes::tetrahedra(2, 2, 2));
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("data/C01_cell_graphs.json")).unwrap();
    let cases = golden["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 12);
    for case in cases {
        let dimension = |name: &str| DIMENSIONS[number(&case["in"][name])];
        let table = complex
            .neighbours(dimension("node_dim"), dimension("arc_dim"))
            .unwrap();
        let greatest = table.rows().map(<[u32]>::len).max().unwrap();
        let found = [table.starts.len() - 1, table.items.len() / 2, greatest];
        let expected = ["nodes", "arcs", "max_degree"];
        assert_eq!(found, expected.map(|name| number(&case["out"][name])));
    }
}

/// Cells by their vertices, and neighbours by trying every pair.
#[test]
fn neighbours_are_the_cells_with_a_cell_of_the_other_dimension_in_common() {
    for grid in [shapes::tetrahedra(2, 2, 1), shapes::hexahedra(2, 2, 2)] {
        let complex = complex(&grid);
        let sets = |dimension: Dimension| -> Vec<Vec<u32>> {
            if dimension == Dimension::Vertex {
                return (0..)
                    .take(grid.positions.len())
                    .map(|vertex| vec![vertex])
                    .collect();
            }
            let table = complex.bounds(dimension, Dimension::Vertex);
            table.rows().map(<[u32]>::to_vec).collect()
        };
        let within = |a: &[u32], b: &[u32]| a.iter().all(|vertex| b.contains(vertex));
        for nodes in DIMENSIONS {
            for arcs in DIMENSIONS.into_iter().filter(|&arcs| arcs != nodes) {
                let (cells, joints) = (sets(nodes), sets(arcs));
                let joined = |a: &[u32], b: &[u32]| {
                    joints.iter().any(|joint| {
                        let one = |cell| within(joint, cell) || within(cell, joint);
                        one(a) && one(b)
                    })
                };
                let table = complex.neighbours(nodes, arcs).unwrap();
                for (cell, row) in cells.iter().zip(table.rows()) {
                    let others = (0..).zip(&cells).filter(|(_, other)| *other != cell);
                    let expected: Vec<u32> = others
                        .filter(|(_, other)| joined(cell, other))
                        .map(|(other, _)| other)
                        .collect();
                    assert_eq!(row, expected, "{nodes:?} by {arcs:?}");
                }
            }
        }
    }
}

#[test]
fn a_surface_has_edges_and_faces_and_no_volumes() {
    let mut cells = Cells::default();
    for vertices in [[0, 1, 2], [1, 0, 3]] {
        cells.push(Cell {
            kind: CellType::Triangle,
            vertices: &vertices,
            face_stream: &[],
        });
    }
    let complex = Complex::new(Arc::new(cells), 5);
    assert_eq!(
        DIMENSIONS.map(|dimension| complex.count(dimension)),
        [5, 5, 2, 0]
    );
    let faces = complex
        .neighbours(Dimension::Face, Dimension::Edge)
        .unwrap();
    assert_eq!(faces.items, [1, 0]);
    let vertices = complex
        .neighbours(Dimension::Vertex, Dimension::Edge)
        .unwrap();
    assert_eq!(vertices.row(4), [0_u32; 0]); // of no cell
    let by_volume = complex.neighbours(Dimension::Vertex, Dimension::Volume);
    assert!(by_volume.unwrap().items.is_empty());
    assert_eq!(complex.sizes(Dimension::Face, &[Vector3::zeros(); 5]), None);
}

#[test]
fn so_many_neighbours_that_no_memory_holds_them_are_refused() {
    let mut cells = Cells::default();
    let around = u32::try_from(MOST_NEIGHBOURS.isqrt()).unwrap() + 2;
    for rim in 1..=around {
        cells.push(Cell {
            kind: CellType::Triangle,
            vertices: &[0, rim, rim + 1],
            face_stream: &[],
        });
    }
    let complex = Complex::new(Arc::new(cells), around as usize + 2);
    let error = complex
        .neighbours(Dimension::Face, Dimension::Vertex)
        .unwrap_err();
    assert!(error.neighbours > MOST_NEIGHBOURS);
    assert!(complex.neighbours(Dimension::Face, Dimension::Edge).is_ok());
}

#[test]
fn places_are_held_by_the_volumes_around_them() {
    let grid = shapes::tetrahedra(3, 2, 2); // the box [0, 1] x [0, 2/3] x [0, 2/3]
    let complex = complex(&grid);
    let third = 1.0 / 3.0;
    let places = [
        Vector3::new(0.1, 0.05, 0.02),     // inside one
        Vector3::new(0.1, 0.1, 0.1),       // on a diagonal
        Vector3::new(third, third, third), // on a vertex
        Vector3::new(-1e-12, 0.05, 0.02),  // hardly outside
        Vector3::new(-1e-3, 0.05, 0.02),   // outside
        Vector3::new(f64::NAN, 0.0, 0.0),
    ];
    let volumes = complex.holding(Dimension::Volume, &grid.positions, &places);
    let counts: Vec<usize> = volumes.rows().map(<[u32]>::len).collect();
    assert_eq!(counts, [1, 6, 24, 1, 0, 0]);
    let vertices = complex.holding(Dimension::Vertex, &grid.positions, &places);
    assert_eq!(
        vertices.row(0),
        complex
            .bounds(Dimension::Volume, Dimension::Vertex)
            .row(volumes.row(0)[0] as usize)
    );
    assert_eq!(vertices.row(1).len(), 8);
    let edges = complex.holding(Dimension::Edge, &grid.positions, &places);
    assert_eq!(edges.row(0).len(), 6);
}

#[test]
fn sizes_and_normals_are_those_of_the_cells() {
    let grid = shapes::hexahedra(3, 3, 3);
    let complex = complex(&grid);
    for dimension in DIMENSIONS {
        let sizes = complex.sizes(dimension, &grid.positions).unwrap();
        assert_eq!(sizes.len(), complex.count(dimension));
        assert!(sizes.iter().all(|size| (size - 1.0).abs() < 1e-12));
        let normals = complex.normals(dimension, &grid.positions);
        for (normal, centre) in normals
            .iter()
            .zip(complex.centres(dimension, &grid.positions))
        {
            let inside = centre.iter().all(|&c| 0.33 < c && c < 0.67);
            assert_eq!(
                *normal == Vector3::zeros(),
                inside,
                "{dimension:?} at {centre:?}"
            );
        }
    }
    let middle = complex.normals(Dimension::Volume, &grid.positions)[4]; // of the lower side
    assert!((middle - Vector3::new(0.0, 0.0, -1.0)).norm() < 1e-6);
}
