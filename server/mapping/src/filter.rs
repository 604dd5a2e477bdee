use nalgebra::Vector3;
use rayon::prelude::*;

use crate::barycentric::four;
use crate::blocks::BLOCK;
use crate::distance::Distances;
use crate::{Dimension, Filter, MappingError, Rows};

/// Nearest points in which four that span a volume are looked for at first.
const CANDIDATES: usize = 16;

/// What a filter has to see to decide: nothing else need be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Demand {
    /// So many of the nearest.
    pub(crate) count: usize,
    /// And all up to this distance; below 0 where that does not matter.
    pub(crate) within: f64,
    /// But none beyond this distance.
    pub(crate) limit: f64,
    /// Whether more of the nearest may help where it fails.
    pub(crate) grows: bool,
}

impl Demand {
    fn nearest(count: usize) -> Self {
        Self {
            count,
            within: -1.0,
            limit: f64::INFINITY,
            grows: false,
        }
    }
}

impl Filter {
    /// # Errors
    /// A filter that keeps nothing whatever the points, or a distance that is none.
    pub(crate) fn check(&self) -> Result<(), MappingError> {
        match *self {
            Self::KeepK(0) | Self::KeepAtLeast { k: 0, .. } => Err(MappingError::KeepsNone),
            Self::Interval { nearest, farthest } if !(0.0..=farthest).contains(&nearest) => {
                Err(MappingError::Interval { nearest, farthest })
            }
            Self::KeepAtLeast { within, .. } | Self::FourSpanning { within }
                if !(0.0..=f64::MAX).contains(&within) =>
            {
                Err(MappingError::Bound { within })
            }
            Self::Sequence(ref stages) => stages.iter().try_for_each(Self::check),
            Self::KeepK(_)
            | Self::Interval { .. }
            | Self::KeepAtLeast { .. }
            | Self::InVolume
            | Self::FourSpanning { .. } => Ok(()),
        }
    }

    pub(crate) fn demand(&self) -> Demand {
        demand(std::slice::from_ref(self))
    }

    /// Whether it asks which volumes hold a point.
    #[must_use]
    pub fn needs_volumes(&self) -> bool {
        match self {
            Self::InVolume => true,
            Self::Sequence(stages) => stages.iter().any(Self::needs_volumes),
            Self::KeepK(_)
            | Self::Interval { .. }
            | Self::KeepAtLeast { .. }
            | Self::FourSpanning { .. } => false,
        }
    }
}

fn demand(stages: &[Filter]) -> Demand {
    match stages {
        [] | [Filter::InVolume, ..] => Demand::nearest(usize::MAX),
        [Filter::Sequence(first), rest @ ..] => {
            let mut stages = first.clone();
            stages.extend_from_slice(rest);
            demand(&stages)
        }
        &[Filter::KeepK(count), ..] => Demand::nearest(count),
        &[Filter::KeepAtLeast { k, within }, ..] => Demand {
            within,
            ..Demand::nearest(k)
        },
        &[Filter::FourSpanning { within }, ..] => Demand {
            within: if within > 0.0 { within } else { -1.0 },
            grows: true,
            ..Demand::nearest(CANDIDATES)
        },
        // What comes next sees all that is nearer too, so that the nearest that it asks for are enough.
        [
            Filter::Interval {
                nearest: 0.0,
                farthest,
            },
            next,
            rest @ ..,
        ] => {
            let next = demand(&[std::slice::from_ref(next), rest].concat());
            Demand {
                limit: next.limit.min(*farthest),
                ..next
            }
        }
        &[Filter::Interval { farthest, .. }, ..] => Demand {
            count: 0,
            within: farthest,
            limit: farthest,
            grows: false,
        },
    }
}

/// What filters are told beside distances.
pub(crate) struct Surroundings<'a> {
    pub(crate) targets: Dimension,
    /// m
    pub(crate) points: &'a [Vector3<f64>],
    /// Of each point the targets of the volumes that hold it, ascending.
    pub(crate) holding: Option<&'a Rows>,
}

/// Which points each target keeps: the second stage.
///
/// # Errors
/// [`MappingError::KeepsNoneAt`] or [`MappingError::SpansNone`] with the targets that would keep none.
pub(crate) fn filter(
    distances: Distances,
    filter: &Filter,
    around: &Surroundings<'_>,
) -> Result<Distances, MappingError> {
    if let Filter::Sequence(stages) = filter {
        let each = |distances, stage| self::filter(distances, stage, around);
        return stages.iter().try_fold(distances, each);
    }
    let kept = select(distances, filter, around);
    let cells = kept.empty();
    let targets = around.targets;
    if cells.is_empty() {
        Ok(kept)
    } else if let Filter::FourSpanning { .. } = filter {
        Err(MappingError::SpansNone { targets, cells })
    } else {
        Err(MappingError::KeepsNoneAt { targets, cells })
    }
}

/// The points that each target keeps, if any.
///
/// # Panics
/// If the filter needs volumes and is told none.
pub(crate) fn select(
    distances: Distances,
    filter: &Filter,
    around: &Surroundings<'_>,
) -> Distances {
    match *filter {
        Filter::KeepK(k) if distances.stride <= k => distances,
        Filter::KeepK(k) => retain(&distances, |entry| entry.rank < k), // [F1]
        Filter::Interval { nearest, farthest } => {
            let squares = nearest * nearest..=farthest * farthest;
            retain(&distances, |entry| squares.contains(&entry.squared)) // [F2]
        }
        Filter::KeepAtLeast { k, within } => {
            let most = within * within;
            retain(&distances, |entry| entry.rank < k || entry.squared <= most) // [F3]
        }
        Filter::InVolume => {
            let holding = around
                .holding
                .expect("the mesh tells which volumes hold a point");
            retain(&distances, |entry| {
                let held = holding.row(entry.point as usize);
                u32::try_from(entry.target).is_ok_and(|target| held.binary_search(&target).is_ok())
            }) // [F4]
        }
        Filter::FourSpanning { within } => {
            let most = if within > 0.0 { within * within } else { -1.0 };
            let fours: Vec<Option<[u32; 4]>> =
                (distances.points.par_chunks_exact(distances.stride))
                    .enumerate()
                    .with_min_len(BLOCK)
                    .map(|(target, row)| four(&row[..distances.in_reach(target)], around.points))
                    .collect();
            retain(&distances, |entry| {
                let four = fours[entry.target].as_ref();
                four.is_some_and(|four| four.contains(&entry.point) || entry.squared <= most)
            }) // [F5]
        }
        Filter::Sequence(ref stages) => {
            let each = |distances, stage| select(distances, stage, around);
            stages.iter().fold(distances, each)
        }
    }
}

/// A point that a target has in reach.
struct Reached {
    target: usize,
    /// How many of its points come before it.
    rank: usize,
    point: u32,
    squared: f64,
}

/// The entries of each row in reach that `keep` wants, in rows as long as the longest.
fn retain(distances: &Distances, keep: impl Fn(&Reached) -> bool) -> Distances {
    let rows = || {
        let rows = distances.points.chunks_exact(distances.stride);
        rows.zip(distances.squared.chunks_exact(distances.stride))
            .enumerate()
            .map(|(target, (points, squared))| {
                let row = points.iter().copied().zip(squared.iter().copied());
                let in_reach = row.filter(|(_, squared)| *squared < f64::INFINITY);
                let reached = in_reach
                    .enumerate()
                    .map(move |(rank, (point, squared))| Reached {
                        target,
                        rank,
                        point,
                        squared,
                    });
                reached.filter(&keep)
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
        for entry in row {
            kept.points.push(entry.point);
            kept.squared.push(entry.squared);
        }
        let pad = kept.points.get(start).copied().unwrap_or(0);
        kept.points.resize(end, pad);
        kept.squared.resize(end, f64::INFINITY);
    }
    kept
}
