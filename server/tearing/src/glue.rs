//! Gluing faces that came apart.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sinew_topology::{Cell, Dart, Face, Map, Vertex, Volume, Walk};

use crate::areas::View;
use crate::body::number;
use crate::commit::{Batch, Made};
use crate::shape::is_cell;
use crate::{Body, Done, Facet, Refusal};

/// Vertices farther apart at rest than this part of their face's extent are not the same.
const SAME: f64 = 1e-9;

impl Body {
    /// Glues faces of the boundary to each other.
    pub(crate) fn glue(
        &mut self,
        pairs: &[[Facet; 2]],
        view: &View<'_>,
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        let mut darts = Vec::new();
        for [one, other] in pairs {
            let ends = [self.free(one)?, self.free(other)?];
            let cells = [one.cell, other.cell];
            darts.push(self.facing_at_rest(ends).ok_or(Refusal::Apart { cells })?);
        }
        self.sew(darts, view, batch)
    }

    /// Glues all faces of two fragments, or of one, that came apart and are near again.
    pub(crate) fn close(
        &mut self,
        fragments: [u32; 2],
        distance: f64,
        view: &View<'_>,
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        let slots = 0..number(self.slot_count());
        let mut pairs =
            self.facing(slots.filter(|&slot| fragments.contains(&self.fragments.of(slot))));
        pairs.retain(|&pair| {
            let owners = pair.map(|dart| self.fragments.of(self.slot(self.map.volume(dart))));
            let is_between = owners == fragments || owners == [fragments[1], fragments[0]];
            is_between && self.is_near(pair, distance, view, batch)
        });
        self.sew(pairs, view, batch)
    }

    /// The two sides of each face of these cells, by slot, that came apart and have both sides among them: so that
    /// vertices in the same place of both lay upon each other at rest.
    pub fn gaps(&self, cells: &[u32]) -> Vec<[Facet; 2]> {
        let facet = |darts: Vec<Dart>| Facet {
            cell: self.slot(self.map.volume(darts[0])),
            vertices: (darts.iter())
                .map(|&dart| number(self.map.vertex(dart).index()))
                .collect(),
        };
        let pairs = self.facing(cells.iter().copied()).into_iter();
        let sides =
            pairs.map(|[one, other]| [self.map.ring(one).collect(), self.back(other)].map(facet));
        sides.collect()
    }

    /// Faces of the boundary of these cells that lie upon each other at rest, as darts in opposite directions.
    fn facing(&self, slots: impl Iterator<Item = u32>) -> Vec<[Dart; 2]> {
        let mut walk = Walk::default();
        // By where their corners are at rest: the two sides of a tear have the same.
        let mut free = BTreeMap::<Vec<[u64; 3]>, Vec<Dart>>::new();
        for volume in slots.filter_map(|slot| self.volume(slot)) {
            for face in self.map.incident::<Volume, Face>(volume, &mut walk) {
                let dart = self.map.dart(face);
                if self.map.beta3(dart).is_none() {
                    free.entry(corners(&self.map, &self.rest, dart))
                        .or_default()
                        .push(dart);
                }
            }
        }
        let two = |darts: Vec<Dart>| <[Dart; 2]>::try_from(darts).ok();
        let pairs = free.into_values().filter_map(two);
        pairs.filter_map(|pair| self.facing_at_rest(pair)).collect()
    }

    /// The ring of a face from where its dart runs to, backwards.
    fn back(&self, dart: Dart) -> Vec<Dart> {
        let mut back: Vec<_> = self.map.ring(self.map.beta1(dart)).collect();
        back[1..].reverse();
        back
    }

    /// The dart of a face of the boundary.
    pub(crate) fn free(&mut self, facet: &Facet) -> Result<Dart, Refusal> {
        let volume = self.live(facet.cell)?;
        let mut wanted = facet.vertices.clone();
        wanted.sort_unstable();
        let map = &self.map;
        let is_wanted = |dart: &Dart| {
            let ring = map.ring(*dart).map(|dart| number(map.vertex(dart).index()));
            let mut vertices: Vec<_> = ring.collect();
            vertices.sort_unstable();
            vertices == wanted && map.beta3(*dart).is_none()
        };
        let found = map.orbit(volume, &mut self.walk).find(is_wanted);
        found.ok_or(Refusal::NoFreeFacet { cell: facet.cell })
    }

    /// Two faces as darts that lie upon each other at rest, in opposite directions; `None` if they do not.
    fn facing_at_rest(&self, [one, other]: [Dart; 2]) -> Option<[Dart; 2]> {
        let at = |dart: Dart| self.rest[self.map.vertex(dart).index()];
        let ring: Vec<_> = self.map.ring(one).collect();
        let extent = ring.iter().map(|&dart| (at(dart) - at(one)).norm());
        let same = SAME * extent.fold(0.0, f64::max);
        // `one` runs from where its partner runs to.
        let partner = self.map.ring(other).find(|&other| {
            let back = self.back(other);
            let pairs = || ring.iter().zip(&back);
            back.len() == ring.len() && pairs().all(|(&a, &b)| (at(a) - at(b)).norm() <= same)
        });
        Some([one, partner?])
    }

    fn is_near(
        &self,
        [one, other]: [Dart; 2],
        distance: f64,
        view: &View<'_>,
        batch: &Batch,
    ) -> bool {
        let now = |dart: Dart| {
            let vertex = number(self.map.vertex(dart).index());
            view.now.get(batch.known_by(vertex) as usize)
        };
        let mut pairs = self.map.ring(one).zip(self.back(other));
        pairs.all(|(one, other)| match (now(one), now(other)) {
            (Some(one), Some(other)) => (one - other).norm() <= distance,
            (None, _) | (_, None) => false,
        })
    }

    fn sew(
        &mut self,
        pairs: Vec<[Dart; 2]>,
        view: &View<'_>,
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        if pairs.is_empty() {
            return Err(Refusal::Nothing);
        }
        for darts in &pairs {
            let owners = darts.map(|dart| self.owner(self.map.volume(dart), view, batch));
            if let [Some(one), Some(other)] = owners {
                self.torn.remove(&[one.min(other), one.max(other)]);
            }
        }
        let (slots, walk) = (&self.slots, &mut self.walk);
        let (closed, changes) = self.map.edit(|edit| {
            for &[one, other] in &pairs {
                edit.sew3(one, other)?;
            }
            let spoilt = spoilt(edit.map(), &pairs, walk);
            if spoilt.is_empty() {
                return Ok(pairs);
            }
            let cells = spoilt.iter().map(|volume| slots[volume.index()]);
            let cells = cells.collect();
            Err(Refusal::Spoilt { cells })
        })?;
        let made = Made {
            closed,
            ..Made::default()
        };
        Ok(self.commit(&changes, &made, batch))
    }
}

/// Where the corners of a face are at rest, in an order of their own.
fn corners(map: &Map, rest: &[Vector3<f64>], dart: Dart) -> Vec<[u64; 3]> {
    let bits = |dart| rest[map.vertex(dart).index()].map(f64::to_bits).into();
    let mut corners: Vec<[u64; 3]> = map.ring(dart).map(bits).collect();
    corners.sort_unstable();
    corners
}

/// Volumes at glued faces that touch themselves now.
fn spoilt(map: &Map, pairs: &[[Dart; 2]], walk: &mut Walk) -> Vec<Cell<Volume>> {
    let mut volumes = Vec::new();
    for &[one, _] in pairs {
        for dart in map.ring(one) {
            volumes.extend(map.incident::<Vertex, Volume>(map.vertex(dart), walk));
        }
    }
    volumes.sort_unstable();
    volumes.dedup();
    volumes.retain(|&volume| !is_cell(map, volume, walk));
    volumes
}
