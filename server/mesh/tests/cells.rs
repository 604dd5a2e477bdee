//! Each kind of cell: its volume, its faces, and which way these look.

use std::sync::Arc;

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_mesh::{
    Cell, CellType, Cells, Complex, Dimension, Grid, GridError, area, inspect, quality,
    scaled_jacobian, shapes, surface,
};
use sinew_mesh::{Surface, vertex_normals, volume};

/// A prism of height 1 over a regular polygon of radius 1, wound as given.
fn prism(kind: CellType, corners: i32, sense: f64) -> Grid {
    let ring = |z: f64| {
        (0..corners).map(move |corner| {
            let angle = sense * std::f64::consts::TAU * f64::from(corner) / f64::from(corners);
            Vector3::new(angle.cos(), angle.sin(), z)
        })
    };
    one(kind, ring(0.0).chain(ring(1.0)).collect(), &[])
}

/// A grid of one cell that uses all positions in order.
fn one(kind: CellType, positions: Vec<Vector3<f64>>, face_stream: &[u32]) -> Grid {
    let vertices: Vec<u32> = (0u32..).zip(&positions).map(|(vertex, _)| vertex).collect();
    let mut cells = Cells::default();
    cells.push(Cell {
        kind,
        vertices: &vertices,
        face_stream,
    });
    Grid { positions, cells }
}

fn points(positions: &[[f64; 3]]) -> Vec<Vector3<f64>> {
    positions.iter().map(|&at| at.into()).collect()
}

const CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

const CUBE_STREAM: [u32; 31] = [
    6, 4, 0, 4, 7, 3, 4, 1, 2, 6, 5, 4, 0, 1, 5, 4, 4, 3, 7, 6, 2, 4, 0, 3, 2, 1, 4, 4, 5, 6, 7,
];

/// One of each kind that encloses a volume, with the volume and the number of faces.
fn volumes() -> Vec<(Grid, f64, usize)> {
    let tetrahedron = [CUBE[0], CUBE[1], CUBE[3], CUBE[4]];
    let pyramid = [CUBE[0], CUBE[1], CUBE[2], CUBE[3], [0.5, 0.5, 1.0]];
    let polygon = |corners: f64| corners / 2.0 * (std::f64::consts::TAU / corners).sin();
    vec![
        (
            one(CellType::Tetrahedron, points(&tetrahedron), &[]),
            1.0 / 6.0,
            4,
        ),
        (one(CellType::Hexahedron, points(&CUBE), &[]), 1.0, 6),
        (one(CellType::Pyramid, points(&pyramid), &[]), 1.0 / 3.0, 5),
        (prism(CellType::Wedge, 3, -1.0), polygon(3.0), 5),
        (prism(CellType::PentagonalPrism, 5, 1.0), polygon(5.0), 7),
        (prism(CellType::HexagonalPrism, 6, 1.0), polygon(6.0), 8),
        (
            one(CellType::Polyhedron, points(&CUBE), &CUBE_STREAM),
            1.0,
            6,
        ),
    ]
}

#[test]
fn every_kind_has_its_volume_wherever_it_stands() {
    for (mut grid, expected, _) in volumes() {
        assert_eq!(grid.check(), Ok(()));
        assert!((volume(&grid, 0) - expected).abs() < 1e-15);
        for position in &mut grid.positions {
            position.add_scalar_mut(1e6);
        }
        assert!((volume(&grid, 0) - expected).abs() < 1e-9);
    }
}

#[test]
fn every_kind_has_as_many_vertices_and_faces_as_edges_and_two_more() {
    for (grid, _, faces) in volumes() {
        let complex = Complex::new(Arc::new(grid.cells.clone()), grid.positions.len());
        let edges = complex.count(Dimension::Edge);
        assert_eq!(complex.count(Dimension::Face), faces);
        assert_eq!(
            grid.positions.len() + faces,
            edges + 2,
            "{:?}",
            grid.cells.cell(0).kind
        );
        for dimension in [Dimension::Edge, Dimension::Face] {
            let bounds = complex.bounds(Dimension::Volume, dimension);
            assert_eq!(bounds.row(0).len(), complex.count(dimension));
        }
        let sides: usize = grid.cells.cell(0).faces().map(|face| face.len()).sum();
        assert_eq!(
            complex.bounds(Dimension::Face, Dimension::Edge).items.len(),
            sides
        );
    }
}

#[test]
fn every_kind_holds_what_is_inside() {
    for (grid, _, _) in volumes() {
        let complex = Complex::new(Arc::new(grid.cells.clone()), grid.positions.len());
        let count = grid.positions.len() as f64;
        let centre = grid.positions.iter().sum::<Vector3<f64>>() / count;
        for (corner, &at) in (0..).zip(&grid.positions) {
            let places = [0.0, 0.99, 1.0, 1.01].map(|t| centre + (at - centre) * t);
            let held = complex.holding(Dimension::Vertex, &grid.positions, &places);
            let lengths: Vec<usize> = held.rows().map(<[u32]>::len).collect();
            let all = grid.positions.len();
            assert_eq!(
                lengths,
                [all, all, all, 0],
                "{:?}, {corner}",
                grid.cells.cell(0).kind
            );
        }
    }
}

#[test]
fn every_kind_is_sound_and_its_mirror_image_is_not() {
    for (mut grid, _, _) in volumes() {
        assert_eq!(inspect(&grid).inverted_cells, []);
        assert!(!inspect(&grid).inside_out);
        for position in &mut grid.positions {
            position.x = -position.x;
        }
        assert!(volume(&grid, 0) < 0.0);
        assert!(inspect(&grid).inside_out);
        assert_eq!(inspect(&grid).inverted_cells, []);
    }
}

#[test]
fn every_face_looks_outward_and_every_edge_is_walked_once_each_way() {
    for (grid, _, expected) in volumes() {
        let cell = grid.cells.cell(0);
        let centre: Vector3<f64> =
            grid.positions.iter().sum::<Vector3<f64>>() / grid.positions.len() as f64;
        let mut edges = Vec::new();
        for face in cell.faces() {
            let [a, b, c] = [0, 1, 2].map(|corner| grid.positions[face.vertex(corner) as usize]);
            let normal = (b - a).cross(&(c - a));
            assert!(normal.dot(&(a - centre)) > 0.1, "{:?}", cell.kind);
            edges.extend(face.edges());
        }
        assert_eq!(cell.faces().count(), expected);
        edges.sort_unstable();
        for edge in &edges {
            let count = |edge: [u32; 2]| edges.iter().filter(|&&other| other == edge).count();
            assert_eq!([count(*edge), count([edge[1], edge[0]])], [1, 1]);
        }
    }
}

#[test]
fn moving_an_inner_vertex_only_moves_volume_between_cells() {
    let mut grid = shapes::hexahedra(2, 2, 2);
    grid.positions[13] += Vector3::new(0.1, -0.07, 0.05);
    let sum: f64 = (0..8).map(|cell| volume(&grid, cell)).sum();
    assert!((sum - 1.0).abs() < 1e-15);
}

#[test]
fn quality_is_that_of_the_shape_at_any_size_and_negative_inside_out() {
    let corners = [
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, -1.0],
        [1.0, -1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    for scale in [1e-50, 1.0, 1e50] {
        let scaled = |corners: &[[f64; 3]]| points(corners).iter().map(|p| p * scale).collect();
        let cube = one(CellType::Hexahedron, scaled(&CUBE), &[]);
        assert!((quality(&cube, 0) - std::f64::consts::PI / 6.0).abs() < 1e-15);
        let mut tetrahedron = one(CellType::Tetrahedron, scaled(&corners), &[]);
        let regular = std::f64::consts::PI / 108f64.sqrt();
        assert!((quality(&tetrahedron, 0) - regular).abs() < 1e-15);
        tetrahedron.positions.swap(0, 1);
        assert!((quality(&tetrahedron, 0) + regular).abs() < 1e-15);
        tetrahedron.positions[0] = tetrahedron.positions[1];
        assert_eq!(quality(&tetrahedron, 0), 0.0);
    }
}

#[test]
fn a_surface_cell_has_an_area_and_no_volume() {
    let square = points(&[CUBE[0], CUBE[1], CUBE[2], CUBE[3]]);
    for kind in [CellType::Quad, CellType::Polygon] {
        let grid = one(kind, square.clone(), &[]);
        assert_eq!((volume(&grid, 0), area(&grid, 0)), (0.0, 1.0));
    }
    let grid = one(CellType::Triangle, square[..3].to_vec(), &[]);
    assert_eq!((volume(&grid, 0), area(&grid, 0)), (0.0, 0.5));
}

#[test]
fn the_hash_follows_its_description_and_sees_every_column() {
    let mut cells = Cells::default();
    for (kind, vertices) in [
        (CellType::Tetrahedron, &[0, 1, 2, 3][..]),
        (CellType::Triangle, &[0, 2, 1]),
        (CellType::Empty, &[]),
    ] {
        cells.push(Cell {
            kind,
            vertices,
            face_stream: &[],
        });
    }
    assert_eq!(cells.hash(), HASH);
    let polyhedron = one(CellType::Polyhedron, points(&CUBE), &CUBE_STREAM).cells;
    assert_eq!(polyhedron.hash(), POLYHEDRON_HASH);
    let mut hashes = vec![polyhedron.hash()];
    for change in 0..4 {
        let mut changed = polyhedron.clone();
        match change {
            0 => changed.types[0] = 7,
            1 => changed.connectivity.swap(0, 1),
            2 => changed.faces.swap(2, 3),
            _ => {
                changed = Cells::default();
                for kind in [CellType::Empty, CellType::Polyhedron] {
                    let cell = polyhedron.cell(0);
                    changed.push(Cell {
                        kind,
                        vertices: if kind == cell.kind {
                            cell.vertices
                        } else {
                            &[]
                        },
                        face_stream: if kind == cell.kind {
                            cell.face_stream
                        } else {
                            &[]
                        },
                    });
                }
            }
        }
        hashes.push(changed.hash());
    }
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), 5);
}

/// By the reference implementation, over the bytes that the documentation of `Cells::hash` describes.
const HASH: u64 = 0xf113_bcda_89b6_2aac;
const POLYHEDRON_HASH: u64 = 0x9aae_00a7_e25a_f401;

#[test]
fn the_surface_of_a_box_is_a_sphere_wound_outward() {
    for grid in [shapes::hexahedra(3, 2, 4), shapes::tetrahedra(3, 2, 4)] {
        assert_eq!(grid.check(), Ok(()));
        let Surface {
            vertices,
            triangles,
        } = surface(&grid.cells);
        // 2 (3·2 + 2·4 + 3·4) squares.
        assert_eq!((vertices.len(), triangles.len()), (54, 104));
        assert!(vertices.is_sorted());
        let enclosed = triangles.iter().map(|triangle| {
            let [a, b, c] =
                triangle.map(|corner| grid.positions[vertices[corner as usize] as usize]);
            a.cross(&b).dot(&c) / 6.0
        });
        let expected = 3.0 * 2.0 * 4.0 / 27.0;
        assert!((enclosed.sum::<f64>() - expected).abs() < 1e-12);
    }
}

#[test]
fn surface_cells_count_unless_they_are_a_face_of_a_volume() {
    let mut grid = shapes::tetrahedra(1, 1, 1);
    let alone = surface(&grid.cells);
    let inner = [0, 3, 7];
    let boundary = [0, 1, 3];
    for vertices in [&inner, &boundary] {
        grid.cells.push(Cell {
            kind: CellType::Triangle,
            vertices,
            face_stream: &[],
        });
    }
    assert_eq!(surface(&grid.cells), alone);
    let free = [1, 2, 4];
    grid.cells.push(Cell {
        kind: CellType::Triangle,
        vertices: &free,
        face_stream: &[],
    });
    let with_free = surface(&grid.cells);
    assert_eq!(with_free.triangles.len(), alone.triangles.len() + 1);
    assert_eq!(with_free.triangles.last(), Some(&free));
}

#[test]
fn normals_are_unit_and_weighted_by_area_and_zero_where_there_is_none() {
    let positions = points(&[CUBE[0], CUBE[1], CUBE[3], CUBE[4], CUBE[0]]);
    let surface = Surface {
        vertices: vec![0, 1, 2, 3, 4],
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 0, 4]],
    };
    let mut normals = vec![[9.0; 3]; 7];
    vertex_normals(&positions, &surface, &mut normals);
    let half = 0.5f32.sqrt();
    assert_eq!(
        normals,
        [
            [half, 0.0, half],
            [0.0, 0.0, 1.0],
            [half, 0.0, half],
            [1.0, 0.0, 0.0],
            [0.0; 3]
        ]
    );
}

#[test]
fn errors_name_the_column_the_entry_and_the_value() {
    let cube = one(CellType::Polyhedron, points(&CUBE), &CUBE_STREAM);
    let refused = |damage: &dyn Fn(&mut Grid)| {
        let mut grid = cube.clone();
        damage(&mut grid);
        grid.check().unwrap_err().to_string()
    };
    let message = refused(&|grid| grid.cells.connectivity[5] = 99);
    assert_eq!(
        message,
        "column `connectivity`, entry 5, value 99: there are only 8 vertices, numbered from 0"
    );
    for (damage, expected) in [
        (
            &(|grid: &mut Grid| grid.cells.types[0] = 11) as &dyn Fn(&mut Grid),
            "`types`, entry 0, value 11",
        ),
        (
            &|grid| grid.cells.offsets[0] = 1,
            "`offsets`, entry 0, value 1",
        ),
        (
            &|grid| grid.cells.offsets[1] = 7,
            "`offsets`, entry 1, value 7",
        ),
        (
            &|grid| grid.cells.offsets.push(3),
            "`offsets` has 3 entries",
        ),
        (&|grid| grid.cells.types[0] = 12, "`face_offsets`, entry 0"),
        (
            &|grid| grid.cells.face_offsets.clear(),
            "`faces` has 31 entries",
        ),
        (&|grid| grid.cells.faces[0] = 3, "`faces`, entry 0, value 3"),
        (&|grid| grid.cells.faces[0] = 5, "`faces`, entry 26"),
        (&|grid| grid.cells.faces[0] = u32::MAX, "`faces`, entry 31"),
        (&|grid| grid.cells.faces[1] = 2, "`faces`, entry 1, value 2"),
        (&|grid| grid.cells.faces[1] = u32::MAX, "`faces`, entry 1"),
        (&|grid| grid.cells.faces[2] = 8, "`faces`, entry 2, value 8"),
        (
            &|grid| grid.cells.connectivity[7] = 0,
            "`connectivity`, entry 7, value 0",
        ),
        (
            &|grid| grid.positions[2].y = f64::NAN,
            "`positions`, entry 2, value NaN at axis 1",
        ),
    ] {
        let message = refused(damage);
        assert!(message.contains(expected), "{message}");
    }
    let mut lonely = one(CellType::Hexahedron, points(&CUBE), &[]);
    lonely.cells.types[0] = CellType::Wedge.number();
    let wrong = GridError::VertexCount {
        cell: 0,
        kind: CellType::Wedge,
        found: 8,
        expected: "6",
    };
    assert_eq!(lonely.check(), Err(wrong));
}

/// A number that is likely to be nearly right.
fn entry() -> impl Strategy<Value = u32> {
    prop_oneof![0..12u32, any::<u32>()]
}

proptest! {
    #[test]
    fn any_columns_are_checked_without_panic_and_what_passes_can_be_used(
        types in prop::collection::vec(prop::sample::select(vec![5, 7, 9, 10, 14, 42, 3]), 0..4),
        connectivity in prop::collection::vec(entry(), 0..20),
        offsets in prop::collection::vec(entry(), 0..6),
        faces in prop::collection::vec(entry(), 0..30),
        face_offsets in prop::collection::vec(entry(), 0..6),
        vertices in 0..10usize,
    ) {
        let cells = Cells { types, connectivity, offsets, faces, face_offsets };
        let grid = Grid { positions: vec![Vector3::zeros(); vertices], cells };
        if grid.check().is_ok() {
            inspect(&grid);
            surface(&grid.cells);
        }
    }

    #[test]
    fn one_wrong_entry_never_panics(at in 0..41usize, value in entry()) {
        let mut grid = one(CellType::Polyhedron, points(&CUBE), &CUBE_STREAM);
        let Cells { connectivity, offsets, faces, .. } = &mut grid.cells;
        let mut entries = connectivity.iter_mut().chain(offsets).chain(faces);
        *entries.nth(at).unwrap() = value;
        if grid.check().is_ok() {
            inspect(&grid);
            surface(&grid.cells);
            sinew_mesh::repair(grid);
        }
    }
}

#[test]
fn the_scaled_jacobian_is_1_for_a_cube_and_turns_with_the_cell() {
    let jacobian = |grid: &Grid| {
        let at = |vertex: u32| grid.positions[vertex as usize];
        scaled_jacobian(&grid.cells.cell(0), at)
    };
    let corner = points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let cells = [
        (one(CellType::Hexahedron, points(&CUBE), &[]), 1.0),
        // All cones to the faces of a cube are of one size.
        (one(CellType::Polyhedron, points(&CUBE), &CUBE_STREAM), 1.0),
        // 1 at the right corner, 1 over two edges of length √2 at the others.
        (one(CellType::Tetrahedron, corner, &[]), 0.5),
        // Between edges at 60 degrees.
        (prism(CellType::Wedge, 3, -1.0), 0.75_f64.sqrt()),
    ];
    for (mut grid, expected) in cells {
        assert!((jacobian(&grid) - expected).abs() < 1e-12, "{expected}");
        let upright = grid.positions.clone();
        grid.positions
            .iter_mut()
            .for_each(|position| position.x *= -1.0);
        assert!(jacobian(&grid) < -0.49, "{expected}");
        grid.positions = upright;
        grid.positions
            .iter_mut()
            .for_each(|position| position.x = 0.0);
        assert!(jacobian(&grid).abs() < 1e-12, "{expected}");
    }
}
