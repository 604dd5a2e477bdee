use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Vector3};

/// A chain of bodies that cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "bodies {first} and the next bend by {curvature}/m over {length} m: \
     no circle is so small; keep curvature times length below 2"
)]
pub struct TooCurved {
    /// The first body of the pair.
    pub first: usize,
    /// Mean curvature of both, 1/m.
    pub curvature: f64,
    /// Distance between both, m.
    pub length: f64,
}

/// A plane chain whose bodies are, pair by pair, at rest under the form interaction: such as an arc or a spiral. `[P34]`
///
/// * `curvatures` – of each body, 1/m.
/// * `length` – between consecutive bodies, m.
/// * returns world from body, m: from the origin on in the plane z = 0, with x the normal away from the centre of
///   curvature and y along the chain.
///
/// # Errors
/// [`TooCurved`] where two bodies lie on no common circle.
pub fn arc_chain(curvatures: &[f64], length: f64) -> Result<Vec<Isometry3<f64>>, TooCurved> {
    let (mut at, mut angle) = (Vector3::zeros(), 0.0_f64);
    let body = |at: Vector3<f64>, angle: f64| Isometry3::new(at, Vector3::z() * angle);
    let mut bodies = Vec::with_capacity(curvatures.len());
    for (first, ends) in curvatures.windows(2).enumerate() {
        bodies.push(body(at, angle));
        let curvature = 0.5 * (ends[0] + ends[1]);
        let sine = 0.5 * curvature * length;
        if sine.is_nan() || sine.abs() >= 1.0 {
            return Err(TooCurved {
                first,
                curvature,
                length,
            });
        }
        let half = sine.asin();
        let (sin, cos) = (angle + FRAC_PI_2 + half).sin_cos();
        at += Vector3::new(cos, sin, 0.0) * length;
        angle += 2.0 * half;
    }
    if !curvatures.is_empty() {
        bodies.push(body(at, angle));
    }
    Ok(bodies)
}
