//! Which particles lie near which at rest.

use std::collections::BTreeSet;

use kiddo::{SquaredEuclidean, immutable::float::kdtree::ImmutableKdTree};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{Dimension, Metric, Reach};

/// Balls are closed: a lattice's neighbours at exactly the reach are in, whatever the rounding.
pub(super) const CLOSED: f64 = 1.0 + 1e-12;
/// Of the tie break among cheapest paths, in favour of the shorter one.
const TIE: f64 = 1e-9;

/// Places to find neighbours in.
#[derive(Clone, Debug)]
pub(super) struct Places {
    pub(super) positions: Vec<Vector3<f64>>,
    tree: ImmutableKdTree<f64, u64, 3, 32>,
}

/// Arcs between particles within reach of each other, both ways, ascending in each row.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    pub(super) start: Vec<usize>,
    pub(super) arcs: Vec<Arc>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    pub(super) to: u32,
    /// m.
    pub(super) length: f64,
    /// What paths are compared by: no unit, or m where the metric is graded.
    pub(super) cost: f64,
}

impl Places {
    pub(super) fn new(positions: Vec<Vector3<f64>>) -> Self {
        let points: Vec<[f64; 3]> = positions.iter().map(|x| (*x).into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&points);
        Self { positions, tree }
    }

    /// The others within a closed ball around a particle, ascending, with their distances, m.
    pub(super) fn near(&self, i: usize, radius: f64) -> Vec<(u32, f64)> {
        let x = self.positions[i];
        let radius = radius * CLOSED;
        // A little wider than asked for, so that it does not matter whether the tree's balls are open.
        let within = (radius * CLOSED).powi(2);
        let found = self
            .tree
            .within_unsorted::<SquaredEuclidean>(&x.into(), within);
        let others = found.iter().filter_map(|found| {
            let other = u32::try_from(found.item).expect("particles are counted in 32 bits");
            let distance = (self.positions[other as usize] - x).norm();
            (other as usize != i && distance <= radius).then_some((other, distance))
        });
        let mut near: Vec<_> = others.collect();
        near.sort_unstable_by_key(|&(other, _)| other);
        near
    }

    /// The distance to the `dim`-th other particle, the median over the particle and the 2 `dim` around it, m; the median
    /// of all where that is 0. `[B3]`
    pub(super) fn spacings(&self, dimension: Dimension) -> Vec<f64> {
        let (count, dim) = (self.positions.len(), dimension.count());
        let asked = (2 * dim + 1).min(count).try_into();
        let Ok(asked) = asked else {
            return Vec::new();
        };
        let around: Vec<(f64, Vec<usize>)> = (0..count)
            .into_par_iter()
            .map(|i| {
                let place = self.positions[i].into();
                let found = self.tree.nearest_n::<SquaredEuclidean>(&place, asked);
                let mut found: Vec<_> = found.iter().map(|n| (n.distance, n.item)).collect();
                found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let width = found[dim.min(found.len() - 1)].0.sqrt();
                let items = found
                    .iter()
                    .map(|&(_, item)| usize::try_from(item).expect("an index of a particle"));
                (width, items.collect())
            })
            .collect();
        let of_rows = around
            .par_iter()
            .map(|(_, items)| median(items.iter().map(|&item| around[item].0).collect()));
        let mut spacings: Vec<f64> = of_rows.collect();
        let usual = median(spacings.iter().copied().filter(|&s| s > 0.0).collect());
        for spacing in &mut spacings {
            if *spacing == 0.0 {
                *spacing = usual;
            }
        }
        spacings
    }
}

/// Two particles, the lower index first.
pub(super) fn pair(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// 1 of nothing: a particle alone has some size.
fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 1.0;
    }
    values.sort_unstable_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 {
        values[half]
    } else {
        0.5 * (values[half - 1] + values[half])
    }
}

impl Reach {
    /// Of each particle, m.
    pub(super) fn of(self, spacings: &[f64]) -> Vec<f64> {
        match self {
            Self::Length(length) => vec![length; spacings.len()],
            Self::Spacings(times) => spacings.iter().map(|s| s * times).collect(),
        }
    }
}

impl Graph {
    /// Arcs where one of both ends reaches the other.
    pub(super) fn new(places: &Places, reach: &[f64], pricing: &Pricing) -> Self {
        let rows = (0..reach.len()).into_par_iter();
        let mut rows: Vec<Vec<(u32, f64)>> = rows.map(|i| places.near(i, reach[i])).collect();
        let mut one_way: Vec<(u32, u32, f64)> = Vec::new();
        for (i, row) in (0_u32..).zip(&rows) {
            let beyond = row.iter();
            let beyond = beyond.filter(|(j, length)| *length > reach[*j as usize] * CLOSED);
            one_way.extend(beyond.map(|&(j, length)| (j, i, length)));
        }
        for (j, i, length) in one_way {
            let row = &mut rows[j as usize];
            let at = row.partition_point(|&(other, _)| other < i);
            row.insert(at, (i, length));
        }
        let mut start = vec![0];
        start.extend(rows.iter().scan(0, |end, row| {
            *end += row.len();
            Some(*end)
        }));
        let shortest = rows.iter().flatten().map(|&(_, length)| length);
        let shortest = shortest.filter(|&l| l > 0.0).fold(f64::INFINITY, f64::min);
        let priced = rows.par_iter().enumerate().flat_map_iter(|(i, row)| {
            row.iter().map(move |&(to, length)| Arc {
                to,
                length,
                cost: pricing.cost(i, to as usize, length, shortest),
            })
        });
        Self {
            arcs: priced.collect(),
            start,
        }
    }

    /// Takes out the arcs between pairs, the lower index of each first.
    pub(super) fn sever(&mut self, pairs: &BTreeSet<[u32; 2]>) {
        let (mut kept, mut end) = (0, 0);
        for (i, from) in (0_u32..).zip(0..self.len()) {
            let row = end..self.start[from + 1];
            end = row.end;
            for slot in row {
                let arc = self.arcs[slot];
                if !pairs.contains(&pair(i, arc.to)) {
                    self.arcs[kept] = arc;
                    kept += 1;
                }
            }
            self.start[from + 1] = kept;
        }
        self.arcs.truncate(kept);
    }

    pub(super) fn row(&self, i: usize) -> &[Arc] {
        &self.arcs[self.start[i]..self.start[i + 1]]
    }

    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }
}

/// What an arc costs.
pub(super) struct Pricing<'a> {
    metric: Metric,
    spacings: &'a [f64],
    /// The greatest reach, m.
    reach: f64,
}

impl<'a> Pricing<'a> {
    pub(super) fn new(metric: Metric, spacings: &'a [f64], reach: &[f64]) -> Self {
        Self {
            metric,
            spacings,
            reach: reach.iter().copied().fold(0.0, f64::max),
        }
    }

    /// `[B1]`, `[B2]`
    fn cost(&self, i: usize, j: usize, length: f64, shortest: f64) -> f64 {
        match self.metric {
            Metric::Geodesic { exponent } => {
                // In units of the reach: 1 mm to the power of 15 would be lost beside 1 m.
                let tie = TIE * (shortest / self.reach).powf(exponent - 1.0);
                let length = length / self.reach;
                length.powf(exponent) + tie * length
            }
            Metric::Graded { gap, exponent } => {
                let spacing = self.spacings[i].max(self.spacings[j]);
                length * (length / (gap * spacing)).max(1.0).powf(exponent - 1.0)
            }
        }
    }
}
