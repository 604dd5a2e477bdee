//! Measures between the two sides of what came apart.

use std::collections::{BTreeMap, BTreeSet};

use sinew_tearing::Facet;

use super::{
    cells::{Moment, Turn},
    latch::Reading,
    standing::Standing,
};

/// One rule's watch over the faces that came apart.
#[derive(Clone, Debug)]
pub(crate) struct GapGauge {
    /// Sides this near or nearer are together, m.
    together: f64,
    /// Sides farther apart than this have parted, m.
    apart: f64,
    gaps: Vec<Gap>,
}

/// The two sides of a face.
#[derive(Clone, Debug)]
struct Gap {
    /// Vertices in the same place of both were one.
    sides: [Facet; 2],
    /// Whether they were apart since they were together.
    parted: bool,
}

/// Two sides that came together.
pub(crate) struct GapCrossing {
    pub(crate) sides: [Facet; 2],
    pub(crate) measured: f64,
}

impl GapGauge {
    pub(crate) fn new(together: f64, apart: f64) -> Self {
        let gaps = Vec::new();
        Self {
            together,
            apart,
            gaps,
        }
    }

    /// Measures a step; the least of all takes the place of the greatest. `[E5]` Gaps that points not seen move measure
    /// nothing.
    pub(crate) fn measure(&mut self, moment: &Moment<'_>) -> Reading<GapCrossing> {
        let (mut least, mut crossings) = (None, Vec::new());
        for Gap { sides, parted } in &mut self.gaps {
            let [here, there] = [&sides[0].vertices, &sides[1].vertices];
            if standing(here.iter().chain(there), moment) != Standing::Seen {
                continue;
            }
            let x = |vertex: u32| moment.vertices[vertex as usize];
            let distances = (here.iter().zip(there)).map(|(&a, &b)| (x(a) - x(b)).norm());
            let measured = distances.fold(0.0, f64::max);
            *parted |= measured > self.apart;
            if *parted {
                least = Some(least.map_or(measured, |least: f64| least.min(measured)));
            }
            if measured <= self.together && std::mem::take(parted) {
                let sides = sides.clone();
                crossings.push(GapCrossing { sides, measured });
            }
        }
        Reading {
            greatest: least,
            crossings,
        }
    }

    /// Takes over faces that came apart, together, or were divided: a part has parted if the whole has.
    pub(crate) fn follow(&mut self, turn: &Turn<'_>) {
        let mut cells: BTreeSet<u32> = turn.patch.slots.iter().copied().collect();
        cells.extend(turn.patch.seams.iter().flat_map(|seam| seam.cells));
        let mut parted = BTreeMap::<[u32; 2], bool>::new();
        for gap in &self.gaps {
            cells.extend(gap.sides.iter().map(|side| side.cell));
            *parted.entry(between(&gap.sides)).or_default() |= gap.parted;
        }
        let cells: Vec<u32> = cells.into_iter().collect();
        let was = |slot: u32| match (slot as usize) < turn.cells {
            true => slot,
            false => turn.parent(slot).unwrap_or(slot),
        };
        let gaps = turn.body.gaps(&cells).into_iter();
        let watched = gaps.filter(|sides| (turn.parts)(between(sides)));
        let known = watched.map(|sides| {
            let cells = between(&sides).map(was);
            let known = parted.get(&[cells[0].min(cells[1]), cells[0].max(cells[1])]);
            Gap {
                parted: known.copied().unwrap_or(false),
                sides,
            }
        });
        self.gaps = known.collect();
    }

    /// All of the past that the next measure depends on.
    pub(crate) fn state(&self) -> impl Iterator<Item = u64> {
        self.gaps.iter().map(|gap| gap.parted.into())
    }
}

/// The cells on both sides, the lower first.
fn between(sides: &[Facet; 2]) -> [u32; 2] {
    let [one, other] = [sides[0].cell, sides[1].cell];
    [one.min(other), one.max(other)]
}

/// What a gap's measure is worth: no more than the least of the points that move its vertices.
fn standing<'a>(vertices: impl Iterator<Item = &'a u32>, moment: &Moment<'_>) -> Standing {
    let binding = moment.scale.binding;
    let acting = vertices.flat_map(|&vertex| binding.weights(vertex as usize));
    let points = acting.filter(|(_, weight)| *weight != 0.0);
    let standings = points.map(|(point, _)| moment.standing[point as usize]);
    standings.max().unwrap_or(Standing::Seen)
}
