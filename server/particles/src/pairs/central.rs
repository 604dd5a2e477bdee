use nalgebra::Vector3;

use super::{
    apart,
    law::{Ending, Law, RadialLaw},
    spec::EndingKind,
    table::Table,
};
use crate::rows::Rows;

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
    let end = law.reach * law.reach;
    let core = law.core * law.core;
    rows.add_pushes(force, |a, b| {
        let b = b as usize;
        let r = position[b] - position[a];
        let square = r.norm_squared();
        if square >= end {
            Vector3::zeros()
        } else if square >= core {
            r * law.over_distance(square)
        } else {
            apart(r, a, b, law.core) * law.over_distance(core)
        }
    });
}
