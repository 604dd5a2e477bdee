use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::blocks::for_each_block;
use crate::clusters::Clusters;
use crate::rotation;

/// Clusters per task; a fit costs about as much as posing a hundred vertices.
const FITS: usize = 64;

/// One rigid motion per cluster, `x = c + R (x⁰ − c⁰)`, with c the centroid of its points. `[M4]`
#[derive(Clone, Debug)]
pub(crate) struct Rigid {
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
}

/// The columns of R, then c, each with a zero: four full vectors, so that posing a vertex is a few vector operations.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Motion([[f64; 4]; 4]);

impl Motion {
    fn new(rotation: &UnitQuaternion<f64>, centroid: Vector3<f64>) -> Self {
        let rotation = rotation.to_rotation_matrix();
        let column = |i: usize| rotation.matrix().column(i).into_owned();
        let columns = [column(0), column(1), column(2), centroid];
        Self(columns.map(|v| [v.x, v.y, v.z, 0.0]))
    }

    /// `c + R offset` `[M4]`
    fn apply(&self, offset: &Vector3<f64>) -> Vector3<f64> {
        let Self([x, y, z, c]) = self;
        let mut moved = [0.0; 4];
        for axis in 0..4 {
            moved[axis] = (x[axis] * offset.x + y[axis] * offset.y) + z[axis] * offset.z + c[axis];
        }
        Vector3::new(moved[0], moved[1], moved[2])
    }
}

impl Rigid {
    pub(crate) fn new(
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        clusters: Clusters,
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
            for (out, (offset, &cluster)) in out.iter_mut().zip(vertices) {
                *out = motions[cluster as usize].apply(offset);
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
            offsets: _,
        } = self;
        let fit = |cluster: usize, rotation: &mut UnitQuaternion<f64>, motion: &mut Motion| {
            let range = clusters.first[cluster]..clusters.first[cluster + 1];
            let set = &clusters.members[range.clone()];
            let center = Center::of(set, points);
            let mut covariance = Matrix3::zeros(); // [M2]
            let mut spread = 0.0;
            for (&j, rest) in set.iter().zip(&arms[range]) {
                let now = center.arm(&points[j as usize]);
                covariance += now * rest.transpose();
                spread += now.norm_squared();
            }
            let size = spread.sqrt() * spreads[cluster].sqrt();
            *rotation = rotation::fit(&covariance, size, rotation);
            *motion = Motion::new(rotation, center.centroid());
        };
        if rotations.len() >= 4 * FITS && rayon::current_num_threads() > 1 {
            (rotations.par_iter_mut().zip(motions))
                .enumerate()
                .with_min_len(FITS)
                .for_each(|(cluster, (rotation, motion))| fit(cluster, rotation, motion));
        } else {
            for (cluster, (rotation, motion)) in rotations.iter_mut().zip(motions).enumerate() {
                fit(cluster, rotation, motion);
            }
        }
    }

    /// Bytes that a pose reads and writes, each array once, the motions twice.
    pub(crate) fn bytes(&self) -> usize {
        2 * size_of_val(&*self.offsets)
            + size_of_val(&*self.clusters.of_vertex)
            + size_of_val(&*self.clusters.first)
            + size_of_val(&*self.clusters.members)
            + size_of_val(&*self.arms)
            + size_of_val(&*self.spreads)
            + 2 * size_of_val(&*self.rotations)
            + 2 * size_of_val(&*self.motions)
    }
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
