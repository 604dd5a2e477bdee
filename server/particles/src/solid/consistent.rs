//! Derivatives under which a constant stress pushes no inner particle, so that irregular clouds converge, too.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::stencil::Stencils;

/// What is left of the pushes, as a fraction of their start, and the most iterations.
const ENOUGH: f64 = 1e-12;
const ITERATIONS: usize = 200;

impl Stencils {
    /// Adds to the gradients what shows them curved fields, and then the least that makes `Σ_i (V_i g_ij − V_j g_ji)` vanish
    /// in every direction in which nothing but the body is there. No derivative of a linear field changes. `[B5]`
    pub(super) fn make_consistent(&mut self, positions: &[Vector3<f64>], volumes: &[f64]) {
        let curvature = self.curvature(positions);
        let equations = Equations {
            stencils: self,
            positions,
            scale: self.scales(volumes),
            within: self.within(positions),
        };
        let pushes = equations.pushes(volumes, &curvature);
        let multipliers = equations.solve(&pushes);
        let corrections = equations.corrections(&multipliers);
        for (i, scale) in volumes.iter().enumerate() {
            for slot in self.row(i) {
                self.gradient[slot] += curvature[slot] + corrections[slot] / *scale;
            }
        }
    }

    /// `w V²` of every slot, in units of the row's kernel.
    fn scales(&self, volumes: &[f64]) -> Vec<f64> {
        let mut scales = Vec::with_capacity(self.share.len());
        for (i, sight) in self.sight.iter().enumerate() {
            let square = sight.weight * volumes[i] * volumes[i];
            scales.extend(self.row(i).map(|slot| self.share[slot] * square));
        }
        scales
    }
}

/// The normal equations of the multipliers, one vector per particle: symmetric, and positive where a multiplier is no
/// linear function of place.
struct Equations<'a> {
    stencils: &'a Stencils,
    positions: &'a [Vector3<f64>],
    /// Per slot.
    scale: Vec<f64>,
    /// The directions that a multiplier may have.
    within: Vec<Matrix3<f64>>,
}

impl Equations<'_> {
    /// What is to vanish.
    fn pushes(&self, volumes: &[f64], curvature: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut pushes = vec![Vector3::zeros(); self.within.len()];
        for (i, volume) in volumes.iter().enumerate() {
            for slot in self.stencils.row(i) {
                let push = (self.stencils.gradient[slot] + curvature[slot]) * *volume;
                pushes[self.stencils.other[slot] as usize] += push;
                pushes[i] -= push;
            }
        }
        let pairs = pushes.iter().zip(&self.within);
        pairs.map(|(push, within)| within * push).collect()
    }

    /// What the multipliers add to `V_i g_ij`: what their linear part leaves.
    fn corrections(&self, multipliers: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let Self {
            stencils,
            positions,
            scale,
            ..
        } = self;
        let rows = (0..multipliers.len()).into_par_iter();
        let slots = rows.flat_map_iter(|i| {
            let linear = stencils.derivative(i, multipliers);
            stencils.row(i).map(move |slot| {
                let j = stencils.other[slot] as usize;
                let difference = multipliers[j] - multipliers[i];
                (difference - linear * (positions[j] - positions[i])) * scale[slot]
            })
        });
        slots.collect()
    }

    fn apply(&self, multipliers: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let corrections = self.corrections(multipliers);
        let stencils = self.stencils;
        let rows = (0..multipliers.len()).into_par_iter();
        let sums = rows.map(|i| {
            let arriving: Vector3<f64> = stencils.into(i).map(|slot| corrections[slot]).sum();
            let leaving: Vector3<f64> = stencils.row(i).map(|slot| corrections[slot]).sum();
            self.within[i] * (arriving - leaving)
        });
        sums.collect()
    }

    /// The multipliers that take back the pushes, by conjugate gradients.
    fn solve(&self, pushes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let n = pushes.len();
        let mut diagonal = vec![0.0; n];
        for i in 0..n {
            for slot in self.stencils.row(i) {
                diagonal[i] += self.scale[slot];
                diagonal[self.stencils.other[slot] as usize] += self.scale[slot];
            }
        }
        let conditioned = |residual: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            let pairs = residual.iter().zip(&diagonal);
            pairs
                .map(|(r, &d)| if d > 0.0 { r / d } else { Vector3::zeros() })
                .collect()
        };
        let mut x = vec![Vector3::zeros(); n];
        let mut residual: Vec<_> = pushes.iter().map(|push| -push).collect();
        let mut direction = conditioned(&residual);
        let mut size = dot(&residual, &direction);
        let enough = size * (ENOUGH * ENOUGH);
        for _ in 0..ITERATIONS {
            if size <= enough {
                break;
            }
            let product = self.apply(&direction);
            let step = size / dot(&direction, &product);
            for i in 0..n {
                x[i] += direction[i] * step;
                residual[i] -= product[i] * step;
            }
            let next = conditioned(&residual);
            let smaller = dot(&residual, &next);
            for (direction, next) in direction.iter_mut().zip(&next) {
                *direction = next + *direction * (smaller / size);
            }
            size = smaller;
        }
        x
    }
}

/// The product of two columns of vectors.
fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
