//! Cutting volumes along a surface that the caller knows as the sides that vertices lie on.

use crate::error::EditError;
use crate::map::SIDE;
use crate::{Cell, Dart, Dimension, Edge, Edit, Face, Map, Vertex, Volume};

/// Where a vertex lies of a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Place {
    /// Before the cut.
    Below,
    /// On the cut, which passes through it.
    On,
    /// Beyond the cut.
    Above,
}

/// What a cut made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    /// New vertices, in edges that were crossed. Their places are the caller's to choose, between those of the edge's
    /// ends: see [`crate::Event::Born`].
    pub vertices: Vec<Cell<Vertex>>,
    /// New edges, in faces that were crossed.
    pub edges: Vec<Cell<Edge>>,
    /// New faces, in volumes that were crossed. To open the cut, [`Edit::unsew3`] them.
    pub faces: Vec<Cell<Face>>,
    /// New volumes. Of each volume cut, a part below keeps the name.
    pub volumes: Vec<Cell<Volume>>,
}

impl Edit<'_> {
    /// Cuts volumes along a surface: between vertices through their edges, and through the vertices that lie on it. New
    /// vertices stand in the edges that have an end on either side. A face may be crossed once; a volume that is crossed in
    /// several rings falls in as many parts more. Neighbours are not cut, but gain the new vertices and edges.
    ///
    /// `place` is asked about the vertices of `volumes` only. In a 2-map, edges and faces are cut; to open the cut,
    /// [`Edit::unsew2`] the new edges.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`], [`EditError::OpenVolume`];
    /// [`EditError::FaceCrossings`] and [`EditError::NotARing`] for volumes that such a cut cannot part.
    pub fn cut(
        &mut self,
        volumes: &[Cell<Volume>],
        place: impl Fn(Cell<Vertex>) -> Place,
    ) -> Result<Cut, EditError> {
        self.settle_whole()?;
        self.attempt(|edit| edit.cut_all(volumes, &place))
    }

    fn cut_all(
        &mut self,
        volumes: &[Cell<Volume>],
        place: &dyn Fn(Cell<Vertex>) -> Place,
    ) -> Result<Cut, EditError> {
        let mut cut = Cut::default();
        let (mut edges, mut faces) = (Vec::new(), Vec::new());
        let mut walk = std::mem::take(&mut self.map.walk);
        let known = volumes.iter().try_for_each(|&volume| {
            let first = self.alive(volume)?;
            let map = &*self.map;
            for &dart in walk.collect(map, 3, first) {
                faces.push((map.face(dart), dart));
                // Once per edge of the volume.
                if map.beta2(dart).is_none_or(|across| dart < across) {
                    let ends = [map.vertex(dart), map.head(dart)].map(place);
                    if let [Place::Below, Place::Above] | [Place::Above, Place::Below] = ends {
                        edges.push(map.edge(dart));
                    }
                }
            }
            Ok(())
        });
        self.map.walk = walk;
        known?;
        edges.sort_unstable();
        edges.dedup();
        faces.sort_unstable();
        faces.dedup_by_key(|(face, _)| *face);
        for edge in edges {
            cut.vertices.push(self.split_edge(edge)?);
        }
        let mut new = cut.vertices.clone();
        new.sort_unstable();
        let place = |vertex: Cell<Vertex>| match new.binary_search(&vertex) {
            Ok(_) => Place::On,
            Err(_) => place(vertex),
        };
        for (face, dart) in faces {
            if let Some((from, to)) = self.crossing(face, dart, &place)? {
                cut.edges.push(self.split_face(from, to)?);
            }
        }
        if self.map.dimension == Dimension::Three {
            for &volume in volumes {
                self.part(volume, &place, &mut cut)?;
            }
        }
        Ok(cut)
    }

    /// The darts that leave the two vertices where a cut crosses the face of `first` from one side to the other.
    fn crossing(
        &self,
        face: Cell<Face>,
        first: Dart,
        place: &impl Fn(Cell<Vertex>) -> Place,
    ) -> Result<Option<(Dart, Dart)>, EditError> {
        let map = &*self.map;
        let strictly = |dart: &Dart| place(map.vertex(*dart)) != Place::On;
        let Some(start) = map.ring(first).find(strictly) else {
            return Ok(None);
        };
        // Of each change of sides, the first and the last dart on the cut.
        let (mut side, mut on) = (place(map.vertex(start)), None);
        let (mut crossings, mut ends, mut is_along) = (0, [first; 2], false);
        for dart in map.ring(start).skip(1).chain([start]) {
            match place(map.vertex(dart)) {
                Place::On => on = Some((on.map_or(dart, |(first, _)| first), dart)),
                here @ (Place::Below | Place::Above) => {
                    if let (true, Some((first, last))) = (here != side, on) {
                        ends[crossings % 2] = first;
                        crossings += 1;
                        is_along |= first != last;
                    }
                    (side, on) = (here, None);
                }
            }
        }
        match (crossings, ends) {
            (0, _) => Ok(None),
            (2, [from, to]) if !is_along => Ok(Some((from, to))),
            _ => Err(EditError::FaceCrossings { face, crossings }),
        }
    }

    /// Splits a volume, whose faces are all on one side, where those below meet the others.
    fn part(
        &mut self,
        volume: Cell<Volume>,
        place: &impl Fn(Cell<Vertex>) -> Place,
        cut: &mut Cut,
    ) -> Result<(), EditError> {
        let mut walk = std::mem::take(&mut self.map.walk);
        let darts = walk.collect(self.map, 3, self.map.dart(volume));
        let rings = borders(self.map, darts, place);
        self.map.walk = walk;
        for ring in rings {
            let split = self.split_volume(&ring)?;
            cut.faces.push(split.face);
            cut.volumes.push(split.new);
        }
        Ok(())
    }
}

/// The rings of darts of a volume, of faces below, beyond which faces are not below.
fn borders(map: &Map, darts: &[Dart], place: &impl Fn(Cell<Vertex>) -> Place) -> Vec<Vec<Dart>> {
    let is_below = |dart: Dart| {
        let mut ring = map.ring(dart);
        ring.any(|dart| place(map.vertex(dart)) == Place::Below)
    };
    let mut is_above = false;
    let mut border = Vec::new();
    for &dart in darts {
        match place(map.vertex(dart)) {
            Place::Below => {}
            Place::Above => is_above = true,
            // As faces are on one side, they change sides along edges that lie on the cut.
            Place::On => {
                let is_border = place(map.head(dart)) == Place::On
                    && is_below(dart)
                    && map.beta2(dart).is_some_and(|across| !is_below(across));
                border.extend(is_border.then_some(dart));
            }
        }
    }
    let mut rings = Vec::new();
    if !is_above {
        return rings;
    }
    border.sort_unstable();
    while let Some(&start) = border.first() {
        let mut ring = Vec::new();
        let mut at = start;
        loop {
            ring.push(at);
            border.retain(|&dart| dart != at);
            at = map.beta1(at);
            // Around the vertex, through the faces below, to where these end.
            while let Some(across) = map.beta2(at).filter(|&across| is_below(across)) {
                at = map.beta1(across);
            }
            if at == start {
                break;
            }
        }
        if is_any_above(map, &ring, place) {
            rings.push(ring);
        }
    }
    rings
}

/// Whether what lies beyond a ring of darts, of faces below, has a vertex above: faces wholly on the cut that only faces
/// below surround are nothing to be parted.
fn is_any_above(map: &Map, ring: &[Dart], place: &impl Fn(Cell<Vertex>) -> Place) -> bool {
    let mut faces: Vec<Dart> = Vec::new();
    let mut queue = ring.to_vec();
    while let Some(dart) = queue.pop() {
        let Some(across) = map.beta2(dart) else {
            continue;
        };
        let mut places = map.ring(across).map(|dart| place(map.vertex(dart)));
        match places.find(|&place| place != Place::On) {
            Some(Place::Above) => return true,
            Some(Place::Below | Place::On) => {}
            None => {
                let side = |dart: Dart| map.label[SIDE][dart.index()];
                if !faces.iter().any(|&face| side(face) == side(across)) {
                    faces.push(across);
                    queue.extend(map.ring(across));
                }
            }
        }
    }
    false
}
