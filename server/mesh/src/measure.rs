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

/// How far a cell is from folding over, -1 to 1: the smallest scaled Jacobian of its corners, the determinant of a corner's
/// three edges over the product of their lengths. 1 for a cube, 0 for a cell that is flat or has an edge of no length, below 0
/// for one that is inside out or folds over. Of a polyhedron it is the smallest cone from the mean of its vertices to a face
/// over the mean size of these cones; of a cell that encloses no volume it is 1.
///
/// * `at` – where a vertex is.
pub fn scaled_jacobian(cell: &Cell<'_>, at: impl Fn(u32) -> Vector3<f64>) -> f64 {
    if let Some(least) = smallest_corner(cell, 1.0, &at) {
        return least;
    }
    if cell.kind == CellType::Tetrahedron {
        let [a, b, c, d] = [0, 1, 2, 3].map(|corner| at(cell.vertices[corner]));
        // At every corner: a needle's are all of one sign, but not of one size.
        let corners = [[a, b, c, d], [b, c, a, d], [c, a, b, d], [d, b, a, c]];
        return corners
            .map(|[here, ends @ ..]| scaled_determinant(ends.map(|end| end - here)))
            .into_iter()
            .fold(f64::INFINITY, f64::min);
    }
    if !cell.kind.is_volume() {
        return 1.0;
    }
    let sum: Vector3<f64> = cell.vertices.iter().map(|&vertex| at(vertex)).sum();
    let middle = sum / cell.vertices.len() as f64;
    let from_middle = |vertex: u32| at(vertex) - middle;
    let (mut least, mut total, mut count) = (f64::INFINITY, 0.0, 0.0);
    for cone in cell.faces().map(|face| cone_volume(&face, &from_middle)) {
        least = least.min(cone);
        total += cone.abs();
        count += 1.0;
    }
    if total > 0.0 {
        least / total * count
    } else {
        0.0
    }
}

/// The determinant of three edges over the product of their lengths; 0 where one has none.
fn scaled_determinant([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let lengths = a.norm() * b.norm() * c.norm();
    if lengths > 0.0 {
        a.cross(&b).dot(&c) / lengths
    } else {
        0.0
    }
}

/// Smallest determinant of the three edges at a corner, over the product of their lengths: 1 for a cube, below 0 where
/// the cell folds over. `None` for kinds whose volume alone tells (tetrahedra, polyhedra) and for surface cells.
/// `sign` is -1 to measure the mirror image, else 1.
///
/// A corner with an edge of no length counts as 0: it is degenerate, not folded.
pub(crate) fn smallest_corner(
    cell: &Cell<'_>,
    sign: f64,
    at: &impl Fn(u32) -> Vector3<f64>,
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
        sign * scaled_determinant(others.map(|other| at(other) - at(here)))
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
