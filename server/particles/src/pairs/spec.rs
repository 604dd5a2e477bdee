use nalgebra::Vector3;

use super::form::{Form, Weighting};
use crate::{
    Fault,
    check::{self, Checked, NOT_NEGATIVE, POSITIVE, not_negative, positive},
};

/// What acts between any two particles, by their distance and orientations.
///
/// A pair is complete, and does all that is given here but repulsion, or it repels. Complete are the pairs of one object
/// and one kind, and those of one object of which one is a hinge; where there are bonds, these alone. `[P30]`
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairSpec {
    /// Attraction and repulsion of complete pairs.
    pub attraction: Option<Attraction>,
    /// What orientations do in complete pairs; needs frames.
    pub form: Option<Form>,
    /// Friction of complete pairs; needs frames.
    pub friction: Option<PairFriction>,
    /// Distance from which complete pairs do nothing, m, > 0; bonds act at any distance.
    pub reach: f64,
    /// The complete pairs, wherever they are; `None` for all those within reach that objects and kinds allow.
    pub bonds: Option<Vec<[u32; 2]>>,
    /// What every other pair does.
    pub repulsion: Option<Repulsion>,
    /// The object of each particle; empty where all are one.
    pub objects: Vec<u32>,
    /// The kind of each particle, 0 for a hinge; empty where all are one.
    pub kinds: Vec<u32>,
    /// What is searched for beyond the reaches, so that pairs can be kept for some steps, m, > 0; `None` for an eighth
    /// of the longest reach.
    pub skin: Option<f64>,
}

/// A force along the line between two particles.
#[derive(Clone, Debug, PartialEq)]
pub struct Attraction {
    /// Force against distance.
    pub law: AttractionLaw,
    /// How it ends at its reach.
    pub ending: EndingKind,
    /// Error of a table that stands for the law, as a fraction of its greatest attraction, or of the force where that
    /// is greater, > 0; `None` for the law itself.
    pub table: Option<f64>,
}

/// Force against distance.
#[derive(Clone, Debug, PartialEq)]
pub enum AttractionLaw {
    /// `[P18]`
    LennardJones {
        /// N/m at rest, > 0.
        stiffness: f64,
        /// m, > 0.
        rest_length: f64,
        /// Power of the distance in the attraction, 2 to 64; that of the repulsion is twice as much.
        exponent: u32,
    },
    /// `[P19]`
    TwelveSix {
        /// J, > 0.
        depth: f64,
        /// Distance at which the potential is zero, m, > 0.
        size: f64,
    },
    /// `[P20]`
    Cohesion {
        /// N/m, > 0.
        stiffness: f64,
        /// m, > 0.
        rest_length: f64,
        /// No unit, > 0: how short its range is. Repulsion is monotone up to 16/3.
        sharpness: f64,
    },
    /// Cohesion whose rest length depends on the direction; needs frames. `[P31]`
    DirectedCohesion {
        /// N/m, > 0, at a rest length of the cube root of the mean product of the radii.
        stiffness: f64,
        /// As above.
        sharpness: f64,
        /// Rest lengths of each particle along its x, y and z axis, m, > 0.
        radii: Vec<Vector3<f64>>,
    },
}

/// How a force ends at its reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EndingKind {
    /// It is moved by its value there: no jump, no drift of energy.
    #[default]
    Shifted,
    /// It jumps to zero.
    Sharp,
}

/// Friction that vanishes for rigid motions and conserves momenta. `[P32]`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairFriction {
    /// N s/m, ≥ 0.
    pub sliding: f64,
    /// N m s, ≥ 0.
    pub turning: f64,
}

/// A repulsion that falls exponentially. `[P21]`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repulsion {
    /// N, > 0, at no distance.
    pub strength: f64,
    /// Distance over which it falls by e, m, > 0.
    pub length: f64,
    /// Distance from which it is nothing, m, > 0.
    pub reach: f64,
}

impl PairSpec {
    pub(crate) fn check(&self, particles: usize, framed: bool) -> Checked {
        let Self {
            attraction,
            form,
            friction,
            reach,
            bonds,
            repulsion,
            objects,
            kinds,
            skin,
        } = self;
        if let Some(attraction) = attraction {
            attraction.check(particles, framed)?;
        }
        if let Some(form) = form {
            framed_only("pairs.form", framed)?;
            form.check(particles)?;
        }
        if let Some(PairFriction { sliding, turning }) = *friction {
            framed_only("pairs.friction", framed)?;
            let (rule, admits) = (NOT_NEGATIVE, not_negative);
            check::number("pairs.friction.sliding", sliding, admits, rule)?;
            check::number("pairs.friction.turning", turning, admits, rule)?;
        }
        match bonds {
            Some(bonds) => check::ends("pairs.bonds", bonds, particles)?,
            None => check::number("pairs.reach", *reach, positive, POSITIVE)?,
        }
        if let Some(repulsion) = repulsion {
            repulsion.check()?;
        }
        for (field, column) in [("pairs.objects", objects), ("pairs.kinds", kinds)] {
            if !column.is_empty() {
                check::length(field, column.len(), particles, "particles")?;
            }
        }
        skin.iter()
            .try_for_each(|&skin| check::number("pairs.skin", skin, positive, POSITIVE))
    }
}

/// Orientations cannot act where there are none.
fn framed_only(field: &str, framed: bool) -> Checked {
    if framed {
        return Ok(());
    }
    Err(check::refuse(field, Fault::Unframed))
}

impl Attraction {
    fn check(&self, particles: usize, framed: bool) -> Checked {
        let each = |law: &str, numbers: &[(&str, f64)]| -> Checked {
            numbers.iter().try_for_each(|(name, value)| {
                let field = format!("pairs.attraction.{law}.{name}");
                check::number(&field, *value, positive, POSITIVE)
            })
        };
        match &self.law {
            AttractionLaw::LennardJones {
                stiffness,
                rest_length,
                exponent,
            } => {
                each(
                    "lennard_jones",
                    &[("stiffness", *stiffness), ("rest_length", *rest_length)],
                )?;
                let field = "pairs.attraction.lennard_jones.exponent";
                let admits = |n: f64| (2.0..=64.0).contains(&n);
                check::number(field, f64::from(*exponent), admits, "2 to 64")?;
            }
            AttractionLaw::TwelveSix { depth, size } => {
                each("twelve_six", &[("depth", *depth), ("size", *size)])?;
            }
            AttractionLaw::Cohesion {
                stiffness,
                rest_length,
                sharpness,
            } => each(
                "cohesion",
                &[
                    ("stiffness", *stiffness),
                    ("rest_length", *rest_length),
                    ("sharpness", *sharpness),
                ],
            )?,
            AttractionLaw::DirectedCohesion {
                stiffness,
                sharpness,
                radii,
            } => {
                let law = "directed_cohesion";
                framed_only(&format!("pairs.attraction.{law}"), framed)?;
                each(law, &[("stiffness", *stiffness), ("sharpness", *sharpness)])?;
                let field = format!("pairs.attraction.{law}.radii");
                check::length(&field, radii.len(), particles, "particles")?;
                for (entry, radii) in radii.iter().enumerate() {
                    let field = format!("{field}[{entry}]");
                    check::column(&field, radii.as_slice(), positive, POSITIVE)?;
                }
            }
        }
        self.table.iter().try_for_each(|&error| {
            check::number("pairs.attraction.table", error, positive, POSITIVE)
        })
    }
}

impl Form {
    fn check(&self, particles: usize) -> Checked {
        let Self {
            form,
            coplanarity,
            conormality,
            cocircularity,
            curvatures,
            weighting,
            normalisation: _,
            gradient: _,
        } = self;
        for (name, strength) in [
            ("form", form),
            ("coplanarity", coplanarity),
            ("conormality", conormality),
            ("cocircularity", cocircularity),
        ] {
            let field = format!("pairs.form.{name}");
            check::number(&field, *strength, not_negative, NOT_NEGATIVE)?;
        }
        let field = "pairs.form.curvatures";
        check::length(field, curvatures.len(), particles, "particles")?;
        for (entry, curvatures) in curvatures.iter().enumerate() {
            let field = format!("{field}[{entry}]");
            check::column(&field, curvatures, f64::is_finite, "finite")?;
        }
        match *weighting {
            Weighting::One => Ok(()),
            Weighting::Gaussian { width } => {
                check::number("pairs.form.weighting.width", width, positive, POSITIVE)
            }
            Weighting::Wendland { reach } => {
                check::number("pairs.form.weighting.reach", reach, positive, POSITIVE)
            }
        }
    }
}

impl Repulsion {
    fn check(&self) -> Checked {
        let Self {
            strength,
            length,
            reach,
        } = *self;
        for (name, value) in [("strength", strength), ("length", length), ("reach", reach)] {
            let field = format!("pairs.repulsion.{name}");
            check::number(&field, value, positive, POSITIVE)?;
        }
        Ok(())
    }
}
