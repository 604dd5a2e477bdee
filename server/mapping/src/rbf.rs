use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use crate::clusters::cluster;
use crate::distance::Distances;
use crate::system::System;
use crate::weights::Weights;
use crate::{MappingError, RadialBasis};

/// The most points of one interpolation: its matrix then takes 200 MB, twice while it is solved.
pub const MAX_BASIS: usize = 5_000;

/// Vertices solved for at once.
const BATCH: usize = 64;

/// The interpolation of the kept points' displacements as weights of them: one factorisation per set of points, and a block
/// of right sides for its vertices. O(n³) per set and O(n²) per vertex of n points. `[M10]`
///
/// # Errors
/// [`MappingError::ManyPoints`], [`MappingError::Condition`] and [`MappingError::Overflow`], for the first set in the
/// order of sets.
pub(crate) fn weights(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    distances: &Distances,
    basis: &RadialBasis,
    scale: f64,
) -> Result<Weights, MappingError> {
    let clusters = cluster(distances); // [C1]
    let sets: Vec<&[u32]> = clusters.sets().collect();
    let stride = sets.iter().map(|set| set.len()).max().unwrap_or(0).max(1);
    let mut weights = Weights {
        stride,
        points: vec![distances.points.first().copied().unwrap_or(0); vertices.len() * stride],
        values: vec![0.0; vertices.len() * stride],
    };
    let rows = weights.points.chunks_exact_mut(stride);
    let rows = rows.zip(weights.values.chunks_exact_mut(stride));
    let mut rows: Vec<Row> = (vertices.iter().zip(rows).zip(&clusters.of_vertex))
        .enumerate()
        .map(|(vertex, ((x, (points, values)), &cluster))| Row {
            vertex,
            x,
            cluster,
            points,
            values,
        })
        .collect();
    rows.sort_by_key(|row| row.cluster); // stable, so each group's vertices rise
    let mut groups: Vec<&mut [Row]> = rows.chunk_by_mut(|a, b| a.cluster == b.cluster).collect();
    let refusals: Vec<Option<MappingError>> = groups
        .par_iter_mut()
        .map(|group| {
            let set = sets[group[0].cluster as usize];
            fill(group, set, points, basis, scale).err()
        })
        .collect();
    drop(groups);
    drop(rows);
    match refusals.into_iter().flatten().next() {
        None => Ok(weights),
        Some(refusal) => Err(refusal),
    }
}

/// The system of a set of points, which move `vertex` among others.
///
/// # Errors
/// [`MappingError::ManyPoints`] and [`MappingError::Condition`].
pub(crate) fn solved(
    set: &[u32],
    points: &[Vector3<f64>],
    basis: &RadialBasis,
    scale: f64,
    vertex: usize,
) -> Result<System, MappingError> {
    if set.len() > MAX_BASIS {
        return Err(MappingError::ManyPoints { points: set.len() });
    }
    let places = set.iter().map(|&j| points[j as usize]);
    System::new(places, basis, scale)
        .map_err(|condition| MappingError::Condition { vertex, condition })
}

/// One vertex and where its weights go.
struct Row<'a> {
    vertex: usize,
    x: &'a Vector3<f64>,
    cluster: u32,
    points: &'a mut [u32],
    values: &'a mut [f64],
}

/// Fills the rows of the vertices that share a set of points.
fn fill(
    rows: &mut [Row],
    set: &[u32],
    points: &[Vector3<f64>],
    basis: &RadialBasis,
    scale: f64,
) -> Result<(), MappingError> {
    if set.is_empty() {
        return Ok(());
    }
    let system = solved(set, points, basis, scale, rows[0].vertex)?;
    let overflows: Vec<Option<usize>> = rows
        .par_chunks_mut(BATCH)
        .map(|rows| {
            let mut right = DMatrix::zeros(system.size(), rows.len());
            for (row, mut column) in rows.iter().zip(right.column_iter_mut()) {
                system.fill(&system.place(row.x), column.as_mut_slice());
            }
            system.solve(&mut right);
            let mut overflow = None;
            for (row, column) in rows.iter_mut().zip(right.column_iter()) {
                if !column.iter().all(|weight| weight.is_finite()) {
                    overflow = overflow.or(Some(row.vertex));
                }
                row.points.fill(set[0]);
                row.points[..set.len()].copy_from_slice(set);
                row.values[..set.len()].copy_from_slice(&column.as_slice()[..set.len()]);
            }
            overflow
        })
        .collect();
    match overflows.into_iter().flatten().next() {
        None => Ok(()),
        Some(vertex) => Err(MappingError::Overflow { vertex }),
    }
}
