//! BVH, Biovision's skeleton: a tree of joints, then per frame the value of every channel of every joint.
//!
//! Points are the joints and, named `<joint>_end`, the end sites, in the file's order. The format names no unit of
//! length (in practice centimetres) and has no gaps.

mod hierarchy;
mod words;

use nalgebra::{Rotation3, Vector3};

use super::error::{Fault, Place, check_samples, quoted};
use super::recording::{Recorder, finite};
use super::{Format, Options, Take, Up};
use hierarchy::{Channel, Node};
use words::Words;

pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = Words::new(text.strip_prefix('\u{feff}').unwrap_or(&text));
    let nodes = hierarchy::read(&mut words)?;
    let claimed = frame_count(&mut words)?;
    let rate_hz = rate_hz(&mut words)?;

    let rows = || {
        words
            .lines_after()
            .filter(|(line, _)| !line.trim().is_empty())
    };
    let count = rows().count();
    let place = words.line();
    if count == 0 {
        return Err(Fault::at_line(place, "no rows follow the frame time"));
    }
    check_samples(nodes.len(), count, bytes.len(), Place::Line(place))?;

    let labels = nodes.iter().map(|node| node.label.clone()).collect();
    let mut recorder = Recorder::new(labels, rate_hz);
    recorder.format(Format::Bvh);
    recorder.up(Some(Up::Y));
    let bones = nodes.iter().enumerate();
    recorder.skeleton(
        bones
            .filter_map(|(child, node)| Some([node.parent?, child]))
            .collect(),
    );
    if options.unit_scale.is_none() {
        recorder.warn(
            "BVH names no unit of length; centimetres assumed, else give the unit scale in metres",
        );
    }
    if claimed != count {
        recorder.warn(format!(
            "Frames is {claimed}, but there are {count} rows; the rows were believed"
        ));
    }
    recorder.reserve_frames(count);
    let metres = options.unit_scale.unwrap_or(0.01);
    let channels = nodes.iter().map(|node| node.channels.len()).sum();
    let mut values = Vec::with_capacity(channels);
    let mut pose = Vec::with_capacity(nodes.len());
    for (line, number) in rows() {
        read_row(line, number, channels, &mut values)?;
        place_nodes(&nodes, &values, &mut pose);
        for (node, placed) in nodes.iter().zip(&pose) {
            let position = finite(placed.position * metres).ok_or_else(|| {
                Fault::at_line(
                    number,
                    format!("{} lies too far away for a number", quoted(&node.label)),
                )
            })?;
            recorder.push(Some(position));
        }
    }
    Ok(recorder.finish())
}

fn frame_count(words: &mut Words) -> Result<usize, Fault> {
    words.expect("Frames:")?;
    let word = words.next_word()?;
    word.parse()
        .map_err(|_| words.fault(format!("Frames is {}, not a count", quoted(word))))
}

fn rate_hz(words: &mut Words) -> Result<f64, Fault> {
    words.expect("Frame")?;
    words.expect("Time:")?;
    let word = words.next_word()?;
    let rate = word.parse().ok().and_then(|seconds| rate_of(word, seconds));
    rate.ok_or_else(|| {
        words.fault(format!(
            "Frame Time is {}, not a time in seconds",
            quoted(word)
        ))
    })
}

/// The rate of a frame time as printed: 0.033333 means 30 Hz, not 30.0003. A whole rate is meant if its frame time
/// agrees with the printed one to within a unit in the last place, and to within 0.1 %.
fn rate_of(printed: &str, seconds: f64) -> Option<f64> {
    let rate = 1.0 / seconds;
    if !(seconds.is_finite() && rate.is_finite() && seconds > 0.0) {
        return None;
    }
    let decimals = printed
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let last_place = 0.1_f64.powi(i32::try_from(decimals).unwrap_or(i32::MAX));
    let whole = rate.round();
    let off = (1.0 / whole - seconds).abs();
    Some(if off < last_place && off < 1e-3 * seconds {
        whole
    } else {
        rate
    })
}

/// Reads exactly `channels` numbers.
fn read_row(
    line: &str,
    number: usize,
    channels: usize,
    values: &mut Vec<f64>,
) -> Result<(), Fault> {
    let width = line.split_whitespace().count();
    if width != channels {
        return Err(Fault::at_line(
            number,
            format!("holds {width} values, but the joints have {channels} channels"),
        ));
    }
    values.clear();
    for (word, column) in line.split_whitespace().zip(1..) {
        let value = word.parse().ok().filter(|value: &f64| value.is_finite());
        values.push(value.ok_or_else(|| {
            Fault::at_line(
                number,
                format!("value {column} is {}, not a finite number", quoted(word)),
            )
        })?);
    }
    Ok(())
}

struct Placed {
    position: Vector3<f64>,
    world_from_node: Rotation3<f64>,
}

/// Forward kinematics. A joint's rotations turn about its own axes, in the order of its channels; a position channel
/// replaces that coordinate of the offset, as the programs that write such channels mean it.
fn place_nodes(nodes: &[Node], values: &[f64], pose: &mut Vec<Placed>) {
    let mut values = values.iter();
    pose.clear();
    for node in nodes {
        let mut translation = node.offset;
        let mut rotation = Rotation3::identity();
        for (channel, &value) in node.channels.iter().zip(&mut values) {
            match *channel {
                Channel::Position(axis) => translation[axis] = value,
                Channel::Rotation(axis) => {
                    rotation *= Rotation3::from_scaled_axis(unit(axis) * value.to_radians());
                }
            }
        }
        let placed = match node.parent {
            None => Placed {
                position: translation,
                world_from_node: rotation,
            },
            Some(parent) => {
                let Placed {
                    position,
                    world_from_node,
                } = &pose[parent];
                Placed {
                    position: position + world_from_node * translation,
                    world_from_node: world_from_node * rotation,
                }
            }
        };
        pose.push(placed);
    }
}

fn unit(axis: usize) -> Vector3<f64> {
    let mut unit = Vector3::zeros();
    unit[axis] = 1.0;
    unit
}
