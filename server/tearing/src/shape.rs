//! What volumes of a map are cells of a mesh.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sinew_mesh::{Cells, scaled_jacobian};
use sinew_topology::{AnyCell, Cell, Edge, Edit, Event, Face, Map, Vertex, Volume, Walk};

/// Scaled Jacobians below this are those of flat cells.
const FLAT: f64 = 1e-12;

/// Whether a volume has four faces and vertices or more, and its surface is a sphere that nowhere touches itself.
pub(crate) fn is_cell(map: &Map, volume: Cell<Volume>, walk: &mut Walk) -> bool {
    let vertices = map.incident::<Volume, Vertex>(volume, walk).count();
    let edges = map.incident::<Volume, Edge>(volume, walk).count();
    let faces = map.incident::<Volume, Face>(volume, walk).count();
    let darts = map.orbit(volume, walk).count();
    vertices >= 4 && faces >= 4 && vertices + faces == edges + 2 && darts == 2 * edges
}

/// Whether a volume is a cell of four vertices.
pub(crate) fn is_tetrahedron(map: &Map, volume: Cell<Volume>, walk: &mut Walk) -> bool {
    map.incident::<Volume, Vertex>(volume, walk).count() == 4 && is_cell(map, volume, walk)
}

/// Volumes that are neither flat nor inside out at rest, and are not to become so.
pub(crate) struct Upright {
    /// Ascending.
    volumes: Vec<Cell<Volume>>,
}

impl Upright {
    /// Those among some volumes.
    pub(crate) fn of(map: &Map, rest: &[Vector3<f64>], volumes: &[Cell<Volume>]) -> Self {
        let mut volumes = volumes.to_vec();
        volumes.sort_unstable();
        volumes.retain(|&volume| is_upright(map, volume, |vertex| rest[vertex as usize]));
        Self { volumes }
    }

    /// Those of which an edit made something flat or inside out, ascending. New vertices stand in the midst of those that
    /// the edit put them between.
    pub(crate) fn folded(&self, edit: &Edit<'_>, rest: &[Vector3<f64>]) -> Vec<Cell<Volume>> {
        let changes = edit.changes();
        let mut places: Vec<Vector3<f64>> = Vec::new();
        // Of each part, the volume that it was part of.
        let mut parts: BTreeMap<_, _> = self.volumes.iter().map(|&v| (v, v)).collect();
        for event in &changes.events {
            let Event::Born {
                cell,
                parent,
                among,
            } = event
            else {
                continue;
            };
            let at = |vertex: &Cell<Vertex>| place(rest, &places, vertex.index());
            match (cell, parent) {
                (AnyCell::Vertex(_), Some(AnyCell::Vertex(parent))) => places.push(at(parent)),
                (AnyCell::Vertex(_), _) => {
                    let among = &changes.among[among.start as usize..among.end as usize];
                    #[expect(clippy::cast_precision_loss, reason = "a vertex has few parents")]
                    let count = among.len().max(1) as f64;
                    places.push(among.iter().map(at).sum::<Vector3<f64>>() / count);
                }
                (AnyCell::Volume(part), Some(AnyCell::Volume(parent))) => {
                    let whole = parts.get(parent).copied();
                    parts.extend(whole.map(|whole| (*part, whole)));
                }
                (AnyCell::Volume(_) | AnyCell::Edge(_) | AnyCell::Face(_), _) => {}
            }
        }
        let map = edit.map();
        parts.retain(|&part, _| {
            let at = |vertex: u32| place(rest, &places, vertex as usize);
            map.try_dart(part).is_some() && !is_upright(map, part, at)
        });
        let mut folded: Vec<_> = parts.into_values().collect();
        folded.sort_unstable();
        folded.dedup();
        folded
    }
}

/// Where a vertex is at rest, which an edit may just have appended.
fn place(rest: &[Vector3<f64>], appended: &[Vector3<f64>], vertex: usize) -> Vector3<f64> {
    let new = vertex.checked_sub(rest.len());
    new.map_or_else(|| rest[vertex], |new| appended[new])
}

fn is_upright(map: &Map, volume: Cell<Volume>, at: impl Fn(u32) -> Vector3<f64>) -> bool {
    let found = map.export_volumes(&[volume]);
    let cells = Cells {
        types: found.types,
        connectivity: found.connectivity,
        offsets: found.offsets,
        faces: found.faces,
        face_offsets: found.face_offsets,
    };
    scaled_jacobian(&cells.cell(0), at) > FLAT
}
