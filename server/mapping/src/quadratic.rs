use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Directions of the space of monomials in which points spread by less than the square root of this, relative to the
/// widest, count as unseen.
const UNSEEN: f64 = 1e-9;

/// Monomials that vary by less than this, relative to the size of a cluster, are rounding.
const FAINT: f64 = 1e-6;

/// The quadratic terms of an offset: x², y², z², xy, yz, zx.
fn squares(o: &Vector3<f64>) -> [f64; 6] {
    [
        o.x * o.x,
        o.y * o.y,
        o.z * o.z,
        o.x * o.y,
        o.y * o.z,
        o.z * o.x,
    ]
}

/// How a cluster sees the nine monomials at rest, in units of its size. `[M9]`
#[derive(Clone, Debug)]
pub(crate) struct Quadratic {
    /// 1/m; one over the points' root mean square distance from their centroid, 1 for a single place.
    per_size: f64,
    /// The mean of the quadratic terms.
    mean: SVector<f64, 6>,
    /// The pseudo-inverse of the weighted sum of `m mᵀ`, with m the monomials less their means.
    inverse: SMatrix<f64, 9, 9>,
}

/// What a quadratic fit adds to a linear map.
pub(crate) struct Fitted {
    pub(crate) linear: Matrix3<f64>,
    pub(crate) shift: Vector3<f64>,
    pub(crate) bend: Bend,
}

impl Quadratic {
    /// Of arms with shares that sum to 1.
    pub(crate) fn new(arms: &[Vector3<f64>], shares: &[f64]) -> Self {
        let arms = || arms.iter().zip(shares);
        let spread: f64 = arms().map(|(arm, share)| share * arm.norm_squared()).sum();
        let size = spread.sqrt();
        let mut quadratic = Self {
            per_size: if size.is_normal() { size.recip() } else { 1.0 },
            mean: SVector::zeros(),
            inverse: SMatrix::zeros(),
        };
        let terms = |arm: &Vector3<f64>| SVector::from(squares(&(arm * quadratic.per_size)));
        quadratic.mean = arms().map(|(arm, share)| terms(arm) * *share).sum();
        let mut spread = SMatrix::<f64, 9, 9>::zeros();
        for (arm, share) in arms() {
            let monomials = quadratic.monomials(arm);
            spread += monomials * monomials.transpose() * *share;
        }
        // Each monomial in units of its own spread, or flat shapes would seem to have none across.
        let unit = |value: f64| value.sqrt().max(FAINT);
        let units = SVector::<f64, 9>::from_fn(|i, _| unit(spread[(i, i)]));
        let outer = units * units.transpose();
        let eigen = spread.component_div(&outer).symmetric_eigen();
        let least = UNSEEN * eigen.eigenvalues.max();
        for (&value, axis) in (eigen.eigenvalues.iter()).zip(eigen.eigenvectors.column_iter()) {
            if value > least {
                quadratic.inverse += axis * axis.transpose() / value;
            }
        }
        quadratic.inverse.component_div_assign(&outer);
        quadratic
    }

    /// The monomials of an arm less their means over the points.
    fn monomials(&self, arm: &Vector3<f64>) -> SVector<f64, 9> {
        let arm = arm * self.per_size;
        let squares = SVector::from(squares(&arm)) - self.mean;
        SVector::from_fn(|i, _| if i < 3 { arm[i] } else { squares[i - 3] })
    }

    /// Fits what `linear` leaves of arms at rest and now, each pair with its share. `[M9]`
    pub(crate) fn fit<'a>(
        &self,
        linear: &Matrix3<f64>,
        arms: impl Iterator<Item = ((&'a f64, &'a Vector3<f64>), Vector3<f64>)>,
    ) -> Fitted {
        let mut left = SMatrix::<f64, 3, 9>::zeros();
        for ((share, rest), now) in arms {
            left += (now - linear * rest) * *share * self.monomials(rest).transpose();
        }
        let map = left * self.inverse;
        let terms = map.fixed_columns::<6>(3);
        let shift: Vector3<f64> = -(terms * self.mean);
        let per_area = self.per_size * self.per_size;
        let column = |i: usize| [terms[(0, i)], terms[(1, i)], terms[(2, i)], 0.0];
        Fitted {
            linear: map.fixed_columns::<3>(0) * self.per_size,
            shift,
            bend: Bend([0, 1, 2, 3, 4, 5].map(column)).scaled(per_area),
        }
    }
}

/// The columns of the quadratic terms, 1/m, each with a zero.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(crate) struct Bend([[f64; 4]; 6]);

impl Bend {
    pub(crate) fn scaled(self, by: f64) -> Self {
        Self(self.0.map(|column| column.map(|entry| entry * by)))
    }

    pub(crate) fn apply(&self, offset: &Vector3<f64>) -> Vector3<f64> {
        let mut sum = [0.0; 4];
        for (column, square) in self.0.iter().zip(squares(offset)) {
            for axis in 0..4 {
                sum[axis] += column[axis] * square;
            }
        }
        Vector3::new(sum[0], sum[1], sum[2])
    }
}
