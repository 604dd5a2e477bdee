use nalgebra::Vector3;

use crate::NetworkError;

/// A mass-spring network as described, before anything is checked. Columns have one entry per particle or per spring.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NetworkSpec {
    /// At the start, m, one per particle.
    pub positions: Vec<Vector3<f64>>,
    /// At the start, m/s, one per particle; that of a fixed particle is taken as zero.
    pub velocities: Vec<Vector3<f64>>,
    /// kg, > 0, one per particle.
    pub masses: Vec<f64>,
    /// Particles that never move; naming one twice is the same as once.
    pub fixed: Vec<u32>,
    /// The two particles of each spring.
    pub springs: Vec<[u32; 2]>,
    /// N/m, ≥ 0, one per spring.
    pub stiffness: Vec<f64>,
    /// N s/m along the spring, ≥ 0, one per spring.
    pub damping: Vec<f64>,
    /// m, ≥ 0, one per spring; `None` for the distances at the start.
    pub rest_lengths: Option<Vec<f64>>,
    /// m/s².
    pub gravity: Vector3<f64>,
}

impl NetworkSpec {
    pub(crate) fn check(&self) -> Result<(), NetworkError> {
        // Exhaustive: a new column does not compile until its check is considered.
        let Self {
            positions,
            velocities,
            masses,
            fixed,
            springs,
            stiffness,
            damping,
            rest_lengths,
            gravity,
        } = self;
        let particles = positions.len();
        length("velocities", velocities.len(), particles, "particles")?;
        length("masses", masses.len(), particles, "particles")?;
        length("stiffness", stiffness.len(), springs.len(), "springs")?;
        length("damping", damping.len(), springs.len(), "springs")?;

        finite("positions", positions)?;
        finite("velocities", velocities)?;
        if let Some(&value) = gravity.iter().find(|value| !value.is_finite()) {
            return Err(NetworkError::Gravity { value });
        }
        let positive = |value: f64| value.is_finite() && value > 0.0;
        admit("masses", masses, positive, "finite and above 0")?;
        let not_negative = |value: f64| value.is_finite() && value >= 0.0;
        let rule = "finite and not below 0";
        admit("stiffness", stiffness, not_negative, rule)?;
        admit("damping", damping, not_negative, rule)?;
        if let Some(rest_lengths) = rest_lengths {
            length("rest_lengths", rest_lengths.len(), springs.len(), "springs")?;
            admit("rest_lengths", rest_lengths, not_negative, rule)?;
        }

        for (entry, &index) in fixed.iter().enumerate() {
            exists("fixed", entry, index, particles)?;
        }
        for (spring, &[left, right]) in springs.iter().enumerate() {
            exists("springs", spring, left, particles)?;
            exists("springs", spring, right, particles)?;
            if left == right {
                let particle = left;
                return Err(NetworkError::SelfSpring { spring, particle });
            }
        }
        Ok(())
    }
}

fn length(
    column: &'static str,
    found: usize,
    expected: usize,
    owner: &'static str,
) -> Result<(), NetworkError> {
    if found == expected {
        return Ok(());
    }
    Err(NetworkError::Length {
        column,
        found,
        expected,
        owner,
    })
}

fn finite(column: &'static str, vectors: &[Vector3<f64>]) -> Result<(), NetworkError> {
    for (entry, vector) in vectors.iter().enumerate() {
        if let Some(&value) = vector.iter().find(|value| !value.is_finite()) {
            let rule = "finite in every component";
            return Err(NetworkError::Value {
                column,
                entry,
                value,
                rule,
            });
        }
    }
    Ok(())
}

fn admit(
    column: &'static str,
    values: &[f64],
    admits: impl Fn(f64) -> bool,
    rule: &'static str,
) -> Result<(), NetworkError> {
    match values.iter().position(|&value| !admits(value)) {
        None => Ok(()),
        Some(entry) => Err(NetworkError::Value {
            column,
            entry,
            value: values[entry],
            rule,
        }),
    }
}

fn exists(
    column: &'static str,
    entry: usize,
    index: u32,
    particles: usize,
) -> Result<(), NetworkError> {
    if (index as usize) < particles {
        return Ok(());
    }
    Err(NetworkError::Index {
        column,
        entry,
        index,
        particles,
    })
}
