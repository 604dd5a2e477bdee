//! What crosses a threshold, and when it may cross again.

use std::collections::BTreeSet;

use sinew_mesh::Cell;

use super::{cells::Moment, standing::Standing};

/// A threshold, and the level below which what crossed it may cross again. `[E3]`
#[derive(Clone, Copy, Debug)]
pub(crate) struct Latch {
    pub(crate) threshold: f64,
    pub(crate) rearm: f64,
}

/// What a rule measured at a step.
pub(crate) struct Reading<Crossing> {
    /// The greatest of all, whether it crosses or not.
    pub(crate) greatest: Option<f64>,
    pub(crate) crossings: Vec<Crossing>,
}

/// A cell that crosses.
pub(crate) struct CellCrossing {
    /// By slot.
    pub(crate) cell: u32,
    pub(crate) measured: f64,
}

impl Latch {
    /// Tells which of `cells` cross at this step, and keeps in `spent` those that did and have not come back. `[E3]`
    ///
    /// A cell that is moved by points not seen measures nothing. One beyond the threshold as its points are
    /// believed again does not cross, and cannot until it has come back.
    pub(crate) fn turn(
        self,
        cells: &[u32],
        spent: &mut BTreeSet<u32>,
        measured: impl Fn(&Cell<'_>) -> Option<f64>,
        moment: &Moment<'_>,
    ) -> Vec<CellCrossing> {
        let mut crossings = Vec::new();
        for &cell in cells {
            let form = moment.scale.cells.cell(cell as usize);
            let Some(measured) = measured(&form) else {
                continue;
            };
            if measured >= self.threshold {
                if spent.contains(&cell) {
                    continue;
                }
                match standing(&form, moment) {
                    Standing::Seen => crossings.push(CellCrossing { cell, measured }),
                    Standing::Unseen => continue,
                    Standing::Regained => {}
                }
                spent.insert(cell);
            } else if measured < self.rearm && standing(&form, moment) == Standing::Seen {
                spent.remove(&cell);
            }
        }
        crossings
    }
}

/// What a cell's measure is worth: no more than the least of the points that move its vertices.
fn standing(cell: &Cell<'_>, moment: &Moment<'_>) -> Standing {
    let rows = cell.vertices.iter();
    let acting = rows.flat_map(|&vertex| moment.scale.binding.weights(vertex as usize));
    let points = acting.filter(|(_, weight)| *weight != 0.0);
    let standings = points.map(|(point, _)| moment.standing[point as usize]);
    standings.max().unwrap_or(Standing::Seen)
}
