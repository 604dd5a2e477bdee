use std::sync::Arc;

use nalgebra::Vector3;

use crate::clusters::{Clusters, cluster};
use crate::distance::Distances;
use crate::interpolation::Interpolation;
use crate::linear::Linear;
use crate::shape::Shape;
use crate::weights::{alike, for_fits, nearest_alone, normalise};
use crate::{
    Dimension, Fit, FitWeights, Kernel, MappingError, Metric, MovingFit, Rule, ShapeMatching,
    Weighting, barycentric, moving, rbf,
};

/// What a recipe compiles to.
#[derive(Clone, Debug)]
pub(crate) enum Operator {
    Linear(Linear),
    Shape(Shape),
    Interpolation(Interpolation),
}

/// The last stage: turns kept points into an [`Operator`] for any frame of reference.
#[derive(Clone, Debug)]
pub(crate) struct Compiler {
    pub(crate) kernel: Kernel,
    /// Of the kernel, m.
    pub(crate) scale: f64,
    pub(crate) rule: Rule,
    /// Of the radial function, m; not read by other rules.
    pub(crate) reach: f64,
    /// The points of one interpolation for all vertices, where there is one.
    pub(crate) together: Option<Vec<u32>>,
    /// Made when first needed: moving points change no set of them.
    pub(crate) clusters: Option<Arc<Clusters>>, // [C1]
}

impl Compiler {
    /// The operator of vertices and points in the frame of reference, with the distances between them there.
    ///
    /// # Errors
    /// What leaves the rule without an answer there.
    pub(crate) fn compile(
        &mut self,
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
        distances: Distances,
    ) -> Result<Operator, MappingError> {
        let weights = match self.rule {
            Rule::Direct => nearest_alone(&distances), // [M5]
            Rule::Mean => alike(distances),            // [M6]
            Rule::WeightedMean => normalise(distances, self.kernel, self.scale), // [W4]
            Rule::Barycentric => barycentric::weights(vertices, points, &distances)?, // [M7]
            Rule::RadialBasis(basis) => {
                if let Some(set) = &self.together {
                    let all = Interpolation::new(vertices, points, set, &basis, self.reach)?;
                    return Ok(Operator::Interpolation(all)); // [M10]
                }
                rbf::weights(vertices, points, &distances, &basis, self.reach)? // [M10]
            }
            Rule::MovingLeastSquares(MovingFit::Affine) => {
                let weights = for_fits(distances, self.kernel, self.scale); // [M13]
                moving::affine(vertices, points, weights)? // [M14]
            }
            Rule::MovingLeastSquares(MovingFit::Rigid) => {
                let weights = for_fits(distances, self.kernel, self.scale); // [M13]
                let (clusters, shares) = Clusters::of_rows(&weights); // [M15]
                let clusters = Arc::new(clusters);
                let shape = Shape::new(vertices, points, clusters, shares, Fit::Rigid);
                return Ok(Operator::Shape(shape));
            }
            Rule::ShapeMatching(ShapeMatching { fit, weights }) => {
                let clusters = self.clusters(&distances);
                let shares = match weights {
                    FitWeights::Alike => clusters.alike(),
                    FitWeights::ClusterMean => {
                        clusters.means(&for_fits(distances, self.kernel, self.scale)) // [M13]
                    }
                };
                let shape = Shape::new(vertices, points, clusters, shares, fit);
                return Ok(Operator::Shape(shape));
            }
        };
        Ok(Operator::Linear(Linear::new(vertices, points, weights)))
    }

    fn clusters(&mut self, distances: &Distances) -> Arc<Clusters> {
        let clusters = self
            .clusters
            .get_or_insert_with(|| Arc::new(cluster(distances)));
        Arc::clone(clusters)
    }
}

/// What makes the operator anew from each pose. `[M16]`
#[derive(Clone, Debug)]
pub(crate) struct Previous {
    compiler: Compiler,
    weighting: Weighting,
    /// The points kept at rest, at their distances there.
    kept: Distances,
    /// The last pose, m; at first that of rest.
    pub(crate) vertices: Vec<Vector3<f64>>,
    pub(crate) points: Vec<Vector3<f64>>,
}

impl Previous {
    /// `None` for a rule that makes the same operator in every frame: `x + W (p′ − p)` adds up to `x⁰ + W (p′ − p⁰)`.
    pub(crate) fn new(
        compiler: Compiler,
        weighting: &Weighting,
        kept: Distances,
        vertices: &[Vector3<f64>],
        points: &[Vector3<f64>],
    ) -> Option<Self> {
        match compiler.rule {
            Rule::Direct | Rule::Mean | Rule::Barycentric => None,
            Rule::WeightedMean
            | Rule::ShapeMatching(_)
            | Rule::MovingLeastSquares(_)
            | Rule::RadialBasis(_) => Some(Self {
                compiler,
                weighting: weighting.clone(),
                kept,
                vertices: vertices.to_vec(),
                points: points.to_vec(),
            }),
        }
    }

    /// The operator of the last pose.
    ///
    /// # Errors
    /// As [`Compiler::compile`].
    pub(crate) fn compile(&mut self) -> Result<Operator, MappingError> {
        let Self {
            compiler,
            weighting,
            kept,
            vertices,
            points,
        } = self;
        let distances = match (&weighting.metric, weighting.targets) {
            (Metric::Straight, Dimension::Vertex) => {
                kept.measured_at(vertices, points, &weighting.coefficients)
            }
            (Metric::Straight | Metric::Paths(_) | Metric::Geodesics(_), _) => kept.clone(),
        };
        compiler.compile(vertices, points, distances)
    }
}
