//! The files that a scene names.

use std::path::Path;

use sinew_formats::{
    mesh,
    take::{self, Take, Up},
};
use sinew_proto::v1::{self, Indices, Precision, Reals};

use super::{SceneFile, SceneFileError};
use crate::grid::flatten;

/// Reads the files that the scene names, relative to the scene file at `path`.
pub(super) fn files(scene: v1::Scene, path: &Path) -> Result<SceneFile, SceneFileError> {
    let refuse = |field, problem: String| SceneFileError::File {
        path: path.to_owned(),
        field,
        problem,
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut file = SceneFile {
        scene,
        take: None,
        grid: None,
        warnings: Vec::new(),
    };
    if let Some(name) = take_name(&file.scene) {
        let take = take::read(folder.join(name), &take::Options::default())
            .map_err(|error| refuse("motion.external.file", error.to_string()))?;
        file.apply(take);
    }
    if let Some(name) = mesh_name(&file.scene) {
        let loaded = mesh::read(&folder.join(name))
            .map_err(|error| refuse("mesh.file", error.to_string()))?;
        file.warnings.extend(loaded.warnings);
        file.grid = Some(loaded.grid);
    }
    Ok(file)
}

fn take_name(scene: &v1::Scene) -> Option<&str> {
    match scene.motion.as_ref()?.source.as_ref()? {
        v1::motion::Source::External(points) => {
            Some(points.file.as_str()).filter(|n| !n.is_empty())
        }
        v1::motion::Source::MassSpring(_) => None,
    }
}

fn mesh_name(scene: &v1::Scene) -> Option<&str> {
    match scene.mesh.as_ref()?.source.as_ref()? {
        v1::mesh::Source::File(name) => Some(name),
        v1::mesh::Source::Grid(_) | v1::mesh::Source::Asset(_) | v1::mesh::Source::Lattice(_) => {
            None
        }
    }
}

impl SceneFile {
    /// Fills from the take what the scene leaves open.
    pub(super) fn apply(&mut self, take: Take) {
        if let Some(v1::motion::Source::External(points)) = self
            .scene
            .motion
            .as_mut()
            .and_then(|motion| motion.source.as_mut())
        {
            fill_points(points, &take);
        }
        if let Some(v1::mesh::Source::Lattice(lattice)) = self
            .scene
            .mesh
            .as_mut()
            .and_then(|mesh| mesh.source.as_mut())
            && lattice.bones.is_empty()
        {
            lattice.bones = bones(&take);
        }
        if self.scene.up() == v1::UpAxis::Unspecified
            && let Some(up) = take.up()
        {
            self.scene.set_up(match up {
                Up::Y => v1::UpAxis::Y,
                Up::Z => v1::UpAxis::Z,
            });
        }
        self.warnings.extend(take.warnings().iter().cloned());
        self.take = Some(take);
    }
}

fn fill_points(points: &mut v1::ExternalPoints, take: &Take) {
    points.file.clear();
    if points.labels.is_empty() {
        points.labels = take.labels().to_vec();
    }
    if points.rest_positions.as_ref().is_none_or(Reals::is_empty) {
        let reference = take.reference();
        let absent: Vec<u32> = (0..)
            .zip(&reference.absent)
            .filter(|(_, absent)| **absent)
            .map(|(index, _)| index)
            .collect();
        points.rest_positions = Some(Reals::pack(&flatten(&reference.positions), Precision::F64));
        points.absent = (!absent.is_empty()).then(|| Indices::pack(&absent));
    }
    if points.rate_hz == 0.0 {
        points.rate_hz = take.rate_hz();
    }
}

/// The skeleton's bones; a bone without length says nothing about the body, and is left out.
fn bones(take: &Take) -> Vec<v1::Bone> {
    let reference = take.reference().positions;
    take.skeleton()
        .iter()
        .filter(|[from, to]| reference[*from] != reference[*to])
        .map(|[from, to]| v1::Bone {
            from: take.labels()[*from].clone(),
            to: take.labels()[*to].clone(),
            radius: 0.0,
        })
        .collect()
}
