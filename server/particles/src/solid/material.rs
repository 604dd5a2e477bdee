//! Stress and energy of materials. Deformations may be known along some directions only.

use nalgebra::{Matrix3, Vector3};

use super::{Dimension, Material, MaterialLaw, stencil::Sight};

/// A material's moduli, Pa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moduli {
    lambda: f64,
    mu: f64,
    dimension: Dimension,
    law: MaterialLaw,
}

/// A deformation gradient and the directions in which it is known; in the others it is 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deformation<'a> {
    pub(crate) gradient: Matrix3<f64>,
    pub(crate) sight: &'a Sight,
}

impl Moduli {
    pub(crate) fn new(material: &Material, dimension: Dimension) -> Self {
        let Material {
            young: e,
            poisson: nu,
            law,
        } = *material;
        let lambda = match dimension {
            Dimension::Plane => e * nu / (1.0 - nu * nu),
            Dimension::Space => e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        };
        Self {
            lambda,
            mu: e / (2.0 * (1.0 + nu)),
            dimension,
            law,
        }
    }

    /// First Piola–Kirchhoff stress, Pa: by the gradient's columns, as the deformation.
    pub(crate) fn stress(&self, deformation: &Deformation) -> Matrix3<f64> {
        let Self { lambda, mu, .. } = *self;
        let (f, seen) = (deformation.gradient, deformation.sight.projector());
        let of_strain =
            |strain: Matrix3<f64>| strain * (2.0 * mu) + seen * (lambda * strain.trace());
        match self.law_of(deformation.sight) {
            MaterialLaw::Linear => of_strain(small_strain(&f, &seen)),
            MaterialLaw::Corotated => {
                let r = self.rotation(deformation);
                r * of_strain(r.transpose() * f - seen)
            }
            MaterialLaw::StVenantKirchhoff => f * of_strain((f.transpose() * f - seen) * 0.5),
            MaterialLaw::NeoHookean => {
                let Rubber {
                    lambda, mu, alpha, ..
                } = self.rubber(deformation.sight.rank);
                let whole = self.completed(deformation);
                let square = f.norm_squared();
                f * (mu * (1.0 - 1.0 / (square + 1.0)))
                    + cofactor(&whole) * seen * (lambda * (whole.determinant() - alpha))
            }
        }
    }

    /// Energy per volume at rest, J/m³; 0 at rest.
    pub(crate) fn energy(&self, deformation: &Deformation) -> f64 {
        let Self { lambda, mu, .. } = *self;
        let (f, seen) = (deformation.gradient, deformation.sight.projector());
        let of_strain = |strain: Matrix3<f64>| {
            mu * strain.norm_squared() + 0.5 * lambda * strain.trace().powi(2)
        };
        match self.law_of(deformation.sight) {
            MaterialLaw::Linear => of_strain(small_strain(&f, &seen)),
            MaterialLaw::Corotated => of_strain(self.rotation(deformation).transpose() * f - seen),
            MaterialLaw::StVenantKirchhoff => of_strain((f.transpose() * f - seen) * 0.5),
            MaterialLaw::NeoHookean => {
                let Rubber {
                    lambda,
                    mu,
                    alpha,
                    dims,
                } = self.rubber(deformation.sight.rank);
                let at = |square: f64, volume: f64| {
                    0.5 * mu * (square - dims - (square + 1.0).ln())
                        + 0.5 * lambda * (volume - alpha).powi(2)
                };
                let volume = self.completed(deformation).determinant();
                at(f.norm_squared(), volume) - at(dims, 1.0)
            }
        }
    }

    /// A chain has no volume to keep, but its length.
    fn law_of(&self, sight: &Sight) -> MaterialLaw {
        if self.law == MaterialLaw::NeoHookean && sight.rank < 2 {
            MaterialLaw::Corotated
        } else {
            self.law
        }
    }

    /// How many times stiffer than at rest a deformation makes the material, about, from 1.
    pub(crate) fn stiffening(&self, f: &Matrix3<f64>) -> f64 {
        let times = match self.law {
            MaterialLaw::Linear | MaterialLaw::Corotated => 1.0,
            // Of a bar: dP/dF = E (3 F² − 1)/2.
            MaterialLaw::StVenantKirchhoff => 0.5 * (3.0 * f.norm_squared() - 1.0) / 2.0,
            MaterialLaw::NeoHookean => cofactor(f).norm_squared(),
        };
        times.max(1.0)
    }

    /// The rotation nearest to the deformation, det = +1. Of directions not seen no more than that they turn along.
    fn rotation(&self, deformation: &Deformation) -> Matrix3<f64> {
        if self.dimension == Dimension::Plane && deformation.sight.rank == 2 {
            return plane_rotation(&deformation.gradient);
        }
        rotation(&self.completed(deformation))
    }

    /// The deformation with a turn of the directions that are not seen, which stretches none of them.
    fn completed(&self, deformation: &Deformation) -> Matrix3<f64> {
        let Deformation { gradient: f, sight } = *deformation;
        let axis = |k: usize| sight.axes.column(k).into_owned();
        match (self.dimension, sight.rank) {
            (_, 0) => Matrix3::identity(),
            (_, 1) => {
                let along = axis(0);
                let turned = f * along;
                let turn = nalgebra::Rotation3::rotation_between(&along, &turned);
                let turn = turn.unwrap_or_else(|| {
                    nalgebra::Rotation3::from_axis_angle(
                        &nalgebra::Unit::new_normalize(axis(1)),
                        std::f64::consts::PI,
                    )
                });
                f + turn.matrix() * (Matrix3::identity() - sight.projector())
            }
            (Dimension::Plane, 2) => f + Vector3::z() * Vector3::z().transpose(),
            (Dimension::Space, 2) => {
                let across = axis(0).cross(&axis(1));
                let turned = (f * axis(0)).cross(&(f * axis(1)));
                let turned = turned.try_normalize(0.0).unwrap_or(across);
                f + turned * across.transpose()
            }
            (_, _) => f,
        }
    }

    /// `[B9]`
    fn rubber(&self, rank: usize) -> Rubber {
        #[expect(clippy::cast_precision_loss, reason = "at most 3")]
        let dims = rank as f64;
        let mu = self.mu * (dims + 1.0) / dims;
        let lambda = self.lambda + self.mu * (1.0 - 2.0 / (dims * (dims + 1.0)));
        Rubber {
            lambda,
            mu,
            alpha: 1.0 + self.mu / lambda,
            dims,
        }
    }
}

/// Moduli of the stable neo-Hookean law, Pa, and the volume at which its pressure vanishes.
struct Rubber {
    lambda: f64,
    mu: f64,
    alpha: f64,
    dims: f64,
}

/// Symmetric part of the gradient of the displacement along the directions that are seen. `[B6]`
fn small_strain(f: &Matrix3<f64>, seen: &Matrix3<f64>) -> Matrix3<f64> {
    let gradient = f - seen;
    seen * (gradient + gradient.transpose()) * seen * 0.5
}

/// `∂ det F/∂F`
fn cofactor(f: &Matrix3<f64>) -> Matrix3<f64> {
    let [a, b, c] = [0, 1, 2].map(|k| f.column(k).into_owned());
    Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}

/// The rotation about z that is nearest to a deformation of the plane. `[B7]`
fn plane_rotation(f: &Matrix3<f64>) -> Matrix3<f64> {
    let (c, s) = (f.m11 + f.m22, f.m21 - f.m12);
    let length = c.hypot(s);
    if length == 0.0 {
        return Matrix3::identity();
    }
    let (c, s) = (c / length, s / length);
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// The rotation nearest to a deformation, det = +1: by Newton's iteration for the polar factor, which is that rotation
/// unless space is turned inside out. `[B7]`; Higham, SIAM J. Sci. Stat. Comput. 7 (1986) 1160.
fn rotation(f: &Matrix3<f64>) -> Matrix3<f64> {
    let size = f.norm();
    if f.determinant() <= 1e-6 * size.powi(3) || !size.is_finite() {
        return inverted_rotation(f);
    }
    let mut x = *f;
    for _ in 0..30 {
        let inverse_transposed = cofactor(&x) / x.determinant();
        let scale = (inverse_transposed.norm() / x.norm()).sqrt();
        let next = (x * scale + inverse_transposed / scale) * 0.5;
        let moved = (next - x).norm();
        x = next;
        if moved <= 1e-9 {
            // Convergence is quadratic: the next iterate is exact to rounding.
            break;
        }
    }
    (x + cofactor(&x) / x.determinant()) * 0.5
}

/// Where the least stretch is taken as negative. `[B7]`
fn inverted_rotation(f: &Matrix3<f64>) -> Matrix3<f64> {
    if !f.norm().is_finite() {
        return Matrix3::identity();
    }
    let svd = f.svd(true, true);
    let (Some(mut u), Some(v)) = (svd.u, svd.v_t) else {
        return Matrix3::identity();
    };
    if (u * v).determinant() < 0.0 {
        let least = svd.singular_values.imin();
        u.column_mut(least).neg_mut();
    }
    u * v
}
