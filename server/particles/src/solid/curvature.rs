//! Derivatives that a curved field does not lead astray where the others are all on one side.

use nalgebra::{Matrix3x6, Matrix6, Vector3, Vector6};
use rayon::prelude::*;

use super::stencil::Stencils;

/// How much less than all the squares of a row its quadratic fields may show before they count no more: what they hardly
/// show would else ask for derivatives out of all proportion.
const FAINT: f64 = 0.01;

impl Stencils {
    /// What the gradients of moving least squares lack, per slot, to see the gradients of quadratic fields, too, as far as
    /// the others show them; that of a linear field is 0. `[B13]`
    pub(super) fn curvature(&self, positions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let rows = (0..self.sight.len()).into_par_iter();
        let slots = rows.flat_map_iter(|i| {
            let offset = move |slot: usize| positions[self.other[slot] as usize] - positions[i];
            let of = move |slot: usize| squares(&(offset(slot) / self.sight[i].reach));
            // What the gradients make of the squares, whose gradient is 0 here.
            let mut astray = Matrix3x6::zeros();
            let mut size = 0.0;
            for slot in self.row(i) {
                astray += self.gradient[slot] * of(slot).transpose();
                size += self.share[slot] * of(slot).norm_squared();
            }
            let beside = move |slot: usize| of(slot) - astray.transpose() * offset(slot);
            let mut moment = Matrix6::identity() * (FAINT * size);
            for slot in self.row(i) {
                let beside = beside(slot);
                moment += beside * beside.transpose() * self.share[slot];
            }
            // Not positive where there is no one to see.
            let inverse = moment.cholesky().map(|moment| moment.inverse());
            let turn = astray * inverse.unwrap_or_default();
            self.row(i)
                .map(move |slot| turn * beside(slot) * -self.share[slot])
        });
        slots.collect()
    }
}

/// The products of the components, so that the norm is the square of the vector's.
fn squares(x: &Vector3<f64>) -> Vector6<f64> {
    let [mixed_yz, mixed_zx, mixed_xy] = [x.y * x.z, x.z * x.x, x.x * x.y];
    let twice = std::f64::consts::SQRT_2;
    Vector6::new(
        x.x * x.x,
        x.y * x.y,
        x.z * x.z,
        twice * mixed_yz,
        twice * mixed_zx,
        twice * mixed_xy,
    )
}
