//! Why a vertex is where it is.

use nalgebra::Vector3;

use crate::{
    scene::{Reference, Rule},
    world::World,
};

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
    /// From where their motion is measured.
    pub reference: Reference,
    /// The vertices that move with it, where the rule has clusters.
    pub cluster: Option<Cluster>,
    /// Steps taken when the mapping changed last; 0 for the scene's own.
    pub changed_at_step: u64,
    /// Steps taken when a cell of the vertex changed last; `None` where none did.
    pub topology_step: Option<u64>,
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
    /// Why a vertex is where it is; `None` where there is no such vertex. O(V) where the rule has clusters.
    pub fn explain(&self, vertex: usize) -> Option<Explanation> {
        let position = *self.frame.vertices.get(vertex)?;
        let rest = self.rest.vertices[vertex];
        let influence = |(point, weight)| Influence {
            point,
            weight,
            rest_distance: (rest - self.rest.points[point as usize]).norm(),
        };
        let weights = self.bound.binding.weights(vertex);
        let mut influences: Vec<_> = weights.into_iter().map(influence).collect();
        // Stable: among equals the order of the binding, the nearest first.
        influences.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
        Some(Explanation {
            rest,
            position,
            step: self.frame.step,
            influences,
            rule: self.bound.mapping.recipe.rule,
            reference: self.bound.mapping.recipe.reference,
            cluster: self.cluster(vertex),
            changed_at_step: self.changed_at_step,
            topology_step: (self.topology.as_ref())
                .and_then(|topology| topology.changed_at[vertex]),
        })
    }

    fn cluster(&self, vertex: usize) -> Option<Cluster> {
        let (first_vertex, vertices) = self.bound.binding.companions(vertex)?;
        Some(Cluster {
            first_vertex,
            vertices,
        })
    }
}
