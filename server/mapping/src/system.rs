use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::factors::Factors;
use crate::{Polynomial, RadialBasis, RadialFunction};

/// Condition numbers beyond this leave no digit that a picture would show.
const CONDITION: f64 = 1e12;

/// Points nearer than this, relative to the radius of their set, may be one to a system that cannot tell them apart.
const SAME: f64 = 1e-3;

/// The matrix `B = [Φ Q; Qᵀ 0]` of a set of points, solved. `[M10]`
#[derive(Clone, Debug)]
pub(crate) struct System {
    /// The points seen from their centroid, in scales of the function.
    places: Vec<Vector3<f64>>,
    centroid: Vector3<f64>,
    scale: f64,
    function: RadialFunction,
    /// Φ is divided by its greatest entry: the same interpolation, and a condition number without units.
    greatest: f64,
    constant: bool,
    /// The polynomial's slopes are along these, each as long as one over the radius of the points. Where they lie in a
    /// plane or on a line, nothing slopes away from it: of the solutions, the least.
    slopes: Vec<Vector3<f64>>,
    /// Of the points, rms, in scales of the function.
    radius: f64,
    solution: Solution,
}

#[derive(Clone, Debug)]
enum Solution {
    /// Of a regular matrix.
    Regular(Factors),
    /// The pseudo-inverse of a singular one: of the solutions, the least.
    LeastNorm(DMatrix<f64>),
}

impl System {
    /// Solves the system, or says its condition number. O(n³).
    pub(crate) fn new(
        points: impl Iterator<Item = Vector3<f64>> + Clone,
        basis: &RadialBasis,
        scale: f64,
    ) -> Result<Self, f64> {
        let n = points.clone().count();
        // Differences first: a set far from the origin loses nothing.
        let base = points.clone().next().unwrap_or_default();
        let mean = points.clone().map(|p| p - base).sum::<Vector3<f64>>() / n.max(1) as f64;
        let centroid = base + mean;
        let places: Vec<_> = points.map(|p| (p - centroid) / scale).collect();
        let spread: Matrix3<f64> = places.iter().map(|p| p * p.transpose()).sum();
        let radius = (spread.trace() / n.max(1) as f64).sqrt();
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let mut system = Self {
            places,
            centroid,
            scale,
            function: basis.function,
            greatest: 1.0,
            constant: basis.polynomial >= Polynomial::Constant,
            slopes: Vec::new(),
            radius,
            solution: Solution::LeastNorm(DMatrix::zeros(0, 0)),
        };
        if basis.polynomial == Polynomial::Linear && spread.iter().all(|entry| entry.is_finite()) {
            let eigen = spread.symmetric_eigen();
            let least = (eigen.eigenvalues.max() / CONDITION).max(f64::MIN_POSITIVE);
            let seen = eigen.eigenvalues.iter().map(|value| *value > least);
            let axes = eigen.eigenvectors.column_iter().zip(seen);
            let axes = axes.filter(|(_, seen)| *seen);
            system.slopes = axes.map(|(axis, _)| axis / radius).collect();
        }
        let matrix = system.matrix();
        if !matrix.iter().all(|entry| entry.is_finite()) {
            return Err(f64::INFINITY);
        }
        system.solution = system.factor(matrix)?;
        Ok(system)
    }

    /// B; sets [`Self::greatest`].
    fn matrix(&mut self) -> DMatrix<f64> {
        let (n, size) = (self.places.len(), self.size());
        let mut matrix = DMatrix::zeros(size, size);
        for (place, mut column) in self.places.iter().zip(matrix.column_iter_mut()) {
            self.fill(place, column.as_mut_slice());
        }
        let greatest = matrix.view((0, 0), (n, n)).amax();
        if greatest > 0.0 {
            matrix.view_mut((0, 0), (n, n)).unscale_mut(greatest);
            self.greatest = greatest;
        }
        let terms = matrix.view((n, 0), (size - n, n)).transpose();
        matrix.view_mut((0, n), (n, size - n)).copy_from(&terms);
        matrix
    }

    fn factor(&self, matrix: DMatrix<f64>) -> Result<Solution, f64> {
        let sizes = matrix.column_iter().map(|column| column.lp_norm(1));
        let norm = sizes.fold(0.0, f64::max);
        let factors = Factors::of(matrix.clone());
        if factors.condition(norm) <= CONDITION {
            return Ok(Solution::Regular(factors));
        }
        let eigen = matrix.symmetric_eigen();
        let sizes = eigen.eigenvalues.abs();
        let (least, condition) = (sizes.max() / CONDITION, sizes.max() / sizes.min());
        let mut scaled = eigen.eigenvectors.clone();
        let axes = eigen.eigenvectors.column_iter();
        for ((&value, axis), mut scaled) in
            (eigen.eigenvalues.iter().zip(axes)).zip(scaled.column_iter_mut())
        {
            if value.abs() > least {
                scaled /= value;
            } else if self.loses(axis.as_slice()) {
                return Err(condition);
            } else {
                scaled.fill(0.0);
            }
        }
        Ok(Solution::LeastNorm(scaled * eigen.eigenvectors.transpose()))
    }

    /// Whether displacements would be lost with this direction: none are where it is only the polynomial's or only the
    /// difference between points in one place.
    fn loses(&self, direction: &[f64]) -> bool {
        let near = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm() <= SAME * self.radius;
        let mut lost = vec![0.0; self.places.len()];
        for (place, share) in self.places.iter().zip(direction) {
            let same = self.places.iter().position(|other| near(other, place));
            lost[same.expect("a place is near itself")] += share;
        }
        lost.iter().map(|share| share * share).sum::<f64>() > 1e-8
    }

    /// Rows of the matrix: points, then terms of the polynomial.
    pub(crate) fn size(&self) -> usize {
        self.places.len() + usize::from(self.constant) + self.slopes.len()
    }

    /// A position seen from the centroid of the points, in scales of the function.
    pub(crate) fn place(&self, x: &Vector3<f64>) -> Vector3<f64> {
        (x - self.centroid) / self.scale
    }

    /// φ at a place around each point, then the polynomial's terms.
    pub(crate) fn fill(&self, place: &Vector3<f64>, row: &mut [f64]) {
        let (values, terms) = row.split_at_mut(self.places.len());
        for (value, point) in values.iter_mut().zip(&self.places) {
            *value = self.function.of_square((place - point).norm_squared()) / self.greatest;
        }
        let constant = self.constant.then_some(1.0);
        let slopes = self.slopes.iter().map(|slope| slope.dot(place));
        for (term, value) in terms.iter_mut().zip(constant.into_iter().chain(slopes)) {
            *term = value;
        }
    }

    /// Solves for each column in its place. B is its own transpose: a right side of displacements gives coefficients,
    /// and one of [`Self::fill`] the weights of displacements. O(n²) each.
    pub(crate) fn solve(&self, right: &mut DMatrix<f64>) {
        match &self.solution {
            Solution::Regular(factors) => factors.solve(right),
            Solution::LeastNorm(inverse) => *right = inverse * &*right,
        }
    }

    pub(crate) fn function(&self) -> RadialFunction {
        self.function
    }

    /// The points as [`Self::place`] sees them.
    pub(crate) fn places(&self) -> &[Vector3<f64>] {
        &self.places
    }

    /// Solved coefficients as those of φ; and the polynomial as its value at the centroid and its change along each axis.
    pub(crate) fn coefficients(&self, solved: &DMatrix<f64>) -> (Vec<[f64; 3]>, [Vector3<f64>; 4]) {
        let n = self.places.len();
        let row = |row: usize| Vector3::new(solved[(row, 0)], solved[(row, 1)], solved[(row, 2)]);
        let of_points = (0..n).map(|j| (row(j) / self.greatest).into()).collect();
        let mut plane = [Vector3::zeros(); 4];
        if self.constant {
            plane[0] = row(n);
        }
        for (slope, term) in self.slopes.iter().zip(n + usize::from(self.constant)..) {
            for axis in 0..3 {
                plane[axis + 1] += row(term) * slope[axis];
            }
        }
        (of_points, plane)
    }

    /// Bytes of a solution.
    pub(crate) fn bytes(&self) -> usize {
        self.size() * self.size() * size_of::<f64>()
    }
}
