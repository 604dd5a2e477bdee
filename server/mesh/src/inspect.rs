//! What a grid holds, and what is wrong with its shape.

use nalgebra::Vector3;

use crate::adjacency::{FaceSets, duplicate_cells};
use crate::measure::{cell_volume, cone_volume, face_normal, smallest_corner};
use crate::winding::{EdgeUse, by_edge, edge_uses};
use crate::{Cell, CellType, Face, Grid};

/// Below this part of the median volume (or area), a cell counts as flat.
const FLAT: f64 = 1e-6;

/// A relative volume or Jacobian above minus this is not negative: four vertices in a plane give either sign.
const ROUNDING: f64 = 1e-12;

/// What a grid holds, and what is wrong with it. Ids are indices of cells or vertices, ascending.
///
/// *Free* surface cells are those that are not a face of a cell which encloses a volume: only they are a surface of
/// their own. (Mesh files often list the boundary of a volume once more.)
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspection {
    /// How many cells of each kind there are, by ascending type number; kinds without cells are left out.
    pub counts: Vec<(CellType, usize)>,
    /// Lowest and highest corner of the box around all vertices, m; `None` without vertices.
    pub bounds: Option<[Vector3<f64>; 2]>,
    /// The signed volumes of all cells together, m³; without cells that enclose one, what the surface encloses, or 0 if
    /// it is not closed.
    pub volume: f64,
    /// Parts that share no vertex.
    pub components: usize,
    /// Most volumes (or the volume that the surface encloses) are negative: the grid is inside-out as a whole.
    pub inside_out: bool,
    /// Cells whose volume, or Jacobian at some corner, has the other sign than most; polyhedra whose faces disagree on
    /// what is outside.
    pub inverted_cells: Vec<u32>,
    /// Cells with less than 10⁻⁶ of the median volume.
    pub zero_volume_cells: Vec<u32>,
    /// Surface cells with less than 10⁻⁶ of their median area.
    pub zero_area_cells: Vec<u32>,
    /// Cells that name a vertex twice; polyhedra with such a face.
    pub repeated_vertex_cells: Vec<u32>,
    /// Polyhedra with an edge that not exactly two of their faces share.
    pub open_polyhedra: Vec<u32>,
    /// Cells with the same vertices as an earlier one, and that.
    pub duplicate_cells: Vec<[u32; 2]>,
    /// The vertices of faces that more than two volumes share.
    pub non_manifold_faces: Vec<Vec<u32>>,
    /// Edges that more than two faces of the volumes' boundary share, or more than two free surface cells.
    pub non_manifold_edges: Vec<[u32; 2]>,
    /// Edges of just one free surface cell: the surface's rim.
    pub open_edges: Vec<[u32; 2]>,
    /// Edges whose two free surface cells wind in opposite senses.
    pub miswound_edges: Vec<[u32; 2]>,
    /// Vertices of no cell.
    pub unused_vertices: Vec<u32>,
    /// Vertices at exactly the place of an earlier one, and that.
    pub duplicate_vertices: Vec<[u32; 2]>,
}

/// Looks at a checked grid. Time is that of sorting, memory linear.
pub fn inspect(grid: &Grid) -> Inspection {
    let mut found = Inspection {
        counts: counts(grid),
        bounds: bounds(&grid.positions),
        duplicate_cells: duplicate_cells(&grid.cells),
        duplicate_vertices: duplicate_vertices(&grid.positions),
        ..Inspection::default()
    };
    (found.components, found.unused_vertices) = components(grid);
    inspect_cells(grid, &mut found);
    inspect_faces(grid, &mut found);
    found
}

fn counts(grid: &Grid) -> Vec<(CellType, usize)> {
    let mut counts = CellType::ALL.map(|kind| (kind, 0));
    for cell in grid.cells.iter() {
        let entry = counts.iter_mut().find(|(kind, _)| *kind == cell.kind);
        entry.expect("ALL has every kind").1 += 1;
    }
    counts.into_iter().filter(|&(_, count)| count > 0).collect()
}

fn bounds(positions: &[Vector3<f64>]) -> Option<[Vector3<f64>; 2]> {
    let first = positions.first()?;
    Some(positions.iter().fold([*first; 2], |[low, high], position| {
        [low.inf(position), high.sup(position)]
    }))
}

fn duplicate_vertices(positions: &[Vector3<f64>]) -> Vec<[u32; 2]> {
    // Adding 0 makes -0 equal to 0.
    let mut sorted: Vec<_> = (0u32..)
        .zip(positions)
        .map(|(vertex, at)| ([at.x + 0.0, at.y + 0.0, at.z + 0.0], vertex))
        .collect();
    sorted.sort_unstable_by(|(a, i), (b, j)| {
        let axes = (0..3).map(|axis| a[axis].total_cmp(&b[axis]));
        axes.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
            .then(i.cmp(j))
    });
    let mut duplicates = Vec::new();
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        duplicates.extend(same[1..].iter().map(|&(_, again)| [again, same[0].1]));
    }
    duplicates.sort_unstable();
    duplicates
}

/// The number of components, and the vertices that are in none.
fn components(grid: &Grid) -> (usize, Vec<u32>) {
    const UNUSED: u32 = u32::MAX;
    let mut parent = vec![UNUSED; grid.positions.len()];
    let root = |parent: &mut [u32], mut at: u32| {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    };
    let mut components = 0;
    for cell in grid.cells.iter() {
        for &vertex in cell.vertices {
            if parent[vertex as usize] == UNUSED {
                parent[vertex as usize] = vertex;
                components += 1;
            }
            let (a, b) = (
                root(&mut parent, vertex),
                root(&mut parent, cell.vertices[0]),
            );
            if a != b {
                parent[a.max(b) as usize] = a.min(b);
                components -= 1;
            }
        }
    }
    let vertices = (0u32..).zip(parent);
    let unused = vertices.filter(|&(_, parent)| parent == UNUSED);
    (components, unused.map(|(vertex, _)| vertex).collect())
}

/// Each cell by itself, but for the medians.
fn inspect_cells(grid: &Grid, found: &mut Inspection) {
    let (mut volumes, mut areas) = (Vec::new(), Vec::new());
    for (id, cell) in (0u32..).zip(grid.cells.iter()) {
        if has_repeated_vertex(&cell) {
            found.repeated_vertex_cells.push(id);
        }
        if cell.kind.is_volume() {
            volumes.push((id, cell_volume(&grid.positions, &cell)));
        } else if cell.kind.is_surface() {
            let normals = cell.faces().map(|face| face_normal(&grid.positions, &face));
            areas.push((id, normals.map(|normal| normal.norm()).sum()));
        }
    }
    let typical = median(&volumes);
    found.zero_volume_cells = flat(&volumes, typical);
    found.zero_area_cells = flat(&areas, median(&areas));
    found.volume = volumes.iter().fold(0.0, |sum, (_, volume)| sum + volume);

    let negative = volumes.iter().filter(|(_, volume)| *volume < 0.0).count();
    let positive = volumes.iter().filter(|(_, volume)| *volume > 0.0).count();
    found.inside_out = negative > positive;
    let sign = if found.inside_out { -1.0 } else { 1.0 };
    let at = |vertex: u32| grid.positions[vertex as usize];
    for (id, volume) in volumes {
        let cell = grid.cells.cell(id as usize);
        let folded = || smallest_corner(&cell, sign, &at).is_some_and(|j| j < -ROUNDING);
        let winding = winding(&cell);
        if winding == Winding::Open {
            found.open_polyhedra.push(id);
        }
        let is_negative = sign * volume < -ROUNDING * typical;
        if is_negative || folded() || winding == Winding::Inconsistent {
            found.inverted_cells.push(id);
        }
    }
}

fn has_repeated_vertex(cell: &Cell<'_>) -> bool {
    let repeats = |ring: &mut [u32]| {
        ring.sort_unstable();
        ring.windows(2).any(|pair| pair[0] == pair[1])
    };
    let mut fixed = [0; 12];
    if cell.kind == CellType::Polyhedron {
        let mut faces = cell.faces();
        faces.any(|face| repeats(&mut face.vertices().collect::<Vec<_>>()))
    } else if let Some(vertices) = fixed.get_mut(..cell.vertices.len()) {
        vertices.copy_from_slice(cell.vertices);
        repeats(vertices)
    } else {
        repeats(&mut cell.vertices.to_vec())
    }
}

/// The median of the sizes, regardless of sign; 0 if there is none.
fn median(sizes: &[(u32, f64)]) -> f64 {
    let mut sorted: Vec<_> = sizes.iter().map(|(_, size)| size.abs()).collect();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return 0.0;
    }
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The cells with less than [`FLAT`] of the median size, or none at all.
fn flat(sizes: &[(u32, f64)], median: f64) -> Vec<u32> {
    let flat = |size: f64| size.abs() < FLAT * median || size == 0.0;
    let cells = sizes.iter().filter(|&&(_, size)| flat(size));
    cells.map(|&(cell, _)| cell).collect()
}

/// How a polyhedron's faces fit together; every other kind is [`Winding::Consistent`] by its pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Winding {
    Consistent,
    Inconsistent,
    Open,
}

fn winding(cell: &Cell<'_>) -> Winding {
    if cell.kind != CellType::Polyhedron {
        return Winding::Consistent;
    }
    let uses = edge_uses((0..).zip(cell.faces()));
    if by_edge(&uses).any(|edge| edge.len() != 2) {
        Winding::Open
    } else if by_edge(&uses).any(|edge| edge[0].descends == edge[1].descends) {
        Winding::Inconsistent
    } else {
        Winding::Consistent
    }
}

/// How faces meet.
fn inspect_faces(grid: &Grid, found: &mut Inspection) {
    let faces = FaceSets::new(&grid.cells);
    let exposed = faces.exposed(|crowded| found.non_manifold_faces.push(crowded.to_vec()));
    let boundary = exposed_faces(grid, &exposed, Side::Volumes);
    let crowded = |edge: &&[EdgeUse]| edge.len() > 2;
    let uses = edge_uses(boundary);
    let edges = by_edge(&uses).filter(crowded).map(|edge| edge[0].ends);
    found.non_manifold_edges = edges.collect();

    let uses = edge_uses(exposed_faces(
        grid,
        &exposed[faces.of_volumes..],
        Side::Surface,
    ));
    let mut closed = !uses.is_empty();
    for edge in by_edge(&uses) {
        closed &= edge.len() == 2;
        let ends = edge[0].ends;
        match edge {
            [_] => found.open_edges.push(ends),
            [a, b] if a.descends == b.descends => found.miswound_edges.push(ends),
            [_, _] => {}
            _ => found.non_manifold_edges.push(ends),
        }
    }
    found.non_manifold_edges.sort_unstable();
    found.non_manifold_edges.dedup();
    let is_surface = found.counts.iter().all(|(kind, _)| !kind.is_volume());
    if is_surface && closed {
        let origin = grid.positions[uses[0].ends[0] as usize];
        let at = |vertex: u32| grid.positions[vertex as usize] - origin;
        let cones = grid.cells.iter().flat_map(|cell| cell.faces());
        found.volume = cones.map(|face| cone_volume(&face, &at)).sum();
        found.inside_out = found.miswound_edges.is_empty() && found.volume < 0.0;
    }
}

/// Which cells' faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// Those that enclose a volume.
    Volumes,
    /// Surface cells.
    Surface,
}

/// The exposed faces on one side, with their cells. `exposed` has one entry per face of that side.
pub(crate) fn exposed_faces<'a>(
    grid: &'a Grid,
    exposed: &'a [bool],
    side: Side,
) -> impl Iterator<Item = (u32, Face<'a>)> {
    let cells = (0u32..).zip(grid.cells.iter());
    let cells = cells.filter(move |(_, cell)| match side {
        Side::Volumes => cell.kind.is_volume(),
        Side::Surface => cell.kind.is_surface(),
    });
    let faces = cells.flat_map(|(id, cell)| cell.faces().map(move |face| (id, face)));
    faces
        .zip(exposed)
        .filter(|(_, exposed)| **exposed)
        .map(|(face, _)| face)
}
