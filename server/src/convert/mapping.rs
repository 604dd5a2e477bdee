//! How the points drive the mesh.

use sinew_engine::{
    Filter, Kernel, Mapping, Polynomial, RadialBasis, RadialFunction, Recipe, Rule, Weighting,
};
use sinew_proto::v1;

use super::{Result, known, reals};

/// The points that a vertex keeps where the scene does not say.
const DEFAULT_KEEP: usize = 8;
/// The same where four of them have to span a volume: the nearest few may lie in a plane.
const DEFAULT_CANDIDATES: usize = 32;

/// Reads a mapping.
pub(crate) fn mapping(mapping: v1::Mapping) -> Result<Mapping> {
    let rule = match mapping.rule.and_then(|rule| rule.kind) {
        Some(kind) => rule(kind)?,
        None => Rule::WeightedMean,
    };
    Ok(Mapping {
        recipe: Recipe {
            weighting: weighting(mapping.weighting.and_then(|weighting| weighting.kind))?,
            filter: filter(mapping.filter.and_then(|filter| filter.kind), &rule),
            rule,
        },
        points: mapping.points,
    })
}

fn weighting(kind: Option<v1::weighting::Kind>) -> Result<Weighting> {
    let distance = match kind {
        Some(v1::weighting::Kind::Distance(distance)) => distance,
        None => v1::DistanceWeighting::default(),
    };
    let kernel =
        match known::<v1::Kernel>(distance.kernel, "scene.mapping.weighting.distance.kernel")? {
            v1::Kernel::Unspecified | v1::Kernel::Gaussian => Kernel::Gaussian,
            v1::Kernel::InverseSquare => Kernel::InverseSquare,
        };
    Ok(Weighting::Distance {
        kernel,
        scale: given(distance.scale),
        coefficients: reals(
            distance.coefficients.as_ref(),
            "scene.mapping.weighting.distance.coefficients",
        )?,
    })
}

fn filter(kind: Option<v1::filter::Kind>, rule: &Rule) -> Filter {
    use v1::filter::Kind;
    let default = match rule {
        Rule::RadialBasis(_) => usize::MAX,
        Rule::Barycentric => DEFAULT_CANDIDATES,
        Rule::Direct
        | Rule::Mean
        | Rule::WeightedMean
        | Rule::ShapeMatching
        | Rule::LinearShapeMatching { .. }
        | Rule::QuadraticShapeMatching { .. } => DEFAULT_KEEP,
    };
    let count = |k: u32| if k > 0 { k as usize } else { default };
    match kind {
        Some(Kind::Keep(keep)) => Filter::KeepK(count(keep.k)),
        Some(Kind::Minimum(_)) => Filter::KeepK(1),
        Some(Kind::Interval(v1::Interval { nearest, farthest })) => {
            Filter::Interval { nearest, farthest }
        }
        Some(Kind::KeepAtLeast(v1::KeepAtLeast { k, within })) => Filter::KeepAtLeast {
            k: count(k),
            within,
        },
        None => Filter::KeepK(default),
    }
}

fn rule(kind: v1::motion_rule::Kind) -> Result<Rule> {
    use v1::motion_rule::Kind;
    Ok(match kind {
        Kind::Direct(_) => Rule::Direct,
        Kind::Mean(_) => Rule::Mean,
        Kind::WeightedMean(_) => Rule::WeightedMean,
        Kind::Barycentric(_) => Rule::Barycentric,
        Kind::ShapeMatching(_) => Rule::ShapeMatching,
        Kind::LinearShapeMatching(linear) => Rule::LinearShapeMatching {
            beta: linear.beta.unwrap_or(1.0),
        },
        Kind::QuadraticShapeMatching(quadratic) => Rule::QuadraticShapeMatching {
            beta: quadratic.beta.unwrap_or(1.0),
        },
        Kind::RadialBasis(basis) => Rule::RadialBasis(radial_basis(&basis)?),
    })
}

fn radial_basis(basis: &v1::RadialBasis) -> Result<RadialBasis> {
    use v1::RadialFunction as Given;
    const FIELD: &str = "scene.mapping.rule.radial_basis";
    let function = match known::<Given>(basis.function, &format!("{FIELD}.function"))? {
        Given::Gaussian => RadialFunction::Gaussian,
        Given::ShiftedLog => RadialFunction::ShiftedLog,
        Given::Multiquadric => RadialFunction::Multiquadric,
        Given::InverseMultiquadric => RadialFunction::InverseMultiquadric,
        Given::InverseQuadratic => RadialFunction::InverseQuadratic,
        Given::Wendland => RadialFunction::Wendland,
        Given::ThinPlate => RadialFunction::ThinPlate,
        Given::Unspecified | Given::Cubic => RadialFunction::Cubic,
        Given::Linear => RadialFunction::Linear,
    };
    let polynomial =
        match known::<v1::Polynomial>(basis.polynomial, &format!("{FIELD}.polynomial"))? {
            v1::Polynomial::None => Polynomial::None,
            v1::Polynomial::Constant => Polynomial::Constant,
            v1::Polynomial::Unspecified | v1::Polynomial::Linear => Polynomial::Linear,
        };
    Ok(RadialBasis {
        function,
        scale: given(basis.scale),
        polynomial,
    })
}

/// A number for which 0 stands for the default.
fn given(number: f64) -> Option<f64> {
    (number != 0.0).then_some(number)
}
