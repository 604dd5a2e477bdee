/// Why a [`NetworkSpec`](crate::NetworkSpec) was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// A column does not have one entry per particle, or one per spring.
    #[error("`{column}` has {found} entries where there are {expected} {owner}: give one for each")]
    Length {
        /// Name of the column in the specification.
        column: &'static str,
        /// Entries found.
        found: usize,
        /// Entries expected.
        expected: usize,
        /// What the column has one entry for: `particles` or `springs`.
        owner: &'static str,
    },
    /// A number that its column does not admit.
    #[error("`{column}[{entry}]` is {value}: it must be {rule}")]
    Value {
        /// Name of the column in the specification.
        column: &'static str,
        /// Index into the column.
        entry: usize,
        /// The number.
        value: f64,
        /// What it should be.
        rule: &'static str,
    },
    /// A component of gravity that is not finite.
    #[error("`gravity` has the component {value}: it must be finite")]
    Gravity {
        /// The component, m/s².
        value: f64,
    },
    /// An index of a particle that does not exist.
    #[error("`{column}[{entry}]` names particle {index}, but there are {particles}: count from 0")]
    Index {
        /// Name of the column in the specification.
        column: &'static str,
        /// Index into the column.
        entry: usize,
        /// The particle named.
        index: u32,
        /// Number of particles.
        particles: usize,
    },
    /// A spring from a particle to itself.
    #[error(
        "`springs[{spring}]` joins particle {particle} to itself: name two particles or remove the spring"
    )]
    SelfSpring {
        /// Index of the spring.
        spring: usize,
        /// The particle named twice.
        particle: u32,
    },
}

/// A step that would have taken a particle out of the range of numbers; the network stays as it was before it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "particle {particle} diverges in a step of {time_step} s: \
     steps below about {largest_stable_step} s are stable; take a smaller one, or softer or less damped springs"
)]
pub struct Diverged {
    /// The first particle whose position or velocity would not be finite.
    pub particle: usize,
    /// The step asked for, s.
    pub time_step: f64,
    /// [`Network::largest_stable_step`](crate::Network::largest_stable_step), s.
    pub largest_stable_step: f64,
}
