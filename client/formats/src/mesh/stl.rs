//! Stereolithography files (`.stl`), text and binary; vertices at the same place become one.

use nalgebra::Vector3;

use super::assembly::Assembly;
use super::cursor::{Cursor, shown};
use super::error::{Flaw, Parsed};
use super::scalar::{Encoding, Endian, Scalar};
use super::weld::weld;

/// Bytes before the count of a binary file, and bytes of one of its triangles.
const HEADER: usize = 80;
const TRIANGLE: usize = 50;

/// Whether the length of a file is exactly that of a binary one; binary files may start with `solid` too.
pub(super) fn has_binary_length(bytes: &[u8]) -> bool {
    let Some([a, b, c, d]) = bytes.get(HEADER..HEADER + 4) else {
        return false;
    };
    let count = u64::from(u32::from_le_bytes([*a, *b, *c, *d]));
    bytes.len() as u64 == (HEADER + 4) as u64 + count * TRIANGLE as u64
}

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let corners = if !has_binary_length(bytes) && bytes.trim_ascii_start().starts_with(b"solid") {
        text_corners(bytes)?
    } else {
        binary_corners(bytes)?
    };
    let (positions, vertices) =
        weld(&corners).ok_or_else(|| Flaw::whole("more than 2^32 vertices"))?;
    let mut assembly = Assembly::of(positions);
    for triangle in vertices.chunks(3) {
        assembly.polygon(triangle).map_err(Flaw::whole)?;
    }
    Ok(assembly)
}

/// The corners of all triangles, one triangle after the other.
fn binary_corners(bytes: &[u8]) -> Parsed<Vec<Vector3<f64>>> {
    let encoding = Encoding::Binary(Endian::Little);
    let mut cursor = Cursor::new(bytes);
    let mut corners = Vec::new();
    cursor.take(HEADER, "the header")?;
    let count = cursor.integer(encoding, Scalar::U32, "the number of triangles")?;
    for _ in 0..cursor.claim(count, TRIANGLE, "triangles")? {
        cursor.take(12, "a normal")?;
        for _ in 0..3 {
            corners.push(cursor.point(encoding, Scalar::F32)?);
        }
        cursor.take(2, "the attributes of a triangle")?;
    }
    Ok(corners)
}

/// The corners of all triangles, one triangle after the other.
fn text_corners(bytes: &[u8]) -> Parsed<Vec<Vector3<f64>>> {
    let mut cursor = Cursor::new(bytes);
    let mut corners = Vec::new();
    while let Some(word) = cursor.word() {
        match word.to_ascii_lowercase().as_slice() {
            // Names and normals are passed with their line.
            b"solid" | b"endsolid" => {
                cursor.line();
            }
            b"facet" => {
                cursor.line();
                cursor.keyword("outer")?;
                cursor.keyword("loop")?;
                for _ in 0..3 {
                    cursor.keyword("vertex")?;
                    corners.push(cursor.point(Encoding::Text, Scalar::F32)?);
                }
                cursor.keyword("endloop")?;
                cursor.keyword("endfacet")?;
            }
            _ => {
                let reason = format!("expected facet or endsolid, found {}", shown(word));
                return Err(cursor.flaw(reason));
            }
        }
    }
    Ok(corners)
}
