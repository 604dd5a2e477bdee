//! Measures on the physical side: the distances of points.

use nalgebra::Vector3;

use super::{
    latch::{Latch, Reading},
    standing::Standing,
};
use crate::rule::Strain;

/// One rule's watch over pairs of points.
#[derive(Clone, Debug)]
pub(crate) struct PairGauge {
    strain: Strain,
    latch: Latch,
    /// With the distance at rest, m.
    pairs: Vec<([u32; 2], f64)>,
    /// Which crossed and have not come back.
    spent: Vec<bool>,
}

/// Which pair crosses.
pub(crate) struct PairCrossing {
    pub(crate) points: [u32; 2],
    pub(crate) measured: f64,
}

impl PairGauge {
    /// The pairs must be apart at rest.
    pub(crate) fn new(
        strain: Strain,
        latch: Latch,
        pairs: Vec<[u32; 2]>,
        rest: &[Vector3<f64>],
    ) -> Self {
        let sized = |ends| (ends, distance(rest, ends));
        Self {
            strain,
            latch,
            spent: vec![false; pairs.len()],
            pairs: pairs.into_iter().map(sized).collect(),
        }
    }

    /// Measures a step; the pairs that cross come in the rule's order. `[E3]`
    pub(crate) fn measure(
        &mut self,
        points: &[Vector3<f64>],
        standing: &[Standing],
    ) -> Reading<PairCrossing> {
        let Latch { threshold, rearm } = self.latch;
        let (mut greatest, mut crossings) = (None, Vec::new());
        for (&(ends, rest), spent) in self.pairs.iter().zip(&mut self.spent) {
            let measured = self.strain.of(distance(points, ends) / rest);
            let [a, b] = ends.map(|point| standing[point as usize]);
            let worth = a.max(b);
            if worth == Standing::Seen {
                greatest = Some(greatest.map_or(measured, |greatest: f64| greatest.max(measured)));
            }
            match worth {
                Standing::Unseen => {}
                Standing::Regained => *spent |= measured >= threshold,
                Standing::Seen if measured >= threshold => {
                    if !*spent {
                        let points = ends;
                        crossings.push(PairCrossing { points, measured });
                    }
                    *spent = true;
                }
                Standing::Seen => *spent &= measured >= rearm,
            }
        }
        Reading {
            greatest,
            crossings,
        }
    }

    pub(crate) fn spent(&self) -> &[bool] {
        &self.spent
    }
}

fn distance(x: &[Vector3<f64>], [a, b]: [u32; 2]) -> f64 {
    (x[a as usize] - x[b as usize]).norm()
}
