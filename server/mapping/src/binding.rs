use nalgebra::{UnitQuaternion, Vector3};

use crate::clusters::cluster;
use crate::distance::{nearest, spacing};
use crate::filter::filter;
use crate::linear::Linear;
use crate::rigid::Rigid;
use crate::weights::{Weights, normalise};
use crate::{MappingError, Recipe, Rule, Weighting};

/// The most pairs of vertex and point that a binding holds: 1.6 GB of them.
pub const MAX_INFLUENCES: usize = 1 << 27;

/// Coordinates and scales up to this have finite squares, and so have their quotients.
const LARGEST: f64 = 1e100;

/// A [`Recipe`] applied to a rest pose, ready to pose the vertices step by step.
#[derive(Clone, Debug)]
pub struct Binding {
    points: usize,
    weights: Weights,
    dominant: Vec<u32>,
    operator: Operator,
}

/// What the pipeline compiles to.
#[derive(Clone, Debug)]
enum Operator {
    Linear(Linear),
    Rigid(Rigid),
}

/// Binds vertices to points at rest.
///
/// * `vertices`, `points` – positions at rest, m, world frame.
/// * `usable` – one per point; where `false`, the point has no rest position, its entry in `points` is not read, and it
///   drives nothing.
///
/// # Errors
/// No usable point; slices that do not match; a coordinate that is not finite or beyond 1e100 m; a scale or a filter
/// that means nothing; more pairs than [`MAX_INFLUENCES`].
pub fn bind(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    usable: &[bool],
    recipe: &Recipe,
) -> Result<Binding, MappingError> {
    let usable = usable_points(points, usable)?;
    for (index, vertex) in vertices.iter().enumerate() {
        check_coordinates("vertex", index, vertex)?;
    }
    let demand = recipe.filter.demand();
    if demand == 0 {
        return Err(MappingError::KeepsNone);
    }
    let kept = demand.min(usable.len());
    if vertices.len() > MAX_INFLUENCES / kept {
        let vertices = vertices.len();
        return Err(MappingError::TooLarge { vertices, kept });
    }

    let Weighting::Distance { kernel, scale } = recipe.weighting;
    let scale = resolve_scale(scale, points, &usable)?;
    let distances = nearest(vertices, points, &usable, demand); // [W1]
    let distances = filter(distances, recipe.filter); // [F1]
    let operator = match recipe.rule {
        Rule::WeightedMean => Operator::Linear(Linear::new(vertices, points)),
        Rule::ShapeMatching => {
            Operator::Rigid(Rigid::new(vertices, points, cluster(&distances))) // [C1]
        }
    };
    let weights = normalise(distances, kernel, scale); // [W4]
    Ok(Binding {
        points: points.len(),
        dominant: weights.dominant(),
        weights,
        operator,
    })
}

impl Binding {
    /// Writes the position of every vertex, m, for these positions of the points, m. O(k V).
    ///
    /// The usable points must be finite; beyond 1e150 m the result may not be. Mutable because shape matching starts from
    /// the last rotation.
    ///
    /// # Errors
    /// [`MappingError::Length`] if there are not as many points or vertices as were bound; nothing is written then.
    pub fn pose(
        &mut self,
        points: &[Vector3<f64>],
        out: &mut [Vector3<f64>],
    ) -> Result<(), MappingError> {
        check_length("points", points.len(), self.points)?;
        check_length("vertices", out.len(), self.dominant.len())?;
        match &mut self.operator {
            Operator::Linear(linear) => linear.pose(&self.weights, points, out),
            Operator::Rigid(rigid) => rigid.pose(points, out),
        }
        Ok(())
    }

    /// The point of greatest weight of each vertex, ties to the lower index.
    #[must_use]
    pub fn dominant(&self) -> &[u32] {
        &self.dominant
    }

    /// The points that a vertex keeps with their weights, which sum to 1; nearest point first.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn weights(&self, vertex: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.weights.row(vertex)
    }

    /// The last rotation of each cluster: all of the past that the next pose depends on. Empty without shape matching.
    #[must_use]
    pub fn rotations(&self) -> &[UnitQuaternion<f64>] {
        match &self.operator {
            Operator::Linear(_) => &[],
            Operator::Rigid(rigid) => rigid.rotations(),
        }
    }

    /// Bytes that a pose has to move, output included: to compare its time with the memory's speed.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.operator {
            Operator::Linear(linear) => linear.bytes(&self.weights),
            Operator::Rigid(rigid) => rigid.bytes(),
        }
    }
}

/// The indices of the usable points, rising.
fn usable_points(points: &[Vector3<f64>], usable: &[bool]) -> Result<Vec<u32>, MappingError> {
    check_length("entries of `usable`", usable.len(), points.len())?;
    let mut indices = Vec::new();
    for (index, (point, _)) in (0_u32..)
        .zip(points.iter().zip(usable))
        .filter(|(_, (_, usable))| **usable)
    {
        check_coordinates("point", index as usize, point)?;
        indices.push(index);
    }
    if indices.is_empty() {
        let points = points.len();
        return Err(MappingError::NoUsablePoint { points });
    }
    Ok(indices)
}

fn resolve_scale(
    scale: Option<f64>,
    points: &[Vector3<f64>],
    usable: &[u32],
) -> Result<f64, MappingError> {
    match scale {
        Some(scale) if (LARGEST.recip()..=LARGEST).contains(&scale) => Ok(scale),
        Some(scale) => Err(MappingError::Scale { scale }),
        None => Ok(spacing(points, usable).map_or(1.0, |spacing| spacing.max(LARGEST.recip()))),
    }
}

fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), MappingError> {
    if found == expected {
        return Ok(());
    }
    Err(MappingError::Length {
        what,
        found,
        expected,
    })
}

fn check_coordinates(
    what: &'static str,
    index: usize,
    position: &Vector3<f64>,
) -> Result<(), MappingError> {
    // Written so that what is not a number fails it.
    let in_range = |value: &f64| value.abs() <= LARGEST;
    match position.iter().find(|value| !in_range(value)) {
        None => Ok(()),
        Some(&value) => Err(MappingError::Coordinate { what, index, value }),
    }
}
