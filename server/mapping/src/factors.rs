use nalgebra::{DMatrix, DVector};

/// Columns that are factored one by one before the rest of the matrix follows at once: as fast as a product of matrices.
const PANEL: usize = 48;

/// A matrix as P⁻¹ L U, for solving.
#[derive(Clone, Debug)]
pub(crate) struct Factors {
    /// L below the diagonal, where it is 1; U on and above.
    both: DMatrix<f64>,
    /// With which row each row was exchanged, in this order.
    exchanges: Vec<usize>,
}

impl Factors {
    /// Of a square matrix, by Gaussian elimination with exchanges of rows. O(n³).
    pub(crate) fn of(mut matrix: DMatrix<f64>) -> Self {
        let n = matrix.nrows();
        let mut exchanges = Vec::with_capacity(n);
        for first in (0..n).step_by(PANEL) {
            let width = PANEL.min(n - first);
            let end = first + width;
            for column in first..end {
                exchanges.push(eliminate(&mut matrix, column, end));
            }
            let rest = n - end;
            let corner = matrix.view((first, first), (width, width)).into_owned();
            let mut right = matrix.view((first, end), (width, rest)).into_owned();
            corner.solve_lower_triangular_with_diag_mut(&mut right, 1.0);
            matrix
                .view_mut((first, end), (width, rest))
                .copy_from(&right);
            let below = matrix.view((end, first), (rest, width)).into_owned();
            matrix
                .view_mut((end, end), (rest, rest))
                .gemm(-1.0, &below, &right, 1.0);
        }
        Self {
            both: matrix,
            exchanges,
        }
    }

    /// Solves for each column in its place. Of a singular matrix the result is not finite, or anything. O(n²) each.
    pub(crate) fn solve(&self, right: &mut DMatrix<f64>) {
        for (row, &with) in self.exchanges.iter().enumerate() {
            right.swap_rows(row, with);
        }
        self.both.solve_lower_triangular_with_diag_mut(right, 1.0);
        if !self.both.solve_upper_triangular_mut(right) {
            right.fill(f64::NAN);
        }
    }

    /// An estimate from below of the condition number in the 1-norm, never below that in the 2-norm by much, of the
    /// symmetric matrix that was factored, `norm` its 1-norm: Hager's method with Higham's second start, within a factor of
    /// three but for matrices made against it. Infinite for a singular one. O(n²).
    pub(crate) fn condition(&self, norm: f64) -> f64 {
        let n = self.both.nrows();
        let solved = |start: DVector<f64>| {
            let mut column = DMatrix::from_column_slice(n, 1, start.as_slice());
            self.solve(&mut column);
            column
        };
        let sum = |column: &DMatrix<f64>| column.iter().map(|x| x.abs()).sum::<f64>();
        let mut image = solved(DVector::repeat(n, 1.0 / n as f64));
        let mut inverse = sum(&image);
        for _ in 0..4 {
            let steepest = solved(DVector::from_fn(n, |i, _| 1.0_f64.copysign(image[i])));
            let next = steepest.column(0).iamax();
            image = solved(DVector::from_fn(n, |i, _| f64::from(u8::from(i == next))));
            let found = sum(&image);
            if found <= inverse {
                break;
            }
            inverse = found;
        }
        let alternating = |i: usize, _| {
            let size = 1.0 + i as f64 / (n.max(2) - 1) as f64;
            if i.is_multiple_of(2) { size } else { -size }
        };
        let second = 2.0 * sum(&solved(DVector::from_fn(n, alternating))) / (3.0 * n as f64);
        let condition = inverse.max(second) * norm;
        // What factors of a singular matrix solve is no number.
        if condition.is_nan() {
            f64::INFINITY
        } else {
            condition
        }
    }
}

/// Brings the greatest entry of a column to the diagonal and eliminates those below it, within the panel that ends at `end`.
/// The row that it came from.
fn eliminate(matrix: &mut DMatrix<f64>, column: usize, end: usize) -> usize {
    let n = matrix.nrows();
    let greatest = column
        + matrix
            .view((column, column), (n - column, 1))
            .column(0)
            .iamax();
    matrix.swap_rows(column, greatest);
    let pivot = matrix[(column, column)];
    if pivot == 0.0 {
        return greatest; // all below are 0 too
    }
    let (mut left, mut right) = matrix.columns_range_pair_mut(column..=column, column + 1..end);
    let mut below = left.rows_range_mut(column + 1..);
    below /= pivot;
    for mut next in right.column_iter_mut() {
        let factor = next[column];
        next.rows_range_mut(column + 1..)
            .axpy(-factor, &below.column(0), 1.0);
    }
    greatest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries without a pattern, from −1 to 1.
    fn matrix(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| {
            (1.0 + (i * n + j) as f64 * 12.9898).sin() * 43758.5
        })
        .map(|x| 2.0 * x.fract().abs() - 1.0)
    }

    #[test]
    fn what_is_solved_is_the_solution_at_any_size() {
        for n in [1, 2, PANEL - 1, PANEL, PANEL + 1, 3 * PANEL + 5] {
            let a = matrix(n);
            let x = DMatrix::from_fn(n, 3, |i, j| (i + 2 * j) as f64 - 3.0);
            let mut solved = &a * &x;
            Factors::of(a).solve(&mut solved);
            assert!((solved - &x).amax() < 1e-9 * x.amax(), "{n}");
        }
    }

    #[test]
    fn the_condition_number_is_estimated_within_a_few_times() {
        for power in [0, 3, 8, 13] {
            let n = 60;
            let q = matrix(n).qr().q();
            let values =
                DVector::from_fn(n, |i, _| 10_f64.powf(-f64::from(power) * i as f64 / 59.0));
            let a = &q * DMatrix::from_diagonal(&values) * q.transpose();
            let a = (&a + a.transpose()) * 0.5;
            let norm = a.column_iter().map(|c| c.lp_norm(1)).fold(0.0, f64::max);
            let found = Factors::of(a).condition(norm);
            let expected = 10_f64.powi(power);
            // The norms differ by at most n.
            assert!(
                found > 0.2 * expected && found < 2.0 * n as f64 * expected,
                "{found} {expected}"
            );
        }
        assert_eq!(
            Factors::of(DMatrix::zeros(3, 3)).condition(1.0),
            f64::INFINITY
        );
    }
}
