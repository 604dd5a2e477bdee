//! The same bits for any number of threads.

use nalgebra::Vector3;
use sinew_particles::{Network, NetworkSpec};

/// A sheet of `side` × `side` particles hung by one edge, large enough for the parallel path.
fn sheet(side: u32) -> NetworkSpec {
    let index = |row: u32, column: u32| row * side + column;
    let mut springs = Vec::new();
    for row in 0..side {
        for column in 0..side {
            if column + 1 < side {
                springs.push([index(row, column), index(row, column + 1)]);
            }
            if row + 1 < side {
                springs.push([index(row, column), index(row + 1, column)]);
            }
        }
    }
    let cells = (0..side).flat_map(|row| (0..side).map(move |column| (row, column)));
    let n = (side * side) as usize;
    NetworkSpec {
        positions: cells
            .map(|(row, column)| {
                let (x, y) = (f64::from(column), f64::from(row));
                Vector3::new(x, y, 0.1 * (0.7 * x).sin() * (0.3 * y).cos())
            })
            .collect(),
        velocities: vec![Vector3::zeros(); n],
        masses: vec![0.01; n],
        fixed: (0..side).collect(),
        stiffness: vec![30.0; springs.len()],
        damping: vec![0.01; springs.len()],
        rest_lengths: Some(vec![0.9; springs.len()]),
        springs,
        gravity: Vector3::new(0.0, 0.0, -9.81),
    }
}

#[test]
fn positions_have_the_same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut network = Network::new(sheet(70)).unwrap();
            let dt = 0.5 * network.largest_stable_step();
            for _ in 0..50 {
                network.step(dt).unwrap();
            }
            let bits = |x: &Vector3<f64>| x.data.0[0].map(f64::to_bits);
            network.positions().iter().map(bits).collect::<Vec<_>>()
        })
    };
    let alone = run(1);
    assert_eq!(alone, run(2));
    assert_eq!(alone, run(8));
}

#[test]
fn divergence_names_the_same_particle_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut network = Network::new(sheet(70)).unwrap();
            loop {
                if let Err(diverged) = network.step(100.0) {
                    return diverged;
                }
            }
        })
    };
    assert_eq!(run(1), run(8));
}
