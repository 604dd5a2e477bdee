//! What capture programs export as `.csv` and `.tsv`: Motive, Vicon Nexus, Qualisys, and plain tables.

use super::error::{Fault, quoted};
use super::table::{Table, coordinate_in, rate_of, text, triples};
use super::{Format, Options, Take, Up, units};

/// A file's lines with their numbers.
type Lines<'a> = Vec<(usize, &'a str)>;

/// Reads whatever of them it is; the first cell tells.
pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let text = text(bytes);
    let lines: Lines<'_> = (1..).zip(text.lines()).collect();
    let begins = |word: &str| lines.iter().position(|(_, line)| line.starts_with(word));
    let size = bytes.len();
    if begins("Format Version") == Some(0) {
        motive(&lines, options, size)
    } else if let Some(section) = begins("Trajectories") {
        nexus(&lines[section..], options, size)
    } else if begins("NO_OF_FRAMES") == Some(0) {
        qualisys(&lines, options, size)
    } else {
        plain(&lines, options, size)
    }
}

fn numbered<'a>(
    lines: &'a Lines<'_>,
    from: usize,
) -> impl Iterator<Item = (usize, &'a str)> + Clone {
    let rows = lines[from.min(lines.len())..].iter().copied();
    rows.filter(|(_, line)| !line.trim_matches([',', '\t', ' ']).is_empty())
}

fn rate_in(value: Option<&str>, name: &str, line: usize) -> Result<f64, Fault> {
    let rate = value.and_then(|value| value.trim().parse().ok());
    rate.filter(|rate: &f64| rate.is_finite() && *rate > 0.0)
        .ok_or_else(|| {
            let found = value.map_or_else(|| "nothing".to_owned(), quoted);
            Fault::at_line(line, format!("{name} is {found}, not a rate in Hz"))
        })
}

/// Metres per unit: as asked for, else as the file says.
fn metres(unit: &str, options: &Options, line: usize) -> Result<f64, Fault> {
    match options.unit_scale {
        Some(scale) => Ok(scale),
        None => units::metres_per(unit).ok_or_else(|| {
            let problem = format!("the unit of length is {}", quoted(unit));
            Fault::at_line(line, format!("{problem}; {}", units::REMEDY))
        }),
    }
}

/// OptiTrack Motive: a first line of properties, then rows of names above the columns. Y points up.
fn motive(lines: &Lines<'_>, options: &Options, size: usize) -> Result<Take, Fault> {
    let properties: Vec<&str> = lines[0].1.split(',').collect();
    let property = |name: &str| {
        let at = properties.iter().position(|cell| cell.trim() == name)?;
        properties.get(at + 1).copied()
    };
    let rate = property("Export Frame Rate").or(property("Capture Frame Rate"));
    let rate_hz = rate_in(rate, "Export Frame Rate", 1)?;
    let metres = metres(property("Length Units").unwrap_or("Meters"), options, 1)?;
    let axes = lines
        .iter()
        .position(|(_, line)| line.starts_with("Frame,Time"));
    let Some(axes) = axes else {
        return Err(Fault::at_line(
            lines.len(),
            "no line begins with Frame,Time",
        ));
    };
    let (mut columns, names) = motive_columns(&lines[..axes]);
    if columns.is_empty() {
        return Err(Fault::at_line(
            lines[axes].0,
            "no column holds a marker's, a bone's or a rigid body's position; export with markers",
        ));
    }
    let name = |column: &usize| names.get(*column).copied().unwrap_or_default().trim();
    let labelled = |column: &usize| !name(column).starts_with("Unlabeled");
    let all = columns.len();
    let unlabelled = columns.iter().filter(|column| !labelled(column)).count();
    if unlabelled < all {
        columns.retain(labelled);
    }
    let table = Table {
        labels: columns
            .iter()
            .map(|column| name(column).to_owned())
            .collect(),
        columns,
        separator: ',',
        metres,
        zeros_are_gaps: false,
    };
    let mut recorder = table.record(numbered(lines, axes + 1), rate_hz, size)?;
    recorder.format(Format::Table);
    recorder.up(Some(Up::Y));
    match unlabelled {
        0 => {}
        n if n == all => recorder.warn("no marker is labelled; they are called by their numbers"),
        n => recorder.warn(format!("{n} unlabelled markers were left out")),
    }
    Ok(recorder.finish())
}

/// The columns of x of the markers, or else of the bones, or else of the rigid bodies; and the names above all columns.
fn motive_columns<'a>(head: &[(usize, &'a str)]) -> (Vec<usize>, Vec<&'a str>) {
    let row = |name: &str| {
        let found = head
            .iter()
            .find(|(_, line)| line.split(',').nth(1) == Some(name));
        found.map_or(Vec::new(), |(_, line)| line.split(',').collect::<Vec<_>>())
    };
    let (types, names) = (row("Type"), row("Name"));
    let kinds: Vec<&str> = head
        .last()
        .map_or(Vec::new(), |(_, line)| line.split(',').collect());
    let of_type = |wanted: &str| {
        let position = |column: &usize| {
            types[*column].trim() == wanted
                && kinds
                    .get(*column)
                    .is_some_and(|kind| kind.trim() == "Position")
        };
        let columns: Vec<usize> = (2..types.len()).filter(position).collect();
        columns.into_iter().step_by(3).collect::<Vec<_>>()
    };
    let wanted = [
        "Marker",
        "Bone Marker",
        "Rigid Body Marker",
        "Bone",
        "Rigid Body",
    ];
    let columns = wanted
        .into_iter()
        .map(of_type)
        .find(|found| !found.is_empty());
    (columns.unwrap_or_default(), names)
}

/// Vicon Nexus: `Trajectories`, the rate, the labels, the axes, the units; the section ends at a blank line. Z points
/// up.
fn nexus(lines: &[(usize, &str)], options: &Options, size: usize) -> Result<Take, Fault> {
    const HEADER_LINES: usize = 5;
    let last = lines.last().map_or(1, |(line, _)| *line);
    let head: Vec<Vec<&str>> = (lines.iter().take(HEADER_LINES))
        .map(|(_, line)| line.split(',').map(str::trim).collect())
        .collect();
    let [_, rate, labels, axes, unit] = &head[..] else {
        return Err(Fault::at_line(last, "the file ends within the header"));
    };
    let line = |offset: usize| lines[offset].0;
    let rate_hz = rate_in(rate.first().copied(), "the rate", line(1))?;
    let metres = metres(unit.get(2).copied().unwrap_or("mm"), options, line(4))?;
    let columns: Vec<usize> = (2..axes.len().saturating_sub(2))
        .step_by(3)
        .take_while(|&column| axes[column] == "X")
        .collect();
    if columns.is_empty() {
        return Err(Fault::at_line(line(3), "no column is called X"));
    }
    let label = |column: &usize| labels.get(*column).copied().unwrap_or_default();
    let table = Table {
        labels: columns
            .iter()
            .map(|column| label(column).to_owned())
            .collect(),
        columns,
        separator: ',',
        metres,
        zeros_are_gaps: false,
    };
    let rows = lines[HEADER_LINES..].iter().copied();
    let rows = rows.take_while(|(_, line)| !line.trim_matches([',', ' ']).is_empty());
    let mut recorder = table.record(rows, rate_hz, size)?;
    recorder.format(Format::Table);
    recorder.up(Some(Up::Z));
    Ok(recorder.finish())
}

/// Qualisys Track Manager: names and values, then the rows, in millimetres. Three zeros are a gap. Z points up.
fn qualisys(lines: &Lines<'_>, options: &Options, size: usize) -> Result<Take, Fault> {
    let value = |name: &str| {
        let mut found = lines.iter().filter_map(|(number, line)| {
            Some((*number, line.strip_prefix(name)?.strip_prefix('\t')?))
        });
        found.next()
    };
    let (line, rate) = value("FREQUENCY")
        .ok_or_else(|| Fault::at_line(lines.len(), "no line begins with FREQUENCY"))?;
    let rate_hz = rate_in(Some(rate), "FREQUENCY", line)?;
    let (line, names) = value("MARKER_NAMES")
        .ok_or_else(|| Fault::at_line(lines.len(), "no line begins with MARKER_NAMES"))?;
    let labels: Vec<String> = names
        .split('\t')
        .map(|name| name.trim().to_owned())
        .filter(|name| !name.is_empty())
        .collect();
    if labels.is_empty() {
        return Err(Fault::at_line(line, "MARKER_NAMES names no marker"));
    }
    let begins = |word: &str| lines.iter().position(|(_, line)| line.starts_with(word));
    let first_number = |&(_, line): &(usize, &str)| {
        line.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '.' | '\t'))
    };
    // A row of column names stands before the numbers where frames and times do.
    let (start, leading) = match begins("Frame\t") {
        Some(at) => (
            at + 1,
            1 + usize::from(lines[at].1.starts_with("Frame\tTime")),
        ),
        None => (
            lines.iter().position(first_number).unwrap_or(lines.len()),
            0,
        ),
    };
    let table = Table {
        columns: (0..labels.len()).map(|point| leading + 3 * point).collect(),
        labels,
        separator: '\t',
        metres: options.unit_scale.unwrap_or(0.001),
        zeros_are_gaps: true,
    };
    let mut recorder = table.record(numbered(lines, start), rate_hz, size)?;
    recorder.format(Format::Table);
    recorder.up(Some(Up::Z));
    Ok(recorder.finish())
}

/// A plain table: a header with a column `time`, in seconds, and three columns `name_x`, `name_y`, `name_z` per point
/// (or `.`, `:`, a blank instead of `_`), in metres.
fn plain(lines: &Lines<'_>, options: &Options, size: usize) -> Result<Take, Fault> {
    let header = lines.first().map_or("", |(_, line)| *line);
    let separator = [',', '\t', ';']
        .into_iter()
        .max_by_key(|c| header.matches(*c).count());
    let separator = separator.unwrap_or(',');
    let names: Vec<&str> = header
        .split(separator)
        .map(|name| name.trim().trim_matches('"'))
        .collect();
    let (labels, columns) = triples(&names, &["_", ".", ":", " "]);
    if labels.is_empty() {
        return Err(Fault::at_line(
            1,
            format!(
                "begins with {}: neither an export of Motive, Nexus or Qualisys, nor a header with columns name_x, name_y, name_z",
                quoted(header)
            ),
        ));
    }
    let is_time = |name: &&str| name.to_ascii_lowercase().starts_with("time");
    let Some(time) = names.iter().position(is_time) else {
        return Err(Fault::at_line(1, "has no column `time`, in seconds"));
    };
    let rows = || numbered(lines, 1);
    let time_of = |row: Option<(usize, &str)>| {
        let (line, row) = row?;
        let cell = row.split(separator).nth(time)?;
        Some((line, coordinate_in(cell).ok().flatten()?))
    };
    let (Some((line, first)), Some((_, last))) = (time_of(rows().next()), time_of(rows().last()))
    else {
        return Err(Fault::at_line(2, "the first or the last row has no time"));
    };
    let rate_hz = rate_of(first, last, rows().count(), line)?;
    let table = Table {
        labels,
        columns,
        separator,
        metres: options.unit_scale.unwrap_or(1.0),
        zeros_are_gaps: false,
    };
    let mut recorder = table.record(rows(), rate_hz, size)?;
    recorder.format(Format::Table);
    recorder.first_time_seconds(first);
    if options.unit_scale.is_none() {
        recorder.warn("the table names no unit of length; metres assumed");
    }
    Ok(recorder.finish())
}
