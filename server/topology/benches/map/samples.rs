//! Medians, ratios and how the figures grow with the mesh.

use std::collections::BTreeMap;
use std::fmt;

use crate::kernel::ROWS;

/// Figures by row, who was measured, and number of tetrahedra.
#[derive(Default)]
pub(crate) struct Samples {
    figures: BTreeMap<(String, &'static str, usize), Vec<f64>>,
}

impl Samples {
    pub(crate) fn add(&mut self, row: &str, who: &'static str, size: usize, figure: f64) {
        let key = (row.to_owned(), who, size);
        self.figures.entry(key).or_default().push(figure);
    }

    /// Least, median and greatest.
    fn spread(&self, row: &str, who: &'static str, size: usize) -> Option<[f64; 3]> {
        let mut sorted = self.figures.get(&(row.to_owned(), who, size))?.clone();
        sorted.sort_by(f64::total_cmp);
        Some([sorted[0], sorted[sorted.len() / 2], *sorted.last()?])
    }

    fn sizes(&self, row: &str, who: &str) -> Vec<usize> {
        let keys = self.figures.keys();
        let found = keys.filter(|(r, w, _)| r == row && *w == who);
        found.map(|&(_, _, size)| size).collect()
    }

    /// The exponent p in time ~ cells^p, by least squares over the logarithms of the medians. The figures are times per
    /// unit, hence the 1.
    fn exponent(&self, row: &str, who: &'static str) -> Option<f64> {
        let sizes = self.sizes(row, who).into_iter();
        let points: Vec<_> = sizes
            .filter_map(|size| Some(((size as f64).ln(), self.spread(row, who, size)?[1].ln())))
            .collect();
        let n = points.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
        slope.is_finite().then_some(1.0 + slope)
    }
}

impl fmt::Display for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "median [least – greatest]; N× is the peer's median over ours; p as in time ~ cells^p"
        )?;
        for (row, unit) in ROWS {
            for size in self.sizes(row, "map") {
                let Some([least, median, most]) = self.spread(row, "map", size) else {
                    continue;
                };
                write!(
                    f,
                    "{row:>26} {size:>8}: {median:>9.2} {unit} [{least:.2} – {most:.2}]"
                )?;
                for who in ["lean", "full"] {
                    if let Some([_, peer, _]) = self.spread(row, who, size) {
                        write!(f, "   {who} {peer:.2}, {:.1}×", peer / median)?;
                    }
                }
                writeln!(f)?;
            }
            if let Some(p) = self.exponent(row, "map") {
                writeln!(f, "{row:>26}   p = {p:.3}")?;
            }
        }
        Ok(())
    }
}
