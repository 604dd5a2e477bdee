use std::sync::{Arc, OnceLock};

use nalgebra::{UnitQuaternion, Vector3};

use crate::compile::{Compiler, Operator, Previous};
use crate::distance::{Seeker, spacing};
use crate::flooded::Flooded;
use crate::targets::{Kept, Mesh};
use crate::{
    Dimension, Filter, Fit, MappingError, Metric, RadialBasis, Recipe, Reference, Rule,
    ShapeMatching, Weighting,
};

/// The most pairs of vertex and point that a binding holds: 1.6 GB of them.
pub const MAX_INFLUENCES: usize = 1 << 27;

/// Coordinates and scales up to this have finite squares, and so have their quotients.
pub(crate) const LARGEST: f64 = 1e100;

/// Distances times coefficients up to this still have finite squares.
const LARGEST_COEFFICIENT: f64 = 1e30;

/// A [`Recipe`] applied to a rest pose, ready to pose the vertices step by step.
#[derive(Clone, Debug)]
pub struct Binding {
    points: usize,
    pub(crate) compiler: Compiler,
    pub(crate) dominant: Vec<u32>,
    pub(crate) operator: Operator,
    previous: Option<Previous>,
    pub(crate) flooded: Option<Box<Flooded>>,
    /// Made when new vertices first look for their points.
    pub(crate) seeker: OnceLock<Arc<Seeker>>,
}

/// Binds vertices to points at rest, by their distances alone.
///
/// * `vertices`, `points` – positions at rest, m, world frame.
/// * `usable` – one per point; where `false`, the point has no rest position, its entry in `points` is not read, and it
///   drives nothing.
///
/// # Errors
/// As [`bind_mesh`].
///
/// # Panics
/// If the recipe asks for cells of the mesh.
pub fn bind(
    vertices: &[Vector3<f64>],
    points: &[Vector3<f64>],
    usable: &[bool],
    recipe: &Recipe,
) -> Result<Binding, MappingError> {
    bind_mesh(&Mesh::of_vertices(vertices), points, usable, recipe)
}

/// Binds the vertices of a mesh to points at rest. Points as in [`bind`].
///
/// # Errors
/// No usable point; slices that do not match; a coordinate that is not finite or beyond 1e100 m; a scale, a
/// coefficient, paths, a filter or a rule that mean nothing; more pairs than [`MAX_INFLUENCES`]; targets that no point
/// reaches or that keep none, and vertices without targets; vertices whose points leave a rule without an answer: in a
/// plane for [`Rule::Barycentric`], too many or hardly apart for [`Rule::RadialBasis`].
///
/// # Panics
/// If the mesh does not tell what the recipe asks for.
pub fn bind_mesh(
    mesh: &Mesh<'_>,
    points: &[Vector3<f64>],
    usable: &[bool],
    recipe: &Recipe,
) -> Result<Binding, MappingError> {
    let usable = usable_points(points, usable)?;
    mesh.check(&recipe.weighting)?;
    let vertices = mesh.vertices;
    let Weighting {
        kernel,
        scale,
        ref coefficients,
        ..
    } = recipe.weighting;
    check_coefficients(coefficients, points.len())?;
    check_rule(&recipe.rule)?;
    recipe.filter.check()?;
    let given_scale = resolve_scale(scale, 1.0, points, &usable)?;
    let together = interpolates_all(recipe, usable.len());
    let seen = if together {
        // Distances make no difference, but for the nearest point.
        &Recipe {
            filter: Filter::KeepK(1),
            ..recipe.clone()
        }
    } else {
        recipe
    };
    let Kept {
        distances,
        typical,
        flooded,
    } = mesh.kept(points, &usable, seen)?; // [W1], [W6] to [W8], [F1] to [F5]
    let scale = match (scale, typical) {
        (None, Some(typical)) => typical, // [W9]
        (Some(_), _) | (None, None) => given_scale,
    };
    let reach = if let Rule::RadialBasis(basis) = recipe.rule {
        resolve_scale(basis.scale, basis.function.reach(), points, &usable)?
    } else {
        scale
    };
    let mut compiler = Compiler {
        kernel,
        scale,
        rule: recipe.rule,
        reach,
        together: together.then_some(usable),
        clusters: None,
    };
    let first_kept = distances.firsts();
    let kept = match recipe.reference {
        Reference::Initial => None,
        Reference::Previous => Some(distances.clone()),
    };
    let operator = compiler.compile(vertices, points, distances)?;
    Ok(Binding {
        points: points.len(),
        dominant: match &operator {
            Operator::Linear(linear) => linear.weights.dominant(),
            Operator::Shape(_) | Operator::Interpolation(_) => first_kept,
        },
        operator,
        previous: kept.and_then(|kept| {
            Previous::new(compiler.clone(), &recipe.weighting, kept, vertices, points)
        }),
        compiler,
        flooded: flooded.map(Box::new),
        seeker: OnceLock::new(),
    })
}

impl Binding {
    /// Writes the position of every vertex, m, for these positions of the points, m. O(k V).
    ///
    /// The usable points must be finite; beyond 1e150 m the result may not be. Mutable because shape matching starts from
    /// the last rotation, and the previous frame of reference is the last pose.
    ///
    /// # Errors
    /// [`MappingError::Length`] if there are not as many points or vertices as were bound, and from the previous frame of
    /// reference what leaves the rule without an answer there; nothing is written then.
    pub fn pose(
        &mut self,
        points: &[Vector3<f64>],
        out: &mut [Vector3<f64>],
    ) -> Result<(), MappingError> {
        check_length("points", points.len(), self.points)?;
        check_length("vertices", out.len(), self.dominant.len())?;
        if let Some(previous) = &mut self.previous {
            self.operator = previous.compile()?;
        }
        match &mut self.operator {
            Operator::Linear(linear) => linear.pose(points, out),
            Operator::Shape(shape) => shape.pose(points, out),
            Operator::Interpolation(all) => all.pose(points, out),
        }
        if let Some(previous) = &mut self.previous {
            previous.vertices.copy_from_slice(out);
            previous.points.copy_from_slice(points);
        }
        Ok(())
    }

    /// Writes the positions of these vertices, m, as the last [`Self::pose`] would have: those that
    /// [`Renewal::alone`](crate::Renewal::alone) tells, after they were bound anew. At their cost.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn pose_alone(&self, vertices: &[u32], out: &mut [Vector3<f64>]) {
        match &self.operator {
            Operator::Linear(linear) => linear.pose_alone(vertices, out),
            Operator::Shape(shape) => shape.pose_alone(vertices, out),
            Operator::Interpolation(_) => panic!("all vertices have one interpolation"),
        }
    }

    /// The point of greatest weight of each vertex, ties to the lower index; of fits that share or turn and of an
    /// interpolation of all points, the first kept: the nearest.
    #[must_use]
    pub fn dominant(&self) -> &[u32] {
        &self.dominant
    }

    /// The length scale of the kernel: the one asked for, or the one of `[W5]` or `[W9]`.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.compiler.scale
    }

    /// The points that act on a vertex with their weights, nearest point at rest first; by index where vertices share a
    /// fit or an interpolation.
    ///
    /// The weights sum to 1, but for an interpolation without a polynomial. In a fit they are what each point counts. Those
    /// of an interpolation of all n points are made here, O(n²).
    ///
    /// # Panics
    /// If there is no such vertex.
    #[must_use]
    pub fn weights(&self, vertex: usize) -> Vec<(u32, f64)> {
        match &self.operator {
            Operator::Linear(linear) => linear.weights.row(vertex).collect(),
            Operator::Shape(shape) => shape.row(vertex).collect(),
            Operator::Interpolation(all) => all.row(vertex),
        }
    }

    /// Shows each point that acts on a vertex and its weight, in the order of [`Self::weights`].
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn visit(&self, vertex: usize, mut see: impl FnMut(u32, f64)) {
        let mut see = |(point, weight)| see(point, weight);
        match &self.operator {
            Operator::Linear(linear) => linear.weights.row(vertex).for_each(&mut see),
            Operator::Shape(shape) => shape.row(vertex).for_each(&mut see),
            Operator::Interpolation(all) => all.row(vertex).into_iter().for_each(&mut see),
        }
    }

    /// The vertices that share the motion of this one: the first of them, and how many there are. `None` where the rule
    /// has no clusters. O(V).
    ///
    /// # Panics
    /// If there is no such vertex.
    #[must_use]
    pub fn companions(&self, vertex: usize) -> Option<(usize, usize)> {
        match &self.operator {
            Operator::Linear(_) | Operator::Interpolation(_) => None,
            Operator::Shape(shape) => shape.companions(vertex),
        }
    }

    /// Vertices and points of the last pose, m, where that is the frame of reference of the next.
    #[must_use]
    pub fn previous(&self) -> Option<[&[Vector3<f64>]; 2]> {
        let previous = self.previous.as_ref()?;
        Some([&previous.vertices, &previous.points])
    }

    /// The last rotation of each cluster: with [`Self::previous`] all of the past that the next pose depends on. Empty
    /// without shape matching.
    #[must_use]
    pub fn rotations(&self) -> &[UnitQuaternion<f64>] {
        match &self.operator {
            Operator::Linear(_) | Operator::Interpolation(_) => &[],
            Operator::Shape(shape) => shape.rotations(),
        }
    }

    /// Whether vertices follow points linearly, alike at every step: each moves by the sum of its points' displacements
    /// times their weights.
    #[must_use]
    pub fn is_linear(&self) -> bool {
        match &self.operator {
            Operator::Linear(_) | Operator::Interpolation(_) => self.previous.is_none(),
            Operator::Shape(_) => false,
        }
    }

    /// Goes on from the rotations of a binding of the same points to the mesh before it changed, where vertices that it
    /// had still have the same points. O(k V).
    ///
    /// # Panics
    /// If that one had vertices that this one has not.
    pub fn go_on(&mut self, before: &Self) {
        if let (Operator::Shape(own), Operator::Shape(before)) =
            (&mut self.operator, &before.operator)
        {
            own.go_on(before);
        }
    }

    /// Takes this pose as the last one, m, where that is the frame of reference of the next.
    ///
    /// # Panics
    /// If there are not as many vertices or points as were bound.
    pub fn resume(&mut self, vertices: &[Vector3<f64>], points: &[Vector3<f64>]) {
        if let Some(previous) = &mut self.previous {
            previous.vertices.copy_from_slice(vertices);
            previous.points.copy_from_slice(points);
        }
    }

    /// The cluster of a vertex; `None` without shape matching.
    ///
    /// # Panics
    /// If there is no such vertex.
    #[must_use]
    pub fn cluster(&self, vertex: usize) -> Option<u32> {
        match &self.operator {
            Operator::Linear(_) | Operator::Interpolation(_) => None,
            Operator::Shape(shape) => Some(shape.cluster(vertex)),
        }
    }

    /// How badly the points of each cluster fit the rotation of its last pose, relative to their spread at rest: 0 for a
    /// rigid motion. `[E2]` Empty without shape matching.
    ///
    /// # Panics
    /// If there are not as many points as were bound.
    #[must_use]
    pub fn strains(&self, points: &[Vector3<f64>]) -> Vec<f64> {
        assert_eq!(points.len(), self.points, "other points than were bound");
        match &self.operator {
            Operator::Linear(_) | Operator::Interpolation(_) => Vec::new(),
            Operator::Shape(shape) => shape.strains(points),
        }
    }

    /// Bytes that a pose has to move, output included: to compare its time with the memory's speed.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.operator {
            Operator::Linear(linear) => linear.bytes(),
            Operator::Shape(shape) => shape.bytes(),
            Operator::Interpolation(all) => all.bytes(),
        }
    }
}

/// The indices of the usable points, rising.
pub(crate) fn usable_points(
    points: &[Vector3<f64>],
    usable: &[bool],
) -> Result<Vec<u32>, MappingError> {
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

pub(crate) fn check_coefficients(coefficients: &[f64], points: usize) -> Result<(), MappingError> {
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
        Rule::ShapeMatching(ShapeMatching {
            fit: Fit::Linear { beta } | Fit::Quadratic { beta },
            ..
        }) if !(0.0..=1.0).contains(&beta) => Err(MappingError::Beta { beta }),
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
        | Rule::ShapeMatching(_)
        | Rule::MovingLeastSquares(_)
        | Rule::RadialBasis(_) => Ok(()),
    }
}

/// Whether all vertices have one interpolation of all points.
fn interpolates_all(recipe: &Recipe, usable: usize) -> bool {
    let Weighting {
        metric, targets, ..
    } = &recipe.weighting;
    matches!(recipe.rule, Rule::RadialBasis(_))
        && matches!(recipe.filter, Filter::KeepK(k) if k >= usable)
        && (metric, targets) == (&Metric::Straight, &Dimension::Vertex)
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

pub(crate) fn check_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), MappingError> {
    if found == expected {
        return Ok(());
    }
    Err(MappingError::Length {
        what,
        found,
        expected,
    })
}

pub(crate) fn check_coordinates(
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
