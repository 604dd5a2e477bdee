//! Gmsh's element types, common to all versions of its format.

use sinew_mesh::CellType;

/// A Gmsh element type.
pub(super) struct Element {
    /// Nodes in all.
    pub(super) nodes: usize,
    /// The cell made of its first nodes; none for points and edges.
    pub(super) kind: Option<CellType>,
}

/// The element type with Gmsh's `number`.
pub(super) fn element(number: i64) -> Option<Element> {
    use CellType::{Hexahedron, Pyramid, Quad, Tetrahedron, Triangle, Wedge};
    let (kind, nodes) = match number {
        15 => (None, 1),
        1 => (None, 2),
        8 => (None, 3),
        26 => (None, 4),
        27 => (None, 5),
        28 => (None, 6),
        2 => (Some(Triangle), 3),
        9 => (Some(Triangle), 6),
        20 => (Some(Triangle), 9),
        21 => (Some(Triangle), 10),
        22 => (Some(Triangle), 12),
        23 => (Some(Triangle), 15),
        24 => (Some(Triangle), 15),
        25 => (Some(Triangle), 21),
        3 => (Some(Quad), 4),
        16 => (Some(Quad), 8),
        10 => (Some(Quad), 9),
        36 => (Some(Quad), 16),
        37 => (Some(Quad), 25),
        4 => (Some(Tetrahedron), 4),
        11 => (Some(Tetrahedron), 10),
        29 => (Some(Tetrahedron), 20),
        30 => (Some(Tetrahedron), 35),
        31 => (Some(Tetrahedron), 56),
        5 => (Some(Hexahedron), 8),
        17 => (Some(Hexahedron), 20),
        12 => (Some(Hexahedron), 27),
        92 => (Some(Hexahedron), 64),
        93 => (Some(Hexahedron), 125),
        6 => (Some(Wedge), 6),
        18 => (Some(Wedge), 15),
        13 => (Some(Wedge), 18),
        90 => (Some(Wedge), 40),
        91 => (Some(Wedge), 75),
        7 => (Some(Pyramid), 5),
        19 => (Some(Pyramid), 13),
        14 => (Some(Pyramid), 14),
        _ => return None,
    };
    Some(Element { nodes, kind })
}
