//! GSD, HOOMD-blue's trajectories: named arrays in frames. What a frame does not hold is as in the first one.
//!
//! Layout: <https://gsd.readthedocs.io/en/stable/file-layer.html>; schema:
//! <https://gsd.readthedocs.io/en/stable/schema-hoomd.html>.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::error::{Fault, Place, check_samples};
use super::particles::{Particles, record};
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

/// The arrays of all frames, by frame and by name.
type Frames<'a> = BTreeMap<u64, BTreeMap<&'a str, Chunk>>;

/// Reads a trajectory of HOOMD's schema. Particles keep their order; images, or else walls of the box between one frame
/// and the next, are unwrapped.
pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let file = Bytes(bytes);
    let chunks = chunks(file)?;
    let first = chunks.get(&0).cloned().unwrap_or_default();
    let has_images = chunks
        .values()
        .any(|frame| frame.contains_key("particles/image"));
    let mut frames: Vec<Particles> = Vec::new();
    let last = chunks.keys().next_back().copied().unwrap_or_default();
    for frame in 0..=last {
        let own = chunks.get(&frame);
        let find = |name: &str| {
            own.and_then(|own| own.get(name))
                .or_else(|| first.get(name))
                .copied()
        };
        let Some(position) = find("particles/position") else {
            return Err(Fault::at_byte(
                0,
                "no frame holds particles/position; it is no trajectory of HOOMD",
            ));
        };
        check_samples(
            position.rows,
            frames.len() + 1,
            bytes.len(),
            Place::Byte(position.at),
        )?;
        let edges = edges(file, find("configuration/box"))?;
        let images = find("particles/image").filter(|image| image.rows == position.rows);
        let images = images
            .map(|chunk| chunk.read(file, I32, 3, "particles/image"))
            .transpose()?;
        let numbers = position.read(file, F32, 3, "particles/position")?;
        let before = frames.last().filter(|_| !has_images);
        let mut particles = Particles::new();
        for (i, place) in numbers.as_chunks::<3>().0.iter().enumerate() {
            let name = i as u64 + 1;
            let mut place = Vector3::from(place.map(|x| f64::from(f32::from_le_bytes(x))));
            if let Some(images) = images {
                let image =
                    Vector3::from_fn(|axis, _| f64::from(i32::from_le_bytes(images[3 * i + axis])));
                place += edges * image;
            } else if let Some(last) = before.and_then(|before| before.get(&name))
                && let Some(inverse) = edges.try_inverse()
            {
                place += edges * (inverse * (last - place)).map(f64::round);
            }
            if let Some(place) = finite(place) {
                particles.insert(name, place);
            }
        }
        frames.push(particles);
    }
    let mut recorder = record(&frames, "p", options, bytes.len())?;
    recorder.format(Format::Gsd);
    Ok(recorder.finish())
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
fn chunks(file: Bytes<'_>) -> Result<Frames<'_>, Fault> {
    if file.size(0, "the header").ok() != usize::try_from(MAGIC).ok() {
        return Err(Fault::at_byte(0, "it does not begin as a GSD file does"));
    }
    let index = file.size(8, "the place of the index")?;
    let entries = file.size(16, "the number of entries")?;
    let names = names(file)?;
    let mut frames = Frames::new();
    for entry in 0..entries {
        let at = index.saturating_add(entry.saturating_mul(ENTRY));
        file.slice(at, ENTRY, "an entry of the index")?;
        let place = file.size(at + 16, "an array's place")?;
        if place == 0 {
            break; // the rest is room for more
        }
        let frame = u64::from_le_bytes(file.array(at, "an entry's frame")?);
        let [low, high, kind, _] = file.array(at + 28, "an array's name and kind")?;
        let Some(name) = names.get(usize::from(u16::from_le_bytes([low, high]))) else {
            return Err(Fault::at_byte(
                at + 28,
                "an array has a name that is not in the list",
            ));
        };
        if frame > entries as u64 {
            let problem = format!("frame {frame}, and there are {entries} arrays");
            return Err(Fault::at_byte(at, problem));
        }
        let chunk = Chunk {
            at: place,
            rows: file.size(at + 8, "an array's rows")?,
            columns: file.u32(at + 24, "an array's columns")? as usize,
            kind,
        };
        frames.entry(frame).or_default().insert(*name, chunk);
    }
    Ok(frames)
}

/// Names of arrays: 64 bytes each, from version 2 on one after the other.
fn names(file: Bytes<'_>) -> Result<Vec<&str>, Fault> {
    let at = file.size(24, "the place of the names")?;
    let length = file.size(32, "the room of the names")?.saturating_mul(NAME);
    let is_packed = file.u32(44, "the version")? >> 16 >= 2;
    let bytes = file.slice(at, length, "the list of names")?;
    let word = |bytes| std::str::from_utf8(bytes).unwrap_or_default();
    Ok(match is_packed {
        true => bytes.split(|byte| *byte == 0).map(word).collect(),
        false => (bytes.chunks(NAME))
            .map(|name| word(name.split(|byte| *byte == 0).next().unwrap_or_default()))
            .collect(),
    })
}
