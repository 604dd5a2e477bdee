//! TetGen's pair of files: vertices (`.node`) and tetrahedra (`.ele`).

use sinew_mesh::CellType;

use super::assembly::Assembly;
use super::cursor::Cursor;
use super::error::Parsed;
use super::labels::Labels;
use super::scalar::{Encoding, Scalar};

/// The vertices, and the numbers that the file gives them.
pub(super) struct Nodes {
    assembly: Assembly,
    labels: Labels,
}

/// Reads the file of vertices: a number, three coordinates, attributes and a mark in each line.
pub(super) fn parse_nodes(bytes: &[u8]) -> Parsed<Nodes> {
    let mut cursor = Cursor::with_comments(bytes);
    let count: i64 = cursor.number("the number of vertices")?;
    let axes: i64 = cursor.number("the dimension")?;
    if axes != 3 {
        return Err(cursor.flaw(format!("dimension {axes}: TetGen's is 3")));
    }
    cursor.line();
    let mut assembly = Assembly::default();
    let mut numbers: Vec<i64> = Vec::new();
    for _ in 0..cursor.claim(count, 4, "vertices")? {
        numbers.push(cursor.number("a vertex number")?);
        let position = cursor.point(Encoding::Text, Scalar::F64)?;
        assembly.positions.push(position);
        while cursor.word_on_line().is_some() {}
    }
    let labels = Labels::new(numbers.into_iter())
        .map_err(|label| cursor.flaw(format!("two vertices have number {label}")))?;
    Ok(Nodes { assembly, labels })
}

/// Reads the file of tetrahedra: a number, four or ten vertices, and attributes in each line.
pub(super) fn parse_elements(nodes: Nodes, bytes: &[u8]) -> Parsed<Assembly> {
    let Nodes {
        mut assembly,
        labels,
    } = nodes;
    let mut cursor = Cursor::with_comments(bytes);
    let count: i64 = cursor.number("the number of tetrahedra")?;
    let corners: i64 = cursor.number("the vertices of a tetrahedron")?;
    if corners != 4 && corners != 10 {
        return Err(cursor.flaw(format!(
            "{corners} vertices per tetrahedron: there are 4 or 10"
        )));
    }
    cursor.line();
    for _ in 0..cursor.claim(count, 5, "tetrahedra")? {
        cursor.number::<i64>("the number of a tetrahedron")?;
        let mut cell = Vec::new();
        for _ in 0..corners {
            let label = cursor.number("a vertex number")?;
            let vertex = labels.index(label);
            cell.push(vertex.ok_or_else(|| cursor.flaw(format!("no vertex has number {label}")))?);
        }
        assembly
            .cell(CellType::Tetrahedron, &cell)
            .map_err(|reason| cursor.flaw(reason))?;
        while cursor.word_on_line().is_some() {}
    }
    Ok(assembly)
}
