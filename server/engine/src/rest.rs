//! The rest pose, and mappings bound to it.

use nalgebra::Vector3;
use sinew_mapping::Binding;
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    build::{kernel_refusal, refuse},
    digest::Digest,
    scene::{Mapping, SceneError},
};

/// Points and vertices at rest: all that a mapping is bound to. It never changes, so that a mapping can be bound while
/// the world steps.
#[derive(Debug)]
pub struct Rest {
    pub(crate) labels: Vec<String>,
    /// m; not read where not present.
    pub(crate) points: Vec<Vector3<f64>>,
    /// Which points have a position at rest.
    pub(crate) present: Vec<bool>,
    /// m
    pub(crate) vertices: Vec<Vector3<f64>>,
}

/// A mapping bound to a rest pose.
#[derive(Debug)]
pub struct Bound {
    pub(crate) mapping: Mapping,
    pub(crate) binding: Binding,
    /// Hash of `mapping`.
    fingerprint: u64,
}

impl Rest {
    /// Binds a mapping. This is the only validation of one: what binds, poses.
    ///
    /// # Errors
    /// [`SceneError`], whose field is below `scene.mapping`.
    pub fn bind(&self, mapping: Mapping) -> Result<Bound, SceneError> {
        let usable = self.usable(&mapping)?;
        let binding =
            sinew_mapping::bind(&self.vertices, &self.points, &usable, &mapping.recipe)
                .map_err(|error| kernel_refusal("MAPPING_REFUSED", "scene.mapping", &error))?;
        Ok(Bound {
            binding,
            // Numbers are written so that they read back the same: equal texts are equal mappings.
            fingerprint: xxh3_64(format!("{mapping:?}").as_bytes()),
            mapping,
        })
    }

    /// Which points may drive the mesh.
    fn usable(&self, mapping: &Mapping) -> Result<Vec<bool>, SceneError> {
        if mapping.points.is_empty() {
            return Ok(self.present.clone());
        }
        let mut usable = vec![false; self.present.len()];
        for (i, label) in mapping.points.iter().enumerate() {
            let field = format!("scene.mapping.points[{i}]");
            match self.labels.iter().position(|known| known == label) {
                Some(point) if self.present[point] => usable[point] = true,
                Some(_) => {
                    let problem = format!("is `{label}`, which has no rest position");
                    let remedy = "map onto points that have one";
                    return Err(refuse("POINT_ABSENT", field, problem, remedy));
                }
                None => {
                    let problem = format!("is `{label}`, which no point has");
                    let remedy = "use the labels of the scene's points";
                    return Err(refuse("LABEL_UNKNOWN", field, problem, remedy));
                }
            }
        }
        Ok(usable)
    }
}

impl Bound {
    /// All that the next pose depends on, apart from the points.
    pub(crate) fn digest(&self, digest: &mut Digest) {
        let rotations = self.binding.rotations().iter();
        let state: Vec<u64> = std::iter::once(self.fingerprint)
            .chain(rotations.flat_map(|q| q.coords.iter()).map(|x| x.to_bits()))
            .collect();
        digest.words(&state);
        for positions in self.binding.previous().iter().flatten() {
            digest.vectors(positions);
        }
    }
}
