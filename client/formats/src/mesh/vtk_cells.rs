//! VTK's cell types, as both of its file formats number them.

use sinew_mesh::CellType;

use super::assembly::{Assembly, corners};

/// What becomes of a VTK cell type.
enum Role {
    /// No cell, a point or an edge.
    Lesser,
    /// Its corners come first; more vertices than corners only where `curved`.
    Corners {
        kind: CellType,
        curved: bool,
    },
    /// Four vertices, row by row instead of around.
    Pixel,
    /// Eight vertices, row by row instead of around.
    Voxel,
    TriangleStrip,
    Polygon,
    /// The corners, then as many vertices between them.
    QuadraticPolygon,
    /// Its vertices are a stream of faces.
    Polyhedron,
}

fn role(number: i64) -> Option<Role> {
    use CellType::{
        HexagonalPrism, Hexahedron, PentagonalPrism, Pyramid, Quad, Tetrahedron, Triangle, Wedge,
    };
    let flat = |kind| Role::Corners {
        kind,
        curved: false,
    };
    let curved = |kind| Role::Corners { kind, curved: true };
    Some(match number {
        0..=4 | 21 | 35 | 68 | 75 => Role::Lesser,
        5 => flat(Triangle),
        6 => Role::TriangleStrip,
        7 => Role::Polygon,
        8 => Role::Pixel,
        9 => flat(Quad),
        10 => flat(Tetrahedron),
        11 => Role::Voxel,
        12 => flat(Hexahedron),
        13 => flat(Wedge),
        14 => flat(Pyramid),
        15 => flat(PentagonalPrism),
        16 => flat(HexagonalPrism),
        22 | 34 | 69 | 76 => curved(Triangle),
        23 | 28 | 30 | 70 | 77 => curved(Quad),
        24 | 71 | 78 => curved(Tetrahedron),
        25 | 29 | 33 | 72 | 79 => curved(Hexahedron),
        26 | 31 | 32 | 73 | 80 => curved(Wedge),
        27 | 37 | 74 | 81 => curved(Pyramid),
        36 => Role::QuadraticPolygon,
        42 => Role::Polyhedron,
        _ => return None,
    })
}

/// Whether cells of this type are given by a stream of faces.
pub(super) fn is_polyhedron(number: i64) -> bool {
    matches!(role(number), Some(Role::Polyhedron))
}

/// Adds a cell of VTK's type `number`. `vertices` are checked indices, except for a polyhedron, where they are its
/// face stream: the number of faces, then per face the number of its vertices and their checked indices.
pub(super) fn add(assembly: &mut Assembly, number: i64, vertices: &[u32]) -> Result<(), String> {
    let role = role(number).ok_or_else(|| {
        format!("cell type {number}: none of VTK's that Sinew reads (0-16, 21-37, 42, 68-81)")
    })?;
    match role {
        Role::Lesser => {
            assembly.skip();
            Ok(())
        }
        Role::Corners {
            kind,
            curved: false,
        } if vertices.len() > corners(kind) => Err(format!(
            "a {kind:?} has {} vertices, not {}",
            corners(kind),
            vertices.len()
        )),
        Role::Corners { kind, .. } => assembly.cell(kind, vertices),
        Role::Pixel => assembly.cell(CellType::Quad, &around(vertices)),
        Role::Voxel => assembly.cell(CellType::Hexahedron, &around(vertices)),
        Role::TriangleStrip => strip(assembly, vertices),
        Role::Polygon => assembly.polygon(vertices),
        Role::QuadraticPolygon => {
            let (corners, midside) = vertices.split_at(vertices.len() / 2);
            assembly.leave_out_midside(midside);
            assembly.polygon(corners)
        }
        Role::Polyhedron => assembly.polyhedron(&faces(vertices)?),
    }
}

/// Triangles of a strip, every second one turned.
pub(super) fn strip(assembly: &mut Assembly, vertices: &[u32]) -> Result<(), String> {
    for (place, corners) in vertices.windows(3).enumerate() {
        let turned = [corners[1], corners[0], corners[2]];
        assembly.polygon(if place % 2 == 0 { corners } else { &turned })?;
    }
    Ok(())
}

/// Swaps the last two of every four vertices: row by row becomes around.
fn around(vertices: &[u32]) -> Vec<u32> {
    let mut around = vertices.to_vec();
    for four in around.chunks_exact_mut(4) {
        four.swap(2, 3);
    }
    around
}

fn faces(stream: &[u32]) -> Result<Vec<Vec<u32>>, String> {
    let cut = || "the face stream of a polyhedron ends early".to_owned();
    let (&count, mut rest) = stream.split_first().ok_or_else(cut)?;
    let mut faces = Vec::new();
    for _ in 0..count {
        let (&length, vertices) = rest.split_first().ok_or_else(cut)?;
        let (face, others) = vertices.split_at_checked(length as usize).ok_or_else(cut)?;
        faces.push(face.to_vec());
        rest = others;
    }
    if rest.is_empty() {
        return Ok(faces);
    }
    Err(format!(
        "the face stream of a polyhedron is {} numbers too long",
        rest.len()
    ))
}

/// The face stream `numbers` with every vertex number checked by `vertex`, and the counts left as they are.
pub(super) fn check_stream<E>(
    numbers: &[i64],
    vertex: impl Fn(i64) -> Result<u32, E>,
) -> Result<Vec<u32>, E> {
    // A count beyond the stream is refused when the stream is cut into faces.
    let count = |number: i64| u32::try_from(number).unwrap_or(u32::MAX);
    let mut left_in_face = 0;
    numbers
        .iter()
        .enumerate()
        .map(|(place, &number)| {
            if place > 0 && left_in_face > 0 {
                left_in_face -= 1;
                return vertex(number);
            }
            if place > 0 {
                left_in_face = count(number);
            }
            Ok(count(number))
        })
        .collect()
}
