//! When the motion changes the mesh.

use nalgebra::Vector3;
use sinew_engine::{Action, Limits, Measure, Pairs, Region, Strain, TopologyRule};
use sinew_proto::v1;

use super::{Result, indices, known, missing};
use crate::error::invalid;

/// Reads a rule.
pub(super) fn rule(index: usize, rule: v1::TopologyRule) -> Result<TopologyRule> {
    let field = format!("scene.rules[{index}]");
    let limits = rule.limits.unwrap_or_default();
    let action = rule.action.and_then(|action| action.kind);
    Ok(TopologyRule {
        measure: measure(rule.measure, &format!("{field}.measure"))?,
        threshold: rule.threshold,
        hysteresis: rule.hysteresis,
        limits: self::limits(limits, &format!("{field}.limits"))?,
        action: match action {
            None | Some(v1::action::Kind::Report(_)) => Action::Report,
            Some(v1::action::Kind::Separate(_)) => Action::Separate,
            Some(v1::action::Kind::Open(_)) => Action::Open,
            Some(v1::action::Kind::Remove(_)) => Action::Remove,
            Some(v1::action::Kind::Subdivide(_)) => Action::Subdivide,
            Some(v1::action::Kind::Glue(_)) => Action::Glue,
        },
    })
}

fn measure(measure: Option<v1::Measure>, field: &str) -> Result<Measure> {
    use v1::measure::Kind;
    let part = |part: v1::PartMeasure, name: &str| strain(part.strain, &format!("{field}.{name}"));
    let kind = measure.and_then(|measure| measure.kind).ok_or_else(|| {
        missing(
            field,
            "give `points`, `edges`, `faces`, `volumes`, `fit` or `gaps`",
        )
    })?;
    Ok(match kind {
        Kind::Points(points) => Measure::Points {
            strain: strain(points.strain, &format!("{field}.points"))?,
            pairs: if points.pairs.is_empty() {
                Pairs::Within(points.within)
            } else {
                let pairs = points.pairs.into_iter();
                Pairs::Named(pairs.map(|v1::PointPair { a, b }| [a, b]).collect())
            },
        },
        Kind::Edges(given) => Measure::Edges(part(given, "edges")?),
        Kind::Faces(given) => Measure::Faces(part(given, "faces")?),
        Kind::Volumes(given) => Measure::Volumes(part(given, "volumes")?),
        Kind::Fit(_) => Measure::Fit,
        Kind::Gaps(_) => Measure::Gaps,
    })
}

fn strain(number: i32, field: &str) -> Result<Strain> {
    Ok(
        match known::<v1::Strain>(number, &format!("{field}.strain"))? {
            v1::Strain::Unspecified | v1::Strain::Elongation => Strain::Elongation,
            v1::Strain::Compression => Strain::Compression,
        },
    )
}

fn limits(limits: v1::Limits, field: &str) -> Result<Limits> {
    let corner = |corner: Option<v1::Vector3>, name: &str| -> Result<Vector3<f64>> {
        let v1::Vector3 { x, y, z } = corner.ok_or_else(|| {
            let field = format!("{field}.region.{name}");
            missing(&field, "give both corners")
        })?;
        Ok(Vector3::new(x, y, z))
    };
    let region = |v1::Region { min, max }| -> Result<Region> {
        Ok(Region {
            min: corner(min, "min")?,
            max: corner(max, "max")?,
        })
    };
    let ends = indices(limits.seam.as_ref(), &format!("{field}.seam"))?;
    let (seam, odd) = ends.as_chunks::<2>();
    if !odd.is_empty() {
        let problem = format!("has {} numbers", ends.len());
        let remedy = "give two cells for each face";
        return Err(invalid(
            "LENGTH_MISMATCH",
            format!("{field}.seam"),
            problem,
            remedy,
        ));
    }
    Ok(Limits {
        region: limits.region.map(region).transpose()?,
        from: limits.from_seconds,
        until: limits.until_seconds,
        seam: seam.to_vec(),
    })
}
