//! The same bits for any number of threads.

use nalgebra::{UnitQuaternion, Vector3};
use sinew_particles::{
    Attraction, AttractionLaw, EndingKind, FrameSpec, Integrator, PairFriction, PairSpec,
    SystemSpec,
};

use crate::{INTEGRATORS, build, particles, run, springs};

/// A sheet of `side` × `side` particles hung by one edge, large enough for the parallel path.
fn sheet(side: u32) -> SystemSpec {
    let index = |row: u32, column: u32| row * side + column;
    let mut links = Vec::new();
    for row in 0..side {
        for column in 0..side {
            if column + 1 < side {
                links.push([index(row, column), index(row, column + 1)]);
            }
            if row + 1 < side {
                links.push([index(row, column), index(row + 1, column)]);
            }
        }
    }
    let cells = (0..side).flat_map(|row| (0..side).map(move |column| (row, column)));
    let places = cells.map(|(row, column)| {
        let (x, y) = (f64::from(column), f64::from(row));
        Vector3::new(x, y, 0.1 * (0.7 * x).sin() * (0.3 * y).cos())
    });
    SystemSpec {
        masses: vec![0.01; (side * side) as usize],
        fixed: (0..side).collect(),
        links: vec![springs(links, 30.0, 0.01, 0.9)],
        gravity: Vector3::new(0.0, 0.0, -9.81),
        ..particles(places.collect())
    }
}

fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap().install(work)
}

#[test]
fn positions_have_the_same_bits_for_any_number_of_threads() {
    for integrator in INTEGRATORS {
        let travel = |threads: usize| {
            with_threads(threads, || {
                let mut system = build(SystemSpec {
                    integrator,
                    ..sheet(130)
                });
                run(&mut system, 5, 1e-3);
                let bits = |x: &Vector3<f64>| x.data.0[0].map(f64::to_bits);
                system.positions().iter().map(bits).collect::<Vec<_>>()
            })
        };
        let alone = travel(1);
        assert_eq!(alone, travel(2));
        assert_eq!(alone, travel(8));
    }
}

#[test]
fn the_order_of_particles_and_of_links_changes_rounding_only() {
    let side = 20;
    let spec = sheet(side);
    let n = side * side;
    // A permutation without pattern: 7 and 400 have no common factor.
    let new = |i: u32| (7 * i + 3) % n;
    let mut shuffled = spec.clone();
    for i in 0..n {
        shuffled.positions[new(i) as usize] = spec.positions[i as usize];
    }
    shuffled.fixed = spec.fixed.iter().map(|&i| new(i)).collect();
    for ends in &mut shuffled.links[0].ends {
        *ends = [new(ends[1]), new(ends[0])];
    }
    shuffled.links[0].ends.reverse();
    let [mut one, mut other] = [spec, shuffled].map(build);
    for system in [&mut one, &mut other] {
        run(system, 200, 1e-3);
    }
    for i in 0..n {
        let moved = one.positions()[i as usize] - other.positions()[new(i) as usize];
        assert!(moved.norm() < 1e-12, "{i}: {moved}");
    }
}

#[test]
fn divergence_names_the_same_particle_for_any_number_of_threads() {
    let diverge = |threads: usize| {
        with_threads(threads, || {
            let mut system = build(SystemSpec {
                integrator: Integrator::SemiImplicitEuler,
                ..sheet(130)
            });
            loop {
                if let Err(diverged) = system.step(100.0) {
                    return diverged;
                }
            }
        })
    };
    assert_eq!(diverge(1), diverge(8));
}

#[test]
fn neighbours_and_bodies_have_the_same_bits_for_any_number_of_threads() {
    let side = 22;
    let places = (0..side * side * side).map(|i| {
        let at = [i % side, i / side % side, i / side / side].map(f64::from);
        let jitter = (0.7 * at[0]).sin() * (0.3 * at[1]).cos() * 0.1;
        Vector3::from(at) + Vector3::repeat(jitter)
    });
    let places: Vec<_> = places.collect();
    let n = places.len();
    assert!(n > 8192, "more than a block");
    let spec = SystemSpec {
        frames: Some(FrameSpec {
            orientations: vec![UnitQuaternion::identity(); n],
            spins: vec![Vector3::zeros(); n],
            moments: vec![Vector3::new(0.1, 0.2, 0.3); n],
            damping: 0.0,
        }),
        pairs: Some(PairSpec {
            attraction: Some(Attraction {
                law: AttractionLaw::LennardJones {
                    stiffness: 1.0,
                    rest_length: 1.0,
                    exponent: 4,
                },
                ending: EndingKind::Shifted,
                table: None,
            }),
            friction: Some(PairFriction {
                sliding: 0.1,
                turning: 0.1,
            }),
            reach: 1.6,
            ..PairSpec::default()
        }),
        ..particles(places)
    };
    let travel = |threads: usize| {
        with_threads(threads, || {
            let mut system = build(spec.clone());
            run(&mut system, 10, 0.02);
            let columns = system.hidden_state();
            let bits = columns.into_iter().flatten().map(|x| x.to_bits());
            bits.collect::<Vec<_>>()
        })
    };
    let alone = travel(1);
    assert_eq!(alone, travel(2));
    assert_eq!(alone, travel(8));
}
