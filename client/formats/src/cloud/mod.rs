//! Clouds of points: files that hold places and nothing that joins them.
//!
//! ```
//! let cloud = sinew_formats::cloud::parse("square.csv", b"x,y\n0,0\n1,0\n0,1\n")?;
//! assert_eq!(cloud.positions.len(), 3);
//! # Ok::<(), sinew_formats::mesh::MeshFileError>(())
//! ```

mod bgeo;
mod rows;

use std::{fmt, path::Path};

use nalgebra::Vector3;

use crate::mesh::{
    MeshFileError,
    error::{Flaw, Parsed},
    ply,
};

/// Points, in the file's own unit of length.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// At least one; those of a file with two columns have z = 0.
    pub positions: Vec<Vector3<f64>>,
    /// What the file was.
    pub format: Format,
}

/// What a file of points may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stanford polygons: the vertices, whatever else there is.
    Ply,
    /// A table of two or three columns, with or without a line of names.
    Csv,
    /// Chemical XYZ (a count, a comment, then an element and three numbers a line), or three numbers a line.
    Xyz,
    /// Houdini's classic geometry, plain or packed by gzip.
    Bgeo,
}

impl Format {
    const ALL: [Self; 4] = [Self::Ply, Self::Csv, Self::Xyz, Self::Bgeo];

    /// By the extension of a file's name.
    #[must_use]
    pub fn of(name: &Path) -> Option<Self> {
        let extension = name.extension()?;
        let known = |format: &Self| extension.eq_ignore_ascii_case(format.extension());
        Self::ALL.into_iter().find(known)
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Xyz => "xyz",
            Self::Bgeo => "bgeo",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ply => "PLY",
            Self::Csv => "CSV",
            Self::Xyz => "XYZ",
            Self::Bgeo => "BGEO",
        })
    }
}

/// Whether a file can be nothing else: BGEO, or PLY whose header tells of no faces.
///
/// # Errors
/// [`MeshFileError::Io`] where a PLY cannot be read.
pub fn is_one(path: &Path) -> Result<bool, MeshFileError> {
    match Format::of(path) {
        Some(Format::Bgeo) => Ok(true),
        Some(Format::Ply) => {
            let bytes = load(path)?;
            let mut lines = bytes.split(|byte| *byte == b'\n');
            let mut header = lines
                .by_ref()
                .take_while(|line| line.trim_ascii() != b"end_header");
            let joins = |line: &[u8]| {
                [&b"element face"[..], b"element tristrips"]
                    .iter()
                    .any(|element| line.starts_with(element))
            };
            Ok(!header.any(joins))
        }
        Some(Format::Csv | Format::Xyz) | None => Ok(false),
    }
}

fn load(path: &Path) -> Result<Vec<u8>, MeshFileError> {
    std::fs::read(path).map_err(|source| MeshFileError::Io {
        file: path.to_owned(),
        source,
    })
}

/// Reads a file of points; its extension tells the format.
///
/// # Errors
/// [`MeshFileError`] with the file, the place and the reason.
pub fn read(path: &Path) -> Result<Cloud, MeshFileError> {
    parse(&path.display().to_string(), &load(path)?)
}

/// Reads points from bytes; the extension of `name` tells the format.
///
/// # Errors
/// [`MeshFileError::Content`] with `name`, the place and the reason.
pub fn parse(name: &str, bytes: &[u8]) -> Result<Cloud, MeshFileError> {
    let unknown = || {
        let known = Format::ALL.map(Format::extension).join(", ");
        Flaw::whole(format!(
            "the extension is not that of a cloud; known are {known}"
        ))
        .of(name)
    };
    let format = Format::of(Path::new(name)).ok_or_else(unknown)?;
    let positions: Parsed<Vec<Vector3<f64>>> = match format {
        Format::Ply => ply::parse(bytes).map(|assembly| assembly.positions),
        Format::Csv | Format::Xyz => rows::parse(bytes),
        Format::Bgeo => bgeo::parse(bytes),
    };
    let positions = positions.map_err(|flaw| flaw.of(name))?;
    if positions.is_empty() {
        return Err(Flaw::whole("holds no point").of(name));
    }
    Ok(Cloud { positions, format })
}
