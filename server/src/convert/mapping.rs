//! How the points drive the mesh.

use sinew_engine::{
    Cost, Dimension, Filter, Fit, FitWeights, Geodesics, Kernel, Mapping, Metric, MovingFit, Paths,
    Polynomial, Preset, RadialBasis, RadialFunction, Recipe, Reference, Roots, Rule, ShapeMatching,
    Start, Weighting,
};
use sinew_proto::v1;

use crate::error::invalid;

use super::{Result, known, reals};

/// The points that a vertex keeps where the scene does not say.
const DEFAULT_KEEP: usize = 8;
/// The same where four of them have to span a volume: the nearest few may lie in a plane.
const DEFAULT_CANDIDATES: usize = 32;

/// Reads a mapping: a preset's, where it names one, with the fields that are set in its place.
pub(crate) fn mapping(mapping: v1::Mapping) -> Result<Mapping> {
    let preset = preset(mapping.preset)?.map(Preset::recipe);
    let (mut weights, mut kept, mut moves) = (None, None, None);
    if let Some(recipe) = preset {
        (weights, kept, moves) = (
            Some(recipe.weighting),
            Some(recipe.filter),
            Some(recipe.rule),
        );
    }
    let rule = match (mapping.rule.and_then(|rule| rule.kind), moves) {
        (Some(kind), _) => rule(kind)?,
        (None, moves) => moves.unwrap_or(Rule::WeightedMean),
    };
    let weighting = match (mapping.weighting, weights) {
        (None, Some(weights)) => weights,
        (given, _) => weighting(given.unwrap_or_default())?,
    };
    let filter = match (mapping.filter.and_then(|filter| filter.kind), kept) {
        (None, Some(kept)) => kept,
        (given, _) => filter(given, &rule),
    };
    Ok(Mapping {
        recipe: Recipe {
            weighting,
            filter,
            rule,
            reference: reference(mapping.reference)?,
        },
        points: mapping.points,
    })
}

fn preset(number: i32) -> Result<Option<Preset>> {
    Ok(match known::<v1::Preset>(number, "scene.mapping.preset")? {
        v1::Preset::Unspecified => None,
        v1::Preset::Mkn04 => Some(Preset::Mkn04),
        v1::Preset::Pka05 => Some(Preset::Pka05),
        v1::Preset::Mhtg05 => Some(Preset::Mhtg05),
        v1::Preset::Mhhr07 => Some(Preset::Mhhr07),
        v1::Preset::Rj07 => Some(Preset::Rj07),
        v1::Preset::Acf07 => Some(Preset::Acf07),
        v1::Preset::Sog08 => Some(Preset::Sog08),
        v1::Preset::Aow08 => Some(Preset::Aow08),
    })
}

fn reference(number: i32) -> Result<Reference> {
    Ok(
        match known::<v1::Reference>(number, "scene.mapping.reference")? {
            v1::Reference::Unspecified | v1::Reference::Initial => Reference::Initial,
            v1::Reference::Previous => Reference::Previous,
        },
    )
}

fn weighting(weighting: v1::Weighting) -> Result<Weighting> {
    use v1::weighting::Kind;
    const FIELD: &str = "scene.mapping.weighting";
    let v1::Weighting {
        kind,
        coefficients,
        targets,
    } = weighting;
    let targets = cells(targets, &format!("{FIELD}.targets"))?.unwrap_or_default();
    let (metric, law, scale, name) = match kind {
        None => (Metric::Straight, 0, 0.0, "distance"),
        Some(Kind::Distance(distance)) => {
            let v1::DistanceWeighting { kernel, scale } = distance;
            (Metric::Straight, kernel, scale, "distance")
        }
        Some(Kind::Flood(flood)) => {
            let (kernel, scale) = (flood.kernel, flood.scale);
            let metric = flooded(flood, targets, &format!("{FIELD}.flood"))?;
            (metric, kernel, scale, "flood")
        }
    };
    Ok(Weighting {
        metric,
        targets,
        kernel: kernel(law, &format!("{FIELD}.{name}.kernel"))?,
        scale: given(scale),
        coefficients: reals(coefficients.as_ref(), &format!("{FIELD}.coefficients"))?,
    })
}

fn kernel(number: i32, field: &str) -> Result<Kernel> {
    Ok(match known::<v1::Kernel>(number, field)? {
        v1::Kernel::Unspecified | v1::Kernel::Gaussian => Kernel::Gaussian,
        v1::Kernel::InverseSquare => Kernel::InverseSquare,
    })
}

fn cells(number: i32, field: &str) -> Result<Option<Dimension>> {
    Ok(match known::<v1::CellKind>(number, field)? {
        v1::CellKind::Unspecified => None,
        v1::CellKind::Vertex => Some(Dimension::Vertex),
        v1::CellKind::Edge => Some(Dimension::Edge),
        v1::CellKind::Face => Some(Dimension::Face),
        v1::CellKind::Volume => Some(Dimension::Volume),
    })
}

fn flooded(flood: v1::FloodWeighting, targets: Dimension, field: &str) -> Result<Metric> {
    use v1::flood_weighting::{Cost as GivenCost, Roots as GivenRoots};
    let arcs = cells(flood.arcs, &format!("{field}.arcs"))?;
    let roots = flood.roots.map(|roots| match roots {
        GivenRoots::Nearest(_) => Roots::Nearest,
        GivenRoots::Containing(_) => Roots::Containing,
        GivenRoots::Ball(ball) => Roots::Ball(ball.radius),
    });
    let cost = match flood.cost {
        Some(GivenCost::Geodesic(_)) => {
            if arcs.is_some() {
                let problem = "is given, and geodesics go along no arcs";
                let remedy = "leave it out, or choose another cost";
                return Err(invalid(
                    "MAPPING_REFUSED",
                    format!("{field}.arcs"),
                    problem,
                    remedy,
                ));
            }
            let start = start(flood.start, field)?.unwrap_or(Start::Distance);
            let roots = roots.unwrap_or(Roots::Containing);
            return Ok(Metric::Geodesics(Geodesics { roots, start }));
        }
        None | Some(GivenCost::Hops(_)) => Cost::Hops,
        Some(GivenCost::Length(_)) => Cost::Length,
        Some(GivenCost::Volume(_)) => Cost::Volume,
        Some(GivenCost::Curvature(curvature)) => Cost::Curvature(curvature.metres_per_radian),
        Some(GivenCost::Column(column)) => {
            Cost::Column(reals(Some(&column), &format!("{field}.column"))?)
        }
    };
    let start = start(flood.start, field)?.unwrap_or(match cost {
        Cost::Length | Cost::Curvature(_) => Start::Distance,
        Cost::Hops | Cost::Volume | Cost::Column(_) => Start::Zero,
    });
    Ok(Metric::Paths(Paths {
        arcs: arcs.unwrap_or(match targets {
            Dimension::Vertex => Dimension::Edge,
            Dimension::Edge => Dimension::Vertex,
            Dimension::Face => Dimension::Edge,
            Dimension::Volume => Dimension::Face,
        }),
        roots: roots.unwrap_or(Roots::Nearest),
        start,
        cost,
    }))
}

fn start(number: i32, field: &str) -> Result<Option<Start>> {
    Ok(
        match known::<v1::RootStart>(number, &format!("{field}.start"))? {
            v1::RootStart::Unspecified => None,
            v1::RootStart::Zero => Some(Start::Zero),
            v1::RootStart::Distance => Some(Start::Distance),
        },
    )
}

fn filter(kind: Option<v1::filter::Kind>, rule: &Rule) -> Filter {
    use v1::filter::Kind;
    let default = match rule {
        Rule::RadialBasis(_) => usize::MAX,
        Rule::Barycentric => DEFAULT_CANDIDATES,
        Rule::Direct
        | Rule::Mean
        | Rule::WeightedMean
        | Rule::ShapeMatching(_)
        | Rule::MovingLeastSquares(_) => DEFAULT_KEEP,
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
        Some(Kind::InVolume(_)) => Filter::InVolume,
        Some(Kind::FourSpanning(v1::FourSpanning { within })) => Filter::FourSpanning { within },
        Some(Kind::Sequence(sequence)) => {
            let stages = sequence.filters.into_iter();
            Filter::Sequence(stages.map(|stage| filter(stage.kind, rule)).collect())
        }
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
        Kind::ShapeMatching(rigid) => shape_matching(Fit::Rigid, rigid.weights, "shape_matching")?,
        Kind::LinearShapeMatching(linear) => {
            let beta = linear.beta.unwrap_or(1.0);
            let fit = Fit::Linear { beta };
            shape_matching(fit, linear.weights, "linear_shape_matching")?
        }
        Kind::QuadraticShapeMatching(quadratic) => {
            let beta = quadratic.beta.unwrap_or(1.0);
            let fit = Fit::Quadratic { beta };
            shape_matching(fit, quadratic.weights, "quadratic_shape_matching")?
        }
        Kind::RadialBasis(basis) => Rule::RadialBasis(radial_basis(&basis)?),
        Kind::MovingLeastSquares(moving) => Rule::MovingLeastSquares(moving_fit(moving.fit)?),
    })
}

fn shape_matching(fit: Fit, weights: i32, rule: &str) -> Result<Rule> {
    let field = format!("scene.mapping.rule.{rule}.weights");
    let weights = match known::<v1::FitWeights>(weights, &field)? {
        v1::FitWeights::Unspecified | v1::FitWeights::Alike => FitWeights::Alike,
        v1::FitWeights::ClusterMean => FitWeights::ClusterMean,
    };
    Ok(Rule::ShapeMatching(ShapeMatching { fit, weights }))
}

fn moving_fit(number: i32) -> Result<MovingFit> {
    let field = "scene.mapping.rule.moving_least_squares.fit";
    Ok(match known::<v1::MovingFit>(number, field)? {
        v1::MovingFit::Unspecified | v1::MovingFit::Affine => MovingFit::Affine,
        v1::MovingFit::Rigid => MovingFit::Rigid,
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
