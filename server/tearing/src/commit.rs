//! From edits of the map to one patch.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use sinew_mesh::Cells;
use sinew_topology::{AnyCell, Cell, Changes, Dart, Event, Vertex, Volume};

use crate::areas::{View, ranks_in};
use crate::body::number;
use crate::{Body, Done, Patch, Refusal, Seam, SeamKind};

/// What the requests of one batch did so far.
#[derive(Debug)]
pub(crate) struct Batch {
    vertex_parents: Vec<u32>,
    vertex_parent_offsets: Vec<u32>,
    cell_parents: Vec<u32>,
    dirty: BTreeSet<u32>,
    seams: Vec<Seam>,
    /// Vertices that were there before.
    bound: usize,
    /// The points of vertices that the binding knows otherwise or not, the strongest first.
    points: BTreeMap<u32, Vec<u32>>,
}

/// Where a vertex's points are known from.
enum Source<'a> {
    /// A row of the binding.
    Row(usize),
    /// Since this batch.
    Known(&'a [u32]),
}

/// What an edit did, as the operation that made it knows.
#[derive(Debug, Default)]
pub(crate) struct Made {
    /// A dart on each side of the faces that came apart.
    pub(crate) opened: Vec<[Dart; 2]>,
    /// A dart on each side of the faces that came together.
    pub(crate) closed: Vec<[Dart; 2]>,
    /// A dart of each face that lost its neighbour.
    pub(crate) bared: Vec<Dart>,
    /// Where some new vertices are at rest, ascending; others are in the midst of their parents.
    pub(crate) placed: Vec<(Cell<Vertex>, Vector3<f64>)>,
    /// Cells beside what changed, beyond those of the faces.
    pub(crate) cells: Vec<u32>,
}

impl Batch {
    pub(crate) fn new(body: &Body) -> Self {
        Self {
            vertex_parents: Vec::new(),
            vertex_parent_offsets: vec![0],
            cell_parents: Vec::new(),
            dirty: BTreeSet::new(),
            seams: Vec::new(),
            bound: body.rest.len(),
            points: BTreeMap::new(),
        }
    }

    /// How strong two points are at a vertex.
    pub(crate) fn ranks(&self, view: &View<'_>, vertex: u32, points: [u32; 2]) -> [Option<u32>; 2] {
        match self.source(vertex) {
            Source::Row(row) => ranks_in(view.binding, row, points),
            Source::Known(known) => points.map(|point| {
                let at = known.iter().position(|&known| known == point);
                at.map(number)
            }),
        }
    }

    /// The points that act on a vertex, the strongest first.
    pub(crate) fn points(&self, view: &View<'_>, vertex: u32) -> Vec<u32> {
        match self.source(vertex) {
            Source::Row(row) => {
                let mut points = view.binding.weights(row);
                points.retain(|(_, weight)| *weight != 0.0);
                points.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
                points.into_iter().map(|(point, _)| point).collect()
            }
            Source::Known(known) => known.to_vec(),
        }
    }

    /// The strongest point that acts on a vertex.
    pub(crate) fn strongest(&self, view: &View<'_>, vertex: u32) -> Option<u32> {
        match self.source(vertex) {
            Source::Row(row) => Some(view.binding.dominant()[row]),
            Source::Known(known) => known.first().copied(),
        }
    }

    /// Where the points of a vertex are known from: of one without a row, from its first parent.
    fn source(&self, vertex: u32) -> Source<'_> {
        let mut vertex = vertex;
        loop {
            if let Some(points) = self.points.get(&vertex) {
                return Source::Known(points);
            }
            match self.parents(vertex) {
                None => return Source::Row(vertex as usize),
                Some([]) => return Source::Known(&[]),
                Some([first, ..]) => vertex = *first,
            }
        }
    }

    /// What a vertex that this batch appended comes from; `None` for an older one.
    pub(crate) fn parents(&self, vertex: u32) -> Option<&[u32]> {
        let at = (vertex as usize).checked_sub(self.bound)?;
        let row = self.vertex_parent_offsets[at]..self.vertex_parent_offsets[at + 1];
        Some(&self.vertex_parents[row.start as usize..row.end as usize])
    }

    /// The vertex below `before` that a vertex was split from, perhaps itself; else one that was put between others.
    pub(crate) fn origin(&self, vertex: u32, before: usize) -> u32 {
        let mut vertex = vertex;
        while vertex as usize >= before
            && let Some([parent]) = self.parents(vertex)
        {
            vertex = *parent;
        }
        vertex
    }

    /// The vertex that was there before the batch and that a vertex comes from, itself or its first parent.
    pub(crate) fn known_by(&self, vertex: u32) -> u32 {
        let mut vertex = vertex;
        while let Some([first, ..]) = self.parents(vertex) {
            vertex = *first;
        }
        vertex
    }

    /// Takes note of the points that act on a vertex, the strongest first.
    pub(crate) fn know(&mut self, vertex: u32, points: Vec<u32>) {
        self.points.insert(vertex, points);
    }

    /// The patch of all that was done.
    pub(crate) fn finish(self, body: &mut Body) -> Option<Patch> {
        if self.dirty.is_empty() {
            return None;
        }
        let touched: Vec<_> = self.dirty.into_iter().collect();
        let (slots, cells) = body.changed(&touched);
        let from_version = body.version;
        body.version += 1;
        Some(Patch {
            from_version,
            vertex_parents: self.vertex_parents,
            vertex_parent_offsets: self.vertex_parent_offsets,
            slots,
            cells,
            cell_parents: self.cell_parents,
            seams: self.seams,
            hash: body.hash,
        })
    }
}

impl Body {
    /// Takes over what an edit changed.
    pub(crate) fn commit(&mut self, changes: &Changes, made: &Made, batch: &mut Batch) -> Done {
        let before = number(self.rest.len());
        for event in &changes.events {
            match event {
                Event::Born {
                    cell,
                    parent,
                    among,
                } => {
                    let among = &changes.among[among.start as usize..among.end as usize];
                    self.born(*cell, *parent, among, &made.placed, batch);
                }
                Event::Died { cell, .. } => self.died(*cell, batch),
            }
        }
        for volume in changes.touched::<Volume>(&self.map) {
            if self.map.try_dart(volume).is_some() {
                batch.dirty.insert(self.slot(volume));
            }
        }
        let touched = changes.touched::<Vertex>(&self.map);
        self.adjacency.refresh(&self.map, &touched);
        self.kept.touched.extend(touched);
        let mut cells = made.cells.clone();
        for (kind, pairs) in [
            (SeamKind::Opened, &made.opened),
            (SeamKind::Closed, &made.closed),
        ] {
            for darts in pairs {
                let seam = self.seam(kind, *darts);
                cells.extend(seam.cells);
                batch.seams.push(seam);
            }
        }
        cells.sort_unstable();
        cells.dedup();
        let mut effects = Vec::new();
        self.join_fragments(&made.closed, &mut effects);
        self.part_fragments(made, &mut effects);
        self.follow_fractures(made, &mut effects);
        Done {
            opened: number(made.opened.len()),
            closed: number(made.closed.len()),
            cells,
            vertices: before..number(self.rest.len()),
            effects,
        }
    }

    fn born(
        &mut self,
        cell: AnyCell,
        parent: Option<AnyCell>,
        among: &[Cell<Vertex>],
        placed: &[(Cell<Vertex>, Vector3<f64>)],
        batch: &mut Batch,
    ) {
        match cell {
            AnyCell::Vertex(vertex) => {
                debug_assert_eq!(vertex.index(), self.rest.len(), "slots are appended");
                let parents = match parent {
                    Some(AnyCell::Vertex(parent)) => &[parent][..],
                    _ => among,
                };
                let rest = parents.iter().map(|parent| self.rest[parent.index()]);
                #[expect(clippy::cast_precision_loss, reason = "a vertex has few parents")]
                let midst = || rest.sum::<Vector3<f64>>() / parents.len().max(1) as f64;
                let known = placed.binary_search_by_key(&vertex, |(placed, _)| *placed);
                self.rest
                    .push(known.map_or_else(|_| midst(), |at| placed[at].1));
                let slots = parents.iter().map(|parent| number(parent.index()));
                batch.vertex_parents.extend(slots);
                batch
                    .vertex_parent_offsets
                    .push(number(batch.vertex_parents.len()));
            }
            AnyCell::Volume(volume) => {
                let slot = number(self.volumes.len());
                let parent = match parent {
                    Some(AnyCell::Volume(parent)) => Some(self.slot(parent)),
                    _ => None,
                };
                self.volumes.push(Some(volume));
                self.slots.grow(volume.index() + 1, slot);
                self.slots.set(volume.index(), slot);
                self.fragments.born(slot, parent);
                batch.cell_parents.push(parent.unwrap_or(slot));
                batch.dirty.insert(slot);
            }
            AnyCell::Face(face) => self.fractures.born(face, parent),
            AnyCell::Edge(_) => {}
        }
    }

    fn died(&mut self, cell: AnyCell, batch: &mut Batch) {
        match cell {
            AnyCell::Volume(volume) => {
                let slot = self.slot(volume);
                self.volumes.set(slot as usize, None);
                self.fragments.died(slot);
                batch.dirty.insert(slot);
            }
            AnyCell::Face(face) => self.fractures.died(face),
            AnyCell::Vertex(_) | AnyCell::Edge(_) => {}
        }
    }

    /// Of these slots, those whose cell is another than before, and the cells; takes over their hashes.
    pub(crate) fn changed(&mut self, touched: &[u32]) -> (Vec<u32>, Cells) {
        self.hashes.grow(self.slot_count(), 0);
        let (mut slots, mut changed) = (Vec::new(), Cells::default());
        for (cell, &slot) in self.cells_in(touched).iter().zip(touched) {
            let (old, new) = (self.hashes[slot as usize], cell.hash(slot));
            if old != new {
                self.hash = self.hash.wrapping_sub(old).wrapping_add(new);
                self.hashes.set(slot as usize, new);
                slots.push(slot);
                changed.push(cell);
            }
        }
        (slots, changed)
    }

    fn seam(&self, kind: SeamKind, darts: [Dart; 2]) -> Seam {
        let ring = self.map.ring(darts[0]);
        Seam {
            kind,
            cells: darts.map(|dart| self.slot(self.map.volume(dart))),
            vertices: ring
                .map(|dart| number(self.map.vertex(dart).index()))
                .collect(),
        }
    }

    /// The cells in these slots, in VTK's form; of type 0 and without vertices where there is none.
    pub(crate) fn cells_in(&self, slots: &[u32]) -> Cells {
        let live: Vec<_> = slots.iter().filter_map(|&slot| self.volume(slot)).collect();
        let found = self.map.export_volumes(&live);
        let mut cells = Cells {
            types: Vec::with_capacity(slots.len()),
            connectivity: found.connectivity,
            offsets: Vec::with_capacity(slots.len() + 1),
            faces: found.faces,
            face_offsets: Vec::new(),
        };
        cells.offsets.push(0);
        let has_faces = !found.face_offsets.is_empty();
        cells.face_offsets.extend(has_faces.then_some(0));
        let mut at = 0;
        for &slot in slots {
            if self.volume(slot).is_some() {
                cells.types.push(found.types[at]);
                at += 1;
            } else {
                cells.types.push(0);
            }
            cells.offsets.push(found.offsets[at]);
            if has_faces {
                cells.face_offsets.push(found.face_offsets[at]);
            }
        }
        cells
    }

    /// A dart, on the first one's side, of every face that two cells share.
    pub(crate) fn shared(&mut self, cells: [u32; 2]) -> Result<Vec<Dart>, Refusal> {
        let [one, other] = [self.live(cells[0])?, self.live(cells[1])?];
        let map = &self.map;
        let mut darts: Vec<_> = map.orbit(one, &mut self.walk).collect();
        darts.retain(|&dart| {
            map.beta3(dart)
                .is_some_and(|beyond| map.volume(beyond) == other)
        });
        // One dart of each face.
        darts.sort_unstable_by_key(|&dart| (map.face(dart), dart));
        darts.dedup_by_key(|dart| map.face(*dart));
        if darts.is_empty() {
            return Err(Refusal::NoFacet { cells });
        }
        Ok(darts)
    }
}
