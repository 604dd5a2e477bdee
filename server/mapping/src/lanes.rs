//! Rotations of many clusters side by side in vector registers.

use multiversion::multiversion;

/// Fits that are made at once.
pub(crate) const LANES: usize = 64;

/// Steps towards the greatest eigenvalue, each of which triples the digits; few fits need more than four.
const ROOT_STEPS: usize = 7;

/// A last step of this size has left only rounding.
const ROOTED: f64 = 1e-5;

/// [`quick_fit`] of each lane: its nine entries by columns to its five results.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn quick_fits(a: &[[f64; LANES]; 9], fits: &mut [[f64; LANES]; 5]) {
    for lane in 0..LANES {
        let fit = quick_fit([
            a[0][lane], a[1][lane], a[2][lane], a[3][lane], a[4][lane], a[5][lane], a[6][lane],
            a[7][lane], a[8][lane],
        ]);
        for row in 0..5 {
            fits[row][lane] = fit[row];
        }
    }
}

/// The eigenvector [w, x, y, z] of the greatest eigenvalue λ of Horn's matrix of A, given by columns, and the slope of the
/// characteristic polynomial at λ: 0 where λ has not been found. No branch, so that lanes do the same.
///
/// With |A| = 1 the polynomial is (λ² − 1)² − 8 λ det A − 4 |adj A|². All of its roots are real, so Halley's steps fall
/// from a bound above onto the greatest. There adj(N − λ) is a multiple of the projection onto the eigenvector, the
/// longest of whose columns loses no digits.
#[inline(always)]
fn quick_fit(a: [f64; 9]) -> [f64; 5] {
    let scale = a.iter().fold(0.0, |sum, x| sum + x * x).sqrt().recip();
    let [xx, yx, zx, xy, yy, zy, xz, yz, zz] = a.map(|x| x * scale);
    let cofactors = [
        yy * zz - yz * zy,
        yz * zx - yx * zz,
        yx * zy - yy * zx,
        zy * xz - zz * xy,
        zz * xx - zx * xz,
        zx * xy - zy * xx,
        xy * yz - xz * yy,
        xz * yx - xx * yz,
        xx * yy - xy * yx,
    ];
    let determinant = xx * cofactors[0] + xy * cofactors[1] + xz * cofactors[2];
    let adjugate = cofactors.iter().fold(0.0, |sum, x| sum + x * x);
    let (root, slope) = greatest_root(determinant, adjugate);
    // N − λ, symmetric; its minors of the lower and of the upper two rows.
    let (n01, n02, n03) = (zy - yz, xz - zx, yx - xy);
    let (n12, n23, n13) = (xy + yx, yz + zy, zx + xz);
    let (n00, n11) = (xx + yy + zz - root, xx - yy - zz - root);
    let (n22, n33) = (yy - xx - zz - root, zz - xx - yy - root);
    let (l01, l02, l03) = (
        n02 * n13 - n12 * n03,
        n02 * n23 - n22 * n03,
        n02 * n33 - n23 * n03,
    );
    let (l12, l13, l23) = (
        n12 * n23 - n22 * n13,
        n12 * n33 - n23 * n13,
        n22 * n33 - n23 * n23,
    );
    let (u01, u02, u03) = (
        n00 * n11 - n01 * n01,
        n00 * n12 - n02 * n01,
        n00 * n13 - n03 * n01,
    );
    let (u12, u13) = (n01 * n12 - n02 * n11, n01 * n13 - n03 * n11);
    let a01 = n12 * l03 - n01 * l23 - n13 * l02;
    let a02 = n01 * l13 - n11 * l03 + n13 * l01;
    let a03 = n11 * l02 - n01 * l12 - n12 * l01;
    let a12 = n01 * l03 - n00 * l13 - n03 * l01;
    let a13 = n00 * l12 - n01 * l02 + n02 * l01;
    let a23 = n12 * u03 - n02 * u13 - n23 * u01;
    let a00 = n11 * l23 - n12 * l13 + n13 * l12;
    let a11 = n00 * l23 - n02 * l03 + n03 * l02;
    let a22 = n03 * u13 - n13 * u03 + n33 * u01;
    let a33 = n02 * u12 - n12 * u02 + n22 * u01;
    let [w, x, y, z] = longest([
        [a00, a01, a02, a03],
        [a01, a11, a12, a13],
        [a02, a12, a22, a23],
        [a03, a13, a23, a33],
    ]);
    [w, x, y, z, slope]
}

/// The greatest root of (λ² − 1)² − 8 d λ − 4 c, d = det A and c = |adj A|² with |A| = 1, and the slope there; 0 where the
/// root has not been found.
#[inline(always)]
fn greatest_root(determinant: f64, cofactors: f64) -> (f64, f64) {
    // The sum of the products of two singular values is at most this, and 1.
    let products = (3.0 * cofactors).sqrt().min(1.0);
    let mut root = (1.0 + 2.0 * products).sqrt();
    let slope = |root: f64| 4.0 * root * (root * root - 1.0) - 8.0 * determinant;
    let mut step = 0.0;
    for _ in 0..ROOT_STEPS {
        let square = root * root - 1.0;
        let value = square * square - 8.0 * determinant * root - 4.0 * cofactors;
        let (first, second) = (slope(root), 12.0 * root * root - 4.0);
        step = 2.0 * value * first / (2.0 * first * first - value * second);
        root -= step;
    }
    let slope = if step.abs() < ROOTED {
        slope(root)
    } else {
        0.0
    };
    (root, slope)
}

/// The column of the greatest diagonal entry of a symmetric matrix, made of unit length.
#[inline(always)]
fn longest(columns: [[f64; 4]; 4]) -> [f64; 4] {
    let mut longest = columns[0];
    let mut size = columns[0][0].abs();
    let mut pick = |diagonal: f64, column: [f64; 4]| {
        let longer = diagonal.abs() > size;
        for entry in 0..4 {
            longest[entry] = if longer {
                column[entry]
            } else {
                longest[entry]
            };
        }
        size = if longer { diagonal.abs() } else { size };
    };
    pick(columns[1][1], columns[1]);
    pick(columns[2][2], columns[2]);
    pick(columns[3][3], columns[3]);
    let norm = longest.iter().fold(0.0, |sum, x| sum + x * x).sqrt();
    longest.map(|entry| entry / norm)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn lanes_do_not_see_each_other_and_have_the_same_bits_on_every_processor(
            sets in prop::collection::vec(prop::array::uniform9(-1.0..1.0), 1..LANES),
        ) {
            let mut entries = [[0.0; LANES]; 9];
            for (lane, a) in sets.iter().enumerate() {
                for (entry, value) in entries.iter_mut().zip(a) {
                    entry[lane] = *value;
                }
            }
            let mut fits = [[0.0; LANES]; 5];
            quick_fits(&entries, &mut fits);
            for (lane, a) in sets.iter().enumerate() {
                let alone = quick_fit(*a);
                prop_assert_eq!(fits.map(|row| row[lane].to_bits()), alone.map(f64::to_bits));
            }
        }
    }
}
