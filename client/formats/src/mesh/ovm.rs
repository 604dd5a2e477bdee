//! Text files of OpenVolumeMesh (`.ovm`): vertices, edges, faces of half-edges, polyhedra of half-faces.
//! Writers differ in whether half-faces look into their cell or out of it.

use super::assembly::Assembly;
use super::cursor::Cursor;
use super::error::Parsed;
use super::scalar::{Encoding, Scalar};
use super::shell::FaceUses;

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::with_comments(bytes);
    cursor.keyword("OVM")?;
    cursor.keyword("ASCII")?;
    cursor.keyword("Vertices")?;
    let vertices = cursor.count(3, "vertices")?;
    let mut assembly = Assembly::default();
    for _ in 0..vertices {
        let position = cursor.point(Encoding::Text, Scalar::F64)?;
        assembly.positions.push(position);
    }
    cursor.keyword("Edges")?;
    let mut edges = Vec::new();
    for _ in 0..cursor.count(2, "edges")? {
        let from = cursor.vertex(Encoding::Text, Scalar::I64, 0, vertices)?;
        let to = cursor.vertex(Encoding::Text, Scalar::I64, 0, vertices)?;
        edges.push([from, to]);
    }
    cursor.keyword("Faces")?;
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for _ in 0..cursor.count(1, "faces")? {
        let length = cursor.count(1, "half-edges of a face")?;
        let mut face = Vec::new();
        for _ in 0..length {
            let half = half(&mut cursor, edges.len(), "half-edge")?;
            face.push(edges[half.whole][half.side]);
        }
        faces.push(face);
    }
    cursor.keyword("Polyhedra")?;
    let mut uses = FaceUses::of(faces.len());
    for _ in 0..cursor.count(1, "polyhedra")? {
        let length = cursor.count(1, "half-faces of a polyhedron")?;
        let mut shell = Vec::new();
        for _ in 0..length {
            let half = half(&mut cursor, faces.len(), "half-face")?;
            uses.add(half.whole).map_err(|reason| cursor.flaw(reason))?;
            let mut face = faces[half.whole].clone();
            if half.side == 1 {
                face.reverse();
            }
            shell.push(face);
        }
        assembly
            .unturned_polyhedron(shell)
            .map_err(|reason| cursor.flaw(reason))?;
    }
    // Properties follow, which a grid does not hold.
    Ok(assembly)
}

/// One side of an edge or a face.
struct Half {
    whole: usize,
    /// 0 as the file gives it, 1 turned.
    side: usize,
}

/// Half `2 n` is `n` as given, half `2 n + 1` is `n` turned.
fn half(cursor: &mut Cursor<'_>, wholes: usize, what: &str) -> Parsed<Half> {
    let number = cursor.number(what)?;
    let half = cursor.in_range(number, 0, 2 * wholes, what)? as usize;
    Ok(Half {
        whole: half / 2,
        side: half % 2,
    })
}
