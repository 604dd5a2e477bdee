//! Recordings of particle simulators: LAMMPS dumps and XYZ. They name neither a unit of length nor a rate.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::error::{Fault, Place, check_samples, quoted};
use super::recording::{Recorder, finite};
use super::table::text;
use super::{Format, Options, Take};

/// Frames per second of a file that names none.
const RATE_HZ: f64 = 60.0;

/// A frame's particles by their names: ids, or else their order.
type Particles = BTreeMap<u64, Vector3<f64>>;

/// A reader of lines that knows where it is.
struct Lines<'a> {
    lines: std::str::Lines<'a>,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a str> {
        self.number += 1;
        self.lines.next()
    }

    fn expect(&mut self, what: &str) -> Result<&'a str, Fault> {
        self.next()
            .ok_or_else(|| Fault::at_line(self.number, format!("the file ends before {what}")))
    }

    fn number<T: std::str::FromStr>(&self, word: Option<&str>, what: &str) -> Result<T, Fault> {
        let word = word.unwrap_or_default();
        word.parse().map_err(|_| {
            Fault::at_line(
                self.number,
                format!("{what} is {}, not a number", quoted(word)),
            )
        })
    }
}

/// LAMMPS' text dumps: `x y z`, unwrapped `xu yu zu`, or scaled by the box, in two dimensions too. Particles with ids
/// are known by them; wrapped ones are followed through the walls of a periodic box.
pub(super) fn lammps(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let text = text(bytes);
    let mut lines = Lines {
        lines: text.lines(),
        number: 0,
    };
    let mut frames: Vec<Particles> = Vec::new();
    let mut ordered = false;
    while let Some(line) = lines.next() {
        if line.trim().is_empty() {
            continue;
        }
        if !line.starts_with("ITEM: TIMESTEP") && !line.starts_with("ITEM:") {
            return Err(Fault::at_line(
                lines.number,
                format!("begins with {}, not with ITEM:", quoted(line)),
            ));
        }
        if line.starts_with("ITEM: TIMESTEP") {
            let (particles, has_ids) = dump_frame(&mut lines, frames.last(), bytes.len())?;
            ordered |= !has_ids;
            frames.push(particles);
        } else {
            lines.expect("the item's value")?;
        }
    }
    let mut recorder = record(&frames, options, bytes.len())?;
    recorder.format(Format::Lammps);
    if ordered {
        recorder.warn("the particles have no ids; they were taken to keep their order");
    }
    Ok(recorder.finish())
}

/// The box of a frame: its corner and its edges, and which of them are periodic.
struct Box3 {
    corner: Vector3<f64>,
    size: Vector3<f64>,
    periodic: [bool; 3],
}

fn dump_frame(
    lines: &mut Lines<'_>,
    before: Option<&Particles>,
    bytes: usize,
) -> Result<(Particles, bool), Fault> {
    lines.expect("the time step")?;
    let mut count = 0;
    let mut bounds = None;
    loop {
        let item = lines.expect("ITEM: ATOMS")?;
        if item.starts_with("ITEM: NUMBER OF ATOMS") {
            let line = lines.expect("the number of atoms")?;
            count = lines.number(Some(line.trim()), "the number of atoms")?;
            check_samples(count, 1, bytes, Place::Line(lines.number))?;
        } else if let Some(kinds) = item.strip_prefix("ITEM: BOX BOUNDS") {
            bounds = Some(read_box(lines, kinds)?);
        } else if let Some(columns) = item.strip_prefix("ITEM: ATOMS") {
            let columns: Vec<&str> = columns.split_whitespace().collect();
            let Some(bounds) = bounds else {
                return Err(Fault::at_line(
                    lines.number,
                    "no ITEM: BOX BOUNDS comes before the atoms",
                ));
            };
            return atoms(lines, &columns, count, &bounds, before);
        } else if item.starts_with("ITEM:") {
            lines.expect("the item's value")?;
        } else {
            return Err(Fault::at_line(
                lines.number,
                format!("is {}, not an ITEM:", quoted(item)),
            ));
        }
    }
}

fn read_box(lines: &mut Lines<'_>, kinds: &str) -> Result<Box3, Fault> {
    if kinds.contains("xy") {
        return Err(Fault::at_line(
            lines.number,
            "the box is triclinic; dump an orthogonal one, or unwrapped xu yu zu",
        ));
    }
    let mut bounds = Box3 {
        corner: Vector3::zeros(),
        size: Vector3::zeros(),
        periodic: [false; 3],
    };
    for (axis, kind) in kinds.split_whitespace().take(3).enumerate() {
        bounds.periodic[axis] = kind == "pp";
    }
    for axis in 0..3 {
        let line = lines.expect("the bounds of the box")?;
        let mut words = line.split_whitespace();
        let low: f64 = lines.number(words.next(), "a bound of the box")?;
        let high: f64 = lines.number(words.next(), "a bound of the box")?;
        bounds.corner[axis] = low;
        bounds.size[axis] = high - low;
    }
    Ok(bounds)
}

/// How a column of coordinates is meant.
#[derive(Clone, Copy)]
struct Axis {
    column: usize,
    scaled: bool,
    wrapped: bool,
    image: Option<usize>,
}

fn axes(columns: &[&str]) -> [Option<Axis>; 3] {
    let at = |name: &str| columns.iter().position(|column| *column == name);
    ["x", "y", "z"].map(|axis| {
        let kinds = [
            ("", false, true),
            ("u", false, false),
            ("s", true, true),
            ("su", true, false),
        ];
        kinds.into_iter().find_map(|(suffix, scaled, wrapped)| {
            Some(Axis {
                column: at(&format!("{axis}{suffix}"))?,
                scaled,
                wrapped,
                image: at(&format!("i{axis}")),
            })
        })
    })
}

fn atoms(
    lines: &mut Lines<'_>,
    columns: &[&str],
    count: usize,
    bounds: &Box3,
    before: Option<&Particles>,
) -> Result<(Particles, bool), Fault> {
    let axes = axes(columns);
    if axes[0].is_none() || axes[1].is_none() {
        return Err(Fault::at_line(
            lines.number,
            format!("the columns {} hold no x and y", quoted(&columns.join(" "))),
        ));
    }
    let id = columns.iter().position(|column| *column == "id");
    let mut particles = Particles::new();
    let mut words = Vec::new();
    for index in 0..count {
        let line = lines.expect("the last atom")?;
        words.clear();
        words.extend(line.split_whitespace());
        let name: u64 = match id {
            Some(id) => lines.number(words.get(id).copied(), "the id")?,
            None => index as u64 + 1,
        };
        let last = before.and_then(|before| before.get(&name));
        let mut place = Vector3::zeros();
        for (k, axis) in axes.iter().enumerate() {
            let Some(axis) = axis else { continue };
            let raw: f64 = lines.number(words.get(axis.column).copied(), columns[axis.column])?;
            let size = bounds.size[k];
            place[k] = if axis.scaled {
                bounds.corner[k] + raw * size
            } else {
                raw
            };
            if !axis.wrapped {
                continue;
            }
            match (axis.image, last) {
                (Some(image), _) => {
                    let image: f64 = lines.number(words.get(image).copied(), "the image")?;
                    place[k] += image * size;
                }
                (None, Some(last)) if bounds.periodic[k] && size > 0.0 => {
                    place[k] += ((last[k] - place[k]) / size).round() * size;
                }
                (None, _) => {}
            }
        }
        let Some(place) = finite(place) else {
            return Err(Fault::at_line(
                lines.number,
                format!("particle {name} is at no finite place"),
            ));
        };
        if particles.insert(name, place).is_some() {
            return Err(Fault::at_line(
                lines.number,
                format!("particle {name} is there twice"),
            ));
        }
    }
    Ok((particles, id.is_some()))
}

/// XYZ: a count, a comment, and a row `element x y z` for each particle, known by its place in the order.
pub(super) fn xyz(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let text = text(bytes);
    let mut lines = Lines {
        lines: text.lines(),
        number: 0,
    };
    let mut frames: Vec<Particles> = Vec::new();
    while let Some(line) = lines.next() {
        if line.trim().is_empty() {
            continue;
        }
        let count: usize = lines.number(Some(line.trim()), "the number of particles")?;
        check_samples(count, 1, bytes.len(), Place::Line(lines.number))?;
        if let Some(first) = frames.first()
            && first.len() != count
        {
            let problem = format!("{count} particles, and {} before", first.len());
            return Err(Fault::at_line(
                lines.number,
                format!("{problem}; without ids their number must stay"),
            ));
        }
        lines.expect("the comment")?;
        let mut particles = Particles::new();
        for name in 1..=count as u64 {
            let line = lines.expect("the last particle")?;
            let mut words = line.split_whitespace().skip(1);
            let mut place = Vector3::zeros();
            for axis in 0..3 {
                place[axis] = lines.number(words.next(), "a coordinate")?;
            }
            let Some(place) = finite(place) else {
                return Err(Fault::at_line(
                    lines.number,
                    "the particle is at no finite place",
                ));
            };
            particles.insert(name, place);
        }
        frames.push(particles);
    }
    let mut recorder = record(&frames, options, bytes.len())?;
    recorder.format(Format::Xyz);
    Ok(recorder.finish())
}

/// The take of frames of particles that are known by name; where one is missing it is not seen.
fn record(frames: &[Particles], options: &Options, bytes: usize) -> Result<Recorder, Fault> {
    let mut names: Vec<u64> = frames.iter().flat_map(BTreeMap::keys).copied().collect();
    names.sort_unstable();
    names.dedup();
    if names.is_empty() {
        return Err(Fault::at_line(1, "holds no particle"));
    }
    check_samples(names.len(), frames.len(), bytes, Place::Line(1))?;
    let mut recorder = recorder(names.iter().copied(), frames.len(), options);
    let metres = options.unit_scale.unwrap_or(1.0);
    for frame in frames {
        for name in &names {
            recorder.push(frame.get(name).and_then(|place| finite(place * metres)));
        }
    }
    Ok(recorder)
}

/// An empty take of a simulator, which names neither rate nor unit, with room for so many frames.
pub(super) fn recorder(
    names: impl Iterator<Item = u64>,
    frames: usize,
    options: &Options,
) -> Recorder {
    let labels = names.map(|name| format!("p{name}")).collect();
    let mut recorder = Recorder::new(labels, RATE_HZ);
    recorder.reserve_frames(frames);
    recorder.warn(format!(
        "the file names no rate; {RATE_HZ} frames per second assumed"
    ));
    if options.unit_scale.is_none() {
        recorder.warn("the file names no unit of length; metres assumed");
    }
    recorder
}
