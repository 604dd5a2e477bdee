use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    Fault, Links, PairSpec, SolidSpec, SpecError, Track,
    check::{self, Checked, NOT_NEGATIVE, POSITIVE, not_negative, positive},
};

/// A system of particles as described, before anything is checked. Columns have one entry per particle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SystemSpec {
    /// At the start, m.
    pub positions: Vec<Vector3<f64>>,
    /// At the start, m/s; that of a particle that is fixed or driven does not count.
    pub velocities: Vec<Vector3<f64>>,
    /// kg, > 0; none where a solid gives them.
    pub masses: Vec<f64>,
    /// Particles that never move; naming one twice is the same as once.
    pub fixed: Vec<u32>,
    /// Particles whose motion is imposed.
    pub driven: Vec<Driven>,
    /// Forces from outside.
    pub forces: Vec<ExternalForce>,
    /// m/s².
    pub gravity: Vector3<f64>,
    /// Drag on every particle, N s/m, ≥ 0.
    pub damping: f64,
    /// Orientations; `None` for points without.
    pub frames: Option<FrameSpec>,
    /// Links between pairs of particles, in batches of one law each.
    pub links: Vec<Links>,
    /// What acts between any two particles, by distance and orientation.
    pub pairs: Option<PairSpec>,
    /// The elastic solid that the particles are.
    pub solid: Option<SolidSpec>,
    /// How a step is taken.
    pub integrator: Integrator,
    /// How a step is divided.
    pub stepping: Stepping,
}

/// A particle whose motion is imposed.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// Which.
    pub particle: u32,
    /// Its position, m, against time.
    pub path: Track,
}

/// A force from outside on one particle.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalForce {
    /// Which.
    pub particle: u32,
    /// N, against time.
    pub force: Track,
}

/// What makes points to bodies with an orientation. Columns have one entry per particle.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSpec {
    /// At the start: world from body.
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// At the start, 1/s, world frame; that of a particle that is fixed or driven does not count.
    pub spins: Vec<Vector3<f64>>,
    /// Moments of inertia about the body's axes, kg m², > 0.
    pub moments: Vec<Vector3<f64>>,
    /// Drag on every particle's spin, N m s, ≥ 0.
    pub damping: f64,
}

/// How a step is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Velocities, then positions with the new velocities: order 1, symplectic without damping.
    #[default]
    SemiImplicitEuler,
    /// Half a kick, a drift, half a kick: order 2, symplectic without damping.
    VelocityVerlet,
    /// The classical method of four stages: order 4; loses a little energy.
    RungeKutta4,
    /// One linear solve per step: order 1, stable for stiff links at any step, and damps them.
    LinearlyImplicitEuler,
    /// Solved by Newton's method: order 2, stable for stiff links, keeps quadratic invariants.
    ImplicitMidpoint,
}

/// How a step is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Stepping {
    /// Not at all.
    #[default]
    Fixed,
    /// Into equal substeps that stability allows as things stand at its start.
    Stable {
        /// The most substeps of a step.
        most: u32,
    },
    /// Into substeps whose error, as two halves of one tell it, stays within a tolerance.
    Adaptive {
        /// Error of a position in one substep, m, > 0.
        tolerance: f64,
        /// The most substeps of a step.
        most: u32,
    },
}

impl SystemSpec {
    pub(crate) fn check(&self) -> Checked {
        // Exhaustive: a new column does not compile until its check is considered.
        let Self {
            positions,
            velocities,
            masses,
            fixed,
            driven,
            forces,
            gravity,
            damping,
            frames,
            links,
            pairs,
            solid,
            integrator: _,
            stepping,
        } = self;
        let particles = positions.len();
        check::length("velocities", velocities.len(), particles, "particles")?;
        if !(masses.is_empty() && solid.is_some()) {
            check::length("masses", masses.len(), particles, "particles")?;
        }
        check::finite("positions", positions)?;
        check::finite("velocities", velocities)?;
        check::finite_vector("gravity", gravity)?;
        check::column("masses", masses, positive, POSITIVE)?;
        check::number("damping", *damping, not_negative, NOT_NEGATIVE)?;
        if let Some(frames) = frames {
            frames.check(particles)?;
        }
        for (batch, links) in links.iter().enumerate() {
            links.check(&format!("links[{batch}]"), particles)?;
        }
        if let Some(pairs) = pairs {
            pairs.check(particles, frames.is_some())?;
        }
        if let Some(solid) = solid {
            solid.check(positions)?;
        }
        for (entry, &index) in fixed.iter().enumerate() {
            check::exists(&format!("fixed[{entry}]"), index, particles)?;
        }
        check_driven(driven, fixed, particles)?;
        for (entry, ExternalForce { particle, force }) in forces.iter().enumerate() {
            check::exists(&format!("forces[{entry}].particle"), *particle, particles)?;
            force.check(&format!("forces[{entry}].force"))?;
        }
        stepping.check()
    }
}

fn check_driven(driven: &[Driven], fixed: &[u32], particles: usize) -> Checked {
    let mut moved: Vec<Option<&'static str>> = vec![None; particles];
    for &particle in fixed {
        moved[particle as usize] = Some("fixed");
    }
    for (entry, &Driven { particle, ref path }) in driven.iter().enumerate() {
        let field = format!("driven[{entry}].particle");
        check::exists(&field, particle, particles)?;
        if let Some(already) = moved[particle as usize].replace("driven already") {
            let fault = Fault::Twice { particle, already };
            return Err(SpecError { field, fault });
        }
        path.check(&format!("driven[{entry}].path"))?;
    }
    Ok(())
}

impl FrameSpec {
    fn check(&self, particles: usize) -> Checked {
        let Self {
            orientations,
            spins,
            moments,
            damping,
        } = self;
        let lengths = [
            ("frames.orientations", orientations.len()),
            ("frames.spins", spins.len()),
            ("frames.moments", moments.len()),
        ];
        for (field, found) in lengths {
            check::length(field, found, particles, "particles")?;
        }
        for (entry, orientation) in orientations.iter().enumerate() {
            let norm = orientation.coords.norm();
            let unit = |norm: f64| (norm - 1.0).abs() < 1e-6;
            let field = format!("frames.orientations[{entry}]");
            check::number(&field, norm, unit, "of length 1")?;
        }
        check::finite("frames.spins", spins)?;
        for (entry, moments) in moments.iter().enumerate() {
            let field = format!("frames.moments[{entry}]");
            check::column(&field, moments.as_slice(), positive, POSITIVE)?;
        }
        check::number("frames.damping", *damping, not_negative, NOT_NEGATIVE)
    }
}

impl Stepping {
    fn check(&self) -> Checked {
        let at_least_one = |most: u32| {
            let rule = "at least 1";
            check::number("stepping.most", f64::from(most), |most| most >= 1.0, rule)
        };
        match *self {
            Self::Fixed => Ok(()),
            Self::Stable { most } => at_least_one(most),
            Self::Adaptive { tolerance, most } => {
                check::number("stepping.tolerance", tolerance, positive, POSITIVE)?;
                at_least_one(most)
            }
        }
    }
}
