use crate::MAX_INFLUENCES;

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
    /// A filter that would keep no point.
    #[error("keeping 0 points per vertex moves nothing: keep at least 1")]
    KeepsNone,
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
}
