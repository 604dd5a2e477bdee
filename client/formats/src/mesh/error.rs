//! What can be wrong with a mesh file, and where.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, counted from 1.
    Line(usize),
    /// An offset into binary data, counted from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// Why a mesh file was not read.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// The file could not be opened or read.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The content is broken, or of a kind that Sinew does not read.
    #[error("{file}{place}: {reason}")]
    Content {
        /// The name that the caller gave.
        file: String,
        /// Where in the file.
        place: Place,
        /// What is wrong, the value that is, and the remedy where there is one.
        reason: String,
    },
}

/// A content error before the file's name is known.
#[derive(Debug)]
pub(crate) struct Flaw {
    pub(crate) place: Place,
    pub(crate) reason: String,
}

impl Flaw {
    /// A flaw of the file as a whole.
    pub(crate) fn whole(reason: impl Into<String>) -> Self {
        Self {
            place: Place::File,
            reason: reason.into(),
        }
    }

    pub(crate) fn of(self, file: &str) -> MeshFileError {
        MeshFileError::Content {
            file: file.to_owned(),
            place: self.place,
            reason: self.reason,
        }
    }
}

pub(crate) type Parsed<T> = Result<T, Flaw>;
