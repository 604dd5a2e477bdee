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
    /// By distance at rest. `[W1]`
    Distance {
        /// The law.
        kernel: Kernel,
        /// Length scale, m, > 0; `None` for the mean distance of a usable point to its nearest neighbour elsewhere, or
        /// 1 m where all points share one place (no scale makes a difference then). `[W5]`
        scale: Option<f64>,
    },
}

/// A law of weight against distance r with length scale s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// exp(−(r/s)²/2) `[W2]`
    Gaussian,
    /// (s/r)² `[W3]`; the scale cancels when the weights are divided by their sum. A vertex on a point follows that point
    /// alone, or the mean of the points it is on.
    InverseSquare,
}

/// Which points each vertex keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The k with the greatest weights, k ≥ 1; ties go to the lower index; all, if there are fewer than k. `[F1]`
    KeepK(usize),
}

/// How the kept points move a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The weighted mean of their displacements. `[M1]`
    WeightedMean,
    /// The rigid motion that fits them best, all alike: their weights select but do not count. `[M2]` to `[M4]`
    ShapeMatching,
}
