//! Sums over the points of a cluster, in vector registers. `[M2]`

use multiversion::multiversion;
use nalgebra::Vector3;

/// A position and a zero, so that a load is a full vector and never straddles a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Place([f64; 4]);

impl Place {
    pub(crate) fn new(at: &Vector3<f64>) -> Self {
        Self([at.x, at.y, at.z, 0.0])
    }
}

/// What a cluster's points sum to, each from the first one.
pub(crate) struct Sums {
    /// The first point, m.
    pub(crate) base: Vector3<f64>,
    /// Σ ω (p − base), m.
    pub(crate) mean: Vector3<f64>,
    /// The columns of Σ ω (p − base) (p⁰ − c⁰)ᵀ, m²: the arms at rest sum to 0, so p may be from anywhere. `[M2]`
    pub(crate) covariance: [Vector3<f64>; 3],
    /// Σ ω |p − base|², m².
    pub(crate) squares: f64,
}

/// Of a cluster with these points, their shares ω and their arms p⁰ − c⁰ at rest.
pub(crate) fn sums(set: &[u32], shares: &[f64], arms: &[Vector3<f64>], places: &[Place]) -> Sums {
    let base = set.first().map_or([0.0; 4], |&j| places[j as usize].0);
    let [mean, x, y, z, squares] = add(base, set, shares, arms, places);
    let vector = |row: [f64; 4]| Vector3::new(row[0], row[1], row[2]);
    Sums {
        base: vector(base),
        mean: vector(mean),
        covariance: [x, y, z].map(vector),
        squares: squares[0] + squares[1] + squares[2],
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn add(
    base: [f64; 4],
    set: &[u32],
    shares: &[f64],
    arms: &[Vector3<f64>],
    places: &[Place],
) -> [[f64; 4]; 5] {
    let mut sums = [[0.0; 4]; 5];
    for ((&j, &share), arm) in set.iter().zip(shares).zip(arms) {
        let Place(place) = &places[j as usize];
        let now: [f64; 4] = std::array::from_fn(|i| place[i] - base[i]);
        let weighted = now.map(|x| x * share);
        for i in 0..4 {
            sums[0][i] += weighted[i];
            sums[1][i] += weighted[i] * arm.x;
            sums[2][i] += weighted[i] * arm.y;
            sums[3][i] += weighted[i] * arm.z;
            sums[4][i] += weighted[i] * now[i];
        }
    }
    sums
}
