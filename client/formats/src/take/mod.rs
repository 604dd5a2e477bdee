//! Motion captures and other recordings: labelled points over time, from C3D, TRC, BVH, MOT and STO, the text exports
//! of Motive, Vicon Nexus and Qualisys, plain tables, LAMMPS dumps, XYZ and GSD.
//!
//! [`read`] and [`parse`] give a [`Take`]: positions in metres, one visibility flag per sample, and in
//! [`Take::warnings`] everything in the file that a careful reader would have frowned at. A file that cannot be
//! understood is a [`TakeFileError`] naming the byte or line; memory stays within a small multiple of the file's size,
//! whatever the file claims.
//!
//! ```
//! use sinew_formats::take::{self, Options};
//!
//! let text = "PathFileType\t4\t(X/Y/Z)\twave.trc\n\
//!             DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n\
//!             100\t100\t2\t1\tmm\n\
//!             Frame#\tTime\thand\n\
//!             \t\tX1\tY1\tZ1\n\
//!             1\t0.00\t10\t20\t30\n\
//!             2\t0.01\t\t\t\n";
//! let take = take::parse("wave.trc", text.as_bytes(), &Options::default())?;
//! assert_eq!((take.frames(), take.labels()), (2, &["hand".to_owned()][..]));
//! assert_eq!(take.visible(), [true, false]);
//! # Ok::<(), take::TakeFileError>(())
//! ```

mod bvh;
mod c3d;
mod error;
mod exports;
mod gsd;
mod particles;
mod recording;
mod storage;
mod table;
mod trc;
mod units;

use std::fs;
use std::path::Path;

pub use error::{Place, TakeFileError};
pub use recording::{PointGaps, Reference, Take, Up};

use error::Fault;

/// The kinds of motion-capture file that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The binary format of c3d.org: markers and analog channels.
    C3d,
    /// Motion Analysis' tab-separated marker table.
    Trc,
    /// Biovision's skeleton with joint angles.
    Bvh,
    /// OpenSim's table of coordinates, forces and, at times, points.
    Storage,
    /// A text export of Motive, Vicon Nexus or Qualisys, or a plain table; the contents tell which.
    Table,
    /// A text dump of LAMMPS.
    Lammps,
    /// XYZ, of many simulators.
    Xyz,
    /// HOOMD-blue's binary trajectories.
    Gsd,
}

impl Format {
    /// Every format, in the order in which help texts list them.
    pub const ALL: [Self; 8] = [
        Self::C3d,
        Self::Trc,
        Self::Bvh,
        Self::Storage,
        Self::Table,
        Self::Lammps,
        Self::Xyz,
        Self::Gsd,
    ];

    /// The file extensions, lower case, without the dot; the first is also the format's short name.
    #[must_use]
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::C3d => &["c3d"],
            Self::Trc => &["trc"],
            Self::Bvh => &["bvh"],
            Self::Storage => &["mot", "sto"],
            Self::Table => &["csv", "tsv"],
            Self::Lammps => &["lammpstrj", "dump"],
            Self::Xyz => &["xyz"],
            Self::Gsd => &["gsd"],
        }
    }

    /// The format of a file of this name, by its extension; `None` if it is not one of [`Format::ALL`].
    #[must_use]
    pub fn of(name: &Path) -> Option<Self> {
        let extension = name.extension()?;
        Self::ALL.into_iter().find(|format| {
            let mut known = format.extensions().iter();
            known.any(|known| extension.eq_ignore_ascii_case(known))
        })
    }
}

/// What a reader cannot know from the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Metres per unit of length in the file, finite and > 0. `None`: the file's own unit. Where the format names none,
    /// centimetres for BVH, millimetres for Qualisys, metres for the others.
    pub unit_scale: Option<f64>,
}

/// Reads the motion-capture file at `path`; its extension tells the format.
///
/// # Errors
/// [`TakeFileError::Unreadable`] if the file cannot be opened or read, else as [`parse`].
pub fn read(path: impl AsRef<Path>, options: &Options) -> Result<Take, TakeFileError> {
    let path = path.as_ref();
    // Before the file is opened: a wrong name must not cost the reading of a large file.
    let name = path.display().to_string();
    format_of(&name)?;
    let bytes = fs::read(path).map_err(|source| TakeFileError::Unreadable {
        path: path.to_owned(),
        source,
    })?;
    parse(&name, &bytes, options)
}

/// Reads a motion-capture file already in memory.
///
/// * `name` – the file's name, whose extension tells the format; errors quote it.
///
/// # Errors
/// [`TakeFileError::UnknownFormat`] for an extension outside [`Format::ALL`], [`TakeFileError::UnitScale`] for a scale
/// that is not finite and positive, [`TakeFileError::Malformed`] for contents that are not what the format prescribes.
pub fn parse(name: &str, bytes: &[u8], options: &Options) -> Result<Take, TakeFileError> {
    let format = format_of(name)?;
    if let Some(scale) = options.unit_scale
        && !(scale.is_finite() && scale > 0.0)
    {
        return Err(TakeFileError::UnitScale(scale));
    }
    let take = match format {
        Format::C3d => c3d::parse(bytes, options),
        Format::Trc => trc::parse(bytes, options),
        Format::Bvh => bvh::parse(bytes, options),
        Format::Storage => storage::parse(bytes, options),
        Format::Table => exports::parse(bytes, options),
        Format::Lammps => particles::lammps(bytes, options),
        Format::Xyz => particles::xyz(bytes, options),
        Format::Gsd => gsd::parse(bytes, options),
    };
    take.map_err(|Fault { place, problem }| TakeFileError::Malformed {
        name: name.to_owned(),
        place,
        problem,
    })
}

fn format_of(name: &str) -> Result<Format, TakeFileError> {
    Format::of(Path::new(name)).ok_or_else(|| TakeFileError::UnknownFormat {
        name: name.to_owned(),
    })
}
