use rayon::prelude::*;

use crate::Kernel;
use crate::blocks::{BLOCK, worth_sharing};
use crate::distance::Distances;
use crate::radial::exponentials;

/// How strongly the kept points act on each vertex.
///
/// Rows of `stride` entries, one row per vertex; a row sums to 1, or is all zero where no point is in reach. Only those of
/// an interpolation without a polynomial `[M10]` sum to something else. A row of fewer points ends in repetitions of its
/// first, with weight 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    pub(crate) stride: usize,
    pub(crate) points: Vec<u32>,
    pub(crate) values: Vec<f64>,
}

/// How little a point may count in a fit beside another: enough for three points of which two count so little to turn
/// a fit as exactly as positions in single precision are known.
const LEAST: f64 = 1e-6;

/// Turns distances into weights that sum to 1, with `scale` > 0 in m.
pub(crate) fn normalise(distances: Distances, kernel: Kernel, scale: f64) -> Weights {
    let Distances {
        stride,
        points,
        squared: mut values,
    } = distances;
    let rows = |values: &mut [f64]| {
        for row in values.chunks_exact_mut(stride) {
            normalise_row(row, kernel, scale);
        }
    };
    if worth_sharing(values.len() / stride) {
        (values.par_chunks_mut(BLOCK * stride)).for_each(rows);
    } else {
        rows(&mut values);
    }
    Weights {
        stride,
        points,
        values,
    }
}

/// As [`normalise`], with no weight below [`LEAST`] of the greatest of its row: far from all points but one, the others
/// still say how a fit turns. `[M13]`
pub(crate) fn for_fits(distances: Distances, kernel: Kernel, scale: f64) -> Weights {
    let rows = distances.points.len() / distances.stride;
    let counts: Vec<usize> = (0..rows).map(|row| distances.in_reach(row)).collect();
    let mut weights = normalise(distances, kernel, scale);
    let rows = weights.values.par_chunks_exact_mut(weights.stride);
    rows.with_min_len(BLOCK)
        .zip(counts)
        .for_each(|(row, count)| {
            let row = &mut row[..count];
            let least = LEAST * row.iter().copied().fold(0.0, f64::max);
            row.iter_mut()
                .for_each(|weight| *weight = weight.max(least));
            let sum: f64 = row.iter().sum();
            row.iter_mut().for_each(|weight| *weight /= sum);
        });
    weights
}

/// All of the weight on the nearest point. `[M5]`
pub(crate) fn nearest_alone(distances: &Distances) -> Weights {
    let first = |row: &[f64]| f64::from(u8::from(row[0] < f64::INFINITY));
    Weights {
        stride: 1,
        points: (distances.points.iter().step_by(distances.stride).copied()).collect(),
        values: distances
            .squared
            .chunks_exact(distances.stride)
            .map(first)
            .collect(),
    }
}

/// The same weight for each point in reach. `[M6]`
pub(crate) fn alike(distances: Distances) -> Weights {
    let Distances {
        stride,
        points,
        squared: mut values,
    } = distances;
    for row in values.chunks_exact_mut(stride) {
        let count = row.partition_point(|&squared| squared < f64::INFINITY);
        row[..count].fill((count as f64).recip());
        row[count..].fill(0.0);
    }
    Weights {
        stride,
        points,
        values,
    }
}

/// Replaces the squared distances of a row by its weights.
///
/// Each weight is first taken relative to the greatest: that one is 1 however far the vertex, so the sum never vanishes.
fn normalise_row(row: &mut [f64], kernel: Kernel, scale: f64) {
    let nearest = row.iter().copied().fold(f64::INFINITY, f64::min);
    if nearest == f64::INFINITY {
        return row.fill(0.0);
    }
    match kernel {
        Kernel::Gaussian => {
            let factor = -0.5 / (scale * scale);
            row.iter_mut()
                .for_each(|value| *value = factor * (*value - nearest));
            exponentials(row); // [W2]
        }
        Kernel::InverseSquare => row.iter_mut().for_each(|value| {
            // Equal first: a vertex on a point would give 0/0.
            *value = if *value == nearest {
                1.0
            } else {
                nearest / *value // [W3]
            };
        }),
    }
    let sum: f64 = row.iter().sum();
    row.iter_mut().for_each(|weight| *weight /= sum); // [W4]
}

impl Weights {
    /// The points with their weights of one vertex.
    pub(crate) fn row(&self, vertex: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let row = vertex * self.stride..(vertex + 1) * self.stride;
        let (points, values) = (&self.points[row.clone()], &self.values[row]);
        let repeats = |&(place, point): &(usize, u32)| place > 0 && point == points[0];
        (points.iter().copied().enumerate())
            .take_while(move |entry| !repeats(entry))
            .map(|(place, point)| (point, values[place]))
    }

    /// Takes over rows of other weights: those of `to`, ascending, of which the last may be appended.
    pub(crate) fn take(&mut self, to: &[u32], rows: &Self) {
        if self.stride < rows.stride {
            self.widen(rows.stride);
        }
        let stride = self.stride;
        for (at, &row) in to.iter().enumerate() {
            let from = at * rows.stride..(at + 1) * rows.stride;
            let row = row as usize * stride..(row as usize + 1) * stride;
            if row.end > self.points.len() {
                self.points.resize(row.end, 0);
                self.values.resize(row.end, 0.0);
            }
            let (points, values) = (&mut self.points[row.clone()], &mut self.values[row]);
            points.fill(rows.points[from.start]);
            values.fill(0.0);
            points[..rows.stride].copy_from_slice(&rows.points[from.clone()]);
            values[..rows.stride].copy_from_slice(&rows.values[from]);
        }
    }

    /// Makes the rows longer.
    fn widen(&mut self, stride: usize) {
        let rows = self.points.len() / self.stride;
        let mut wide = Self {
            stride,
            points: Vec::with_capacity(rows * stride),
            values: Vec::with_capacity(rows * stride),
        };
        let old =
            (self.points.chunks_exact(self.stride)).zip(self.values.chunks_exact(self.stride));
        for (row, (points, values)) in (1..).zip(old) {
            wide.points.extend_from_slice(points);
            wide.points.resize(row * stride, points[0]);
            wide.values.extend_from_slice(values);
            wide.values.resize(row * stride, 0.0);
        }
        *self = wide;
    }

    /// The point of greatest weight of each vertex, ties to the lower index.
    pub(crate) fn dominant(&self) -> Vec<u32> {
        let strongest = |(points, values): (&[u32], &[f64])| {
            let mut best = (points[0], values[0]);
            for (&point, &value) in points.iter().zip(values) {
                if value > best.1 || (value == best.1 && point < best.0) {
                    best = (point, value);
                }
            }
            best.0
        };
        let rows = self.points.chunks_exact(self.stride);
        rows.zip(self.values.chunks_exact(self.stride))
            .map(strongest)
            .collect()
    }
}
