//! Maps of known complexes.

use sinew_mesh::shapes;

use sinew_mesh::{Cell, CellType, Cells, Grid};
use sinew_topology::{BuildError, BuildReport, Dimension, InputError, Map, NonManifold, Vertex};

use crate::shapes::{census, map_of, mesh, torus, two_tetrahedra, view};

#[test]
fn two_tetrahedra_on_a_face_share_three_vertices() {
    assert_eq!(census(&map_of(&two_tetrahedra())), [5, 9, 7, 2].into());
}

#[test]
fn a_grid_of_cubes_has_the_cells_that_counting_gives() {
    for [x, y, z] in [[1, 1, 1], [2, 1, 1], [3, 4, 5]] {
        let map = map_of(&shapes::hexahedra(x, y, z));
        let [a, b, c] = [x + 1, y + 1, z + 1];
        let edges = x * b * c + a * y * c + a * b * z;
        let faces = a * y * z + x * b * z + x * y * c;
        assert_eq!(census(&map), [a * b * c, edges, faces, x * y * z].into());
    }
}

#[test]
fn a_ring_of_hexahedra_has_euler_characteristic_0_and_a_ball_1() {
    let torus = map_of(&torus(7));
    assert_eq!(census(&torus), [28, 28 + 28, 28 + 7, 7].into());
    let found = torus.components();
    assert_eq!(found.len(), 1);
    assert_eq!(
        (found[0].euler_characteristic(&torus), found[0].boundary),
        (0, 28)
    );
    let ball = map_of(&shapes::tetrahedra(3, 3, 3));
    let found = ball.components();
    assert_eq!(
        (found[0].euler_characteristic(&ball), found[0].boundary),
        (1, 108)
    );
}

#[test]
fn a_surface_is_a_map_without_3_links() {
    let squares = mesh(
        9,
        CellType::Quad,
        &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[3, 4, 7, 6], &[4, 5, 8, 7]],
    );
    let map = map_of(&squares);
    assert_eq!(map.dimension(), Dimension::Two);
    assert_eq!(census(&map), [9, 12, 4, 1].into());
    let found = map.components();
    assert_eq!(
        (found[0].euler_characteristic(&map), found[0].boundary),
        (1, 8)
    );
    let tetrahedron = mesh(
        4,
        CellType::Triangle,
        &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]],
    );
    let map = map_of(&tetrahedron);
    assert_eq!(map.components()[0].euler_characteristic(&map), 2);
}

#[test]
fn a_cell_inside_out_is_turned_and_reported() {
    let mut grid = shapes::hexahedra(3, 3, 3);
    let inverted: Vec<_> = [5usize, 13].map(|cell| cell * 8).into_iter().collect();
    for at in inverted {
        grid.cells.connectivity[at..at + 8].rotate_left(4);
    }
    let (map, report) = Map::build(&view(&grid), NonManifold::Refuse).unwrap();
    assert_eq!(
        report,
        BuildReport {
            turned: vec![5, 13],
            ..BuildReport::default()
        }
    );
    assert_eq!(map.violations(), []);
    assert_eq!(census(&map), census(&map_of(&shapes::hexahedra(3, 3, 3))));
}

#[test]
fn polyhedra_whose_faces_wind_at_random_become_the_same_map() {
    let rings: &[&[u32]] = &[
        &[0, 4, 7, 3],
        &[1, 5, 6, 2],
        &[0, 1, 5, 4],
        &[3, 2, 6, 7],
        &[0, 3, 2, 1],
        &[4, 5, 6, 7],
    ];
    let mut stream = vec![6];
    for ring in rings {
        stream.push(4);
        stream.extend_from_slice(ring);
    }
    let mut cells = Cells::default();
    let vertices: Vec<u32> = (0..8).collect();
    cells.push(Cell {
        kind: CellType::Polyhedron,
        vertices: &vertices,
        face_stream: &stream,
    });
    let grid = Grid {
        positions: vec![nalgebra::Vector3::zeros(); 8],
        cells,
    };
    let (map, report) = Map::build(&view(&grid), NonManifold::Refuse).unwrap();
    assert_eq!(map.violations(), []);
    assert_eq!(census(&map), [8, 12, 6, 1].into());
    assert_eq!(report.rewound, [0]);
}

fn refusal(grid: &Grid) -> BuildError {
    Map::build(&view(grid), NonManifold::Refuse).expect_err("no manifold")
}

#[test]
fn tetrahedra_that_touch_at_a_vertex_or_an_edge_are_refused_or_split_there() {
    let touching_vertex = mesh(7, CellType::Tetrahedron, &[&[0, 1, 2, 3], &[3, 4, 5, 6]]);
    let error = refusal(&touching_vertex);
    assert_eq!(
        error,
        BuildError::NonManifold {
            faces: vec![],
            edges: vec![],
            vertices: vec![3]
        }
    );
    let (map, report) = Map::build(&view(&touching_vertex), NonManifold::Split).unwrap();
    assert_eq!(census(&map), [8, 12, 8, 2].into());
    let split: Vec<_> = report
        .split_vertices
        .iter()
        .map(|&(new, old)| (new.index(), old))
        .collect();
    assert_eq!((split, map.components().len()), (vec![(7, 3)], 2));

    let touching_edge = mesh(6, CellType::Tetrahedron, &[&[0, 1, 2, 3], &[2, 3, 4, 5]]);
    let error = refusal(&touching_edge);
    assert_eq!(
        error,
        BuildError::NonManifold {
            faces: vec![],
            edges: vec![[2, 3]],
            vertices: vec![2, 3]
        }
    );
    let (map, report) = Map::build(&view(&touching_edge), NonManifold::Split).unwrap();
    assert_eq!(map.violations(), []);
    assert_eq!(
        (census(&map), report.split_edges),
        ([8, 12, 8, 2].into(), vec![[2, 3]])
    );
}

#[test]
fn a_face_of_three_cells_is_refused_or_left_open_by_all() {
    let grid = mesh(
        6,
        CellType::Tetrahedron,
        &[&[0, 1, 2, 3], &[1, 2, 3, 4], &[1, 2, 3, 5]],
    );
    let BuildError::NonManifold { faces, .. } = refusal(&grid) else {
        panic!("refused for another reason");
    };
    assert_eq!(faces, [[0, 1, 2]]);
    let (map, report) = Map::build(&view(&grid), NonManifold::Split).unwrap();
    assert_eq!(map.violations(), []);
    assert_eq!(
        (census(&map), report.split_faces.len()),
        ([12, 18, 12, 3].into(), 1)
    );
}

#[test]
fn what_is_no_cell_is_refused_with_its_number() {
    let repeated = mesh(4, CellType::Tetrahedron, &[&[0, 1, 2, 3], &[0, 1, 2, 2]]);
    assert_eq!(
        refusal(&repeated),
        BuildError::RepeatedVertex { cell: 1, vertex: 2 }
    );
    let twice = mesh(4, CellType::Tetrahedron, &[&[0, 1, 2, 3], &[1, 2, 0, 3]]);
    assert_eq!(
        refusal(&twice),
        BuildError::DuplicateCells { cells: [0, 1] }
    );
    let beyond = mesh(3, CellType::Tetrahedron, &[&[0, 1, 2, 3]]);
    assert!(matches!(
        refusal(&beyond),
        BuildError::Input(InputError::Vertex {
            entry: 3,
            value: 3,
            ..
        })
    ));
    let mixed = mesh(4, CellType::Tetrahedron, &[&[0, 1, 2, 3]]);
    let mut mixed = mixed;
    mixed.cells.push(Cell {
        kind: CellType::Triangle,
        vertices: &[0, 1, 2],
        face_stream: &[],
    });
    assert!(matches!(
        refusal(&mixed),
        BuildError::Input(InputError::Mixed { cell: 1, value: 5 })
    ));
    let moebius = mesh(
        6,
        CellType::Quad,
        &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 3, 0, 5]],
    );
    assert!(matches!(
        refusal(&moebius),
        BuildError::NotOrientable { .. }
    ));
}

#[test]
fn vertices_of_no_cell_are_reported_and_keep_the_others_numbers() {
    let grid = mesh(6, CellType::Tetrahedron, &[&[0, 2, 3, 5]]);
    let (map, report) = Map::build(&view(&grid), NonManifold::Refuse).unwrap();
    assert_eq!(report.isolated, [1, 4]);
    let vertices: Vec<_> = map.cells::<Vertex>().map(|vertex| vertex.index()).collect();
    assert_eq!((vertices, map.violations()), (vec![0, 2, 3, 5], vec![]));
}

#[test]
fn a_map_gives_back_the_mesh_that_it_was_built_of() {
    for grid in [
        shapes::tetrahedra(3, 2, 4),
        shapes::hexahedra(2, 3, 4),
        two_tetrahedra(),
    ] {
        let out = map_of(&grid).export();
        assert_eq!(out.connectivity, grid.cells.connectivity);
        assert_eq!(
            (out.types, out.offsets),
            (grid.cells.types, grid.cells.offsets)
        );
    }
}

#[test]
fn two_pairs_of_cells_on_one_face_are_found_even_where_a_ring_of_cells_joins_them() {
    // Cells 4 to 6 join cells 1 and 2, and cells 7 to 9 join 3 and 0, around each edge of the face.
    let crowd = mesh(
        7,
        CellType::Tetrahedron,
        &[
            &[0, 1, 2, 3],
            &[0, 1, 2, 4],
            &[0, 1, 2, 5],
            &[0, 1, 2, 6],
            &[0, 1, 4, 5],
            &[1, 2, 4, 5],
            &[0, 2, 4, 5],
            &[0, 1, 6, 3],
            &[1, 2, 6, 3],
            &[0, 2, 6, 3],
        ],
    );
    let BuildError::NonManifold { faces, .. } = refusal(&crowd) else {
        panic!("the crowd was not found");
    };
    assert_eq!(faces, [[0, 1, 2, 3]]);
    let (map, report) = Map::build(&view(&crowd), NonManifold::Split).unwrap();
    assert_eq!(map.violations(), []);
    assert_eq!(report.split_faces, [[0, 1, 2, 3]]);
}

#[test]
fn a_polyhedron_of_two_faces_meets_itself() {
    let mut cells = Cells::default();
    cells.push(Cell {
        kind: CellType::Polyhedron,
        vertices: &[0, 1, 2, 3],
        face_stream: &[2, 4, 0, 1, 2, 3, 4, 3, 2, 1, 0],
    });
    let grid = Grid {
        positions: vec![nalgebra::Vector3::zeros(); 4],
        cells,
    };
    let map = map_of(&grid);
    assert_eq!(map.violations(), []);
    assert_eq!(census(&map), [4, 4, 1, 1].into());
}
