//! Houdini's classic binary geometry, version 5 (`.bgeo`), plain or packed by gzip: its points.

use std::io::Read as _;

use flate2::read::GzDecoder;
use nalgebra::Vector3;

use crate::mesh::{
    cursor::Cursor,
    error::{Flaw, Parsed},
    scalar::{Encoding, Endian, Scalar},
};

const BIG: Encoding = Encoding::Binary(Endian::Big);
/// Bytes that a packed file may unpack to for each of its own: far above what points are packed to.
const RATIO: u64 = 64;
/// The type of an attribute that is one of several names.
const INDEX: i64 = 4;

pub(super) fn parse(bytes: &[u8]) -> Parsed<Vec<Vector3<f64>>> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return points(bytes);
    }
    let most = (bytes.len() as u64).saturating_mul(RATIO);
    let mut unpacked = Vec::new();
    let read = GzDecoder::new(bytes)
        .take(most + 1)
        .read_to_end(&mut unpacked);
    read.map_err(|error| {
        Flaw::whole(format!(
            "cannot be unpacked: {error}; the file is cut or damaged"
        ))
    })?;
    if unpacked.len() as u64 > most {
        return Err(Flaw::whole(format!(
            "unpacks to more than {RATIO} times its size"
        )));
    }
    points(&unpacked)
}

fn points(bytes: &[u8]) -> Parsed<Vec<Vector3<f64>>> {
    let mut cursor = Cursor::new(bytes);
    if cursor.take(5, "the magic")? != b"BgeoV" {
        return Err(cursor.flaw("this is no classic BGEO; save it as Houdini 11 does"));
    }
    let mut int = |what: &str| cursor.integer(BIG, Scalar::I32, what);
    let version = int("the version")?;
    let count = int("the number of points")?;
    for what in ["primitives", "groups of points", "groups of primitives"] {
        int(what)?;
    }
    let attributes = int("the number of attributes")?;
    for what in [
        "attributes of vertices",
        "attributes of primitives",
        "attributes",
    ] {
        int(what)?;
    }
    if version != 5 {
        return Err(cursor.flaw(format!("version {version} is not read; known is 5")));
    }
    let mut size = 16_usize;
    for _ in 0..cursor.claim(attributes, 8, "attributes")? {
        size = size.saturating_add(attribute(&mut cursor)?);
    }
    let count = cursor.claim(count, size, "points")?;
    let mut points = Vec::with_capacity(count);
    for _ in 0..count {
        points.push(cursor.point(BIG, Scalar::F32)?);
        cursor.take(size - 12, "a point's attributes")?;
    }
    Ok(points)
}

/// Passes what is said of an attribute; returns its bytes for each point.
fn attribute(cursor: &mut Cursor<'_>) -> Parsed<usize> {
    let name = |cursor: &mut Cursor<'_>| {
        let length = cursor.integer(BIG, Scalar::U16, "the length of a name")?;
        let length = cursor.claim(length, 1, "letters")?;
        cursor.take(length, "a name").map(drop)
    };
    name(cursor)?;
    let values = cursor.integer(BIG, Scalar::U16, "the size of an attribute")?;
    let kind = cursor.integer(BIG, Scalar::I32, "the type of an attribute")?;
    if kind == INDEX {
        let names = cursor.integer(BIG, Scalar::I32, "the number of names")?;
        for _ in 0..cursor.claim(names, 2, "names")? {
            name(cursor)?;
        }
        return Ok(4);
    }
    let bytes = 4 * cursor.claim(values, 4, "values")?;
    cursor.take(bytes, "the default of an attribute")?;
    Ok(bytes)
}
