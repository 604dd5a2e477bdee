use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::blocks::for_each_block;
use crate::clusters::Clusters;
use crate::lanes::LANES;
use crate::moments::{Place, Sums, sums};
use crate::quadratic::{Bend, Quadratic};
use crate::rotation::Moments;
use crate::{Fit, rotation};

/// Clusters per task; a fit costs about as much as posing a hundred vertices.
const FITS: usize = LANES;

/// Directions in which points spread by less than the square root of this, relative to the widest, count as unseen.
const UNSEEN: f64 = 1e-9;

/// One motion per cluster, `x = c + R (x⁰ − c⁰)`, with c the centroid of its points `[M4]`; or with a linear `[M8]` or
/// quadratic `[M9]` map in place of R.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    clusters: Arc<Clusters>,
    /// x⁰ − c⁰ per vertex.
    offsets: Vec<Vector3<f64>>,
    /// ω per member of each cluster; those of a cluster sum to 1.
    shares: Vec<f64>,
    /// p⁰ − c⁰ per member of each cluster.
    arms: Vec<Vector3<f64>>,
    /// Σ ω |p⁰ − c⁰|² per cluster.
    spreads: Vec<f64>,
    /// The last one per cluster. Where the points leave the rotation open, the next starts from it.
    rotations: Vec<UnitQuaternion<f64>>,
    /// This step's, one per cluster: kept between steps for its memory only.
    motions: Vec<Motion>,
    mode: Mode,
}

/// What a cluster may do beside turning.
#[derive(Clone, Debug)]
enum Mode {
    Rigid,
    Linear {
        beta: f64,
        stretches: Vec<Stretch>,
    },
    Quadratic {
        beta: f64,
        stretches: Vec<Stretch>,
        quadratics: Vec<Quadratic>,
        /// This step's, one per cluster: kept between steps for its memory only.
        bends: Vec<Bend>,
    },
}

/// How points see directions at rest. `[M8]`
#[derive(Clone, Debug)]
pub(crate) struct Stretch {
    /// The pseudo-inverse of Σ ω (p⁰ − c⁰)(p⁰ − c⁰)ᵀ.
    pub(crate) inverse: Matrix3<f64>,
    /// The projection onto the directions in which the points do not spread.
    unseen: Matrix3<f64>,
}

impl Stretch {
    /// Of `spread`, Σ ω (p⁰ − c⁰)(p⁰ − c⁰)ᵀ.
    pub(crate) fn new(spread: Matrix3<f64>) -> Self {
        let eigen = spread.symmetric_eigen();
        let least = (UNSEEN * eigen.eigenvalues.max()).max(f64::MIN_POSITIVE);
        let (mut inverse, mut unseen) = (Matrix3::zeros(), Matrix3::zeros());
        for (&value, axis) in (eigen.eigenvalues.iter()).zip(eigen.eigenvectors.column_iter()) {
            let onto = axis * axis.transpose();
            if value > least {
                inverse += onto / value;
            } else {
                unseen += onto;
            }
        }
        Self { inverse, unseen }
    }

    /// The affine map that fits best; where the points do not say, R. `[M8]`
    fn fit(&self, covariance: &Matrix3<f64>, rotation: &Matrix3<f64>) -> Matrix3<f64> {
        covariance * self.inverse + rotation * self.unseen
    }
}

/// The columns of R or the map in its place, then c, each with a zero: four full vectors, so that posing a vertex is a few vector operations.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Motion([[f64; 4]; 4]);

impl Motion {
    pub(crate) fn new(linear: &Matrix3<f64>, centroid: Vector3<f64>) -> Self {
        let column = |i: usize| linear.column(i).into_owned();
        let columns = [column(0), column(1), column(2), centroid];
        Self(columns.map(|v| [v.x, v.y, v.z, 0.0]))
    }

    /// `c + R offset` `[M4]`
    pub(crate) fn apply(&self, offset: &Vector3<f64>) -> Vector3<f64> {
        let Self([x, y, z, c]) = self;
        let mut moved = [0.0; 4];
        for axis in 0..4 {
            moved[axis] = (x[axis] * offset.x + y[axis] * offset.y) + z[axis] * offset.z + c[axis];
        }
        Vector3::new(moved[0], moved[1], moved[2])
    }
}

impl Shape {
    /// One motion per cluster, each of whose members has a share in it; the shares of a cluster sum to 1.
    pub(crate) fn new(
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        clusters: Arc<Clusters>,
        shares: Vec<f64>,
        fit: Fit,
    ) -> Self {
        let count = clusters.first.len() - 1;
        let mut arms = Vec::with_capacity(clusters.members.len());
        let (mut spreads, mut centroids) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (set, shares) in clusters.sets().zip(clusters.columns(&shares)) {
            let center = Center::of(set, shares, points);
            let start = arms.len();
            arms.extend(set.iter().map(|&j| center.arm(&points[j as usize])));
            let sizes = arms[start..].iter().map(Vector3::norm_squared);
            spreads.push(
                shares
                    .iter()
                    .zip(sizes)
                    .map(|(share, size)| share * size)
                    .sum(),
            );
            centroids.push(center.centroid());
        }
        let of_clusters = || clusters.columns(&arms).zip(clusters.columns(&shares));
        let stretch = |(arms, shares): (&[Vector3<f64>], &[f64])| {
            let arms = arms.iter().zip(shares);
            Stretch::new(
                arms.map(|(arm, share)| arm * arm.transpose() * *share)
                    .sum(),
            )
        };
        let mode = match fit {
            Fit::Rigid => Mode::Rigid,
            Fit::Linear { beta } => Mode::Linear {
                beta,
                stretches: of_clusters().map(stretch).collect(),
            },
            Fit::Quadratic { beta } => Mode::Quadratic {
                beta,
                stretches: of_clusters().map(stretch).collect(),
                quadratics: of_clusters()
                    .map(|(arms, shares)| Quadratic::new(arms, shares))
                    .collect(),
                bends: vec![Bend::default(); count],
            },
        };
        let offset = |(x, &c): (&Vector3<f64>, &u32)| x - centroids[c as usize];
        Self {
            offsets: vertices
                .iter()
                .zip(&clusters.of_vertex)
                .map(offset)
                .collect(),
            shares,
            arms,
            spreads,
            rotations: vec![UnitQuaternion::identity(); count],
            motions: vec![Motion([[0.0; 4]; 4]); count],
            mode,
            clusters,
        }
    }

    /// The points of a vertex's cluster with their shares in its fit, by index.
    pub(crate) fn row(&self, vertex: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let cluster = self.clusters.of_vertex[vertex] as usize;
        let range = self.clusters.first[cluster]..self.clusters.first[cluster + 1];
        let members = self.clusters.members[range.clone()].iter().copied();
        members.zip(self.shares[range].iter().copied())
    }

    /// The vertices that move with this one: the first of them, and how many there are.
    pub(crate) fn companions(&self, vertex: usize) -> Option<(usize, usize)> {
        let own = self.clusters.of_vertex[vertex];
        let of_vertex = self.clusters.of_vertex.iter().enumerate();
        let mut same = of_vertex.filter(|(_, cluster)| **cluster == own);
        let (first, _) = same.next()?;
        Some((first, 1 + same.count()))
    }

    /// Of each vertex of a shape of the same points, the own cluster that has the same of them; `None` where there is
    /// none.
    pub(crate) fn homes(&self, some: &Self) -> Option<Vec<u32>> {
        let found: Option<Vec<u32>> = some
            .clusters
            .sets()
            .map(|set| self.clusters.find(set))
            .collect();
        let found = found?;
        let of_vertex = some.clusters.of_vertex.iter();
        Some(of_vertex.map(|&cluster| found[cluster as usize]).collect())
    }

    /// Appends the vertices of a shape of the same points: to own clusters as [`Self::homes`] tells, or with clusters of
    /// their own where `homes` is empty.
    pub(crate) fn append(&mut self, some: Self, homes: &[u32]) {
        let Self {
            clusters,
            offsets,
            shares,
            arms,
            spreads,
            rotations,
            motions,
            mode: _,
        } = some;
        self.offsets.extend(offsets);
        let own = Arc::make_mut(&mut self.clusters);
        if !homes.is_empty() {
            own.of_vertex.extend(homes);
            return;
        }
        own.append(&clusters);
        self.shares.extend(shares);
        self.arms.extend(arms);
        self.spreads.extend(spreads);
        self.rotations.extend(rotations);
        self.motions.extend(motions);
    }

    /// Goes on from the rotations of the shape before, where vertices that it had still have the same points.
    pub(crate) fn go_on(&mut self, before: &Self) {
        for vertex in 0..before.offsets.len() {
            let [here, there] = [&self.clusters, &before.clusters].map(|clusters| {
                let cluster = clusters.of_vertex[vertex] as usize;
                let set = &clusters.members[clusters.first[cluster]..clusters.first[cluster + 1]];
                (cluster, set)
            });
            if here.1 == there.1 {
                self.rotations[here.0] = before.rotations[there.0];
            }
        }
    }

    pub(crate) fn rotations(&self) -> &[UnitQuaternion<f64>] {
        &self.rotations
    }

    pub(crate) fn cluster(&self, vertex: usize) -> u32 {
        self.clusters.of_vertex[vertex]
    }

    /// `√(Σ ω |p − c − R (p⁰ − c⁰)|² / Σ ω |p⁰ − c⁰|²)` per cluster; 0 where its points do not spread. `[E2]`
    pub(crate) fn strains(&self, points: &[Vector3<f64>]) -> Vec<f64> {
        let strain = |cluster: usize| {
            let range = self.clusters.first[cluster]..self.clusters.first[cluster + 1];
            let set = &self.clusters.members[range.clone()];
            let (shares, arms) = (&self.shares[range.clone()], &self.arms[range]);
            let center = Center::of(set, shares, points);
            let rotation = self.rotations[cluster].to_rotation_matrix();
            let left = |(&j, rest): (&u32, &Vector3<f64>)| {
                (center.arm(&points[j as usize]) - rotation * rest).norm_squared()
            };
            let left = set.iter().zip(arms).map(left).zip(shares);
            let left: f64 = left.map(|(left, share)| share * left).sum();
            match self.spreads[cluster] {
                spread if spread > 0.0 => (left / spread).sqrt(),
                _ => 0.0,
            }
        };
        let clusters = (0..self.rotations.len()).into_par_iter();
        clusters.with_min_len(FITS).map(strain).collect()
    }

    pub(crate) fn pose(&mut self, points: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        self.fit(points);
        let (motions, offsets, of_vertex) =
            (&self.motions, &self.offsets, &self.clusters.of_vertex);
        for_each_block(out, |first, out| {
            let range = first..first + out.len();
            let vertices = offsets[range.clone()].iter().zip(&of_vertex[range]);
            match &self.mode {
                Mode::Rigid | Mode::Linear { .. } => {
                    for (out, (offset, &cluster)) in out.iter_mut().zip(vertices) {
                        *out = motions[cluster as usize].apply(offset);
                    }
                }
                Mode::Quadratic { bends, .. } => {
                    for (out, (offset, &cluster)) in out.iter_mut().zip(vertices) {
                        let cluster = cluster as usize;
                        *out = motions[cluster].apply(offset) + bends[cluster].apply(offset);
                    }
                }
            }
        });
    }

    /// These vertices, by the motions of the last pose.
    pub(crate) fn pose_alone(&self, vertices: &[u32], out: &mut [Vector3<f64>]) {
        for vertex in vertices.iter().map(|&vertex| vertex as usize) {
            let cluster = self.clusters.of_vertex[vertex] as usize;
            let offset = &self.offsets[vertex];
            out[vertex] = match &self.mode {
                Mode::Rigid | Mode::Linear { .. } => self.motions[cluster].apply(offset),
                Mode::Quadratic { bends, .. } => {
                    self.motions[cluster].apply(offset) + bends[cluster].apply(offset)
                }
            };
        }
    }

    fn fit(&mut self, points: &[Vector3<f64>]) {
        let Self {
            clusters,
            shares,
            arms,
            spreads,
            rotations,
            motions,
            mode,
            offsets: _,
        } = self;
        let places: Vec<Place> = points.iter().map(Place::new).collect();
        let set = |cluster: usize| {
            let range = clusters.first[cluster]..clusters.first[cluster + 1];
            (
                &clusters.members[range.clone()],
                &shares[range.clone()],
                &arms[range],
            )
        };
        let rigid = |first: usize, rotations: &mut [UnitQuaternion<f64>]| {
            let fits: Vec<(Center, Moments)> = (first..first + rotations.len())
                .map(|cluster| moments(set(cluster), spreads[cluster], &places))
                .collect();
            rotation::fit(fits.iter().map(|(_, moments)| moments), rotations);
            let matrices = rotations.iter().map(|r| *r.to_rotation_matrix().matrix());
            let fits = fits.into_iter().zip(matrices);
            fits.map(|((center, moments), r)| (center, moments.covariance, r))
                .collect::<Vec<_>>()
        };
        let rotations = rotations.par_chunks_mut(FITS);
        let motions = motions.par_chunks_mut(FITS);
        match mode {
            Mode::Rigid => for_each_chunk((rotations, motions), |first, (rotations, motions)| {
                for ((center, _, r), motion) in rigid(first, rotations).iter().zip(motions) {
                    *motion = Motion::new(r, center.centroid());
                }
            }),
            Mode::Linear { beta, stretches } => {
                for_each_chunk((rotations, motions), |first, (rotations, motions)| {
                    let fits = rigid(first, rotations).into_iter().zip(&stretches[first..]);
                    for (((center, covariance, r), stretch), motion) in fits.zip(motions) {
                        let linear = stretch.fit(&covariance, &r);
                        *motion = Motion::new(&blend(&r, &linear, *beta), center.centroid());
                    }
                });
            }
            Mode::Quadratic {
                beta,
                stretches,
                quadratics,
                bends,
            } => {
                let all = (rotations, motions, bends.par_chunks_mut(FITS));
                for_each_chunk(all, |first, (rotations, motions, bends)| {
                    let fits = (first..).zip(rigid(first, rotations));
                    let results = motions.iter_mut().zip(bends);
                    for ((cluster, (center, covariance, r)), (motion, bend)) in fits.zip(results) {
                        let linear = stretches[cluster].fit(&covariance, &r);
                        let (set, shares, arms) = set(cluster);
                        let now = set.iter().map(|&j| center.arm(&points[j as usize]));
                        let pairs = shares.iter().zip(arms).zip(now);
                        let fitted = quadratics[cluster].fit(&linear, pairs);
                        let linear = blend(&r, &(linear + fitted.linear), *beta);
                        *motion = Motion::new(&linear, center.centroid() + fitted.shift * *beta);
                        *bend = fitted.bend.scaled(*beta);
                    }
                });
            }
        }
    }

    /// Bytes that a pose reads and writes, each array once, this step's twice.
    pub(crate) fn bytes(&self) -> usize {
        let mode = match &self.mode {
            Mode::Rigid => 0,
            Mode::Linear { stretches, .. } => size_of_val(&**stretches),
            Mode::Quadratic {
                stretches,
                quadratics,
                bends,
                ..
            } => size_of_val(&**stretches) + size_of_val(&**quadratics) + 2 * size_of_val(&**bends),
        };
        2 * size_of_val(&*self.offsets)
            + size_of_val(&*self.clusters.of_vertex)
            + size_of_val(&*self.clusters.first)
            + size_of_val(&*self.clusters.members)
            + size_of_val(&*self.shares)
            + size_of_val(&*self.arms)
            + size_of_val(&*self.spreads)
            + 2 * size_of_val(&*self.rotations)
            + 2 * size_of_val(&*self.motions)
            + mode
    }
}

/// `β A + (1 − β) R` `[M8]`
fn blend(rotation: &Matrix3<f64>, linear: &Matrix3<f64>, beta: f64) -> Matrix3<f64> {
    linear * beta + rotation * (1.0 - beta)
}

/// The centre and the moments of a cluster's points, for which it has members, shares and arms; `spread` is that at rest.
fn moments(
    (set, shares, arms): (&[u32], &[f64], &[Vector3<f64>]),
    spread: f64,
    places: &[Place],
) -> (Center, Moments) {
    let Sums {
        base,
        mean,
        covariance,
        squares,
    } = sums(set, shares, arms, places);
    let covariance = Matrix3::from_columns(&covariance); // [M2]
    let size = ((squares - mean.norm_squared()) * spread).max(0.0).sqrt();
    (Center { base, mean }, Moments { covariance, size })
}

/// Calls `fit` with the first cluster of each chunk and its part of columns that have an entry per cluster, on the threads
/// of the current pool. No chunk sees another.
fn for_each_chunk<Columns>(columns: Columns, fit: impl Fn(usize, Columns::Item) + Sync + Send)
where
    Columns: IntoParallelIterator<Iter: IndexedParallelIterator>,
{
    (columns.into_par_iter().enumerate()).for_each(|(chunk, entries)| fit(chunk * FITS, entries));
}

/// The weighted centroid of a set of points, as a point of the set and the mean of the others' offsets from it.
///
/// Differences of near positions are exact, so a set far from the origin loses nothing, and the arms of coincident
/// points are exactly zero.
struct Center {
    base: Vector3<f64>,
    mean: Vector3<f64>,
}

impl Center {
    /// Of points with shares that sum to 1.
    fn of(set: &[u32], shares: &[f64], points: &[Vector3<f64>]) -> Self {
        let at = |j: &u32| points[*j as usize];
        let base = set.first().map_or_else(Vector3::zeros, at);
        let offsets = set
            .iter()
            .zip(shares)
            .map(|(j, &share)| (at(j) - base) * share);
        Self {
            base,
            mean: offsets.sum(),
        }
    }

    fn arm(&self, point: &Vector3<f64>) -> Vector3<f64> {
        (point - self.base) - self.mean
    }

    fn centroid(&self) -> Vector3<f64> {
        self.base + self.mean
    }
}
