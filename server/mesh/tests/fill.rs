//! Filled surfaces: what they enclose, where their skin lies, and what is refused.

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_mesh::{
    Capsule, Cell, CellShape, CellType, Cells, FillError, Grid, LatticeError, cell_volume, fill,
    inspect, lattice, shapes, surface,
};

const SHAPES: [CellShape; 2] = [CellShape::Hexahedron, CellShape::Tetrahedron];

/// The surface of a grid as a grid of triangles.
fn skin(of: &Grid) -> Grid {
    let surface = surface(&of.cells);
    let mut cells = Cells::default();
    for triangle in &surface.triangles {
        cells.push(Cell {
            kind: CellType::Triangle,
            vertices: triangle,
            face_stream: &[],
        });
    }
    let vertices = surface.vertices.iter();
    Grid {
        positions: vertices.map(|&at| of.positions[at as usize]).collect(),
        cells,
    }
}

fn ball(centre: [f64; 3], radius: f64, spacing: f64) -> Grid {
    let centre = Vector3::from(centre);
    let capsule = Capsule {
        start: centre,
        end: centre,
        radius,
    };
    skin(&lattice(CellShape::Tetrahedron, spacing, &[capsule]).expect("a ball"))
}

fn turned(mut grid: Grid) -> Grid {
    for triangle in grid.cells.connectivity.chunks_exact_mut(3) {
        triangle.swap(1, 2);
    }
    grid
}

fn both(mut first: Grid, second: &Grid) -> Grid {
    let offset = u32::try_from(first.positions.len()).expect("small");
    first.positions.extend(&second.positions);
    for cell in second.cells.iter() {
        let vertices: Vec<_> = cell.vertices.iter().map(|vertex| vertex + offset).collect();
        first.cells.push(Cell {
            kind: cell.kind,
            vertices: &vertices,
            face_stream: &[],
        });
    }
    first
}

fn volume(grid: &Grid) -> f64 {
    let cells = grid.cells.iter();
    cells.map(|cell| cell_volume(&grid.positions, &cell)).sum()
}

fn assert_sound(grid: &Grid) {
    let found = inspect(grid);
    assert_eq!(found.inverted_cells, [] as [u32; 0]);
    assert_eq!(found.non_manifold_faces, [] as [Vec<u32>; 0]);
    assert_eq!(found.duplicate_cells, [] as [[u32; 2]; 0]);
    assert!(found.volume > 0.0);
}

/// The farthest that a surface vertex of `filled` lies from the sphere.
fn off_sphere(filled: &Grid, radius: f64) -> f64 {
    let surface = surface(&filled.cells);
    let off = |&vertex: &u32| (filled.positions[vertex as usize].norm() - radius).abs();
    surface.vertices.iter().map(off).fold(0.0, f64::max)
}

#[test]
fn a_box_on_the_grid_is_filled_exactly() {
    // Every lattice plane at the sides coincides with them: each row there meets faces, edges or corners.
    let box_of_two = skin(&shapes::hexahedra(2, 2, 2));
    for shape in SHAPES {
        let filled = fill(shape, 0.25, &box_of_two).expect("a box");
        assert_sound(&filled);
        assert!((volume(&filled) - 1.0).abs() < 1e-12, "{}", volume(&filled));
    }
}

#[test]
fn what_a_stuffed_surface_encloses_converges_with_order_two_and_its_skin_lies_on_it() {
    let given = ball([0.0; 3], 1.0, 0.1);
    let enclosed = inspect(&given).volume;
    let error = |spacing: f64| {
        let filled = fill(CellShape::Tetrahedron, spacing, &given).expect("a ball");
        assert_sound(&filled);
        // The surface given is itself off the sphere by h²/8 of its own edges.
        assert!(off_sphere(&filled, 1.0) < 0.1f64.powi(2) / 2.0);
        (volume(&filled) - enclosed).abs() / enclosed
    };
    let (coarse, fine) = (error(0.2), error(0.1));
    assert!(coarse < 0.04, "{coarse}");
    assert!(fine < 0.3 * coarse, "{fine} against {coarse}");
}

#[test]
fn a_part_wound_the_other_way_leaves_a_hollow() {
    let (outer, inner) = (ball([0.0; 3], 1.0, 0.2), ball([0.1, 0.0, 0.0], 0.5, 0.1));
    let enclosed = inspect(&outer).volume - inspect(&inner).volume;
    for shape in SHAPES {
        let filled =
            fill(shape, 0.1, &both(outer.clone(), &turned(inner.clone()))).expect("hollow");
        assert_sound(&filled);
        assert!((volume(&filled) - enclosed).abs() < 0.03 * enclosed);
        assert!(inspect(&filled).components == 1);
        let least = (filled.positions.iter())
            .map(|position| (position - Vector3::x() * 0.1).norm())
            .fold(f64::INFINITY, f64::min);
        assert!(least > 0.4, "{least}");
    }
}

#[test]
fn parts_that_overlap_are_filled_once() {
    let (left, right) = (
        ball([-0.4, 0.0, 0.0], 1.0, 0.1),
        ball([0.4, 0.0, 0.0], 1.0, 0.1),
    );
    let filled = fill(CellShape::Tetrahedron, 0.1, &both(left, &right)).expect("two balls");
    assert_sound(&filled);
    // Two balls less the lens they share.
    let distance: f64 = 0.8;
    let lens = std::f64::consts::PI / 12.0 * (4.0 + distance) * (2.0 - distance).powi(2);
    let union = 8.0 / 3.0 * std::f64::consts::PI - lens;
    assert!(
        (volume(&filled) / union - 1.0).abs() < 0.02,
        "{}",
        volume(&filled) / union
    );
    assert_eq!(inspect(&filled).components, 1);
}

#[test]
fn the_way_that_a_whole_surface_is_wound_does_not_matter() {
    let given = ball([0.03, 0.02, 0.01], 0.7, 0.2);
    for shape in SHAPES {
        let filled = fill(shape, 0.15, &given).expect("a ball");
        assert_eq!(fill(shape, 0.15, &turned(given.clone())), Ok(filled));
    }
}

#[test]
fn what_cannot_be_filled_is_refused_with_its_place() {
    let box_of_one = skin(&shapes::hexahedra(1, 1, 1));
    let fill = |spacing: f64, grid: &Grid| fill(CellShape::Tetrahedron, spacing, grid);

    let refused = fill(0.1, &shapes::hexahedra(1, 1, 1));
    assert_eq!(refused, Err(FillError::Volume { cell: 0 }));

    let mut open = box_of_one.clone();
    open.cells.types.pop();
    open.cells.offsets.pop();
    open.cells.connectivity.truncate(33);
    assert!(matches!(
        fill(0.1, &open),
        Err(FillError::Open { edges: 3, .. })
    ));

    let mut miswound = box_of_one.clone();
    miswound.cells.connectivity.swap(0, 1);
    assert!(matches!(
        fill(0.1, &miswound),
        Err(FillError::Open { edges: 3, .. })
    ));

    let refused = fill(0.0, &box_of_one);
    assert_eq!(refused, Err(LatticeError::Spacing { value: 0.0 }.into()));
    let refused = fill(1e-4, &box_of_one);
    assert!(matches!(
        refused,
        Err(FillError::Lattice(LatticeError::TooMany { .. }))
    ));
    let refused = fill(1e-7, &box_of_one);
    assert!(matches!(
        refused,
        Err(FillError::OutOfReach { vertex: 1, .. })
    ));
    let mut small = box_of_one;
    for position in &mut small.positions {
        *position = *position * 0.1 + Vector3::repeat(0.3);
    }
    assert!(matches!(fill(10.0, &small), Err(FillError::NoCells { .. })));
}

proptest! {
    /// Whatever way a surface lies to the grid, even with its vertices on it, no row of the grid leaks.
    #[test]
    fn no_surface_leaks(
        shift in prop::array::uniform3(-4i8..4),
        spacing in prop::sample::select(vec![0.25, 0.2, 0.125]),
        angle in prop::sample::select(vec![0.0, std::f64::consts::FRAC_PI_4, 0.3]),
    ) {
        let mut given = skin(&shapes::hexahedra(1, 2, 1));
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        for position in &mut given.positions {
            *position = turn * *position + Vector3::from(shift.map(|at| f64::from(at) * 0.125));
        }
        for shape in SHAPES {
            let filled = fill(shape, spacing, &given).expect("a box");
            assert_sound(&filled);
            // A row that leaks is empty, or full up to the next wall. What else is missing are the edges, rounded off, or the
            // steps of cubes along walls that do not lie between them.
            let fits = angle == 0.0 && spacing != 0.2;
            let most = match shape {
                CellShape::Hexahedron if fits => 1e-12,
                CellShape::Hexahedron => 0.2,
                CellShape::Tetrahedron => 0.1,
            };
            prop_assert!((volume(&filled) / 2.0 - 1.0).abs() < most);
            for position in &filled.positions {
                let back = turn.inverse() * (position - Vector3::from(shift.map(|at| f64::from(at) * 0.125)));
                let outside = (0..3).map(|axis| (back[axis] - [1.0, 2.0, 1.0][axis]).max(-back[axis]));
                let reach = match shape {
                    CellShape::Hexahedron => 0.9 * spacing,
                    CellShape::Tetrahedron => 1e-9,
                };
                let outside = outside.fold(f64::NEG_INFINITY, f64::max);
                prop_assert!(outside <= reach, "{outside} {back:?} {shape:?}");
            }
        }
    }
}
