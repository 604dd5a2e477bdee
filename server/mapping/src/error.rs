use crate::{Dimension, MAX_BASIS, MAX_INFLUENCES, Polynomial, RadialFunction};

/// Vertices named in one refusal; more are counted.
const NAMED: usize = 8;

/// Why a mapping was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MappingError {
    /// No point has a rest position.
    #[error(
        "none of the {points} points has a rest position: give at least one that is seen at rest"
    )]
    NoUsablePoint {
        /// Number of points.
        points: usize,
    },
    /// A slice of the wrong length.
    #[error("there are {found} {what} where {expected} are expected")]
    Length {
        /// What the slice holds.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits the binding, or the other arguments.
        expected: usize,
    },
    /// A coordinate that is not a number, or so large that its square is none.
    #[error("{what} {index} has the coordinate {value}: give a finite one, in metres, below 1e100")]
    Coordinate {
        /// `vertex` or `point`.
        what: &'static str,
        /// Which one.
        index: usize,
        /// The coordinate, m.
        value: f64,
    },
    /// A length scale that is none.
    #[error(
        "the length scale is {scale}: give one above 0 (1e-100 to 1e100 m), or none for the spacing of the points"
    )]
    Scale {
        /// The scale, m.
        scale: f64,
    },
    /// A coefficient that is none.
    #[error("the coefficient of point {point} is {value}: give one from 0 to 1e30")]
    Coefficient {
        /// Which point.
        point: usize,
        /// Its coefficient.
        value: f64,
    },
    /// A filter that would keep no point.
    #[error("keeping 0 points per vertex moves nothing: keep at least 1")]
    KeepsNone,
    /// Distances between which there is nothing.
    #[error(
        "the interval goes from {nearest} m to {farthest} m: give 0 or more, then no less than that"
    )]
    Interval {
        /// Where it starts, m.
        nearest: f64,
        /// Where it ends, m.
        farthest: f64,
    },
    /// A distance that is none.
    #[error("the bound is {within} m: give a finite one, 0 or more")]
    Bound {
        /// The bound, m.
        within: f64,
    },
    /// Targets that no point reaches.
    #[error(
        "no point reaches {}: give each part of the mesh a point or a root in it, or weights by distance",
        named(*targets, cells)
    )]
    Unreached {
        /// What they are.
        targets: Dimension,
        /// Their indices, rising.
        cells: Vec<usize>,
    },
    /// Targets for which the filter leaves no point.
    #[error(
        "no point is left for {}: widen the filter, or keep at least one point whatever its distance",
        named(*targets, cells)
    )]
    KeepsNoneAt {
        /// What they are.
        targets: Dimension,
        /// Their indices, rising.
        cells: Vec<usize>,
    },
    /// Targets whose points lie in a plane, where the filter keeps four that span a volume.
    #[error(
        "no four points span a volume at {}: let more points through before this filter, or keep them by number",
        named(*targets, cells)
    )]
    SpansNone {
        /// What they are.
        targets: Dimension,
        /// Their indices, rising.
        cells: Vec<usize>,
    },
    /// Vertices without a target, and so without points.
    #[error(
        "there is no {} at {}: choose vertices as targets, or take these away",
        name(*targets), named(Dimension::Vertex, vertices)
    )]
    NoTargets {
        /// What the targets are.
        targets: Dimension,
        /// The vertices, rising.
        vertices: Vec<usize>,
    },
    /// Paths from cells to cells of the same kind, where those of another have to join them.
    #[error(
        "the arcs are of the same dimension as the targets: choose cells of another to join them"
    )]
    Arcs,
    /// A radius that is none.
    #[error("the radius of the ball is {radius} m: give one above 0, at most 1e100")]
    Radius {
        /// The radius, m.
        radius: f64,
    },
    /// More pairs of vertex and point than a binding may hold.
    #[error(
        "{vertices} vertices with {kept} points each are more than {MAX_INFLUENCES} pairs: keep fewer points per vertex"
    )]
    TooLarge {
        /// Number of vertices.
        vertices: usize,
        /// Points kept per vertex.
        kept: usize,
    },
    /// A share of the affine or quadratic map that is none.
    #[error("beta is {beta}: give one from 0 (rigid) to 1")]
    Beta {
        /// The share.
        beta: f64,
    },
    /// Vertices whose points lie in a plane, where a volume is needed.
    #[error(
        "no four of the points kept span a volume at {}: keep more points, or use shape matching, which needs no volume",
        named(Dimension::Vertex, vertices)
    )]
    Flat {
        /// The vertices, rising.
        vertices: Vec<usize>,
    },
    /// A radial function with too low a polynomial to have a unique interpolation.
    #[error(
        "the radial function {function:?} with the polynomial {found:?} need not have a solution: use at least {needed:?}"
    )]
    Polynomial {
        /// The function.
        function: RadialFunction,
        /// The polynomial asked for.
        found: Polynomial,
        /// The lowest one with which every set of points has a solution.
        needed: Polynomial,
    },
    /// More points in one interpolation than may be.
    #[error(
        "an interpolation of {points} points is more than {MAX_BASIS}: use fewer points, or keep fewer per vertex"
    )]
    ManyPoints {
        /// Points of the interpolation.
        points: usize,
    },
    /// An interpolation whose solution would be noise.
    #[error(
        "the interpolation at vertex {vertex} has the condition number {condition:.1e}, beyond 1e12: use a smaller scale or fewer points"
    )]
    Condition {
        /// A vertex that the interpolation moves.
        vertex: usize,
        /// Greatest over least absolute eigenvalue.
        condition: f64,
    },
    /// A neighbour that is no node.
    #[error("an arc leads to node {node}, and there are {nodes} nodes: give the index of a node")]
    Node {
        /// The neighbour.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A cost of an arc that is none.
    #[error("the cost of arc {arc} is {value}: give one from 0 to 1e100")]
    Cost {
        /// Which arc.
        arc: usize,
        /// Its cost.
        value: f64,
    },
    /// Weights beyond the numbers there are.
    #[error("the weights of vertex {vertex} overflow: use a greater scale, or bring it nearer")]
    Overflow {
        /// The vertex.
        vertex: usize,
    },
}

fn name(cell: Dimension) -> &'static str {
    match cell {
        Dimension::Vertex => "vertex",
        Dimension::Edge => "edge",
        Dimension::Face => "face",
        Dimension::Volume => "volume",
    }
}

fn named(kind: Dimension, cells: &[usize]) -> String {
    let list: Vec<String> = cells.iter().take(NAMED).map(usize::to_string).collect();
    let list = list.join(", ");
    let one = name(kind);
    let many = match kind {
        Dimension::Vertex => "vertices",
        Dimension::Edge => "edges",
        Dimension::Face => "faces",
        Dimension::Volume => "volumes",
    };
    match cells.len() {
        1 => format!("{one} {list}"),
        n if n <= NAMED => format!("{many} {list}"),
        n => format!("{n} {many}, {list}, …"),
    }
}
