//! Motions of the unit cube with known answers.

use nalgebra::{Rotation3, Unit, Vector3};

/// A motion: from where something is at rest to where it is now, m.
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) at: fn(Vector3<f64>) -> Vector3<f64>,
}

/// Rigid and affine ones, which some mappings reproduce, and two that none does.
pub(crate) const ALL: [Field; 5] = [
    Field {
        name: "rigid",
        at: |x| {
            let axis = Unit::new_normalize(Vector3::new(1.0, 1.0, 1.0));
            CENTRE
                + Rotation3::from_axis_angle(&axis, 30_f64.to_radians()) * (x - CENTRE)
                + Vector3::new(0.2, -0.1, 0.3)
        },
    },
    Field {
        name: "scale",
        at: |x| CENTRE + 1.3 * (x - CENTRE),
    },
    Field {
        name: "shear",
        at: |x| x + Vector3::new(0.5 * (x.z - 0.5), 0.0, 0.0),
    },
    BEND,
    TWIST,
];

const CENTRE: Vector3<f64> = Vector3::new(0.5, 0.5, 0.5);

/// The z axis becomes an arc of 1 rad in the xz plane.
pub(crate) const BEND: Field = Field {
    name: "bend",
    at: |x| {
        let (sin, cos) = (x.z - 0.5).sin_cos();
        let radius = 1.0 - (x.x - 0.5);
        Vector3::new(1.5 - radius * cos, x.y, 0.5 + radius * sin)
    },
};

/// A quarter turn about the z axis from one end to the other.
pub(crate) const TWIST: Field = Field {
    name: "twist",
    at: |x| {
        let angle = (x.z - 0.5) * 90_f64.to_radians();
        CENTRE + Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * (x - CENTRE)
    },
};

/// Points scattered evenly in the unit cube: the additive recurrence of the plastic number's powers.
pub(crate) fn scattered(count: usize) -> Vec<Vector3<f64>> {
    let step = Vector3::new(
        0.819_172_513_396_164,
        0.671_043_606_703_789,
        0.549_700_477_901_97,
    );
    #[expect(clippy::cast_precision_loss, reason = "indices of points are small")]
    let at = |i: usize| (step * (0.5 + i as f64)).map(f64::fract);
    (0..count).map(at).collect()
}

/// How far two sets of positions are apart, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    pub(crate) rms: f64,
    pub(crate) max: f64,
}

impl Gap {
    pub(crate) fn between(ours: &[Vector3<f64>], truth: &[Vector3<f64>]) -> Self {
        assert_eq!(ours.len(), truth.len(), "as many");
        let squares = ours.iter().zip(truth).map(|(x, y)| (x - y).norm_squared());
        let (sum, max) = squares.fold((0.0, 0.0), |(sum, max), s| (sum + s, f64::max(max, s)));
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 vertices")]
        let mean = sum / ours.len() as f64;
        Self {
            rms: mean.sqrt(),
            max: max.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bends_and_twists_keep_lengths_along_their_middle() {
        for field in [BEND, TWIST] {
            let at = |z: f64| (field.at)(Vector3::new(0.5, 0.5, z));
            assert!((at(0.5) - CENTRE).norm() < 1e-15, "{}", field.name);
            let short = (at(0.9) - at(0.9 + 1e-6)).norm();
            assert!((short - 1e-6).abs() < 1e-12, "{}: {short}", field.name);
        }
    }

    #[test]
    fn a_gap_is_its_mean_square_and_its_worst() {
        let rest = [Vector3::zeros(), Vector3::x()];
        let gap = Gap::between(&rest, &[Vector3::zeros(), 3.0 * Vector3::x()]);
        assert_eq!((gap.rms, gap.max), (2_f64.sqrt(), 2.0));
    }
}
