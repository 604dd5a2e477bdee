//! What the scenes of networks cost: they are read from their files.

use nalgebra::Vector3;
use serde::Deserialize;
use sinew_particles::{Driven, Elastic, LinkLaw, Links, System, SystemSpec, Track};

use super::Lab;
use crate::section::Failure;

const SCENES: [(&str, &str); 4] = [
    (
        "hanging chain",
        include_str!("../../../../../client/scenes/particles/hanging_chain.toml"),
    ),
    (
        "plastic bar",
        include_str!("../../../../../client/scenes/particles/plastic_bar.toml"),
    ),
    (
        "breaking net",
        include_str!("../../../../../client/scenes/particles/breaking_net.toml"),
    ),
    (
        "body of 40 (figure 7 on mappings)",
        include_str!("../../../../../client/scenes/particles/body_of_forty.toml"),
    ),
];

pub(super) fn time(lab: &mut Lab) -> Result<(), Failure> {
    for (name, text) in SCENES {
        let scene: File = toml::from_str(text)?;
        let dt = scene.time_step_seconds;
        let mut system = System::new(scene.motion.particles.spec()?)?;
        lab.time(name, &mut system, [(4.0 / dt).round(), dt])?;
    }
    Ok(())
}

/// What a network's scene file says of it.
#[derive(Deserialize)]
struct File {
    time_step_seconds: f64,
    motion: Motion,
}

#[derive(Deserialize)]
struct Motion {
    particles: Particles,
}

#[derive(Deserialize)]
struct Particles {
    positions: Column,
    masses: Column,
    fixed: Indices,
    #[serde(default)]
    gravity: Gravity,
    #[serde(default)]
    damping: f64,
    #[serde(default)]
    driven: Vec<Led>,
    links: Vec<Batch>,
}

#[derive(Deserialize, Default)]
struct Column {
    values: Vec<f64>,
}

#[derive(Deserialize)]
struct Indices {
    values: Vec<u32>,
}

#[derive(Deserialize, Default)]
struct Gravity {
    z: f64,
}

#[derive(Deserialize)]
struct Led {
    particle: u32,
    path: Path,
}

#[derive(Deserialize)]
struct Path {
    times: Column,
    values: Column,
}

#[derive(Deserialize)]
struct Batch {
    ends: Indices,
    spring: Option<Law>,
    plastic: Option<Law>,
    breaking: Option<Law>,
}

#[derive(Deserialize)]
struct Law {
    stiffness: Column,
    damping: Column,
    #[serde(default)]
    yields: Column,
    #[serde(default)]
    elongations: Column,
}

impl Column {
    /// One number stands for all.
    fn each(&self, count: usize) -> Vec<f64> {
        match self.values[..] {
            [one] => vec![one; count],
            _ => self.values.clone(),
        }
    }

    fn vectors(&self) -> Vec<Vector3<f64>> {
        self.values
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&v| v.into())
            .collect()
    }
}

impl Particles {
    fn spec(self) -> Result<SystemSpec, Failure> {
        let positions = self.positions.vectors();
        let count = positions.len();
        let driven = self.driven.into_iter().map(|led| Driven {
            particle: led.particle,
            path: Track {
                times: led.path.times.values,
                values: led.path.values.vectors(),
            },
        });
        Ok(SystemSpec {
            velocities: vec![Vector3::zeros(); count],
            masses: self.masses.each(count),
            fixed: self.fixed.values,
            driven: driven.collect(),
            gravity: Vector3::z() * self.gravity.z,
            damping: self.damping,
            links: self
                .links
                .into_iter()
                .map(Batch::links)
                .collect::<Result<_, _>>()?,
            positions,
            ..SystemSpec::default()
        })
    }
}

impl Batch {
    fn links(self) -> Result<Links, Failure> {
        let ends = self.ends.values.as_chunks::<2>().0.to_vec();
        let count = ends.len();
        let elastic = |law: &Law| Elastic {
            stiffness: law.stiffness.each(count),
            damping: law.damping.each(count),
            rest_lengths: None,
        };
        let law = match (self.spring, self.plastic, self.breaking) {
            (Some(law), None, None) => LinkLaw::Spring(elastic(&law)),
            (None, Some(law), None) => LinkLaw::Plastic {
                elastic: elastic(&law),
                yields: law.yields.each(count),
            },
            (None, None, Some(law)) => LinkLaw::Breaking {
                elastic: elastic(&law),
                elongations: law.elongations.each(count),
            },
            _ => return Err("a batch of links has no law that this report knows".into()),
        };
        Ok(Links { ends, law })
    }
}
