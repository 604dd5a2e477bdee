//! Particles and links of a simulated network, one by one: their places and forces.

use nalgebra::Vector3;
use sinew_particles::{Link, System};

use crate::{
    build::refuse,
    scene::{Module, Probe, SceneError},
    world::{Source, World},
};

/// Probes that a scene may have: each is a line in a plot.
const PROBES: usize = 64;
/// Modules in one answer, so that it fits into a message of 4 MiB in double precision.
const AT_ONCE: usize = 32_768;

/// A probe, found in its system.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Found {
    Particle(usize),
    Link(Link),
}

impl Found {
    fn read(self, system: &System) -> Vector3<f64> {
        match self {
            Self::Particle(i) => system.positions()[i],
            Self::Link(link) => system.link_force(link),
        }
    }
}

/// Reads probes, in order.
pub(crate) fn read_all(probes: &[Found], source: &Source, readings: &mut Vec<Vector3<f64>>) {
    readings.clear();
    if let Source::Particles(system) = source {
        readings.extend(probes.iter().map(|probe| probe.read(system)));
    }
}

/// Finds a scene's probes, and reads them.
pub(crate) fn find(
    probes: &[Probe],
    source: &Source,
) -> Result<(Vec<Found>, Vec<Vector3<f64>>), SceneError> {
    if probes.len() > PROBES {
        return Err(refuse(
            "VALUE_OUT_OF_RANGE",
            "scene.probes",
            format!("has {} entries", probes.len()),
            format!("give at most {PROBES}; ReadModules reads any number"),
        ));
    }
    let each = |(i, Probe { name, module }): (usize, &Probe)| {
        let field = |name: &str| format!("scene.probes[{i}].{name}");
        if name.is_empty() {
            return Err(refuse(
                "FIELD_MISSING",
                field("name"),
                "is empty",
                "give it a name to be shown by",
            ));
        }
        if probes[..i].iter().any(|before| before.name == *name) {
            return Err(refuse(
                "LABEL_DUPLICATE",
                field("name"),
                format!("`{name}` names a probe before it"),
                "give each a name of its own",
            ));
        }
        let Source::Particles(system) = source else {
            return Err(refuse(
                "CONFLICT",
                format!("scene.probes[{i}]"),
                "reads a module, and the scene's points are streamed",
                "give particles that the server simulates, or no probes",
            ));
        };
        match *module {
            Module::Particle(particle) => {
                let particle = existing(particle, system, field("particle"))?;
                Ok(Found::Particle(particle))
            }
            Module::Link { batch, link } => {
                let links = batch_of(batch, system, || field("link.batch"))?;
                let found = system.link(batch, link);
                let found = found.ok_or_else(|| no_link(link, links, field("link.link")))?;
                Ok(Found::Link(found))
            }
        }
    };
    let found: Vec<_> = (probes.iter().enumerate())
        .map(each)
        .collect::<Result<_, _>>()?;
    let mut readings = Vec::new();
    read_all(&found, source, &mut readings);
    Ok((found, readings))
}

fn existing(particle: u32, system: &System, field: String) -> Result<usize, SceneError> {
    let count = system.positions().len();
    let known = Some(particle as usize).filter(|&i| i < count);
    known.ok_or_else(|| {
        let problem = format!("is {particle}, and there are {count} particles");
        refuse(
            "INDEX_OUT_OF_RANGE",
            field,
            problem,
            "give the index of one, from 0",
        )
    })
}

/// How many links a batch has.
fn batch_of(
    batch: u32,
    system: &System,
    field: impl FnOnce() -> String,
) -> Result<usize, SceneError> {
    let counts = system.link_counts();
    counts.get(batch as usize).copied().ok_or_else(|| {
        let problem = format!(
            "is {batch}, and there are {} batches of links",
            counts.len()
        );
        refuse(
            "INDEX_OUT_OF_RANGE",
            field(),
            problem,
            "give the index of one, from 0",
        )
    })
}

fn no_link(link: u32, links: usize, field: String) -> SceneError {
    let problem = format!("is {link}, and the batch has {links} links");
    refuse(
        "INDEX_OUT_OF_RANGE",
        field,
        problem,
        "give the index of one, from 0",
    )
}

/// Which modules to read; all of them where none is named.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Particles, by index.
    pub particles: Vec<u32>,
    /// Links.
    pub links: Vec<LinkSelection>,
}

/// Links of one batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkSelection {
    /// The batch, by index.
    pub batch: u32,
    /// The links, by index in the batch; empty for all.
    pub links: Vec<u32>,
}

/// Modules at the step last taken. Columns have one entry per particle read.
#[derive(Clone, Debug, PartialEq)]
pub struct Modules {
    /// Steps taken.
    pub step: u64,
    /// Simulated time, s.
    pub time_seconds: f64,
    /// The particles, by index.
    pub particles: Vec<u32>,
    /// m
    pub positions: Vec<Vector3<f64>>,
    /// m/s
    pub velocities: Vec<Vector3<f64>>,
    /// What acts on them save for gravity, N.
    pub forces: Vec<Vector3<f64>>,
    /// N m, world frame; empty where the particles have no orientation.
    pub torques: Vec<Vector3<f64>>,
    /// The links, batch by batch.
    pub links: Vec<LinkModules>,
}

/// Links of one batch. Columns have one entry per link read.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkModules {
    /// The batch, by index.
    pub batch: u32,
    /// The links, by index in the batch.
    pub links: Vec<u32>,
    /// Their particles.
    pub ends: Vec<[u32; 2]>,
    /// On the second of them, N.
    pub forces: Vec<Vector3<f64>>,
    /// Those of `links` that are broken.
    pub broken: Vec<u32>,
}

/// Why modules are not read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReadError {
    /// There are none.
    #[error(
        "the session's points are streamed by a client; modules are of particles that the server simulates"
    )]
    External,
    /// A module that is not there, or too many.
    #[error(transparent)]
    Refused(#[from] SceneError),
}

impl World {
    /// Reads modules at the step last taken, and changes nothing. Linear in the batches named, and where particles are read
    /// in all that acts.
    ///
    /// # Errors
    /// [`ReadError`].
    pub fn read_modules(&self, selection: &Selection) -> Result<Modules, ReadError> {
        let Source::Particles(system) = &self.source else {
            return Err(ReadError::External);
        };
        let Selection { particles, links } = whole(selection, system)?;
        let pick = |column: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            particles.iter().map(|&i| column[i as usize]).collect()
        };
        let [forces, torques] = if particles.is_empty() {
            Default::default()
        } else {
            system.loads()
        };
        Ok(Modules {
            step: self.frame.step,
            time_seconds: self.frame.time_seconds,
            positions: pick(system.positions()),
            velocities: pick(system.velocities()),
            forces: pick(&forces),
            torques: match torques.is_empty() {
                true => Vec::new(),
                false => pick(&torques),
            },
            links: links
                .into_iter()
                .map(|links| read_links(links, system))
                .collect(),
            particles,
        })
    }
}

/// The selection with every module named, all of which are there.
fn whole(selection: &Selection, system: &System) -> Result<Selection, SceneError> {
    let Selection { particles, links } = selection;
    let counts = system.link_counts();
    let all = particles.is_empty() && links.is_empty();
    let whole_batch = |batch| LinkSelection {
        batch,
        links: Vec::new(),
    };
    let particles_of = system.positions().len();
    let (wanted, selected): (usize, Vec<LinkSelection>) = match all {
        true => (
            particles_of,
            (0..).take(counts.len()).map(whole_batch).collect(),
        ),
        false => (particles.len(), links.clone()),
    };
    let mut total = wanted;
    for (i, LinkSelection { batch, links }) in selected.iter().enumerate() {
        let count = batch_of(*batch, system, || format!("links[{i}].batch"))?;
        total += if links.is_empty() { count } else { links.len() };
        let beyond = links.iter().position(|&link| link as usize >= count);
        if let Some(at) = beyond {
            return Err(no_link(links[at], count, format!("links[{i}].links[{at}]")));
        }
    }
    for (i, &particle) in particles.iter().enumerate() {
        existing(particle, system, format!("particles[{i}]"))?;
    }
    if total > AT_ONCE {
        let problem = format!("asks with `links` for {total} modules");
        let remedy = format!("name at most {AT_ONCE} at once");
        return Err(refuse("TOO_MANY_MODULES", "particles", problem, remedy));
    }
    let named = |given: &[u32], count: usize| match given.is_empty() {
        true => (0..).take(count).collect(),
        false => given.to_vec(),
    };
    Ok(Selection {
        particles: match all {
            true => named(&[], particles_of),
            false => particles.clone(),
        },
        links: (selected.iter())
            .map(|LinkSelection { batch, links }| LinkSelection {
                batch: *batch,
                links: named(links, counts[*batch as usize]),
            })
            .collect(),
    })
}

/// All of `links` are there.
fn read_links(LinkSelection { batch, links }: LinkSelection, system: &System) -> LinkModules {
    let index = batch as usize;
    let (ends, forces) = (system.link_ends(index), system.link_forces(index));
    let broken = system.broken_links(index);
    let picked = || links.iter().map(|&link| link as usize);
    LinkModules {
        batch,
        ends: picked().map(|link| ends[link]).collect(),
        forces: picked().map(|link| forces[link]).collect(),
        broken: (links.iter().copied())
            .filter(|&link| broken.get(link as usize).is_some_and(|&is| is))
            .collect(),
        links,
    }
}
