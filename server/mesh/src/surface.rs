//! The surface of a grid, as triangles to draw.

use nalgebra::Vector3;

use crate::adjacency::FaceSets;
use crate::{CellType, Cells, Face};

/// Triangles that cover what is seen of a grid from outside.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surface {
    /// The grid's vertices on the surface, ascending.
    pub vertices: Vec<u32>,
    /// Indices into `vertices`, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The surface of checked cells: the faces that belong to one volume only, by ascending cell, then the surface cells
/// that are no face of a volume, as they are wound. Polygons become fans around their first vertex.
pub fn surface(cells: &Cells) -> Surface {
    let [whole, _] = split_surface(cells, |_| false);
    whole
}

/// The surface in two parts: the faces that `is_second` does not take, and those that it does.
pub fn split_surface(cells: &Cells, mut is_second: impl FnMut(&Face<'_>) -> bool) -> [Surface; 2] {
    let faces = FaceSets::new(cells);
    let exposed = faces.exposed(|_| {});
    let mut exposed = exposed.iter();
    let mut parts = [Vec::new(), Vec::new()];
    for wanted in [CellType::is_volume, CellType::is_surface] {
        for cell in cells.iter().filter(|cell| wanted(cell.kind)) {
            for face in cell.faces() {
                if exposed.next() == Some(&true) {
                    parts[usize::from(is_second(&face))].extend(fan(&face));
                }
            }
        }
    }
    parts.map(compact)
}

fn fan(face: &Face<'_>) -> impl Iterator<Item = [u32; 3]> {
    (2..face.len()).map(|corner| [face.vertex(0), face.vertex(corner - 1), face.vertex(corner)])
}

/// From triangles of grid vertices to triangles of surface vertices.
fn compact(mut triangles: Vec<[u32; 3]>) -> Surface {
    let most = triangles.iter().flatten().max();
    let mut number = vec![u32::MAX; most.map_or(0, |&most| most as usize + 1)];
    for &vertex in triangles.iter().flatten() {
        number[vertex as usize] = 0;
    }
    let mut vertices = Vec::new();
    for (vertex, number) in (0u32..).zip(&mut number) {
        if *number == 0 {
            *number = u32::try_from(vertices.len()).expect("not more than vertices in the grid");
            vertices.push(vertex);
        }
    }
    for vertex in triangles.iter_mut().flatten() {
        *vertex = number[*vertex as usize];
    }
    Surface {
        vertices,
        triangles,
    }
}

/// Writes the unit normal of each surface vertex to `out`: the mean of its triangles' normals, weighted by area, or zero
/// where they cancel or have no area. `positions` are those of the grid; `out` is resized to `surface.vertices`.
///
/// # Panics
/// If the surface names a vertex that `positions` does not have.
pub fn vertex_normals(positions: &[Vector3<f64>], surface: &Surface, out: &mut Vec<[f32; 3]>) {
    let mut sums = vec![Vector3::<f64>::zeros(); surface.vertices.len()];
    let at = |corner: u32| positions[surface.vertices[corner as usize] as usize];
    for triangle in &surface.triangles {
        // By hand: an array's `map` with checked indices is not inlined, and doubles the time.
        let [a, b, c] = [at(triangle[0]), at(triangle[1]), at(triangle[2])];
        let normal = (b - a).cross(&(c - a));
        for &corner in triangle {
            sums[corner as usize] += normal;
        }
    }
    out.clear();
    out.extend(sums.iter().map(|sum| -> [f32; 3] {
        let length = sum.norm();
        let unit = if length > 0.0 { sum / length } else { *sum };
        unit.cast::<f32>().into()
    }));
}
