use nalgebra::Vector3;

/// How much particles move about their common motion: `√(Σ m |δ − δ̄|² / m̄)`, m. `[P33]`
///
/// * `displacements` – of each particle over a step, m; δ̄ is their mean, weighted by mass.
/// * `masses` – kg, one per particle, > 0.
///
/// # Panics
/// If the columns differ in length.
#[must_use]
pub fn oscillation(displacements: &[Vector3<f64>], masses: &[f64]) -> f64 {
    assert_eq!(displacements.len(), masses.len(), "one mass for each");
    let total: f64 = masses.iter().sum();
    if total == 0.0 {
        return 0.0;
    }
    let weighted = displacements.iter().zip(masses);
    let mean: Vector3<f64> = weighted.clone().map(|(d, &m)| d * m).sum::<Vector3<f64>>() / total;
    let spread: f64 = weighted.map(|(d, m)| m * (d - mean).norm_squared()).sum();
    #[expect(clippy::cast_precision_loss, reason = "a count of particles")]
    let count = masses.len() as f64;
    (spread * count / total).sqrt()
}
