//! Derivatives under which a constant stress pushes no inner particle, so that irregular clouds converge, too.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::stencil::Stencils;

/// Cosine of the half angle of a cone: on the surface is who sees no one in the one that opens away from the others.
const CONE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Others on all sides leave no more of their sum, as a fraction of their distances, than rounding.
const EVEN: f64 = 1e-6;
/// What is left of the pushes, as a fraction of their start, and the most iterations.
const ENOUGH: f64 = 1e-12;
const ITERATIONS: usize = 200;

impl Stencils {
    /// Adds to the gradients the least that makes `Σ_i (V_i g_ij − V_j g_ji)` vanish at inner particles, and changes no
    /// derivative of a linear field. `[B5]`
    pub(super) fn make_consistent(&mut self, positions: &[Vector3<f64>], volumes: &[f64]) {
        let inner = self.inner(positions);
        let equations = Equations {
            stencils: self,
            positions,
            scale: self.scales(volumes),
            inner,
        };
        let pushes = equations.pushes(volumes);
        let multipliers = equations.solve(&pushes);
        let corrections = equations.corrections(&multipliers);
        for (i, scale) in volumes.iter().enumerate() {
            for slot in self.row(i) {
                self.gradient[slot] += corrections[slot] / *scale;
            }
        }
    }

    /// Whether the particles around each are on all sides; where there are few, with those that they see.
    fn inner(&self, positions: &[Vector3<f64>]) -> Vec<bool> {
        let seen = |i: usize| self.row(i).map(|slot| self.other[slot] as usize);
        let inner = (0..self.sight.len()).into_par_iter().map(|i| {
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
        });
        inner.collect()
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

/// The normal equations of the multipliers, one vector per inner particle: symmetric, and positive where a multiplier is
/// no linear function of place.
struct Equations<'a> {
    stencils: &'a Stencils,
    positions: &'a [Vector3<f64>],
    /// Per slot.
    scale: Vec<f64>,
    inner: Vec<bool>,
}

impl Equations<'_> {
    /// What is to vanish.
    fn pushes(&self, volumes: &[f64]) -> Vec<Vector3<f64>> {
        let mut pushes = vec![Vector3::zeros(); self.inner.len()];
        for (i, volume) in volumes.iter().enumerate() {
            for slot in self.stencils.row(i) {
                let push = self.stencils.gradient[slot] * *volume;
                pushes[self.stencils.other[slot] as usize] += push;
                pushes[i] -= push;
            }
        }
        self.mask(&mut pushes);
        pushes
    }

    fn mask(&self, values: &mut [Vector3<f64>]) {
        for (value, inner) in values.iter_mut().zip(&self.inner) {
            if !inner {
                *value = Vector3::zeros();
            }
        }
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
            if !self.inner[i] {
                return Vector3::zeros();
            }
            let arriving: Vector3<f64> = stencils.into(i).map(|slot| corrections[slot]).sum();
            arriving
                - stencils
                    .row(i)
                    .map(|slot| corrections[slot])
                    .sum::<Vector3<f64>>()
        });
        sums.collect()
    }

    /// The multipliers that take back the pushes, by conjugate gradients, each component by itself.
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
        let mut size = dots(&residual, &direction);
        let enough = size * (ENOUGH * ENOUGH);
        for _ in 0..ITERATIONS {
            let product = self.apply(&direction);
            let step = ratios(&size, &dots(&direction, &product), &enough);
            for i in 0..n {
                x[i] += direction[i].component_mul(&step);
                residual[i] -= product[i].component_mul(&step);
            }
            let next = conditioned(&residual);
            let smaller = dots(&residual, &next);
            let turn = ratios(&smaller, &size, &Vector3::zeros());
            for (direction, next) in direction.iter_mut().zip(&next) {
                *direction = next + direction.component_mul(&turn);
            }
            size = smaller;
            if size
                .iter()
                .zip(enough.iter())
                .all(|(size, enough)| size <= enough)
            {
                break;
            }
        }
        x
    }
}

/// The products of two columns of vectors, component by component.
fn dots(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Vector3<f64> {
    a.iter().zip(b).map(|(a, b)| a.component_mul(b)).sum()
}

/// `a/b` by components; 0 where `a` is not above `enough`, or `b` not above 0.
fn ratios(a: &Vector3<f64>, b: &Vector3<f64>, enough: &Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|k, _| {
        if a[k] > enough[k] && b[k] > 0.0 {
            a[k] / b[k]
        } else {
            0.0
        }
    })
}
