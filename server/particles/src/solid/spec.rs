use nalgebra::Vector3;

use crate::{
    Fault,
    check::{self, Checked, NOT_NEGATIVE, POSITIVE, not_negative, positive},
};

/// An elastic solid that is nothing but the particles of a system, all of them, at rest where they start.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidSpec {
    /// Whether the particles fill a space or a plane.
    pub dimension: Dimension,
    /// How far apart particles are within the body.
    pub metric: Metric,
    /// How far a particle sees.
    pub reach: Reach,
    /// How derivatives are weighed against each other.
    pub integration: Integration,
    /// What the body is made of.
    pub material: Material,
    /// Mass density, kg/m³, > 0: gives the masses where the system has none.
    pub density: f64,
    /// Volume of each particle, m³, > 0; `None` for its spacing to the power of the dimension, times 1 m in a plane.
    /// `[B3]`
    pub volumes: Option<Vec<f64>>,
    /// How much a motion that no gradient shows is resisted, as a fraction of Young's modulus, ≥ 0. `[B11]`
    pub stabilisation: f64,
    /// Drag on every particle by its mass, 1/s, ≥ 0.
    pub damping: f64,
    /// The distance of two particles over that at rest, > 1, beyond which they see each other no more: the solid tears.
    /// Looked at after each step. `None` for one that does not. `[B14]`
    pub break_at_stretch: Option<f64>,
}

/// Whether the particles of a solid fill a space or a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// The plane of x and y, in plane stress: a sheet 1 m thick, where not said otherwise, whose particles share a z.
    Plane,
    /// Space. Particles that lie in a line or a plane resist within it alone.
    Space,
}

/// How the distance between two particles is measured along the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Metric {
    /// The length of the path of least `Σ |e|^γ`. At γ = 1 the straight distance: the classical radial method. `[B1]`
    Geodesic {
        /// γ, from 1: the greater, the smaller the gaps that part the body.
        exponent: f64,
    },
    /// The length of the shortest path, where a jump counts for more the more spacings it is wider than `gap`. `[B2]`
    Graded {
        /// The widest jump that is still within the body, in spacings around it, > 0: wider than the diagonals of a
        /// lattice's cells, narrower than two of its rows.
        gap: f64,
        /// From 1: how steeply wider jumps are lengthened.
        exponent: f64,
    },
}

/// How far a particle sees, which bounds the graph of the paths, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// As far for all, m, > 0.
    Length(f64),
    /// By the spacing around each, > 1; up to twice as far where fewer directions show than there are.
    Spacings(f64),
}

/// How derivatives are weighed against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integration {
    /// Each by moving least squares alone. Irregular clouds are then too soft, however fine. `[B4]`
    Nodal,
    /// Changed as little as shows them curved fields and makes constant stresses push no particle but out of the surface.
    /// `[B5]`, `[B13]`
    Consistent,
}

/// An isotropic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus, Pa, > 0.
    pub young: f64,
    /// Poisson's ratio, above −1 and below 1/2.
    pub poisson: f64,
    /// How stress follows from deformation.
    pub law: MaterialLaw,
}

/// How stress follows from deformation; all laws agree on small ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialLaw {
    /// Of small strains: turning costs energy. `[B6]`
    Linear,
    /// Of small strains beside any rotation. `[B7]`
    Corotated,
    /// Quadratic in Green's strain; gives way when crushed. `[B8]`
    StVenantKirchhoff,
    /// Rubber that resists being crushed and turned inside out. `[B9]`
    NeoHookean,
}

impl SolidSpec {
    /// A solid in space of a material, with the defaults of all else.
    #[must_use]
    pub fn new(material: Material, density: f64) -> Self {
        Self {
            dimension: Dimension::Space,
            metric: Metric::Graded {
                gap: 1.8,
                exponent: 6.0,
            },
            reach: Reach::Spacings(1.9),
            integration: Integration::Consistent,
            material,
            density,
            volumes: None,
            stabilisation: 0.1,
            damping: 0.0,
            break_at_stretch: None,
        }
    }

    pub(crate) fn check(&self, positions: &[Vector3<f64>]) -> Checked {
        // Exhaustive: a new field does not compile until its check is considered.
        let Self {
            dimension,
            metric,
            reach,
            integration: _,
            material,
            density,
            volumes,
            stabilisation,
            damping,
            break_at_stretch,
        } = self;
        dimension.check(positions)?;
        metric.check()?;
        reach.check()?;
        material.check()?;
        check::number("solid.density", *density, positive, POSITIVE)?;
        if let Some(volumes) = volumes {
            check::length("solid.volumes", volumes.len(), positions.len(), "particles")?;
            check::column("solid.volumes", volumes, positive, POSITIVE)?;
        }
        let field = "solid.stabilisation";
        check::number(field, *stabilisation, not_negative, NOT_NEGATIVE)?;
        check::number("solid.damping", *damping, not_negative, NOT_NEGATIVE)?;
        let Some(stretch) = *break_at_stretch else {
            return Ok(());
        };
        let admits = |value: f64| value.is_finite() && value > 1.0;
        let rule = "finite and above 1: a body at rest is whole";
        check::number("solid.break_at_stretch", stretch, admits, rule)
    }
}

impl Dimension {
    /// How many directions it has.
    pub(crate) fn count(self) -> usize {
        match self {
            Self::Plane => 2,
            Self::Space => 3,
        }
    }

    fn check(self, positions: &[Vector3<f64>]) -> Checked {
        let Some(first) = positions.first() else {
            return Ok(());
        };
        match (self, positions.iter().position(|x| x.z != first.z)) {
            (Self::Space, _) | (Self::Plane, None) => Ok(()),
            (Self::Plane, Some(particle)) => {
                let value = positions[particle].z;
                let rule =
                    "that of particle 0 in a plane: give all the same, or the dimension of space";
                let field = format!("positions[{particle}].z");
                Err(check::refuse(field, Fault::Value { value, rule }))
            }
        }
    }
}

impl Metric {
    fn check(self) -> Checked {
        let at_least_one = |value: f64| value.is_finite() && value >= 1.0;
        let rule = "finite and at least 1";
        match self {
            Self::Geodesic { exponent } => check::number(
                "solid.metric.geodesic.exponent",
                exponent,
                at_least_one,
                rule,
            ),
            Self::Graded { gap, exponent } => {
                check::number("solid.metric.graded.gap", gap, positive, POSITIVE)?;
                check::number("solid.metric.graded.exponent", exponent, at_least_one, rule)
            }
        }
    }
}

impl Reach {
    fn check(self) -> Checked {
        match self {
            Self::Length(length) => check::number("solid.reach", length, positive, POSITIVE),
            Self::Spacings(spacings) => {
                let admits = |value: f64| value.is_finite() && value > 1.0;
                let rule = "finite and above 1: a particle sees its neighbours";
                check::number("solid.reach_spacings", spacings, admits, rule)
            }
        }
    }
}

impl Material {
    fn check(self) -> Checked {
        let Self {
            young,
            poisson,
            law,
        } = self;
        check::number("solid.material.young", young, positive, POSITIVE)?;
        let (from, rule) = match law {
            MaterialLaw::NeoHookean => (0.0, "from 0 and below 0.5 for this law"),
            MaterialLaw::Linear | MaterialLaw::Corotated | MaterialLaw::StVenantKirchhoff => {
                (f64::next_up(-1.0), "above -1 and below 0.5")
            }
        };
        let admits = |value: f64| value >= from && value < 0.5;
        check::number("solid.material.poisson", poisson, admits, rule)
    }
}
