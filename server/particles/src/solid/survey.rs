use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    Dimension, Material, MaterialLaw, SolidSpec, graph::Places, stencil::Stencils,
    surroundings::Surroundings,
};
use crate::{SpecError, check};

/// Distance at which two particles are one, in spacings.
const TWINS: f64 = 1e-6;

/// What a cloud of points is like, before a solid is made of it with the defaults of all else.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// The least, the middle and the greatest spacing around a point, m. `[B3]`
    pub spacing: [f64; 3],
    /// Points in one place, the lower index first.
    pub twins: Vec<[u32; 2]>,
    /// How many points the pieces have that nothing holds together, the largest first.
    pub pieces: Vec<usize>,
    /// Points in pieces too small to resist in every direction; these are not among `pieces`.
    pub outliers: Vec<u32>,
    /// Other points whose neighbours show fewer directions than there are.
    pub sparse: Vec<u32>,
}

impl Survey {
    /// Looks at a cloud; `reach` in spacings.
    ///
    /// # Errors
    /// The first position that is not finite, or not in the plane, or a reach not above 1.
    pub fn new(
        positions: &[Vector3<f64>],
        dimension: Dimension,
        reach: f64,
    ) -> Result<Self, SpecError> {
        check::finite("positions", positions)?;
        let material = Material {
            young: 1.0,
            poisson: 0.0,
            law: MaterialLaw::Corotated,
        };
        let spec = SolidSpec {
            dimension,
            reach: super::Reach::Spacings(reach),
            ..SolidSpec::new(material, 1.0)
        };
        spec.check(positions)?;
        let places = Places::new(positions.to_vec());
        let mut spacings = places.spacings(dimension);
        let surroundings = Surroundings::new(&spec, places, &spacings);
        let stencils = Stencils::new(&surroundings);
        let twins = (0_u32..).zip(&spacings).collect::<Vec<_>>();
        let twins = twins.into_par_iter().flat_map_iter(|(i, spacing)| {
            let near = surroundings.places.near(i as usize, TWINS * spacing);
            let near = near.into_iter();
            near.filter(move |(j, _)| i < *j).map(move |(j, _)| [i, j])
        });
        let twins = twins.collect();
        let mut sizes = vec![0_usize; stencils.components()];
        for &piece in &stencils.pieces {
            sizes[piece as usize] += 1;
        }
        let all = dimension.count();
        let is_small = |i: usize| sizes[stencils.pieces[i] as usize] <= all + 1;
        let (mut outliers, mut sparse) = (Vec::new(), Vec::new());
        for (i, sight) in (0_u32..).zip(&stencils.sight) {
            if is_small(i as usize) {
                outliers.push(i);
            } else if sight.rank < all {
                sparse.push(i);
            }
        }
        let mut pieces: Vec<usize> = sizes.into_iter().filter(|&size| size > all + 1).collect();
        pieces.sort_unstable_by(|a, b| b.cmp(a));
        spacings.sort_unstable_by(f64::total_cmp);
        let at = |part: usize| {
            let last = spacings.len().saturating_sub(1);
            spacings.get(last * part / 2).copied().unwrap_or(0.0)
        };
        Ok(Self {
            spacing: [at(0), at(1), at(2)],
            twins,
            pieces,
            outliers,
            sparse,
        })
    }
}
