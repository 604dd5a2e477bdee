//! Solids that tear.

use nalgebra::{Matrix3, Vector3};
use sinew_particles::{
    Dimension, Integration, MaterialLaw, Metric, Reach, Solid, SolidSpec, Stepping, System,
    SystemSpec,
};

use super::{block, material, shaken};
use crate::momenta;

const SPACING: f64 = 0.1;
const BREAK: f64 = 1.6;

fn spec(points: &[Vector3<f64>]) -> SolidSpec {
    SolidSpec {
        break_at_stretch: Some(BREAK),
        volumes: Some(vec![SPACING.powi(3); points.len()]),
        ..SolidSpec::new(material(1e4, 0.3, MaterialLaw::Corotated), 1_000.0)
    }
}

/// A block whose halves along x come one after the other, irregular.
fn halves() -> (Vec<Vector3<f64>>, usize) {
    let grid = block([10, 5, 5], SPACING);
    let is_left = |x: &&Vector3<f64>| x.x < 5.0 * SPACING;
    let [left, right]: [Vec<_>; 2] = [true, false].map(|left| {
        let half = grid.iter().filter(|x| is_left(x) == left);
        half.copied().collect()
    });
    let cut = left.len();
    (shaken([left, right].concat(), 0.2 * SPACING, 3), cut)
}

/// The points from `cut` on moved away.
fn parted(points: &[Vector3<f64>], cut: usize) -> Vec<Vector3<f64>> {
    let mut parted = points.to_vec();
    parted[cut..].iter_mut().for_each(|x| x.x += 10.0);
    parted
}

#[test]
fn a_body_torn_in_two_is_what_its_halves_are_alone() {
    let (points, cut) = halves();
    let spec = SolidSpec {
        metric: Metric::Geodesic { exponent: 1.0 },
        reach: Reach::Length(1.9 * SPACING),
        integration: Integration::Nodal,
        ..spec(&points)
    };
    let mut torn = Solid::new(&spec, &points).unwrap();
    let away = parted(&points, cut);
    let pairs = torn.tear(&away);
    assert!(
        pairs
            .iter()
            .all(|&[a, b]| (a as usize) < cut && b as usize >= cut)
    );
    assert_eq!(torn.report().components, 2);
    let moved = shaken(points.clone(), 0.1 * SPACING, 8);
    let forces = torn.forces(&moved);
    for half in [0..cut, cut..points.len()] {
        let alone = SolidSpec {
            volumes: Some(vec![SPACING.powi(3); half.len()]),
            ..spec.clone()
        };
        let mut alone = Solid::new(&alone, &points[half.clone()]).unwrap();
        for (i, own) in half.clone().enumerate() {
            let first = u32::try_from(half.start).unwrap();
            let seen: Vec<_> = torn.neighbours(own).map(|(j, d)| (j - first, d)).collect();
            assert_eq!(seen, alone.neighbours(i).collect::<Vec<_>>());
        }
        assert_eq!(alone.forces(&moved[half.clone()]), forces[half]);
    }
    assert!(torn.tear(&away).is_empty());
}

#[test]
fn what_is_torn_bit_by_bit_is_what_is_torn_at_once() {
    let (points, _) = halves();
    // Two cuts across the block.
    let opened = |cuts: &[f64]| -> Vec<_> {
        let beyond = |x: &Vector3<f64>| cuts.iter().filter(|cut| x.x > **cut).count();
        let apart = |x: &Vector3<f64>| x + Vector3::x() * (10.0 * beyond(x) as f64);
        points.iter().map(apart).collect()
    };
    for metric in [
        Metric::Graded {
            gap: 1.8,
            exponent: 6.0,
        },
        Metric::Geodesic { exponent: 15.0 },
    ] {
        let spec = SolidSpec {
            metric,
            integration: Integration::Nodal,
            ..spec(&points)
        };
        let mut at_once = Solid::new(&spec, &points).unwrap();
        at_once.tear(&opened(&[0.3, 0.5]));
        let mut by_bits = Solid::new(&spec, &points).unwrap();
        by_bits.tear(&opened(&[0.3]));
        assert_eq!(by_bits.report().components, 2);
        by_bits.tear(&opened(&[0.3, 0.5]));
        assert_eq!(by_bits.report(), at_once.report());
        let moved = shaken(points.clone(), 0.1 * SPACING, 8);
        assert_eq!(by_bits.forces(&moved), at_once.forces(&moved), "{metric:?}");
    }
}

/// A constant stress pushes no one inside, at the tear neither.
#[test]
fn derivatives_beside_a_tear_stay_consistent() {
    let points = shaken(block([16, 9, 0], SPACING), 0.2 * SPACING, 5);
    let spec = SolidSpec {
        dimension: Dimension::Plane,
        ..spec(&points)
    };
    let mut solid = Solid::new(&spec, &points).unwrap();
    let is_right = |x: &Vector3<f64>| x.x > 0.8;
    let mut opened = points.clone();
    for x in opened.iter_mut().filter(|x| is_right(x)) {
        x.x += 10.0;
    }
    assert!(!solid.tear(&opened).is_empty());
    let stretch = Matrix3::from_diagonal(&Vector3::new(1.02, 0.99, 1.0));
    let forces = solid.forces(&points.iter().map(|x| stretch * x).collect::<Vec<_>>());
    let inside = |x: &&Vector3<f64>| {
        (0.15..1.45).contains(&x.x) && (0.15..0.75).contains(&x.y) && (x.x - 0.8).abs() > 0.15
    };
    let inner = points.iter().zip(&forces).filter(|(x, _)| inside(x));
    let worst = inner.map(|(_, f)| f.amax()).fold(0.0, f64::max);
    assert!(worst < 1e-10 * 1e4 * SPACING * SPACING, "{worst}");
}

#[test]
fn two_halves_of_a_bar_fly_apart_and_keep_their_momentum_on_any_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let (positions, cut) = halves();
            let solid = spec(&positions);
            let velocities = (0..positions.len()).map(|i| {
                let away = if i < cut { -4.0 } else { 6.0 };
                Vector3::new(away, 0.0, 0.5)
            });
            let masses = Solid::new(&solid, &positions).unwrap().masses().to_vec();
            let mut system = System::new(SystemSpec {
                velocities: velocities.collect(),
                positions,
                solid: Some(solid),
                stepping: Stepping::Stable { most: 10_000 },
                ..SystemSpec::default()
            })
            .unwrap();
            let before = momenta(&system, &masses);
            for _ in 0..60 {
                system.step(0.005).unwrap();
            }
            let after = momenta(&system, &masses);
            for (before, after) in before.iter().zip(&after) {
                assert!((before - after).norm() < 1e-10 * before.norm());
            }
            assert!(system.solid().unwrap().report().components >= 2);
            let x = system.positions();
            let mean = |half: &[Vector3<f64>]| half.iter().map(|x| x.x).sum::<f64>() / cut as f64;
            assert!(mean(&x[cut..]) - mean(&x[..cut]) > 1.0);
            x.iter()
                .map(|x| x.data.0[0].map(f64::to_bits))
                .collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}
