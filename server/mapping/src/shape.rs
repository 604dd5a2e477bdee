use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::blocks::for_each_block;
use crate::clusters::Clusters;
use crate::quadratic::{Bend, Quadratic};
use crate::rotation;

/// Clusters per task; a fit costs about as much as posing a hundred vertices.
const FITS: usize = 64;

/// Directions in which points spread by less than the square root of this, relative to the widest, count as unseen.
const UNSEEN: f64 = 1e-9;

/// One motion per cluster, `x = c + R (x⁰ − c⁰)`, with c the centroid of its points `[M4]`; or with a linear `[M8]` or
/// quadratic `[M9]` map in place of R.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    clusters: Clusters,
    /// x⁰ − c⁰ per vertex.
    offsets: Vec<Vector3<f64>>,
    /// p⁰ − c⁰ per member of each cluster.
    arms: Vec<Vector3<f64>>,
    /// Σ|p⁰ − c⁰|² per cluster.
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

/// Which map fits the points of a cluster.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fit {
    Rigid,
    Linear { beta: f64 },
    Quadratic { beta: f64 },
}

/// How a cluster sees directions at rest. `[M8]`
#[derive(Clone, Debug)]
struct Stretch {
    /// The pseudo-inverse of Σ (p⁰ − c⁰)(p⁰ − c⁰)ᵀ.
    inverse: Matrix3<f64>,
    /// The projection onto the directions in which the points do not spread.
    unseen: Matrix3<f64>,
}

impl Stretch {
    fn new(arms: &[Vector3<f64>]) -> Self {
        let spread: Matrix3<f64> = arms.iter().map(|arm| arm * arm.transpose()).sum();
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
    pub(crate) fn new(
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        clusters: Clusters,
        fit: Fit,
    ) -> Self {
        let mut arms = Vec::with_capacity(clusters.members.len());
        let mut spreads = Vec::new();
        let mut centroids = Vec::new();
        for set in clusters.sets() {
            let center = Center::of(set, points);
            let start = arms.len();
            arms.extend(set.iter().map(|&j| center.arm(&points[j as usize])));
            spreads.push(arms[start..].iter().map(Vector3::norm_squared).sum());
            centroids.push(center.centroid());
        }
        let arms_of = |cluster: usize| &arms[clusters.first[cluster]..clusters.first[cluster + 1]];
        let stretches = || {
            (0..centroids.len())
                .map(|c| Stretch::new(arms_of(c)))
                .collect()
        };
        let mode = match fit {
            Fit::Rigid => Mode::Rigid,
            Fit::Linear { beta } => Mode::Linear {
                beta,
                stretches: stretches(),
            },
            Fit::Quadratic { beta } => Mode::Quadratic {
                beta,
                stretches: stretches(),
                quadratics: (0..centroids.len())
                    .map(|c| Quadratic::new(arms_of(c)))
                    .collect(),
                bends: vec![Bend::default(); centroids.len()],
            },
        };
        let offset = |(x, &c): (&Vector3<f64>, &u32)| x - centroids[c as usize];
        Self {
            offsets: vertices
                .iter()
                .zip(&clusters.of_vertex)
                .map(offset)
                .collect(),
            arms,
            spreads,
            rotations: vec![UnitQuaternion::identity(); centroids.len()],
            motions: vec![Motion([[0.0; 4]; 4]); centroids.len()],
            mode,
            clusters,
        }
    }

    pub(crate) fn rotations(&self) -> &[UnitQuaternion<f64>] {
        &self.rotations
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

    fn fit(&mut self, points: &[Vector3<f64>]) {
        let Self {
            clusters,
            arms,
            spreads,
            rotations,
            motions,
            mode,
            offsets: _,
        } = self;
        let set = |cluster: usize| {
            let range = clusters.first[cluster]..clusters.first[cluster + 1];
            (&clusters.members[range.clone()], &arms[range])
        };
        let rigid = |cluster: usize, rotation: &mut UnitQuaternion<f64>| {
            let (set, arms) = set(cluster);
            let center = Center::of(set, points);
            let mut covariance = Matrix3::zeros(); // [M2]
            let mut spread = 0.0;
            for (&j, rest) in set.iter().zip(arms) {
                let now = center.arm(&points[j as usize]);
                covariance += now * rest.transpose();
                spread += now.norm_squared();
            }
            let size = spread.sqrt() * spreads[cluster].sqrt();
            *rotation = rotation::fit(&covariance, size, rotation);
            (center, covariance, *rotation.to_rotation_matrix().matrix())
        };
        let pairs = (rotations, motions);
        match mode {
            Mode::Rigid => for_each_cluster(pairs, |cluster, (rotation, motion)| {
                let (center, _, r) = rigid(cluster, rotation);
                *motion = Motion::new(&r, center.centroid());
            }),
            Mode::Linear { beta, stretches } => {
                for_each_cluster(pairs, |cluster, (rotation, motion)| {
                    let (center, covariance, r) = rigid(cluster, rotation);
                    let linear = stretches[cluster].fit(&covariance, &r);
                    *motion = Motion::new(&blend(&r, &linear, *beta), center.centroid());
                });
            }
            Mode::Quadratic {
                beta,
                stretches,
                quadratics,
                bends,
            } => {
                let (rotations, motions) = pairs;
                let all = (rotations, motions, bends);
                for_each_cluster(all, |cluster, (rotation, motion, bend)| {
                    let (center, covariance, r) = rigid(cluster, rotation);
                    let linear = stretches[cluster].fit(&covariance, &r);
                    let (set, arms) = set(cluster);
                    let now = set.iter().map(|&j| center.arm(&points[j as usize]));
                    let fitted = quadratics[cluster].fit(&linear, arms.iter().zip(now));
                    let linear = blend(&r, &(linear + fitted.linear), *beta);
                    *motion = Motion::new(&linear, center.centroid() + fitted.shift * *beta);
                    *bend = fitted.bend.scaled(*beta);
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

/// Calls `fit` for each entry of columns that have one per cluster, on the threads of the current pool if that is worth
/// it. No cluster sees another.
fn for_each_cluster<Columns>(columns: Columns, fit: impl Fn(usize, Columns::Item) + Sync + Send)
where
    Columns: IntoParallelIterator<Iter: IndexedParallelIterator>,
{
    (columns.into_par_iter().enumerate())
        .with_min_len(FITS)
        .for_each(|(cluster, entries)| fit(cluster, entries));
}

/// The centroid of a set of points, as a point of the set and the mean of the others' offsets from it.
///
/// Differences of near positions are exact, so a set far from the origin loses nothing, and the arms of coincident
/// points are exactly zero.
struct Center {
    base: Vector3<f64>,
    mean: Vector3<f64>,
}

impl Center {
    fn of(set: &[u32], points: &[Vector3<f64>]) -> Self {
        let at = |j: &u32| points[*j as usize];
        let base = set.first().map_or_else(Vector3::zeros, at);
        let sum: Vector3<f64> = set.iter().map(|j| at(j) - base).sum();
        Self {
            base,
            mean: sum / set.len().max(1) as f64,
        }
    }

    fn arm(&self, point: &Vector3<f64>) -> Vector3<f64> {
        (point - self.base) - self.mean
    }

    fn centroid(&self) -> Vector3<f64> {
        self.base + self.mean
    }
}
