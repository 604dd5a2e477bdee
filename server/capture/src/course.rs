//! Where a marker goes by itself.

use nalgebra::{Matrix3, Vector3};

/// How fast the acceleration of a part of a body changes, s, and how strong it is, m/s²: those of a person's limbs.
const MANOEUVRE: f64 = 0.1;
const STRENGTH: f64 = 10.0;
/// How far beside its place a marker is seen, m.
const NOISE: f64 = 3e-4;
/// What is known of the speed of a marker that was seen once, m/s.
const SPEED: f64 = 2.0;

/// The variance of what nothing is known of: large, and finite beside what is known.
const NOTHING: f64 = 1e12;

/// How a course goes on over one step.
#[derive(Clone, Debug)]
pub(crate) struct Law {
    onward: Matrix3<f64>,
    spread: Matrix3<f64>,
}

impl Law {
    /// * `step` - s, > 0.
    pub(crate) fn new(step: f64) -> Self {
        let rate = MANOEUVRE.recip();
        let left = (-rate * step).exp();
        let (t2, t3) = (step * step, step * step * step);
        let onward = Matrix3::new(
            1.0,
            step,
            (left - 1.0 + rate * step) / (rate * rate),
            0.0,
            1.0,
            (1.0 - left) / rate,
            0.0,
            0.0,
            left,
        );
        let spread = Matrix3::new(
            t3 * t2 / 20.0,
            t2 * t2 / 8.0,
            t3 / 6.0,
            t2 * t2 / 8.0,
            t3 / 3.0,
            t2 / 2.0,
            t3 / 6.0,
            t2 / 2.0,
            step,
        );
        Self {
            onward,
            spread: spread * (2.0 * rate * STRENGTH * STRENGTH),
        }
    }
}

/// Place, speed and acceleration of one marker, and how well they are known, the same along each axis. `[S5]`
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) position: Vector3<f64>,
    pub(crate) velocity: Vector3<f64>,
    acceleration: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Course {
    /// Never seen.
    pub(crate) fn unknown(position: Vector3<f64>) -> Self {
        let mut course = Self::start(position, Vector3::zeros());
        course.forget();
        course
    }

    /// Seen once.
    pub(crate) fn start(position: Vector3<f64>, velocity: Vector3<f64>) -> Self {
        Self {
            position,
            velocity,
            acceleration: Vector3::zeros(),
            covariance: Matrix3::from_diagonal(&Vector3::new(
                NOISE * NOISE,
                SPEED * SPEED,
                STRENGTH * STRENGTH,
            )),
        }
    }

    /// Forgets all of it.
    pub(crate) fn forget(&mut self) {
        self.covariance = Matrix3::from_diagonal_element(NOTHING);
    }

    /// Where it is a step later if nothing is seen of it.
    pub(crate) fn advance(&mut self, law: &Law) {
        let f = &law.onward;
        self.position += self.velocity * f.m12 + self.acceleration * f.m13;
        self.velocity += self.acceleration * f.m23;
        self.acceleration *= f.m33;
        self.covariance = f * self.covariance * f.transpose() + law.spread;
    }

    /// Takes in where it is seen.
    pub(crate) fn correct(&mut self, seen: Vector3<f64>) {
        let surprise = seen - self.position;
        let column: Vector3<f64> = self.covariance.column(0).into();
        let gain = column / (column.x + NOISE * NOISE);
        self.position += surprise * gain.x;
        self.velocity += surprise * gain.y;
        self.acceleration += surprise * gain.z;
        self.covariance -= gain * column.transpose();
    }

    /// Lets its speed die away.
    pub(crate) fn slow(&mut self, share: f64) {
        self.velocity *= share;
        self.acceleration *= share;
    }

    /// How far off its place may be, m².
    pub(crate) fn variance(&self) -> f64 {
        self.covariance.m11
    }

    /// How far off its speed may be, m²/s².
    pub(crate) fn speed_variance(&self) -> f64 {
        self.covariance.m22
    }

    /// All of it, in words.
    pub(crate) fn state(&self) -> impl Iterator<Item = u64> + '_ {
        let vectors = [&self.position, &self.velocity, &self.acceleration];
        (vectors.into_iter().flat_map(|v| v.iter()))
            .chain(self.covariance.iter())
            .map(|x| x.to_bits())
    }
}
