//! What elastic solids of points promise.

mod beams;
mod goldens;
mod hard;
mod laws;
mod tears;

use nalgebra::Vector3;
use sinew_particles::{Material, MaterialLaw, Solid};

const LAWS: [MaterialLaw; 4] = [
    MaterialLaw::Linear,
    MaterialLaw::Corotated,
    MaterialLaw::StVenantKirchhoff,
    MaterialLaw::NeoHookean,
];

fn material(young: f64, poisson: f64, law: MaterialLaw) -> Material {
    Material {
        young,
        poisson,
        law,
    }
}

/// A block of points in the middles of cubes, or of squares where `sides[2]` is 0.
fn block(sides: [u32; 3], spacing: f64) -> Vec<Vector3<f64>> {
    let mut points = Vec::new();
    for z in 0..sides[2].max(1) {
        for y in 0..sides[1] {
            for x in 0..sides[0] {
                let at = |k: u32| (f64::from(k) + 0.5) * spacing;
                let z = if sides[2] == 0 { 0.0 } else { at(z) };
                points.push(Vector3::new(at(x), at(y), z));
            }
        }
    }
    points
}

/// Numbers from −1 to 1 without pattern.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).unwrap()) / 2_147_483_648.0 - 1.0
    }
}

/// The points moved by up to a part of the spacing; in their plane where they share one.
fn shaken(mut points: Vec<Vector3<f64>>, by: f64, seed: u64) -> Vec<Vector3<f64>> {
    let flat = points.iter().all(|x| x.z == points[0].z);
    let mut noise = noise(seed);
    for x in &mut points {
        let [a, b, c] = [noise(), noise(), noise()];
        *x += Vector3::new(a, b, if flat { 0.0 } else { c }) * by;
    }
    points
}

/// The displacements of linear statics, m, by conjugate gradients: `load` N, where `free`.
fn statics(
    solid: &mut Solid,
    rest: &[Vector3<f64>],
    load: &[Vector3<f64>],
    free: &[bool],
) -> Vec<Vector3<f64>> {
    let n = rest.len();
    let mut stiffness = |u: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
        let at: Vec<_> = rest.iter().zip(u).map(|(x, u)| x + u).collect();
        let mut forces = solid.forces(&at);
        for (force, free) in forces.iter_mut().zip(free) {
            *force = if *free { -*force } else { Vector3::zeros() };
        }
        forces
    };
    let dot = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
        a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>()
    };
    let mut u = vec![Vector3::zeros(); n];
    let mut r: Vec<_> = load
        .iter()
        .zip(free)
        .map(|(f, free)| if *free { *f } else { Vector3::zeros() })
        .collect();
    let mut p = r.clone();
    let mut size = dot(&r, &r);
    let enough = size * 1e-20;
    let mut iterations = 0;
    while size > enough {
        iterations += 1;
        assert!(iterations < 20_000, "no equilibrium: {size} of {enough}");
        let product = stiffness(&p);
        let step = size / dot(&p, &product);
        for i in 0..n {
            u[i] += p[i] * step;
            r[i] -= product[i] * step;
        }
        let smaller = dot(&r, &r);
        for i in 0..n {
            p[i] = r[i] + p[i] * (smaller / size);
        }
        size = smaller;
    }
    u
}
