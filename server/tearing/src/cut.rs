//! Cutting cells along a frontier, so that all faces stay plane.

use nalgebra::Vector3;
use sinew_topology::{
    AnyCell, Cell, Dart, Edge, Edit, EditError, Face, Map, Place, Vertex, Volume, Walk,
};

use crate::areas::Sides;
use crate::shape::is_cell;

/// Deviations from a plane below this part of a face's extent are rounding.
const FLAT: f64 = 1e-12;

/// What cutting made.
#[derive(Debug, Default)]
pub(crate) struct Cuts {
    pub(crate) volumes: Vec<Cell<Volume>>,
    /// The new vertices, ascending, and where they are at rest.
    pub(crate) placed: Vec<(Cell<Vertex>, Vector3<f64>)>,
}

impl Cuts {
    /// Cuts a volume whose vertices all have sides where it crosses from one to the other. A new face that is not plane is parted in triangles: a
    /// cell with plane faces has one volume only, however its faces are cut later.
    ///
    /// # Errors
    /// What the map says where such a cut cannot part the volume; nothing is done then.
    pub(crate) fn cut(
        &mut self,
        edit: &mut Edit<'_>,
        volume: Cell<Volume>,
        sides: &Sides,
        rest: &[Vector3<f64>],
        walk: &mut Walk,
    ) -> Result<(), EditError> {
        let known = self.placed.len();
        let place = |vertex: Cell<Vertex>| sides.place(vertex.index()).unwrap_or(Place::On);
        let cut = edit.attempt(|edit| {
            let edges = edit.map().incident::<Volume, Edge>(volume, walk);
            let mut edges: Vec<_> = edges.collect();
            edges.sort_unstable();
            for edge in edges {
                let ends = edit.map().ends(edge);
                let [from, to] = ends.map(place);
                if from != to && from != Place::On && to != Place::On {
                    let at = sides.crossing(ends.map(|end| rest[end.index()]));
                    self.placed.push((edit.split_edge(edge)?, at));
                }
            }
            let cut = edit.cut(&[volume], place)?;
            for face in cut.faces {
                let position = |vertex| self.position(vertex, rest);
                if !is_plane(edit.map(), face, position) {
                    fan(edit, face)?;
                }
            }
            let mut parts = cut.volumes.iter().copied().chain([volume]);
            match parts.find(|&part| !is_cell(edit.map(), part, walk)) {
                Some(part) => Err(EditError::WrongShape {
                    cell: AnyCell::Volume(part),
                    needed: "cell of a mesh",
                }),
                None => Ok(cut.volumes),
            }
        });
        match cut {
            Ok(volumes) => {
                self.volumes.extend(volumes);
                Ok(())
            }
            Err(refusal) => {
                self.placed.truncate(known);
                Err(refusal)
            }
        }
    }

    fn position(&self, vertex: Cell<Vertex>, rest: &[Vector3<f64>]) -> Vector3<f64> {
        match self.placed.binary_search_by_key(&vertex, |new| new.0) {
            Ok(at) => self.placed[at].1,
            Err(_) => rest[vertex.index()],
        }
    }
}

fn is_plane(map: &Map, face: Cell<Face>, position: impl Fn(Cell<Vertex>) -> Vector3<f64>) -> bool {
    let ring = map.ring(map.dart(face));
    let corners: Vec<_> = ring.map(|dart| position(map.vertex(dart))).collect();
    let from_first = |corner: &Vector3<f64>| corner - corners[0];
    let pairs = corners[1..].windows(2);
    let area: Vector3<f64> = pairs
        .map(|pair| from_first(&pair[0]).cross(&from_first(&pair[1])))
        .sum();
    let extent = corners.iter().map(|corner| from_first(corner).norm());
    let bound = FLAT * extent.fold(0.0, f64::max) * area.norm();
    let mut heights = corners.iter().map(|corner| from_first(corner).dot(&area));
    heights.all(|height| height.abs() <= bound)
}

/// Parts a face in triangles around its first corner.
fn fan(edit: &mut Edit<'_>, face: Cell<Face>) -> Result<(), EditError> {
    let mut dart = edit.map().dart(face);
    for _ in 3..edit.map().ring(dart).count() {
        let map = edit.map();
        let to = map.beta1(map.beta1(dart));
        edit.split_face(dart, to)?;
        dart = rest_of(edit.map(), dart);
    }
    Ok(())
}

/// After a triangle was cut off a face, the dart of the rest that leaves the triangle's first corner.
fn rest_of(map: &Map, first: Dart) -> Dart {
    let back = map.beta0(first);
    map.beta2(back).expect("the new edge has two sides")
}
