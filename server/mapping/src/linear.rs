use multiversion::multiversion;
use nalgebra::Vector3;

use crate::blocks::for_each_block;
use crate::weights::Weights;

/// The weighted mean of displacements from rest, `x = x⁰ + Σ w (p − p⁰)`. `[M1]`
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    pub(crate) weights: Weights,
    rest_vertices: Vec<Vector3<f64>>,
    rest_points: Vec<Vector3<f64>>,
    /// This step's, one per point: kept between steps for its memory only.
    displacements: Vec<Displacement>,
}

/// p − p⁰ and a zero, so that a load is two full vectors and never straddles a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Displacement([f64; 4]);

impl Linear {
    pub(crate) fn new(
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        weights: Weights,
    ) -> Self {
        Self {
            weights,
            rest_vertices: vertices.to_vec(),
            rest_points: points.to_vec(),
            displacements: vec![Displacement([0.0; 4]); points.len()],
        }
    }

    /// Takes over vertices of another operator of the same points: as those of `to`, ascending, of which the last may be
    /// appended.
    pub(crate) fn take(&mut self, to: &[u32], some: &Self) {
        self.weights.take(to, &some.weights);
        for (&vertex, rest) in to.iter().zip(&some.rest_vertices) {
            match self.rest_vertices.get_mut(vertex as usize) {
                Some(own) => *own = *rest,
                None => self.rest_vertices.push(*rest),
            }
        }
    }

    pub(crate) fn pose(&mut self, points: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        for ((displacement, now), rest) in self
            .displacements
            .iter_mut()
            .zip(points)
            .zip(&self.rest_points)
        {
            let d = now - rest;
            *displacement = Displacement([d.x, d.y, d.z, 0.0]);
        }
        let (rest, displacements, weights) =
            (&self.rest_vertices, &self.displacements, &self.weights);
        let stride = weights.stride;
        for_each_block(out, |first, out| {
            let rows = first * stride..(first + out.len()) * stride;
            pose_block(
                &rest[first..first + out.len()],
                &weights.points[rows.clone()],
                &weights.values[rows],
                stride,
                displacements,
                out,
            );
        });
    }

    /// These vertices, by the displacements of the last pose.
    pub(crate) fn pose_alone(&self, vertices: &[u32], out: &mut [Vector3<f64>]) {
        let stride = self.weights.stride;
        for vertex in vertices.iter().map(|&vertex| vertex as usize) {
            let row = vertex * stride..(vertex + 1) * stride;
            pose_block(
                &self.rest_vertices[vertex..=vertex],
                &self.weights.points[row.clone()],
                &self.weights.values[row],
                stride,
                &self.displacements,
                &mut out[vertex..=vertex],
            );
        }
    }

    /// Bytes that a pose reads and writes, each array once.
    pub(crate) fn bytes(&self) -> usize {
        2 * size_of_val(&*self.rest_vertices)
            + size_of_val(&*self.weights.points)
            + size_of_val(&*self.weights.values)
            + size_of_val(&*self.rest_points)
            + size_of_val(&*self.displacements)
    }
}

/// Poses vertices, each by a row of `stride` points and weights. Rows of the usual lengths are unrolled.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn pose_block(
    rest: &[Vector3<f64>],
    points: &[u32],
    weights: &[f64],
    stride: usize,
    displacements: &[Displacement],
    out: &mut [Vector3<f64>],
) {
    match stride {
        4 => pose_rows::<4>(rest, points, weights, displacements, out),
        8 => pose_rows::<8>(rest, points, weights, displacements, out),
        _ => {
            let rows = points
                .chunks_exact(stride)
                .zip(weights.chunks_exact(stride));
            for ((out, rest), (points, weights)) in out.iter_mut().zip(rest).zip(rows) {
                *out = pose_row(rest, points, weights, displacements);
            }
        }
    }
}

#[inline(always)]
fn pose_rows<const K: usize>(
    rest: &[Vector3<f64>],
    points: &[u32],
    weights: &[f64],
    displacements: &[Displacement],
    out: &mut [Vector3<f64>],
) {
    let rows = points.as_chunks::<K>().0.iter();
    let rows = rows.zip(weights.as_chunks::<K>().0);
    for ((out, rest), (points, weights)) in out.iter_mut().zip(rest).zip(rows) {
        *out = pose_row(rest, points, weights, displacements);
    }
}

#[inline(always)]
fn pose_row(
    rest: &Vector3<f64>,
    points: &[u32],
    weights: &[f64],
    displacements: &[Displacement],
) -> Vector3<f64> {
    let mut sum = [0.0; 4];
    for (&point, &weight) in points.iter().zip(weights) {
        let Displacement(d) = &displacements[point as usize];
        for axis in 0..4 {
            sum[axis] += weight * d[axis];
        }
    }
    Vector3::new(rest.x + sum[0], rest.y + sum[1], rest.z + sum[2])
}
