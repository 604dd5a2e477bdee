//! The strain of clusters: how badly their points fit a rigid motion.

use std::collections::BTreeSet;

use sinew_mesh::Cell;

use super::{
    cells::{Moment, Scale, Turn},
    latch::{CellCrossing, Latch, Reading},
};

/// One rule's watch over the fits that move the cells.
#[derive(Clone, Debug)]
pub(crate) struct FitGauge {
    latch: Latch,
    /// By slot, ascending.
    cells: Vec<u32>,
    /// Cells that crossed and have not come back, by slot.
    pub(crate) spent: BTreeSet<u32>,
}

impl FitGauge {
    pub(crate) fn new(latch: Latch, cells: Vec<u32>) -> Self {
        let spent = BTreeSet::new();
        Self {
            latch,
            cells,
            spent,
        }
    }

    /// Measures a step. `[E2]` `[E3]` The cells that cross come by slot, ascending; the greatest is of the whole mesh.
    pub(crate) fn measure(&mut self, moment: &Moment<'_>) -> Reading<CellCrossing> {
        let binding = moment.scale.binding;
        let strains = binding.strains(moment.points);
        let greatest = strains.iter().copied().reduce(f64::max);
        let crosses = greatest.is_some_and(|strain| strain >= self.latch.threshold);
        if !crosses && self.spent.is_empty() {
            let crossings = Vec::new();
            return Reading {
                greatest,
                crossings,
            };
        }
        let worst = |cell: &Cell<'_>| {
            let clusters = cell
                .vertices
                .iter()
                .filter_map(|&v| binding.cluster(v as usize));
            clusters
                .map(|cluster| strains[cluster as usize])
                .reduce(f64::max)
        };
        Reading {
            greatest,
            crossings: (self.latch).turn(&self.cells, &mut self.spent, worst, moment),
        }
    }

    /// Takes over cells that changed: those that came apart from others are watched like these.
    pub(crate) fn follow(&mut self, turn: &Turn<'_>, scale: &Scale<'_>) {
        for &slot in (turn.patch.slots.iter()).filter(|&&slot| slot as usize >= turn.cells) {
            let watched = match turn.parent(slot) {
                Some(parent) => self.cells.binary_search(&parent).is_ok(),
                None => (turn.admits)(slot),
            };
            if watched {
                self.cells.push(slot);
            }
            if turn
                .parent(slot)
                .is_some_and(|parent| self.spent.contains(&parent))
            {
                self.spent.insert(slot);
            }
        }
        let live = |slot: &u32| scale.cells.types[*slot as usize] != 0;
        self.cells.retain(live);
        self.spent.retain(live);
    }
}
