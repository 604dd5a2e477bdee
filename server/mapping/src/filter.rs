use crate::Filter;
use crate::distance::Distances;

impl Filter {
    /// How many of the nearest points the filter has to see to decide.
    pub(crate) fn demand(self) -> usize {
        match self {
            Self::KeepK(k) => k,
        }
    }
}

/// Which points each vertex keeps: the second stage.
pub(crate) fn filter(distances: Distances, filter: Filter) -> Distances {
    match filter {
        Filter::KeepK(k) => keep(distances, k),
    }
}

/// The k nearest of each row, which are its first. `[F1]`
fn keep(distances: Distances, k: usize) -> Distances {
    let Distances {
        stride,
        points,
        squared,
    } = distances;
    if stride <= k {
        return Distances {
            stride,
            points,
            squared,
        };
    }
    Distances {
        stride: k,
        points: first_of_each(&points, stride, k),
        squared: first_of_each(&squared, stride, k),
    }
}

fn first_of_each<T: Copy>(rows: &[T], stride: usize, k: usize) -> Vec<T> {
    let rows = rows.chunks_exact(stride);
    rows.flat_map(|row| &row[..k]).copied().collect()
}
