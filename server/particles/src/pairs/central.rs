use nalgebra::Vector3;

use super::{
    apart,
    law::{Ending, Law, RadialLaw},
    spec::EndingKind,
    table::Table,
};
use crate::rows::{Rows, for_each_block};

/// A law of the distance alone, exact or tabulated.
#[derive(Clone, Debug)]
pub(super) enum Central {
    Exact(Law),
    Table(Table),
}

impl Central {
    /// `table` is the error of a table, if there is to be one.
    pub(super) fn ending(
        law: Law,
        reach: f64,
        ending: EndingKind,
        table: Option<f64>,
    ) -> Ending<Self> {
        let law = match table {
            None => Self::Exact(law),
            Some(error) => Self::Table(Table::new(law, reach.min(law.range()), error)),
        };
        match ending {
            EndingKind::Shifted if reach.is_finite() => Ending::shifted(law, reach),
            EndingKind::Shifted | EndingKind::Sharp => Ending::sharp(law, reach),
        }
    }
}

impl RadialLaw for Central {
    fn force(&self, r: f64) -> f64 {
        match self {
            Self::Exact(law) => law.force(r),
            Self::Table(law) => law.force(r),
        }
    }

    fn slope(&self, r: f64) -> f64 {
        match self {
            Self::Exact(law) => law.slope(r),
            Self::Table(law) => law.slope(r),
        }
    }

    fn energy(&self, r: f64) -> f64 {
        match self {
            Self::Exact(law) => law.energy(r),
            Self::Table(law) => law.energy(r),
        }
    }

    fn core(&self) -> f64 {
        match self {
            Self::Exact(law) => law.core(),
            Self::Table(law) => law.core(),
        }
    }
}

/// Adds the forces of any law: one branch for all pairs.
pub(super) fn add_forces(
    ending: &Ending<Central>,
    rows: &Rows<u32>,
    position: &[Vector3<f64>],
    force: &mut [Vector3<f64>],
) {
    match &ending.law {
        Central::Exact(Law::LennardJones(law)) => {
            add_radial(&ending.of(*law), rows, position, force)
        }
        Central::Exact(Law::TwelveSix(law)) => add_radial(&ending.of(*law), rows, position, force),
        Central::Exact(Law::Cohesion(law)) => add_radial(&ending.of(*law), rows, position, force),
        Central::Table(law) => add_radial(&ending.of(law), rows, position, force),
    }
}

/// Adds the forces of a radial law in rows of places.
pub(super) fn add_radial<L: RadialLaw>(
    law: &Ending<L>,
    rows: &Rows<u32>,
    position: &[Vector3<f64>],
    force: &mut [Vector3<f64>],
) {
    for_each_block(force, |first, force| {
        let mut near = Near::new();
        for (a, row) in rows.of_block(first) {
            let mut own = Vector3::zeros();
            for row in row.chunks(BATCH) {
                for (b, push) in near.pushes(law, position, a, row) {
                    own -= push;
                    // A partner of another block has its own row.
                    if let Some(other) = force.get_mut(b.wrapping_sub(first)) {
                        *other += push;
                    }
                }
            }
            force[a - first] += own;
        }
    });
}

/// Pairs of one row that are weighed at once.
const BATCH: usize = 256;

/// Those of a batch of pairs that are within reach: picked without a branch, which no processor would foresee, so that
/// the law is one tight loop over them.
struct Near {
    partner: [u32; BATCH],
    r: [Vector3<f64>; BATCH],
    /// Squared distances, m², then force over distance, N/m.
    strength: [f64; BATCH],
}

impl Near {
    fn new() -> Self {
        Self {
            partner: [0; BATCH],
            r: [Vector3::zeros(); BATCH],
            strength: [0.0; BATCH],
        }
    }

    /// What a particle does to those of at most [`BATCH`] others that are within reach, N.
    #[inline]
    fn pushes<L: RadialLaw>(
        &mut self,
        law: &Ending<L>,
        position: &[Vector3<f64>],
        a: usize,
        row: &[u32],
    ) -> impl Iterator<Item = (usize, Vector3<f64>)> {
        let [nearest, farthest] = [law.core * law.core, law.reach * law.reach];
        let at = position[a];
        let mut count = 0;
        for &b in row {
            let mut r = position[b as usize] - at;
            let mut square = r.norm_squared();
            if square < nearest {
                r = apart(r, a, b as usize, law.core);
                square = nearest;
            }
            self.partner[count] = b;
            self.r[count] = r;
            self.strength[count] = square;
            count += usize::from(square < farthest);
        }
        let strength = &mut self.strength[..count];
        law.weigh(strength);
        (self.partner[..count].iter().zip(&self.r))
            .zip(strength)
            .map(|((&b, r), strength)| (b as usize, r * *strength))
    }
}
