use std::num::NonZeroUsize;

use kiddo::SquaredEuclidean;
use kiddo::immutable::float::kdtree::ImmutableKdTree;
use multiversion::multiversion;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::blocks::{BLOCK, worth_sharing};

/// Points within reach of each vertex, and how far they are: the first stage. `[W1]`
///
/// Rows of `stride` entries, one row per vertex, nearest first, equal distances by index. Rows with fewer points end in
/// repetitions of their first, at infinite distance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Distances {
    pub(crate) stride: usize,
    pub(crate) points: Vec<u32>,
    pub(crate) squared: Vec<f64>, // m²
}

impl Distances {
    /// Of rows of squared distances and points, the nearest first.
    pub(crate) fn of_rows(rows: &[Vec<(f64, u32)>]) -> Self {
        let stride = rows.iter().map(Vec::len).max().unwrap_or(1).max(1);
        let mut distances = Self {
            stride,
            points: Vec::with_capacity(rows.len() * stride),
            squared: Vec::with_capacity(rows.len() * stride),
        };
        for row in rows {
            let end = distances.points.len() + stride;
            distances.points.extend(row.iter().map(|entry| entry.1));
            distances.squared.extend(row.iter().map(|entry| entry.0));
            let pad = row.first().map_or(0, |entry| entry.1);
            distances.points.resize(end, pad);
            distances.squared.resize(end, f64::INFINITY);
        }
        distances
    }

    /// How many points a vertex has in reach.
    pub(crate) fn in_reach(&self, vertex: usize) -> usize {
        let row = &self.squared[vertex * self.stride..(vertex + 1) * self.stride];
        row.partition_point(|&squared| squared < f64::INFINITY)
    }

    /// The first point of each row.
    pub(crate) fn firsts(&self) -> Vec<u32> {
        let firsts = self.points.iter().step_by(self.stride);
        firsts.copied().collect()
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        self.points.len() / self.stride
    }

    /// The rows without a point in reach, rising.
    pub(crate) fn empty(&self) -> Vec<usize> {
        let first = self.squared.iter().step_by(self.stride).enumerate();
        let empty = first.filter(|(_, squared)| **squared == f64::INFINITY);
        empty.map(|(row, _)| row).collect()
    }

    /// Gives the nearest point of each row of `nearest` to one of these rows, which are empty.
    pub(crate) fn give(&mut self, rows: &[usize], nearest: &Self) {
        let entries = nearest.points.iter().step_by(nearest.stride);
        let entries = entries.zip(nearest.squared.iter().step_by(nearest.stride));
        for (&row, (&point, &squared)) in rows.iter().zip(entries) {
            self.points[row * self.stride..(row + 1) * self.stride].fill(point);
            self.squared[row * self.stride] = squared;
        }
    }

    /// The same points in the same order, at the distances that they have here; what is out of reach stays so.
    /// `coefficients` as in [`scaled`], or none. `[M16]`
    pub(crate) fn measured_at(
        &self,
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        coefficients: &[f64],
    ) -> Self {
        let mut squared = self.squared.clone();
        let rows = (squared.par_chunks_exact_mut(self.stride))
            .zip(self.points.par_chunks_exact(self.stride))
            .zip(vertices);
        rows.with_min_len(BLOCK).for_each(|((squared, set), x)| {
            for (squared, &j) in squared.iter_mut().zip(set) {
                if *squared < f64::INFINITY {
                    let factor = coefficients.get(j as usize).map_or(1.0, |c| c * c);
                    *squared = (factor * (x - points[j as usize]).norm_squared()).min(f64::MAX);
                }
            }
        });
        Self {
            stride: self.stride,
            points: self.points.clone(),
            squared,
        }
    }
}

/// Up to this many points are all looked at, side by side: sooner done than a walk through a tree.
const FEW: usize = 8;

/// The coordinates of few points, by columns; those that are none are infinitely far.
#[derive(Clone)]
struct Few([[f64; FEW]; 3]);

impl Few {
    /// `None` for more.
    fn new(places: &[[f64; 3]]) -> Option<Self> {
        let column = |axis: usize| {
            std::array::from_fn(|i| places.get(i).map_or(f64::INFINITY, |place| place[axis]))
        };
        (places.len() <= FEW).then(|| Self([0, 1, 2].map(column)))
    }

    /// Fills rows of all of them, the nearest first; `usable` translates.
    fn fill(
        &self,
        vertices: &[Vector3<f64>],
        usable: &[u32],
        points: &mut [u32],
        squared: &mut [f64],
    ) {
        let rows =
            (points.chunks_exact_mut(usable.len())).zip(squared.chunks_exact_mut(usable.len()));
        for (vertex, (points, squared)) in vertices.iter().zip(rows) {
            let (found, ranks) = ranked(&self.0, &(*vertex).into());
            for ((&point, distance), rank) in usable.iter().zip(found).zip(ranks) {
                (points[rank as usize], squared[rank as usize]) = (point, distance);
            }
        }
    }
}

/// The squared distances of places, by columns, from a vertex, and which is the how many-th; equal ones by number.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn ranked([x, y, z]: &[[f64; FEW]; 3], vertex: &[f64; 3]) -> ([f64; FEW], [u32; FEW]) {
    let mut squared = [0.0; FEW];
    for i in 0..FEW {
        let (dx, dy, dz) = (x[i] - vertex[0], y[i] - vertex[1], z[i] - vertex[2]);
        squared[i] = dx * dx + dy * dy + dz * dz;
    }
    let mut ranks = [0; FEW];
    for (j, &other) in squared.iter().enumerate() {
        for i in 0..FEW {
            ranks[i] += u32::from(other < squared[i] || (other == squared[i] && j < i));
        }
    }
    (squared, ranks)
}

type Tree = ImmutableKdTree<f64, u32, 3, 32>;

/// The usable points, to find those near to a place.
#[derive(Clone)]
pub(crate) struct Seeker {
    usable: Vec<u32>,
    tree: Tree,
    few: Option<Few>,
}

impl std::fmt::Debug for Seeker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Seeker").field(&self.usable.len()).finish()
    }
}

/// The `count` ≥ 1 nearest of the usable points for each vertex (all, if there are fewer).
///
/// Weights fall with distance, so these are the greatest `count` weights, and nothing else need be computed for a
/// filter that keeps no more. O(V log P) for few ties.
pub(crate) fn nearest(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    usable: &[u32],
    count: usize,
) -> Distances {
    Seeker::new(points, usable).nearest(vertices, count)
}

impl Seeker {
    pub(crate) fn new(points: &[Vector3<f64>], usable: &[u32]) -> Self {
        let places: Vec<[f64; 3]> = usable.iter().map(|&j| points[j as usize].into()).collect();
        Self {
            usable: usable.to_vec(),
            tree: Tree::new_from_slice(&places),
            few: Few::new(&places),
        }
    }

    /// As [`nearest`].
    pub(crate) fn nearest(&self, vertices: &[Vector3<f64>], count: usize) -> Distances {
        let Self { usable, tree, few } = self;
        let stride = count.min(usable.len());
        let all = few.as_ref().filter(|_| stride == usable.len());
        let mut distances = Distances {
            stride,
            points: vec![usable[0]; vertices.len() * stride],
            squared: vec![f64::INFINITY; vertices.len() * stride],
        };
        let fill = |vertices: &[Vector3<f64>], points: &mut [u32], squared: &mut [f64]| {
            let rows = points
                .chunks_exact_mut(stride)
                .zip(squared.chunks_exact_mut(stride));
            if let Some(all) = all {
                return all.fill(vertices, usable, points, squared);
            }
            for (vertex, (points, squared)) in vertices.iter().zip(rows) {
                fill_row(tree, usable, &(*vertex).into(), points, squared);
            }
        };
        if worth_sharing(vertices.len()) {
            vertices
                .par_chunks(BLOCK)
                .zip(distances.points.par_chunks_mut(BLOCK * stride))
                .zip(distances.squared.par_chunks_mut(BLOCK * stride))
                .for_each(|((vertices, points), squared)| fill(vertices, points, squared));
        } else {
            fill(vertices, &mut distances.points, &mut distances.squared);
        }
        distances
    }
}

/// Multiplies the distances of each point by its coefficient, and orders the rows anew. What is out of reach stays so,
/// whatever its coefficient. `[W6]`
pub(crate) fn scaled(mut distances: Distances, coefficients: &[f64]) -> Distances {
    let stride = distances.stride;
    let rows = (distances.points.par_chunks_exact_mut(stride))
        .zip(distances.squared.par_chunks_exact_mut(stride));
    rows.with_min_len(BLOCK).for_each(|(points, squared)| {
        let entries = points.iter().zip(squared.iter());
        let mut row: Vec<(f64, u32)> = entries
            .map(|(&point, &squared)| {
                let in_reach = squared < f64::INFINITY;
                let factor = if in_reach {
                    coefficients[point as usize]
                } else {
                    1.0
                };
                (factor * factor * squared, point)
            })
            .collect();
        row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for ((point, squared), entry) in points.iter_mut().zip(squared).zip(row) {
            (*squared, *point) = entry;
        }
    });
    distances
}

/// Fills one row; `usable` translates what the tree counts.
fn fill_row(
    tree: &Tree,
    usable: &[u32],
    vertex: &[f64; 3],
    points: &mut [u32],
    squared: &mut [f64],
) {
    let count = points.len();
    // One more than asked for, to see whether the last one ties; if it does, more, until the tie is whole.
    let mut asked = (count + 1).min(usable.len());
    let mut found = loop {
        let most = NonZeroUsize::new(asked).expect("a row holds at least one point");
        let found = tree.nearest_n::<SquaredEuclidean>(vertex, most);
        if asked == usable.len() || found[asked - 1].distance > found[count - 1].distance {
            break found;
        }
        asked = (2 * asked).min(usable.len());
    };
    // `usable` rises, so the tree's own numbers order ties like the points'.
    found.sort_unstable_by(|a, b| (a.distance.total_cmp(&b.distance)).then(a.item.cmp(&b.item)));
    for ((point, squared), near) in points.iter_mut().zip(squared).zip(&found) {
        *point = usable[near.item as usize];
        *squared = near.distance;
    }
}

/// The mean distance, m, of the usable points to their nearest neighbour in another place; `None` if there is no other
/// place. `[W5]`
pub(crate) fn spacing(points: &[Vector3<f64>], usable: &[u32]) -> Option<f64> {
    let place = |&j: &u32| -> [f64; 3] { points[j as usize].map(|c| c + 0.0).into() }; // −0 + 0 = 0
    let mut places: Vec<[f64; 3]> = usable.iter().map(place).collect();
    places.sort_unstable_by(|a, b| a.partial_cmp(b).expect("coordinates are finite"));
    places.dedup();
    if places.len() < 2 {
        return None;
    }
    let tree = Tree::new_from_slice(&places);
    let two = NonZeroUsize::new(2).expect("two is not zero");
    let nearest = |place| tree.nearest_n::<SquaredEuclidean>(place, two)[1].distance;
    let sum: f64 = places.iter().map(|place| nearest(place).sqrt()).sum();
    Some(sum / places.len() as f64)
}
