//! Distances along paths over a mesh, and from the cells that have them to the vertices.

use rayon::prelude::*;

use crate::blocks::BLOCK;
use crate::distance::Distances;
use crate::filter::Demand;
use crate::flood::{Flood, NOBODY, Nearest};
use crate::reflood::Bounds;
use crate::{Graph, Root, Rows};

/// Floods that together show as much as a filter has to see. `[W7]`
#[derive(Clone, Debug)]
pub(crate) struct Floods(Vec<(Bounds, Nearest)>);

/// Distances along paths, in as much as a filter has to see of them. `[W7]`
pub(crate) fn along(graph: &Graph, roots: &[Root], coefficients: &[f64], demand: Demand) -> Floods {
    let up_to = |limit, count| {
        let flood = Flood {
            graph,
            roots,
            coefficients,
            limit,
        };
        (Bounds { count, limit }, flood.nearest(count))
    };
    let Demand {
        count,
        within,
        limit,
        grows: _,
    } = demand;
    if within < 0.0 {
        return Floods(vec![up_to(limit, count)]);
    }
    let mut floods = vec![up_to(limit.min(within), usize::MAX)];
    if count > 0 {
        floods.push(up_to(limit, count));
    }
    Floods(floods)
}

impl Floods {
    pub(crate) fn each(&self) -> &[(Bounds, Nearest)] {
        &self.0
    }

    /// The nodes that no flood reaches, ascending.
    pub(crate) fn unreached(&self) -> Vec<usize> {
        // The last one reaches all that any does.
        let last = self.0.last().map(|(_, flood)| flood);
        last.map_or_else(Vec::new, Nearest::unreached)
    }

    /// All that they show.
    pub(crate) fn distances(self) -> Distances {
        let mut each = self.0.into_iter().map(|(_, flood)| Distances::from(flood));
        let near = each.next().expect("a filter asks for something");
        match each.next() {
            None => near,
            Some(first) => gathered(near.len(), |row| [(&near, row), (&first, row)].into_iter()),
        }
    }
}

/// The points of the targets at each vertex, each at its least distance from them. `[W8]`
pub(crate) fn at_vertices(of_targets: &Distances, targets_of: &Rows) -> Distances {
    gathered(targets_of.len(), |vertex| {
        let targets = targets_of.row(vertex).iter();
        targets.map(|&target| (of_targets, target as usize))
    })
}

/// Rows of all points in the rows that are told of each, at their least distances.
fn gathered<'a, I: Iterator<Item = (&'a Distances, usize)>>(
    rows: usize,
    of: impl Fn(usize) -> I + Sync,
) -> Distances {
    let gather = |row: usize| -> Vec<(f64, u32)> {
        let mut entries: Vec<(u32, f64)> = Vec::new();
        for (distances, row) in of(row) {
            let row = row * distances.stride..row * distances.stride + distances.in_reach(row);
            let points = distances.points[row.clone()].iter().copied();
            entries.extend(points.zip(distances.squared[row].iter().copied()));
        }
        entries.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        entries.dedup_by_key(|entry| entry.0);
        let mut row: Vec<(f64, u32)> = entries.into_iter().map(|(point, d)| (d, point)).collect();
        row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        row
    };
    let rows: Vec<Vec<(f64, u32)>> = (0..rows)
        .into_par_iter()
        .with_min_len(BLOCK)
        .map(gather)
        .collect();
    Distances::of_rows(&rows)
}

/// The mean over the rows of the least distance in each, 1 where that is 0 or no row has one. `[W9]`
pub(crate) fn typical(distances: &Distances) -> f64 {
    let least = distances.squared.iter().step_by(distances.stride);
    let reached = least.filter(|squared| **squared < f64::INFINITY);
    let (sum, count) = reached.fold((0.0, 0), |(sum, count), d| (sum + d.sqrt(), count + 1));
    if sum > 0.0 {
        sum / f64::from(count)
    } else {
        1.0
    }
}

impl Nearest {
    /// The nodes that no source reaches, ascending.
    fn unreached(&self) -> Vec<usize> {
        let first = self.sources.iter().step_by(self.stride).enumerate();
        let unreached = first.filter(|(_, source)| **source == NOBODY);
        unreached.map(|(node, _)| node).collect()
    }
}

impl From<Nearest> for Distances {
    fn from(nearest: Nearest) -> Self {
        let Nearest {
            stride,
            sources: mut points,
            mut distances,
        } = nearest;
        for row in points.chunks_exact_mut(stride) {
            let pad = if row[0] == NOBODY { 0 } else { row[0] };
            row.iter_mut()
                .filter(|point| **point == NOBODY)
                .for_each(|point| *point = pad);
        }
        distances
            .iter_mut()
            .for_each(|distance| *distance *= *distance);
        Self {
            stride,
            points,
            squared: distances,
        }
    }
}

impl From<Distances> for Nearest {
    fn from(distances: Distances) -> Self {
        let Distances {
            stride,
            points: mut sources,
            mut squared,
        } = distances;
        for (source, squared) in sources.iter_mut().zip(&mut squared) {
            *squared = squared.sqrt();
            if *squared == f64::INFINITY {
                *source = NOBODY;
            }
        }
        Self {
            stride,
            sources,
            distances: squared,
        }
    }
}
