//! Why a motion-capture file was refused, and where.

use std::fmt;
use std::io;
use std::path::PathBuf;

use super::Format;

/// Why no take came out of a file.
#[derive(Debug, thiserror::Error)]
pub enum TakeFileError {
    /// The file system refused.
    #[error("cannot read {path}: {source}", path = path.display())]
    Unreadable {
        /// The file that was asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The extension belongs to no format that can be read.
    #[error(
        "{name}: not a known kind of motion capture; can be read: {}",
        known_extensions()
    )]
    UnknownFormat {
        /// The file's name.
        name: String,
    },
    /// [`Options::unit_scale`](super::Options::unit_scale) is not finite and positive.
    #[error("unit scale {0} is no length: give metres per file unit, such as 0.001 for mm")]
    UnitScale(f64),
    /// The contents are not what the format prescribes.
    #[error("{name}, {place}: {problem}")]
    Malformed {
        /// The file's name.
        name: String,
        /// Where in the file.
        place: Place,
        /// What is wrong, with the value found and, where there is one, the remedy.
        problem: String,
    },
}

fn known_extensions() -> String {
    let known = Format::ALL.iter().flat_map(|format| format.extensions());
    let dotted: Vec<_> = known.map(|extension| format!(".{extension}")).collect();
    dotted.join(" ")
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// An offset from the file's beginning, for binary formats.
    Byte(usize),
    /// A line number from 1, for text formats.
    Line(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(at) => write!(to, "byte {at}"),
            Self::Line(number) => write!(to, "line {number}"),
        }
    }
}

/// A [`TakeFileError::Malformed`] before the file's name is known.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) place: Place,
    pub(super) problem: String,
}

impl Fault {
    pub(super) fn at_byte(at: usize, problem: impl Into<String>) -> Self {
        Self {
            place: Place::Byte(at),
            problem: problem.into(),
        }
    }

    pub(super) fn at_line(number: usize, problem: impl Into<String>) -> Self {
        Self {
            place: Place::Line(number),
            problem: problem.into(),
        }
    }
}

/// `text` in quotes, cut where it is too long for a message.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// Refuses a table larger than its file.
///
/// In every honest file a sample takes several bytes, but points without columns of their own (BVH end sites, the
/// trailing gaps of short TRC rows) would let a small file claim a huge take.
pub(super) fn check_samples(
    points: usize,
    rows: usize,
    bytes: usize,
    place: Place,
) -> Result<(), Fault> {
    if points.saturating_mul(rows) <= bytes {
        return Ok(());
    }
    Err(Fault {
        place,
        problem: format!("{rows} rows of {points} points cannot come from {bytes} bytes"),
    })
}
