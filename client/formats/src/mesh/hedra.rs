//! HEDRA files of cinolib: vertices, faces, and polyhedra as lists of faces.
//! The sign of a face tells its two cells apart; the rings themselves are wound either way.

use super::assembly::Assembly;
use super::cursor::Cursor;
use super::error::Parsed;
use super::scalar::{Encoding, Scalar};
use super::shell::FaceUses;

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::with_comments(bytes);
    let vertices: i64 = cursor.number("the number of vertices")?;
    let faces: i64 = cursor.number("the number of faces")?;
    let polyhedra: i64 = cursor.number("the number of polyhedra")?;
    let vertices = cursor.claim(vertices, 3, "vertices")?;
    let faces = cursor.claim(faces, 4, "faces")?;
    let polyhedra = cursor.claim(polyhedra, 5, "polyhedra")?;
    let mut assembly = Assembly::default();
    for _ in 0..vertices {
        let position = cursor.point(Encoding::Text, Scalar::F64)?;
        assembly.positions.push(position);
    }
    let mut loops: Vec<Vec<u32>> = Vec::with_capacity(faces);
    for _ in 0..faces {
        let length = cursor.count(1, "vertices of a face")?;
        let face = (0..length).map(|_| cursor.vertex(Encoding::Text, Scalar::I64, 1, vertices));
        loops.push(face.collect::<Parsed<_>>()?);
    }
    let mut uses = FaceUses::of(faces);
    for _ in 0..polyhedra {
        let length = cursor.count(1, "faces of a polyhedron")?;
        let mut shell = Vec::new();
        for _ in 0..length {
            let signed: i64 = cursor.number("a face number")?;
            let face = cursor.in_range(signed.saturating_abs(), 1, faces, "face")?;
            uses.add(face as usize)
                .map_err(|reason| cursor.flaw(reason))?;
            shell.push(loops[face as usize].clone());
        }
        assembly
            .unturned_polyhedron(shell)
            .map_err(|reason| cursor.flaw(reason))?;
    }
    Ok(assembly)
}
