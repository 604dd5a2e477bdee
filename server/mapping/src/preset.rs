use crate::{
    Cost, Dimension, Filter, Fit, FitWeights, Metric, MovingFit, Paths, Recipe, Reference, Roots,
    Rule, ShapeMatching, Start, Weighting,
};

/// The points of a region of width 1 on a cubic lattice.
const REGION: usize = 27;
/// The neighbours that fix the width of a kernel in MKN04 and PKA05.
const NEIGHBOURS: usize = 10;

/// Methods of the literature, as the rows of 000, table 1.
///
/// Where the table leaves a number open, it is the method's own; distances that depend on the scene are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Müller et al. 2004: by distance, shape matching as moving least squares.
    Mkn04,
    /// Pauly et al. 2005: the same along the mesh.
    Pka05,
    /// Müller et al. 2005: the points in the volumes around, one rigid motion per set.
    Mhtg05,
    /// Müller et al. 2007: one point per vertex, direct.
    Mhhr07,
    /// Rivers and James 2007: by distance, one rigid motion per set.
    Rj07,
    /// Allard et al. 2007: four points that span a volume, barycentric.
    Acf07,
    /// Steinemann et al. 2008: by distance, one weighted rigid motion per set.
    Sog08,
    /// Adams et al. 2008: along the mesh, four points at least that span a volume, moving least squares.
    Aow08,
}

impl Preset {
    /// Every row, in the table's order.
    pub const ALL: [Self; 8] = [
        Self::Mkn04,
        Self::Pka05,
        Self::Mhtg05,
        Self::Mhhr07,
        Self::Rj07,
        Self::Acf07,
        Self::Sog08,
        Self::Aow08,
    ];

    /// What it does. Its reference is the initial frame.
    #[must_use]
    pub fn recipe(self) -> Recipe {
        let moving = Rule::MovingLeastSquares(MovingFit::Affine);
        let rigid = |weights| {
            let fit = Fit::Rigid;
            Rule::ShapeMatching(ShapeMatching { fit, weights })
        };
        let straight = Weighting::default();
        let (weighting, filter, rule) = match self {
            Self::Mkn04 => (straight, Filter::KeepK(NEIGHBOURS), moving),
            Self::Pka05 => (along(Cost::Length), Filter::KeepK(NEIGHBOURS), moving),
            Self::Mhtg05 => (
                along(Cost::Hops),
                Filter::InVolume,
                rigid(FitWeights::Alike),
            ),
            Self::Mhhr07 => (straight, Filter::KeepK(1), Rule::Direct),
            Self::Rj07 => (straight, Filter::KeepK(REGION), rigid(FitWeights::Alike)),
            Self::Acf07 => {
                let four = Filter::FourSpanning { within: 0.0 };
                (straight, four, Rule::Barycentric)
            }
            Self::Sog08 => {
                let weighted = rigid(FitWeights::ClusterMean);
                (straight, Filter::KeepK(REGION), weighted)
            }
            Self::Aow08 => {
                let four = Filter::FourSpanning { within: 0.0 };
                (along(Cost::Length), four, moving)
            }
        };
        Recipe {
            weighting,
            filter,
            rule,
            reference: Reference::Initial,
        }
    }
}

/// A flood over the vertices by their edges.
fn along(cost: Cost) -> Weighting {
    let (roots, start) = match cost {
        Cost::Length | Cost::Curvature(_) => (Roots::Nearest, Start::Distance),
        Cost::Hops | Cost::Volume | Cost::Column(_) => (Roots::Containing, Start::Zero),
    };
    Weighting {
        metric: Metric::Paths(Paths {
            arcs: Dimension::Edge,
            roots,
            start,
            cost,
        }),
        ..Weighting::default()
    }
}
