//! Motion/geometry mapping.

/// How points drive vertices: weights, then a filter, then a rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// How strongly each point acts on each vertex.
    pub weighting: Weighting,
    /// Which points each vertex keeps.
    pub filter: Filter,
    /// How the kept points move the vertex.
    pub rule: Rule,
}

/// How strongly a point acts on a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weighting {
    /// By distance at rest; `scale` in m, `None` for the mean distance of a point to its nearest neighbour.
    Distance {
        /// The law.
        kernel: Kernel,
        /// Length scale, m.
        scale: Option<f64>,
    },
}

/// A law of weight against distance r with length scale s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// exp(-(r/s)²/2)
    Gaussian,
    /// (s/r)²
    InverseSquare,
}

/// Which points each vertex keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The k with the greatest weights.
    KeepK(usize),
}

/// How the kept points move a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The weighted mean of displacements.
    WeightedMean,
    /// The best rigid motion.
    ShapeMatching,
}
