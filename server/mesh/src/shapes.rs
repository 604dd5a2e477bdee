//! Small regular grids, for tests and benchmarks.

use nalgebra::Vector3;

use crate::{Cell, CellType, Cells, Grid};

/// A box of `nx` × `ny` × `nz` cubes of edge 1 / `nx`, one corner at the origin. Vertices and cubes run along x first.
///
/// # Panics
/// If a count is 0, or more cells would result than a grid can hold.
pub fn hexahedra(nx: usize, ny: usize, nz: usize) -> Grid {
    cut(
        nx,
        ny,
        nz,
        CellType::Hexahedron,
        &[&[0, 1, 3, 2, 4, 5, 7, 6]],
    )
}

/// The box of [`hexahedra`], each cube cut in six tetrahedra around its main diagonal.
///
/// # Panics
/// As [`hexahedra`].
pub fn tetrahedra(nx: usize, ny: usize, nz: usize) -> Grid {
    let around_the_diagonal: [&[usize]; 6] = [
        &[0, 1, 3, 7],
        &[0, 3, 2, 7],
        &[0, 2, 6, 7],
        &[0, 6, 4, 7],
        &[0, 4, 5, 7],
        &[0, 5, 1, 7],
    ];
    cut(nx, ny, nz, CellType::Tetrahedron, &around_the_diagonal)
}

/// `pieces` name the corners of a cube by x + 2 y + 4 z.
fn cut(nx: usize, ny: usize, nz: usize, kind: CellType, pieces: &[&[usize]]) -> Grid {
    assert!(
        nx > 0 && ny > 0 && nz > 0,
        "a box has cubes along every axis"
    );
    let edge = 1.0 / nx as f64;
    let mut positions = Vec::new();
    for z in 0..=nz {
        for y in 0..=ny {
            positions.extend((0..=nx).map(|x| Vector3::new(x as f64, y as f64, z as f64) * edge));
        }
    }
    let vertex = |x: usize, y: usize, z: usize| {
        u32::try_from(x + (nx + 1) * (y + (ny + 1) * z)).expect("fewer than u32::MAX vertices")
    };
    let mut cells = Cells::default();
    let mut vertices = Vec::new();
    for cube in 0..nx * ny * nz {
        let [x, y, z] = [cube % nx, cube / nx % ny, cube / (nx * ny)];
        for piece in pieces {
            vertices.clear();
            let corners = piece.iter();
            vertices.extend(corners.map(|c| vertex(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))));
            cells.push(Cell {
                kind,
                vertices: &vertices,
                face_stream: &[],
            });
        }
    }
    Grid { positions, cells }
}
