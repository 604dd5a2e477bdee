//! An edge drawn together to a point.

use crate::error::EditError;
use crate::map::{SIDE, VERTEX};
use crate::orbit::Walk;
use crate::{AnyCell, Cell, Dart, Edge, Edit, Map, Vertex, Volume};

impl Edit<'_> {
    /// Draws an edge together to one of its vertices, `kept`; the other vertex dies into it. Triangles at the edge become
    /// edges, and volumes that would enclose nothing any more (tetrahedra at the edge) become faces.
    ///
    /// Refused where that would change what the mesh is: where cells would become doubled, or touch themselves, or where
    /// the neighbourhood of a vertex would be no ball, or no half-ball on the boundary.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::OpenFace`], [`EditError::OpenVolume`], [`EditError::NotCollapsible`].
    pub fn collapse(&mut self, edge: Cell<Edge>, kept: Cell<Vertex>) -> Result<(), EditError> {
        self.settle_whole()?;
        self.alive(edge)?;
        let mut ends = self.map.ends(edge);
        if ends[0] != kept {
            ends.reverse();
        }
        if ends[0] != kept {
            let (at, reason) = (AnyCell::Vertex(kept), "it is at neither end");
            return Err(EditError::NotCollapsible { edge, at, reason });
        }
        self.attempt(|edit| {
            let near = edit.draw_together(edge, ends)?;
            let mut walk = std::mem::take(&mut edit.map.walk);
            let spoilt = spoilt(edit.map, kept, near, &mut walk);
            edit.map.walk = walk;
            match spoilt {
                None => Ok(()),
                Some((at, reason)) => Err(EditError::NotCollapsible { edge, at, reason }),
            }
        })
    }

    /// Draws the second of an edge's ends to the first. Returns the vertices whose surroundings changed.
    fn draw_together(
        &mut self,
        edge: Cell<Edge>,
        ends: [Cell<Vertex>; 2],
    ) -> Result<Vec<Cell<Vertex>>, EditError> {
        let first = self.map.dart(edge);
        let refuse = |at, reason| EditError::NotCollapsible { edge, at, reason };
        if ends[0] == ends[1] {
            return Err(refuse(
                AnyCell::Vertex(ends[0]),
                "both its ends are the same",
            ));
        }
        let edge_darts: Vec<_> = self.map.around(first).collect();
        // Whatever may change is in a volume at either end.
        let mut darts = self.stars(ends);
        // What becomes of the ends: the darts of the first stand before those of the second.
        darts.sort_by_key(|&dart| self.map.vertex(dart) == ends[1]);
        let mut orphans = Vec::new();
        let mut gone: Vec<Dart> = Vec::new();
        for &dart in &edge_darts {
            let (before, after) = (self.map.beta0(dart), self.map.beta1(dart));
            if before == after {
                return Err(refuse(
                    AnyCell::Face(self.map.face(dart)),
                    "it has two edges only",
                ));
            }
            self.map.set_beta(1, before, Some(after));
            gone.push(dart);
        }
        let flat: Vec<_> = edge_darts
            .iter()
            .map(|&dart| self.map.beta1(dart))
            .collect();
        self.drop_slivers(&flat, &mut gone);
        self.drop_pillows(&flat, &mut gone).map_err(|volume| {
            let reason = "it would leave a face with nothing on either side";
            refuse(AnyCell::Volume(volume), reason)
        })?;
        for &dart in &gone {
            orphans.extend((0..4).map(|dimension| (dimension, self.map.label_in(dimension, dart))));
        }
        gone.sort_unstable();
        darts.retain(|dart| gone.binary_search(dart).is_err());
        for &dart in &gone {
            self.map.free_dart(dart);
        }
        if darts.is_empty() {
            return Err(refuse(
                AnyCell::Edge(edge),
                "nothing would be left of its component",
            ));
        }
        // Where nothing of the first vertex is left, the second takes its name.
        let of =
            |map: &Map, darts: &[Dart], end| darts.iter().position(|&dart| map.vertex(dart) == end);
        if of(self.map, &darts, ends[0]).is_none() {
            let Some(heir) = of(self.map, &darts, ends[1]) else {
                return Err(refuse(
                    AnyCell::Edge(edge),
                    "nothing would be left of its ends",
                ));
            };
            self.map.set_label(VERTEX, darts[heir], ends[0].label());
            darts.swap(0, heir);
        }
        if of(self.map, &darts, ends[1]).is_none() {
            self.bury(0, ends[1].label(), Some(ends[0].label()));
        }
        self.settle(&darts, &orphans);
        let mut near: Vec<_> = darts.iter().map(|&dart| self.map.vertex(dart)).collect();
        near.sort_unstable();
        near.dedup();
        Ok(near)
    }

    /// Joins the neighbours of faces that have two darts left, of which `flat` has one, and adds the darts to `gone`.
    fn drop_slivers(&mut self, flat: &[Dart], gone: &mut Vec<Dart>) {
        for &one in flat {
            let other = self.map.beta1(one);
            if self.map.beta1(other) != one || gone.contains(&one) {
                continue;
            }
            let across = [one, other].map(|dart| self.map.beta2(dart));
            self.join_ends(2, across);
            gone.extend([one, other]);
        }
    }

    /// Joins the neighbours of volumes beside `flat` that have two faces left, each the other's only neighbour, and adds
    /// their darts to `gone`. One without neighbours is an error.
    fn drop_pillows(&mut self, flat: &[Dart], gone: &mut Vec<Dart>) -> Result<(), Cell<Volume>> {
        let beside: Vec<_> = flat
            .iter()
            .filter_map(|&dart| self.map.beta2(dart))
            .collect();
        for dart in beside {
            if gone.contains(&dart) || !self.is_pillow(dart) {
                continue;
            }
            let near: Vec<_> = self.map.ring(dart).collect();
            for dart in near {
                let across = self.map.beta2(dart).expect("seen in the pillow");
                let beyond = [dart, across].map(|dart| self.map.beta3(dart));
                if beyond == [None; 2] {
                    return Err(self.map.volume(dart));
                }
                self.join_ends(3, beyond);
                gone.extend([dart, across]);
            }
        }
        Ok(())
    }

    /// Links two darts along β2 or β3, or frees the one where there is no other.
    fn join_ends(&mut self, beta: usize, ends: [Option<Dart>; 2]) {
        for (dart, partner) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            if let Some(dart) = dart {
                self.map.set_beta(beta, dart, partner);
            }
        }
    }

    /// The darts of all volumes at either vertex.
    fn stars(&mut self, ends: [Cell<Vertex>; 2]) -> Vec<Dart> {
        let mut walk = std::mem::take(&mut self.map.walk);
        let map = &*self.map;
        let mut volumes = Vec::new();
        for vertex in ends {
            volumes.extend(map.orbit(vertex, &mut walk).map(|dart| map.volume(dart)));
        }
        volumes.sort_unstable();
        volumes.dedup();
        let mut darts = Vec::new();
        for volume in volumes {
            darts.extend(map.orbit(volume, &mut walk));
        }
        self.map.walk = walk;
        darts
    }

    /// Whether the volume of `dart` has two faces only, glued edge to edge.
    fn is_pillow(&self, dart: Dart) -> bool {
        let map = &*self.map;
        let Some(mut across) = map.beta2(dart) else {
            return false;
        };
        let mut at = dart;
        loop {
            at = map.beta1(at);
            // The other face runs against this one.
            let expected = map.beta2(at);
            if expected.map(|other| map.beta1(other)) != Some(across) {
                return false;
            }
            let Some(next) = expected else { return false };
            across = next;
            if at == dart {
                return true;
            }
        }
    }
}

/// What is wrong with a vertex, its cells and what is `near`, if anything is.
fn spoilt(
    map: &Map,
    vertex: Cell<Vertex>,
    near: Vec<Cell<Vertex>>,
    walk: &mut Walk,
) -> Option<(AnyCell, &'static str)> {
    let edges: Vec<_> = map.incident::<Vertex, Edge>(vertex, walk).collect();
    let mut others: Vec<_> = edges
        .iter()
        .map(|&edge| {
            let [a, b] = map.ends(edge);
            (if a == vertex { b } else { a }, edge)
        })
        .collect();
    others.sort_unstable();
    if let Some(&(_, edge)) = others.iter().find(|(other, _)| *other == vertex) {
        return Some((AnyCell::Edge(edge), "it would begin and end at the vertex"));
    }
    if let Some(pair) = others.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Some((AnyCell::Edge(pair[0].1), "another edge would join its ends"));
    }
    let volumes: Vec<_> = map.incident::<Vertex, Volume>(vertex, walk).collect();
    for &volume in &volumes {
        if let Some(reason) = spoilt_volume(map, volume, walk) {
            return Some((AnyCell::Volume(volume), reason));
        }
    }
    if let Some(found) = doubled_face(map, vertex, walk) {
        return Some(found);
    }
    let bad = near.into_iter().find(|&vertex| !is_ball(map, vertex, walk));
    bad.map(|vertex| {
        (
            AnyCell::Vertex(vertex),
            "its neighbourhood would be no ball",
        )
    })
}

/// Every face a ring of three vertices or more, no vertex twice; every vertex at one corner of the volume.
fn spoilt_volume(map: &Map, volume: Cell<Volume>, walk: &mut Walk) -> Option<&'static str> {
    let darts: Vec<_> = map.orbit(volume, walk).collect();
    let side = |dart: Dart| map.label[SIDE][dart.index()];
    let count = |mut labels: Vec<u32>| {
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    };
    let of = |label: &dyn Fn(Dart) -> u32| count(darts.iter().map(|&dart| label(dart)).collect());
    let vertices = of(&|dart| map.vertex(dart).label());
    let edges = of(&|dart| map.edge(dart).label());
    let rings = of(&side);
    if rings < 4 && map.dimension == crate::Dimension::Three {
        return Some("it would have fewer than four faces");
    }
    let is_simple = |dart: Dart| {
        let ring: Vec<_> = map
            .ring(dart)
            .map(|dart| map.vertex(dart).label())
            .collect();
        let length = ring.len();
        length > 2 && count(ring) == length
    };
    if !darts.iter().all(|&dart| is_simple(dart)) {
        return Some("a face of it would touch itself");
    }
    // A sphere, if no vertex, edge or face is at two places of it.
    let is_sphere = vertices + rings == edges + 2 && 2 * edges == darts.len();
    (!is_sphere && map.dimension == crate::Dimension::Three).then_some("it would touch itself")
}

/// Two faces at the vertex with the same vertices.
fn doubled_face(
    map: &Map,
    vertex: Cell<Vertex>,
    walk: &mut Walk,
) -> Option<(AnyCell, &'static str)> {
    let faces: Vec<_> = map.incident::<Vertex, crate::Face>(vertex, walk).collect();
    let ring = |face| {
        let ring = map.ring(map.dart(face));
        let mut vertices: Vec<_> = ring.map(|dart| map.vertex(dart)).collect();
        vertices.sort_unstable();
        vertices
    };
    let mut rings: Vec<_> = faces.into_iter().map(|face| (ring(face), face)).collect();
    rings.sort_unstable();
    let doubled = rings.windows(2).find(|pair| pair[0].0 == pair[1].0)?;
    Some((
        AnyCell::Face(doubled[0].1),
        "another face would have its vertices",
    ))
}

/// Whether the cells around a vertex make a ball, or a half-ball with the vertex on the boundary (in a 2-map, a disc or
/// half-disc). What they cut a small sphere into is a sphere or a disc: by its Euler characteristic, being connected.
fn is_ball(map: &Map, vertex: Cell<Vertex>, walk: &mut Walk) -> bool {
    if map.dimension == crate::Dimension::Two {
        let ends = map
            .orbit(vertex, walk)
            .filter(|&dart| map.beta2(dart).is_none());
        return ends.count() < 2;
    }
    let darts: Vec<_> = map.orbit(vertex, walk).collect();
    let is_boundary = darts.iter().any(|&dart| map.beta3(dart).is_none());
    // Each face at the vertex is an edge of the cut sphere, and each corner of a volume a face.
    let sides = darts.len();
    let inner = darts
        .iter()
        .filter(|&&dart| map.beta3(dart).is_some())
        .count();
    let faces = sides - inner / 2;
    let count = |labels: Vec<u32>| {
        let mut labels = labels;
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    };
    let edges = count(darts.iter().map(|&dart| map.edge(dart).label()).collect());
    let corners = count(darts.iter().map(|&dart| map.volume(dart).label()).collect());
    edges + corners == faces + if is_boundary { 1 } else { 2 }
}
