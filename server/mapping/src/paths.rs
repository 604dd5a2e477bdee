//! Distances along paths over a mesh, and from the cells that have them to the vertices.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::blocks::BLOCK;
use crate::distance::Distances;
use crate::filter::Demand;
use crate::flood::{Flood, NOBODY, Nearest};
use crate::front::Medium;
use crate::reflood::Bounds;
use crate::{Graph, Root, Rows, Simplices};

/// Floods that together show as much as a filter has to see. `[W7]`
#[derive(Clone, Debug)]
pub(crate) struct Floods(Vec<(Bounds, Nearest)>);

/// What floods spread over.
#[derive(Clone, Copy)]
pub(crate) enum Ground<'a> {
    Graph(&'a Graph),
    Body(&'a Simplices),
}

impl Ground<'_> {
    /// Number of nodes.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Graph(graph) => graph.len(),
            Self::Body(simplices) => simplices.nodes(),
        }
    }

    /// Calls `visit` for the neighbours of a node, for some more than once.
    pub(crate) fn for_each_neighbour(&self, node: usize, visit: impl FnMut(u32)) {
        match self {
            Self::Graph(graph) => graph.neighbours(node).iter().copied().for_each(visit),
            Self::Body(simplices) => simplices.neighbours(node).for_each(visit),
        }
    }

    /// Distances of the nodes, in as much as a filter has to see of them. `[W7]`, `[W12]`
    pub(crate) fn floods(&self, roots: &[Root], coefficients: &[f64], demand: Demand) -> Floods {
        match self {
            Self::Graph(graph) => along(*graph, roots, coefficients, demand),
            Self::Body(simplices) => along(*simplices, roots, coefficients, demand),
        }
    }
}

fn along<M: Medium>(graph: &M, roots: &[Root], coefficients: &[f64], demand: Demand) -> Floods {
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

/// The distances of targets inside the body from those of their corners: as of one point that is straight as far from each
/// `[W13]`; where it has not come to all of them, by way of the nearest.
pub(crate) fn inside(
    of_corners: &Distances,
    corners: &Rows,
    places: &[Vector3<f64>],
    centres: &[Vector3<f64>],
    coefficients: &[f64],
) -> Distances {
    let factor = |point: u32| coefficients.get(point as usize).map_or(1.0, |c| c * c);
    let row = |(): &mut (), target: usize| {
        let corners = corners.row(target);
        let arm = |corner: u32| (places[corner as usize] - centres[target]).norm_squared();
        let arms: f64 = corners.iter().map(|&corner| arm(corner)).sum();
        let mut entries: Vec<(u32, f64, f64)> = Vec::new();
        for &corner in corners {
            let row = corner as usize * of_corners.stride;
            let row = row..row + of_corners.in_reach(corner as usize);
            let points = of_corners.points[row.clone()].iter();
            entries.extend(
                points
                    .zip(&of_corners.squared[row])
                    .map(|(&point, &squared)| {
                        let by_way = squared.sqrt() + (factor(point) * arm(corner)).sqrt();
                        (point, squared, by_way * by_way)
                    }),
            );
        }
        entries.sort_by_key(|entry| entry.0);
        let entries = entries.chunk_by(|a, b| a.0 == b.0).map(|of_point| {
            let point = of_point[0].0;
            let least = of_point.iter().map(|entry| entry.2);
            let least = least.fold(f64::INFINITY, f64::min);
            let squared = if of_point.len() == corners.len() {
                let sum: f64 = of_point.iter().map(|entry| entry.1).sum();
                ((sum - factor(point) * arms) / corners.len() as f64).clamp(0.0, least)
            } else {
                least
            };
            (squared, point)
        });
        sorted(entries.collect())
    };
    in_rows(corners.len(), row)
}

/// Rows of all points in the rows that are told of each, at their least distances.
fn gathered<'a, I: Iterator<Item = (&'a Distances, usize)>>(
    rows: usize,
    of: impl Fn(usize) -> I + Send + Sync,
) -> Distances {
    let gather = |least: &mut Vec<f64>, row: usize| -> Vec<(f64, u32)> {
        let mut points = Vec::new();
        for (distances, row) in of(row) {
            let row = row * distances.stride..row * distances.stride + distances.in_reach(row);
            let entries = distances.points[row.clone()].iter();
            for (&point, &squared) in entries.zip(&distances.squared[row]) {
                if point as usize >= least.len() {
                    least.resize(point as usize + 1, f64::INFINITY);
                }
                let least = &mut least[point as usize];
                if *least == f64::INFINITY {
                    points.push(point);
                }
                *least = least.min(squared);
            }
        }
        let entry = |point: u32| {
            let least = &mut least[point as usize];
            (std::mem::replace(least, f64::INFINITY), point)
        };
        sorted(points.into_iter().map(entry).collect())
    };
    in_rows(rows, gather)
}

/// Squared distances and points, nearest first, equal distances by point.
fn sorted(mut row: Vec<(f64, u32)>) -> Vec<(f64, u32)> {
    row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    row
}

/// So many rows, each sorted. `row` finds in its first argument what it left there.
fn in_rows<S: Default + Send>(
    rows: usize,
    row: impl Fn(&mut S, usize) -> Vec<(f64, u32)> + Send + Sync,
) -> Distances {
    let rows: Vec<Vec<(f64, u32)>> = (0..rows)
        .into_par_iter()
        .with_min_len(BLOCK)
        .map_init(S::default, row)
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
