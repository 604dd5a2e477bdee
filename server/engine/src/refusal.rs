//! Which field of a scene a mapping was refused for.

use sinew_mapping::MappingError;

use crate::scene::{Cost, Filter, Fit, Mapping, Metric, Rule, SceneError, ShapeMatching};

/// The kernel's errors name the value and the remedy themselves.
pub(crate) fn mapping_refusal(mapping: &Mapping, error: &MappingError) -> SceneError {
    SceneError {
        reason: "MAPPING_REFUSED",
        field: format!("scene.mapping{}", field(mapping, error)),
        message: error.to_string(),
    }
}

fn field(mapping: &Mapping, error: &MappingError) -> String {
    let recipe = &mapping.recipe;
    match error {
        MappingError::NoUsablePoint { .. } => ".points".to_owned(),
        MappingError::Coefficient { point, .. } => {
            format!(".weighting.coefficients[{point}]")
        }
        MappingError::Length {
            what: "coefficients",
            ..
        } => ".weighting.coefficients".to_owned(),
        MappingError::Scale { scale }
            if recipe.weighting.scale.map(f64::to_bits) == Some(scale.to_bits()) =>
        {
            format!("{}.scale", metric(&recipe.weighting.metric))
        }
        MappingError::Scale { .. } => format!("{}.scale", rule(&recipe.rule)),
        MappingError::KeepsNone
        | MappingError::Interval { .. }
        | MappingError::Bound { .. }
        | MappingError::KeepsNoneAt { .. }
        | MappingError::SpansNone { .. }
        | MappingError::TooLarge { .. } => filter(&recipe.filter).to_owned(),
        MappingError::Unreached { .. } => ".weighting.flood.roots".to_owned(),
        MappingError::Arcs => ".weighting.flood.arcs".to_owned(),
        MappingError::Radius { .. } => ".weighting.flood.ball.radius".to_owned(),
        MappingError::Node { .. } | MappingError::Cost { .. } => cost(&recipe.weighting.metric),
        MappingError::NoTargets { .. } => ".weighting.targets".to_owned(),
        MappingError::Beta { .. } => format!("{}.beta", rule(&recipe.rule)),
        MappingError::Polynomial { .. } => format!("{}.polynomial", rule(&recipe.rule)),
        MappingError::Flat { .. }
        | MappingError::ManyPoints { .. }
        | MappingError::Condition { .. }
        | MappingError::Overflow { .. } => rule(&recipe.rule).to_owned(),
        MappingError::Length { .. } | MappingError::Coordinate { .. } => String::new(),
    }
}

fn metric(metric: &Metric) -> &'static str {
    match metric {
        Metric::Straight => ".weighting.distance",
        Metric::Paths(_) | Metric::Geodesics(_) => ".weighting.flood",
    }
}

fn cost(metric: &Metric) -> String {
    let Metric::Paths(paths) = metric else {
        return String::new();
    };
    let name = match paths.cost {
        Cost::Hops => "hops",
        Cost::Length => "length",
        Cost::Volume => "volume",
        Cost::Curvature(_) => "curvature",
        Cost::Column(_) => "column",
    };
    format!(".weighting.flood.{name}")
}

fn filter(filter: &Filter) -> &'static str {
    match filter {
        Filter::KeepK(_) => ".filter.keep",
        Filter::Interval { .. } => ".filter.interval",
        Filter::KeepAtLeast { .. } => ".filter.keep_at_least",
        Filter::InVolume => ".filter.in_volume",
        Filter::FourSpanning { .. } => ".filter.four_spanning",
        Filter::Sequence(_) => ".filter.sequence",
    }
}

fn rule(rule: &Rule) -> &'static str {
    match rule {
        Rule::Direct => ".rule.direct",
        Rule::Mean => ".rule.mean",
        Rule::WeightedMean => ".rule.weighted_mean",
        Rule::Barycentric => ".rule.barycentric",
        Rule::ShapeMatching(ShapeMatching { fit, .. }) => match fit {
            Fit::Rigid => ".rule.shape_matching",
            Fit::Linear { .. } => ".rule.linear_shape_matching",
            Fit::Quadratic { .. } => ".rule.quadratic_shape_matching",
        },
        Rule::MovingLeastSquares(_) => ".rule.moving_least_squares",
        Rule::RadialBasis(_) => ".rule.radial_basis",
    }
}
