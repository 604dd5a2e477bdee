//! Cohesion whose rest length depends on the direction.

use nalgebra::{Matrix3, Vector3};

use super::{PairLoad, law::Cohesion};

/// `Φ = ε Ψ(x)` with `x² = r·G r`, where G is the mean of both ends' `R diag(1/ρ²) Rᵀ` and Ψ the potential of the
/// cohesion force free of scale: ellipsoids that rest where spheres would touch. `[P31]`
#[derive(Clone, Debug)]
pub(super) struct DirectedCohesion {
    energy: f64, // J
    sharpness: f64,
    /// Inverse squares of the radii, 1/m².
    metric: Vec<Vector3<f64>>,
}

/// Least distance, in rest lengths.
const CORE: f64 = 1e-3;

impl DirectedCohesion {
    pub(super) fn new(stiffness: f64, sharpness: f64, radii: Vec<Vector3<f64>>) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "a count of particles")]
        let count = radii.len().max(1) as f64;
        let volume = radii.iter().map(|radii| radii.product()).sum::<f64>() / count;
        let metric = |radii: Vector3<f64>| radii.map(|radius| radius.powi(-2));
        Self {
            energy: stiffness * volume.cbrt().powi(2),
            sharpness,
            metric: radii.into_iter().map(metric).collect(),
        }
    }

    /// `G r` of each end.
    fn stretched(
        &self,
        r: Vector3<f64>,
        frames: [&Matrix3<f64>; 2],
        ends: [usize; 2],
    ) -> [Vector3<f64>; 2] {
        [0, 1].map(|end| {
            let in_body = frames[end].tr_mul(&r);
            frames[end] * in_body.component_mul(&self.metric[ends[end]])
        })
    }

    pub(super) fn add_load(
        &self,
        r: Vector3<f64>,
        frames: [&Matrix3<f64>; 2],
        ends: [usize; 2],
        load: &mut PairLoad,
    ) {
        let stretched = self.stretched(r, frames, ends);
        let mean = (stretched[0] + stretched[1]) * 0.5;
        let x = mean.dot(&r).sqrt().max(CORE);
        let strength = self.energy * Cohesion::shape(self.sharpness, x) / x;
        load.push += mean * strength;
        for (torque, stretched) in load.torques.iter_mut().zip(stretched) {
            *torque -= r.cross(&stretched) * (0.5 * strength);
        }
    }

    /// J
    pub(super) fn energy(
        &self,
        r: Vector3<f64>,
        frames: [&Matrix3<f64>; 2],
        ends: [usize; 2],
    ) -> f64 {
        let [a, b] = self.stretched(r, frames, ends);
        let x = (0.5 * (a + b).dot(&r)).sqrt().max(CORE);
        self.energy * Cohesion::potential(self.sharpness, x)
    }

    /// About the greatest stiffness of a pair near rest, N/m: the law is flat at rest and steepest beside it.
    pub(super) fn stiffness(&self) -> f64 {
        let metric = self.metric.iter().map(Vector3::max);
        self.energy * metric.fold(0.0, f64::max)
    }
}
