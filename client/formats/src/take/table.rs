//! Tables with one row per frame and three columns per point: what the formats of text have in common.

use std::borrow::Cow;

use nalgebra::Vector3;

use super::error::{Fault, Place, check_samples, quoted};
use super::recording::{Recorder, finite};

/// A file's text, without the mark that some programs begin it with.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    String::from_utf8_lossy(bytes)
}

/// A number, or `None` for a gap: blank, or not finite in the spelling of any language (`NaN`, `-nan(ind)`, `1.#QNAN`).
pub(super) fn coordinate_in(cell: &str) -> Result<Option<f64>, ()> {
    let cell = cell.trim();
    match cell.parse::<f64>() {
        Ok(value) => Ok(Some(value).filter(|value| value.is_finite())),
        Err(_) => {
            let bare = cell.trim_start_matches(['-', '+']).to_ascii_lowercase();
            let gap = bare.is_empty() || bare.starts_with("nan") || bare.starts_with("1.#");
            gap.then_some(None).ok_or(())
        }
    }
}

/// Where in a row the points are, and what their numbers mean.
pub(super) struct Table {
    /// One name per point.
    pub(super) labels: Vec<String>,
    /// For each point the column of its x; y and z follow.
    pub(super) columns: Vec<usize>,
    pub(super) separator: char,
    /// Metres per unit of length.
    pub(super) metres: f64,
    /// Whether three zeros are a gap, not a place.
    pub(super) zeros_are_gaps: bool,
}

impl Table {
    /// Reads the rows, each with its line's number, into a recorder at `rate_hz`. Rows may end early, between points.
    pub(super) fn record<'a>(
        &self,
        rows: impl Iterator<Item = (usize, &'a str)> + Clone,
        rate_hz: f64,
        bytes: usize,
    ) -> Result<Recorder, Fault> {
        let first = rows.clone().next().map_or(1, |(line, _)| line);
        let count = rows.clone().count();
        if count == 0 {
            return Err(Fault::at_line(first, "no rows follow the header"));
        }
        check_samples(self.labels.len(), count, bytes, Place::Line(first))?;
        let mut recorder = Recorder::new(self.labels.clone(), rate_hz);
        recorder.reserve_frames(count);
        let mut cells = Vec::new();
        for (line, row) in rows {
            cells.clear();
            cells.extend(row.split(self.separator));
            for (label, &column) in self.labels.iter().zip(&self.columns) {
                recorder.push(self.sample(&cells, column, label, line)?);
            }
        }
        recorder.warn_of_samples_at_origin();
        Ok(recorder)
    }

    fn sample(
        &self,
        cells: &[&str],
        column: usize,
        label: &str,
        line: usize,
    ) -> Result<Option<Vector3<f64>>, Fault> {
        let mut sample = [None; 3];
        for (axis, value) in sample.iter_mut().enumerate() {
            let Some(cell) = cells.get(column + axis) else {
                continue; // programs that strip trailing blanks cut off unseen points
            };
            *value = coordinate_in(cell).map_err(|()| {
                let column = column + axis + 1;
                let problem = format!("column {column} ({label}) holds {}", quoted(cell));
                Fault::at_line(line, format!("{problem}, not a number"))
            })?;
        }
        let [Some(x), Some(y), Some(z)] = sample else {
            return Ok(None);
        };
        let place = Vector3::new(x, y, z) * self.metres;
        Ok(finite(place).filter(|place| !(self.zeros_are_gaps && *place == Vector3::zeros())))
    }
}

/// The points among named columns: each three columns whose names end in x, y, z after the same beginning, in this
/// order. Between both stands one of `joints`, such as `_` or `.`; empty for none. Gives names and columns of x.
pub(super) fn triples(names: &[&str], joints: &[&str]) -> (Vec<String>, Vec<usize>) {
    let stem = |name: &str, axis: char| {
        let bare = name.trim();
        let bare = bare.strip_suffix([axis, axis.to_ascii_uppercase()])?;
        let joint = joints.iter().find(|joint| bare.ends_with(**joint))?;
        Some((bare.len() - joint.len(), bare.to_owned()))
    };
    let mut labels = Vec::new();
    let mut columns = Vec::new();
    for (column, three) in names.windows(3).enumerate() {
        let [Some((end, x)), Some((_, y)), Some((_, z))] = [
            stem(three[0], 'x'),
            stem(three[1], 'y'),
            stem(three[2], 'z'),
        ] else {
            continue;
        };
        if x == y && y == z {
            labels.push(x[..end].to_owned());
            columns.push(column);
        }
    }
    (labels, columns)
}

/// The rate of rows at these times, s: their mean, over all of them.
///
/// # Errors
/// Where there are fewer than two, or they do not grow.
pub(super) fn rate_of(first: f64, last: f64, rows: usize, line: usize) -> Result<f64, Fault> {
    #[expect(clippy::cast_precision_loss, reason = "row counts are far below 2^53")]
    let rate = (rows as f64 - 1.0) / (last - first);
    if rate.is_finite() && rate > 0.0 {
        Ok(rate)
    } else {
        let problem = format!("{rows} rows from {first} s to {last} s have no rate");
        Err(Fault::at_line(
            line,
            format!("{problem}; give at least two rows with growing times"),
        ))
    }
}
