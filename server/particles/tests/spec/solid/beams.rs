//! Beams against beam theory.

use nalgebra::Vector3;
use sinew_particles::{Dimension, Integration, MaterialLaw, Metric, Solid, SolidSpec};

use super::{block, material, shaken, statics};

const YOUNG: f64 = 1e4;
const POISSON: f64 = 0.3;
const HEIGHT: f64 = 0.5;

/// A cantilever under its weight.
#[derive(Clone, Copy)]
struct Beam {
    /// Points through its height, and through its width: 0 of a plane.
    through: u32,
    wide: u32,
    /// Points along it for each through its height.
    slender: u32,
    /// By what part of their distance points are moved.
    noise: f64,
}

impl Beam {
    fn plane(through: u32, noise: f64) -> Self {
        Self {
            through,
            wide: 0,
            slender: 8,
            noise,
        }
    }

    fn space(through: u32) -> Self {
        Self {
            through,
            wide: through,
            slender: 5,
            noise: 0.0,
        }
    }

    /// How much further its end sinks in linear statics than Timoshenko's theory says, as a fraction.
    ///
    /// Points are the middles of cubes, save for those held, which lie on the root's plane and own half of one.
    fn error(self, change: impl FnOnce(SolidSpec) -> SolidSpec) -> f64 {
        let Self {
            through,
            wide,
            slender,
            noise,
        } = self;
        let s = HEIGHT / f64::from(through);
        let columns = slender * through;
        let length = (f64::from(columns) + 0.5) * s;
        let mut grid = block([columns + 1, through, wide], s);
        grid.iter_mut().for_each(|x| x.x -= 0.5 * s);
        let held = |x: &Vector3<f64>| x.x < 0.25 * s;
        let mut points = shaken(grid.clone(), noise * s, 2);
        for (x, at) in points.iter_mut().zip(&grid).filter(|(_, at)| held(at)) {
            *x = *at;
        }
        let (dimension, volume) = match wide {
            0 => (Dimension::Plane, s * s),
            _ => (Dimension::Space, s.powi(3)),
        };
        let volumes = grid
            .iter()
            .map(|x| if held(x) { 0.5 * volume } else { volume });
        let spec = SolidSpec {
            dimension,
            volumes: Some(volumes.collect()),
            ..SolidSpec::new(material(YOUNG, POISSON, MaterialLaw::Linear), 1.0)
        };
        let mut solid = Solid::new(&change(spec), &points).unwrap();
        let free: Vec<bool> = grid.iter().map(|x| !held(x)).collect();
        let load = vec![Vector3::new(0.0, -volume, 0.0); points.len()];
        let moved = statics(&mut solid, &points, &load, &free);
        let last = length - 0.5 * s;
        let end = grid
            .iter()
            .zip(&moved)
            .filter(|(x, _)| x.x > last - 0.5 * s);
        let sinks: Vec<f64> = end.map(|(_, u)| -u.y).collect();
        sinks.iter().sum::<f64>() / sinks.len() as f64 / timoshenko(length, last) - 1.0
    }
}

/// Deflection of a cantilever under its weight of 1 N/m³, of any width, at `x` from its root, m; shear by Cowper.
fn timoshenko(length: f64, x: f64) -> f64 {
    let weight = HEIGHT;
    let bending = YOUNG * HEIGHT.powi(3) / 12.0;
    let shear =
        YOUNG / (2.0 * (1.0 + POISSON)) * HEIGHT * 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON);
    weight * (6.0 * length * length * x * x - 4.0 * length * x.powi(3) + x.powi(4))
        / (24.0 * bending)
        + weight * (length * x - 0.5 * x * x) / shear
}

/// The order by which three values converge whose spacings halve, whatever they converge to.
fn order([coarse, middle, fine]: [f64; 3]) -> f64 {
    ((coarse - middle) / (middle - fine)).abs().log2()
}

#[test]
fn a_cantilever_in_the_plane_sinks_as_timoshenko_says_and_converges_by_the_second_order() {
    let errors = [5, 10, 20].map(|through| Beam::plane(through, 0.0).error(|spec| spec));
    assert!(
        errors[1].abs() < 0.01 && errors[2].abs() < 0.005,
        "{errors:?}"
    );
    assert!(order(errors) > 1.9, "{}: {errors:?}", order(errors));
}

#[test]
fn a_cantilever_in_space_sinks_as_timoshenko_says_and_converges_by_the_second_order() {
    let errors = [3, 6, 12].map(|through| Beam::space(through).error(|spec| spec));
    assert!(
        errors[1].abs() < 0.02 && errors[2].abs() < 0.02,
        "{errors:?}"
    );
    assert!(order(errors) > 1.5, "{}: {errors:?}", order(errors));
}

#[test]
fn a_cloud_noisy_by_thirty_per_cent_converges_where_nodal_integration_does_not() {
    for metric in [
        Metric::Geodesic { exponent: 1.0 },
        Metric::Graded {
            gap: 1.8,
            exponent: 6.0,
        },
    ] {
        let error = |through, integration| {
            Beam::plane(through, 0.3).error(|spec| SolidSpec {
                metric,
                integration,
                ..spec
            })
        };
        let [coarse, fine] = [10, 20].map(|through| error(through, Integration::Consistent));
        let nodal = error(20, Integration::Nodal);
        assert!(
            fine.abs() < 0.04 && fine.abs() < 0.5 * coarse.abs(),
            "{coarse} {fine}"
        );
        assert!(nodal > 10.0 * fine.abs(), "{nodal} {fine}");
    }
}
