//! Which volumes hold a place.

use nalgebra::{Matrix3, Vector3};

use crate::complex::Table;
use crate::{Cell, CellType};

/// How far outside a place may be, relative to the size of the volume, to count as on the boundary.
const MARGIN: f64 = 1e-9;

/// For each place the volumes that hold it, by their order, ascending. O((V + P) log P) for volumes of which each has few
/// places beside it.
pub(crate) fn holders<'a>(
    positions: &[Vector3<f64>],
    volumes: impl Iterator<Item = Cell<'a>>,
    places: &[Vector3<f64>],
) -> Table {
    // By x, so that a volume looks only at places beside it.
    let mut order: Vec<(f64, u32)> = places.iter().map(|place| place.x).zip(0..).collect();
    order.retain(|&(x, place)| {
        x.is_finite() && places[place as usize].iter().all(|c| c.is_finite())
    });
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut pairs = Vec::new();
    for (volume, cell) in (0..).zip(volumes) {
        let corners = cell
            .vertices
            .iter()
            .map(|&vertex| positions[vertex as usize]);
        let (low, high) = corners.fold(
            (
                Vector3::repeat(f64::INFINITY),
                Vector3::repeat(f64::NEG_INFINITY),
            ),
            |(low, high), corner| (low.inf(&corner), high.sup(&corner)),
        );
        let margin = Vector3::repeat(MARGIN * (high - low).amax());
        let (low, high) = (low - margin, high + margin);
        let first = order.partition_point(|entry| entry.0 < low.x);
        for &(_, place) in order[first..].iter().take_while(|entry| entry.0 <= high.x) {
            let x = &places[place as usize];
            if low <= *x && *x <= high && holds(positions, &cell, x) {
                pairs.push([place, volume]);
            }
        }
    }
    Table::grouped(places.len(), pairs.iter().copied())
}

fn holds(positions: &[Vector3<f64>], cell: &Cell<'_>, x: &Vector3<f64>) -> bool {
    let at = |vertex: u32| positions[vertex as usize] - x;
    if cell.kind == CellType::Tetrahedron {
        let corners = [0, 1, 2, 3].map(|corner| at(cell.vertices[corner]));
        return holds_origin(corners);
    }
    // As cones around the mean of the vertices: of any cell that sees all of its boundary from there.
    let mean = |count: usize, vertices: &mut dyn Iterator<Item = u32>| -> Vector3<f64> {
        vertices.map(at).sum::<Vector3<f64>>() / count as f64
    };
    let centre = mean(cell.vertices.len(), &mut cell.vertices.iter().copied());
    cell.faces().any(|face| {
        let middle = mean(face.len(), &mut face.vertices());
        let mut edges = face.edges();
        edges.any(|[from, to]| holds_origin([centre, middle, at(from), at(to)]))
    })
}

/// Whether the origin is in a tetrahedron; a flat one holds nothing.
fn holds_origin([a, b, c, d]: [Vector3<f64>; 4]) -> bool {
    let edges = Matrix3::from_columns(&[b - a, c - a, d - a]);
    let Some(inverse) = edges.try_inverse() else {
        return false;
    };
    let shares = inverse * -a;
    shares.min() >= -MARGIN && shares.sum() <= 1.0 + MARGIN
}
