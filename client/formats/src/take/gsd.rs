//! GSD, HOOMD-blue's trajectories: named arrays in frames. What a frame does not hold is as in the first one.
//!
//! Layout: <https://gsd.readthedocs.io/en/stable/file-layer.html>; schema:
//! <https://gsd.readthedocs.io/en/stable/schema-hoomd.html>.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::error::{Fault, Place, check_samples};
use super::particles::recorder;
use super::recording::finite;
use super::{Format, Options, Take};

const MAGIC: u64 = 0x65DF_65DF_65DF_65DF;
/// Bytes of an entry of the index, and of a name in files of version 1.
const ENTRY: usize = 32;
const NAME: usize = 64;

/// Little-endian numbers at any place of a file.
#[derive(Clone, Copy)]
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn slice(self, at: usize, length: usize, what: &str) -> Result<&'a [u8], Fault> {
        let end = at.checked_add(length);
        end.and_then(|end| self.0.get(at..end)).ok_or_else(|| {
            let problem = format!("{what}, {length} bytes, is beyond the file's end; it is cut");
            Fault::at_byte(at, problem)
        })
    }

    fn array<const N: usize>(self, at: usize, what: &str) -> Result<[u8; N], Fault> {
        let bytes = self.slice(at, N, what)?;
        Ok(bytes.try_into().expect("N bytes were taken"))
    }

    fn u32(self, at: usize, what: &str) -> Result<u32, Fault> {
        self.array(at, what).map(u32::from_le_bytes)
    }

    /// A number that says where or how many.
    fn size(self, at: usize, what: &str) -> Result<usize, Fault> {
        let size = u64::from_le_bytes(self.array(at, what)?);
        usize::try_from(size)
            .map_err(|_| Fault::at_byte(at, format!("{what} is {size}, more than any file has")))
    }
}

/// An array of a frame: rows of a few numbers.
#[derive(Clone, Copy)]
struct Chunk {
    at: usize,
    rows: usize,
    columns: usize,
    kind: u8,
}

/// Kinds of numbers: integers and binary32.
const I32: u8 = 7;
const F32: u8 = 9;

impl Chunk {
    /// The bytes of its numbers, 4 each, where it is of this kind and so many columns wide.
    fn read<'a>(
        self,
        file: Bytes<'a>,
        kind: u8,
        columns: usize,
        what: &str,
    ) -> Result<&'a [[u8; 4]], Fault> {
        if (self.kind, self.columns) != (kind, columns) {
            let problem = format!(
                "{what} is {} columns of kind {}, not {columns} of {kind}",
                self.columns, self.kind
            );
            return Err(Fault::at_byte(self.at, problem));
        }
        let length = self.rows.saturating_mul(4 * columns);
        let bytes = file.slice(self.at, length, what)?;
        Ok(bytes.as_chunks::<4>().0)
    }
}

/// The arrays that are read, and their places here.
const ARRAYS: [&str; 3] = ["particles/position", "particles/image", "configuration/box"];
const POSITION: usize = 0;
const IMAGE: usize = 1;
const BOX: usize = 2;

/// Where the arrays of all frames are.
struct Index {
    frames: usize,
    chunks: BTreeMap<(usize, usize), Chunk>, // by frame and place in ARRAYS
}

impl Index {
    /// An array of a frame; what the frame does not hold is as in the first one.
    fn find(&self, frame: usize, array: usize) -> Option<Chunk> {
        let chunk = self.chunks.get(&(frame, array));
        chunk.or_else(|| self.chunks.get(&(0, array))).copied()
    }
}

/// Reads a trajectory of HOOMD's schema. Particles keep their order; images, or else walls of the box between one frame
/// and the next, are unwrapped.
pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let file = Bytes(bytes);
    let index = index(file)?;
    let positions = (0..index.frames).map(|frame| positions(file, &index, frame));
    let positions = positions.collect::<Result<Vec<_>, Fault>>()?;
    let count = positions.iter().map(|rows| rows.len()).max().unwrap_or(0);
    if count == 0 {
        return Err(Fault::at_byte(0, "holds no particle"));
    }
    check_samples(count, index.frames, bytes.len(), Place::Byte(0))?;
    let mut recorder = recorder(1..=count as u64, index.frames, options);
    let metres = options.unit_scale.unwrap_or(1.0);
    let has_images = index.chunks.keys().any(|(_, array)| *array == IMAGE);
    let mut last: Vec<Option<Vector3<f64>>> = vec![None; count];
    for (frame, rows) in positions.into_iter().enumerate() {
        let edges = edges(file, index.find(frame, BOX))?;
        let images = (index.find(frame, IMAGE))
            .filter(|images| images.rows == rows.len())
            .map(|images| images.read(file, I32, 3, ARRAYS[IMAGE]))
            .transpose()?;
        for (i, last) in last.iter_mut().enumerate() {
            let row = rows.get(i).map(|row| row.map(f32::from_le_bytes));
            *last = row.and_then(|row| {
                let place = Vector3::from(row.map(f64::from));
                let walls = match (images, *last) {
                    (Some(images), _) => Vector3::from_fn(|axis, _| {
                        f64::from(i32::from_le_bytes(images[3 * i + axis]))
                    }),
                    (None, Some(last)) if !has_images => (edges.try_inverse())
                        .map_or(Vector3::zeros(), |inverse| {
                            (inverse * (last - place)).map(f64::round)
                        }),
                    (None, _) => Vector3::zeros(),
                };
                finite(place + edges * walls)
            });
            recorder.push(last.and_then(|place| finite(place * metres)));
        }
    }
    recorder.format(Format::Gsd);
    Ok(recorder.finish())
}

/// A frame's positions: x y z of each particle.
fn positions<'a>(
    file: Bytes<'a>,
    index: &Index,
    frame: usize,
) -> Result<&'a [[[u8; 4]; 3]], Fault> {
    let Some(chunk) = index.find(frame, POSITION) else {
        let problem = "no frame holds particles/position; it is no trajectory of HOOMD";
        return Err(Fault::at_byte(0, problem));
    };
    let numbers = chunk.read(file, F32, 3, ARRAYS[POSITION])?;
    Ok(numbers.as_chunks::<3>().0)
}

/// The edges of the box as columns: Lx Ly Lz xy xz yz.
fn edges(file: Bytes<'_>, chunk: Option<Chunk>) -> Result<Matrix3<f64>, Fault> {
    let Some(chunk) = chunk else {
        return Ok(Matrix3::zeros());
    };
    let numbers = chunk.read(file, F32, 1, "configuration/box")?;
    let numbers: Vec<f64> = numbers
        .iter()
        .map(|x| f64::from(f32::from_le_bytes(*x)))
        .collect();
    let [x, y, z, xy, xz, yz] = numbers[..] else {
        return Err(Fault::at_byte(
            chunk.at,
            format!("the box has {} numbers, not 6", numbers.len()),
        ));
    };
    let edges = Matrix3::new(x, xy * y, xz * z, 0.0, y, yz * z, 0.0, 0.0, z);
    match edges.iter().all(|x| x.is_finite()) {
        true => Ok(edges),
        false => Err(Fault::at_byte(chunk.at, "the box is not finite")),
    }
}

/// Reads the index.
fn index(file: Bytes<'_>) -> Result<Index, Fault> {
    if file.size(0, "the header").ok() != usize::try_from(MAGIC).ok() {
        return Err(Fault::at_byte(0, "it does not begin as a GSD file does"));
    }
    let index = file.size(8, "the place of the index")?;
    let entries = file.size(16, "the number of entries")?;
    let names = Names::read(file)?;
    let arrays = ARRAYS.map(|array| names.find(array));
    let mut chunks = BTreeMap::new();
    let (mut last, mut filled) = (0, 0);
    for entry in 0..entries {
        let at = index.saturating_add(entry.saturating_mul(ENTRY));
        file.slice(at, ENTRY, "an entry of the index")?;
        let place = file.size(at + 16, "an array's place")?;
        if place == 0 {
            break; // the rest is room for more
        }
        filled += 1;
        let frame = file.size(at, "an entry's frame")?;
        last = last.max(frame);
        let [low, high, kind, _] = file.array(at + 28, "an array's name and kind")?;
        let name = usize::from(u16::from_le_bytes([low, high]));
        let Some(array) = arrays.iter().position(|array| *array == Some(name)) else {
            continue;
        };
        let chunk = Chunk {
            at: place,
            rows: file.size(at + 8, "an array's rows")?,
            columns: file.u32(at + 24, "an array's columns")? as usize,
            kind,
        };
        chunks.insert((frame, array), chunk);
    }
    if last > filled {
        let problem = format!("its last frame is {last}, and it has {filled} arrays");
        return Err(Fault::at_byte(index, problem));
    }
    Ok(Index {
        frames: last + 1,
        chunks,
    })
}

/// The list of the arrays' names: 64 bytes each, from version 2 on one after the other.
struct Names<'a> {
    bytes: &'a [u8],
    is_packed: bool,
}

impl<'a> Names<'a> {
    fn read(file: Bytes<'a>) -> Result<Self, Fault> {
        let at = file.size(24, "the place of the names")?;
        let length = file.size(32, "the room of the names")?;
        let bytes = file.slice(at, length.saturating_mul(NAME), "the list of names")?;
        let is_packed = file.u32(44, "the version")? >> 16 >= 2;
        Ok(Self { bytes, is_packed })
    }

    /// The place of a name in the list.
    fn find(&self, name: &str) -> Option<usize> {
        let is_name = |bytes: &[u8]| bytes == name.as_bytes();
        match self.is_packed {
            true => self.bytes.split(|byte| *byte == 0).position(is_name),
            false => (self.bytes.chunks(NAME))
                .position(|bytes| bytes.split(|byte| *byte == 0).next().is_some_and(is_name)),
        }
    }
}
