//! Regular subdivisions: tetrahedra around an edge in two, hexahedra in eight.

use crate::error::EditError;
use crate::map::{EDGE, SIDE, VERTEX};
use crate::{AnyCell, Cell, Dart, Edge, Edit, Face, Map, Vertex, Volume};

impl Edit<'_> {
    /// Splits a face by a new vertex in its midst, joined to all of its own. The triangle of [`Map::dart`] keeps the
    /// face's name.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`].
    pub fn star_face(&mut self, face: Cell<Face>) -> Result<Cell<Vertex>, EditError> {
        self.settle_pending()?;
        let first = self.alive(face)?;
        let ring: Vec<_> = self.map.ring(first).collect();
        let corners: Vec<_> = ring.iter().map(|&dart| self.map.vertex(dart)).collect();
        self.room(4 * ring.len())?;
        let parent = Some(AnyCell::Face(face));
        // Of each corner's edge, a triangle: on from its head to the centre, and from there to its vertex.
        let near: Vec<_> = ring.iter().map(|&dart| (dart, self.fan(dart))).collect();
        let vertex = self.bear_vertex(parent, &corners, near[0].1[1]);
        let sides = self.map.label[SIDE][first.index()];
        let volumes = [sides, sides ^ 1].map(|side| self.map.side_volume[side as usize]);
        let count = near.len();
        for (at, &(dart, [inward, outward])) in near.iter().enumerate() {
            let (next, [_, next_outward]) = near[(at + 1) % count];
            let beyond = self.map.beta3(dart).map(|other| (other, self.fan(other)));
            let edge = self.bear(1, parent, inward);
            let side = if at == 0 {
                sides
            } else {
                let face = self.bear(2, parent, dart);
                self.map.set_side_volume(2 * face, volumes[0]);
                self.map.set_side_volume(2 * face + 1, volumes[1]);
                2 * face
            };
            self.pair(2, inward, next_outward);
            let head = self.map.vertex(next).label();
            self.label_fan(dart, [inward, outward], [head, vertex.label()], side);
            self.map.set_label(EDGE, inward, edge);
            self.map.set_label(EDGE, next_outward, edge);
            if let Some((other, [back, forth])) = beyond {
                self.pair(3, back, outward);
                self.pair(3, forth, inward);
                let tail = corners[at].label();
                self.label_fan(other, [back, forth], [tail, vertex.label()], side ^ 1);
            }
        }
        self.map.set_cell_dart(2, face.label(), Some(first));
        self.close_far_fan(&near);
        Ok(vertex)
    }

    /// Makes a triangle of `dart`: two new darts after it.
    fn fan(&mut self, dart: Dart) -> [Dart; 2] {
        let [inward, outward] = [(); 2].map(|()| self.map.new_dart());
        self.map.set_beta(1, dart, Some(inward));
        self.map.set_beta(1, inward, Some(outward));
        self.map.set_beta(1, outward, Some(dart));
        [inward, outward]
    }

    fn label_fan(&mut self, dart: Dart, fan: [Dart; 2], vertices: [u32; 2], side: u32) {
        for (dart, vertex) in fan.into_iter().zip(vertices) {
            self.map.set_label(VERTEX, dart, vertex);
            self.map.set_label(SIDE, dart, side);
        }
        if self.map.label[SIDE][dart.index()] != side {
            self.map.set_label(SIDE, dart, side);
        }
    }

    /// The spokes of the far side are those of the near one.
    fn close_far_fan(&mut self, near: &[(Dart, [Dart; 2])]) {
        for &(_, [inward, _]) in near {
            let (Some(next), Some(forth)) = (self.map.beta2(inward), self.map.beta3(inward)) else {
                continue;
            };
            if let Some(back) = self.map.beta3(next) {
                self.pair(2, forth, back);
                let edge = self.map.label[EDGE][inward.index()];
                self.map.set_label(EDGE, forth, edge);
                self.map.set_label(EDGE, back, edge);
            }
        }
    }

    /// Splits an edge at a new vertex, and with it each tetrahedron around the edge in two: through the new vertex and
    /// the opposite edge.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`], [`EditError::OpenVolume`]; [`EditError::WrongShape`] if a volume at the
    /// edge is no tetrahedron (in a 2-map, a face no triangle).
    pub fn bisect(&mut self, edge: Cell<Edge>) -> Result<Cell<Vertex>, EditError> {
        self.settle_whole()?;
        let first = self.alive(edge)?;
        let around: Vec<_> = self.map.around(first).collect();
        let is_volume = self.map.dimension == crate::Dimension::Three;
        for &dart in &around {
            if self.map.ring(dart).take(4).count() != 3 {
                let cell = AnyCell::Face(self.map.face(dart));
                let needed = "triangle";
                return Err(EditError::WrongShape { cell, needed });
            }
            if is_volume && !self.map.is_tetrahedron(dart) {
                let cell = AnyCell::Volume(self.map.volume(dart));
                let needed = "tetrahedron";
                return Err(EditError::WrongShape { cell, needed });
            }
        }
        let mut tetrahedra = around.clone();
        tetrahedra.retain(|_| is_volume);
        tetrahedra.sort_unstable_by_key(|&dart| self.map.volume(dart));
        tetrahedra.dedup_by_key(|dart| self.map.volume(*dart));
        self.room(8 * around.len())?;
        self.attempt(|edit| {
            let vertex = edit.split_edge(edge)?;
            // Either way along the edge, the dart before the new vertex.
            let before = |map: &Map, dart| match map.vertex(dart) == vertex {
                true => map.beta0(dart),
                false => dart,
            };
            for &dart in &around {
                // Splitting one side of a face splits the other.
                if edit.map.ring(dart).count() == 4 {
                    let dart = before(edit.map, dart);
                    edit.split_face(edit.map.beta1(dart), edit.map.beta0(dart))?;
                }
            }
            for &dart in &tetrahedra {
                edit.bisect_tetrahedron(before(edit.map, dart))?;
            }
            Ok(vertex)
        })
    }

    /// `dart` is the half of the edge before the new vertex, in a tetrahedron whose faces at the edge are split.
    fn bisect_tetrahedron(&mut self, dart: Dart) -> Result<(), EditError> {
        let map = &*self.map;
        let across = |dart: Dart| map.beta2(dart).expect("volumes are closed");
        let down = map.beta1(dart);
        let opposite = map.beta1(across(map.beta1(down)));
        let up = map.beta0(across(dart));
        self.split_volume(&[down, opposite, up])?;
        Ok(())
    }

    /// Splits hexahedra in eight each: a new vertex in the midst of each edge, each face and each volume. Hexahedra that
    /// have faces in common must be given at once: one whose neighbour was split before has split faces, and is a
    /// hexahedron no more.
    ///
    /// # Errors
    /// [`EditError::NoCell`], [`EditError::Full`], [`EditError::OpenFace`], [`EditError::OpenVolume`]; [`EditError::WrongShape`] if a volume is no
    /// hexahedron.
    pub fn split_hexahedra(&mut self, volumes: &[Cell<Volume>]) -> Result<(), EditError> {
        self.settle_whole()?;
        let mut hexahedra = Vec::new();
        let (mut edges, mut faces) = (Vec::new(), Vec::new());
        let mut sorted = volumes.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        for volume in sorted {
            let dart = self.alive(volume)?;
            let hexahedron = Hexahedron::of(self.map, dart).ok_or(EditError::WrongShape {
                cell: AnyCell::Volume(volume),
                needed: "hexahedron",
            })?;
            let darts = hexahedron.bottom.into_iter().chain(hexahedron.top);
            for dart in darts.chain(hexahedron.sides.into_iter().flatten()) {
                edges.push(self.map.edge(dart));
                faces.push(self.map.face(dart));
            }
            hexahedra.push(hexahedron);
        }
        edges.sort_unstable();
        edges.dedup();
        faces.sort_unstable();
        faces.dedup();
        self.attempt(|edit| {
            let (mut middles, mut centres) = (Vec::new(), Vec::new());
            let plans: Vec<_> = hexahedra
                .iter()
                .map(|hexahedron| hexahedron.plan(edit.map))
                .collect();
            for edge in edges {
                middles.push((edge, edit.split_edge(edge)?));
            }
            let mut new: Vec<_> = middles.iter().map(|&(_, vertex)| vertex).collect();
            new.sort_unstable();
            for face in faces {
                centres.push((face, edit.split_quad(face, &new)?));
            }
            for plan in &plans {
                edit.split_hexahedron(&plan.resolve(&middles, &centres))?;
            }
            Ok(())
        })
    }

    /// Splits a quad in four whose edges are split at some of `middles`, which ascend. Returns the vertex in the midst.
    fn split_quad(
        &mut self,
        face: Cell<Face>,
        middles: &[Cell<Vertex>],
    ) -> Result<Cell<Vertex>, EditError> {
        let first = self.map.dart(face);
        let ring: Vec<_> = self.map.ring(first).collect();
        // Every second vertex is the middle of an edge that was.
        let start = self.map.vertex(first);
        let is_corner = middles.binary_search(&start).is_err();
        let middle = |at: usize| ring[usize::from(is_corner) + 2 * at];
        let chord = self.split_face(middle(0), middle(2))?;
        let centre = self.split_edge(chord)?;
        for dart in [middle(1), middle(3)] {
            let around: Vec<_> = self.map.ring(dart).collect();
            let from = around.iter().find(|&&dart| self.map.vertex(dart) == centre);
            self.split_face(dart, *from.expect("the centre is in both halves"))?;
        }
        Ok(centre)
    }

    fn split_hexahedron(&mut self, new: &Middles) -> Result<(), EditError> {
        let &Middles {
            volume,
            upright,
            side,
            ends,
        } = new;
        let ring: Vec<_> = (0..4).flat_map(|at| [upright[at], side[at]]).collect();
        let halves = self.split_volume_along(volume, &ring)?;
        // The face between the halves in four, around the centre.
        let chord = self.split_face_of(halves.kept, side[0], side[2])?;
        let centre = self.split_edge(chord)?;
        self.split_face_of(halves.kept, centre, side[1])?;
        self.split_face_of(halves.kept, centre, side[3])?;
        for half in [halves.kept, halves.new] {
            let is_bottom = self.has_vertex(half, ends[0].1);
            let (middle, end) = if is_bottom { ends[0] } else { ends[1] };
            let across = [side[0], centre, side[2], middle[2], end, middle[0]];
            let quarters = self.split_volume_along(half, &across)?;
            self.split_face_of(quarters.kept, centre, end)?;
            for quarter in [quarters.kept, quarters.new] {
                let at = if self.has_vertex(quarter, side[1]) {
                    1
                } else {
                    3
                };
                self.split_volume_along(quarter, &[centre, side[at], middle[at], end])?;
            }
        }
        Ok(())
    }

    fn has_vertex(&mut self, volume: Cell<Volume>, vertex: Cell<Vertex>) -> bool {
        let mut walk = std::mem::take(&mut self.map.walk);
        let mut orbit = self.map.orbit(volume, &mut walk);
        let has = orbit.any(|dart| self.map.vertex(dart) == vertex);
        self.map.walk = walk;
        has
    }
}

/// The darts of a hexahedron: of four sides that meet in upright edges, and of two ends.
struct Hexahedron {
    /// Along the bottom's ring.
    bottom: [Dart; 4],
    /// Of each side, in its ring: against the bottom's dart, up, along the top, down.
    sides: [[Dart; 4]; 4],
    /// Against the sides' third darts.
    top: [Dart; 4],
}

impl Hexahedron {
    fn of(map: &Map, dart: Dart) -> Option<Self> {
        let ring = |dart: Dart| -> Option<[Dart; 4]> {
            let ring: Vec<_> = map.ring(dart).take(5).collect();
            ring.try_into().ok()
        };
        let bottom = ring(dart)?;
        let mut sides = [[dart; 4]; 4];
        let mut top = [dart; 4];
        for at in 0..4 {
            sides[at] = ring(map.beta2(bottom[at])?)?;
            top[at] = map.beta2(sides[at][2])?;
        }
        for at in 0..4 {
            // Sides share upright edges: up on the one is down on the one before.
            let before = (at + 3) % 4;
            let next = (at + 1) % 4;
            if map.beta2(sides[at][1]) != Some(sides[before][3]) || map.beta1(top[next]) != top[at]
            {
                return None;
            }
        }
        let mut vertices: Vec<_> = bottom.iter().chain(&top).map(|&d| map.vertex(d)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let sound = vertices.len() == 8 && ring(top[0]).is_some();
        sound.then_some(Self { bottom, sides, top })
    }

    fn plan(&self, map: &Map) -> Plan {
        Plan {
            volume: map.volume(self.bottom[0]),
            upright: self.sides.map(|side| map.edge(side[1])),
            sides: self.sides.map(|side| map.face(side[0])),
            ends: [self.bottom, self.top]
                .map(|ring| (ring.map(|dart| map.edge(dart)), map.face(ring[0]))),
        }
    }
}

/// Which edges and faces of a hexahedron new vertices come from.
struct Plan {
    volume: Cell<Volume>,
    upright: [Cell<Edge>; 4],
    sides: [Cell<Face>; 4],
    ends: [([Cell<Edge>; 4], Cell<Face>); 2],
}

/// The new vertices of a hexahedron. `side[i]` lies between `upright[i]` and the next.
struct Middles {
    volume: Cell<Volume>,
    upright: [Cell<Vertex>; 4],
    side: [Cell<Vertex>; 4],
    /// Of the bottom and the top: next to each side, and of the whole.
    ends: [([Cell<Vertex>; 4], Cell<Vertex>); 2],
}

impl Plan {
    /// The lists ascend by what new vertices come from.
    fn resolve(
        &self,
        middles: &[(Cell<Edge>, Cell<Vertex>)],
        centres: &[(Cell<Face>, Cell<Vertex>)],
    ) -> Middles {
        let middle = |edge: Cell<Edge>| middles[middles.partition_point(|m| m.0 < edge)].1;
        let centre = |face: Cell<Face>| centres[centres.partition_point(|c| c.0 < face)].1;
        Middles {
            volume: self.volume,
            upright: self.upright.map(middle),
            side: self.sides.map(centre),
            ends: self
                .ends
                .map(|(edges, face)| (edges.map(middle), centre(face))),
        }
    }
}

impl Map {
    /// Whether the volume of `dart` has four triangles.
    fn is_tetrahedron(&self, dart: Dart) -> bool {
        let is_triangle = |dart: Dart| self.ring(dart).take(4).count() == 3;
        let base = [dart, self.beta1(dart), self.beta0(dart)];
        let slopes = base.map(|dart| self.beta2(dart).filter(|&slope| is_triangle(slope)));
        let [Some(a), Some(b), Some(c)] = slopes else {
            return false;
        };
        // Each slope goes up where the one before comes down.
        let meet =
            |slope: Dart, before: Dart| self.beta2(self.beta1(slope)) == Some(self.beta0(before));
        is_triangle(dart) && meet(a, c) && meet(b, a) && meet(c, b)
    }
}
