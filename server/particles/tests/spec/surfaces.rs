//! Bodies on surfaces whose normals and curvatures are known.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use sinew_particles::{
    Form, Gradient, Normalisation, PairSpec, Surface, SystemSpec, Weighting, surface,
};

use crate::{build, pairs::bodies, particles, run};

/// Points of a sphere, spread by the golden angle.
fn sphere(radius: f64, count: u32) -> Vec<Vector3<f64>> {
    let at = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let angle = 2.399_963_229_728_653 * f64::from(i);
        let side = (1.0 - z * z).sqrt();
        Vector3::new(side * angle.cos(), side * angle.sin(), z) * radius
    };
    (0..count).map(at).collect()
}

fn normal(surface: &Surface, i: usize) -> Vector3<f64> {
    surface.orientations[i] * Vector3::x()
}

#[test]
fn a_cloud_on_a_sphere_bends_alike_everywhere_with_normals_outwards() {
    let error = |count: u32, reach: f64| {
        let points = sphere(2.0, count);
        let found = surface(&points, &[], reach).unwrap();
        for (i, x) in points.iter().enumerate() {
            assert!(normal(&found, i).dot(x) / 2.0 > 0.9999, "{i}");
        }
        let off = found.curvatures.iter().flatten().map(|k| (k - 0.5).abs());
        off.fold(0.0, f64::max)
    };
    // What a quadric leaves out falls with the square of its reach.
    let [coarse, fine] = [error(800, 0.7), error(3_200, 0.35)];
    assert!(coarse < 0.015 && fine < coarse / 3.0, "{coarse} {fine}");
}

#[test]
fn a_tube_bends_about_its_axis_alone() {
    let at = |i: u32| {
        let angle = TAU * f64::from(i % 40) / 40.0;
        Vector3::new(0.1 * f64::from(i / 40), angle.cos(), angle.sin())
    };
    let points: Vec<_> = (0..40 * 30).map(at).collect();
    let found = surface(&points, &[], 0.4).unwrap();
    for (i, x) in points.iter().enumerate() {
        let [most, least] = found.curvatures[i];
        assert!(
            (most - 1.0).abs() < 0.03 && least.abs() < 0.01,
            "{i}: {most} {least}"
        );
        let axis = found.orientations[i] * Vector3::z();
        assert!(axis.x.abs() > 0.999, "{i}: {axis}");
        assert!(normal(&found, i).dot(&Vector3::new(0.0, x.y, x.z)) > 0.999);
    }
}

#[test]
fn triangles_say_which_side_is_outside() {
    let side = 12;
    let at = |i: u32| {
        let (x, y) = (f64::from(i % side), f64::from(i / side));
        Vector3::new(x, y, 0.02 * (x - 5.5) * (y - 5.5))
    };
    let points: Vec<_> = (0..side * side).map(at).collect();
    let corner = |i: u32| (i % side < side - 1 && i / side < side - 1).then_some(i);
    let cells = (0..side * side).filter_map(corner);
    let up: Vec<[u32; 3]> = cells
        .flat_map(|i| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]])
        .collect();
    let down: Vec<_> = up.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let [up, down] = [up, down].map(|triangles| surface(&points, &triangles, 2.5).unwrap());
    for i in 0..points.len() {
        assert!(normal(&up, i).z > 0.9 && normal(&down, i).z < -0.9);
        // A saddle bends both ways, and so it does from either side.
        let ([most, least], [back, forth]) = (up.curvatures[i], down.curvatures[i]);
        assert!((most + forth).abs() < 1e-9 && (least + back).abs() < 1e-9);
    }
    let middle = (side * side / 2 + side / 2) as usize;
    assert!((up.curvatures[middle][0] - 0.02).abs() < 1e-3);
    assert!((up.curvatures[middle][1] + 0.02).abs() < 1e-3);
}

#[test]
fn bodies_of_a_surface_are_at_rest_and_come_back_to_it() {
    let points = sphere(2.0, 600);
    let found = surface(&points, &[], 0.6).unwrap();
    let spec = |points: Vec<Vector3<f64>>| SystemSpec {
        damping: 1.0,
        frames: bodies(found.orientations.clone(), Vector3::repeat(0.1)),
        pairs: Some(PairSpec {
            form: Some(Form {
                form: 1.0,
                coplanarity: 0.0,
                conormality: 0.0,
                cocircularity: 0.0,
                curvatures: found.curvatures.clone(),
                weighting: Weighting::Wendland { reach: 0.6 },
                normalisation: Normalisation::SquaredDistance,
                gradient: Gradient::Whole,
            }),
            reach: 0.6,
            ..PairSpec::default()
        }),
        ..particles(points)
    };
    let rest = build(spec(points.clone())).energy();
    let dent = |x: &Vector3<f64>| {
        if x.z > 1.2 {
            x - Vector3::z() * 0.4 * (x.z - 1.2)
        } else {
            *x
        }
    };
    let mut dented = build(spec(points.iter().map(dent).collect()));
    let start = dented.energy();
    assert!(rest < 0.02 * start, "{rest} of {start}");
    run(&mut dented, 4_000, 0.01);
    assert!(
        dented.energy() < 0.1 * start,
        "{} of {start}",
        dented.energy()
    );
}

#[test]
fn what_is_no_surface_is_refused_by_name() {
    let points = sphere(1.0, 100);
    let refused = |points: &[Vector3<f64>], triangles: &[[u32; 3]], reach| {
        surface(points, triangles, reach).unwrap_err().to_string()
    };
    assert!(refused(&points, &[], 0.01).contains("`reach` is 0.01: it must be so long"));
    assert!(refused(&points, &[], f64::NAN).contains("`reach`"));
    assert!(refused(&points, &[[0, 1, 100]], 1.0).contains("triangles[0]"));
    assert!(refused(&[Vector3::repeat(f64::NAN)], &[], 1.0).contains("points[0]"));
    let line: Vec<_> = (0..9).map(|i| Vector3::x() * f64::from(i)).collect();
    let flat = surface(&line, &[], 20.0).unwrap();
    assert!(
        flat.curvatures.iter().flatten().all(|k| k.abs() < 1e-9),
        "{flat:?}"
    );
}
