//! Tabulated laws.

use super::law::{Law, RadialLaw};

/// Force over distance against squared distance, by cubic Hermite pieces: no root, no exponential. `[P22]`
///
/// Below its first node the exact law goes on.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    exact: Law,
    first: f64,         // m²
    inverse_width: f64, // 1/m²
    /// Coefficients of each piece, from the constant up, N/m.
    pieces: Vec<[f64; 4]>,
    /// The greatest error found, as a fraction of the greatest attraction, or of the force where that is larger.
    pub(crate) error: f64,
}

/// The first node, in the law's range.
const FIRST: f64 = 0.2;
/// Most pieces: 2 MB.
const MOST: usize = 1 << 16;

impl Table {
    /// A table up to `reach`, m, as fine as its `error` asks for, or as fine as tables get.
    pub(crate) fn new(exact: Law, reach: f64, error: f64) -> Self {
        let mut pieces = 64;
        loop {
            let table = Self::of(exact, reach, pieces);
            if table.error <= error || pieces == MOST {
                return table;
            }
            pieces *= 2;
        }
    }

    fn of(exact: Law, reach: f64, count: usize) -> Self {
        let first = (FIRST * reach).powi(2);
        #[expect(clippy::cast_precision_loss, reason = "at most MOST")]
        let width = (reach * reach - first) / count as f64;
        #[expect(clippy::cast_precision_loss, reason = "at most MOST")]
        let at = |piece: usize| first + piece as f64 * width;
        let node = |square: f64| {
            let r = square.sqrt();
            let value = exact.over_distance(square);
            // d(f/r)/d(r²)
            let slope = (exact.slope(r) - value) / (2.0 * square);
            [value, slope * width]
        };
        let piece = |k: usize| {
            let [[y0, d0], [y1, d1]] = [node(at(k)), node(at(k + 1))];
            [
                y0,
                d0,
                3.0 * (y1 - y0) - 2.0 * d0 - d1,
                2.0 * (y0 - y1) + d0 + d1,
            ]
        };
        let mut table = Self {
            exact,
            first,
            inverse_width: width.recip(),
            pieces: (0..count).map(piece).collect(),
            error: 0.0,
        };
        let inner = || (0..count).flat_map(|k| [0.2, 0.5, 0.8].map(|t| at(k) + t * width));
        let attraction = inner().map(|square| -exact.force(square.sqrt()));
        let scale = attraction.fold(f64::MIN_POSITIVE, f64::max);
        let off = |square: f64| {
            let r = square.sqrt();
            let force = exact.force(r);
            (table.over_distance(square) * r - force).abs() / scale.max(force.abs())
        };
        table.error = inner().map(off).fold(0.0, f64::max);
        table
    }

    pub(crate) fn pieces(&self) -> usize {
        self.pieces.len()
    }
}

impl RadialLaw for Table {
    fn force(&self, r: f64) -> f64 {
        self.over_distance(r * r) * r
    }

    fn slope(&self, r: f64) -> f64 {
        self.exact.slope(r)
    }

    fn energy(&self, r: f64) -> f64 {
        self.exact.energy(r)
    }

    fn core(&self) -> f64 {
        self.exact.core()
    }

    fn over_distance(&self, square: f64) -> f64 {
        let at = (square - self.first) * self.inverse_width;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below 0 and no number go to the exact law by the comparison"
        )]
        let piece = at as usize;
        match self.pieces.get(piece) {
            Some([a, b, c, d]) if at >= 0.0 => {
                #[expect(clippy::cast_precision_loss, reason = "at most MOST")]
                let t = at - piece as f64;
                a + t * (b + t * (c + t * d))
            }
            _ => self.exact.over_distance(square),
        }
    }
}
