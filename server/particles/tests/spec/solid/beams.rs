//! Beams against beam theory.

use nalgebra::Vector3;
use sinew_particles::{Dimension, Integration, MaterialLaw, Metric, Solid, SolidSpec};

use super::{block, material, shaken, statics};

const YOUNG: f64 = 1e4;
const POISSON: f64 = 0.3;
const HEIGHT: f64 = 0.5;

/// How far the end of a beam of about eight heights sinks under its weight, over what Timoshenko's theory says. It is
/// held from the plane through its root's points on; plane stress.
fn sag(through: u32, shake: f64, change: impl FnOnce(SolidSpec) -> SolidSpec) -> f64 {
    let s = HEIGHT / f64::from(through);
    let (columns, root) = (8 * through, 4);
    let length = (f64::from(columns) + 0.5) * s;
    let grid = block([columns + root + 1, through, 0], s);
    let start = (f64::from(root) + 0.5) * s;
    let held = |x: &Vector3<f64>| x.x < start + 0.25 * s;
    let mut points = shaken(grid.clone(), shake * s, 2);
    for (x, at) in points.iter_mut().zip(&grid) {
        if held(at) {
            *x = *at;
        }
    }
    let spec = SolidSpec::new(material(YOUNG, POISSON, MaterialLaw::Linear), 1.0);
    let spec = SolidSpec {
        dimension: Dimension::Plane,
        volumes: Some(vec![s * s; points.len()]),
        ..spec
    };
    let mut solid = Solid::new(&change(spec), &points).unwrap();
    let free: Vec<bool> = grid.iter().map(|x| !held(x)).collect();
    let load = vec![Vector3::new(0.0, -s * s, 0.0); points.len()];
    let moved = statics(&mut solid, &points, &load, &free);
    let last = start + (f64::from(columns) - 0.5) * s;
    let end = grid.iter().zip(&moved).filter(|(x, _)| x.x > last);
    let tip = end.map(|(_, u)| -u.y).sum::<f64>() / f64::from(through);
    tip / timoshenko(length, length - 0.5 * s)
}

/// Deflection of a cantilever under its weight of 1 N/m³, 1 m thick, at `x` from its root, m; shear by Cowper.
fn timoshenko(length: f64, x: f64) -> f64 {
    let weight = HEIGHT;
    let bending = YOUNG * HEIGHT.powi(3) / 12.0;
    let shear =
        YOUNG / (2.0 * (1.0 + POISSON)) * HEIGHT * 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON);
    weight * (6.0 * length * length * x * x - 4.0 * length * x.powi(3) + x.powi(4))
        / (24.0 * bending)
        + weight * (length * x - 0.5 * x * x) / shear
}

#[test]
fn a_cantilever_sinks_as_timoshenko_says_within_two_per_cent_at_twenty_points_and_converges() {
    let errors = [5, 10, 20].map(|through| sag(through, 0.0, |spec| spec) - 1.0);
    assert!(errors[2].abs() < 0.02, "{errors:?}");
    let order = (errors[0] / errors[2]).abs().log2() / 2.0;
    assert!(order > 1.5, "order {order}: {errors:?}");
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
            sag(through, 0.3, |spec| SolidSpec {
                metric,
                integration,
                ..spec
            }) - 1.0
        };
        let [coarse, fine] = [10, 20].map(|through| error(through, Integration::Consistent));
        let nodal = error(20, Integration::Nodal);
        assert!(
            fine.abs() < 0.12 && fine.abs() < 0.7 * coarse.abs(),
            "{coarse} {fine}"
        );
        assert!(nodal > 3.0 * fine.abs(), "{nodal} {fine}");
    }
}
