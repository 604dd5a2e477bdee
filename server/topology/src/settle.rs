//! Cells follow β: each orbit gets one label, each label one orbit.

use crate::error::EditError;
use crate::map::SIDE;
use crate::orbit::LabelSet;
use crate::slots::NONE;
use crate::{AnyCell, Cell, Dart, Edit};

/// What happened to the labels of one dimension while its orbits were settled.
struct Claims {
    taken: LabelSet,
    /// Labels found in orbits that took another, with that other.
    passed: Vec<(u32, u32)>,
}

impl Edit<'_> {
    /// Settles what was linked, unless a face is open, or its sides are different.
    pub(crate) fn settle_pending(&mut self) -> Result<(), EditError> {
        if let Some(&dart) = self.headless.first() {
            return Err(EditError::OpenFace { dart });
        }
        if self.unsettled.is_empty() && self.unsettled_faces.is_empty() {
            return Ok(());
        }
        let map = &*self.map;
        let is_live = |dart: &Dart| map.dart_at(dart.index()).is_some();
        let differs = |dart: &&Dart| is_live(dart) && !map.runs_against_itself(**dart);
        if let Some(&dart) = self.unsettled.iter().find(differs) {
            return Err(EditError::SidesDiffer { dart });
        }
        let mut darts = std::mem::take(&mut self.unsettled);
        // Where rings are what they were, one dart tells of a face whether it faces the same one again.
        let are_rings_kept = darts.is_empty();
        for (face, was) in std::mem::take(&mut self.unsettled_faces) {
            if are_rings_kept && map.beta3(face) == was {
                continue;
            }
            for face in [Some(face), was].into_iter().flatten().filter(is_live) {
                let ring = map.ring(face);
                darts.extend(
                    ring.flat_map(|dart| [Some(dart), map.beta3(dart)])
                        .flatten(),
                );
            }
        }
        darts.retain(is_live);
        self.settle(&darts, &[]);
        Ok(())
    }

    /// Settles all orbits through `darts`. `orphans` are cells, by dimension and label, that lost darts: one that no
    /// orbit has any more dies.
    ///
    /// Where an orbit fell in two, the part with the earlier of `darts` in it keeps the label. Of several labels in one
    /// orbit, the first met stays.
    pub(crate) fn settle(&mut self, darts: &[Dart], orphans: &[(usize, u32)]) {
        let mut settled = std::mem::take(&mut self.map.second_walk);
        let mut walk = std::mem::take(&mut self.map.walk);
        let mut claims = Claims {
            taken: std::mem::take(&mut settled.found),
            passed: Vec::new(),
        };
        for dimension in 0..4 {
            settled.restart(self.map);
            claims.passed.clear();
            // Every dart may become a cell.
            let most = self.map.slots[dimension].dart.len() + darts.len();
            claims.taken.restart(most);
            let mut faces = Vec::new();
            for &dart in darts {
                if settled.has(dart) {
                    continue;
                }
                walk.collect(self.map, dimension, dart);
                walk.darts().iter().for_each(|&dart| settled.push(dart));
                let label = self.claim(dimension, walk.darts(), &mut claims);
                if dimension == 2 {
                    // All are looked at before any is relabelled: sides that part still share what is said of them.
                    faces.push(self.relabelling(dart, label));
                }
                self.relabel(dimension, walk.darts(), label);
            }
            for face in faces {
                self.relabel_sides(face);
            }
            for &(label, heir) in &claims.passed {
                let is_dead = self.map.slots[dimension].dart[label as usize].is_none();
                if !is_dead && !claims.taken.has(label) {
                    self.bury(dimension, label, Some(heir));
                }
            }
            for &(_, label) in orphans.iter().filter(|(of, _)| *of == dimension) {
                let is_dead = self.map.slots[dimension].dart[label as usize].is_none();
                if !is_dead && !claims.taken.has(label) {
                    self.bury(dimension, label, None);
                }
            }
        }
        settled.found = claims.taken;
        self.map.second_walk = settled;
        self.map.walk = walk;
    }

    /// The label for an orbit: the first of its own that no other has taken, or a new one.
    fn claim(&mut self, dimension: usize, orbit: &[Dart], claims: &mut Claims) -> u32 {
        let mut chosen = NONE;
        let mut parent = NONE;
        let mut last = NONE;
        for &dart in orbit {
            let label = self.map.label_in(dimension, dart);
            if label == last || label == NONE {
                continue;
            }
            last = label;
            if parent == NONE {
                parent = label;
            }
            if chosen == NONE && claims.taken.insert(label) {
                chosen = label;
            } else if chosen != label {
                claims.passed.push((label, chosen));
            }
        }
        if chosen == NONE {
            let parent = (parent != NONE).then(|| AnyCell::of(dimension, parent));
            chosen = self.bear(dimension, parent, orbit[0]);
            claims.taken.insert(chosen);
        }
        // Whoever was passed before a label was chosen has its heir now.
        for (_, heir) in claims.passed.iter_mut().rev() {
            if *heir != NONE {
                break;
            }
            *heir = chosen;
        }
        chosen
    }

    fn relabel(&mut self, dimension: usize, orbit: &[Dart], label: u32) {
        let stands_for = self.map.slots[dimension].dart[label as usize];
        let mut candidates = orbit.iter();
        let end = match dimension {
            1 => candidates.find(|&&dart| self.map.beta3(dart).is_none()),
            _ => None,
        };
        let may_stand = |dart: Dart| match end {
            Some(_) => self.map.beta3(dart).is_none() && orbit.contains(&dart),
            None => orbit.contains(&dart),
        };
        if !stands_for.is_some_and(may_stand) {
            let dart = *end.unwrap_or(&orbit[0]);
            self.map.set_cell_dart(dimension, label, Some(dart));
        }
        match dimension {
            0 | 1 => {
                for &dart in orbit {
                    if self.map.label[dimension][dart.index()] != label {
                        self.map.set_label(dimension, dart, label);
                    }
                }
            }
            2 => {}
            _ => self.own_sides(orbit, Cell::new(label)),
        }
    }

    /// Which sides the rings of the face of `dart` get, with their volumes.
    fn relabelling(&self, dart: Dart, face: u32) -> [(u32, Option<Dart>, u32); 2] {
        let side = match self.map.label[SIDE][dart.index()] {
            side if side / 2 == face => side,
            _ => 2 * face,
        };
        [(side, Some(dart)), (side ^ 1, self.map.beta3(dart))].map(|(side, ring)| {
            let volume = ring.map_or(NONE, |dart| self.map.label_in(3, dart));
            (side, ring, volume)
        })
    }

    fn relabel_sides(&mut self, rings: [(u32, Option<Dart>, u32); 2]) {
        for (side, ring, volume) in rings {
            self.map.set_side_volume(side, volume);
            let Some(ring) = ring else { continue };
            let darts: Vec<_> = self.map.ring(ring).collect();
            for dart in darts {
                if self.map.label[SIDE][dart.index()] != side {
                    self.map.set_label(SIDE, dart, side);
                }
            }
        }
    }
}

impl crate::Map {
    /// Whether β1∘β3 is an involution at `dart`, or its β3 is free.
    fn runs_against_itself(&self, dart: Dart) -> bool {
        let Some(facing) = self.beta3(dart) else {
            return true;
        };
        let beyond = self.beta3(self.beta1(dart));
        beyond.is_some_and(|beyond| self.beta1(beyond) == facing)
    }
}
