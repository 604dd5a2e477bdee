//! Volumes, areas and Jacobians of cells.

use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::{Cell, CellType, Face, Grid};

/// Signed volume of a cell, m³: positive where its faces wind counter-clockwise as seen from outside, and 0 for a
/// triangle, quad, polygon or empty cell. A face that is not plane counts as the fan around the mean of its vertices, which for a
/// quad has the volume of the bilinear surface; cells on both sides of a face so agree on it.
///
/// # Panics
/// If there is no such cell in a checked grid.
pub fn volume(grid: &Grid, cell: usize) -> f64 {
    cell_volume(&grid.positions, &grid.cells.cell(cell))
}

/// Area of a triangle, quad or polygon, m², or of all faces of a cell that encloses a volume. A face that is not plane
/// counts as its projection along its mean normal.
///
/// # Panics
/// If there is no such cell in a checked grid.
pub fn area(grid: &Grid, cell: usize) -> f64 {
    let faces = grid.cells.cell(cell).faces();
    faces
        .map(|face| face_normal(&grid.positions, &face).norm())
        .sum()
}

/// How round a cell is, without unit: 36 π V² / A³ of its volume V and area A, with the sign of V. 1 for a ball, π / 6
/// for a cube, 0.302 for a regular tetrahedron, 0 for a flat cell, and below 0 for one that is inside out. Of a triangle,
/// quad, polygon or empty cell it is 0.
///
/// # Panics
/// If there is no such cell in a checked grid.
pub fn quality(grid: &Grid, cell: usize) -> f64 {
    let (volume, area) = (volume(grid, cell), area(grid, cell));
    if area == 0.0 {
        return 0.0;
    }
    // Of ratios to the side of a cube of that area: the powers of very small or large cells would leave f64's range.
    let side = area.sqrt();
    let ratio = volume / side / side / side;
    36.0 * PI * ratio * ratio.abs()
}

/// As [`volume`], of a cell whose vertices are at `positions`, m.
///
/// # Panics
/// If a vertex has no position.
pub fn cell_volume(positions: &[Vector3<f64>], cell: &Cell<'_>) -> f64 {
    if !cell.kind.is_volume() {
        return 0.0;
    }
    // Relative to a vertex of the cell: far from the origin the products would cancel.
    let origin = positions[cell.vertices[0] as usize];
    let at = |vertex: u32| positions[vertex as usize] - origin;
    if cell.kind == CellType::Tetrahedron {
        let [a, b, c] = [1, 2, 3].map(|corner| at(cell.vertices[corner]));
        return a.cross(&b).dot(&c) / 6.0;
    }
    cell.faces().map(|face| cone_volume(&face, &at)).sum()
}

/// Signed volume between a face and the origin of `at`.
pub(crate) fn cone_volume(face: &Face<'_>, at: &impl Fn(u32) -> Vector3<f64>) -> f64 {
    let sum: Vector3<f64> = face.vertices().map(at).sum();
    let centre = sum / face.len() as f64;
    let edges = face.edges();
    edges
        .map(|[from, to]| at(from).cross(&at(to)).dot(&centre))
        .sum::<f64>()
        / 6.0
}

/// Area of a face, m², its vertices being at `positions`, m. One that is not plane counts as its projection along its mean
/// normal.
///
/// # Panics
/// If a vertex has no position.
pub fn face_area(positions: &[Vector3<f64>], face: &Face<'_>) -> f64 {
    face_normal(positions, face).norm()
}

/// The mean normal of a face, its length being the area.
pub(crate) fn face_normal(positions: &[Vector3<f64>], face: &Face<'_>) -> Vector3<f64> {
    let origin = positions[face.vertex(0) as usize];
    let at = |vertex: u32| positions[vertex as usize] - origin;
    let edges = face.edges();
    edges
        .map(|[from, to]| at(from).cross(&at(to)))
        .sum::<Vector3<f64>>()
        / 2.0
}

/// Smallest determinant of the three edges at a corner, over the product of their lengths: 1 for a cube, below 0 where
/// the cell folds over. `None` for kinds whose volume alone tells (tetrahedra, polyhedra) and for surface cells.
/// `sign` is -1 to measure the mirror image, else 1.
///
/// A corner with an edge of no length counts as 0: it is degenerate, not folded.
pub(crate) fn smallest_corner(
    positions: &[Vector3<f64>],
    cell: &Cell<'_>,
    sign: f64,
) -> Option<f64> {
    let ring = match cell.kind {
        CellType::Hexahedron | CellType::Pyramid => 4,
        CellType::Wedge => 3,
        CellType::PentagonalPrism => 5,
        CellType::HexagonalPrism => 6,
        CellType::Empty
        | CellType::Triangle
        | CellType::Polygon
        | CellType::Quad
        | CellType::Tetrahedron
        | CellType::Polyhedron => return None,
    };
    // VTK winds the wedge's first triangle the other way than every other prism's first polygon.
    let sign = if cell.kind == CellType::Wedge {
        -sign
    } else {
        sign
    };
    let (bottom, top) = cell.vertices.split_at(ring);
    let corner = |here: u32, others: [u32; 3]| {
        let [a, b, c] = others.map(|other| positions[other as usize] - positions[here as usize]);
        let lengths = a.norm() * b.norm() * c.norm();
        if lengths > 0.0 {
            sign * a.cross(&b).dot(&c) / lengths
        } else {
            0.0
        }
    };
    let mut least = f64::INFINITY;
    for here in 0..ring {
        let (next, before) = ((here + 1) % ring, (here + ring - 1) % ring);
        // All corners of a pyramid's base look to its only apex.
        let above = top[here % top.len()];
        least = least.min(corner(bottom[here], [bottom[next], bottom[before], above]));
        if top.len() == ring {
            least = least.min(corner(above, [top[before], top[next], bottom[here]]));
        }
    }
    Some(least)
}
