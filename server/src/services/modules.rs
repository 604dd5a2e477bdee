//! SessionService's ReadModules.

use nalgebra::Vector3;
use sinew_engine::{LinkModules, Modules};
use sinew_proto::v1::{self, Indices, Precision, Reals};

use super::Shared;
use crate::{convert, error::ServiceError};

impl Shared {
    pub(super) async fn read_modules(
        &self,
        request: v1::ReadModulesRequest,
    ) -> Result<v1::Modules, ServiceError> {
        let v1::ReadModulesRequest {
            name,
            particles,
            links,
            precision,
        } = request;
        let entry = self.registry.get(&name)?;
        let precision = convert::known::<Precision>(precision, "precision")?;
        let selection = convert::selection(particles.as_ref(), &links)?;
        let modules = entry.handle.read_modules(selection).await?;
        Ok(told(&modules, precision))
    }
}

fn told(modules: &Modules, precision: Precision) -> v1::Modules {
    let Modules {
        step,
        time_seconds,
        particles,
        positions,
        velocities,
        forces,
        torques,
        links,
    } = modules;
    let column = |column: &[Vector3<f64>]| vectors(column, precision);
    v1::Modules {
        step: *step,
        time_seconds: *time_seconds,
        particles: Some(Indices::pack(particles)),
        positions: Some(column(positions)),
        velocities: Some(column(velocities)),
        forces: Some(column(forces)),
        torques: (!torques.is_empty()).then(|| column(torques)),
        links: links
            .iter()
            .map(|links| told_links(links, precision))
            .collect(),
    }
}

fn told_links(links: &LinkModules, precision: Precision) -> v1::LinkModules {
    let LinkModules {
        batch,
        links,
        ends,
        forces,
        broken,
    } = links;
    v1::LinkModules {
        batch: *batch,
        links: Some(Indices::pack(links)),
        ends: Some(Indices::pack(ends.as_flattened())),
        forces: Some(vectors(forces, precision)),
        broken: Some(Indices::pack(broken)),
    }
}

/// 3 numbers per vector.
pub(super) fn vectors(column: &[Vector3<f64>], precision: Precision) -> Reals {
    let numbers: Vec<f64> = column.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
    Reals::pack(&numbers, precision)
}
