//! The tree of joints.

use nalgebra::Vector3;

use super::super::error::{Fault, quoted};
use super::words::Words;

/// A joint or an end site. Parents stand before their children, which is also the order of the channels in a row.
pub(super) struct Node {
    pub(super) label: String,
    pub(super) parent: Option<usize>,
    /// From the parent, in the parent's axes and the file's unit.
    pub(super) offset: Vector3<f64>,
    /// None for an end site.
    pub(super) channels: Vec<Channel>,
    end_site: bool,
}

/// What one number in a row moves; axes are 0, 1, 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    Position(usize),
    /// In degrees.
    Rotation(usize),
}

/// Names longer than this are refused: each end site repeats one.
const LONGEST_NAME: usize = 255;

/// Reads from `HIERARCHY` to `MOTION`.
pub(super) fn read(words: &mut Words) -> Result<Vec<Node>, Fault> {
    words.expect("HIERARCHY")?;
    let mut nodes: Vec<Node> = Vec::new();
    let mut open = Vec::new();
    loop {
        let word = words.next_word()?;
        let inside = open.last().copied();
        let joint = inside.filter(|&node: &usize| !nodes[node].end_site);
        match (word.to_ascii_uppercase().as_str(), inside, joint) {
            ("ROOT", None, _) | ("JOINT", _, Some(_)) => {
                let label = joint_name(words)?;
                open.push(nodes.len());
                nodes.push(begin(words, label, inside, false)?);
            }
            ("END", _, Some(parent)) => {
                words.name();
                let label = format!("{}_end", nodes[parent].label);
                open.push(nodes.len());
                nodes.push(begin(words, label, inside, true)?);
            }
            ("CHANNELS", _, Some(node)) => read_channels(words, &mut nodes[node].channels)?,
            ("}", Some(_), _) => {
                open.pop();
            }
            ("MOTION", None, _) if !nodes.is_empty() => return Ok(nodes),
            _ => {
                return Err(words.fault(format!(
                    "{} has no place here in the hierarchy",
                    quoted(word)
                )));
            }
        }
    }
}

fn joint_name(words: &mut Words) -> Result<String, Fault> {
    let name = words.name();
    if name.len() > LONGEST_NAME {
        return Err(words.fault(format!(
            "a name of {} bytes, more than {LONGEST_NAME}",
            name.len()
        )));
    }
    Ok(name.to_owned())
}

/// Reads from the opening brace to the offset, which every program writes first.
fn begin(
    words: &mut Words,
    label: String,
    parent: Option<usize>,
    end_site: bool,
) -> Result<Node, Fault> {
    words.expect("{")?;
    words.expect("OFFSET")?;
    let offset = Vector3::new(words.number()?, words.number()?, words.number()?);
    Ok(Node {
        label,
        parent,
        offset,
        channels: Vec::new(),
        end_site,
    })
}

fn read_channels(words: &mut Words, channels: &mut Vec<Channel>) -> Result<(), Fault> {
    let word = words.next_word()?;
    let count: usize = word
        .parse()
        .map_err(|_| words.fault(format!("CHANNELS is {}, not a count", quoted(word))))?;
    for _ in 0..count {
        let word = words.next_word()?;
        channels.push(match word.to_ascii_lowercase().as_str() {
            "xposition" => Channel::Position(0),
            "yposition" => Channel::Position(1),
            "zposition" => Channel::Position(2),
            "xrotation" => Channel::Rotation(0),
            "yrotation" => Channel::Rotation(1),
            "zrotation" => Channel::Rotation(2),
            _ => return Err(words.fault(format!("{} is no channel", quoted(word)))),
        });
    }
    Ok(())
}
