//! Measures of a step: how far the mesh and its points depart from rest, against thresholds. Read-only but for what keeps
//! a threshold from being crossed twice.

mod cells;
mod fit;
mod gaps;
mod latch;
mod parts;
mod points;
mod standing;

pub(crate) use cells::{CellGauge, Moment, Scale, Turn};
pub(crate) use fit::FitGauge;
pub(crate) use gaps::{GapCrossing, GapGauge};
pub(crate) use latch::{CellCrossing, Latch};
pub(crate) use parts::Kind;
pub(crate) use points::{PairCrossing, PairGauge};
pub(crate) use standing::Standings;

use latch::Reading;

use crate::digest::Digest;

/// One rule's watch.
#[derive(Clone, Debug)]
pub(crate) enum Gauge {
    Pairs(PairGauge),
    Cells(CellGauge),
    Fit(FitGauge),
    Gaps(GapGauge),
}

/// What crosses a rule's threshold at a step.
pub(crate) enum Crossings {
    Pairs(Vec<PairCrossing>),
    Cells(Vec<CellCrossing>),
    Gaps(Vec<GapCrossing>),
}

impl Gauge {
    /// Measures a step: the greatest of all, of gaps the least, and what crosses. `[E3]`
    pub(crate) fn measure(&mut self, moment: &Moment<'_>) -> (Option<f64>, Crossings) {
        let cells = |reading: Reading<_>| (reading.greatest, Crossings::Cells(reading.crossings));
        match self {
            Self::Pairs(gauge) => {
                let reading = gauge.measure(moment.points, moment.standing);
                (reading.greatest, Crossings::Pairs(reading.crossings))
            }
            Self::Cells(gauge) => cells(gauge.measure(moment)),
            Self::Fit(gauge) => cells(gauge.measure(moment)),
            Self::Gaps(gauge) => {
                let reading = gauge.measure(moment);
                (reading.greatest, Crossings::Gaps(reading.crossings))
            }
        }
    }

    /// Takes over a binding that changed.
    pub(crate) fn rebind(&mut self, scale: &Scale<'_>) {
        match self {
            Self::Cells(gauge) => gauge.rebind(scale),
            Self::Pairs(_) | Self::Fit(_) | Self::Gaps(_) => {}
        }
    }

    /// Takes over cells that changed.
    pub(crate) fn follow(&mut self, turn: &Turn<'_>, scale: &Scale<'_>) {
        match self {
            Self::Cells(gauge) => gauge.follow(turn, scale),
            Self::Fit(gauge) => gauge.follow(turn, scale),
            Self::Gaps(gauge) => gauge.follow(turn),
            Self::Pairs(_) => {}
        }
    }

    /// All of the past that the next measure depends on.
    pub(crate) fn digest(&self, digest: &mut Digest) {
        let spent = |cells: &mut dyn Iterator<Item = u32>| {
            let mut cells: Vec<u64> = cells.map(u64::from).collect();
            cells.sort_unstable();
            cells
        };
        match self {
            Self::Pairs(gauge) => {
                let bytes: Vec<u8> = gauge.spent().iter().map(|&spent| spent.into()).collect();
                digest.bytes(&bytes);
            }
            Self::Cells(gauge) => digest.words(&spent(&mut gauge.spent())),
            Self::Fit(gauge) => digest.words(&spent(&mut gauge.spent.iter().copied())),
            Self::Gaps(gauge) => digest.words(&gauge.state().collect::<Vec<_>>()),
        }
    }
}
