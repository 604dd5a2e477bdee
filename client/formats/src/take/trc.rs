//! TRC, the marker table of Motion Analysis and OpenSim: five header lines, then one tab-separated row per frame.

use nalgebra::Vector3;

use super::error::{Fault, Place, check_samples, quoted};
use super::recording::{Recorder, finite};
use super::table::{coordinate_in, text};
use super::{Format, Options, Take, units};

/// The lines before the rows: the kind of file, the names of its properties, their values, the labels, the axes.
const HEADER_LINES: usize = 5;
/// The frame's number and its time stand before the coordinates.
const LEADING_CELLS: usize = 2;

pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let text = &text(bytes);
    let mut warnings = Vec::new();
    let header = Header::read(text, options, &mut warnings)?;
    let points = header.labels.len();
    let rows = || {
        let numbered = text.lines().zip(1..).skip(HEADER_LINES);
        numbered.filter(|(line, _)| !line.trim().is_empty())
    };
    let count = rows().count();
    let first_line = HEADER_LINES + 1;
    if count == 0 {
        return Err(Fault::at_line(first_line, "no rows follow the header"));
    }
    check_samples(points, count, bytes.len(), Place::Line(first_line))?;

    let mut recorder = Recorder::new(header.labels, header.rate_hz);
    for warning in warnings {
        recorder.warn(warning);
    }
    recorder.format(Format::Trc);
    recorder.reserve_frames(count);
    let mut clock = Clock::default();
    let mut short = 0;
    for (line, number) in rows() {
        let mut cells = line.split('\t');
        clock.read(&mut cells, number)?;
        short += usize::from(read_row(
            cells,
            points,
            header.metres,
            number,
            &mut recorder,
        )?);
    }
    if let Some(claimed) = header.frames.filter(|&claimed| claimed != count) {
        recorder.warn(format!(
            "NumFrames is {claimed}, but there are {count} rows; the rows were believed"
        ));
    }
    if short > 0 {
        recorder.warn(format!(
            "{short} rows end early; the points that they lack were taken as not seen"
        ));
    }
    recorder.first_time_seconds(clock.first_seconds(header.rate_hz));
    if let Some(warning) = clock.oddity(header.rate_hz) {
        recorder.warn(warning);
    }
    recorder.warn_of_samples_at_origin();
    Ok(recorder.finish())
}

struct Header {
    labels: Vec<String>,
    rate_hz: f64,
    metres: f64,
    frames: Option<usize>,
}

impl Header {
    fn read(text: &str, options: &Options, warnings: &mut Vec<String>) -> Result<Self, Fault> {
        let mut lines = text.lines().zip(1..);
        let mut line = || {
            lines.next().ok_or_else(|| {
                Fault::at_line(
                    text.lines().count(),
                    format!("the file ends within the {HEADER_LINES} header lines"),
                )
            })
        };
        let (kind, number) = line()?;
        if !kind.starts_with("PathFileType") {
            return Err(Fault::at_line(
                number,
                format!("begins with {}, a TRC file with PathFileType", quoted(kind)),
            ));
        }
        let (names, _) = line()?;
        let (values, number) = line()?;
        let property = |name: &str| {
            let mut pairs = names.split('\t').zip(values.split('\t'));
            let (_, value) = pairs.find(|(key, _)| key.trim().eq_ignore_ascii_case(name))?;
            Some(value.trim()).filter(|value| !value.is_empty())
        };
        let (label_line, label_number) = line()?;
        let labels = labels(label_line);
        if labels.is_empty() {
            return Err(Fault::at_line(label_number, "names no marker"));
        }
        line()?;

        let markers = property("NumMarkers").and_then(|value| value.parse().ok());
        if let Some(claimed) = markers.filter(|&claimed: &usize| claimed != labels.len()) {
            warnings.push(format!(
                "NumMarkers is {claimed}, but {} markers are named; the names were believed",
                labels.len()
            ));
        }
        let rate_hz = rate_hz(property("DataRate"), property("CameraRate"), warnings)
            .map_err(|problem| Fault::at_line(number, problem))?;
        let metres = match (options.unit_scale, property("Units")) {
            (Some(scale), _) => scale,
            (None, unit) => {
                metres_per(unit, warnings).map_err(|problem| Fault::at_line(number, problem))?
            }
        };
        Ok(Self {
            labels,
            rate_hz,
            metres,
            frames: property("NumFrames").and_then(|value| value.parse().ok()),
        })
    }
}

/// One name for every three columns. Names in other columns than the first of three are counted, not placed.
fn labels(line: &str) -> Vec<String> {
    let cells = || {
        let cells = line.trim_end().split('\t').skip(LEADING_CELLS);
        cells.map(str::trim)
    };
    let in_place = cells()
        .enumerate()
        .all(|(i, cell)| i % 3 == 0 || cell.is_empty());
    if in_place {
        cells().step_by(3).map(str::to_owned).collect()
    } else {
        let names = cells().filter(|cell| !cell.is_empty());
        names.map(str::to_owned).collect()
    }
}

/// The rate of the rows is `DataRate`; `CameraRate` was that of the cameras before any resampling.
fn rate_hz(
    data: Option<&str>,
    camera: Option<&str>,
    warnings: &mut Vec<String>,
) -> Result<f64, String> {
    let (name, value) = match (data, camera) {
        (Some(rate), _) => ("DataRate", rate),
        (None, Some(rate)) => {
            warnings.push("no DataRate; CameraRate was taken".into());
            ("CameraRate", rate)
        }
        (None, None) => return Err("neither DataRate nor CameraRate is given".into()),
    };
    match value.parse() {
        Ok(rate) if rate > 0.0 && f64::is_finite(rate) => Ok(rate),
        Ok(_) | Err(_) => Err(format!("{name} is {}, not a rate in Hz", quoted(value))),
    }
}

fn metres_per(unit: Option<&str>, warnings: &mut Vec<String>) -> Result<f64, String> {
    let Some(unit) = unit else {
        warnings.push("no Units; millimetres assumed".into());
        return Ok(0.001);
    };
    units::metres_per(unit).ok_or_else(|| format!("Units is {}; {}", quoted(unit), units::REMEDY))
}

/// Reads the coordinates of one row; true if it ends before the last point does.
///
/// Editors that strip trailing blanks cut off whole unseen points, so that is allowed; half a point is not.
fn read_row<'a>(
    mut cells: impl Iterator<Item = &'a str>,
    points: usize,
    metres: f64,
    number: usize,
    recorder: &mut Recorder,
) -> Result<bool, Fault> {
    let mut column = LEADING_CELLS;
    let mut short = false;
    for _ in 0..points {
        let mut sample = [None; 3];
        for (coordinate, value) in sample.iter_mut().enumerate() {
            let Some(cell) = cells.next() else {
                if coordinate > 0 {
                    return Err(Fault::at_line(
                        number,
                        format!(
                            "ends within a point, after {column} of {} columns",
                            LEADING_CELLS + 3 * points
                        ),
                    ));
                }
                short = true;
                break;
            };
            column += 1;
            *value = coordinate_in(cell).map_err(|()| {
                Fault::at_line(
                    number,
                    format!("column {column} holds {}, not a number", quoted(cell)),
                )
            })?;
        }
        let position = match sample {
            [Some(x), Some(y), Some(z)] => finite(Vector3::new(x, y, z) * metres),
            [..] => None,
        };
        recorder.push(position);
    }
    match cells.map(str::trim).find(|cell| !cell.is_empty()) {
        Some(cell) => Err(Fault::at_line(
            number,
            format!("holds {} after the last of {column} columns", quoted(cell)),
        )),
        None => Ok(short),
    }
}

/// The leading cells of the rows: frame numbers and times.
#[derive(Default)]
struct Clock {
    rows: u32,
    first: Option<Stamp>,
    last: Option<Stamp>,
    /// The line of the first frame whose number does not follow that of the frame before.
    skip: Option<usize>,
}

#[derive(Clone, Copy)]
struct Stamp {
    frame: i64,
    seconds: Option<f64>,
}

impl Clock {
    fn read<'a>(
        &mut self,
        cells: &mut impl Iterator<Item = &'a str>,
        number: usize,
    ) -> Result<(), Fault> {
        let mut cell = || cells.next().unwrap_or_default().trim();
        let (frame, time) = (cell(), cell());
        let frame = frame.parse().map_err(|_| {
            Fault::at_line(
                number,
                format!(
                    "begins with {}, not a frame number and a tab",
                    quoted(frame)
                ),
            )
        })?;
        let seconds = coordinate_in(time).map_err(|()| {
            Fault::at_line(
                number,
                format!("the time is {}, not a number", quoted(time)),
            )
        })?;
        let stamp = Stamp { frame, seconds };
        if self
            .last
            .is_some_and(|last| last.frame.checked_add(1) != Some(frame))
        {
            self.skip = self.skip.or(Some(number));
        }
        self.first = self.first.or(Some(stamp));
        self.last = Some(stamp);
        self.rows += 1;
        Ok(())
    }

    /// The time of the first row; if it has none, that of its frame number.
    #[expect(
        clippy::cast_precision_loss,
        reason = "frame numbers are far below 2^53"
    )]
    fn first_seconds(&self, rate_hz: f64) -> f64 {
        self.first.map_or(0.0, |first| {
            first
                .seconds
                .unwrap_or((first.frame.saturating_sub(1)) as f64 / rate_hz)
        })
    }

    /// What the stamps say against frames at an even `rate_hz`.
    fn oddity(&self, rate_hz: f64) -> Option<String> {
        if let Some(line) = self.skip {
            return Some(format!(
                "frame numbers do not follow each other, first at line {line}; rows were taken as evenly spaced"
            ));
        }
        let elapsed = self.last?.seconds? - self.first?.seconds?;
        let expected = f64::from(self.rows - 1) / rate_hz;
        // Times are often rounded to milliseconds, hence the allowance of one frame.
        ((elapsed - expected).abs() > 0.01 * expected + 1.0 / rate_hz).then(|| {
            format!("the rows span {elapsed} s by their times, {expected} s by the rate of {rate_hz} Hz, which was believed")
        })
    }
}
