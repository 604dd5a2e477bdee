//! Clouds and motions that are hard on a solver.

use nalgebra::Vector3;
use sinew_particles::{
    Dimension, Integrator, MaterialLaw, Metric, Solid, SolidSpec, Stepping, Survey, System,
    SystemSpec,
};

use super::{block, material, shaken};

fn rubber(young: f64, poisson: f64) -> SolidSpec {
    SolidSpec {
        damping: 2.0,
        ..SolidSpec::new(material(young, poisson, MaterialLaw::NeoHookean), 1_000.0)
    }
}

/// A body at rest that divides its steps as stability asks.
fn body(positions: Vec<Vector3<f64>>, solid: SolidSpec) -> SystemSpec {
    SystemSpec {
        velocities: vec![Vector3::zeros(); positions.len()],
        positions,
        solid: Some(solid),
        stepping: Stepping::Stable { most: 10_000 },
        ..SystemSpec::default()
    }
}

/// The particles at one end along x.
fn root(positions: &[Vector3<f64>], width: f64) -> Vec<u32> {
    let low = positions.iter().map(|x| x.x).fold(f64::INFINITY, f64::min) + width;
    (0..)
        .zip(positions)
        .filter(|(_, x)| x.x < low)
        .map(|(i, _)| i)
        .collect()
}

/// The system after some frames of 20 ms, and the furthest that a particle went from its rest, m.
fn settle(spec: SystemSpec, frames: u32) -> (System, f64) {
    let rest = spec.positions.clone();
    let mut system = System::new(spec).unwrap();
    for _ in 0..frames {
        system.step(0.02).unwrap();
    }
    let ways = system
        .positions()
        .iter()
        .zip(&rest)
        .map(|(x, r)| (x - r).norm());
    let most = ways.fold(0.0, f64::max);
    (system, most)
}

#[test]
fn nearly_incompressible_rubber_hangs_and_keeps_its_volume() {
    let positions = block([8, 4, 4], 0.1);
    let fixed = root(&positions, 0.1);
    let spec = SystemSpec {
        fixed,
        gravity: Vector3::new(9.81, 0.0, 0.0),
        ..body(positions.clone(), rubber(1e5, 0.499))
    };
    let (system, most) = settle(spec, 50);
    assert!(most < 0.2, "{most}");
    let solid = Solid::new(&rubber(1e5, 0.499), &positions).unwrap();
    let volumes = (0..positions.len()).map(|i| solid.gradient(i, system.positions()).determinant());
    let mean = volumes.sum::<f64>() / positions.len() as f64;
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
}

#[test]
fn a_body_stretched_three_times_then_crushed_to_a_fifth_comes_back_when_released() {
    for law in [MaterialLaw::NeoHookean, MaterialLaw::Corotated] {
        let rest = block([8, 4, 4], 0.1);
        for stretch in [3.0, 0.2] {
            let mut solid = rubber(1e4, 0.3);
            solid.material.law = law;
            // About critical, so that no half of it falls through the other.
            solid.damping = 12.0;
            let spec = body(rest.clone(), solid);
            let mut system = System::new(spec).unwrap();
            let ends = [
                root(&rest, 0.1),
                root(&rest.iter().map(|x| -x).collect::<Vec<_>>(), 0.1),
            ];
            let target = |i: u32| {
                let x = rest[i as usize];
                Vector3::new(x.x * stretch, x.y, x.z)
            };
            let held: Vec<u32> = ends.concat();
            for step in 1..=50 {
                for &i in &held {
                    let part = f64::from(step) / 50.0;
                    system.drag(i, Some(rest[i as usize].lerp(&target(i), part)));
                }
                system.step(0.01).unwrap();
            }
            let length = |system: &System| {
                let x = system.positions();
                x[ends[1][0] as usize].x - x[ends[0][0] as usize].x
            };
            let forced = length(&system);
            assert!((forced / 0.7 - stretch).abs() < 0.05, "{law:?} {forced}");
            for &i in &held {
                system.drag(i, None);
            }
            for _ in 0..300 {
                system.step(0.02).unwrap();
            }
            assert!(
                (length(&system) / 0.7 - 1.0).abs() < 0.02,
                "{law:?} from {stretch}: {}",
                length(&system)
            );
        }
    }
}

#[test]
fn a_neck_of_one_point_holds_two_blocks_together() {
    let mut positions = block([4, 4, 4], 0.1);
    let middle = Vector3::new(0.4, 0.2, 0.2);
    positions.extend((0..24).map(|k| middle + Vector3::x() * (0.05 + 0.1 * f64::from(k))));
    positions.extend(block([4, 4, 4], 0.1).iter().map(|x| x + Vector3::x() * 2.8));
    let fixed = root(&positions, 0.1);
    let solid = rubber(1e6, 0.3);
    let report = Solid::new(&solid, &positions).unwrap().report();
    assert_eq!(report.components, 1);
    // The inner points of the neck see a line and nothing else.
    assert!(report.ranks[1] >= 1 && report.ranks[0] == 0, "{report:?}");
    let spec = SystemSpec {
        fixed,
        gravity: Vector3::new(0.98, 0.0, 0.0),
        ..body(positions, solid)
    };
    let (_, most) = settle(spec, 25);
    assert!(most < 0.1, "{most}");
}

#[test]
fn spacing_that_varies_ten_times_is_one_body() {
    let mut positions = Vec::new();
    let mut x = 0.0;
    let mut s = 0.1;
    while s > 0.01 {
        let rows = (1..)
            .find(|&rows| f64::from(rows) * s > 0.4 - 0.5 * s)
            .unwrap();
        for row in 0..rows {
            positions.push(Vector3::new(
                x + 0.5 * s,
                (f64::from(row) + 0.5) * 0.4 / f64::from(rows),
                0.0,
            ));
        }
        x += s;
        s *= 0.92;
    }
    let fixed = root(&positions, 0.1);
    let solid = SolidSpec {
        dimension: Dimension::Plane,
        ..rubber(1e5, 0.3)
    };
    let report = Solid::new(&solid, &positions).unwrap().report();
    assert_eq!(report.components, 1);
    assert_eq!(report.ranks[2], positions.len());
    let spec = SystemSpec {
        fixed,
        gravity: Vector3::new(0.0, -1.0, 0.0),
        ..body(positions, solid)
    };
    let (_, most) = settle(spec, 10);
    assert!(most < 0.2, "{most}");
}

#[test]
fn a_flat_cloud_in_space_resists_in_its_plane_and_turns_freely() {
    let flat: Vec<_> = block([8, 8, 0], 0.1);
    let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 0.7);
    let positions: Vec<_> = flat.iter().map(|x| turn * x).collect();
    let volumes = Some(vec![0.1 * 0.1 * 0.01; positions.len()]);
    for law in super::LAWS {
        let solid = SolidSpec {
            volumes: volumes.clone(),
            ..SolidSpec::new(material(1e4, 0.3, law), 1_000.0)
        };
        let mut solid = Solid::new(&solid, &positions).unwrap();
        assert_eq!(solid.report().ranks[2], positions.len());
        let most = |forces: Vec<Vector3<f64>>| forces.iter().map(Vector3::amax).fold(0.0, f64::max);
        if law != MaterialLaw::Linear {
            let turned: Vec<_> = positions.iter().map(|x| turn * x).collect();
            assert!(most(solid.forces(&turned)) < 1e-10, "{law:?}");
        }
        let stretched: Vec<_> = positions
            .iter()
            .map(|x| x + Vector3::x() * (0.1 * x.x))
            .collect();
        assert!(most(solid.forces(&stretched)) > 0.01, "{law:?}");
    }
}

#[test]
fn points_alone_twins_lines_and_pieces_are_counted_and_push_no_one_wrongly() {
    let mut positions = block([5, 5, 5], 0.1);
    positions.push(Vector3::new(9.0, 0.0, 0.0));
    positions.push(positions[0]);
    positions.extend((0..6).map(|k| Vector3::new(0.0, 5.0 + 0.1 * f64::from(k), 0.0)));
    for law in super::LAWS {
        let spec = SolidSpec::new(material(1e4, 0.3, law), 1_000.0);
        let mut solid = Solid::new(&spec, &positions).unwrap();
        let report = solid.report();
        assert_eq!(report.components, 3, "{report:?}");
        assert_eq!(report.ranks, [1, 6, 0, positions.len() - 7], "{report:?}");
        let moved = shaken(positions.clone(), 0.01, 4);
        let forces = solid.forces(&moved);
        assert!(forces.iter().all(|f| f.norm().is_finite()));
        assert_eq!(forces[125], Vector3::zeros());
        assert!(solid.energy(&moved).is_finite());
    }
}

#[test]
fn a_survey_names_twins_outliers_pieces_and_sparse_points() {
    let mut positions = block([5, 5, 5], 0.1);
    positions.push(Vector3::new(9.0, 0.0, 0.0));
    positions.push(positions[0]);
    positions.extend(block([3, 3, 3], 0.1).iter().map(|x| x + Vector3::y() * 2.0));
    positions.extend((0..9).map(|k| Vector3::new(0.0, 5.0 + 0.1 * f64::from(k), 0.0)));
    let survey = Survey::new(&positions, Dimension::Space, 1.9).unwrap();
    assert_eq!(survey.twins, [[0, 126]]);
    assert_eq!(survey.pieces, [126, 27, 9]);
    assert_eq!(survey.outliers, [125]);
    assert_eq!(survey.sparse, (154..163).collect::<Vec<u32>>());
    assert!((survey.spacing[1] - 0.1).abs() < 1e-12, "{survey:?}");
    let wrong = Survey::new(&positions, Dimension::Plane, 1.9).unwrap_err();
    assert_eq!(wrong.field, "positions[25].z");
}

#[test]
fn a_body_turned_inside_out_is_finite_and_comes_back() {
    let positions = block([4, 4, 4], 0.1);
    let solid = rubber(1e4, 0.3);
    let mut spec = body(positions.clone(), solid);
    spec.integrator = Integrator::SemiImplicitEuler;
    let mut system = System::new(spec).unwrap();
    // Pulled through itself by the corners of one face.
    let face: Vec<u32> = (0..)
        .zip(&positions)
        .filter(|(_, x)| x.x > 0.3)
        .map(|(i, _)| i)
        .collect();
    for step in 1..=40 {
        for &i in &face {
            let x = positions[i as usize];
            system.drag(i, Some(x - Vector3::x() * (0.015 * f64::from(step))));
        }
        system.step(0.01).unwrap();
    }
    for &i in &face {
        system.drag(i, None);
    }
    for _ in 0..200 {
        system.step(0.02).unwrap();
    }
    assert!(system.positions().iter().all(|x| x.norm() < 10.0));
    let speeds = system.velocities().iter().map(Vector3::norm);
    assert!(speeds.fold(0.0, f64::max) < 0.1);
}

#[test]
fn distances_do_not_depend_on_the_unit() {
    let points = shaken(block([12, 8, 0], 0.1), 0.02, 3);
    let small: Vec<_> = points.iter().map(|x| x * 1e-6).collect();
    let spec = |exponent| SolidSpec {
        dimension: Dimension::Plane,
        metric: Metric::Geodesic { exponent },
        ..rubber(1e4, 0.3)
    };
    let [large, small] = [&points, &small].map(|points| Solid::new(&spec(40.0), points).unwrap());
    for i in 0..points.len() {
        let of = |solid: &Solid| solid.neighbours(i).map(|(j, _)| j).collect::<Vec<_>>();
        assert_eq!(of(&large), of(&small));
    }
}
