use nalgebra::{UnitQuaternion, Vector3};

use crate::clusters::cluster;
use crate::distance::{nearest, scaled, spacing};
use crate::filter::filter;
use crate::linear::Linear;
use crate::shape::{Fit, Shape};
use crate::weights::{Weights, alike, nearest_alone, normalise};
use crate::{MappingError, RadialBasis, Recipe, Rule, Weighting, barycentric, rbf};

/// The most pairs of vertex and point that a binding holds: 1.6 GB of them.
pub const MAX_INFLUENCES: usize = 1 << 27;

/// Coordinates and scales up to this have finite squares, and so have their quotients.
const LARGEST: f64 = 1e100;

/// Distances times coefficients up to this still have finite squares.
const LARGEST_COEFFICIENT: f64 = 1e30;

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
    Shape(Shape),
}

/// Binds vertices to points at rest.
///
/// * `vertices`, `points` – positions at rest, m, world frame.
/// * `usable` – one per point; where `false`, the point has no rest position, its entry in `points` is not read, and it
///   drives nothing.
///
/// # Errors
/// No usable point; slices that do not match; a coordinate that is not finite or beyond 1e100 m; a scale, a
/// coefficient, a filter or a rule that means nothing; more pairs than [`MAX_INFLUENCES`]; vertices whose points leave a
/// rule without an answer: none, or in a plane for [`Rule::Barycentric`], too many or hardly apart for
/// [`Rule::RadialBasis`].
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
    let Weighting::Distance {
        kernel,
        scale,
        ref coefficients,
    } = recipe.weighting;
    check_coefficients(coefficients, points.len())?;
    check_rule(&recipe.rule)?;
    let demand = match (recipe.filter.demand()?, &coefficients[..]) {
        (demand, []) => demand,
        _ => usize::MAX, // the nearest need not be the least
    };
    let kept = demand.min(usable.len());
    if vertices.len() > MAX_INFLUENCES / kept {
        let vertices = vertices.len();
        return Err(MappingError::TooLarge { vertices, kept });
    }

    let scale = resolve_scale(scale, 1.0, points, &usable)?;
    let distances = nearest(vertices, points, &usable, demand); // [W1]
    let distances = match &coefficients[..] {
        [] => distances,
        coefficients => scaled(distances, coefficients), // [W6]
    };
    let distances = filter(distances, recipe.filter)?; // [F1] to [F3]
    let linear = || Operator::Linear(Linear::new(vertices, points));
    let shape = |fit| Operator::Shape(Shape::new(vertices, points, cluster(&distances), fit)); // [C1]
    let (operator, weights) = match recipe.rule {
        Rule::Direct => (linear(), nearest_alone(&distances)), // [M5]
        Rule::Mean => (linear(), alike(distances)),            // [M6]
        Rule::WeightedMean => (linear(), normalise(distances, kernel, scale)), // [W4]
        Rule::Barycentric => (
            linear(),
            barycentric::weights(vertices, points, &distances)?, // [M7]
        ),
        Rule::RadialBasis(basis) => {
            let scale = resolve_scale(basis.scale, basis.function.reach(), points, &usable)?;
            let weights = rbf::weights(vertices, points, &distances, &basis, scale)?; // [M10]
            (linear(), weights)
        }
        Rule::ShapeMatching => (shape(Fit::Rigid), normalise(distances, kernel, scale)),
        Rule::LinearShapeMatching { beta } => (
            shape(Fit::Linear { beta }),
            normalise(distances, kernel, scale),
        ),
        Rule::QuadraticShapeMatching { beta } => (
            shape(Fit::Quadratic { beta }),
            normalise(distances, kernel, scale),
        ),
    };
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
            Operator::Shape(shape) => shape.pose(points, out),
        }
        Ok(())
    }

    /// The point of greatest weight of each vertex, ties to the lower index.
    #[must_use]
    pub fn dominant(&self) -> &[u32] {
        &self.dominant
    }

    /// The points that act on a vertex with their weights, nearest point first; by index in an interpolation.
    ///
    /// The weights sum to 1, but for an interpolation without a polynomial.
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
            Operator::Shape(shape) => shape.rotations(),
        }
    }

    /// Bytes that a pose has to move, output included: to compare its time with the memory's speed.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.operator {
            Operator::Linear(linear) => linear.bytes(&self.weights),
            Operator::Shape(shape) => shape.bytes(),
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

fn check_coefficients(coefficients: &[f64], points: usize) -> Result<(), MappingError> {
    if coefficients.is_empty() {
        return Ok(());
    }
    check_length("coefficients", coefficients.len(), points)?;
    let bad = |value: &f64| !(0.0..=LARGEST_COEFFICIENT).contains(value);
    match coefficients.iter().position(bad) {
        None => Ok(()),
        Some(point) => Err(MappingError::Coefficient {
            point,
            value: coefficients[point],
        }),
    }
}

/// What can be wrong with a rule whatever the points.
fn check_rule(rule: &Rule) -> Result<(), MappingError> {
    match *rule {
        Rule::LinearShapeMatching { beta } | Rule::QuadraticShapeMatching { beta }
            if !(0.0..=1.0).contains(&beta) =>
        {
            Err(MappingError::Beta { beta })
        }
        Rule::RadialBasis(RadialBasis {
            function,
            polynomial: found,
            ..
        }) if found < function.needs() => Err(MappingError::Polynomial {
            function,
            found,
            needed: function.needs(),
        }),
        Rule::Direct
        | Rule::Mean
        | Rule::WeightedMean
        | Rule::Barycentric
        | Rule::ShapeMatching
        | Rule::LinearShapeMatching { .. }
        | Rule::QuadraticShapeMatching { .. }
        | Rule::RadialBasis(_) => Ok(()),
    }
}

/// The scale asked for, or this many distances between points.
fn resolve_scale(
    scale: Option<f64>,
    spacings: f64,
    points: &[Vector3<f64>],
    usable: &[u32],
) -> Result<f64, MappingError> {
    match scale {
        Some(scale) if (LARGEST.recip()..=LARGEST).contains(&scale) => Ok(scale),
        Some(scale) => Err(MappingError::Scale { scale }),
        None => Ok(spacing(points, usable)
            .map_or(1.0, |spacing| (spacings * spacing).max(LARGEST.recip()))),
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
