//! Where a body ends, and which way it faces there.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use super::stencil::{Stencils, kernel};

/// Cosine of the half angle of a cone: on the surface is who sees no one in the one that opens away from the others.
const CONE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Others on all sides leave no more of their sum, as a fraction of their distances, than rounding.
const EVEN: f64 = 1e-6;
/// From which part of the greatest scatter of the ways a surface faces it has an edge there.
const EDGE: f64 = 0.1;

impl Stencils {
    /// For each of some particles the projector on the directions in which nothing but the body is there: all of an inner
    /// particle, those along the surface of one on it, at an edge those along the edge. `[B5]`
    pub(super) fn within(&self, positions: &[Vector3<f64>], of: &[usize]) -> Vec<Matrix3<f64>> {
        let mut near: Vec<usize> = of.iter().flat_map(|&i| self.ring(i)).collect();
        near.sort_unstable();
        near.dedup();
        let faces = near.par_iter().map(|&i| self.face(i, positions));
        let faces: Vec<_> = faces.collect();
        let face = |i: usize| faces[near.binary_search(&i).expect("of the rings")];
        let within = of.par_iter().map(|&i| {
            let Some(facing) = face(i) else {
                return Matrix3::identity();
            };
            let mut scatter = Matrix3::zeros();
            for (other, weight) in self.around(i, positions) {
                if let Some(face) = face(other) {
                    scatter += face * face.transpose() * weight;
                }
            }
            let SymmetricEigen {
                eigenvectors,
                eigenvalues,
            } = scatter.symmetric_eigen();
            let bar = EDGE * eigenvalues.max();
            let open = (0..3).filter(|&k| eigenvalues[k] > bar);
            let open: Vec<_> = open.map(|k| eigenvectors.column(k)).collect();
            let closed = |normal: Vector3<f64>| normal * normal.transpose();
            if open.len() > 1 {
                Matrix3::identity()
                    - open
                        .iter()
                        .map(|k| closed(k.into_owned()))
                        .sum::<Matrix3<f64>>()
            } else {
                Matrix3::identity() - closed(facing)
            }
        });
        within.collect()
    }

    /// The unit vector that points out of the body, of a particle on its surface.
    fn face(&self, i: usize, positions: &[Vector3<f64>]) -> Option<Vector3<f64>> {
        if self.is_inner(i, positions) {
            return None;
        }
        let around = self.around(i, positions).into_iter();
        let away: Vector3<f64> = around
            .map(|(other, weight)| (positions[i] - positions[other]) * weight)
            .sum();
        away.try_normalize(0.0)
    }

    /// Whether the particles around one are on all sides; where there are few, with those that they see.
    fn is_inner(&self, i: usize, positions: &[Vector3<f64>]) -> bool {
        let seen = |i: usize| self.row(i).map(|slot| self.other[slot] as usize);
        let (mut away, mut reach) = (Vector3::zeros(), 0.0);
        for slot in self.row(i) {
            let x = positions[self.other[slot] as usize] - positions[i];
            away -= x * self.share[slot];
            reach += x.norm() * self.share[slot];
        }
        let bar = CONE * away.norm();
        let faces = |j: usize| {
            let x = positions[j] - positions[i];
            x.dot(&away) > bar * x.norm()
        };
        bar <= EVEN * reach || seen(i).any(faces) || seen(i).flat_map(seen).any(faces)
    }

    /// A particle, those that it sees and those that they see, ascending.
    fn ring(&self, i: usize) -> Vec<usize> {
        let seen = |i: usize| self.row(i).map(|slot| self.other[slot] as usize);
        let mut ring: Vec<usize> = seen(i).flat_map(seen).chain(seen(i)).collect();
        ring.push(i);
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// The ring with weights that fall off over twice the reach: one by one, the ways that points of an irregular surface
    /// face are too noisy.
    fn around(&self, i: usize, positions: &[Vector3<f64>]) -> Vec<(usize, f64)> {
        let reach = 2.0 * self.sight[i].reach;
        let weigh = |j: usize| (j, kernel((positions[j] - positions[i]).norm(), reach));
        self.ring(i).into_iter().map(weigh).collect()
    }
}
