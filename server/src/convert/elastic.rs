//! Elastic solids of points.

use nalgebra::Vector3;
use sinew_engine as engine;
use sinew_proto::v1;

use super::{
    Result, client_only, indices, known, missing, not_resolved,
    particles::{MOST, driven, each, each_vector, forces, integrator, stepping, vector},
    vectors,
};
use crate::{assets::Assets, error::ServiceError};

const FIELD: &str = "scene.motion.elastic";
/// Where a cloud comes from.
const SOURCES: &str = "give them, or an `asset`; in a scene file also a `file`";
/// Of the graded metric where the scene does not say.
const GAP: f64 = 1.8;
const EXPONENT: f64 = 6.0;

/// Reads an elastic solid: particles that a solid gives their masses.
pub(super) fn elastic(given: v1::ElasticSolid, assets: &Assets) -> Result<engine::SystemSpec> {
    let field = |name: &str| format!("{FIELD}.{name}");
    client_only("", given.file_unit_metres, FIELD)?;
    if given.file_sample_spacing != 0.0 {
        let value = given.file_sample_spacing;
        return Err(not_resolved(
            &field("file_sample_spacing"),
            &value.to_string(),
        ));
    }
    let positions = cloud(given.cloud, assets)?;
    let count = positions.len();
    let velocities = each_vector(given.velocities.as_ref(), &field("velocities"), count)?;
    let material = given
        .material
        .ok_or_else(|| missing(&field("material"), "give its `young` and `density`"))?;
    let mut fixed = indices(given.fixed.as_ref(), &field("fixed"))?;
    fixed.extend(boxed(given.fixed_boxes, &positions)?);
    let stepping = match given.stepping {
        None => engine::Stepping::Stable { most: MOST },
        some => stepping(some),
    };
    let defaults = engine::SolidSpec::new(
        engine::Material {
            young: material.young,
            poisson: material.poisson,
            law: law(material.law)?,
        },
        material.density,
    );
    let solid = engine::SolidSpec {
        dimension: match known(given.dimension, &field("dimension"))? {
            v1::SolidDimension::Unspecified | v1::SolidDimension::Space => {
                engine::SolidDimension::Space
            }
            v1::SolidDimension::Plane => engine::SolidDimension::Plane,
        },
        metric: metric(given.metric),
        reach: match given.sight {
            None => defaults.reach,
            Some(v1::elastic_solid::Sight::ReachSpacings(times)) => engine::Reach::Spacings(times),
            Some(v1::elastic_solid::Sight::Reach(length)) => engine::Reach::Length(length),
        },
        integration: match known(given.integration, &field("integration"))? {
            v1::SolidIntegration::Unspecified | v1::SolidIntegration::Consistent => {
                engine::Integration::Consistent
            }
            v1::SolidIntegration::Nodal => engine::Integration::Nodal,
        },
        volumes: each(given.volumes.as_ref(), &field("volumes"), count)?,
        stabilisation: given.stabilisation.unwrap_or(defaults.stabilisation),
        damping: given.damping,
        break_at_stretch: given.break_at_stretch,
        ..defaults
    };
    Ok(engine::SystemSpec {
        velocities: velocities.unwrap_or_else(|| vec![Vector3::zeros(); count]),
        fixed,
        driven: driven(given.driven, FIELD)?,
        forces: forces(given.forces, FIELD)?,
        gravity: vector(given.gravity),
        integrator: integrator(given.integrator, FIELD)?,
        stepping,
        positions,
        solid: Some(solid),
        ..engine::SystemSpec::default()
    })
}

/// The points in any of the boxes.
fn boxed(boxes: Vec<v1::Box>, positions: &[Vector3<f64>]) -> Result<Vec<u32>> {
    let mut found = Vec::new();
    for (i, v1::Box { low, high }) in boxes.into_iter().enumerate() {
        let field = |name: &str| format!("{FIELD}.fixed_boxes[{i}].{name}");
        let low = vector(Some(
            low.ok_or_else(|| missing(&field("low"), "give both corners"))?,
        ));
        let high = vector(Some(
            high.ok_or_else(|| missing(&field("high"), "give both corners"))?,
        ));
        let within = |x: &Vector3<f64>| (0..3).all(|k| low[k] <= x[k] && x[k] <= high[k]);
        let inside = (0..).zip(positions).filter(|(_, x)| within(x));
        found.extend(inside.map(|(i, _)| i));
    }
    Ok(found)
}

fn cloud(given: Option<v1::elastic_solid::Cloud>, assets: &Assets) -> Result<Vec<Vector3<f64>>> {
    use v1::elastic_solid::Cloud;
    let field = format!("{FIELD}.positions");
    match given {
        Some(Cloud::Positions(positions)) => vectors(Some(&positions), &field),
        Some(Cloud::Asset(name)) => {
            let grid: v1::UnstructuredGrid = prost::Message::decode(assets.get(&name)?)
                .map_err(|error| ServiceError::Garbled(format!("{name}: {error}")))?;
            vectors(grid.positions.as_ref(), &field)
        }
        Some(Cloud::File(path)) => {
            client_only(&path, 0.0, FIELD)?;
            Err(missing(&field, SOURCES))
        }
        None => Err(missing(&field, SOURCES)),
    }
}

fn metric(given: Option<v1::elastic_solid::Metric>) -> engine::SolidMetric {
    use v1::elastic_solid::Metric;
    let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
    match given {
        Some(Metric::Geodesic(given)) => engine::SolidMetric::Geodesic {
            exponent: given.exponent,
        },
        Some(Metric::Graded(given)) => engine::SolidMetric::Graded {
            gap: or(given.gap, GAP),
            exponent: or(given.exponent, EXPONENT),
        },
        None => engine::SolidMetric::Graded {
            gap: GAP,
            exponent: EXPONENT,
        },
    }
}

fn law(number: i32) -> Result<engine::MaterialLaw> {
    use v1::ElasticLaw as Given;
    Ok(match known(number, &format!("{FIELD}.material.law"))? {
        Given::Unspecified | Given::Corotated => engine::MaterialLaw::Corotated,
        Given::Linear => engine::MaterialLaw::Linear,
        Given::StVenantKirchhoff => engine::MaterialLaw::StVenantKirchhoff,
        Given::NeoHookean => engine::MaterialLaw::NeoHookean,
    })
}
