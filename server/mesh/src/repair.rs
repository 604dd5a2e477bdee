//! Making a grid usable: every cell the right way out, nothing degenerate, nothing twice, nothing unused.

use nalgebra::Vector3;

use crate::adjacency::FaceSets;
use crate::inspect::{Side, exposed_faces, inspect};
use crate::measure::{cell_volume, cone_volume};
use crate::winding::{Patches, by_edge, edge_uses};
use crate::{CellType, Cells, Grid, Inspection};

/// Why a cell was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// It is a slot without a cell.
    Empty,
    /// It names a vertex twice.
    RepeatedVertex,
    /// It has the same vertices as an earlier cell.
    Duplicate,
    /// A polyhedron with an edge that not exactly two of its faces share.
    Open,
    /// It encloses next to nothing.
    ZeroVolume,
    /// It covers next to nothing.
    ZeroArea,
    /// It is folded over, whichever way out.
    Folded,
}

/// What [`repair`] has done. Ids are those of the grid before.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Cells turned the other way out, ascending; some may be among the dropped ones, too.
    pub turned: Vec<u32>,
    /// Cells left out and the first reason found, ascending.
    pub dropped: Vec<(u32, Fault)>,
    /// Of each cell that is left, its id before; ascending.
    pub cells: Vec<u32>,
    /// Of each vertex that is left, its id before; ascending. The others were used by no cell that is left.
    pub vertices: Vec<u32>,
}

/// Repairs a checked grid:
///
/// 1. Cells of negative volume are turned by reordering their vertices, polyhedra by winding their faces consistently
///    and outward.
/// 2. Cells with a [`Fault`] are dropped.
/// 3. Free surface cells (see [`Inspection`]) are wound like their neighbours: a closed part outward, an open one as most
///    of it was. Parts that are consistent stay as they are (the inner wall of a hollow body winds the other way than
///    the outer), unless all closed parts together enclose a negative volume: then these are turned.
/// 4. Vertices of no cell are dropped. Coincident vertices are not merged: they may be meant, as where a mesh is torn.
///
/// The result passes [`Grid::check`], and [`inspect`] finds none of this in it any more, but for edges of surfaces that
/// cannot be wound consistently (a Möbius strip).
pub fn repair(mut grid: Grid) -> (Grid, Repairs) {
    let mut repairs = Repairs {
        cells: (0u32..).zip(&grid.cells.types).map(|(id, _)| id).collect(),
        ..Repairs::default()
    };
    let empty: Vec<_> = (repairs.cells.iter().zip(grid.cells.iter()))
        .filter(|(_, cell)| cell.kind == CellType::Empty)
        .map(|(&id, _)| (id, Fault::Empty))
        .collect();
    if !empty.is_empty() {
        drop_cells(&mut grid, &empty, &mut repairs);
    }
    turn_volumes(&mut grid, &mut repairs);
    // Dropping flat cells raises the median that others are measured by, so once may not be enough.
    loop {
        let faults = faults(&inspect(&grid));
        if faults.is_empty() {
            break;
        }
        drop_cells(&mut grid, &faults, &mut repairs);
    }
    turn_surfaces(&mut grid, &mut repairs);
    drop_unused_vertices(&mut grid, &mut repairs);
    repairs.turned.sort_unstable();
    repairs.dropped.sort_unstable();
    (grid, repairs)
}

/// The cells to drop, ascending, each with the first of its faults.
fn faults(found: &Inspection) -> Vec<(u32, Fault)> {
    let mut faults: Vec<_> = (found.duplicate_cells.iter())
        .map(|&[cell, _]| (cell, Fault::Duplicate))
        .collect();
    for (cells, fault) in [
        (&found.repeated_vertex_cells, Fault::RepeatedVertex),
        (&found.open_polyhedra, Fault::Open),
        (&found.zero_volume_cells, Fault::ZeroVolume),
        (&found.zero_area_cells, Fault::ZeroArea),
        (&found.inverted_cells, Fault::Folded),
    ] {
        faults.extend(cells.iter().map(|&cell| (cell, fault)));
    }
    faults.sort_unstable();
    faults.dedup_by_key(|(cell, _)| *cell);
    faults
}

fn turn_volumes(grid: &mut Grid, repairs: &mut Repairs) {
    for id in 0..grid.cells.len() {
        let rewound =
            grid.cells.cell(id).kind == CellType::Polyhedron && wind_faces(&mut grid.cells, id);
        let negative = cell_volume(&grid.positions, &grid.cells.cell(id)) < 0.0;
        if negative {
            turn(&mut grid.cells, id);
        }
        if rewound || negative {
            repairs.turned.push(repairs.cells[id]);
        }
    }
}

/// Winds a polyhedron's faces all like its first; returns whether that changed any.
fn wind_faces(cells: &mut Cells, id: usize) -> bool {
    let cell = cells.cell(id);
    let faces = cell.face_stream[0];
    let uses = edge_uses((0..).zip(cell.faces()));
    let mut patches = Patches::new(faces, &uses);
    let against: Vec<_> = (0..faces).map(|face| patches.root(face).1).collect();
    for_each_ring(cells, id, |face, ring| {
        if against[face] {
            ring[1..].reverse();
        }
    });
    against.contains(&true)
}

fn for_each_ring(cells: &mut Cells, id: usize, mut change: impl FnMut(usize, &mut [u32])) {
    let ends = cells.face_offsets[id] as usize..cells.face_offsets[id + 1] as usize;
    let mut stream = &mut cells.faces[ends][1..];
    let mut face = 0;
    while let Some((&mut count, rest)) = stream.split_first_mut() {
        let (ring, rest) = rest.split_at_mut(count as usize);
        change(face, ring);
        stream = rest;
        face += 1;
    }
}

/// Turns a cell the other way out.
fn turn(cells: &mut Cells, id: usize) {
    let kind = cells.cell(id).kind;
    if kind == CellType::Polyhedron {
        return for_each_ring(cells, id, |_, ring| ring[1..].reverse());
    }
    let ends = cells.offsets[id] as usize..cells.offsets[id + 1] as usize;
    let vertices = &mut cells.connectivity[ends];
    match kind {
        CellType::Triangle | CellType::Polygon | CellType::Quad => vertices[1..].reverse(),
        CellType::Tetrahedron => vertices.swap(1, 2),
        CellType::Pyramid => vertices.swap(1, 3),
        CellType::Hexahedron
        | CellType::Wedge
        | CellType::PentagonalPrism
        | CellType::HexagonalPrism => vertices.rotate_left(vertices.len() / 2),
        CellType::Empty => {}
        CellType::Polyhedron => unreachable!("turned above"),
    }
}

fn drop_cells(grid: &mut Grid, faults: &[(u32, Fault)], repairs: &mut Repairs) {
    let mut faults = faults.iter().peekable();
    let mut kept = Cells::default();
    let mut ids = Vec::new();
    for ((here, cell), &id) in (0u32..).zip(grid.cells.iter()).zip(&repairs.cells) {
        match faults.next_if(|(faulty, _)| *faulty == here) {
            Some(&(_, fault)) => repairs.dropped.push((id, fault)),
            None => {
                kept.push(cell);
                ids.push(id);
            }
        }
    }
    grid.cells = kept;
    repairs.cells = ids;
}

/// What is known of a patch of surface cells, at its root.
#[derive(Clone, Copy, Default)]
struct Patch {
    cells: usize,
    /// Cells that wind against the root.
    against: usize,
    open: bool,
    /// Signed volume if all wound as the root does, m³.
    volume: f64,
    /// Whether the root has to turn.
    turn: bool,
}

fn turn_surfaces(grid: &mut Grid, repairs: &mut Repairs) {
    let faces = FaceSets::new(&grid.cells);
    let exposed = faces.exposed(|_| {});
    let exposed = &exposed[faces.of_volumes..];
    let Some((_, first)) = exposed_faces(grid, exposed, Side::Surface).next() else {
        return;
    };
    let origin = grid.positions[first.vertex(0) as usize];
    let at = |vertex: u32| -> Vector3<f64> { grid.positions[vertex as usize] - origin };
    let uses = edge_uses(exposed_faces(grid, exposed, Side::Surface));
    let count = u32::try_from(grid.cells.len()).expect("checked grids number cells by u32");
    let mut roots = Patches::new(count, &uses);
    let mut patches = vec![Patch::default(); grid.cells.len()];
    let mut winding = Vec::new();
    for (cell, face) in exposed_faces(grid, exposed, Side::Surface) {
        let (root, against) = roots.root(cell);
        let patch = &mut patches[root as usize];
        patch.cells += 1;
        patch.against += usize::from(against);
        patch.volume += cone_volume(&face, &at) * if against { -1.0 } else { 1.0 };
        winding.push((cell, root, against));
    }
    for edge in by_edge(&uses).filter(|edge| edge.len() != 2) {
        for one in edge {
            patches[roots.root(one.face).0 as usize].open = true;
        }
    }
    choose(&mut patches);
    for (cell, root, against) in winding {
        if against != patches[root as usize].turn {
            turn(&mut grid.cells, cell as usize);
            repairs.turned.push(repairs.cells[cell as usize]);
        }
    }
}

/// Decides which way out each patch goes.
fn choose(patches: &mut [Patch]) {
    let mut enclosed = 0.0;
    for patch in patches.iter_mut() {
        patch.turn = if patch.against == 0 {
            false
        } else if patch.open {
            2 * patch.against > patch.cells
        } else {
            patch.volume < 0.0
        };
        if !patch.open {
            enclosed += if patch.turn {
                -patch.volume
            } else {
                patch.volume
            };
        }
    }
    if enclosed < 0.0 {
        for patch in patches.iter_mut().filter(|patch| !patch.open) {
            patch.turn = !patch.turn;
        }
    }
}

fn drop_unused_vertices(grid: &mut Grid, repairs: &mut Repairs) {
    let mut numbers = vec![u32::MAX; grid.positions.len()];
    for &vertex in &grid.cells.connectivity {
        numbers[vertex as usize] = 0;
    }
    let mut positions = Vec::new();
    for (vertex, number) in (0u32..).zip(&mut numbers) {
        if *number == 0 {
            *number = u32::try_from(positions.len()).expect("not more than there were");
            positions.push(grid.positions[vertex as usize]);
            repairs.vertices.push(vertex);
        }
    }
    grid.positions = positions;
    let renumber = |vertex: &mut u32| *vertex = numbers[*vertex as usize];
    grid.cells.connectivity.iter_mut().for_each(renumber);
    for id in 0..grid.cells.len() {
        if grid.cells.cell(id).kind == CellType::Polyhedron {
            for_each_ring(&mut grid.cells, id, |_, ring| {
                ring.iter_mut().for_each(renumber)
            });
        }
    }
}
