//! Whole volumes: added, taken away, and split from their centre.

use crate::error::EditError;
use crate::map::{EDGE, SIDE, VERTEX};
use crate::slots::NONE;
use crate::{AnyCell, Cell, Dart, Edit, Vertex, Volume};

/// A volume that was added.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Added {
    /// The volume.
    pub volume: Cell<Volume>,
    /// Its vertices, by the numbers that the rings used.
    pub vertices: Vec<Cell<Vertex>>,
    /// Of each ring, the dart that leaves its first corner.
    pub rings: Vec<Dart>,
}

impl Edit<'_> {
    /// Adds a volume that is sewn to nothing, with vertices of its own. `rings` are its faces, counter-clockwise as seen
    /// from outside, as vertices numbered from 0 within the volume.
    ///
    /// # Errors
    /// [`EditError::Full`], [`EditError::OpenFace`]; [`EditError::NotAVolume`] if the rings do not bound one volume.
    pub fn add_volume(&mut self, rings: &[&[usize]]) -> Result<Added, EditError> {
        self.settle_pending()?;
        let total = rings.iter().map(|ring| ring.len()).sum();
        self.room(total)?;
        let (uses, count) = matched_edges(rings)?;
        self.attempt(|edit| {
            let darts: Vec<_> = (0..total).map(|_| edit.map.new_dart()).collect();
            let (mut starts, mut start) = (Vec::new(), 0);
            for ring in rings {
                for at in 0..ring.len() {
                    let next = darts[start + (at + 1) % ring.len()];
                    edit.map.set_beta(1, darts[start + at], Some(next));
                }
                starts.push(darts[start]);
                start += ring.len();
            }
            for [one, other] in uses {
                edit.pair(2, darts[one], darts[other]);
            }
            edit.settle(&darts, &[]);
            edit.added(rings, &darts, starts, count)
        })
    }

    fn added(
        &self,
        rings: &[&[usize]],
        darts: &[Dart],
        starts: Vec<Dart>,
        count: usize,
    ) -> Result<Added, EditError> {
        let volume = self.map.volume(darts[0]);
        let mut vertices = vec![None; count];
        let mut at = darts.iter();
        for (face, ring) in rings.iter().enumerate() {
            for ((corner, &local), &dart) in ring.iter().enumerate().zip(at.by_ref()) {
                let reason = if self.map.volume(dart) != volume {
                    "they are several closed surfaces"
                } else if *vertices[local].get_or_insert(self.map.vertex(dart))
                    != self.map.vertex(dart)
                {
                    "a vertex joins parts that have no edge in common there"
                } else {
                    continue;
                };
                return Err(EditError::NotAVolume {
                    face,
                    corner,
                    reason,
                });
            }
        }
        Ok(Added {
            volume,
            vertices: vertices.into_iter().flatten().collect(),
            rings: starts,
        })
    }

    /// Takes a volume away. What its neighbours hold stays; what it held alone dies.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::OpenFace`].
    pub fn remove_volume(&mut self, volume: Cell<Volume>) -> Result<(), EditError> {
        self.settle_pending()?;
        let first = self.alive(volume)?;
        let mut walk = std::mem::take(&mut self.map.walk);
        let darts = walk.collect(self.map, 3, first).to_vec();
        self.map.walk = walk;
        for &dart in &darts {
            // The neighbour keeps the names.
            if let Some(beyond) = self.map.beta3(dart) {
                self.unsew3(beyond)?;
            }
        }
        // Volumes before faces, whose sides know them.
        for dimension in (0..4).rev() {
            let labels = darts.iter().map(|&dart| self.map.label_in(dimension, dart));
            let mut labels: Vec<_> = labels.collect();
            labels.sort_unstable();
            labels.dedup();
            for label in labels {
                self.bury(dimension, label, None);
            }
        }
        for &dart in &darts {
            self.map.free_dart(dart);
        }
        Ok(())
    }

    /// Splits a volume by a new vertex in its midst, joined to all of its own: one pyramid over each face. A tetrahedron
    /// becomes four. The pyramid over the face of [`Map::dart`](crate::Map::dart) keeps the volume's name.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`], [`EditError::OpenVolume`], [`EditError::Surface`].
    pub fn star(&mut self, volume: Cell<Volume>) -> Result<Cell<Vertex>, EditError> {
        self.settle_whole()?;
        let first = self.alive(volume)?;
        if self.map.dimension == crate::Dimension::Two {
            return Err(EditError::Surface { dart: first });
        }
        let mut walk = std::mem::take(&mut self.map.walk);
        let darts = walk.collect(self.map, 3, first).to_vec();
        self.map.walk = walk;
        self.room(3 * darts.len())?;
        let parent = Some(AnyCell::Volume(volume));
        let mut corners: Vec<_> = darts.iter().map(|&dart| self.map.vertex(dart)).collect();
        corners.sort_unstable();
        corners.dedup();
        let across: Vec<_> = darts.iter().map(|&dart| self.map.beta2(dart)).collect();

        // Over each dart a triangle: back along it, up from its vertex, down to its head.
        let triangles: Vec<_> = darts
            .iter()
            .map(|_| [(); 3].map(|()| self.map.new_dart()))
            .collect();
        let vertex = self.bear_vertex(parent, &corners, triangles[0][2]);
        for (&dart, &[base, up, down]) in darts.iter().zip(&triangles) {
            let [from, to] = [self.map.vertex(dart), self.map.head(dart)];
            let labels = [(base, to), (up, from), (down, vertex)];
            for (dart, vertex) in labels {
                self.map.set_label(VERTEX, dart, vertex.label());
            }
            self.map.set_label(EDGE, base, self.map.edge(dart).label());
            self.map.set_beta(1, base, Some(up));
            self.map.set_beta(1, up, Some(down));
            self.map.set_beta(1, down, Some(base));
            self.pair(2, base, dart);
        }
        for (&dart, &[_, up, _]) in darts.iter().zip(&triangles) {
            // The triangle over the dart before comes down where this one goes up.
            let before = self.map.beta0(dart);
            let base = self.map.beta2(before).expect("linked above");
            self.pair(2, up, self.map.beta0(base));
        }
        for (&across, &[base, up, down]) in across.iter().zip(&triangles) {
            let other = across.and_then(|across| self.map.beta2(across));
            let other = other.expect("the surfaces of volumes are closed");
            if self.map.beta3(base).is_none() {
                self.pair(3, base, other);
                self.pair(3, up, self.map.beta0(other));
                self.pair(3, down, self.map.beta1(other));
                let face = self.bear(2, parent, base);
                for (start, side) in [(base, 2 * face), (other, 2 * face + 1)] {
                    let ring = [start, self.map.beta1(start), self.map.beta0(start)];
                    for dart in ring {
                        self.map.set_label(SIDE, dart, side);
                    }
                }
            }
        }
        self.label_spokes(&triangles, parent);
        self.label_pyramids(&darts, volume);
        Ok(vertex)
    }

    /// The new edges, from the new vertex to each old one.
    fn label_spokes(&mut self, triangles: &[[Dart; 3]], parent: Option<AnyCell>) {
        for &[_, up, _] in triangles {
            if self.map.label[EDGE][up.index()] == NONE {
                let edge = self.bear(1, parent, up);
                let around: Vec<_> = self.map.around(up).collect();
                for dart in around {
                    self.map.set_label(EDGE, dart, edge);
                }
            }
        }
    }

    /// The pyramids over the faces that `darts` wind around; the first has the volume's name.
    fn label_pyramids(&mut self, darts: &[Dart], volume: Cell<Volume>) {
        let mut named = volume.label();
        self.map.set_cell_dart(3, named, Some(darts[0]));
        // A base whose volume is still the old one, and that is not the first, is yet to be named.
        let is_first: Vec<_> = self.map.ring(darts[0]).collect();
        let mut done = Vec::new();
        for &dart in darts {
            let side = self.map.label[SIDE][dart.index()];
            if done.contains(&side) {
                continue;
            }
            done.push(side);
            if !is_first.contains(&dart) {
                named = self.bear(3, Some(AnyCell::Volume(volume)), dart);
            }
            self.map.set_side_volume(side, named);
            let slopes: Vec<_> = self
                .map
                .ring(dart)
                .filter_map(|d| self.map.beta2(d))
                .collect();
            for slope in slopes {
                let side = self.map.label[SIDE][slope.index()];
                self.map.set_side_volume(side, named);
            }
        }
    }
}

/// Pairs of corners, counted through all rings, whose edges are the same in opposite directions; and how many vertices
/// there are.
fn matched_edges(rings: &[&[usize]]) -> Result<(Vec<[usize; 2]>, usize), EditError> {
    let refuse = |face, corner, reason| {
        Err(EditError::NotAVolume {
            face,
            corner,
            reason,
        })
    };
    let mut uses = Vec::new();
    let mut dart = 0;
    for (face, ring) in rings.iter().enumerate() {
        if ring.len() < 3 {
            return refuse(face, 0, "a face has fewer than three corners");
        }
        for (corner, &from) in ring.iter().enumerate() {
            let to = ring[(corner + 1) % ring.len()];
            if ring[..corner].contains(&from) {
                return refuse(face, corner, "a face has a corner twice");
            }
            uses.push(([from.min(to), from.max(to)], from > to, dart, face, corner));
            dart += 1;
        }
    }
    uses.sort_unstable();
    let mut pairs = Vec::new();
    for edge in uses.chunk_by(|a, b| a.0 == b.0) {
        match *edge {
            [(_, false, one, ..), (_, true, other, ..)] => pairs.push([one, other]),
            _ => {
                let (.., face, corner) = edge[0];
                return refuse(
                    face,
                    corner,
                    "an edge is not in two faces, once in each direction",
                );
            }
        }
    }
    let mut corners: Vec<_> = rings.iter().flat_map(|ring| ring.iter().copied()).collect();
    corners.sort_unstable();
    corners.dedup();
    let count = corners.len();
    match corners.last() {
        None => refuse(0, 0, "there are none"),
        Some(&last) if last + 1 != count => refuse(0, 0, "corners are not numbered from 0 on"),
        Some(_) => Ok((pairs, count)),
    }
}
