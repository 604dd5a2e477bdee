//! Bindings that follow a mesh of which little changed.

use nalgebra::Vector3;

use crate::binding::{Binding, usable_points};
use crate::compile::{Compiler, Operator};
use crate::{FitWeights, Mesh, Recipe, Rule, ShapeMatching};

/// Some vertices bound anew; see [`Binding::renewal`].
#[derive(Clone, Debug)]
pub struct Renewal {
    /// Ascending. Those that the binding does not have yet are the last.
    vertices: Vec<u32>,
    dominant: Vec<u32>,
    operator: Operator,
    /// Of fits, the clusters that new vertices join; empty where each has one of its own.
    homes: Vec<u32>,
}

impl Binding {
    /// Binds these vertices, ascending, as [`bind_mesh`](crate::bind_mesh) does with the scale of this binding: all that
    /// are new, and all that are elsewhere at rest than before. Everything else has to be what it was. At the cost of
    /// these vertices and of all points.
    ///
    /// `None` where the rest cannot stay as it is, or there is no vertex: one is refused, or brings a new cluster; or how
    /// vertices are bound depends on other vertices or on cells, as along paths, from targets that are no vertices, in
    /// fits weighted by the mean of a cluster, and from the previous frame.
    #[must_use]
    pub fn renewal(
        &self,
        mesh: &Mesh<'_>,
        points: &[Vector3<f64>],
        usable: &[bool],
        recipe: &Recipe,
        vertices: &[u32],
    ) -> Option<Renewal> {
        if !recipe.stands_alone() || self.previous().is_some() || vertices.is_empty() {
            return None;
        }
        let places: Vec<_> = vertices
            .iter()
            .map(|&vertex| mesh.vertices[vertex as usize])
            .collect();
        let some = Mesh::of_vertices(&places);
        some.check(&recipe.weighting).ok()?;
        let usable = usable_points(points, usable).ok()?;
        let (distances, _) = some.kept(points, &usable, recipe).ok()?;
        let mut compiler = Compiler {
            clusters: None,
            ..self.compiler.clone()
        };
        let first_kept = distances.firsts();
        let operator = match &self.operator {
            Operator::Interpolation(own) => Operator::Interpolation(own.at(&places).ok()?),
            Operator::Linear(_) | Operator::Shape(_) => {
                compiler.compile(&places, points, distances).ok()?
            }
        };
        let appends = vertices[0] as usize >= self.dominant().len();
        let homes = match (&self.operator, &operator, recipe.rule) {
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
                Operator::Shape(_) | Operator::Interpolation(_) => first_kept,
            },
            vertices: vertices.to_vec(),
            operator,
            homes,
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
        } = renewal;
        for (&vertex, point) in vertices.iter().zip(dominant) {
            match self.dominant.get_mut(vertex as usize) {
                Some(own) => *own = point,
                None => self.dominant.push(point),
            }
        }
        match (&mut self.operator, operator) {
            (Operator::Linear(own), Operator::Linear(some)) => own.take(&vertices, &some),
            (Operator::Shape(own), Operator::Shape(some)) => own.append(some, &homes),
            (Operator::Interpolation(own), Operator::Interpolation(some)) => {
                own.take(&vertices, &some);
            }
            (Operator::Linear(_) | Operator::Shape(_) | Operator::Interpolation(_), _) => {
                panic!("another binding's renewal")
            }
        }
    }
}
