//! From maps back to meshes.

use crate::cell_pattern::Pattern;
use crate::input::{MeshCells, POLYHEDRON};
use crate::orbit::Walk;
use crate::{AnyCell, Cell, Dart, Dimension, Face, Map, Vertex, Volume};

/// The cells of a map in VTK's form; see [`MeshCells`] for the columns. Vertices are the map's slots, of which some may
/// be in no cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// VTK's type of each cell.
    pub types: Vec<u8>,
    /// The vertices of all cells.
    pub connectivity: Vec<u32>,
    /// Where each cell starts in `connectivity`.
    pub offsets: Vec<u32>,
    /// Face streams of the polyhedra.
    pub faces: Vec<u32>,
    /// Where each cell's stream starts in `faces`; empty without polyhedra.
    pub face_offsets: Vec<u32>,
    /// How many slots for vertices there are.
    pub vertices: usize,
    /// Which cell of the map each is: a volume, or a face of a 2-map.
    pub cells: Vec<AnyCell>,
}

impl Exported {
    /// The columns, to be built from.
    pub fn view(&self) -> MeshCells<'_> {
        MeshCells {
            vertices: self.vertices,
            types: &self.types,
            connectivity: &self.connectivity,
            offsets: &self.offsets,
            faces: &self.faces,
            face_offsets: &self.face_offsets,
        }
    }

    fn close_cell(&mut self, kind: u8, cell: AnyCell) {
        let end = |length: usize| u32::try_from(length).expect("no more entries than darts");
        self.types.push(kind);
        self.offsets.push(end(self.connectivity.len()));
        self.face_offsets.push(end(self.faces.len()));
        self.cells.push(cell);
    }
}

impl Map {
    /// All volumes (of a 2-map, faces) as a mesh, by ascending slot. A volume of the shape of a tetrahedron, hexahedron,
    /// wedge, pyramid or prism becomes that, any other a polyhedron. A map that was just built gives back its mesh, but for
    /// polyhedra that have such a shape, and cells that were turned.
    pub fn export(&self) -> Exported {
        let mut out = self.blank_export();
        let mut walk = Walk::default();
        match self.dimension {
            Dimension::Three => {
                for volume in self.cells::<Volume>() {
                    self.export_volume(volume, &mut walk, &mut out);
                }
            }
            Dimension::Two => {
                for face in self.cells::<Face>() {
                    self.export_face(face, &mut out);
                }
            }
        }
        if out.faces.is_empty() {
            out.face_offsets.clear();
        }
        out
    }

    /// Some volumes, as [`Map::export`] would give them.
    ///
    /// # Panics
    /// If a volume is dead.
    pub fn export_volumes(&self, volumes: &[Cell<Volume>]) -> Exported {
        let mut out = self.blank_export();
        let mut walk = Walk::default();
        for &volume in volumes {
            self.export_volume(volume, &mut walk, &mut out);
        }
        if out.faces.is_empty() {
            out.face_offsets.clear();
        }
        out
    }

    fn blank_export(&self) -> Exported {
        Exported {
            offsets: vec![0],
            face_offsets: vec![0],
            vertices: self.slot_count::<Vertex>(),
            ..Exported::default()
        }
    }

    fn export_face(&self, face: Cell<Face>, out: &mut Exported) {
        let start = out.connectivity.len();
        let ring = self.ring(self.dart(face));
        out.connectivity
            .extend(ring.map(|dart| self.vertex(dart).label()));
        let kind = match out.connectivity.len() - start {
            3 => 5,
            4 => 9,
            _ => 7,
        };
        out.close_cell(kind, AnyCell::Face(face));
    }

    fn export_volume(&self, volume: Cell<Volume>, walk: &mut Walk, out: &mut Exported) {
        let darts = walk.collect(self, 3, self.dart(volume));
        // By the number of darts, what it may be.
        let kind = match darts.len() {
            12 => 10,
            16 => 14,
            18 => 13,
            24 => 12,
            30 => 15,
            36 => 16,
            _ => POLYHEDRON,
        };
        if kind != POLYHEDRON {
            let pattern = Pattern::new(kind, false);
            if let Some(corners) = darts.iter().find_map(|&dart| self.corners(&pattern, dart)) {
                out.connectivity.extend(corners);
                return out.close_cell(kind, AnyCell::Volume(volume));
            }
        }
        let mut vertices: Vec<_> = darts
            .iter()
            .map(|&dart| self.vertex(dart).label())
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        out.connectivity.extend(vertices);
        let entry = |length: usize| u32::try_from(length).expect("no more entries than darts");
        let count = out.faces.len();
        out.faces.push(0);
        let mut rings = Vec::new();
        for &dart in darts {
            let side = self.label[crate::map::SIDE][dart.index()];
            rings.push((side, dart));
        }
        rings.sort_unstable();
        rings.dedup_by_key(|(side, _)| *side);
        // In the order in which the mesh had them.
        rings.sort_unstable_by_key(|&(_, dart)| dart);
        out.faces[count] = entry(rings.len());
        for (_, dart) in rings {
            let start = out.faces.len();
            out.faces.push(0);
            out.faces
                .extend(self.ring(dart).map(|dart| self.vertex(dart).label()));
            out.faces[start] = entry(out.faces.len() - start - 1);
        }
        out.close_cell(POLYHEDRON, AnyCell::Volume(volume));
    }

    /// The vertices of a volume in the order of the pattern, if it has that shape as seen from `dart`.
    fn corners(&self, pattern: &Pattern, dart: Dart) -> Option<Vec<u32>> {
        let count = pattern.origin.len();
        let mut found: Vec<Option<Dart>> = vec![None; count];
        let mut corners = vec![None; pattern.first_of_corner.len()];
        found[0] = Some(dart);
        let mut queue = vec![0];
        while let Some(at) = queue.pop() {
            let here = found[at]?;
            let vertex = self.vertex(here).label();
            if *corners[pattern.origin[at] as usize].get_or_insert(vertex) != vertex {
                return None;
            }
            for (to, dart) in [
                (pattern.next[at], Some(self.beta1(here))),
                (pattern.across[at], self.beta2(here)),
            ] {
                let to = to as usize;
                match found[to] {
                    None => {
                        found[to] = dart;
                        queue.push(to);
                    }
                    known if known != dart => return None,
                    Some(_) => {}
                }
            }
        }
        corners.into_iter().collect()
    }
}
