//! Particles that a world moves itself.

use sinew_particles::{Fault, Solid, SolidReport, SpecError, Stepping, System, SystemSpec};

use crate::{
    build::{Points, in_range, kernel_refusal},
    frame::PointState,
    scene::SceneError,
    world::Source,
};

/// The message that a specification came in.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    Particles,
    MassSpring,
    Elastic,
}

impl Form {
    /// Path in the request of a field of the specification; empty for the whole.
    fn path(self, field: &str) -> String {
        match self {
            Self::Particles => format!("scene.motion.particles.{field}"),
            // The solid is the message itself.
            Self::Elastic => {
                let field = field.replace("solid.density", "material.density");
                let field = field.replace("solid.metric.", "").replace("solid.", "");
                format!("scene.motion.elastic.{field}")
            }
            // The springs of a mass-spring network are its only links.
            Self::MassSpring => {
                let field = field.replace("links[0].ends", "springs");
                let field = field.replace("links[0].spring.", "");
                format!("scene.motion.mass_spring.{field}")
            }
        }
    }
}

pub(crate) fn system_points(
    spec: SystemSpec,
    form: Form,
    time_step: f64,
) -> Result<Points, SceneError> {
    let system = System::new(spec).map_err(|error| refusal(&error, form))?;
    let rest = system.positions().to_vec();
    in_range(&rest, &form.path("positions"))?;
    let stable = system.largest_stable_step();
    let mut warnings = if time_step > stable && system.stepping() == Stepping::Fixed {
        vec![format!(
            "time_step_seconds is {time_step:.3e} s and the particles are stable up to about {stable:.3e} s: they may diverge"
        )]
    } else {
        Vec::new()
    };
    warnings.extend(system.attraction_table().map(|(pieces, error)| {
        format!(
            "the attraction is a table of {pieces} pieces, off by at most {error:.1e} of its greatest, or of the force where that is greater"
        )
    }));
    warnings.extend(system.solid().and_then(blind));
    Ok(Points {
        labels: (0..rest.len()).map(|i| i.to_string()).collect(),
        states: vec![PointState::Valid; rest.len()],
        orientations: system.orientations().unwrap_or_default().to_vec(),
        source: Source::Particles(Box::new(system)),
        rest,
        warnings,
    })
}

/// Says where a solid holds together badly.
fn blind(solid: &Solid) -> Option<String> {
    let SolidReport {
        neighbours: _,
        ranks: [alone, lines, _, _],
        components,
    } = solid.report();
    let odd = alone > 0 || lines > 0 || components > 1;
    odd.then(|| {
        format!(
            "the elastic solid is in {components} pieces, {alone} of its points see no other and {lines} see others in one line alone: \
             they resist nothing, or along that line; remove them, add points, or lengthen the reach"
        )
    })
}

fn refusal(error: &SpecError, form: Form) -> SceneError {
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
    kernel_refusal(reason, form.path(&error.field), &error.fault)
}
