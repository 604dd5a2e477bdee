use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::MappingError;
use crate::blocks::BLOCK;
use crate::distance::Distances;
use crate::weights::Weights;

/// How far out of the span of the points before it a point has to lie, relative to their size. A sliver extrapolates
/// with weights as large as it is thin.
const MARGIN: f64 = 1e-3;

/// The least volume of the edges, relative to the cube of the longest coordinate, that is solved for.
const FLAT: f64 = 1e-9;

/// Barycentric weights of each vertex in the tetrahedron of its nearest points that span a volume. `[M7]`
///
/// # Errors
/// [`MappingError::Flat`] with the vertices that have no such points.
pub(crate) fn weights(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    distances: &Distances,
) -> Result<Weights, MappingError> {
    let stride = distances.stride;
    let mut rows = vec![([0; 4], [0.0; 4]); vertices.len()];
    let flat: Vec<Vec<usize>> = rows
        .par_chunks_mut(BLOCK)
        .zip(vertices.par_chunks(BLOCK))
        .enumerate()
        .map(|(block, (rows, vertices))| {
            let mut flat = Vec::new();
            let first = block * BLOCK;
            for (vertex, (row, x)) in (first..).zip(rows.iter_mut().zip(vertices)) {
                let start = vertex * stride;
                let candidates = &distances.points[start..start + distances.in_reach(vertex)];
                let found = four(candidates, points)
                    .map(|set| (set, coordinates(set.map(|j| points[j as usize]), x)))
                    .filter(|(_, weights)| weights.iter().all(|weight| weight.is_finite()));
                match found {
                    Some(found) => *row = found,
                    None => flat.push(vertex),
                }
            }
            flat
        })
        .collect();
    let flat = flat.concat();
    if !flat.is_empty() {
        return Err(MappingError::Flat { vertices: flat });
    }
    let (points, values): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    Ok(Weights {
        stride: 4,
        points: points.into_flattened(),
        values: values.into_flattened(),
    })
}

/// The first four of `candidates` that span a volume: a point is taken if it lies out of the span of those before it. If
/// the first two then are so near to each other that the volume is flat, the second is passed over.
pub(crate) fn four(candidates: &[u32], points: &[Vector3<f64>]) -> Option<[u32; 4]> {
    let at = |j: u32| points[j as usize];
    let (&first, mut rest) = candidates.split_first()?;
    while rest.len() >= 3 {
        let mut taken = [first; 4];
        let mut count = 1;
        let mut size = 0.0_f64;
        let mut second = 0;
        let mut axes = [Vector3::zeros(); 3];
        for (place, &j) in rest.iter().enumerate() {
            let edge = at(j) - at(first);
            let mut out = edge;
            // Twice, for the remainder to be square to the axes also where it is small.
            for axis in axes.iter().chain(&axes) {
                out -= axis * axis.dot(&out);
            }
            let reach = size.max(edge.norm());
            let height = out.norm();
            if height <= MARGIN * reach {
                continue;
            }
            if count == 1 {
                second = place;
            }
            axes[count - 1] = out / height;
            taken[count] = j;
            size = reach;
            count += 1;
            if count == 4 {
                break;
            }
        }
        if count < 4 {
            return None;
        }
        let edges = edges(taken.map(at));
        let longest = edges.amax();
        if (edges / longest).determinant().abs() >= FLAT {
            return Some(taken);
        }
        rest = &rest[second + 1..];
    }
    None
}

fn edges([origin, a, b, c]: [Vector3<f64>; 4]) -> Matrix3<f64> {
    Matrix3::from_columns(&[a - origin, b - origin, c - origin])
}

/// λ with `Σ λ = 1` and `Σ λ p = x`, for corners p that span a volume. `[M7]`
fn coordinates(corners: [Vector3<f64>; 4], x: &Vector3<f64>) -> [f64; 4] {
    let edges = edges(corners);
    let longest = edges.amax();
    let solved = (edges / longest)
        .full_piv_lu()
        .solve(&((x - corners[0]) / longest));
    let l = solved.expect("four points that span a volume have an inverse");
    [1.0 - l.sum(), l.x, l.y, l.z]
}
