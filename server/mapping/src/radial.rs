//! Radial functions `[M11]`, written without branches so that a loop over them becomes vector instructions.

use multiversion::multiversion;

use crate::{Polynomial, RadialFunction};

/// Places that are evaluated side by side.
pub(crate) const LANES: usize = 64;

impl RadialFunction {
    /// φ of the square of r/s. `[M11]`
    #[inline(always)]
    pub(crate) fn of_square(self, q2: f64) -> f64 {
        match self {
            Self::Gaussian => exp(-q2),
            Self::ShiftedLog => ln(q2 + std::f64::consts::E).sqrt(),
            Self::Multiquadric => (q2 + 1.0).sqrt(),
            Self::InverseMultiquadric => 1.0 / (q2 + 1.0).sqrt(),
            Self::InverseQuadratic => 1.0 / (q2 + 1.0),
            Self::Wendland => {
                let q = q2.sqrt().min(1.0);
                let square = (1.0 - q) * (1.0 - q);
                square * square * (4.0 * q + 1.0)
            }
            // So near to 0 that it changes no other logarithm, and times 0 it is 0.
            Self::ThinPlate => 0.5 * q2 * ln(q2 + 1e-300),
            Self::Cubic => q2 * q2.sqrt(),
            Self::Linear => q2.sqrt(),
        }
    }

    /// The lowest polynomial with which distinct points always have one interpolation: the order of conditional
    /// positive definiteness. `[M10]`
    pub(crate) fn needs(self) -> Polynomial {
        match self {
            Self::Gaussian
            | Self::InverseMultiquadric
            | Self::InverseQuadratic
            | Self::Wendland => Polynomial::None,
            Self::ShiftedLog | Self::Multiquadric | Self::Linear => Polynomial::Constant,
            Self::ThinPlate | Self::Cubic => Polynomial::Linear,
        }
    }

    /// The default scale, in distances between points.
    pub(crate) fn reach(self) -> f64 {
        match self {
            Self::Wendland => 5.0,
            Self::Gaussian
            | Self::ShiftedLog
            | Self::Multiquadric
            | Self::InverseMultiquadric
            | Self::InverseQuadratic
            | Self::ThinPlate
            | Self::Cubic
            | Self::Linear => 2.0,
        }
    }
}

/// A point with the coefficients of its function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Centre {
    pub(crate) place: [f64; 3],
    pub(crate) coefficients: [f64; 3],
}

/// Adds Σ λ φ at each place, coordinates by columns and in scales of the function, to the sums.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn add(
    function: RadialFunction,
    centres: &[Centre],
    places: &[[f64; LANES]; 3],
    sums: &mut [[f64; LANES]; 3],
) {
    use RadialFunction as F;
    // One loop for each function, which then is a constant in it.
    match function {
        F::Gaussian => add_all(F::Gaussian, centres, places, sums),
        F::ShiftedLog => add_all(F::ShiftedLog, centres, places, sums),
        F::Multiquadric => add_all(F::Multiquadric, centres, places, sums),
        F::InverseMultiquadric => add_all(F::InverseMultiquadric, centres, places, sums),
        F::InverseQuadratic => add_all(F::InverseQuadratic, centres, places, sums),
        F::Wendland => add_all(F::Wendland, centres, places, sums),
        F::ThinPlate => add_all(F::ThinPlate, centres, places, sums),
        F::Cubic => add_all(F::Cubic, centres, places, sums),
        F::Linear => add_all(F::Linear, centres, places, sums),
    }
}

#[inline(always)]
fn add_all(
    function: RadialFunction,
    centres: &[Centre],
    [x, y, z]: &[[f64; LANES]; 3],
    [u, v, w]: &mut [[f64; LANES]; 3],
) {
    for centre in centres {
        let ([px, py, pz], [cu, cv, cw]) = (centre.place, centre.coefficients);
        for lane in 0..LANES {
            let (dx, dy, dz) = (x[lane] - px, y[lane] - py, z[lane] - pz);
            let value = function.of_square(dx * dx + dy * dy + dz * dz);
            u[lane] += cu * value;
            v[lane] += cv * value;
            w[lane] += cw * value;
        }
    }
}

/// Replaces each x ≤ 0 by e^x, those below −708 by 0.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn exponentials(row: &mut [f64]) {
    for x in row {
        let value = exp(*x);
        *x = if *x < -708.0 { 0.0 } else { value };
    }
}

/// e^x for x ≤ 0; below −708 it is that of −708, about 1e-308.
///
/// x = n ln 2 + r, n whole, |r| ≤ ln 2 / 2, and e^r by its series.
#[inline(always)]
fn exp(x: f64) -> f64 {
    let x = x.max(-708.0);
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    let power = f64::from_bits(shifted.to_bits().wrapping_add(EXPONENT_BIAS) << MANTISSA_BITS);
    power * polynomial(r, EXP)
}

/// ln x for normal x > 0.
///
/// x = 2^e m, m from √½ to √2, and ln m = 2 artanh((m − 1)/(m + 1)) by its series.
#[inline(always)]
fn ln(x: f64) -> f64 {
    // One in the place of √½, so that the exponent's bits alone are e.
    let moved = x.to_bits().wrapping_add(ONE - SQRT_HALF);
    let e = f64::from_bits((moved >> MANTISSA_BITS) | TWO_TO_52) - (TWO_TO_52_AS_NUMBER + 1023.0);
    let m = f64::from_bits((moved & MANTISSA).wrapping_add(SQRT_HALF));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let tail = s * z * polynomial(z, ARTANH) + e * LN_2_LOW;
    e * LN_2_HIGH + (s + s + tail)
}

/// The value of a polynomial, its coefficients from the highest power down.
#[inline(always)]
fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    let mut sum = coefficients[0];
    for coefficient in &coefficients[1..] {
        sum = sum * x + coefficient;
    }
    sum
}

/// Added to a number below 2^51, it leaves the nearest whole one in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

const MANTISSA_BITS: u32 = 52;
const MANTISSA: u64 = (1 << MANTISSA_BITS) - 1;
const EXPONENT_BIAS: u64 = 1023;
const ONE: u64 = EXPONENT_BIAS << MANTISSA_BITS;
const TWO_TO_52_AS_NUMBER: f64 = 4_503_599_627_370_496.0;
const TWO_TO_52: u64 = TWO_TO_52_AS_NUMBER.to_bits();
const SQRT_HALF: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();

/// ln 2 in two parts: times a whole number below 2^11, the first is exact.
const LN_2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// 1/n! from 12 down.
const EXP: [f64; 13] = [
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// 2/(2 n + 1) from 9 down to 1.
const ARTANH: [f64; 9] = [
    2.0 / 19.0,
    2.0 / 17.0,
    2.0 / 15.0,
    2.0 / 13.0,
    2.0 / 11.0,
    2.0 / 9.0,
    2.0 / 7.0,
    2.0 / 5.0,
    2.0 / 3.0,
];

#[cfg(test)]
mod tests {
    use super::*;

    fn check(from: f64, to: f64, name: &str, ours: fn(f64) -> f64, expected: fn(f64) -> f64) {
        for step in 0..200_000 {
            let x = from * (to / from).powf(f64::from(step) / 2e5);
            let (found, expected) = (ours(x), expected(x));
            let error = (found - expected).abs() / expected.abs().max(1e-15);
            assert!(
                error < 4.0 * f64::EPSILON,
                "{name}({x}): {found} {expected}"
            );
        }
    }

    #[test]
    fn exponentials_and_logarithms_are_exact_to_a_few_bits() {
        check(1e-20, 700.0, "exp", |x| exp(-x), |x| (-x).exp());
        check(1e-150, 1e150, "ln", ln, f64::ln);
        assert_eq!((exp(0.0), ln(1.0)), (1.0, 0.0));
        assert!(exp(-1e30) < 1e-300 && exp(f64::NEG_INFINITY) < 1e-300);
    }

    #[test]
    fn functions_have_their_ends() {
        use RadialFunction as F;
        for (function, at_zero) in [
            (F::Gaussian, 1.0),
            (F::ShiftedLog, 1.0),
            (F::Multiquadric, 1.0),
            (F::InverseMultiquadric, 1.0),
            (F::InverseQuadratic, 1.0),
            (F::Wendland, 1.0),
            (F::ThinPlate, 0.0),
            (F::Cubic, 0.0),
            (F::Linear, 0.0),
        ] {
            assert_eq!(function.of_square(0.0), at_zero, "{function:?}");
        }
        assert_eq!(F::Wendland.of_square(f64::INFINITY), 0.0);
        assert!(F::Gaussian.of_square(f64::INFINITY) < 1e-300);
    }

    #[test]
    fn places_have_the_same_bits_side_by_side_and_alone() {
        use RadialFunction as F;
        let places: [[f64; LANES]; 3] = [0.3, 1.7, 2.9]
            .map(|step| std::array::from_fn(|lane| (lane as f64 * step).sin() * 2.0));
        let centres = [[0.1, -0.2, 0.3], [1.5, 0.0, -0.4]].map(|place| Centre {
            place,
            coefficients: [1.0, -0.7, 0.2],
        });
        for function in [
            F::Gaussian,
            F::ShiftedLog,
            F::Multiquadric,
            F::InverseMultiquadric,
        ]
        .into_iter()
        .chain([
            F::InverseQuadratic,
            F::Wendland,
            F::ThinPlate,
            F::Cubic,
            F::Linear,
        ]) {
            let mut sums = [[0.5; LANES]; 3];
            add(function, &centres, &places, &mut sums);
            for lane in 0..LANES {
                let mut alone = [0.5; 3];
                for centre in &centres {
                    let d: [f64; 3] = std::array::from_fn(|i| places[i][lane] - centre.place[i]);
                    let value = function.of_square(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                    for (sum, coefficient) in alone.iter_mut().zip(centre.coefficients) {
                        *sum += coefficient * value;
                    }
                }
                assert_eq!(sums.map(|row| row[lane]), alone, "{function:?}");
            }
        }
    }
}
