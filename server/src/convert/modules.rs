//! Parts of simulated networks that are read.

use sinew_engine as engine;
use sinew_proto::v1;

use super::{Result, indices, missing};

/// Reads the probe of this index of a scene.
pub(super) fn probe(index: usize, given: v1::Probe) -> Result<engine::Probe> {
    use v1::probe::Module as Given;
    let module = given.module.ok_or_else(|| {
        missing(
            &format!("scene.probes[{index}].module"),
            "give a particle or a link",
        )
    })?;
    Ok(engine::Probe {
        name: given.name,
        module: match module {
            Given::Particle(particle) => engine::Module::Particle(particle),
            Given::Link(v1::LinkIndex { batch, link }) => engine::Module::Link { batch, link },
        },
    })
}

/// Reads which modules a request names.
pub(crate) fn selection(
    particles: Option<&v1::Indices>,
    links: &[v1::LinkSelection],
) -> Result<engine::Selection> {
    let of_batch = |(i, given): (usize, &v1::LinkSelection)| {
        Ok(engine::LinkSelection {
            batch: given.batch,
            links: indices(given.links.as_ref(), &format!("links[{i}].links"))?,
        })
    };
    Ok(engine::Selection {
        particles: indices(particles, "particles")?,
        links: links
            .iter()
            .enumerate()
            .map(of_batch)
            .collect::<Result<_>>()?,
    })
}
