/// Why a [`SystemSpec`](crate::SystemSpec) was refused: which field, and what is wrong with it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{field}` {fault}")]
pub struct SpecError {
    /// Path of the field in the specification, such as `links[2].spring.stiffness[7]`.
    pub field: String,
    /// What is wrong.
    pub fault: Fault,
}

/// What may be wrong with a field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A column does not have one entry for each of its owners.
    #[error("has {found} entries where there are {expected} {owner}: give one for each")]
    Length {
        /// Entries found.
        found: usize,
        /// Entries expected.
        expected: usize,
        /// What the column has one entry for, such as `particles`.
        owner: &'static str,
    },
    /// A number that the field does not admit.
    #[error("is {value}: it must be {rule}")]
    Value {
        /// The number.
        value: f64,
        /// What it should be.
        rule: &'static str,
    },
    /// An index of a particle that does not exist.
    #[error("names particle {index}, but there are {particles}: count from 0")]
    Index {
        /// The particle named.
        index: u32,
        /// Number of particles.
        particles: usize,
    },
    /// A link from a particle to itself.
    #[error("joins particle {particle} to itself: name two particles or remove the link")]
    SelfLink {
        /// The particle named twice.
        particle: u32,
    },
    /// Something that needs orientations in a system without.
    #[error("needs orientations, and the particles have none: give `frames`")]
    Unframed,
    /// Too many particles near each other.
    #[error("has more pairs within reach than memory should hold: shorten the reach")]
    Crowded,
    /// A particle that two things would move.
    #[error("names particle {particle}, which is {already}: let one of them go")]
    Twice {
        /// The particle.
        particle: u32,
        /// What moves it already.
        already: &'static str,
    },
}

/// A step that cannot be taken; the system stays as it was before it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Diverged {
    /// A particle would leave the range of numbers.
    #[error(
        "particle {particle} diverges in a step of {time_step} s: \
         steps below about {largest_stable_step} s are stable; take a smaller one, or softer or less damped links"
    )]
    Particle {
        /// The first particle whose position or velocity would not be finite.
        particle: usize,
        /// The step asked for, s.
        time_step: f64,
        /// [`System::largest_stable_step`](crate::System::largest_stable_step), s.
        largest_stable_step: f64,
    },
    /// The equations of an implicit step were not solved.
    #[error(
        "an implicit step of {time_step} s has no solution near its start (residual {residual:e}): take a smaller one"
    )]
    Unsolved {
        /// The step asked for, s.
        time_step: f64,
        /// What is left of the residual, as a fraction of its start.
        residual: f64,
    },
    /// Too many particles came near each other.
    #[error(
        "more particles are within reach of each other than memory should hold: shorten the reach"
    )]
    Crowded,
    /// More substeps would be needed than are allowed.
    #[error(
        "a step of {time_step} s needs substeps of {needed} s, more than the {most} that are allowed: \
         take a smaller step, or softer or less damped links"
    )]
    Substeps {
        /// The step asked for, s.
        time_step: f64,
        /// The substep that stability or the tolerance asks for, s.
        needed: f64,
        /// The most substeps allowed.
        most: u32,
    },
}
