//! Particles that the server simulates.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sinew_engine as engine;
use sinew_proto::v1;

use super::{Result, client_only, indices, known, missing, reals, vectors};
use crate::error::invalid;

const FIELD: &str = "scene.motion.particles";
/// The laws of links and of attracting pairs.
const LINKS: &str =
    "give `spring`, `contact`, `breaking`, `plastic`, `friction` or `table` with its columns";
const PAIRS: &str = "give `lennard_jones`, `twelve_six`, `cohesion` or `directed_cohesion`";
/// Most substeps of a step where the scene does not say.
pub(super) const MOST: u32 = 1_000;
/// Reach of a repulsion where the scene does not say, in its lengths.
const REPULSION_REACH: f64 = 20.0;

/// Reads a mass-spring network: particles whose only links are springs.
pub(super) fn mass_spring(network: v1::MassSpring) -> Result<engine::SystemSpec> {
    let field = |name: &str| format!("scene.motion.mass_spring.{name}");
    let positions = vectors(network.positions.as_ref(), &field("positions"))?;
    let springs = pairs(network.springs.as_ref(), &field("springs"))?;
    let velocities = match vectors(network.velocities.as_ref(), &field("velocities"))? {
        none if none.is_empty() => vec![Vector3::zeros(); positions.len()],
        given => given,
    };
    let elastic = elastic(
        [network.stiffness, network.damping, network.rest_lengths],
        "scene.motion.mass_spring",
        springs.len(),
    )?;
    let masses = each(network.masses.as_ref(), &field("masses"), positions.len())?;
    Ok(engine::SystemSpec {
        masses: masses.unwrap_or_else(|| vec![1.0; positions.len()]),
        fixed: indices(network.fixed.as_ref(), &field("fixed"))?,
        links: vec![engine::Links {
            ends: springs,
            law: engine::LinkLaw::Spring(elastic),
        }],
        gravity: vector(network.gravity),
        velocities,
        positions,
        ..engine::SystemSpec::default()
    })
}

/// Reads particles of any kind.
pub(super) fn particles(given: v1::Particles) -> Result<engine::SystemSpec> {
    let field = |name: &str| format!("{FIELD}.{name}");
    let positions = vectors(given.positions.as_ref(), &field("positions"))?;
    let count = positions.len();
    let surface = (given.surface.map(|given| surface(&given, &positions))).transpose()?;
    let velocities = each_vector(given.velocities.as_ref(), &field("velocities"), count)?;
    let masses = each(given.masses.as_ref(), &field("masses"), count)?;
    let links = given.links.into_iter().enumerate();
    Ok(engine::SystemSpec {
        velocities: velocities.unwrap_or_else(|| vec![Vector3::zeros(); count]),
        masses: masses.unwrap_or_else(|| vec![1.0; count]),
        fixed: indices(given.fixed.as_ref(), &field("fixed"))?,
        driven: driven(given.driven, FIELD)?,
        forces: forces(given.forces, FIELD)?,
        gravity: vector(given.gravity),
        damping: given.damping,
        frames: (given
            .frames
            .map(|given| frames(&given, count, surface.as_ref())))
        .transpose()?,
        links: links
            .map(|(i, given)| links_of(given, &field(&format!("links[{i}]"))))
            .collect::<Result<_>>()?,
        pairs: (given
            .pairs
            .map(|given| pair_spec(given, count, surface.as_ref())))
        .transpose()?,
        solid: None,
        integrator: integrator(given.integrator, FIELD)?,
        stepping: stepping(given.stepping),
        positions,
    })
}

/// Particles whose motion is imposed; `field` is the message that they are of.
pub(super) fn driven(given: Vec<v1::Driven>, field: &str) -> Result<Vec<engine::Driven>> {
    let each = |(i, driven): (usize, v1::Driven)| {
        Ok(engine::Driven {
            particle: driven.particle,
            path: track(driven.path, &format!("{field}.driven[{i}].path"))?,
        })
    };
    given.into_iter().enumerate().map(each).collect()
}

/// Forces from outside; `field` is the message that they are of.
pub(super) fn forces(
    given: Vec<v1::ExternalForce>,
    field: &str,
) -> Result<Vec<engine::ExternalForce>> {
    let each = |(i, force): (usize, v1::ExternalForce)| {
        Ok(engine::ExternalForce {
            particle: force.particle,
            force: track(force.force, &format!("{field}.forces[{i}].force"))?,
        })
    };
    given.into_iter().enumerate().map(each).collect()
}

/// How a step is taken; `field` is the message that says it.
pub(super) fn integrator(number: i32, field: &str) -> Result<engine::Integrator> {
    use v1::Integrator as Given;
    Ok(
        match known::<Given>(number, &format!("{field}.integrator"))? {
            Given::Unspecified | Given::SemiImplicitEuler => engine::Integrator::SemiImplicitEuler,
            Given::VelocityVerlet => engine::Integrator::VelocityVerlet,
            Given::RungeKutta4 => engine::Integrator::RungeKutta4,
            Given::LinearlyImplicitEuler => engine::Integrator::LinearlyImplicitEuler,
            Given::ImplicitMidpoint => engine::Integrator::ImplicitMidpoint,
        },
    )
}

pub(super) fn stepping(given: Option<v1::Stepping>) -> engine::Stepping {
    use v1::stepping::Kind;
    let most = |most: u32| if most == 0 { MOST } else { most };
    match given.and_then(|given| given.kind) {
        None => engine::Stepping::Fixed,
        Some(Kind::Stable(stable)) => engine::Stepping::Stable {
            most: most(stable.most),
        },
        Some(Kind::Adaptive(adaptive)) => engine::Stepping::Adaptive {
            tolerance: adaptive.tolerance,
            most: most(adaptive.most),
        },
    }
}

/// Estimates the frames and curvatures of particles on a surface.
fn surface(given: &v1::Surface, positions: &[Vector3<f64>]) -> Result<engine::Surface> {
    let field = |name: &str| format!("{FIELD}.surface.{name}");
    client_only(
        &given.file,
        given.file_unit_metres,
        &format!("{FIELD}.surface"),
    )?;
    let corners = indices(given.triangles.as_ref(), &field("triangles"))?;
    let (triangles, rest) = corners.as_chunks::<3>();
    if !rest.is_empty() {
        let problem = format!("has {} numbers", corners.len());
        return Err(invalid(
            "LENGTH_MISMATCH",
            field("triangles"),
            problem,
            "give 3 corners for each triangle",
        ));
    }
    engine::surface(positions, triangles, given.reach).map_err(|error| {
        let name = error.field.split('[').next().unwrap_or_default();
        let field = match name {
            "points" => format!("{FIELD}.positions"),
            name => field(name),
        };
        invalid(
            "VALUE_OUT_OF_RANGE",
            field,
            error.fault,
            "see the field's description",
        )
    })
}

fn frames(
    given: &v1::Frames,
    count: usize,
    surface: Option<&engine::Surface>,
) -> Result<engine::FrameSpec> {
    let field = |name: &str| format!("{FIELD}.frames.{name}");
    let orientations = tuples(
        given.orientations.as_ref(),
        &field("orientations"),
        "w, x, y and z",
    )?;
    // The engine checks that the length is 1.
    let unit = |[w, x, y, z]: [f64; 4]| UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    let orientations = broadcast(orientations, count);
    let spins = each_vector(given.spins.as_ref(), &field("spins"), count)?;
    let moments = each_vector(given.moments.as_ref(), &field("moments"), count)?;
    Ok(engine::FrameSpec {
        orientations: match orientations {
            Some(given) => given.into_iter().map(unit).collect(),
            None => surface.map_or_else(
                || vec![UnitQuaternion::identity(); count],
                |surface| surface.orientations.clone(),
            ),
        },
        spins: spins.unwrap_or_else(|| vec![Vector3::zeros(); count]),
        moments: moments.unwrap_or_default(),
        damping: given.damping,
    })
}

fn links_of(given: v1::Links, field: &str) -> Result<engine::Links> {
    use v1::links::Law;
    let ends = pairs(given.ends.as_ref(), &format!("{field}.ends"))?;
    let count = ends.len();
    let law = given
        .law
        .ok_or_else(|| missing(&format!("{field}.law"), LINKS))?;
    let required = |column: Option<&v1::Reals>, name: &str| {
        Ok::<_, crate::error::ServiceError>(
            each(column, &format!("{field}.{name}"), count)?.unwrap_or_default(),
        )
    };
    let law = match law {
        Law::Spring(given) => engine::LinkLaw::Spring(elastic(
            [given.stiffness, given.damping, given.rest_lengths],
            &format!("{field}.spring"),
            count,
        )?),
        Law::Contact(given) => engine::LinkLaw::Contact(elastic(
            [given.stiffness, given.damping, given.rest_lengths],
            &format!("{field}.contact"),
            count,
        )?),
        Law::Breaking(given) => engine::LinkLaw::Breaking {
            elongations: required(given.elongations.as_ref(), "breaking.elongations")?,
            elastic: elastic(
                [given.stiffness, given.damping, given.rest_lengths],
                &format!("{field}.breaking"),
                count,
            )?,
        },
        Law::Plastic(given) => engine::LinkLaw::Plastic {
            yields: required(given.yields.as_ref(), "plastic.yields")?,
            elastic: elastic(
                [given.stiffness, given.damping, given.rest_lengths],
                &format!("{field}.plastic"),
                count,
            )?,
        },
        Law::Friction(given) => engine::LinkLaw::Friction {
            stiffness: required(given.stiffness.as_ref(), "friction.stiffness")?,
            limits: required(given.limits.as_ref(), "friction.limits")?,
        },
        Law::Table(given) => engine::LinkLaw::Table {
            lengths: reals(given.lengths.as_ref(), &format!("{field}.table.lengths"))?,
            forces: reals(given.forces.as_ref(), &format!("{field}.table.forces"))?,
        },
    };
    Ok(engine::Links { ends, law })
}

/// Stiffness, damping and rest lengths.
fn elastic(
    [stiffness, damping, rest_lengths]: [Option<v1::Reals>; 3],
    field: &str,
    links: usize,
) -> Result<engine::Elastic> {
    let column = |given: Option<v1::Reals>, name: &str| {
        each(given.as_ref(), &format!("{field}.{name}"), links)
    };
    Ok(engine::Elastic {
        stiffness: column(stiffness, "stiffness")?.unwrap_or_default(),
        damping: column(damping, "damping")?.unwrap_or_default(),
        rest_lengths: column(rest_lengths, "rest_lengths")?,
    })
}

fn pair_spec(
    given: v1::Pairs,
    count: usize,
    surface: Option<&engine::Surface>,
) -> Result<engine::PairSpec> {
    let field = |name: &str| format!("{FIELD}.pairs.{name}");
    let bonds = given.bonds.as_ref();
    Ok(engine::PairSpec {
        attraction: (given.attraction.map(|given| attraction(given, count))).transpose()?,
        form: (given.form.map(|given| form(&given, count, surface))).transpose()?,
        friction: given.friction.map(|friction| engine::PairFriction {
            sliding: friction.sliding,
            turning: friction.turning,
        }),
        reach: given.reach,
        bonds: bonds
            .map(|bonds| pairs(Some(bonds), &field("bonds")))
            .transpose()?,
        repulsion: given.repulsion.map(|repulsion| engine::Repulsion {
            strength: repulsion.strength,
            length: repulsion.length,
            reach: if repulsion.reach == 0.0 {
                REPULSION_REACH * repulsion.length
            } else {
                repulsion.reach
            },
        }),
        objects: indices(given.objects.as_ref(), &field("objects"))?,
        kinds: indices(given.kinds.as_ref(), &field("kinds"))?,
        skin: (given.skin != 0.0).then_some(given.skin),
    })
}

fn attraction(given: v1::Attraction, count: usize) -> Result<engine::Attraction> {
    use v1::attraction::Law;
    let field = format!("{FIELD}.pairs.attraction");
    let law = given
        .law
        .ok_or_else(|| missing(&format!("{field}.law"), PAIRS))?;
    Ok(engine::Attraction {
        law: match law {
            Law::LennardJones(law) => engine::AttractionLaw::LennardJones {
                stiffness: law.stiffness,
                rest_length: law.rest_length,
                exponent: law.exponent,
            },
            Law::TwelveSix(law) => engine::AttractionLaw::TwelveSix {
                depth: law.depth,
                size: law.size,
            },
            Law::Cohesion(law) => engine::AttractionLaw::Cohesion {
                stiffness: law.stiffness,
                rest_length: law.rest_length,
                sharpness: law.sharpness,
            },
            Law::DirectedCohesion(law) => {
                let field = format!("{field}.directed_cohesion.radii");
                engine::AttractionLaw::DirectedCohesion {
                    stiffness: law.stiffness,
                    sharpness: law.sharpness,
                    radii: each_vector(law.radii.as_ref(), &field, count)?.unwrap_or_default(),
                }
            }
        },
        ending: match known::<v1::Ending>(given.ending, &format!("{field}.ending"))? {
            v1::Ending::Unspecified | v1::Ending::Shifted => engine::EndingKind::Shifted,
            v1::Ending::Sharp => engine::EndingKind::Sharp,
        },
        table: (given.table != 0.0).then_some(given.table),
    })
}

fn form(given: &v1::Form, count: usize, surface: Option<&engine::Surface>) -> Result<engine::Form> {
    use v1::{Gradient, Normalisation, form::Weighting};
    let field = |name: &str| format!("{FIELD}.pairs.form.{name}");
    let along = "the curvatures along y and z";
    let curvatures = tuples(given.curvatures.as_ref(), &field("curvatures"), along)?;
    Ok(engine::Form {
        form: given.form,
        coplanarity: given.coplanarity,
        conormality: given.conormality,
        cocircularity: given.cocircularity,
        curvatures: broadcast(curvatures, count).unwrap_or_else(|| {
            surface.map_or_else(
                || vec![[0.0; 2]; count],
                |surface| surface.curvatures.clone(),
            )
        }),
        weighting: match given.weighting {
            None => engine::FormWeighting::One,
            Some(Weighting::Gaussian(width)) => engine::FormWeighting::Gaussian { width },
            Some(Weighting::Wendland(reach)) => engine::FormWeighting::Wendland { reach },
        },
        normalisation: match known(given.normalisation, &field("normalisation"))? {
            Normalisation::Unspecified | Normalisation::SquaredDistance => {
                engine::Normalisation::SquaredDistance
            }
            Normalisation::None => engine::Normalisation::None,
        },
        gradient: match known(given.gradient, &field("gradient"))? {
            Gradient::Unspecified | Gradient::Whole => engine::Gradient::Whole,
            Gradient::WithoutWeight => engine::Gradient::WithoutWeight,
        },
    })
}

fn track(given: Option<v1::Track>, field: &str) -> Result<engine::Track> {
    let given = given.unwrap_or_default();
    Ok(engine::Track {
        times: reals(given.times.as_ref(), &format!("{field}.times"))?,
        values: vectors(given.values.as_ref(), &format!("{field}.values"))?,
    })
}

pub(super) fn vector(given: Option<v1::Vector3>) -> Vector3<f64> {
    let given = given.unwrap_or_default();
    Vector3::new(given.x, given.y, given.z)
}

/// Two particles for each link.
fn pairs(given: Option<&v1::Indices>, field: &str) -> Result<Vec<[u32; 2]>> {
    let ends = indices(given, field)?;
    let (pairs, odd) = ends.as_chunks::<2>();
    if odd.is_empty() {
        return Ok(pairs.to_vec());
    }
    let problem = format!("has {} numbers", ends.len());
    let remedy = "give two particles for each";
    Err(invalid("LENGTH_MISMATCH", field, problem, remedy))
}

/// N numbers for each of something.
fn tuples<const N: usize>(
    given: Option<&v1::Reals>,
    field: &str,
    what: &str,
) -> Result<Vec<[f64; N]>> {
    let numbers = reals(given, field)?;
    let (tuples, odd) = numbers.as_chunks::<N>();
    if odd.is_empty() {
        return Ok(tuples.to_vec());
    }
    let problem = format!("has {} numbers", numbers.len());
    Err(invalid(
        "LENGTH_MISMATCH",
        field,
        problem,
        format!("give {what} for each"),
    ))
}

/// One for all stands for every one; none is `None`. Other lengths are checked by the engine.
fn broadcast<T: Clone>(given: Vec<T>, count: usize) -> Option<Vec<T>> {
    match given.as_slice() {
        [] => None,
        [one] => Some(vec![one.clone(); count]),
        [..] => Some(given),
    }
}

pub(super) fn each(
    given: Option<&v1::Reals>,
    field: &str,
    count: usize,
) -> Result<Option<Vec<f64>>> {
    Ok(broadcast(reals(given, field)?, count))
}

pub(super) fn each_vector(
    given: Option<&v1::Reals>,
    field: &str,
    count: usize,
) -> Result<Option<Vec<Vector3<f64>>>> {
    Ok(broadcast(vectors(given, field)?, count))
}
