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

impl Recipe {
    /// Whether which points a vertex keeps, and how far they are, depends on its place and on the points alone.
    #[must_use]
    pub fn stands_alone(&self) -> bool {
        self.weighting.metric == Metric::Straight
            && self.weighting.targets == Dimension::Vertex
            && !self.filter.needs_volumes()
    }
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
    /// before; distances along paths, and from targets other than vertices, stay as they were at rest. Errors add up from step to step. A rule whose weights do not depend on where anything is (direct, mean,
    /// barycentric) gives the same as from the rest pose and costs no more.
    Previous,
}

/// How strongly a point acts on a cell of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weighting {
    /// What a distance is.
    pub metric: Metric,
    /// The cells that have distances, to which filters give points. A vertex follows all points that its cells keep, each
    /// at the least of its distances from them. `[W8]`
    pub targets: Dimension,
    /// The law of weight against distance.
    pub kernel: Kernel,
    /// Its length scale, > 0, in m, or in the unit of the costs of [`Metric::Paths`]. `None` for the mean distance of a
    /// usable point to its nearest neighbour elsewhere, or 1 m where all points share one place (no scale makes a
    /// difference then) `[W5]`; of paths, for the mean distance of a target to its nearest point, or 1 where all are
    /// on one. `[W9]`
    pub scale: Option<f64>,
    /// By what each point's distances are multiplied, before filters see them: a point with a great one acts less. One per
    /// point, 0 to 1e30; empty for 1 each. `[W6]`
    pub coefficients: Vec<f64>,
}

/// How many dimensions a cell of the mesh has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Dimension {
    /// A vertex.
    #[default]
    Vertex,
    /// An edge between two vertices.
    Edge,
    /// A face of a volume, or a surface cell.
    Face,
    /// A cell that encloses a volume.
    Volume,
}

/// What the distance between a point and a cell is.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Metric {
    /// From the point straight to the mean of the cell's vertices, at rest. `[W1]`
    #[default]
    Straight,
    /// Along the cheapest path over the mesh. `[W7]`
    Paths(Paths),
    /// Along the shortest way inside the body: straight, but for where that leaves it. `[W12]`
    Geodesics(Geodesics),
}

impl Metric {
    /// Where floods start, and how far that is from their points; `None` where there are none.
    pub(crate) fn starts(&self) -> Option<(Roots, Start)> {
        match *self {
            Self::Straight => None,
            Self::Paths(Paths { roots, start, .. })
            | Self::Geodesics(Geodesics { roots, start }) => Some((roots, start)),
        }
    }
}

/// The shortest ways from a point through the cells of a body, and over those of a shell, to the mean of a target's
/// vertices. `[W12]`
///
/// The cells are taken for convex. Ways are told to a few thousandths of their length in the mean, to a tenth near their
/// points, and to part of a cell within two cells of a point that roots do not surround.
#[derive(Clone, Debug, PartialEq)]
pub struct Geodesics {
    /// The vertices from which the ways of a point start. [`Roots::Containing`] tells most.
    pub roots: Roots,
    /// How far a root is from its point.
    pub start: Start,
}

/// Paths from a point over the targets of a weighting, from one to the next if an arc joins them. `[W7]`
#[derive(Clone, Debug, PartialEq)]
pub struct Paths {
    /// The cells that join two targets: those that bound both, or that both bound. Not the dimension of the targets.
    pub arcs: Dimension,
    /// Where the paths of a point start.
    pub roots: Roots,
    /// How far a root is from its point.
    pub start: Start,
    /// What an arc costs.
    pub cost: Cost,
}

/// The targets from which the paths of a point start, or the vertices for [`Metric::Geodesics`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Roots {
    /// The nearest; all of them, where others are as near to a relative 10⁻⁹.
    Nearest,
    /// All of the volumes that hold the point; the nearest, where none does.
    Containing,
    /// All at a distance of at most so many m, > 0; none, if there are none.
    Ball(f64),
}

/// How far a root is from its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Not at all: paths count from the roots.
    Zero,
    /// As far as straight, in m.
    Distance,
}

/// What an arc between two targets costs.
#[derive(Clone, Debug, PartialEq)]
pub enum Cost {
    /// 1: a distance is a number of steps.
    Hops,
    /// The distance between their means, m.
    Length,
    /// The mean of their sizes over the mean volume; the size of a target that encloses no volume is the mean of those
    /// that it bounds.
    Volume,
    /// Its length plus so many m, 0 to 1e100, for each radian by which the surface turns from one to the other: floods
    /// keep to flat parts. Inside the mesh nothing turns. `[W10]`
    Curvature(f64),
    /// The mean of both in this column, one per target, 0 to 1e100.
    Column(Vec<f64>),
}

/// A law of weight against distance r with length scale s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// exp(−(r/s)²/2) `[W2]`
    #[default]
    Gaussian,
    /// (s/r)² `[W3]`; the scale cancels when the weights are divided by their sum. A vertex on a point follows that point
    /// alone, or the mean of the points it is on.
    InverseSquare,
}

/// Which points each target keeps.
///
/// Every target has to keep one at least.
#[derive(Clone, Debug, PartialEq)]
pub enum Filter {
    /// The k with the greatest weights, k ≥ 1; ties go to the lower index; all, if there are fewer than k. `[F1]`
    KeepK(usize),
    /// Those at a distance, times their coefficient, from `nearest` to `farthest`, both included. `[F2]`
    Interval {
        /// In the unit of the distances, ≥ 0.
        nearest: f64,
        /// No less than `nearest`.
        farthest: f64,
    },
    /// Those at a distance, times their coefficient, of at most `within`, and as many more as make k, the nearest first. `[F3]`
    KeepAtLeast {
        /// ≥ 1
        k: usize,
        /// In the unit of the distances, ≥ 0, included.
        within: f64,
    },
    /// Those in a volume that the target bounds, or is. `[F4]`
    InVolume,
    /// The nearest four that span a volume, and all at a distance, times their coefficient, of at most `within`. `[F5]`
    FourSpanning {
        /// In the unit of the distances, ≥ 0; 0 for none but the four.
        within: f64,
    },
    /// Those that all of these keep, each of what the one before it has kept.
    Sequence(Vec<Filter>),
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
