use nalgebra::{DMatrix, DVector, Dyn, LU, Vector3};
use rayon::prelude::*;

use crate::blocks::BLOCK;
use crate::clusters::cluster;
use crate::distance::Distances;
use crate::weights::Weights;
use crate::{MappingError, Polynomial, RadialBasis, RadialFunction};

/// The most points of one interpolation: its matrix then takes 32 MB, twice while it is solved.
pub const MAX_BASIS: usize = 2_000;

/// Condition numbers beyond this leave no digit that a picture would show.
const CONDITION: f64 = 1e12;

/// Points nearer than this, relative to the radius of their set, may be one to a system that cannot tell them apart.
const SAME: f64 = 1e-3;

impl RadialFunction {
    /// `φ(r/s)` `[M11]`
    fn value(self, q: f64) -> f64 {
        match self {
            Self::Gaussian => (-q * q).exp(),
            Self::ShiftedLog => (q * q + std::f64::consts::E).ln().sqrt(),
            Self::Multiquadric => (q * q + 1.0).sqrt(),
            Self::InverseMultiquadric => (q * q + 1.0).sqrt().recip(),
            Self::InverseQuadratic => (q * q + 1.0).recip(),
            Self::Wendland => {
                let inside = (1.0 - q).max(0.0);
                inside.powi(4) * (4.0 * q + 1.0)
            }
            Self::ThinPlate if q == 0.0 => 0.0,
            Self::ThinPlate => q * q * q.ln(),
            Self::Cubic => q * q * q,
            Self::Linear => q,
        }
    }

    /// The lowest polynomial with which distinct points always have one interpolation: the order of conditional
    /// positive definiteness. `[M10]`
    pub(crate) fn needs(self) -> Polynomial {
        match self {
            Self::Gaussian
            | Self::InverseMultiquadric
            | Self::InverseQuadratic
            | Self::Wendland => Polynomial::None,
            Self::ShiftedLog | Self::Multiquadric | Self::Linear => Polynomial::Constant,
            Self::ThinPlate | Self::Cubic => Polynomial::Linear,
        }
    }

    /// The default scale, in distances between points.
    pub(crate) fn reach(self) -> f64 {
        match self {
            Self::Wendland => 5.0,
            Self::Gaussian
            | Self::ShiftedLog
            | Self::Multiquadric
            | Self::InverseMultiquadric
            | Self::InverseQuadratic
            | Self::ThinPlate
            | Self::Cubic
            | Self::Linear => 2.0,
        }
    }
}

impl Polynomial {
    fn terms(self) -> usize {
        match self {
            Self::None => 0,
            Self::Constant => 1,
            Self::Linear => 4,
        }
    }
}

/// The interpolation of the kept points' displacements as weights of them: one system per set of points, solved once
/// for each vertex. O(n³) per set and O(n²) per vertex of n points. `[M10]`
///
/// # Errors
/// [`MappingError::ManyPoints`], [`MappingError::Condition`] and [`MappingError::Overflow`], for the first set in the
/// order of sets.
pub(crate) fn weights(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    distances: &Distances,
    basis: &RadialBasis,
    scale: f64,
) -> Result<Weights, MappingError> {
    let clusters = cluster(distances); // [C1]
    let sets: Vec<&[u32]> = clusters.sets().collect();
    let largest = sets.iter().map(|set| set.len()).max().unwrap_or(0);
    if largest > MAX_BASIS {
        return Err(MappingError::ManyPoints { points: largest });
    }
    let stride = largest.max(1);
    let mut weights = Weights {
        stride,
        points: vec![distances.points.first().copied().unwrap_or(0); vertices.len() * stride],
        values: vec![0.0; vertices.len() * stride],
    };
    let rows = weights.points.chunks_exact_mut(stride);
    let rows = rows.zip(weights.values.chunks_exact_mut(stride));
    let mut rows: Vec<Row> = (vertices.iter().zip(rows).zip(&clusters.of_vertex))
        .enumerate()
        .map(|(vertex, ((x, (points, values)), &cluster))| Row {
            vertex,
            x,
            cluster,
            points,
            values,
        })
        .collect();
    rows.sort_by_key(|row| row.cluster); // stable, so each group's vertices rise
    let mut groups: Vec<&mut [Row]> = rows.chunk_by_mut(|a, b| a.cluster == b.cluster).collect();
    let refusals: Vec<Option<MappingError>> = groups
        .par_iter_mut()
        .map(|group| {
            let set = sets[group[0].cluster as usize];
            fill(group, set, points, basis, scale).err()
        })
        .collect();
    drop(groups);
    drop(rows);
    match refusals.into_iter().flatten().next() {
        None => Ok(weights),
        Some(refusal) => Err(refusal),
    }
}

/// One vertex and where its weights go.
struct Row<'a> {
    vertex: usize,
    x: &'a Vector3<f64>,
    cluster: u32,
    points: &'a mut [u32],
    values: &'a mut [f64],
}

/// Fills the rows of the vertices that share a set of points.
fn fill(
    rows: &mut [Row],
    set: &[u32],
    points: &[Vector3<f64>],
    basis: &RadialBasis,
    scale: f64,
) -> Result<(), MappingError> {
    if set.is_empty() {
        return Ok(());
    }
    let places = set.iter().map(|&j| points[j as usize]).collect();
    let vertex = rows[0].vertex;
    let system = System::new(places, basis, scale)
        .map_err(|condition| MappingError::Condition { vertex, condition })?;
    let overflows: Vec<Option<usize>> = rows
        .par_chunks_mut(BLOCK)
        .map(|rows| {
            let mut overflow = None;
            for row in rows {
                let solved = system.weights(row.x);
                if !solved.iter().all(|weight| weight.is_finite()) {
                    overflow = overflow.or(Some(row.vertex));
                }
                row.points.fill(set[0]);
                row.points[..set.len()].copy_from_slice(set);
                row.values[..set.len()].copy_from_slice(&solved.as_slice()[..set.len()]);
            }
            overflow
        })
        .collect();
    match overflows.into_iter().flatten().next() {
        None => Ok(()),
        Some(vertex) => Err(MappingError::Overflow { vertex }),
    }
}

/// The matrix `B = [Φ Q; Qᵀ 0]` of a set of points, solved. `[M10]`
struct System {
    places: Vec<Vector3<f64>>,
    function: RadialFunction,
    scale: f64,
    /// Φ is divided by its greatest entry: the same interpolation, and a condition number without units.
    greatest: f64,
    polynomial: Polynomial,
    centroid: Vector3<f64>,
    radius: f64,
    solution: Solution,
}

enum Solution {
    /// Of a regular matrix.
    Regular(LU<f64, Dyn, Dyn>),
    /// The pseudo-inverse of a singular one: of the solutions, the least.
    LeastNorm(DMatrix<f64>),
}

impl System {
    /// Solves the system, or says its condition number.
    fn new(places: Vec<Vector3<f64>>, basis: &RadialBasis, scale: f64) -> Result<Self, f64> {
        let n = places.len();
        // Differences first: a set far from the origin loses nothing.
        let offsets = || places.iter().map(|p| p - places[0]);
        let centroid = places[0] + offsets().sum::<Vector3<f64>>() / n as f64;
        let spread = places.iter().map(|p| (p - centroid).norm_squared());
        let radius = (spread.sum::<f64>() / n as f64).sqrt();
        let mut system = Self {
            function: basis.function,
            scale,
            greatest: 1.0,
            polynomial: basis.polynomial,
            centroid,
            radius: if radius > 0.0 { radius } else { 1.0 },
            solution: Solution::LeastNorm(DMatrix::zeros(0, 0)),
            places,
        };
        let size = n + basis.polynomial.terms();
        let mut matrix = DMatrix::zeros(size, size);
        for (j, place) in system.places.iter().enumerate() {
            matrix.set_column(j, &system.row(place));
        }
        let greatest = matrix.view((0, 0), (n, n)).amax();
        if greatest > 0.0 {
            matrix.view_mut((0, 0), (n, n)).unscale_mut(greatest);
            system.greatest = greatest;
        }
        let terms = matrix.view((n, 0), (size - n, n)).transpose();
        matrix.view_mut((0, n), (n, size - n)).copy_from(&terms);
        if !matrix.iter().all(|entry| entry.is_finite()) {
            return Err(f64::INFINITY);
        }
        system.solution = system.solve(matrix)?;
        Ok(system)
    }

    fn solve(&self, matrix: DMatrix<f64>) -> Result<Solution, f64> {
        let eigenvalues = matrix.symmetric_eigenvalues().abs();
        let condition = eigenvalues.max() / eigenvalues.min();
        if condition <= CONDITION {
            return Ok(Solution::Regular(matrix.lu()));
        }
        let eigen = matrix.symmetric_eigen();
        let least = eigen.eigenvalues.amax() / CONDITION;
        let mut scaled = eigen.eigenvectors.clone();
        let pairs = eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter());
        for (i, (&value, axis)) in pairs.enumerate() {
            if value.abs() > least {
                scaled.column_mut(i).unscale_mut(value);
            } else if self.loses(axis.as_slice()) {
                return Err(condition);
            } else {
                scaled.column_mut(i).fill(0.0);
            }
        }
        Ok(Solution::LeastNorm(scaled * eigen.eigenvectors.transpose()))
    }

    /// Whether displacements would be lost with this direction: none are where it is only the polynomial's (coplanar
    /// points leave a slope open) or only the difference between points in one place.
    fn loses(&self, direction: &[f64]) -> bool {
        let near = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm() <= SAME * self.radius;
        let mut lost = vec![0.0; self.places.len()];
        for (place, share) in self.places.iter().zip(direction) {
            let same = self.places.iter().position(|other| near(other, place));
            lost[same.expect("a place is near itself")] += share;
        }
        lost.iter().map(|share| share * share).sum::<f64>() > 1e-8
    }

    /// φ at x around each point, then the polynomial's terms.
    fn row(&self, x: &Vector3<f64>) -> DVector<f64> {
        let n = self.places.len();
        let mut row = DVector::zeros(n + self.polynomial.terms());
        for (entry, place) in row.iter_mut().zip(&self.places) {
            *entry = self.function.value((x - place).norm() / self.scale) / self.greatest;
        }
        let offset = (x - self.centroid) / self.radius;
        let terms = [1.0, offset.x, offset.y, offset.z];
        row.as_mut_slice()[n..].copy_from_slice(&terms[..self.polynomial.terms()]);
        row
    }

    /// The weights of the points' displacements at x, then numbers without meaning.
    fn weights(&self, x: &Vector3<f64>) -> DVector<f64> {
        let mut row = self.row(x);
        match &self.solution {
            Solution::Regular(lu) => {
                lu.solve_mut(&mut row);
                row
            }
            Solution::LeastNorm(inverse) => inverse * row,
        }
    }
}
