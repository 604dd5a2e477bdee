//! The rest pose, and mappings bound to it.

use std::sync::{Arc, OnceLock};

use nalgebra::Vector3;
use sinew_mapping::{Binding, Change, Mesh, Nearest, Renewal};
use sinew_mesh::{Cells, Complex};
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    build::refuse,
    cells::Asked,
    digest::Digest,
    gauge::Scale,
    refusal::mapping_refusal,
    scene::{Mapping, Recipe, SceneError},
    wiring::{Rewiring, Turn},
};

/// Points and vertices at rest: all that a mapping is bound to. It never changes, so that a mapping can be bound while
/// the world steps; where the mesh's topology changes, the world takes another.
#[derive(Clone, Debug)]
pub struct Rest {
    /// Of the mesh's topology.
    pub(crate) version: u64,
    pub(crate) labels: Arc<[String]>,
    /// m; not read where not present.
    pub(crate) points: Arc<[Vector3<f64>]>,
    /// Which points have a position at rest.
    pub(crate) present: Arc<[bool]>,
    /// m
    pub(crate) vertices: Vec<Vector3<f64>>,
    pub(crate) cells: Arc<Cells>,
    /// Whether the mesh may change.
    pub(crate) may_change: bool,
    /// Made when a mapping first asks for it.
    pub(crate) complex: OnceLock<Complex>,
}

/// A mapping bound to a rest pose.
#[derive(Debug)]
pub struct Bound {
    pub(crate) mapping: Mapping,
    pub(crate) binding: Binding,
    /// Which points may drive the mesh.
    usable: Vec<bool>,
    /// Of the rest pose's topology.
    pub(crate) version: u64,
    /// Whether it was posed: the frame's vertices are then what it makes of the frame's points.
    pub(crate) is_posed: bool,
    /// Hash of `mapping`.
    fingerprint: u64,
}

/// What of a binding was bound anew.
pub(crate) enum Rebound {
    Not,
    Some(Box<Renewal>),
    Whole(Box<Binding>),
}

impl Rebound {
    /// The vertices that have to be posed where all others were, on the same points; `None` where all have to.
    pub(crate) fn stale(&self) -> Option<Vec<u32>> {
        match self {
            Self::Not => Some(Vec::new()),
            Self::Some(renewal) => renewal.alone().map(<[u32]>::to_vec),
            Self::Whole(_) => None,
        }
    }
}

impl Rest {
    /// Before any change of the mesh, where none may come. `points` are not read where not `present`.
    pub(crate) fn new(
        labels: Vec<String>,
        points: Vec<Vector3<f64>>,
        present: Vec<bool>,
        vertices: Vec<Vector3<f64>>,
        cells: &Arc<Cells>,
    ) -> Self {
        Self {
            version: 0,
            labels: labels.into(),
            points: points.into(),
            present: present.into(),
            vertices,
            cells: Arc::clone(cells),
            may_change: false,
            complex: OnceLock::new(),
        }
    }

    /// The same points, and a mesh that changed.
    pub(crate) fn changed(
        &self,
        version: u64,
        vertices: Vec<Vector3<f64>>,
        cells: Arc<Cells>,
    ) -> Self {
        Self {
            version,
            labels: Arc::clone(&self.labels),
            points: Arc::clone(&self.points),
            present: Arc::clone(&self.present),
            vertices,
            cells,
            may_change: true,
            complex: OnceLock::new(),
        }
    }

    /// Binds a mapping. This is the only validation of one: what binds, poses.
    ///
    /// # Errors
    /// [`SceneError`], whose field is below `scene.mapping`.
    pub fn bind(&self, mapping: Mapping) -> Result<Bound, SceneError> {
        let usable = self.usable(&mapping)?;
        Ok(Bound {
            binding: self.binding(&mapping, &mapping.recipe, &usable)?,
            usable,
            version: self.version,
            is_posed: false,
            // Numbers are written so that they read back the same: equal texts are equal mappings.
            fingerprint: xxh3_64(format!("{mapping:?}").as_bytes()),
            mapping,
        })
    }

    /// How far the points of a mapping are from each target of its weighting, all of them: what filters and kernel see.
    ///
    /// # Errors
    /// As [`Rest::bind`], of a weighting.
    pub fn distances(&self, mapping: &Mapping) -> Result<Nearest, SceneError> {
        let usable = self.usable(mapping)?;
        let asked = Asked::new(self, mapping)?;
        let mesh = asked.mesh(&self.vertices, self.version > 0, false);
        sinew_mapping::distances(&mesh, &self.points, &usable, &mapping.recipe.weighting)
            .map_err(|error| mapping_refusal(mapping, &error))
    }

    /// Binds by a recipe that is the mapping's, but for what it leaves open.
    fn binding(
        &self,
        mapping: &Mapping,
        recipe: &Recipe,
        usable: &[bool],
    ) -> Result<Binding, SceneError> {
        let asked = Asked::new(self, mapping)?;
        let mesh = asked.mesh(&self.vertices, self.version > 0, self.may_change);
        sinew_mapping::bind_mesh(&mesh, &self.points, usable, recipe)
            .map_err(|error| mapping_refusal(mapping, &error))
    }

    /// The cells of every dimension.
    pub(crate) fn complex(&self) -> &Complex {
        let cells = || Complex::new(Arc::clone(&self.cells), self.vertices.len());
        self.complex.get_or_init(cells)
    }

    /// Which points may drive the mesh.
    fn usable(&self, mapping: &Mapping) -> Result<Vec<bool>, SceneError> {
        if mapping.points.is_empty() {
            return Ok(self.present.to_vec());
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
    /// Binds the mapping to a mesh that changed, by the scale that it had: only what the change makes other than it was,
    /// where that can be told, else all. Where the last pose is its frame of reference, it goes on from there, new vertices
    /// from the midst of their parents.
    ///
    /// # Errors
    /// As [`Rest::bind`].
    pub(crate) fn rebound(&self, turn: &Turn<'_>) -> Result<Rebound, SceneError> {
        let Turn { rest, patch, .. } = *turn;
        let recipe = &self.mapping.recipe;
        let known = self.binding.dominant().len();
        let counts = [known, rest.vertices.len()];
        let [before, after] = counts.map(|count| u32::try_from(count).expect("slots are u32"));
        let stale: Vec<u32> = turn.moved.iter().copied().chain(before..after).collect();
        if stale.is_empty() && recipe.stands_alone() {
            return Ok(Rebound::Not);
        }
        let mesh = Mesh::of_vertices(&rest.vertices);
        let rewiring = Rewiring::new(turn, known, recipe);
        let change = Change {
            vertices: &stale,
            wiring: rewiring.as_ref().map(Rewiring::wiring),
        };
        let renewal = (self.binding).renewal(&mesh, &rest.points, &self.usable, recipe, &change);
        if let Some(renewal) = renewal {
            return Ok(Rebound::Some(Box::new(renewal)));
        }
        let mut recipe = recipe.clone();
        recipe.weighting.scale = Some(self.binding.scale());
        let mut binding = rest.binding(&self.mapping, &recipe, &self.usable)?;
        binding.go_on(&self.binding);
        if let Some([vertices, points]) = self.binding.previous() {
            let mut vertices = vertices.to_vec();
            for ends in patch.vertex_parent_offsets.windows(2) {
                let parents = &patch.vertex_parents[ends[0] as usize..ends[1] as usize];
                let sum: Vector3<f64> = parents
                    .iter()
                    .map(|&parent| vertices[parent as usize])
                    .sum();
                vertices.push(sum / parents.len().max(1) as f64);
            }
            binding.resume(&vertices, points);
        }
        Ok(Rebound::Whole(Box::new(binding)))
    }

    /// Takes over what was bound anew to this version of the mesh.
    pub(crate) fn take(&mut self, rebound: Rebound, version: u64) {
        match rebound {
            Rebound::Not => {}
            Rebound::Some(renewal) => self.binding.renew(*renewal),
            Rebound::Whole(binding) => self.binding = *binding,
        }
        self.version = version;
    }

    /// What measures of the mesh compare with.
    pub(crate) fn scale<'a>(&'a self, cells: &'a Cells, rest: &'a Rest) -> Scale<'a> {
        Scale {
            cells,
            rest: &rest.vertices,
            binding: &self.binding,
        }
    }

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
