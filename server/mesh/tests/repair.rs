//! Finding and mending what is wrong with a grid.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_mesh::{
    Capsule, Cell, CellShape, CellType, Cells, Fault, Grid, inspect, lattice, repair, shapes,
    surface, volume,
};

/// The grid again, with the cells as `change` leaves them: kind, vertices and face stream.
fn rebuilt(
    grid: &Grid,
    mut change: impl FnMut(usize, CellType, &mut Vec<u32>, &mut Vec<u32>),
) -> Grid {
    let mut cells = Cells::default();
    for (id, cell) in grid.cells.iter().enumerate() {
        let (mut vertices, mut stream) = (cell.vertices.to_vec(), cell.face_stream.to_vec());
        change(id, cell.kind, &mut vertices, &mut stream);
        cells.push(Cell {
            kind: cell.kind,
            vertices: &vertices,
            face_stream: &stream,
        });
    }
    Grid {
        positions: grid.positions.clone(),
        cells,
    }
}

/// The cubes as polyhedra.
fn polyhedra(grid: &Grid) -> Grid {
    let mut cells = Cells::default();
    for cell in grid.cells.iter() {
        let mut stream = vec![6];
        for face in cell.faces() {
            stream.push(4);
            stream.extend(face.vertices());
        }
        cells.push(Cell {
            kind: CellType::Polyhedron,
            vertices: cell.vertices,
            face_stream: &stream,
        });
    }
    Grid {
        positions: grid.positions.clone(),
        cells,
    }
}

/// Each cube as two wedges, or six pyramids, or a tetrahedron for each corner of a pyramid: kinds by turns.
fn zoo() -> Grid {
    let mut grid = shapes::hexahedra(2, 2, 2);
    let mut cells = Cells::default();
    for (id, cube) in grid.cells.clone().iter().enumerate() {
        let v = cube.vertices;
        let mut add = |kind, vertices: &[u32]| {
            cells.push(Cell {
                kind,
                vertices,
                face_stream: &[],
            })
        };
        match id % 3 {
            0 => add(CellType::Hexahedron, v),
            1 => {
                add(CellType::Wedge, &[v[0], v[2], v[1], v[4], v[6], v[5]]);
                add(CellType::Wedge, &[v[0], v[3], v[2], v[4], v[7], v[6]]);
            }
            _ => {
                let centre = u32::try_from(grid.positions.len()).unwrap();
                let sum: Vector3<f64> = v.iter().map(|&at| grid.positions[at as usize]).sum();
                grid.positions.push(sum / 8.0);
                for face in cube.faces() {
                    let base: Vec<u32> = face.vertices().collect();
                    add(
                        CellType::Pyramid,
                        &[base[3], base[2], base[1], base[0], centre],
                    );
                }
            }
        }
    }
    Grid {
        positions: grid.positions,
        cells,
    }
}

/// The surface of a ball and of a capsule beside it, as triangles.
fn closed_surfaces() -> Grid {
    let ball = |x: f64, radius: f64| Capsule {
        start: Vector3::new(x, 0.0, 0.0),
        end: Vector3::new(x, 0.0, radius),
        radius,
    };
    let solid = lattice(
        CellShape::Tetrahedron,
        0.3,
        &[ball(0.0, 0.5), ball(2.0, 0.8)],
    )
    .unwrap();
    let surface = surface(&solid.cells);
    let mut cells = Cells::default();
    for vertices in &surface.triangles {
        cells.push(Cell {
            kind: CellType::Triangle,
            vertices,
            face_stream: &[],
        });
    }
    let positions = surface
        .vertices
        .iter()
        .map(|&vertex| solid.positions[vertex as usize]);
    Grid {
        positions: positions.collect(),
        cells,
    }
}

fn mirror(kind: CellType, vertices: &mut [u32]) {
    match kind {
        CellType::Tetrahedron => vertices.swap(2, 3),
        CellType::Pyramid => vertices[..4].reverse(),
        CellType::Triangle => vertices.reverse(),
        CellType::Wedge | CellType::Hexahedron => {
            let (bottom, top) = vertices.split_at_mut(vertices.len() / 2);
            bottom.swap_with_slice(top);
        }
        CellType::Polygon
        | CellType::Quad
        | CellType::PentagonalPrism
        | CellType::HexagonalPrism
        | CellType::Empty
        | CellType::Polyhedron => panic!("not in these tests"),
    }
}

/// Panics if inspection finds anything that repair mends.
fn assert_sound(grid: &Grid) {
    assert_eq!(grid.check(), Ok(()));
    let found = inspect(grid);
    assert!(!found.inside_out);
    for (what, cells) in [
        ("inverted", found.inverted_cells),
        ("zero volume", found.zero_volume_cells),
        ("zero area", found.zero_area_cells),
        ("repeated vertex", found.repeated_vertex_cells),
        ("open", found.open_polyhedra),
        ("unused", found.unused_vertices),
    ] {
        assert_eq!(cells, [], "{what}");
    }
    assert_eq!(found.duplicate_cells, [[0; 2]; 0]);
    assert_eq!(found.miswound_edges, [[0; 2]; 0]);
}

fn total_volume(grid: &Grid) -> f64 {
    (0..grid.cells.len()).map(|cell| volume(grid, cell)).sum()
}

#[test]
fn a_sound_grid_is_left_as_it_is() {
    for grid in [
        shapes::hexahedra(2, 3, 1),
        shapes::tetrahedra(2, 3, 1),
        zoo(),
        closed_surfaces(),
        polyhedra(&shapes::hexahedra(2, 1, 1)),
    ] {
        assert_sound(&grid);
        let (repaired, repairs) = repair(grid.clone());
        assert_eq!(repaired, grid);
        assert_eq!((repairs.turned.len(), repairs.dropped.len()), (0, 0));
        assert!(
            repairs
                .cells
                .iter()
                .map(|&id| id as usize)
                .eq(0..grid.cells.len())
        );
        assert!(
            repairs
                .vertices
                .iter()
                .map(|&id| id as usize)
                .eq(0..grid.positions.len())
        );
    }
}

#[test]
fn each_fault_is_found_by_its_name() {
    let mut grid = shapes::tetrahedra(2, 2, 2);
    let lone = u32::try_from(grid.positions.len()).unwrap();
    grid.positions.push(grid.positions[3]);
    grid.cells.connectivity.swap(4 * 7, 4 * 7 + 1);
    let repeated = [0, 1, 1, 5];
    let again = [
        grid.cells.cell(20).vertices[2],
        grid.cells.cell(20).vertices[1],
        grid.cells.cell(20).vertices[0],
        grid.cells.cell(20).vertices[3],
    ];
    let flat = [0, 1, 3, 4];
    for vertices in [&repeated, &again, &flat] {
        grid.cells.push(Cell {
            kind: CellType::Tetrahedron,
            vertices,
            face_stream: &[],
        });
    }
    let found = inspect(&grid);
    assert_eq!(found.counts, [(CellType::Tetrahedron, 51)]);
    assert_eq!(found.inverted_cells, [7, 49]);
    assert_eq!(found.repeated_vertex_cells, [48]);
    assert_eq!(found.zero_volume_cells, [48, 50]);
    assert_eq!(found.duplicate_cells, [[49, 20]]);
    assert_eq!(found.unused_vertices, [lone]);
    assert_eq!(found.duplicate_vertices, [[lone, 3]]);
    assert_eq!(found.components, 1);
    assert_eq!(found.bounds, Some([Vector3::zeros(), Vector3::repeat(1.0)]));

    let (repaired, repairs) = repair(grid);
    assert_sound(&repaired);
    assert_eq!(repairs.turned, [7, 49]);
    assert_eq!(
        repairs.dropped,
        [
            (48, Fault::RepeatedVertex),
            (49, Fault::Duplicate),
            (50, Fault::ZeroVolume)
        ]
    );
    assert_eq!(repairs.vertices.len(), 27);
    assert!((total_volume(&repaired) - 1.0).abs() < 1e-12);
}

#[test]
fn a_folded_hexahedron_is_inverted_although_its_volume_is_positive() {
    let mut grid = shapes::hexahedra(2, 2, 2);
    grid.positions[0] = Vector3::new(0.3, 0.3, 0.3);
    assert!(volume(&grid, 0) > 0.0);
    assert_eq!(inspect(&grid).inverted_cells, [0]);
    let (_, repairs) = repair(grid);
    assert_eq!(repairs.dropped, [(0, Fault::Folded)]);
    assert_eq!(repairs.turned, []);
}

#[test]
fn faces_and_edges_of_too_many_are_found() {
    let mut grid = shapes::tetrahedra(1, 1, 1);
    grid.positions.push(Vector3::new(3.0, -1.0, 0.5));
    grid.cells.push(Cell {
        kind: CellType::Tetrahedron,
        vertices: &[0, 3, 7, 8],
        face_stream: &[],
    });
    assert_eq!(inspect(&grid).non_manifold_faces, [[0, 3, 7]]);

    // Two cubes that touch along an edge only.
    let four = shapes::hexahedra(2, 2, 1);
    let mut two = Grid {
        positions: four.positions.clone(),
        cells: Cells::default(),
    };
    for id in [0, 3] {
        two.cells.push(four.cells.cell(id));
    }
    let found = inspect(&two);
    assert_eq!(found.non_manifold_edges, [[4, 13]]);
    assert_eq!((found.components, found.non_manifold_faces.len()), (1, 0));
    assert_eq!(found.open_edges, [[0; 2]; 0]);
}

#[test]
fn a_surface_turned_inside_out_comes_back_and_a_cavity_stays_one() {
    let grid = closed_surfaces();
    let inside_out = rebuilt(&grid, |_, kind, vertices, _| mirror(kind, vertices));
    assert!(inspect(&inside_out).inside_out);
    let (repaired, _) = repair(inside_out);
    assert_sound(&repaired);
    assert!((inspect(&repaired).volume - inspect(&grid).volume).abs() < 1e-12);

    let mut hollow = grid.clone();
    let (outer, inner) = (grid.positions.len(), grid.cells.len());
    hollow
        .positions
        .extend(grid.positions.iter().map(|at| at * 0.5));
    for cell in grid.cells.iter() {
        let mut vertices: Vec<u32> = cell
            .vertices
            .iter()
            .map(|at| at + u32::try_from(outer).unwrap())
            .collect();
        vertices.reverse();
        hollow.cells.push(Cell {
            kind: cell.kind,
            vertices: &vertices,
            face_stream: &[],
        });
    }
    assert_eq!(hollow.cells.len(), 2 * inner);
    let (repaired, _) = repair(hollow.clone());
    assert_eq!(repaired, hollow);
}

#[test]
fn a_moebius_strip_keeps_one_miswound_rung() {
    let mut strip = Grid::default();
    for turn in 0..8 {
        let angle = std::f64::consts::TAU * f64::from(turn) / 8.0;
        for side in [-0.3, 0.3] {
            let radius = 1.0 + side * (angle / 2.0).cos();
            strip.positions.push(Vector3::new(
                radius * angle.cos(),
                radius * angle.sin(),
                side * (angle / 2.0).sin(),
            ));
        }
    }
    for turn in 0..7 {
        let at = 2 * turn;
        strip.cells.push(Cell {
            kind: CellType::Quad,
            vertices: &[at, at + 1, at + 3, at + 2],
            face_stream: &[],
        });
    }
    strip.cells.push(Cell {
        kind: CellType::Quad,
        vertices: &[14, 15, 0, 1],
        face_stream: &[],
    });
    let (repaired, _) = repair(strip);
    let found = inspect(&repaired);
    assert_eq!(
        (found.miswound_edges.len(), found.open_edges.len()),
        (1, 16)
    );
}

/// One way to spoil a cell or to add something superfluous.
#[derive(Clone, Debug)]
enum Damage {
    Mirror(usize),
    Repeat(usize, usize, usize),
    Copy(usize, usize),
    Flatten(usize),
    Unused,
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        any::<usize>().prop_map(Damage::Mirror),
        any::<[usize; 3]>().prop_map(|[cell, from, to]| Damage::Repeat(cell, from, to)),
        any::<[usize; 2]>().prop_map(|[cell, turn]| Damage::Copy(cell, turn)),
        any::<usize>().prop_map(Damage::Flatten),
        Just(Damage::Unused),
    ]
}

fn spoil(grid: &mut Grid, damage: &Damage) {
    let count = grid.cells.len();
    let mut of = |cell: usize, change: &mut dyn FnMut(CellType, &mut [u32])| {
        let cell = cell % count;
        let kind = grid.cells.cell(cell).kind;
        let ends = grid.cells.offsets[cell] as usize..grid.cells.offsets[cell + 1] as usize;
        change(kind, &mut grid.cells.connectivity[ends]);
    };
    match *damage {
        Damage::Mirror(cell) => of(cell, &mut |kind, vertices| mirror(kind, vertices)),
        Damage::Repeat(cell, from, to) => of(cell, &mut |_, vertices| {
            let length = vertices.len();
            vertices[to % length] = vertices[from % length];
        }),
        Damage::Copy(cell, turn) => {
            let copied = grid.clone();
            let copied = copied.cells.cell(cell % count);
            let mut vertices = copied.vertices.to_vec();
            if copied.kind == CellType::Tetrahedron {
                vertices.rotate_left(turn % 4);
            }
            grid.cells.push(Cell {
                vertices: &vertices,
                ..copied
            });
        }
        Damage::Flatten(cell) => {
            let copied = grid.clone();
            let vertices = copied.cells.cell(cell % count).vertices;
            for &vertex in vertices {
                grid.positions[vertex as usize].z = 0.37;
            }
        }
        Damage::Unused => grid.positions.push(Vector3::new(0.1, 0.2, 0.3)),
    }
}

proptest! {
    #[test]
    fn whatever_is_damaged_is_sound_after_repair(
        which in 0..4usize,
        damages in prop::collection::vec(damage(), 0..12),
    ) {
        let mut grid = match which {
            0 => shapes::tetrahedra(2, 2, 1),
            1 => shapes::hexahedra(2, 2, 2),
            2 => zoo(),
            _ => closed_surfaces(),
        };
        for damage in &damages {
            spoil(&mut grid, damage);
        }
        prop_assert_eq!(grid.check(), Ok(()));
        let before = grid.clone();
        let (repaired, repairs) = repair(grid);
        assert_sound(&repaired);

        // Every cell is kept or dropped; what is kept has its old vertices, at their places.
        prop_assert_eq!(repairs.cells.len() + repairs.dropped.len(), before.cells.len());
        for (cell, &id) in repaired.cells.iter().zip(&repairs.cells) {
            let mut now: Vec<u32> = cell.vertices.iter().map(|&at| repairs.vertices[at as usize]).collect();
            let mut then = before.cells.cell(id as usize).vertices.to_vec();
            if repairs.turned.binary_search(&id).is_err() {
                prop_assert_eq!(&now, &then);
            }
            now.sort_unstable();
            then.sort_unstable();
            prop_assert_eq!(now, then);
        }
        for (position, &id) in repaired.positions.iter().zip(&repairs.vertices) {
            prop_assert_eq!(position, &before.positions[id as usize]);
        }
        let (again, repairs) = repair(repaired.clone());
        prop_assert_eq!(again, repaired);
        prop_assert_eq!(repairs.dropped, []);
    }

    #[test]
    fn mirrored_cells_alone_are_turned_back_and_nothing_is_lost(turned in prop::collection::vec(any::<bool>(), 96)) {
        for grid in [shapes::tetrahedra(2, 2, 2), zoo()] {
            let spoilt = rebuilt(&grid, |id, kind, vertices, _| if turned[id] { mirror(kind, vertices) });
            let (repaired, repairs) = repair(spoilt);
            assert_sound(&repaired);
            prop_assert_eq!(repairs.dropped, []);
            let expected = (0u32..).zip(&turned[..grid.cells.len()]).filter(|(_, turned)| **turned);
            prop_assert!(repairs.turned.iter().copied().eq(expected.map(|(id, _)| id)));
            prop_assert!((total_volume(&repaired) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn polyhedra_with_faces_wound_at_random_come_out_right(turned in prop::collection::vec(any::<bool>(), 24)) {
        let grid = polyhedra(&shapes::hexahedra(2, 2, 1));
        let spoilt = rebuilt(&grid, |id, _, _, stream| {
            for face in 0..6 {
                if turned[6 * id + face] {
                    stream[2 + 5 * face..6 + 5 * face].reverse();
                }
            }
        });
        let (repaired, repairs) = repair(spoilt);
        assert_sound(&repaired);
        prop_assert_eq!(repairs.dropped, []);
        prop_assert!((total_volume(&repaired) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn triangles_wound_at_random_come_out_right(turned in prop::collection::vec(any::<bool>(), 600)) {
        let grid = closed_surfaces();
        let spoilt = rebuilt(&grid, |id, kind, vertices, _| if turned[id % 600] { mirror(kind, vertices) });
        let (repaired, _) = repair(spoilt);
        assert_sound(&repaired);
        prop_assert!((inspect(&repaired).volume - inspect(&grid).volume).abs() < 1e-12);
    }
}
