//! From a mesh and its points to the points that each vertex keeps.

use std::borrow::Cow;

use nalgebra::Vector3;

use crate::binding::{LARGEST, check_coefficients, check_coordinates, check_length, usable_points};
use crate::distance::{Distances, nearest, scaled};
use crate::filter::{Demand, Surroundings, filter};
use crate::flooded::Flooded;
use crate::paths::{Ground, at_vertices, inside, typical};
use crate::roots::roots;
use crate::strays::strays;
use crate::{
    Filter, Graph, MAX_INFLUENCES, MappingError, Metric, Nearest, Paths, Recipe, Root, Roots, Rows,
    Simplices, Weighting,
};

/// A mesh at rest, in as far as a recipe asks for it.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// m
    pub vertices: &'a [Vector3<f64>],
    /// The targets, where they are not the vertices.
    pub cells: Option<Cells<'a>>,
    /// The targets as nodes of a graph, with what its arcs cost; for [`Metric::Paths`].
    pub graph: Option<&'a Graph>,
    /// What geodesics go through; for [`Metric::Geodesics`].
    pub body: Option<Body<'a>>,
    /// Of each point, the targets of the volumes that hold it, ascending; for paths from
    /// [`Roots::Containing`] and for [`Filter::InVolume`].
    pub holding: Option<&'a Rows>,
    /// Whether it came apart since it was made. A part of it that no path reaches has then a root of its own `[W11]`, and a
    /// vertex left over, that bounds no target or is none, follows the point that is straight the nearest.
    pub torn: bool,
    /// Whether it may change yet. A binding along paths then keeps its flood, so that [`Binding::renewal`] can follow:
    /// 16 bytes for each arc both ways, 24 for the place of a target, and 12 for each of the points that it sees.
    ///
    /// [`Binding::renewal`]: crate::Binding::renewal
    pub may_change: bool,
}

/// The points that each vertex keeps, by the first two stages.
pub(crate) struct Kept {
    pub(crate) distances: Distances,
    /// What distances of paths are like. `[W9]`
    pub(crate) typical: Option<f64>,
    /// Of a mesh that may change, the flood that they come from, if a change of it can be followed.
    pub(crate) flooded: Option<Flooded>,
}

/// Targets other than vertices.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// The mean of the vertices of each, m.
    pub centres: &'a [Vector3<f64>],
    /// Of each vertex, the targets that it bounds.
    pub at_vertices: &'a Rows,
}

/// The inside of a mesh at rest.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Of the vertices.
    pub simplices: &'a Simplices,
    /// The vertices of each target, where the targets are not the vertices.
    pub corners: Option<&'a Rows>,
    /// Of each point, the vertices of the volumes that hold it, ascending; for [`Roots::Containing`].
    pub holding: Option<&'a Rows>,
}

impl<'a> Mesh<'a> {
    /// Vertices without cells: all that distances between vertices and points need.
    #[must_use]
    pub fn of_vertices(vertices: &'a [Vector3<f64>]) -> Self {
        Self {
            vertices,
            cells: None,
            graph: None,
            body: None,
            holding: None,
            torn: false,
            may_change: false,
        }
    }

    fn centres(&self) -> &'a [Vector3<f64>] {
        self.cells.map_or(self.vertices, |cells| cells.centres)
    }

    pub(crate) fn check(&self, weighting: &Weighting) -> Result<(), MappingError> {
        for (index, vertex) in self.vertices.iter().enumerate() {
            check_coordinates("vertex", index, vertex)?;
        }
        if let (Metric::Paths(_), Some(graph)) = (&weighting.metric, self.graph) {
            check_length("nodes", graph.len(), self.centres().len())?;
        }
        if let (Metric::Geodesics(_), Some(body)) = (&weighting.metric, self.body) {
            let nodes = Ground::Body(body.simplices).len();
            check_length("corners of simplices", nodes, self.vertices.len())?;
        }
        if let Metric::Paths(Paths { arcs, .. }) = weighting.metric
            && arcs == weighting.targets
        {
            return Err(MappingError::Arcs);
        }
        match weighting.metric.starts() {
            Some((Roots::Ball(radius), _)) if !(LARGEST.recip()..=LARGEST).contains(&radius) => {
                Err(MappingError::Radius { radius })
            }
            Some(_) | None => Ok(()),
        }
    }

    /// The points that each vertex keeps.
    ///
    /// # Errors
    /// Targets or vertices without points, and more pairs than [`MAX_INFLUENCES`].
    pub(crate) fn kept(
        &self,
        points: &[Vector3<f64>],
        usable: &[u32],
        recipe: &Recipe,
    ) -> Result<Kept, MappingError> {
        let weighting = &recipe.weighting;
        let around = Surroundings {
            targets: weighting.targets,
            points,
            holding: self.holding,
        };
        let roots = self.roots(points, usable, weighting);
        let mut demand = recipe.filter.demand();
        let keeps = self.may_change && recipe.can_follow();
        let kept = loop {
            let seen = self.seen(points, usable, weighting, demand, &roots, keeps)?;
            match filter(seen.distances, &recipe.filter, &around) {
                Ok(distances) => break Kept { distances, ..seen },
                Err(MappingError::SpansNone { .. })
                    if demand.grows && demand.count < usable.len() =>
                {
                    demand.count *= 2;
                }
                Err(error) => return Err(error),
            }
        };
        let Some(cells) = self.cells else {
            return Ok(kept);
        };
        let mut distances = at_vertices(&kept.distances, cells.at_vertices); // [W8]
        match distances.empty() {
            vertices if vertices.is_empty() => Ok(Kept { distances, ..kept }),
            vertices if self.torn => {
                let places: Vec<_> = vertices.iter().map(|&x| self.vertices[x]).collect();
                distances.give(&vertices, &nearest(&places, points, usable, 1));
                Ok(Kept { distances, ..kept })
            }
            vertices => Err(MappingError::NoTargets {
                targets: weighting.targets,
                vertices,
            }),
        }
    }

    fn roots(&self, points: &[Vector3<f64>], usable: &[u32], weighting: &Weighting) -> Vec<Root> {
        let (Some(starts), Some(ground)) = (weighting.metric.starts(), self.ground(weighting))
        else {
            return Vec::new();
        };
        let holding = match ground {
            Ground::Graph(_) => self.holding,
            Ground::Body(_) => self.body.and_then(|body| body.holding),
        };
        roots(starts, &self.rooted(ground), points, usable, holding)
    }

    /// What floods spread over; `None` without floods.
    fn ground(&self, weighting: &Weighting) -> Option<Ground<'a>> {
        match weighting.metric {
            Metric::Straight => None,
            Metric::Paths(_) => self.graph.map(Ground::Graph),
            Metric::Geodesics(_) => self.body.map(|body| Ground::Body(body.simplices)),
        }
    }

    /// Where the nodes of floods are, m.
    fn nodes(&self, ground: Ground<'_>) -> &'a [Vector3<f64>] {
        match ground {
            Ground::Graph(_) => self.centres(),
            Ground::Body(_) => self.vertices,
        }
    }

    /// Where paths may start: a vertex that is left over, and has no arc, is infinitely far.
    fn rooted(&self, ground: Ground<'_>) -> Cow<'a, [Vector3<f64>]> {
        let nodes = self.nodes(ground);
        let are_cells = matches!(ground, Ground::Graph(_)) && self.cells.is_some();
        if !self.torn || are_cells {
            return Cow::Borrowed(nodes);
        }
        let place = |(node, x): (usize, &Vector3<f64>)| {
            let mut is_left_over = true;
            ground.for_each_neighbour(node, |_| is_left_over = false);
            if is_left_over {
                Vector3::repeat(f64::INFINITY)
            } else {
                *x
            }
        };
        Cow::Owned(nodes.iter().enumerate().map(place).collect())
    }

    /// The distances of each target, in as far as a filter has to see them.
    fn seen(
        &self,
        points: &[Vector3<f64>],
        usable: &[u32],
        weighting: &Weighting,
        demand: Demand,
        roots: &[Root],
        keeps: bool,
    ) -> Result<Kept, MappingError> {
        let centres = self.centres();
        let coefficients = &weighting.coefficients[..];
        let by_number = match weighting.metric {
            // The nearest need not be the least.
            Metric::Straight => demand.within < 0.0 && coefficients.is_empty(),
            Metric::Paths(_) | Metric::Geodesics(_) => demand.within < 0.0,
        };
        let count = if by_number { demand.count } else { usize::MAX };
        let kept = count.min(usable.len());
        let vertices = centres.len().max(self.vertices.len());
        if vertices > MAX_INFLUENCES / kept {
            return Err(MappingError::TooLarge { vertices, kept });
        }
        let (Some((_, start)), Some(ground)) = (weighting.metric.starts(), self.ground(weighting))
        else {
            let distances = nearest(centres, points, usable, count); // [W1]
            return Ok(Kept {
                distances: match coefficients {
                    [] => distances,
                    coefficients => scaled(distances, coefficients), // [W6]
                },
                typical: None,
                flooded: None,
            });
        };
        let mut floods = ground.floods(roots, coefficients, demand); // [W6], [W7], [W12]
        let mut strays = Vec::new();
        if self.torn {
            let around = (points, usable);
            let nodes = self.nodes(ground);
            let unreached = floods.unreached();
            strays = self::strays(&ground, &unreached, roots, nodes, around, start); // [W11]
            if !strays.is_empty() {
                floods = ground.floods(&[roots, &strays].concat(), coefficients, demand);
            }
        }
        let (distances, flooded) = match ground {
            Ground::Graph(graph) => {
                // Nodes without arcs are no roots any more once a mesh is torn.
                let is_open = |node| !graph.neighbours(node).is_empty();
                let keeps = keeps && (self.torn || (0..graph.len()).all(is_open));
                let keep = || Flooded::new(graph, centres, points, [roots, &strays], &floods);
                let flooded = if keeps { keep() } else { None };
                (floods.distances(), flooded)
            }
            Ground::Body(_) => {
                let of_vertices = floods.distances();
                let corners = self.body.and_then(|body| body.corners);
                let distances = match corners {
                    None => of_vertices,
                    Some(corners) => {
                        inside(&of_vertices, corners, self.vertices, centres, coefficients) // [W13]
                    }
                };
                (distances, None)
            }
        };
        let typical = Some(typical(&distances));
        match distances.empty() {
            cells if cells.is_empty() || demand.limit < f64::INFINITY => Ok(Kept {
                distances,
                typical,
                flooded,
            }),
            cells => Err(MappingError::Unreached {
                targets: weighting.targets,
                cells,
            }),
        }
    }
}

/// How far the points are from each target of a mesh, all of them, nearest first: the first stage alone. Points as in
/// [`bind`](crate::bind).
///
/// # Errors
/// As [`bind_mesh`](crate::bind_mesh), of a weighting.
///
/// # Panics
/// If the mesh does not tell what the weighting asks for.
pub fn distances(
    mesh: &Mesh<'_>,
    points: &[Vector3<f64>],
    usable: &[bool],
    weighting: &Weighting,
) -> Result<Nearest, MappingError> {
    let usable = usable_points(points, usable)?;
    mesh.check(weighting)?;
    check_coefficients(&weighting.coefficients, points.len())?;
    let roots = mesh.roots(points, &usable, weighting);
    let demand = Filter::KeepK(usize::MAX).demand();
    let seen = mesh.seen(points, &usable, weighting, demand, &roots, false)?;
    Ok(seen.distances.into())
}
