//! Linear equations of which only the product with a vector is known.

/// Vectors that are kept before the method starts anew.
const RESTART: usize = 40;

/// Solves `A x = b` by GMRES from `x = 0`; `apply(x, y)` writes `A x` to `y`. Stops where the residual is below
/// `tolerance` times its start, or after `most` products. Returns the residual as a fraction of its start.
///
/// Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856: no symmetry is needed, and no product with the transpose.
pub(crate) fn gmres(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    most: usize,
) -> f64 {
    x.fill(0.0);
    let start = norm(b);
    if start == 0.0 {
        return 0.0;
    }
    let mut residual = b.to_vec();
    let mut size = start;
    let mut products = 0;
    while products < most {
        let before = size;
        products += cycle(&mut apply, &residual, x, tolerance * start, most - products);
        apply(x, &mut residual);
        for (r, b) in residual.iter_mut().zip(b) {
            *r = b - *r;
        }
        size = norm(&residual);
        if size.is_nan() || size <= tolerance * start || size >= 0.99 * before {
            break;
        }
    }
    size / start
}

/// One cycle: adds to `x` what lessens the residual most; returns the products it took.
fn cycle(
    apply: &mut impl FnMut(&[f64], &mut [f64]),
    residual: &[f64],
    x: &mut [f64],
    enough: f64,
    most: usize,
) -> usize {
    let size = norm(residual);
    let mut basis = vec![scaled(residual, size.recip())];
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut turns: Vec<[f64; 2]> = Vec::new();
    let mut right = vec![size];
    let mut product = vec![0.0; residual.len()];
    for k in 0..RESTART.min(most) {
        apply(&basis[k], &mut product);
        let mut column = Vec::with_capacity(k + 2);
        for v in &basis {
            let part = dot(v, &product);
            axpy(-part, v, &mut product);
            column.push(part);
        }
        let rest = norm(&product);
        for (j, &[c, s]) in turns.iter().enumerate() {
            let [upper, lower] = [column[j], column[j + 1]];
            [column[j], column[j + 1]] = [c * upper + s * lower, c * lower - s * upper];
        }
        let length = column[k].hypot(rest);
        if !(length.is_finite() && length > 0.0) {
            break;
        }
        let [c, s] = [column[k] / length, rest / length];
        column[k] = length;
        columns.push(column);
        turns.push([c, s]);
        right.push(-s * right[k]);
        right[k] *= c;
        if right[k + 1].abs() <= enough || rest == 0.0 {
            break;
        }
        basis.push(scaled(&product, rest.recip()));
    }
    let found = columns.len();
    let mut weights = vec![0.0; found];
    for row in (0..found).rev() {
        let known: f64 = (row + 1..found).map(|j| columns[j][row] * weights[j]).sum();
        weights[row] = (right[row] - known) / columns[row][row];
    }
    for (v, &weight) in basis.iter().zip(&weights) {
        axpy(weight, v, x);
    }
    found.max(1)
}

pub(crate) fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn scaled(v: &[f64], by: f64) -> Vec<f64> {
    v.iter().map(|x| x * by).collect()
}

fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsymmetric_system_larger_than_a_cycle_is_solved() {
        let n = 120;
        let apply = |x: &[f64], y: &mut [f64]| {
            for i in 0..n {
                let left = if i > 0 { x[i - 1] } else { 0.0 };
                let right = if i + 1 < n { x[i + 1] } else { 0.0 };
                y[i] = (2.5 + 0.01 * i as f64) * x[i] - 1.3 * left - 0.7 * right;
            }
        };
        let exact: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut b = vec![0.0; n];
        apply(&exact, &mut b);
        let mut x = vec![0.0; n];
        let residual = gmres(apply, &b, &mut x, 1e-13, 1_000);
        assert!(residual < 1e-12, "{residual}");
        let error = x.iter().zip(&exact).map(|(x, e)| (x - e).abs());
        assert!(error.fold(0.0, f64::max) < 1e-11);
    }

    #[test]
    fn nothing_solves_nothing_and_a_singular_system_ends() {
        let mut x = vec![1.0; 3];
        assert_eq!(gmres(|_, _| (), &[0.0; 3], &mut x, 1e-9, 9), 0.0);
        assert_eq!(x, [0.0; 3]);
        let zero = |_: &[f64], y: &mut [f64]| y.fill(0.0);
        assert_eq!(gmres(zero, &[1.0; 3], &mut x, 1e-9, 9), 1.0);
    }
}
