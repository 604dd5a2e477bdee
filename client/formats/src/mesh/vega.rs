//! Vega files (`.veg`): tetrahedra or hexahedra; sets, materials and regions are passed.

use sinew_mesh::CellType;

use super::assembly::Assembly;
use super::cursor::{Cursor, shown};
use super::error::Parsed;
use super::labels::Labels;
use super::scalar::{Encoding, Scalar};

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::with_comments(bytes);
    let mut assembly = Assembly::default();
    let mut labels = None;
    let mut in_geometry = true;
    while let Some(word) = cursor.word() {
        match word.to_ascii_uppercase().as_slice() {
            b"*VERTICES" => labels = Some(vertices(&mut cursor, &mut assembly)?),
            b"*ELEMENTS" => elements(&mut cursor, labels.as_ref(), &mut assembly)?,
            b"*INCLUDE" if in_geometry => {
                return Err(cursor.flaw("vertices or elements in another file are not read"));
            }
            // Materials and regions hold nothing of the mesh.
            [b'*', ..] => in_geometry = false,
            _ if in_geometry => {
                let reason = format!("expected a section (*…), found {}", shown(word));
                return Err(cursor.flaw(reason));
            }
            _ => {}
        }
    }
    Ok(assembly)
}

fn vertices(cursor: &mut Cursor<'_>, assembly: &mut Assembly) -> Parsed<Labels> {
    if !assembly.positions.is_empty() {
        return Err(cursor.flaw("a second section of vertices"));
    }
    let count: i64 = cursor.number("the number of vertices")?;
    let axes: i64 = cursor.number("the number of coordinates")?;
    if axes != 3 {
        return Err(cursor.flaw(format!("{axes} coordinates per vertex: there are 3")));
    }
    cursor.line();
    let mut numbers = Vec::new();
    for _ in 0..cursor.claim(count, 4, "vertices")? {
        numbers.push(cursor.number("a vertex number")?);
        let position = cursor.point(Encoding::Text, Scalar::F64)?;
        assembly.positions.push(position);
    }
    Labels::new(numbers.into_iter())
        .map_err(|label| cursor.flaw(format!("two vertices have number {label}")))
}

fn elements(
    cursor: &mut Cursor<'_>,
    labels: Option<&Labels>,
    assembly: &mut Assembly,
) -> Parsed<()> {
    let name = cursor.text("TET or CUBIC")?;
    let (kind, corners) = match name.to_ascii_uppercase().as_str() {
        "TET" | "TETS" => (CellType::Tetrahedron, 4),
        "CUBIC" => (CellType::Hexahedron, 8),
        _ => {
            let reason = format!("expected TET or CUBIC, found {}", shown(name.as_bytes()));
            return Err(cursor.flaw(reason));
        }
    };
    let count: i64 = cursor.number("the number of elements")?;
    let claimed: i64 = cursor.number("the vertices of an element")?;
    if claimed != corners {
        let reason = format!("{claimed} vertices per element: a {kind:?} has {corners}");
        return Err(cursor.flaw(reason));
    }
    cursor.line();
    for _ in 0..cursor.claim(count, 5, "elements")? {
        cursor.number::<i64>("an element number")?;
        let mut cell = Vec::new();
        for _ in 0..corners {
            let label = cursor.number("a vertex number")?;
            cell.push(
                labels
                    .and_then(|labels| labels.index(label))
                    .ok_or_else(|| cursor.flaw(format!("no vertex has number {label}")))?,
            );
        }
        assembly
            .cell(kind, &cell)
            .map_err(|reason| cursor.flaw(reason))?;
    }
    Ok(())
}
