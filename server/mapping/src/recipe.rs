/// How points drive vertices: weights, then a filter, then a rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// How strongly each point acts on each vertex.
    pub weighting: Weighting,
    /// Which points each vertex keeps.
    pub filter: Filter,
    /// How the kept points move the vertex.
    pub rule: Rule,
    /// From where displacements and shapes are measured.
    pub reference: Reference,
}

/// The frame of reference of a rule. `[M16]`
///
/// Which points a vertex keeps is decided at rest, once, in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reference {
    /// The rest pose: compiled once, and without drift.
    #[default]
    Initial,
    /// The last pose: weights, fits and systems are made anew each step from where vertices and points were in the step
    /// before. Errors add up from step to step. A rule whose weights do not depend on where anything is (direct, mean,
    /// barycentric) gives the same as from the rest pose and costs no more.
    Previous,
}

/// How strongly a point acts on a vertex.
#[derive(Clone, Debug, PartialEq)]
pub enum Weighting {
    /// By distance at rest. `[W1]`
    Distance {
        /// The law.
        kernel: Kernel,
        /// Length scale, m, > 0; `None` for the mean distance of a usable point to its nearest neighbour elsewhere, or
        /// 1 m where all points share one place (no scale makes a difference then). `[W5]`
        scale: Option<f64>,
        /// By what each point's distances are multiplied, before filters see them: a point with a great one acts less.
        /// One per point, 0 to 1e30; empty for 1 each. `[W6]`
        coefficients: Vec<f64>,
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
///
/// Every vertex has to keep one at least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// The k with the greatest weights, k ≥ 1; ties go to the lower index; all, if there are fewer than k. `[F1]`
    KeepK(usize),
    /// Those at a distance, times their coefficient, from `nearest` to `farthest`, m, both included. `[F2]`
    Interval {
        /// m, ≥ 0
        nearest: f64,
        /// m, no less than `nearest`.
        farthest: f64,
    },
    /// Those at a distance, times their coefficient, of at most `within`, and as many more as make k, the nearest first. `[F3]`
    KeepAtLeast {
        /// ≥ 1
        k: usize,
        /// m, ≥ 0, included.
        within: f64,
    },
}

/// How the kept points move the vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// The displacement of the nearest. `[M5]`
    Direct,
    /// The mean of their displacements, all alike. `[M6]`
    Mean,
    /// The weighted mean of their displacements. `[M1]`
    WeightedMean,
    /// The affine map of the nearest four that span a volume, inside their tetrahedron and out of it. `[M7]`
    Barycentric,
    /// The motion that fits them best, one for all vertices that keep the same points. `[M2]` to `[M4]`
    ShapeMatching(ShapeMatching),
    /// The motion that fits them best with the weights of each vertex. `[M14]`, `[M15]`
    MovingLeastSquares(MovingFit),
    /// The interpolation of their displacements by radial basis functions. `[M10]`
    RadialBasis(RadialBasis),
}

/// One motion per set of points. `[M2]` to `[M4]`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeMatching {
    /// Which motions there are to choose from.
    pub fit: Fit,
    /// How much each point counts.
    pub weights: FitWeights,
}

impl ShapeMatching {
    /// Every point counts alike.
    #[must_use]
    pub const fn alike(fit: Fit) -> Self {
        Self {
            fit,
            weights: FitWeights::Alike,
        }
    }
}

/// Which map fits the points of a cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fit {
    /// A rotation and a translation.
    Rigid,
    /// An affine map; where the points leave a direction open, it turns rigidly. `[M8]`
    Linear {
        /// How much of the affine map counts beside the rigid motion: 0 (rigid) to 1.
        beta: f64,
    },
    /// The quadratic map of least change from the affine one. `[M9]`
    Quadratic {
        /// How much of the quadratic map counts beside the rigid motion: 0 (rigid) to 1.
        beta: f64,
    },
}

/// How much the points of a cluster count in its fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitWeights {
    /// All alike: their weights select but do not count.
    Alike,
    /// By the mean of their weights over the cluster's vertices, in the misfit and in both centroids. `[M13]`
    ClusterMean,
}

/// Which map fits the points around a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovingFit {
    /// An affine map. Seen from a fixed reference it is linear in the displacements: one row of weights per vertex,
    /// as cheap as a weighted mean. In directions that the kept points do not span, displacements do not change. `[M14]`
    Affine,
    /// A rotation and a translation: one fit per vertex and step. `[M15]`
    Rigid,
}

/// An interpolation by one radial function at each point and a polynomial. `[M10]`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialBasis {
    /// The function.
    pub function: RadialFunction,
    /// Length scale s, m, > 0; `None` for a multiple of the distance between points, see [`RadialFunction`].
    pub scale: Option<f64>,
    /// What is reproduced exactly, whatever the function.
    pub polynomial: Polynomial,
}

/// A function of distance r with length scale s. `[M11]`
///
/// Without a scale, s is twice that of `[W5]`, and for [`RadialFunction::Wendland`] five times. The scale of the last
/// three makes no difference to the interpolation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RadialFunction {
    /// exp(−(r/s)²)
    Gaussian,
    /// √ln((r/s)² + e); needs a constant.
    ShiftedLog,
    /// √((r/s)² + 1); needs a constant.
    Multiquadric,
    /// 1/√((r/s)² + 1)
    InverseMultiquadric,
    /// 1/((r/s)² + 1)
    InverseQuadratic,
    /// (1 − r/s)⁴ (4 r/s + 1) for r < s, else 0: of class C² and of compact support.
    Wendland,
    /// (r/s)² ln(r/s); needs a linear polynomial.
    ThinPlate,
    /// (r/s)³; needs a linear polynomial.
    Cubic,
    /// r/s; needs a constant.
    Linear,
}

/// The polynomial of an interpolation, with its side conditions; a lower one comes before a higher one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Polynomial {
    /// None: not even a translation is exact.
    None,
    /// A constant: translations are exact.
    Constant,
    /// A linear one: affine maps are exact.
    Linear,
}
