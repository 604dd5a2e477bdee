use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::MappingError;
use crate::blocks::BLOCK;
use crate::shape::Stretch;
use crate::weights::Weights;

/// Turns the weights of a fit into those of the affine map that fits best around each vertex: a moving least squares
/// interpolation is linear in the displacements, whatever they are. O(n) per vertex of n points. `[M14]`
///
/// # Errors
/// [`MappingError::Overflow`] for the first vertex whose weights are not finite.
pub(crate) fn affine(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    mut weights: Weights,
) -> Result<Weights, MappingError> {
    let stride = weights.stride;
    let rows = (weights.points.par_chunks_exact(stride))
        .zip(weights.values.par_chunks_exact_mut(stride))
        .zip(vertices);
    let finite = |((set, values), x): ((&[u32], &mut [f64]), &Vector3<f64>)| {
        fit_row(set, values, points, x);
        values.iter().all(|weight| weight.is_finite())
    };
    let overflow = (rows.with_min_len(BLOCK).map(finite)).position_first(|finite| !finite);
    match overflow {
        None => Ok(weights),
        Some(vertex) => Err(MappingError::Overflow { vertex }),
    }
}

/// `ω (1 + (p⁰ − c⁰)ᵀ M⁺ (x⁰ − c⁰))`; what has no weight keeps none. `[M14]`
fn fit_row(set: &[u32], values: &mut [f64], points: &[Vector3<f64>], x: &Vector3<f64>) {
    let base = points[set[0] as usize];
    let offset = |j: &u32| points[*j as usize] - base;
    let mean: Vector3<f64> = (set.iter().zip(&*values))
        .map(|(j, &w)| offset(j) * w)
        .sum();
    let mut spread = Matrix3::zeros();
    for (j, &weight) in set.iter().zip(&*values) {
        let arm = offset(j) - mean;
        spread += arm * arm.transpose() * weight;
    }
    let slope = Stretch::new(spread).inverse * (x - base - mean);
    for (j, weight) in set.iter().zip(values) {
        *weight *= 1.0 + slope.dot(&(offset(j) - mean));
    }
}
