//! Particles that a world moves itself.

use sinew_particles::{Fault, SpecError, System, SystemSpec};

use crate::{
    build::{Points, in_range, kernel_refusal},
    frame::PointState,
    scene::SceneError,
    world::Source,
};

const FIELD: &str = "scene.motion.mass_spring";

pub(crate) fn system_points(spec: SystemSpec, time_step: f64) -> Result<Points, SceneError> {
    let system = System::new(spec).map_err(|error| refusal(&error))?;
    let rest = system.positions().to_vec();
    in_range(&rest, &format!("{FIELD}.positions"))?;
    let stable = system.largest_stable_step();
    let warnings = if time_step > stable {
        vec![format!(
            "time_step_seconds is {time_step:.3e} s and the particles are stable up to about {stable:.3e} s: they may diverge"
        )]
    } else {
        Vec::new()
    };
    Ok(Points {
        labels: (0..rest.len()).map(|i| i.to_string()).collect(),
        states: vec![PointState::Valid; rest.len()],
        source: Source::Particles(Box::new(system)),
        rest,
        warnings,
    })
}

fn refusal(error: &SpecError) -> SceneError {
    let reason = match error.fault {
        Fault::Length { .. } => "LENGTH_MISMATCH",
        Fault::Value { value, .. } if value.is_finite() => "VALUE_OUT_OF_RANGE",
        Fault::Value { .. } => "VALUE_NOT_FINITE",
        Fault::Index { .. } => "INDEX_OUT_OF_RANGE",
        Fault::SelfLink { .. } => "LINK_DEGENERATE",
        Fault::Twice { .. } => "PARTICLE_MOVED_TWICE",
        Fault::Unframed => "ORIENTATIONS_MISSING",
        Fault::Crowded => "PAIRS_TOO_MANY",
    };
    // The springs of a mass-spring network are its only links.
    let field = (error.field)
        .replace("links[0].ends", "springs")
        .replace("links[0].spring.", "");
    let named = SpecError {
        field: field.clone(),
        fault: error.fault.clone(),
    };
    kernel_refusal(reason, format!("{FIELD}.{field}"), &named)
}
