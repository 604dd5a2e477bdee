//! Which vertices two points hold between them.

use nalgebra::Vector3;
use sinew_mapping::Binding;
use sinew_topology::{Adjacency, Cell, Edge, Map, Place, Vertex};

use crate::Body;
use crate::body::number;
use crate::commit::Batch;

/// What a body is bound to, as of the last step.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Which points act on each vertex of the body.
    pub binding: &'a Binding,
    /// Where the points were when it was bound, m.
    pub points: &'a [Vector3<f64>],
    /// Where each vertex is now, m.
    pub now: &'a [Vector3<f64>],
}

/// How strong two points are at a vertex: 0 for its strongest point; `None` where a point does not act on it.
#[derive(Clone, Copy, Debug)]
struct Ranks {
    vertex: u32,
    of: [Option<u32>; 2],
}

/// The vertices that either of two points acts on.
#[derive(Clone, Debug)]
pub(crate) struct Areas {
    ranks: Vec<Ranks>,
}

/// On which side of the frontier between two points' areas the vertices are. `[T1]`
#[derive(Clone, Debug)]
pub(crate) struct Sides {
    /// By vertex slot: below in the first point's area, above in the second's, on in both, `None` in neither.
    places: Vec<Option<Place>>,
    /// The vertices in the smaller area, those in both included.
    smaller: Vec<u32>,
    points: [Vector3<f64>; 2],
}

/// A new vertex comes no nearer to an end of its edge than this part of it, lest slivers come of it.
const MARGIN: f64 = 0.05;

impl Areas {
    /// One look at each vertex.
    pub(crate) fn new(view: &View<'_>, batch: &Batch, vertices: usize, points: [u32; 2]) -> Self {
        let ranks = (0..number(vertices)).map(|vertex| Ranks {
            vertex,
            of: batch.ranks(view, vertex, points),
        });
        Self {
            ranks: ranks.filter(|ranks| ranks.of != [None; 2]).collect(),
        }
    }

    /// Which of the points acts on no vertex.
    pub(crate) fn missing(&self) -> Option<usize> {
        [0, 1]
            .into_iter()
            .find(|&at| self.ranks.iter().all(|ranks| ranks.of[at].is_none()))
    }

    /// How many points of a vertex make a difference.
    pub(crate) fn depth(&self) -> u32 {
        let ranks = self.ranks.iter().flat_map(|ranks| ranks.of).flatten();
        ranks.max().map_or(0, |rank| rank + 1)
    }

    /// The sides, if so many of each vertex's strongest points count. `[T3]`
    pub(crate) fn sides(&self, kept: u32, vertices: usize, points: [Vector3<f64>; 2]) -> Sides {
        let mut areas = [Vec::new(), Vec::new()];
        let mut places = vec![None; vertices];
        for ranks in &self.ranks {
            let counts = ranks.of.map(|rank| rank.is_some_and(|rank| rank < kept));
            for (area, _) in areas.iter_mut().zip(counts).filter(|(_, counts)| *counts) {
                area.push(ranks.vertex);
            }
            places[ranks.vertex as usize] = match counts {
                [true, true] => Some(Place::On),
                [true, false] => Some(Place::Below),
                [false, true] => Some(Place::Above),
                [false, false] => None,
            };
        }
        let [one, other] = areas;
        Sides {
            places,
            smaller: if one.len() <= other.len() { one } else { other },
            points,
        }
    }
}

impl Sides {
    /// Where a vertex lies, if either point acts on it. A vertex that is newer than the sides lies on the frontier.
    pub(crate) fn place(&self, vertex: usize) -> Option<Place> {
        let known = self.places.get(vertex);
        known.copied().unwrap_or(Some(Place::On))
    }

    /// How far a place is beyond the plane midway between the points, in units of their distance; below 0 before it.
    fn beyond(&self, place: &Vector3<f64>) -> f64 {
        let [one, other] = self.points;
        (place - (one + other) / 2.0).dot(&(other - one))
    }

    /// Where an edge meets the frontier: in the plane midway between the points if that crosses the edge, else halfway, and
    /// not too near to an end. `[T2]`
    pub(crate) fn crossing(&self, [from, to]: [Vector3<f64>; 2]) -> Vector3<f64> {
        let [before, after] = [self.beyond(&from), self.beyond(&to)];
        let part = before / (before - after);
        let crosses = (0.0..=1.0).contains(&part);
        from.lerp(
            &to,
            if crosses {
                part.clamp(MARGIN, 1.0 - MARGIN)
            } else {
                0.5
            },
        )
    }

    /// How many vertices there were.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// In each area, the vertex nearest to the other's point at rest.
    pub(crate) fn ends(&self, rest: &[Vector3<f64>]) -> [Option<usize>; 2] {
        let [one, other] = self.points;
        [(Place::Below, other), (Place::Above, one)].map(|(area, point)| {
            let all = self.places.iter().enumerate();
            let inside =
                all.filter(|(_, place)| **place == Some(area) || **place == Some(Place::On));
            let distance = |vertex: usize| (rest[vertex] - point).norm_squared();
            let nearest = inside.min_by(|(a, _), (b, _)| distance(*a).total_cmp(&distance(*b)));
            nearest.map(|(vertex, _)| vertex)
        })
    }

    /// The vertices in the smaller area that lie on the frontier or have an edge across it.
    pub(crate) fn border(
        &self,
        map: &Map,
        neighbours: &Adjacency<Vertex, Edge>,
    ) -> Vec<Cell<Vertex>> {
        let smaller = self
            .smaller
            .iter()
            .filter_map(|&vertex| map.cell_at(vertex as usize));
        let is_at_border = |vertex: &Cell<Vertex>| match self.place(vertex.index()) {
            None => false,
            Some(Place::On) => true,
            Some(here) => neighbours.of(*vertex).iter().any(|&next| {
                let there = self.place(next.index());
                there.is_some_and(|there| there != here && there != Place::On)
            }),
        };
        smaller.filter(is_at_border).collect()
    }

    /// Grows both areas by the vertices beside them, where both come by that of the nearer point. `[T4]` Returns whether
    /// any came.
    pub(crate) fn grow(&mut self, body: &Body) -> bool {
        let mut grown = Vec::new();
        for vertex in body.map.cells::<Vertex>() {
            if self.place(vertex.index()).is_some() {
                continue;
            }
            let near = body
                .neighbours_of(vertex)
                .iter()
                .filter_map(|&next| self.place(next.index()));
            let (mut below, mut above) = (false, false);
            for place in near {
                below |= place != Place::Above;
                above |= place != Place::Below;
            }
            grown.push(match (below, above) {
                (false, false) => continue,
                (true, false) => (vertex, Place::Below),
                (false, true) => (vertex, Place::Above),
                (true, true) if self.beyond(&body.rest[vertex.index()]) > 0.0 => {
                    (vertex, Place::Above)
                }
                (true, true) => (vertex, Place::Below),
            });
        }
        for &(vertex, place) in &grown {
            self.places[vertex.index()] = Some(place);
        }
        let all = (0..).zip(&self.places);
        let area = all.filter(|(_, place)| place.is_some_and(|place| place != Place::Above));
        self.smaller = area.map(|(vertex, _)| vertex).collect();
        !grown.is_empty()
    }
}

/// How strong two points are in a row of a binding.
pub(crate) fn ranks_in(binding: &Binding, vertex: usize, points: [u32; 2]) -> [Option<u32>; 2] {
    let mut found = [None; 2];
    binding.visit(vertex, |point, weight| {
        for (found, _) in found.iter_mut().zip(points).filter(|(_, of)| *of == point) {
            *found = (weight != 0.0).then_some(weight.abs());
        }
    });
    let mut ranks = found.map(|weight| weight.map(|_| 0));
    if ranks == [None; 2] {
        return ranks;
    }
    let mut is_past = [false; 2];
    binding.visit(vertex, |point, weight| {
        for (at, rank) in ranks.iter_mut().enumerate() {
            let (Some(rank), Some(own)) = (rank, found[at]) else {
                continue;
            };
            is_past[at] |= point == points[at];
            // Nearer points come first, so that of two alike the nearer is the stronger.
            let stronger = weight.abs() > own || weight.abs() == own && !is_past[at];
            *rank += u32::from(stronger);
        }
    });
    ranks
}
