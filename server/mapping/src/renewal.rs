//! Bindings that follow a mesh of which little changed.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::binding::{Binding, check_coordinates, usable_points};
use crate::compile::{Compiler, Operator};
use crate::distance::{Distances, Seeker, scaled};
use crate::filter::{Surroundings, filter};
use crate::flooded::{Renewed, Turned};
use crate::{
    Cost, Dimension, Filter, FitWeights, MAX_INFLUENCES, Mesh, Metric, Recipe, Reference, Roots,
    Rows, Rule, ShapeMatching,
};

/// What changed of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Change<'a> {
    /// The vertices that are new or elsewhere at rest than before, ascending.
    pub vertices: &'a [u32],
    /// Of weights along paths, what changed of the graph.
    pub wiring: Option<Wiring<'a>>,
}

/// Nodes of a graph with other neighbours than before.
#[derive(Clone, Copy, Debug)]
pub struct Wiring<'a> {
    /// All that are new, have other neighbours or arcs of other costs, or are elsewhere; ascending. Others may be among them.
    pub nodes: &'a [u32],
    /// Of each of these its neighbours now, ascending.
    pub arcs: &'a Rows,
    /// One per item of `arcs`, as of [`Graph::new`](crate::Graph::new).
    pub costs: &'a [f64],
}

/// Some vertices bound anew; see [`Binding::renewal`].
#[derive(Clone, Debug)]
pub struct Renewal {
    /// Ascending. Those that the binding does not have yet are the last.
    vertices: Vec<u32>,
    dominant: Vec<u32>,
    operator: Option<Operator>,
    /// Of fits, the clusters that new vertices join; empty where each has one of its own.
    homes: Vec<u32>,
    flooded: Option<Box<Renewed>>,
}

/// The points that some vertices keep, before anything is taken over.
struct Found {
    vertices: Vec<u32>,
    distances: Distances,
    flooded: Option<Box<Renewed>>,
}

impl Recipe {
    /// Whether a flood by this recipe can follow a change of the mesh, where the mesh may change at all.
    pub(crate) fn can_follow(&self) -> bool {
        let Metric::Paths(paths) = &self.weighting.metric else {
            return false;
        };
        let local = match paths.cost {
            Cost::Hops | Cost::Length | Cost::Column(_) => true,
            Cost::Volume | Cost::Curvature(_) => false,
        };
        local
            && paths.roots != Roots::Containing
            && self.weighting.targets == Dimension::Vertex
            && self.weighting.coefficients.iter().all(|c| *c == 1.0)
            && self.filter.looks_at_rows()
            && self.reference == Reference::Initial
    }
}

impl Filter {
    /// Whether what a target keeps depends on its own distances alone, and is found in the first look at them.
    fn looks_at_rows(&self) -> bool {
        match self {
            Self::KeepK(_) | Self::Interval { .. } | Self::KeepAtLeast { .. } => true,
            Self::InVolume | Self::FourSpanning { .. } => false,
            Self::Sequence(stages) => stages.iter().all(Self::looks_at_rows),
        }
    }
}

impl Renewal {
    /// The vertices that move otherwise than before, where their motion is at hand after a pose of all others on the same
    /// points: [`Binding::pose_alone`] poses them. `None` where all have to be posed.
    #[must_use]
    pub fn alone(&self) -> Option<&[u32]> {
        match &self.operator {
            None | Some(Operator::Linear(_)) => Some(&self.vertices),
            Some(Operator::Shape(_)) => (!self.homes.is_empty()).then_some(&self.vertices),
            Some(Operator::Interpolation(_)) => None,
        }
    }
}

impl Binding {
    /// Binds anew what a change of the mesh makes other than it was, as [`bind_mesh`](crate::bind_mesh) with the scale of
    /// this binding would. Of straight distances that is at the cost of the vertices that changed and of all points;
    /// along paths, of the nodes whose points or distances change and of those beside them.
    ///
    /// `None` where the rest cannot stay as it is, or a look at all of the mesh is needed: one is refused, or brings a new
    /// cluster; from targets that are no vertices, with four points that span a volume and with points by volume, in
    /// fits weighted by the mean of a cluster, and from the previous frame. Along paths also with coefficients that
    /// differ (what a near point crowds out may still count beyond), by volume or curvature (costs compare with the whole
    /// mesh), from the volumes that hold a point, where the greatest cost of an arc goes over a power of two (all are rounded
    /// by it), and of a mesh that was not bound as one that may change.
    #[must_use]
    pub fn renewal(
        &self,
        mesh: &Mesh<'_>,
        points: &[Vector3<f64>],
        usable: &[bool],
        recipe: &Recipe,
        change: &Change<'_>,
    ) -> Option<Renewal> {
        if self.previous().is_some() {
            return None;
        }
        let usable = usable_points(points, usable).ok()?;
        let found = match change.wiring {
            _ if recipe.stands_alone() => self.straight(mesh, points, &usable, recipe, change)?,
            Some(wiring) => self.flooded(mesh, points, &usable, recipe, change, wiring)?,
            None => return None,
        };
        let Found {
            vertices,
            distances,
            flooded,
        } = found;
        let renewal = Renewal {
            vertices,
            dominant: distances.firsts(),
            operator: None,
            homes: Vec::new(),
            flooded,
        };
        if renewal.vertices.is_empty() {
            return Some(renewal);
        }
        self.compiled(renewal, mesh, points, distances, recipe.rule)
    }

    /// The vertices that changed, where each stands alone.
    fn straight(
        &self,
        mesh: &Mesh<'_>,
        points: &[Vector3<f64>],
        usable: &[u32],
        recipe: &Recipe,
        change: &Change<'_>,
    ) -> Option<Found> {
        let places: Vec<_> = (change.vertices.iter())
            .map(|&vertex| mesh.vertices[vertex as usize])
            .collect();
        Mesh::of_vertices(&places).check(&recipe.weighting).ok()?;
        let seeker = self
            .seeker
            .get_or_init(|| Arc::new(Seeker::new(points, usable)));
        let coefficients = &recipe.weighting.coefficients[..];
        let mut demand = recipe.filter.demand();
        let distances = loop {
            let by_number = demand.within < 0.0 && coefficients.is_empty();
            let count = if by_number { demand.count } else { usize::MAX };
            let near = seeker.nearest(&places, count); // [W1]
            let seen = match coefficients {
                [] => near,
                coefficients => scaled(near, coefficients), // [W6]
            };
            match filtered(seen, mesh, points, recipe) {
                Some(kept) => break kept,
                None if demand.grows && demand.count < usable.len() => demand.count *= 2,
                None => return None,
            }
        };
        Some(Found {
            vertices: change.vertices.to_vec(),
            distances,
            flooded: None,
        })
    }

    /// The vertices whose flood changed.
    fn flooded(
        &self,
        mesh: &Mesh<'_>,
        points: &[Vector3<f64>],
        usable: &[u32],
        recipe: &Recipe,
        change: &Change<'_>,
        wiring: Wiring<'_>,
    ) -> Option<Found> {
        let (Some(flooded), Metric::Paths(paths)) = (&self.flooded, &recipe.weighting.metric)
        else {
            return None;
        };
        let demand = recipe.filter.demand();
        let by_number = demand.within < 0.0;
        let most = if by_number { demand.count } else { usize::MAX };
        if mesh.vertices.len() > MAX_INFLUENCES / most.min(usable.len()) {
            return None;
        }
        for &node in wiring.nodes {
            check_coordinates("vertex", node as usize, &mesh.vertices[node as usize]).ok()?;
        }
        let arcs = flooded.arcs();
        let rewired = arcs
            .rewired(wiring.nodes, wiring.arcs, wiring.costs)
            .ok()??;
        let mut renewed = flooded.renewed(Turned {
            rewired,
            centres: mesh.vertices,
            points,
            usable,
            paths,
            asked: change.vertices,
        })?;
        let none = Distances::of_rows(&[]);
        let seen = std::mem::replace(&mut renewed.distances, none);
        Some(Found {
            vertices: renewed.targets.clone(),
            distances: filtered(seen, mesh, points, recipe)?,
            flooded: Some(Box::new(renewed)),
        })
    }

    /// What these vertices are compiled to.
    fn compiled(
        &self,
        renewal: Renewal,
        mesh: &Mesh<'_>,
        points: &[Vector3<f64>],
        distances: Distances,
        rule: Rule,
    ) -> Option<Renewal> {
        let places: Vec<_> = (renewal.vertices.iter())
            .map(|&vertex| mesh.vertices[vertex as usize])
            .collect();
        let mut compiler = Compiler {
            clusters: None,
            ..self.compiler.clone()
        };
        let operator = match &self.operator {
            Operator::Interpolation(own) => Operator::Interpolation(own.at(&places).ok()?),
            Operator::Linear(_) | Operator::Shape(_) => {
                compiler.compile(&places, points, distances).ok()?
            }
        };
        let appends = renewal.vertices[0] as usize >= self.dominant().len();
        let homes = match (&self.operator, &operator, rule) {
            (Operator::Linear(_), Operator::Linear(_), _) => Vec::new(),
            (Operator::Interpolation(_), Operator::Interpolation(_), _) => Vec::new(),
            (
                Operator::Shape(own),
                Operator::Shape(some),
                Rule::ShapeMatching(ShapeMatching {
                    weights: FitWeights::Alike,
                    ..
                }),
            ) if appends => own.homes(some)?,
            (Operator::Shape(_), Operator::Shape(_), Rule::MovingLeastSquares(_)) if appends => {
                Vec::new()
            }
            (Operator::Linear(_) | Operator::Shape(_) | Operator::Interpolation(_), _, _) => {
                return None;
            }
        };
        Some(Renewal {
            dominant: match &operator {
                Operator::Linear(linear) => linear.weights.dominant(),
                Operator::Shape(_) | Operator::Interpolation(_) => renewal.dominant,
            },
            operator: Some(operator),
            homes,
            ..renewal
        })
    }

    /// Takes over what was bound anew.
    ///
    /// # Panics
    /// If it is another binding's.
    pub fn renew(&mut self, renewal: Renewal) {
        let Renewal {
            vertices,
            dominant,
            operator,
            homes,
            flooded,
        } = renewal;
        if let (Some(own), Some(renewed)) = (&mut self.flooded, flooded) {
            own.take(*renewed);
        }
        for (&vertex, point) in vertices.iter().zip(dominant) {
            match self.dominant.get_mut(vertex as usize) {
                Some(own) => *own = point,
                None => self.dominant.push(point),
            }
        }
        match (&mut self.operator, operator) {
            (_, None) => {}
            (Operator::Linear(own), Some(Operator::Linear(some))) => own.take(&vertices, &some),
            (Operator::Shape(own), Some(Operator::Shape(some))) => own.append(some, &homes),
            (Operator::Interpolation(own), Some(Operator::Interpolation(some))) => {
                own.take(&vertices, &some);
            }
            (Operator::Linear(_) | Operator::Shape(_) | Operator::Interpolation(_), Some(_)) => {
                panic!("another binding's renewal")
            }
        }
    }
}

/// What of these distances a filter keeps.
fn filtered(
    seen: Distances,
    mesh: &Mesh<'_>,
    points: &[Vector3<f64>],
    recipe: &Recipe,
) -> Option<Distances> {
    let around = Surroundings {
        targets: recipe.weighting.targets,
        points,
        holding: mesh.holding,
    };
    filter(seen, &recipe.filter, &around).ok()
}
