//! What volumes of a map are cells of a mesh.

use sinew_topology::{Cell, Edge, Face, Map, Vertex, Volume, Walk};

/// Whether a volume has four faces and vertices or more, and its surface is a sphere that nowhere touches itself.
pub(crate) fn is_cell(map: &Map, volume: Cell<Volume>, walk: &mut Walk) -> bool {
    let vertices = map.incident::<Volume, Vertex>(volume, walk).count();
    let edges = map.incident::<Volume, Edge>(volume, walk).count();
    let faces = map.incident::<Volume, Face>(volume, walk).count();
    let darts = map.orbit(volume, walk).count();
    vertices >= 4 && faces >= 4 && vertices + faces == edges + 2 && darts == 2 * edges
}
