//! A vertex into an edge, an edge into a face, a face into a volume.

use crate::error::EditError;
use crate::map::{EDGE, SIDE, VERTEX};
use crate::{AnyCell, Cell, Dart, Edge, Edit, Face, Map, Vertex, Volume};

/// A volume that was split by a new face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeSplit {
    /// The face between the parts.
    pub face: Cell<Face>,
    /// The part that keeps the volume's name.
    pub kept: Cell<Volume>,
    /// The other part.
    pub new: Cell<Volume>,
}

impl Map {
    /// The darts of the edge of `first`, in order around it: from `first` on by β2, β3, β2, …, and where that ends before
    /// it returns, from `first` by β3, β2, …. Returns where these second ones start, if anywhere.
    fn darts_around(&self, first: Dart, darts: &mut Vec<Dart>) -> Option<usize> {
        darts.clear();
        darts.push(first);
        let (mut at, mut beta) = (first, 1);
        while let Some(next) = self.beta[beta][at.index()] {
            if next == first {
                return None;
            }
            darts.push(next);
            (at, beta) = (next, 3 - beta);
        }
        let second = darts.len();
        (at, beta) = (first, 2);
        while let Some(next) = self.beta[beta][at.index()] {
            darts.push(next);
            (at, beta) = (next, 3 - beta);
        }
        Some(second)
    }
}

impl Edit<'_> {
    /// Splits an edge by a new vertex. The half with the start of [`Map::dart`] keeps the edge's name.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`].
    pub fn split_edge(&mut self, edge: Cell<Edge>) -> Result<Cell<Vertex>, EditError> {
        self.settle_pending()?;
        let first = self.alive(edge)?;
        let mut darts = std::mem::take(&mut self.scratch);
        let second = self.map.darts_around(first, &mut darts);
        let done = self.room(darts.len());
        let done = done.map(|()| self.split_edge_of(edge, &darts, second));
        self.scratch = darts;
        done
    }

    /// `darts` and `second` are those of [`Map::darts_around`].
    fn split_edge_of(
        &mut self,
        edge: Cell<Edge>,
        darts: &[Dart],
        second: Option<usize>,
    ) -> Cell<Vertex> {
        let ends = self.map.ends(edge);
        let is_closed = second.is_none();
        let second = second.unwrap_or(darts.len());
        // Directions alternate, from `first` on and from its opposite.
        let is_forward = |at: usize| match at.checked_sub(second) {
            None => at.is_multiple_of(2),
            Some(at) => !at.is_multiple_of(2),
        };
        // Of each dart, what was there stays the half at the edge's start, so that these stay linked as they are.
        let mut halves = std::mem::take(&mut self.queue);
        halves.clear();
        for (at, &dart) in darts.iter().enumerate() {
            // Found only now: a face may have the edge twice, once after the other.
            let before = if is_forward(at) {
                dart
            } else {
                self.map.beta0(dart)
            };
            halves.push(self.insert_after(before));
        }
        let vertex = self.bear_vertex(Some(AnyCell::Edge(edge)), &ends, halves[0]);
        let far = self.bear(1, Some(AnyCell::Edge(edge)), halves[0]);
        for (at, (&dart, &half)) in darts.iter().zip(&halves).enumerate() {
            let side = self.map.label[SIDE][dart.index()];
            self.map.set_label(SIDE, half, side);
            self.map.set_label(EDGE, half, far);
            if is_forward(at) {
                self.map.set_label(VERTEX, half, vertex.label());
            } else {
                self.map.set_label(VERTEX, half, ends[1].label());
                self.map.set_label(VERTEX, dart, vertex.label());
                if self.map.dart(ends[1]) == dart {
                    self.map.set_cell_dart(0, ends[1].label(), Some(half));
                }
            }
        }
        for at in 1..second {
            self.pair(2 + (at - 1) % 2, halves[at - 1], halves[at]);
        }
        if is_closed {
            self.pair(3, halves[second - 1], halves[0]);
        }
        for at in second..darts.len() {
            let before = if at == second { 0 } else { at - 1 };
            self.pair(3 - (at - second) % 2, halves[before], halves[at]);
        }
        self.queue = halves;
        vertex
    }

    /// A new dart right after `dart` in its ring.
    pub(crate) fn insert_after(&mut self, dart: Dart) -> Dart {
        let new = self.map.new_dart();
        self.map.set_beta(1, new, self.map.beta[0][dart.index()]);
        self.map.set_beta(1, dart, Some(new));
        new
    }

    /// Splits a face by a new edge, from the vertex that `from` leaves to the one that `to` leaves; both are darts of the
    /// same side of the face. The part with `from` in it keeps the face's name.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Full`], [`EditError::OpenFace`]; [`EditError::NotAChord`] if the darts are of
    /// different rings, or neighbours.
    pub fn split_face(&mut self, from: Dart, to: Dart) -> Result<Cell<Edge>, EditError> {
        self.settle_pending()?;
        self.known(from)?;
        self.known(to)?;
        self.room(4)?;
        let (before_from, before_to) = (self.map.beta0(from), self.map.beta0(to));
        let refuse = |reason| Err(EditError::NotAChord { from, to, reason });
        if from == to || before_from == to || before_to == from {
            return refuse("they leave the same vertex, or are neighbours");
        }
        if !self.map.ring(from).any(|dart| dart == to) {
            return refuse("they are not in the same ring");
        }
        let side = self.map.label[SIDE][from.index()];
        let [start, end] = [from, to].map(|dart| self.map.vertex(dart).label());
        let beyond = [before_from, from, before_to, to].map(|dart| self.map.beta3(dart));
        let back = self.insert_after(before_to);
        let there = self.insert_after(before_from);
        self.map.set_beta(1, back, Some(from));
        self.map.set_beta(1, there, Some(to));
        self.pair(2, back, there);

        let parent = AnyCell::of(2, side / 2);
        let edge = self.bear(1, Some(parent), there);
        let face = self.bear(2, Some(parent), there);
        self.map.set_cell_dart(2, side / 2, Some(from));
        let mut darts = vec![(back, end, side), (there, start, 2 * face)];
        for (new, old) in [(2 * face, side), (2 * face + 1, side ^ 1)] {
            self.map
                .set_side_volume(new, self.map.side_volume[old as usize]);
        }
        self.label_between(to, there, 2 * face);
        if let [
            Some(after_start),
            Some(into_start),
            Some(after_end),
            Some(into_end),
        ] = beyond
        {
            // The other side, whose ring runs against this one.
            let with_from = self.insert_after(into_start);
            let with_to = self.insert_after(into_end);
            self.map.set_beta(1, with_from, Some(after_end));
            self.map.set_beta(1, with_to, Some(after_start));
            self.pair(2, with_from, with_to);
            self.pair(3, with_from, back);
            self.pair(3, with_to, there);
            darts.extend([(with_from, start, side ^ 1), (with_to, end, 2 * face + 1)]);
            self.label_between(after_start, with_to, 2 * face + 1);
        }
        for (dart, vertex, side) in darts {
            self.map.set_label(VERTEX, dart, vertex);
            self.map.set_label(EDGE, dart, edge);
            self.map.set_label(SIDE, dart, side);
        }
        Ok(Cell::new(edge))
    }

    /// Labels the darts from `first` up to `end`, which is left out.
    fn label_between(&mut self, first: Dart, end: Dart, side: u32) {
        let mut at = first;
        while at != end {
            self.map.set_label(SIDE, at, side);
            at = self.map.beta1(at);
        }
    }

    /// Splits a volume by a new face along a closed path of its edges: each dart of `path` runs to the vertex that the
    /// next one leaves, and no vertex comes twice. The part with these darts in it keeps the volume's name.
    ///
    /// # Errors
    /// [`EditError::NoDart`], [`EditError::Full`], [`EditError::OpenFace`], [`EditError::OpenVolume`], [`EditError::Surface`];
    /// [`EditError::NotARing`] if the path is no such path, or does not part the volume (around the hole of a ring).
    pub fn split_volume(&mut self, path: &[Dart]) -> Result<VolumeSplit, EditError> {
        self.settle_whole()?;
        self.check_path(path)?;
        self.room(2 * path.len())?;
        self.attempt(|edit| edit.span(path))
    }

    fn check_path(&self, path: &[Dart]) -> Result<(), EditError> {
        for &dart in path {
            self.known(dart)?;
            if self.map.dimension == crate::Dimension::Two {
                return Err(EditError::Surface { dart });
            }
        }
        let [first, .., last] = *path else {
            return Err(EditError::NoPath);
        };
        let refuse = |dart, reason| Err(EditError::NotARing { dart, reason });
        let mut before = last;
        for &dart in path {
            // Around the vertex, within the volume, from `dart` to the way back.
            let arrival = self.map.beta2(before);
            let mut at = dart;
            while Some(at) != arrival {
                match self.map.beta2(at).map(|across| self.map.beta1(across)) {
                    Some(next) if next != dart => at = next,
                    _ => return refuse(dart, "the path does not arrive, or in another volume"),
                }
            }
            before = dart;
        }
        let mut vertices: Vec<_> = path.iter().map(|&dart| self.map.vertex(dart)).collect();
        vertices.sort_unstable();
        if vertices.windows(2).any(|pair| pair[0] == pair[1]) {
            return refuse(first, "the path passes a vertex twice");
        }
        if path.len() < 3 {
            return refuse(first, "the path has fewer than three edges");
        }
        Ok(())
    }

    fn span(&mut self, path: &[Dart]) -> Result<VolumeSplit, EditError> {
        let volume = self.map.volume(path[0]);
        let near: Vec<_> = path.iter().map(|_| self.map.new_dart()).collect();
        let far: Vec<_> = path.iter().map(|_| self.map.new_dart()).collect();
        let face = self.bear(2, Some(AnyCell::Volume(volume)), near[0]);
        for (at, &dart) in path.iter().enumerate() {
            let next = if at + 1 == path.len() { 0 } else { at + 1 };
            let across = self.map.beta2(dart).expect("checked with the path");
            let [from, to] = [dart, path[next]].map(|dart| self.map.vertex(dart).label());
            let edge = self.map.edge(dart).label();
            // The near side runs against the path, the far side along it.
            self.map.set_beta(1, near[next], Some(near[at]));
            self.map.set_beta(1, far[at], Some(far[next]));
            self.pair(2, near[at], dart);
            self.pair(2, far[at], across);
            self.pair(3, near[at], far[at]);
            for (dart, vertex, side) in [(near[at], to, 2 * face), (far[at], from, 2 * face + 1)] {
                self.map.set_label(VERTEX, dart, vertex);
                self.map.set_label(EDGE, dart, edge);
                self.map.set_label(SIDE, dart, side);
            }
        }
        let mut walk = std::mem::take(&mut self.map.walk);
        let is_whole = walk.reaches(self.map, 3, far[0], near[0]);
        if !is_whole {
            let new = self.bear(3, Some(AnyCell::Volume(volume)), far[0]);
            self.own_sides(walk.darts(), Cell::new(new));
            self.map.set_side_volume(2 * face, volume.label());
            self.map.set_cell_dart(3, volume.label(), Some(near[0]));
        }
        self.map.walk = walk;
        if is_whole {
            let (dart, reason) = (path[0], "the path does not part the volume");
            return Err(EditError::NotARing { dart, reason });
        }
        Ok(VolumeSplit {
            face: Cell::new(face),
            kept: volume,
            new: self.map.volume(far[0]),
        })
    }

    /// [`Edit::split_volume`] along a ring of vertices, of which each two that follow are joined by an edge.
    ///
    /// # Errors
    /// As [`Edit::split_volume`]; [`EditError::NoCell`], [`EditError::NoEdge`].
    pub fn split_volume_along(
        &mut self,
        volume: Cell<Volume>,
        ring: &[Cell<Vertex>],
    ) -> Result<VolumeSplit, EditError> {
        self.settle_whole()?;
        let first = self.alive(volume)?;
        let mut walk = std::mem::take(&mut self.map.walk);
        walk.collect(self.map, 3, first);
        let ends = ring.iter().zip(ring.iter().cycle().skip(1));
        let path: Result<Vec<_>, _> = ends
            .map(|(&from, &to)| {
                let mut darts = walk.darts().iter();
                let joins = |d: &&Dart| self.map.vertex(**d) == from && self.map.head(**d) == to;
                let no_edge = EditError::NoEdge { volume, from, to };
                darts.find(joins).copied().ok_or(no_edge)
            })
            .collect();
        self.map.walk = walk;
        self.split_volume(&path?)
    }

    /// [`Edit::split_face`] between two vertices of a face of a volume.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`]; [`EditError::NoEdge`] if no face of the volume
    /// has both vertices, other than as neighbours.
    pub fn split_face_of(
        &mut self,
        volume: Cell<Volume>,
        from: Cell<Vertex>,
        to: Cell<Vertex>,
    ) -> Result<Cell<Edge>, EditError> {
        self.settle_pending()?;
        let first = self.alive(volume)?;
        let mut walk = std::mem::take(&mut self.map.walk);
        let map = &*self.map;
        let chord = walk.collect(map, 3, first).iter().find_map(|&dart| {
            if map.vertex(dart) != from {
                return None;
            }
            let end = map.ring(dart).find(|&other| map.vertex(other) == to)?;
            let are_neighbours = map.beta1(dart) == end || map.beta1(end) == dart;
            (!are_neighbours).then_some((dart, end))
        });
        self.map.walk = walk;
        let (from, to) = chord.ok_or(EditError::NoEdge { volume, from, to })?;
        self.split_face(from, to)
    }
}
