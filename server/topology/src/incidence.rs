//! Which cells bound, hold or touch a cell.

use crate::map::SIDE;
use crate::orbit::LabelSet;
use crate::slots::NONE;
use crate::{Cell, Dart, Dimension, Kind, Map, Walk};

impl Map {
    /// The `J`-cells incident to a cell, each once: those it is bounded by, or those it bounds. In no particular order.
    ///
    /// # Panics
    /// If the cell is dead.
    pub fn incident<'a, I: Kind, J: Kind>(
        &'a self,
        cell: Cell<I>,
        walk: &'a mut Walk,
    ) -> impl Iterator<Item = Cell<J>> + 'a {
        let mut found = std::mem::take(&mut walk.found);
        found.restart(self.slot_count::<J>());
        self.gather(
            I::DIMENSION,
            self.dart(cell),
            J::DIMENSION,
            walk,
            &mut found,
        );
        walk.found = found;
        walk.found.labels.iter().map(|&label| Cell::new(label))
    }

    /// The cells adjacent to a cell through `J`-cells, each once: those with which it has one in common. In no particular
    /// order, without the cell itself.
    ///
    /// # Panics
    /// If the cell is dead.
    pub fn adjacent<'a, I: Kind, J: Kind>(
        &'a self,
        cell: Cell<I>,
        walk: &'a mut Walk,
    ) -> impl Iterator<Item = Cell<I>> + 'a {
        let mut found = std::mem::take(&mut walk.found);
        found.restart(self.slot_count::<I>());
        let dart = self.dart(cell);
        match (I::DIMENSION, J::DIMENSION) {
            // No more than two cells meet there: the other one is near.
            (0, 1) => {
                for &dart in walk.collect(self, 0, dart) {
                    found.insert(self.head(dart).label());
                    if self.dimension == Dimension::Two {
                        // On a border, an edge may only come in.
                        found.insert(self.vertex(self.beta0(dart)).label());
                    }
                }
            }
            (3, 2) => {
                for &dart in walk.collect(self, 3, dart) {
                    let beyond = self.side_volume[(self.label[SIDE][dart.index()] ^ 1) as usize];
                    if beyond != NONE {
                        found.insert(beyond);
                    }
                }
            }
            _ => {
                let mut through = std::mem::take(&mut walk.through);
                through.restart(self.slot_count::<J>());
                self.gather(I::DIMENSION, dart, J::DIMENSION, walk, &mut through);
                for &label in &through.labels {
                    let between = self.dart(Cell::<J>::new(label));
                    self.gather(J::DIMENSION, between, I::DIMENSION, walk, &mut found);
                }
                walk.through = through;
            }
        }
        walk.found = found;
        let others = walk.found.labels.iter().map(|&label| Cell::new(label));
        others.filter(move |&other| other != cell)
    }

    /// Adds the labels of the `to`-cells incident to the `from`-cell of `dart` to `found`.
    pub(crate) fn gather(
        &self,
        from: usize,
        dart: Dart,
        to: usize,
        walk: &mut Walk,
        found: &mut LabelSet,
    ) {
        match (from, to) {
            (1, 0) => {
                found.insert(self.label_in(0, dart));
                found.insert(self.label_in(0, self.beta1(dart)));
            }
            (2, 0 | 1) => {
                for dart in self.ring(dart) {
                    found.insert(self.label_in(to, dart));
                }
            }
            (2, 3) => {
                found.insert(self.label_in(3, dart));
                if let Some(beyond) = self.beta3(dart) {
                    found.insert(self.label_in(3, beyond));
                }
            }
            _ => {
                walk.collect(self, from, dart);
                for &dart in walk.darts() {
                    found.insert(self.label_in(to, dart));
                }
                if (from, to, self.dimension) == (0, 1, Dimension::Two) {
                    // On a border, an edge may only come in.
                    for &dart in walk.darts() {
                        found.insert(self.label_in(1, self.beta0(dart)));
                    }
                }
            }
        }
    }
}
