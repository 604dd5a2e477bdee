use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3, Vector4};

use crate::lanes::{LANES, quick_fits};

/// Eigenvalues this close, relative to the size of the problem, count as equal.
///
/// It makes points within 1e-5 of their length from a line count as a line: coordinates known to single precision say
/// nothing about the twist of a thinner set.
const TIE: f64 = 1e-10;

/// Steps after which a search is given up; it takes one to three from a quick answer.
const STEPS: usize = 8;

/// A half angle below which one more step, being quadratic, ends at the last bit.
const CONVERGED: f64 = 1e-8;

/// The least determinant of the curvature that a search trusts: far above a tie, for rounding not to matter.
const CURVED: f64 = 1e-4;

/// The least slope at the greatest eigenvalue, of at most 14, with which the eigenvector is exact to 10⁻¹²: the error
/// grows with the inverse square.
const STEEP: f64 = 0.5;

/// What a cluster's points say of its rotation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    /// A = Σ now restᵀ over the arms of the cluster. `[M2]`
    pub(crate) covariance: Matrix3<f64>,
    /// √(Σ|now|²) √(Σ|rest|²), which |A| never exceeds. Where it vanishes or overflows, A says nothing.
    pub(crate) size: f64,
}

/// For each of at most [`LANES`] clusters the rotation R that maximises tr(Rᵀ A); of several, the one nearest to the
/// last one, which it replaces. `[M3]`
///
/// Nearly all are simple roots of a polynomial and are found side by side in vector registers. What is not certain then is
/// searched for from there, and where that finds no unique one either, all eigenvectors tell.
pub(crate) fn fit<'a>(
    moments: impl Iterator<Item = &'a Moments> + Clone,
    rotations: &mut [UnitQuaternion<f64>],
) {
    let mut entries = [[0.0; LANES]; 9];
    for (lane, moments) in moments.clone().enumerate() {
        for (entry, value) in entries.iter_mut().zip(moments.covariance.iter()) {
            entry[lane] = *value;
        }
    }
    let mut quick = [[0.0; LANES]; 5];
    quick_fits(&entries, &mut quick);
    for (lane, (moments, rotation)) in moments.zip(rotations).enumerate() {
        let Moments { covariance, size } = moments;
        if !size.is_normal() {
            continue;
        }
        let [w, i, j, k, slope] = quick.each_ref().map(|row| row[lane]);
        let found = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
        let telling = slope >= STEEP && covariance.norm() > TIE.sqrt() * size;
        if telling {
            *rotation = found;
            continue;
        }
        let a = covariance / *size;
        let start = if w.is_finite() { found } else { *rotation };
        *rotation = climb(&a, &start).unwrap_or_else(|| choose(&a, rotation));
    }
}

/// Newton's method for the maximum of tr(Rᵀ A) over rotations, |A| ≤ 1, from `start`; `None` where it does not lead to a
/// unique one within a few steps.
///
/// With M = Rᵀ A, the gradient is the axial vector of M and the Hessian −(tr(M) I − sym(M)). The function has no maximum
/// but the greatest, so where the gradient vanishes and the Hessian is negative definite, the search has ended for sure.
fn climb(a: &Matrix3<f64>, start: &UnitQuaternion<f64>) -> Option<UnitQuaternion<f64>> {
    let mut rotation = *start;
    for _ in 0..STEPS {
        let m = rotation.to_rotation_matrix().matrix().transpose() * a;
        let gradient = Vector3::new(m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12);
        let curvature = Matrix3::from_diagonal_element(m.trace()) - (m + m.transpose()) * 0.5;
        let curvature = curvature.cholesky()?;
        if curvature.determinant() < CURVED {
            return None;
        }
        let half = curvature.solve(&gradient) * 0.5;
        let turn = UnitQuaternion::new_normalize(Quaternion::new(1.0, half.x, half.y, half.z));
        rotation *= turn;
        if half.norm_squared() < CONVERGED * CONVERGED {
            rotation.renormalize(); // or the products of a long run would drift
            return Some(rotation);
        }
    }
    None
}

/// The general case: Horn's matrix, all of its eigenvectors, |A| ≤ 1.
///
/// As a quaternion, R is an eigenvector of the greatest eigenvalue, and −R the same rotation. So it is never a
/// reflection, whatever the sign of det A, and the cases where it is not unique (coincident, collinear and some mirrored
/// points) are those where the greatest eigenvalue is multiple: then R is `last` projected onto its eigenspace.
fn choose(a: &Matrix3<f64>, last: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let eigen = horn(a).symmetric_eigen();
    let greatest = eigen.eigenvalues.max();
    let last_wxyz = Vector4::new(last.w, last.i, last.j, last.k);
    let mut projected = Vector4::zeros();
    let mut top = Vector4::zeros();
    for (value, axis) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if greatest - value <= TIE {
            projected += axis * axis.dot(&last_wxyz);
            top = axis.into_owned();
        }
    }
    // Half a turn away from `last` there is no nearest one: any of the best will do.
    let [w, i, j, k] = if projected.norm_squared() > 1e-24 {
        projected
    } else {
        top
    }
    .into();
    UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k))
}

/// Horn's symmetric matrix: qᵀ N q = tr(R(q)ᵀ A) for unit quaternions q = [w, x, y, z].
fn horn(a: &Matrix3<f64>) -> Matrix4<f64> {
    let (xx, yy, zz) = (a.m11, a.m22, a.m33);
    let (w_x, w_y, w_z) = (a.m32 - a.m23, a.m13 - a.m31, a.m21 - a.m12);
    let (x_y, y_z, z_x) = (a.m12 + a.m21, a.m23 + a.m32, a.m31 + a.m13);
    Matrix4::new(
        xx + yy + zz,
        w_x,
        w_y,
        w_z, //
        w_x,
        xx - yy - zz,
        x_y,
        z_x, //
        w_y,
        x_y,
        yy - xx - zz,
        y_z, //
        w_z,
        z_x,
        y_z,
        zz - xx - yy,
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::SVD;
    use proptest::prelude::*;

    use super::*;

    fn fit_one(a: &Matrix3<f64>, size: f64, last: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let mut rotation = [*last];
        let covariance = *a;
        fit([Moments { covariance, size }].iter(), &mut rotation);
        rotation[0]
    }

    /// The textbook answer where it is unique: U diag(1, 1, det) Vᵀ.
    fn by_svd(a: &Matrix3<f64>) -> Matrix3<f64> {
        let svd = SVD::new_unordered(*a, true, true);
        let (mut u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
        if u.determinant() * v_t.determinant() < 0.0 {
            let least = svd.singular_values.imin();
            u.column_mut(least).neg_mut();
        }
        u * v_t
    }

    fn matrix() -> impl Strategy<Value = Matrix3<f64>> {
        prop::array::uniform9(-1.0..1.0).prop_map(|a| Matrix3::from_row_slice(&a).normalize())
    }

    fn any_rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
        prop::array::uniform3(-3.0..3.0).prop_map(|turn| UnitQuaternion::new(turn.into()))
    }

    proptest! {
        #[test]
        fn search_and_eigenvectors_agree_with_the_singular_values(a in matrix(), start in any_rotation()) {
            let s = a.singular_values();
            prop_assume!(s[1] + s[2] * a.determinant().signum() > 1e-3);
            let expected = by_svd(&a);
            let chosen = choose(&a, &start).to_rotation_matrix();
            let fitted = fit_one(&a, 1.0, &start).to_rotation_matrix();
            prop_assert!((fitted.matrix() - expected).amax() < 1e-11);
            prop_assert!((chosen.matrix() - expected).amax() < 1e-11);
            if let Some(found) = climb(&a, &start) {
                prop_assert!((found.to_rotation_matrix().matrix() - expected).amax() < 1e-11);
            }
        }

        #[test]
        fn flat_thin_mirrored_and_random_sets_are_fitted_as_well_as_can_be(
            ends in prop::array::uniform2(any_rotation()),
            middle in -16.0..0.0,
            least in -16.0..0.0,
            mirrored: bool,
            last in any_rotation(),
        ) {
            let mut s = [1.0, 10_f64.powf(middle), 10_f64.powf(middle + least)];
            if mirrored {
                s[2] = -s[2];
            }
            let [u, v] = ends.map(|end| *end.to_rotation_matrix().matrix());
            let a = u * Matrix3::from_diagonal(&s.into()) * v;
            let r = *fit_one(&a, 2.0, &last).to_rotation_matrix().matrix();
            let (best, found) = (s.iter().sum::<f64>(), (r.transpose() * a).trace());
            prop_assert!((best - found).abs() < 1e-9, "{best} {found}");
            prop_assert!((r.transpose() * r - Matrix3::identity()).amax() < 1e-12);
            prop_assert!((r.determinant() - 1.0).abs() < 1e-12);
            let gap = s[1] + s[2];
            if gap > 1e-2 {
                prop_assert!((r - u * v).amax() < 1e-12 / gap);
            }
        }

        #[test]
        fn a_search_from_nearby_finds_what_is_well_defined(a in matrix(), noise in matrix()) {
            let s = a.singular_values();
            prop_assume!(s[1] + s[2] * a.determinant().signum() > 0.2);
            let start = choose(&(a + noise * 0.02), &UnitQuaternion::identity());
            prop_assert!(climb(&a, &start).is_some());
        }

        #[test]
        fn of_the_rotations_that_fit_a_line_the_nearest_is_taken(
            last in any_rotation(),
            ends in prop::array::uniform2(any_rotation()),
        ) {
            let [rest, now] = ends.map(|turn| turn * Vector3::z());
            let a = now * rest.transpose();
            let found = fit_one(&a, 1.0, &last);
            prop_assert!((found * rest - now).norm() < 1e-12);
            // The smallest turn that brings the last image of the line onto the line.
            let smallest = UnitQuaternion::rotation_between(&(last * rest), &now);
            let expected = smallest.unwrap_or_default() * last;
            prop_assert!(found.angle_to(&expected) < 1e-7);
        }
    }

    #[test]
    fn a_mirrored_ball_keeps_as_close_to_the_last_rotation_as_it_can() {
        // Every half turn fits −I as well as any other: the one nearest to a turn by 3 about z is by π about z.
        let last = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 3.0);
        let a = -Matrix3::identity() / 3.0;
        let found = fit_one(&a, 1.0, &last);
        let expected = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        assert!(found.angle_to(&expected) < 1e-12);
    }

    #[test]
    fn a_line_turned_end_to_end_is_fitted_by_some_half_turn() {
        let a = Matrix3::from_diagonal(&Vector3::new(-1.0, 0.0, 0.0));
        let found = fit_one(&a, 1.0, &UnitQuaternion::identity());
        assert!((found * Vector3::x() + Vector3::x()).norm() < 1e-12);
    }

    #[test]
    fn a_long_run_of_searches_stays_of_unit_length() {
        let step = UnitQuaternion::from_euler_angles(0.01, -0.02, 0.03);
        let spread = Matrix3::from_diagonal(&Vector3::new(0.5, 0.3, 0.2));
        let mut motion = UnitQuaternion::identity();
        let mut found = UnitQuaternion::identity();
        for _ in 0..100_000 {
            motion = UnitQuaternion::new_normalize((step * motion).into_inner());
            found = climb(&(motion.to_rotation_matrix() * spread), &found).unwrap();
        }
        assert!((found.norm() - 1.0).abs() < 1e-15);
        assert!(found.angle_to(&motion) < 1e-7);
    }
}
