//! OpenSim's storage files, `.mot` and `.sto`: columns over time, some of which are points.

use super::error::{Fault, quoted};
use super::table::{Table, coordinate_in, rate_of, text, triples};
use super::{Format, Options, Take, Up};

pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let text = text(bytes);
    let mut lines = (1..).zip(text.lines());
    let header_ends = |(_, line): &(usize, &str)| line.trim().eq_ignore_ascii_case("endheader");
    if !lines.by_ref().any(|line| header_ends(&line)) {
        return Err(Fault::at_line(
            text.lines().count(),
            "no line says endheader",
        ));
    }
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty());
    let Some((header, names)) = lines.next() else {
        return Err(Fault::at_line(text.lines().count(), "no columns are named"));
    };
    let names: Vec<&str> = names.split('\t').map(str::trim).collect();
    if !names
        .first()
        .is_some_and(|name| name.eq_ignore_ascii_case("time"))
    {
        let found = quoted(names.first().copied().unwrap_or_default());
        return Err(Fault::at_line(
            header,
            format!("the first column is {found}, not time"),
        ));
    }
    let rows: Vec<(usize, &str)> = lines.collect();
    // Positions are called so by OpenSim: translations t, points of application p.
    let (labels, columns) = triples(&names, &["_t", "_p", "_", "."]);
    let of_force = |label: &String| label.ends_with("_v") || label.ends_with("torque");
    let (labels, columns): (Vec<_>, Vec<_>) = (labels.into_iter().zip(columns))
        .filter(|(label, _)| !of_force(label))
        .unzip();
    if labels.is_empty() {
        return Err(Fault::at_line(
            header,
            format!(
                "none of {} columns hold points: no three are called name_tx, name_ty, name_tz, or _x, or _px",
                names.len()
            ),
        ));
    }
    let time = |row: Option<&(usize, &str)>| {
        let (_, row) = row?;
        coordinate_in(row.split('\t').next()?).ok().flatten()
    };
    let (Some(first), Some(last)) = (time(rows.first()), time(rows.last())) else {
        return Err(Fault::at_line(
            header,
            "the first or the last row has no time",
        ));
    };
    let rate_hz = rate_of(first, last, rows.len(), header)?;
    let others = names.len() - 1 - 3 * labels.len();
    let table = Table {
        labels,
        columns,
        separator: '\t',
        metres: options.unit_scale.unwrap_or(1.0),
        zeros_are_gaps: false,
    };
    let mut recorder = table.record(rows.iter().copied(), rate_hz, bytes.len())?;
    recorder.format(Format::Storage);
    recorder.first_time_seconds(first);
    recorder.up(Some(Up::Y));
    if others > 0 {
        recorder.warn(format!("{others} columns are no points, and were left out"));
    }
    Ok(recorder.finish())
}
