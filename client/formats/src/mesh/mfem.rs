//! MFEM meshes v1.0 (`.mesh`) with straight edges.

use nalgebra::Vector3;
use sinew_mesh::CellType;

use super::assembly::Assembly;
use super::cursor::{Cursor, shown};
use super::error::Parsed;
use super::scalar::{Encoding, Scalar};

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::with_comments(bytes);
    let header = cursor.line();
    if header != b"MFEM mesh v1.0" {
        return Err(cursor.flaw(format!(
            "{} is not read: only “MFEM mesh v1.0”; refine or convert the mesh with MFEM and save it as that",
            shown(header)
        )));
    }
    cursor.keyword("dimension")?;
    cursor.number::<i64>("the dimension")?;
    let elements = cursor.clone();
    // The vertices come last, but the elements are checked against them.
    let mut assembly = Assembly::of(vertices(&mut cursor)?);
    read_cells(elements, &mut assembly)?;
    Ok(assembly)
}

fn vertices(cursor: &mut Cursor<'_>) -> Parsed<Vec<Vector3<f64>>> {
    loop {
        match cursor.text("vertices")? {
            "vertices" => break,
            _ => {
                cursor.line();
            }
        }
    }
    let count: i64 = cursor.number("the number of vertices")?;
    let curved = |cursor: &mut Cursor<'_>| {
        cursor.word();
        cursor.flaw(
            "the mesh is curved (its nodes are a grid function), and Sinew's cells are straight; \
             save it with SetCurvature(1) and vertices",
        )
    };
    if cursor.peek() == Some(b"nodes") {
        return Err(curved(cursor));
    }
    let axes: usize = cursor.number("the number of coordinates")?;
    if !(1..=3).contains(&axes) {
        return Err(cursor.flaw(format!("{axes} coordinates per vertex: there are 1 to 3")));
    }
    let mut positions = Vec::new();
    for _ in 0..cursor.claim(count, axes, "vertices")? {
        let mut position = Vector3::zeros();
        for axis in 0..axes {
            position[axis] = cursor.real(Encoding::Text, Scalar::F64, "a coordinate")?;
        }
        positions.push(position);
    }
    match cursor.peek() {
        None => Ok(positions),
        Some(b"nodes") => Err(curved(cursor)),
        Some(_) => {
            let found = shown(cursor.word().unwrap_or_default());
            Err(cursor.flaw(format!("expected the end of the file, found {found}")))
        }
    }
}

fn read_cells(mut cursor: Cursor<'_>, assembly: &mut Assembly) -> Parsed<()> {
    let vertices = assembly.positions.len();
    for section in ["elements", "boundary"] {
        cursor.keyword(section)?;
        for _ in 0..cursor.count(3, section)? {
            cursor.number::<i64>("an attribute")?;
            let geometry: i64 = cursor.number("a geometry")?;
            let (length, kind) = match geometry {
                0 => (1, None),
                1 => (2, None),
                2 => (3, Some(CellType::Triangle)),
                3 => (4, Some(CellType::Quad)),
                4 => (4, Some(CellType::Tetrahedron)),
                5 => (8, Some(CellType::Hexahedron)),
                6 => (6, Some(CellType::Wedge)),
                7 => (5, Some(CellType::Pyramid)),
                _ => return Err(cursor.flaw(format!("geometry {geometry}: there are 0 to 7"))),
            };
            let cell: Vec<u32> = (0..length)
                .map(|_| cursor.vertex(Encoding::Text, Scalar::I64, 0, vertices))
                .collect::<Parsed<_>>()?;
            match kind {
                None => assembly.skip(),
                Some(kind) => assembly
                    .cell_with_facing_wedges(kind, &cell)
                    .map_err(|reason| cursor.flaw(reason))?,
            }
        }
    }
    Ok(())
}
