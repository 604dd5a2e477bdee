//! The parts of cells that have a size: edges, faces, and the cells themselves.

use nalgebra::Vector3;
use sinew_mesh::{Cell, CellType, Face, cell_volume, face_area};

use super::cells::{Moment, Scale};
use crate::rule::Strain;

/// What is measured of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Lengths.
    Edges,
    /// Areas.
    Faces,
    /// The volume.
    Volume,
}

/// The parts of some cells, each once, with their sizes at rest.
#[derive(Clone, Debug)]
pub(crate) enum Parts {
    /// Ends, and the inverse of the length, 1/m.
    Edges(Vec<([u32; 2], f64)>),
    /// Rings of vertices, and the area, m².
    Faces(Vec<(Box<[u32]>, f64)>),
    /// Slots, and the volume, m³.
    Volumes(Vec<(u32, f64)>),
}

/// How some parts stand to a threshold.
pub(crate) struct Nearest {
    /// The greatest departure from rest among them. `[E1]`
    pub(crate) greatest: f64,
    /// How far two vertices of any part may move against each other before it can be at the threshold: in m, of edges in
    /// lengths at rest. `[E4]`
    pub(crate) slack: f64,
}

impl Strain {
    /// By how much of its size at rest a part of `ratio` times that size departs. `[E1]`
    pub(crate) fn of(self, ratio: f64) -> f64 {
        match self {
            Self::Elongation => ratio - 1.0,
            Self::Compression => 1.0 - ratio,
        }
    }
}

impl Parts {
    /// The parts of these cells that have a size at rest.
    pub(crate) fn of(kind: Kind, cells: &[u32], scale: &Scale<'_>) -> Self {
        let rest = scale.rest;
        let forms = || cells.iter().map(|&slot| scale.cells.cell(slot as usize));
        match kind {
            Kind::Edges => {
                let edges = forms().flat_map(|cell| cell.faces().flat_map(Face::edges));
                let mut edges: Vec<_> = edges.map(|[a, b]| [a.min(b), a.max(b)]).collect();
                edges.sort_unstable();
                edges.dedup();
                let sized = edges.into_iter().map(|ends| (ends, length(rest, ends)));
                let sized = sized.filter(|(_, length)| *length > 0.0);
                Self::Edges(sized.map(|(ends, length)| (ends, length.recip())).collect())
            }
            Kind::Faces => {
                let keyed = forms().flat_map(|cell| cell.faces()).map(|face| {
                    let mut set: Box<[u32]> = face.vertices().collect();
                    set.sort_unstable();
                    (set, face)
                });
                let mut keyed: Vec<_> = keyed.collect();
                keyed.sort_by(|(a, _), (b, _)| a.cmp(b));
                keyed.dedup_by(|(a, _), (b, _)| a == b);
                let sized = (keyed.iter())
                    .map(|(_, face)| (face.vertices().collect(), face_area(rest, face)));
                Self::Faces(sized.filter(|(_, area)| *area > 0.0).collect())
            }
            Kind::Volume => {
                let volume = |&slot: &u32| cell_volume(rest, &scale.cells.cell(slot as usize));
                let sized = cells.iter().map(|slot| (*slot, volume(slot)));
                Self::Volumes(sized.filter(|(_, volume)| *volume > 0.0).collect())
            }
        }
    }

    /// How near the parts are to a threshold. `[E1]` `[E4]`
    pub(crate) fn nearest(&self, strain: Strain, threshold: f64, moment: &Moment<'_>) -> Nearest {
        let x = moment.vertices;
        let (mut greatest, mut slack) = (f64::NEG_INFINITY, f64::INFINITY);
        match self {
            Self::Edges(edges) => {
                for &(ends, inverse) in edges {
                    greatest = greatest.max(strain.of(length(x, ends) * inverse));
                }
                slack = threshold - greatest;
            }
            Self::Faces(faces) => {
                for (ring, area) in faces {
                    let departs = strain.of(face_area(x, &Face::from(&ring[..])) / area);
                    greatest = greatest.max(departs);
                    let pieces = (ring.len() - 2) as f64;
                    let spare = 2.0 * (threshold - departs) * area / pieces;
                    let reach = reach(x, ring);
                    slack = slack.min((reach.powi(2) + spare).sqrt() - reach);
                }
            }
            Self::Volumes(volumes) => {
                for &(slot, volume) in volumes {
                    let cell = moment.scale.cells.cell(slot as usize);
                    let departs = strain.of(cell_volume(x, &cell) / volume);
                    greatest = greatest.max(departs);
                    let pieces = match cell.kind == CellType::Tetrahedron {
                        true => 1,
                        false => cell.faces().map(|face| face.len()).sum(),
                    };
                    let spare = 6.0 * (threshold - departs) * volume / pieces as f64;
                    let reach = reach(x, cell.vertices);
                    slack = slack.min((reach.powi(3) + spare).cbrt() - reach);
                }
            }
        }
        Nearest { greatest, slack }
    }

    /// The vertices of each part, and the unit of its [`Nearest::slack`], m.
    pub(crate) fn spans<'a>(&'a self, scale: &Scale<'a>) -> Vec<(&'a [u32], f64)> {
        match self {
            Self::Edges(edges) => {
                let span = |(ends, inverse): &'a ([u32; 2], f64)| (&ends[..], inverse.recip());
                edges.iter().map(span).collect()
            }
            Self::Faces(faces) => faces.iter().map(|(ring, _)| (&ring[..], 1.0)).collect(),
            Self::Volumes(volumes) => {
                let form = |slot: u32| scale.cells.cell(slot as usize).vertices;
                volumes.iter().map(|&(slot, _)| (form(slot), 1.0)).collect()
            }
        }
    }
}

/// The greatest departure from rest among a cell's parts; `None` where none has a size at rest. `[E1]`
pub(crate) fn worst(
    kind: Kind,
    strain: Strain,
    cell: &Cell<'_>,
    moment: &Moment<'_>,
) -> Option<f64> {
    let (x, rest) = (moment.vertices, moment.scale.rest);
    let departs = |size: f64, rest: f64| (rest > 0.0).then(|| strain.of(size / rest));
    let edge = |ends| {
        let rest = length(rest, ends);
        (rest > 0.0).then(|| strain.of(length(x, ends) * rest.recip()))
    };
    match kind {
        Kind::Edges => {
            let edges = cell.faces().flat_map(Face::edges);
            edges.filter_map(edge).reduce(f64::max)
        }
        Kind::Faces => {
            let areas = |face: Face<'_>| departs(face_area(x, &face), face_area(rest, &face));
            cell.faces().filter_map(areas).reduce(f64::max)
        }
        Kind::Volume => departs(cell_volume(x, cell), cell_volume(rest, cell)),
    }
}

fn length(x: &[Vector3<f64>], [a, b]: [u32; 2]) -> f64 {
    (x[a as usize] - x[b as usize]).norm()
}

/// The greatest distance of these vertices from their first, m.
fn reach(x: &[Vector3<f64>], vertices: &[u32]) -> f64 {
    let first = vertices[0];
    let distances = vertices.iter().map(|&vertex| length(x, [first, vertex]));
    distances.fold(0.0, f64::max)
}
