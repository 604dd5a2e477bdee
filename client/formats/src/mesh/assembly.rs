//! Puts a grid together from what a reader finds.

use nalgebra::Vector3;
use sinew_mesh::{CellType, Cells, Grid};

use super::error::{Flaw, Parsed};
use super::shell::turn_outward;

/// Gmsh, Medit and MFEM number a wedge so that its first triangle faces the second; VTK so that it faces away.
pub(super) const VTK_WEDGE: [usize; 6] = [0, 2, 1, 3, 5, 4];

/// Vertices and cells on their way to a grid. Vertex indices are checked by whoever adds them.
#[derive(Default)]
pub(crate) struct Assembly {
    pub(crate) positions: Vec<Vector3<f64>>,
    volumes: Cells,
    faces: Cells,
    /// Edges and points.
    lesser: usize,
    /// Vertices of higher-order cells that are no corners.
    midside: Vec<u32>,
    curved: usize,
    pub(super) warnings: Vec<String>,
}

impl Assembly {
    pub(super) fn of(positions: Vec<Vector3<f64>>) -> Self {
        Self {
            positions,
            ..Self::default()
        }
    }

    /// Counts an edge or a point, which a grid does not hold.
    pub(super) fn skip(&mut self) {
        self.lesser += 1;
    }

    /// Adds a cell with a fixed number of corners; vertices beyond the corners are those of a higher order.
    pub(super) fn cell(&mut self, kind: CellType, vertices: &[u32]) -> Result<(), String> {
        let wanted = corners(kind);
        let Some((corners, midside)) = vertices.split_at_checked(wanted) else {
            return Err(format!(
                "a {kind:?} has {wanted} vertices, not {}",
                vertices.len()
            ));
        };
        self.leave_out_midside(midside);
        self.add(kind, corners.iter().copied());
        Ok(())
    }

    /// Notes the vertices of one cell that are no corners.
    pub(super) fn leave_out_midside(&mut self, vertices: &[u32]) {
        if !vertices.is_empty() {
            self.curved += 1;
            self.midside.extend_from_slice(vertices);
        }
    }

    /// Adds a wedge, if it is one, with its triangles turned as VTK has them, and any other cell as it is.
    pub(super) fn cell_with_facing_wedges(
        &mut self,
        kind: CellType,
        vertices: &[u32],
    ) -> Result<(), String> {
        if kind != CellType::Wedge || vertices.len() < VTK_WEDGE.len() {
            return self.cell(kind, vertices);
        }
        let mut turned = vertices.to_vec();
        for (to, from) in VTK_WEDGE.into_iter().enumerate() {
            turned[to] = vertices[from];
        }
        self.cell(kind, &turned)
    }

    /// Adds a face with any number of vertices.
    pub(super) fn polygon(&mut self, vertices: &[u32]) -> Result<(), String> {
        let kind = match vertices.len() {
            0..=2 => return Err(format!("a face of {} vertices", vertices.len())),
            3 => CellType::Triangle,
            4 => CellType::Quad,
            _ => CellType::Polygon,
        };
        self.add(kind, vertices.iter().copied());
        Ok(())
    }

    /// Adds a polyhedron of `faces` that may look either way; they are turned to look outward.
    pub(super) fn unturned_polyhedron(&mut self, mut faces: Vec<Vec<u32>>) -> Result<(), String> {
        turn_outward(&mut faces, &self.positions);
        self.polyhedron(&faces)
    }

    /// Adds a polyhedron of `faces`, each a loop of vertices, counter-clockwise as seen from outside.
    pub(super) fn polyhedron(&mut self, faces: &[Vec<u32>]) -> Result<(), String> {
        if faces.len() < 4 {
            return Err(format!("a polyhedron of {} faces", faces.len()));
        }
        if let Some(face) = faces.iter().find(|face| face.len() < 3) {
            return Err(format!(
                "a polyhedron with a face of {} vertices",
                face.len()
            ));
        }
        let mut vertices: Vec<u32> = faces.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let cells = &mut self.volumes;
        // Cells added before the first polyhedron have empty streams.
        cells.face_offsets.resize(cells.types.len() + 1, 0);
        cells.faces.push(index(faces.len())?);
        for face in faces {
            cells.faces.push(index(face.len())?);
            cells.faces.extend_from_slice(face);
        }
        self.add(CellType::Polyhedron, vertices.into_iter());
        Ok(())
    }

    fn add(&mut self, kind: CellType, vertices: impl Iterator<Item = u32>) {
        let cells = if dimension(kind) == 3 {
            &mut self.volumes
        } else {
            &mut self.faces
        };
        if cells.offsets.is_empty() {
            cells.offsets.push(0);
        }
        cells.types.push(kind as u8);
        cells.connectivity.extend(vertices);
        cells.offsets.push(saturated(cells.connectivity.len()));
        if !cells.face_offsets.is_empty() {
            cells.face_offsets.push(saturated(cells.faces.len()));
        }
    }

    /// The grid of the highest dimension that was found, and what there is to say about it.
    pub(super) fn finish(mut self) -> Parsed<(Grid, Vec<String>)> {
        let (cells, left_out) = match (self.volumes.types.len(), self.faces.types.len()) {
            (0, 0) => {
                return Err(Flaw::whole(format!(
                    "no faces or volumes: {} vertices and {} edges or points only",
                    self.positions.len(),
                    self.lesser
                )));
            }
            (0, _) => (self.faces, self.lesser),
            (_, faces) => (self.volumes, self.lesser + faces),
        };
        let longest = cells.connectivity.len().max(cells.faces.len());
        if u32::try_from(longest.max(self.positions.len())).is_err() {
            return Err(Flaw::whole("more than 2^32 vertices or corners of cells"));
        }
        if left_out > 0 {
            self.warnings.push(format!(
                "left out {left_out} faces, edges or points: only the {} cells of the highest dimension are kept",
                cells.types.len()
            ));
        }
        let mut grid = Grid {
            positions: self.positions,
            cells,
        };
        if self.curved > 0 {
            let dropped = drop_unused(&mut grid, &self.midside);
            self.warnings.push(format!(
                "{} cells are of higher order: only their corners are kept, {dropped} vertices between them are left out",
                self.curved
            ));
        }
        Ok((grid, self.warnings))
    }
}

/// Removes those `candidates` that no cell uses; returns how many.
fn drop_unused(grid: &mut Grid, candidates: &[u32]) -> usize {
    let mut keep = vec![true; grid.positions.len()];
    for &vertex in candidates {
        keep[vertex as usize] = false;
    }
    for &vertex in &grid.cells.connectivity {
        keep[vertex as usize] = true;
    }
    let mut next = 0;
    let renumbered: Vec<u32> = keep
        .iter()
        .map(|&kept| {
            let here = next;
            next += u32::from(kept);
            here
        })
        .collect();
    let before = grid.positions.len();
    let mut kept = keep.iter();
    grid.positions
        .retain(|_| *kept.next().expect("one flag per vertex"));
    let cells = &mut grid.cells;
    for vertex in &mut cells.connectivity {
        *vertex = renumbered[*vertex as usize];
    }
    let mut at = 0;
    while at < cells.faces.len() {
        // One polyhedron: a count of faces, then each face's count and vertices.
        let faces = cells.faces[at];
        at += 1;
        for _ in 0..faces {
            let end = at + 1 + cells.faces[at] as usize;
            for vertex in &mut cells.faces[at + 1..end] {
                *vertex = renumbered[*vertex as usize];
            }
            at = end;
        }
    }
    before - grid.positions.len()
}

/// Corners of the kinds that have a fixed number.
pub(super) fn corners(kind: CellType) -> usize {
    match kind {
        CellType::Triangle => 3,
        CellType::Quad | CellType::Tetrahedron => 4,
        CellType::Pyramid => 5,
        CellType::Wedge => 6,
        CellType::Hexahedron => 8,
        CellType::PentagonalPrism => 10,
        CellType::HexagonalPrism => 12,
        CellType::Empty => 0,
        CellType::Polygon | CellType::Polyhedron => {
            unreachable!("a polygon or polyhedron has a method of its own")
        }
    }
}

fn dimension(kind: CellType) -> usize {
    match kind {
        CellType::Empty => 0,
        CellType::Triangle | CellType::Polygon | CellType::Quad => 2,
        CellType::Tetrahedron
        | CellType::Hexahedron
        | CellType::Wedge
        | CellType::Pyramid
        | CellType::PentagonalPrism
        | CellType::HexagonalPrism
        | CellType::Polyhedron => 3,
    }
}

/// `length` as an index.
pub(super) fn index(length: usize) -> Result<u32, String> {
    u32::try_from(length).map_err(|_| format!("{length} is more than 2^32"))
}

/// A length as an offset; what does not fit is refused in [`Assembly::finish`].
fn saturated(length: usize) -> u32 {
    u32::try_from(length).unwrap_or(u32::MAX)
}
