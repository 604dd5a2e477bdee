//! SessionService's UpdateMapping and Explain.

use std::sync::Arc;

use nalgebra::Vector3;
use prost::Message as _;
use sinew_engine::{Cluster, Explanation, Fit, Reference, Rule, ShapeMatching};
use sinew_proto::{FieldMask, v1};
use xxhash_rust::xxh3::xxh3_64;

use super::{
    Shared,
    session::{count, describe},
};
use crate::{
    change::{Effect, Remap},
    convert,
    error::{ServiceError, invalid},
    registry::Entry,
    session::Wish,
};

/// Hash of a mapping, by which a client says which one it changes.
pub(super) fn etag(mapping: &v1::Mapping) -> String {
    format!("{:016x}", xxh3_64(&mapping.encode_to_vec()))
}

impl Shared {
    pub(super) async fn remap(
        &self,
        request: v1::UpdateMappingRequest,
    ) -> Result<v1::Session, ServiceError> {
        let entry = self.registry.get(&request.name)?;
        loop {
            match self.try_remap(&entry, &request).await {
                // A tear came first: the mapping has to be bound to what it left.
                Err(ServiceError::MeshChanged) => {}
                // Another request came first. What it left may still be what this one wants to change.
                Err(ServiceError::EtagMismatch) if is_current(&entry, &request.etag).await? => {}
                answer => return answer,
            }
        }
    }

    async fn try_remap(
        &self,
        entry: &Entry,
        request: &v1::UpdateMappingRequest,
    ) -> Result<v1::Session, ServiceError> {
        let v1::UpdateMappingRequest {
            name: _,
            mapping,
            update_mask,
            etag: wanted,
            blend_seconds,
            validate_only,
        } = request;
        let report = entry.handle.ask(Wish::Describe).await?;
        let (base, rest) = (report.mapping, report.rest);
        if !(wanted.is_empty() || *wanted == etag(&base)) {
            return Err(ServiceError::EtagMismatch);
        }
        let update = mapping.clone().ok_or_else(|| {
            let remedy = "give the fields to change";
            invalid("FIELD_MISSING", "mapping", "is missing", remedy)
        })?;
        let mapping = Arc::new(merged(&base, update, update_mask.as_ref())?);
        let given = v1::Mapping::clone(&mapping);
        let bound = self
            .kernels
            .run(move || Ok(rest.bind(convert::mapping(given)?)?))
            .await
            .map_err(ServiceError::Internal)?
            .map_err(in_request)?;
        let effect = if *validate_only {
            Effect::Checked
        } else {
            Effect::Made
        };
        let wish = Wish::Remap(Box::new(Remap {
            base,
            mapping: Arc::clone(&mapping),
            bound,
            blend_seconds: *blend_seconds,
            effect,
        }));
        Ok(v1::Session {
            etag: etag(&mapping),
            mapping: Some(v1::Mapping::clone(&mapping)),
            ..describe(entry, wish).await?
        })
    }
}

/// Whether the session's mapping is the one of this etag. An empty one stands for any.
async fn is_current(entry: &Entry, wanted: &str) -> Result<bool, ServiceError> {
    let report = entry.handle.ask(Wish::Describe).await?;
    Ok(wanted.is_empty() || wanted == etag(&report.mapping))
}

/// `base` with the fields of `update` that the mask names, or that are set where it names none.
fn merged(
    base: &v1::Mapping,
    update: v1::Mapping,
    mask: Option<&FieldMask>,
) -> Result<v1::Mapping, ServiceError> {
    const FIELDS: [&str; 6] = [
        "weighting",
        "filter",
        "rule",
        "points",
        "reference",
        "preset",
    ];
    let paths = mask.map_or(&[][..], |mask| &mask.paths);
    let unknown = paths
        .iter()
        .find(|path| *path != "*" && !FIELDS.contains(&path.as_str()));
    if let Some(path) = unknown {
        let remedy = format!("name some of {}, or * for all", FIELDS.join(", "));
        let problem = format!("names `{path}`");
        return Err(invalid("FIELD_UNKNOWN", "update_mask", problem, remedy));
    }
    let replaced = |field: &str, set: bool| {
        let named = || paths.iter().any(|path| path == "*" || path == field);
        if paths.is_empty() { set } else { named() }
    };
    let v1::Mapping {
        weighting,
        filter,
        rule,
        points,
        reference,
        preset,
    } = update;
    let mut merged = base.clone();
    if replaced("weighting", weighting.is_some()) {
        merged.weighting = weighting;
    }
    if replaced("filter", filter.is_some()) {
        merged.filter = filter;
    }
    if replaced("rule", rule.is_some()) {
        merged.rule = rule;
    }
    if replaced("points", !points.is_empty()) {
        merged.points = points;
    }
    if replaced("reference", reference != 0) {
        merged.reference = reference;
    }
    if replaced("preset", preset != 0) {
        merged.preset = preset;
    }
    Ok(merged)
}

/// A refusal of a scene's mapping as one of this request's.
fn in_request(mut error: ServiceError) -> ServiceError {
    if let ServiceError::Invalid(invalid) = &mut error
        && let Some(field) = invalid.field.strip_prefix("scene.")
    {
        invalid.field = field.to_owned();
    }
    error
}

/// Why a vertex is where it is, with the points' labels.
pub(super) fn explanation(
    vertex: u32,
    explanation: Explanation,
    labels: &[String],
) -> v1::Explanation {
    let Explanation {
        rest,
        position,
        step,
        influences,
        rule,
        reference,
        cluster,
        changed_at_step,
        topology_step,
    } = explanation;
    let points = influences.iter().map(|influence| v1::Influence {
        label: labels[influence.point as usize].clone(),
        index: influence.point,
        weight: influence.weight,
        rest_distance: influence.rest_distance,
    });
    let cluster = cluster.map(
        |Cluster {
             first_vertex,
             vertices,
         }| v1::Cluster {
            first_vertex: count(first_vertex),
            vertex_count: count(vertices),
        },
    );
    v1::Explanation {
        vertex,
        rest_position: Some(vector(&rest)),
        position: Some(vector(&position)),
        step,
        points: points.collect(),
        rule: name(rule).to_owned(),
        cluster,
        mapping_step: changed_at_step,
        topology_step,
        reference: match reference {
            Reference::Initial => v1::Reference::Initial,
            Reference::Previous => v1::Reference::Previous,
        }
        .into(),
    }
}

/// The rule's field in `MotionRule`.
fn name(rule: Rule) -> &'static str {
    match rule {
        Rule::Direct => "direct",
        Rule::Mean => "mean",
        Rule::WeightedMean => "weighted_mean",
        Rule::Barycentric => "barycentric",
        Rule::ShapeMatching(ShapeMatching { fit, .. }) => match fit {
            Fit::Rigid => "shape_matching",
            Fit::Linear { .. } => "linear_shape_matching",
            Fit::Quadratic { .. } => "quadratic_shape_matching",
        },
        Rule::MovingLeastSquares(_) => "moving_least_squares",
        Rule::RadialBasis(_) => "radial_basis",
    }
}

fn vector(v: &Vector3<f64>) -> v1::Vector3 {
    v1::Vector3 {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}
