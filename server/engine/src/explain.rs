//! Why a vertex is where it is.

use nalgebra::Vector3;

use crate::{scene::Rule, world::World};

/// Why a vertex is where it is. While the mesh blends, what is said of the mapping is of the one that it blends to.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// Where it was at rest, m.
    pub rest: Vector3<f64>,
    /// Where it is, m.
    pub position: Vector3<f64>,
    /// Steps taken when it was there.
    pub step: u64,
    /// The points that it follows, the strongest first.
    pub influences: Vec<Influence>,
    /// How the points move it.
    pub rule: Rule,
    /// The vertices that move with it, where the rule has clusters.
    pub cluster: Option<Cluster>,
    /// Steps taken when the mapping changed last; 0 for the scene's own.
    pub changed_at_step: u64,
}

/// A point that a vertex follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Its index.
    pub point: u32,
    /// Its share. Below 0 where the vertex moves against it.
    pub weight: f64,
    /// From the vertex at rest to the point at rest, m.
    pub rest_distance: f64,
}

/// Vertices that follow the same points and share one motion. `[C1]`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cluster {
    /// The least index of its vertices, which tells clusters apart.
    pub first_vertex: usize,
    /// How many vertices it has.
    pub vertices: usize,
}

impl World {
    /// Why a vertex is where it is; `None` where there is no such vertex. O(k V) where the rule has clusters.
    pub fn explain(&self, vertex: usize) -> Option<Explanation> {
        let position = *self.frame.vertices.get(vertex)?;
        let rest = self.rest.vertices[vertex];
        let influence = |(point, weight)| Influence {
            point,
            weight,
            rest_distance: (rest - self.rest.points[point as usize]).norm(),
        };
        let weights = self.bound.binding.weights(vertex);
        let mut influences: Vec<_> = weights.map(influence).collect();
        // Stable: among equals the order of the binding, the nearest first.
        influences.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
        Some(Explanation {
            rest,
            position,
            step: self.frame.step,
            influences,
            rule: self.bound.mapping.recipe.rule,
            cluster: self.cluster(vertex),
            changed_at_step: self.changed_at_step,
        })
    }

    fn cluster(&self, vertex: usize) -> Option<Cluster> {
        if !has_clusters(self.bound.mapping.recipe.rule) {
            return None;
        }
        let points_of = |vertex| self.bound.binding.weights(vertex).map(|(point, _)| point);
        let mut own: Vec<u32> = points_of(vertex).collect();
        own.sort_unstable();
        let shares_all = |other: &usize| {
            points_of(*other).all(|point| own.binary_search(&point).is_ok())
                && points_of(*other).count() == own.len()
        };
        let mut same = (0..self.rest.vertices.len()).filter(shares_all);
        let first_vertex = same.next()?;
        Some(Cluster {
            first_vertex,
            vertices: 1 + same.count(),
        })
    }
}

/// Whether vertices with the same points share one motion, whatever their weights. `[C1]`
fn has_clusters(rule: Rule) -> bool {
    match rule {
        Rule::ShapeMatching
        | Rule::LinearShapeMatching { .. }
        | Rule::QuadraticShapeMatching { .. } => true,
        Rule::Direct
        | Rule::Mean
        | Rule::WeightedMean
        | Rule::Barycentric
        | Rule::RadialBasis(_) => false,
    }
}
