//! Wavefront files (`.obj`): faces with any number of vertices; all objects of a file together.

use super::assembly::Assembly;
use super::cursor::{Cursor, shown};
use super::error::Parsed;
use super::scalar::{Encoding, Scalar};

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut assembly = Assembly::default();
    let vertices = count_vertices(bytes);
    let mut cursor = Cursor::with_comments(bytes);
    while let Some(word) = cursor.word() {
        match word {
            b"v" => {
                let position = cursor.point(Encoding::Text, Scalar::F64)?;
                assembly.positions.push(position);
                // A weight or a colour may follow.
                cursor.line();
            }
            b"f" => {
                let face = face(&mut cursor, assembly.positions.len(), vertices)?;
                assembly
                    .polygon(&face)
                    .map_err(|reason| cursor.flaw(reason))?;
            }
            b"l" | b"p" => {
                assembly.skip();
                cursor.line();
            }
            b"vt" | b"vn" | b"vp" | b"o" | b"g" | b"s" | b"mg" | b"mtllib" | b"usemtl" | b"lod"
            | b"bevel" | b"c_interp" | b"d_interp" | b"shadow_obj" | b"trace_obj" => {
                cursor.line();
            }
            b"curv" | b"curv2" | b"surf" | b"cstype" => {
                let reason = "free-form curves and surfaces are not read; export polygons";
                return Err(cursor.flaw(reason));
            }
            _ => {
                let reason = format!("{} starts no statement that Sinew knows", shown(word));
                return Err(cursor.flaw(reason));
            }
        }
    }
    Ok(assembly)
}

/// A face may name vertices that are defined after it.
fn count_vertices(bytes: &[u8]) -> usize {
    bytes
        .split(|&byte| byte == b'\n')
        .map(<[u8]>::trim_ascii_start)
        .filter(|line| matches!(line, [b'v', b' ' | b'\t', ..]))
        .count()
}

/// The vertices of a face: `vertex/texture/normal`, negative numbers counted back from the last vertex `so_far`.
fn face(cursor: &mut Cursor<'_>, so_far: usize, vertices: usize) -> Parsed<Vec<u32>> {
    let mut face = Vec::new();
    while let Some(corner) = cursor.word_on_line() {
        if corner == b"\\" {
            // The statement goes on in the next line.
            cursor.line();
            continue;
        }
        let number = corner.split(|&byte| byte == b'/').next().unwrap_or(corner);
        let number: i64 = std::str::from_utf8(number)
            .ok()
            .and_then(|number| number.parse().ok())
            .ok_or_else(|| {
                cursor.flaw(format!("expected a vertex number, found {}", shown(corner)))
            })?;
        let back = i64::try_from(so_far).ok().filter(|_| number < 0);
        let counted = back.map_or(number, |so_far| so_far.saturating_add(number) + 1);
        face.push(
            cursor
                .in_range(counted, 1, vertices, "vertex")
                .map_err(|mut flaw| {
                    flaw.reason = format!(
                        "vertex number {number} does not exist: there are {vertices}, counted from 1"
                    );
                    flaw
                })?,
        );
    }
    Ok(face)
}
