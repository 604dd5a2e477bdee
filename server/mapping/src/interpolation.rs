use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};

use crate::blocks::for_each_block;
use crate::radial::{Centre, LANES, add};
use crate::system::System;
use crate::{MappingError, RadialBasis, rbf};

/// One interpolation for all vertices: its coefficients are solved for each step, and the function is evaluated for
/// each pair of vertex and point. `[M10]`
///
/// Weights per pair would be read from memory instead, 8 bytes each: no faster than to evaluate the function, 8 GB for a
/// million vertices and a thousand points, and a solution per vertex to make them.
#[derive(Clone, Debug)]
pub(crate) struct Interpolation {
    system: Arc<System>,
    set: Vec<u32>,
    rest_vertices: Vec<Vector3<f64>>,
    /// p⁰ of the set.
    rest_points: Vec<Vector3<f64>>,
}

impl Interpolation {
    /// # Errors
    /// As [`rbf::solved`]; [`MappingError::Overflow`] for a vertex too far for the function.
    pub(crate) fn new(
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        set: &[u32],
        basis: &RadialBasis,
        scale: f64,
    ) -> Result<Self, MappingError> {
        let all = Self {
            system: Arc::new(rbf::solved(set, points, basis, scale, 0)?),
            set: set.to_vec(),
            rest_vertices: Vec::new(),
            rest_points: set.iter().map(|&j| points[j as usize]).collect(),
        };
        all.at(vertices)
    }

    /// The same interpolation for other vertices.
    ///
    /// # Errors
    /// [`MappingError::Overflow`] for a vertex too far for the function.
    pub(crate) fn at(&self, vertices: &[Vector3<f64>]) -> Result<Self, MappingError> {
        let sizes = self.system.places().iter().map(Vector3::norm);
        let extent = sizes.fold(0.0, f64::max);
        let beyond = |x: &Vector3<f64>| {
            let reach = self.system.place(x).norm() + extent;
            !self.system.function().of_square(reach * reach).is_finite()
        };
        match vertices.iter().position(beyond) {
            Some(vertex) => Err(MappingError::Overflow { vertex }),
            None => Ok(Self {
                system: Arc::clone(&self.system),
                set: self.set.clone(),
                rest_vertices: vertices.to_vec(),
                rest_points: self.rest_points.clone(),
            }),
        }
    }

    /// Takes over the vertices of another, ascending; those that it does not have yet are the last.
    pub(crate) fn take(&mut self, vertices: &[u32], some: &Self) {
        for (&vertex, &x) in vertices.iter().zip(&some.rest_vertices) {
            match self.rest_vertices.get_mut(vertex as usize) {
                Some(own) => *own = x,
                None => self.rest_vertices.push(x),
            }
        }
    }

    pub(crate) fn pose(&self, points: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        let mut columns = DMatrix::zeros(self.system.size(), 3);
        for ((row, &j), rest) in self.set.iter().enumerate().zip(&self.rest_points) {
            columns.set_row(row, &(points[j as usize] - rest).transpose());
        }
        self.system.solve(&mut columns);
        let (coefficients, plane) = self.system.coefficients(&columns);
        let places = self.system.places().iter();
        let centres: Vec<Centre> = (places.zip(coefficients))
            .map(|(&place, coefficients)| Centre {
                place: place.into(),
                coefficients,
            })
            .collect();
        for_each_block(out, |first, out| {
            let rest = &self.rest_vertices[first..first + out.len()];
            for (out, rest) in out.chunks_mut(LANES).zip(rest.chunks(LANES)) {
                self.pose_lanes(&centres, &plane, rest, out);
            }
        });
    }

    /// `x = x⁰ + Σ λ φ + q` for up to [`LANES`] vertices.
    fn pose_lanes(
        &self,
        centres: &[Centre],
        plane: &[Vector3<f64>; 4],
        rest: &[Vector3<f64>],
        out: &mut [Vector3<f64>],
    ) {
        let (mut places, mut sums) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, x) in rest.iter().enumerate() {
            let at = self.system.place(x);
            let sum = plane[0] + plane[1] * at.x + plane[2] * at.y + plane[3] * at.z;
            for axis in 0..3 {
                places[axis][lane] = at[axis];
                sums[axis][lane] = sum[axis];
            }
        }
        add(self.system.function(), centres, &places, &mut sums);
        for (lane, (out, x)) in out.iter_mut().zip(rest).enumerate() {
            *out = x + Vector3::new(sums[0][lane], sums[1][lane], sums[2][lane]);
        }
    }

    /// The weights of the points at a vertex. O(n²).
    pub(crate) fn row(&self, vertex: usize) -> Vec<(u32, f64)> {
        let mut row = DMatrix::zeros(self.system.size(), 1);
        let place = self.system.place(&self.rest_vertices[vertex]);
        self.system.fill(&place, row.as_mut_slice());
        self.system.solve(&mut row);
        self.set.iter().copied().zip(row.iter().copied()).collect()
    }

    /// Bytes that a pose reads and writes, each array once.
    pub(crate) fn bytes(&self) -> usize {
        2 * size_of_val(&*self.rest_vertices) + self.system.bytes()
    }
}
