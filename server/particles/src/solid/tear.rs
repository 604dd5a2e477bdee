//! Solids that tear where they are stretched too far.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{Integration, Solid, graph::pair, surroundings::Surroundings};

/// What a solid keeps to find its neighbourhoods anew.
#[derive(Clone, Debug)]
pub(super) struct Tearing {
    surroundings: Surroundings,
    integration: Integration,
    /// Distance over that at rest beyond which two particles see each other no more.
    stretch: f64,
    /// Pairs parted so far, in their order, as numbers.
    pub(super) parted: Vec<f64>,
}

impl Tearing {
    pub(super) fn new(surroundings: Surroundings, integration: Integration, stretch: f64) -> Self {
        Self {
            surroundings,
            integration,
            stretch,
            parted: Vec::new(),
        }
    }
}

impl Solid {
    /// Parts for good every two particles of which one sees the other over more than the stretch that the solid bears, at
    /// positions, m. Neighbourhoods near them, and derivatives on these, are taken anew; volumes and masses stay. `[B14]`
    ///
    /// * returns the pairs, the lower index of each first, ascending; none where the solid does not tear.
    ///
    /// # Panics
    /// If there is not one position for each particle.
    pub fn tear(&mut self, position: &[Vector3<f64>]) -> Vec<[u32; 2]> {
        assert_eq!(position.len(), self.rest.len(), "one position for each");
        let Some(mut tearing) = self.tearing.take() else {
            return Vec::new();
        };
        let parted = self.overstretched(position, &tearing);
        if !parted.is_empty() {
            let touched = tearing.surroundings.sever(&parted);
            self.stencils.renew(&tearing.surroundings, &touched);
            match tearing.integration {
                Integration::Nodal => {}
                Integration::Consistent => {
                    self.stencils
                        .make_consistent(&self.rest, &self.volumes, &touched);
                }
            }
            let slots = self.stencils.other.len();
            self.pushes.resize(slots, Vector3::zeros());
            self.stiffness = self.greatest_stiffness();
            let ends = parted.iter().flatten();
            tearing.parted.extend(ends.map(|&end| f64::from(end)));
        }
        self.tearing = Some(tearing);
        parted
    }

    /// Indices of the pairs parted so far, one after the other, as numbers.
    pub(crate) fn parted(&self) -> &[f64] {
        self.tearing.as_ref().map_or(&[], |tearing| &tearing.parted)
    }

    /// Pairs that see each other, or might, whose distance is too much of that at rest.
    fn overstretched(&self, position: &[Vector3<f64>], tearing: &Tearing) -> Vec<[u32; 2]> {
        let stretch = tearing.stretch;
        let rows = (0..self.rest.len()).into_par_iter();
        let pairs = rows.flat_map_iter(|i| {
            let others = self.stencils.row(i).map(|slot| self.stencils.other[slot]);
            let others = others.chain(tearing.surroundings.bonds(i));
            let over = move |&other: &u32| {
                let j = other as usize;
                let [now, rest] = [position, &self.rest].map(|at| (at[j] - at[i]).norm_squared());
                // Twins have no length to be stretched from.
                rest > 0.0 && now > stretch * stretch * rest
            };
            let own = u32::try_from(i).expect("particles are counted in 32 bits");
            others.filter(over).map(move |other| pair(own, other))
        });
        let mut pairs: Vec<_> = pairs.collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}
