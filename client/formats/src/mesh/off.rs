//! Object files of Geomview (`.off`), text, with colours or normals passed.

use super::assembly::Assembly;
use super::cursor::{Cursor, shown};
use super::error::Parsed;
use super::scalar::{Encoding, Scalar};

/// Headers of files whose vertices start with x, y, z.
pub(super) const HEADERS: [&[u8]; 6] = [b"OFF", b"COFF", b"NOFF", b"CNOFF", b"STOFF", b"STCNOFF"];

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::with_comments(bytes);
    let header = cursor.text("OFF")?;
    if !HEADERS.contains(&header.as_bytes()) {
        let reason = format!("expected OFF, found {}", shown(header.as_bytes()));
        return Err(cursor.flaw(reason));
    }
    if cursor.peek() == Some(b"BINARY") {
        cursor.word();
        return Err(cursor.flaw("binary OFF is not read; save the mesh as text"));
    }
    let vertices: i64 = cursor.number("the number of vertices")?;
    let faces: i64 = cursor.number("the number of faces")?;
    // The number of edges is often left out, and nothing needs it.
    cursor.word_on_line();
    let vertices = cursor.claim(vertices, 3, "vertices")?;
    let faces = cursor.claim(faces, 4, "faces")?;
    let mut assembly = Assembly::default();
    for _ in 0..vertices {
        let position = cursor.point(Encoding::Text, Scalar::F64)?;
        assembly.positions.push(position);
        while cursor.word_on_line().is_some() {}
    }
    for _ in 0..faces {
        let length = cursor.count(1, "vertices of a face")?;
        let face: Vec<u32> = (0..length)
            .map(|_| cursor.vertex(Encoding::Text, Scalar::I64, 0, vertices))
            .collect::<Parsed<_>>()?;
        assembly
            .polygon(&face)
            .map_err(|reason| cursor.flaw(reason))?;
        while cursor.word_on_line().is_some() {}
    }
    Ok(assembly)
}
