use crate::distance::Distances;
use crate::{Filter, MappingError};

impl Filter {
    /// How many of the nearest points the filter has to see to decide.
    ///
    /// # Errors
    /// A filter that keeps nothing whatever the points.
    pub(crate) fn demand(self) -> Result<usize, MappingError> {
        match self {
            Self::KeepK(0) | Self::KeepAtLeast { k: 0, .. } => Err(MappingError::KeepsNone),
            Self::KeepK(k) => Ok(k),
            Self::Interval { nearest, farthest } if !(0.0..=farthest).contains(&nearest) => {
                Err(MappingError::Interval { nearest, farthest })
            }
            Self::KeepAtLeast { within, .. } if !(0.0..=f64::MAX).contains(&within) => {
                Err(MappingError::Bound { within })
            }
            Self::Interval { .. } | Self::KeepAtLeast { .. } => Ok(usize::MAX),
        }
    }
}

/// Which points each vertex keeps: the second stage.
///
/// # Errors
/// [`MappingError::KeepsNoneAt`] with the vertices that would keep none.
pub(crate) fn filter(distances: Distances, filter: Filter) -> Result<Distances, MappingError> {
    let kept = select(distances, filter);
    let empty: Vec<usize> = (0..kept.points.len() / kept.stride)
        .filter(|&vertex| kept.in_reach(vertex) == 0)
        .collect();
    if empty.is_empty() {
        Ok(kept)
    } else {
        Err(MappingError::KeepsNoneAt { vertices: empty })
    }
}

/// The points that each vertex keeps, if any.
pub(crate) fn select(distances: Distances, filter: Filter) -> Distances {
    match filter {
        Filter::KeepK(k) if distances.stride <= k => distances,
        Filter::KeepK(k) => retain(&distances, |rank, _| rank < k), // [F1]
        Filter::Interval { nearest, farthest } => {
            let squares = nearest * nearest..=farthest * farthest;
            retain(&distances, |_, squared| squares.contains(&squared)) // [F2]
        }
        Filter::KeepAtLeast { k, within } => {
            let most = within * within;
            retain(&distances, |rank, squared| rank < k || squared <= most) // [F3]
        }
    }
}

/// The entries of each row in reach that satisfy `keep(rank, squared distance)`, in rows as long as the longest.
fn retain(distances: &Distances, keep: impl Fn(usize, f64) -> bool) -> Distances {
    let rows = || {
        let rows = distances.points.chunks_exact(distances.stride);
        rows.zip(distances.squared.chunks_exact(distances.stride))
            .map(|(points, squared)| {
                let row = points.iter().copied().zip(squared.iter().copied());
                let in_reach = row.filter(|(_, squared)| *squared < f64::INFINITY);
                (in_reach.enumerate())
                    .filter(|&(rank, (_, squared))| keep(rank, squared))
                    .map(|(_, entry)| entry)
            })
    };
    let stride = rows().map(Iterator::count).max().unwrap_or(1).max(1);
    let size = distances.points.len() / distances.stride * stride;
    let mut kept = Distances {
        stride,
        points: Vec::with_capacity(size),
        squared: Vec::with_capacity(size),
    };
    for row in rows() {
        let end = kept.points.len() + stride;
        let start = kept.points.len();
        for (point, squared) in row {
            kept.points.push(point);
            kept.squared.push(squared);
        }
        let pad = kept.points.get(start).copied().unwrap_or(0);
        kept.points.resize(end, pad);
        kept.squared.resize(end, f64::INFINITY);
    }
    kept
}
