//! Sewing and unsewing: β, and the cells with it.

use crate::error::EditError;
use crate::map::{EDGE, SIDE, VERTEX};
use crate::slots::NONE;
use crate::{AnyCell, Dart, Edit, Map};

impl Edit<'_> {
    /// Lets β1(`from`) = `to`, and likewise on the other side of the face if there is one.
    ///
    /// The cells are settled when the edit ends, since an open face has none.
    ///
    /// # Errors
    /// As [`Edit::link1`]; [`EditError::OtherSide`] if only one of the two has another side.
    pub fn sew1(&mut self, from: Dart, to: Dart) -> Result<(), EditError> {
        self.known(from)?;
        self.known(to)?;
        let other_side = |dart, other| EditError::OtherSide { dart, other };
        match (self.map.beta3(from), self.map.beta3(to)) {
            (None, None) => self.link1(from, to),
            (Some(other), None) => Err(other_side(from, other)),
            (None, Some(other)) => Err(other_side(to, other)),
            (Some(before), Some(after)) => self.attempt(|edit| {
                edit.link1(from, to)?;
                edit.link1(after, before)
            }),
        }
    }

    /// Frees β1(`from`), and likewise on the other side of the face if there is one. Returns the dart that it was.
    ///
    /// The cells are settled when the edit ends, by when the face must be closed again.
    ///
    /// # Errors
    /// As [`Edit::unlink1`].
    pub fn unsew1(&mut self, from: Dart) -> Result<Dart, EditError> {
        self.attempt(|edit| {
            let to = edit.unlink1(from)?;
            if let Some(after) = edit.map.beta3(to) {
                edit.unlink1(after)?;
            }
            Ok(to)
        })
    }

    /// Joins two darts of the borders of two faces along one edge: β2. Their vertices, edges and volumes become one.
    ///
    /// # Errors
    /// As [`Edit::link2`]; [`EditError::OpenFace`].
    pub fn sew2(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.settle_pending()?;
        self.link2(one, other)?;
        self.settle_pending()
    }

    /// Parts two faces of a volume along the edge of `dart`. In a 3-map something must fill the gap before the edit ends.
    /// Where a cell falls in two, the part with `dart` in it keeps its name. Returns the dart that β2(`dart`) was.
    ///
    /// # Errors
    /// As [`Edit::unlink2`]; [`EditError::OpenFace`].
    pub fn unsew2(&mut self, dart: Dart) -> Result<Dart, EditError> {
        self.settle_pending()?;
        let other = self.unlink2(dart)?;
        self.settle_pending()?;
        Ok(other)
    }

    /// Glues the faces of `one` and `other`, these two darts with each other. The cells on `one`'s side keep their names,
    /// and those of `other`'s side die into them.
    ///
    /// # Errors
    /// As [`Edit::link3`].
    pub fn sew3(&mut self, one: Dart, other: Dart) -> Result<(), EditError> {
        self.settle_pending()?;
        if self.has_borders {
            self.link3(one, other)?;
            return self.settle_pending();
        }
        self.pair_faces(one, other)?;
        let pairs = std::mem::take(&mut self.pairs);
        for &[near, facing] in &pairs {
            self.merge(VERTEX, near, self.map.beta1(facing));
            self.merge(EDGE, near, facing);
        }
        self.pairs = pairs;
        let [kept, gone] = [one, other].map(|dart| self.map.label[SIDE][dart.index()]);
        let beyond = kept ^ 1;
        self.map
            .set_side_volume(beyond, self.map.side_volume[gone as usize]);
        self.label_ring(other, beyond);
        self.bury(2, gone / 2, Some(kept / 2));
        Ok(())
    }

    /// Parts the two volumes on the sides of the face of `dart`. Vertices and edges that nothing else holds together
    /// fall in two; `dart`'s part of each keeps its name. Returns the dart that β3(`dart`) was.
    ///
    /// # Errors
    /// As [`Edit::unlink3`].
    pub fn unsew3(&mut self, dart: Dart) -> Result<Dart, EditError> {
        self.settle_pending()?;
        self.known(dart)?;
        if self.has_borders || self.map.meets_itself(dart) {
            let other = self.unlink3(dart)?;
            self.settle_pending()?;
            return Ok(other);
        }
        // All are looked at before any is changed, so that no load waits for another.
        let mut open = std::mem::take(&mut self.flags);
        open.clear();
        open.extend(self.map.ring(dart).map(|dart| self.map.is_open(dart)));
        let other = self.unpair_faces(dart)?;
        let side = self.map.label[SIDE][dart.index()];
        let parent = AnyCell::of(2, side / 2);
        let face = self.bear(2, Some(parent), other);
        let volume = self.map.side_volume[(side ^ 1) as usize];
        self.map.set_side_volume(2 * face, volume);
        self.map.set_side_volume(side ^ 1, NONE);
        self.label_ring(other, 2 * face);
        self.map.set_cell_dart(2, side / 2, Some(dart));

        let pairs = std::mem::take(&mut self.pairs);
        for (&[near, far], &was_open) in pairs.iter().zip(&open) {
            let edge = self.map.label[EDGE][near.index()];
            self.map.set_cell_dart(1, edge, Some(near));
            // A ring of volumes around it is a fan from `near` to `far` now, a fan is two.
            if was_open {
                self.part_edge(edge, far);
            }
        }
        // A vertex that neither of the face's two edges there holds together may fall in two.
        let mut before = pairs.len() - 1;
        for at in 0..pairs.len() {
            if open[before] && open[at] {
                self.part_vertex(pairs[at][0], pairs[before][1]);
            }
            before = at;
        }
        (self.pairs, self.flags) = (pairs, open);
        Ok(other)
    }

    fn label_ring(&mut self, dart: Dart, side: u32) {
        let mut at = dart;
        loop {
            self.map.set_label(SIDE, at, side);
            at = self.map.beta1(at);
            if at == dart {
                return;
            }
        }
    }

    /// Makes one vertex or edge (column 0 or 1) of those of two darts that are joined now.
    fn merge(&mut self, column: usize, keep: Dart, give: Dart) {
        let [kept, gone] = [keep, give].map(|dart| self.map.label[column][dart.index()]);
        if kept == gone {
            return;
        }
        // Only what has the old label is walked: the new label marks what is done.
        self.queue.clear();
        self.queue.push(give);
        self.map.set_label(column, give, kept);
        let mut done = 0;
        while let Some(&dart) = self.queue.get(done) {
            done += 1;
            for next in self.map.steps(column, dart).into_iter().flatten() {
                if self.map.label[column][next.index()] == gone {
                    self.map.set_label(column, next, kept);
                    self.queue.push(next);
                }
            }
        }
        if column == EDGE {
            self.stand_at_end(keep, [kept, gone]);
        }
        self.bury(column, gone, Some(kept));
    }

    /// Lets a dart at an end of the fan stand for the edge of `dart`, if that is open. `labels` are those of the edge and of
    /// the one that was merged into it.
    fn stand_at_end(&mut self, dart: Dart, labels: [u32; 2]) {
        let is_end = |dart: &Dart| self.map.beta3(*dart).is_none();
        let darts = labels.map(|label| self.map.slots[1].dart[label as usize].filter(is_end));
        let end = match darts {
            [Some(_), _] => return,
            [None, Some(end)] => Some(end),
            [None, None] => self.map.around(dart).find(is_end),
        };
        if end.is_some() {
            self.map.set_cell_dart(1, labels[0], end);
        }
    }

    /// Gives the fan that begins with `far` an edge of its own.
    fn part_edge(&mut self, label: u32, far: Dart) {
        let new = self.bear(1, Some(AnyCell::of(1, label)), far);
        let mut at = Some(far);
        while let Some(dart) = at {
            self.map.set_label(EDGE, dart, new);
            at = self.map.beta2(dart);
            if let Some(across) = at {
                self.map.set_label(EDGE, across, new);
                at = self.map.beta3(across);
            }
        }
    }

    /// After a cut between `near` and `far`: if their vertex does not hold together any more, `far`'s part of it becomes
    /// a vertex of its own.
    fn part_vertex(&mut self, near: Dart, far: Dart) {
        let label = self.map.label[VERTEX][near.index()];
        if self.map.label[VERTEX][far.index()] != label {
            return;
        }
        let mut walk = std::mem::take(&mut self.map.walk);
        if !walk.reaches(self.map, VERTEX, far, near) {
            let parent = AnyCell::of(0, label);
            let new = self.bear(0, Some(parent), far);
            for &dart in walk.darts() {
                self.map.set_label(VERTEX, dart, new);
            }
            self.map.set_cell_dart(0, label, Some(near));
        }
        self.map.walk = walk;
    }
}

impl Map {
    /// Whether the volumes around the edge of `dart` are a fan, which ends on the boundary, not a ring.
    fn is_open(&self, dart: Dart) -> bool {
        let edge = self.label[EDGE][dart.index()];
        let end = self.slots[1].dart[edge as usize];
        end.is_some_and(|end| self.beta3(end).is_none())
    }

    /// Whether the ring of `dart` passes a vertex or an edge twice, so that one cut may part that in more than two.
    pub(crate) fn meets_itself(&self, dart: Dart) -> bool {
        let label = |dart: Dart| self.label[VERTEX][dart.index()];
        let (next, after) = (self.beta1(dart), self.beta1(self.beta1(dart)));
        if after == dart {
            return true;
        }
        if self.beta1(after) == dart {
            let [a, b, c] = [dart, next, after].map(label);
            return a == b || b == c || c == a;
        }
        self.ring(dart).any(|dart| {
            let mut others = self
                .ring(self.beta1(dart))
                .take_while(|&other| other != dart);
            others.any(|other| label(other) == label(dart))
        })
    }
}
