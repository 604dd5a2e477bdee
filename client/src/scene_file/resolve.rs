//! The files that a scene names.

use std::path::Path;

use nalgebra::Vector3;
use sinew_formats::{
    cloud, mesh,
    take::{self, Take, Up},
};
use sinew_mesh::{CellShape, Grid};
use sinew_proto::v1::{self, Indices, Precision, Reals, elastic_solid::Cloud};

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
    if let Some((name, unit)) = take_file(&file.scene) {
        let unit_scale = unit_scale(unit)
            .map_err(|problem| refuse("motion.external.file_unit_metres", problem))?;
        let take = take::read(folder.join(name), &take::Options { unit_scale })
            .map_err(|error| refuse("motion.external.file", error.to_string()))?;
        file.apply(take);
    }
    if let Some(solid) = elastic(&mut file.scene) {
        let cloud = cloud(solid, folder);
        let cloud = cloud.map_err(|problem| refuse("motion.elastic.file", problem))?;
        if let Some(Points {
            positions,
            warnings,
        }) = cloud
        {
            let positions = Reals::pack(&flatten(&positions), Precision::F64);
            solid.cloud = Some(Cloud::Positions(positions));
            file.warnings.extend(warnings);
        }
    }
    if let Some((name, unit)) = surface_file(&file.scene) {
        let unit = unit_scale(unit)
            .map_err(|problem| refuse("motion.particles.surface.file_unit_metres", problem))?;
        let loaded = mesh::read(&folder.join(name))
            .map_err(|error| refuse("motion.particles.surface.file", error.to_string()))?;
        file.warnings.extend(loaded.warnings);
        file.lay(&loaded.grid, unit.unwrap_or(1.0));
    }
    if let Some((name, unit)) = mesh_file(&file.scene) {
        let unit = unit_scale(unit).map_err(|problem| refuse("mesh.file_unit_metres", problem))?;
        let mut loaded = mesh::read(&folder.join(name))
            .map_err(|error| refuse("mesh.file", error.to_string()))?;
        for position in &mut loaded.grid.positions {
            *position *= unit.unwrap_or(1.0);
        }
        file.warnings.extend(loaded.warnings);
        file.grid = Some(loaded.grid);
    }
    Ok(file)
}

/// Metres per unit, where the scene says; 0 is a field left out.
fn unit_scale(unit: f64) -> Result<Option<f64>, String> {
    match unit {
        0.0 => Ok(None),
        unit if unit.is_finite() && unit > 0.0 => Ok(Some(unit)),
        unit => Err(format!(
            "is {unit}; give metres per unit of the file, such as 0.0254 for inches"
        )),
    }
}

fn take_file(scene: &v1::Scene) -> Option<(&str, f64)> {
    match scene.motion.as_ref()?.source.as_ref()? {
        v1::motion::Source::External(points) => {
            Some((&*points.file, points.file_unit_metres)).filter(|(name, _)| !name.is_empty())
        }
        v1::motion::Source::MassSpring(_)
        | v1::motion::Source::Particles(_)
        | v1::motion::Source::Elastic(_) => None,
    }
}

fn elastic(scene: &mut v1::Scene) -> Option<&mut v1::ElasticSolid> {
    match scene.motion.as_mut()?.source.as_mut()? {
        v1::motion::Source::Elastic(solid) => Some(solid),
        v1::motion::Source::MassSpring(_)
        | v1::motion::Source::Particles(_)
        | v1::motion::Source::External(_) => None,
    }
}

/// Points of a file.
struct Points {
    positions: Vec<Vector3<f64>>, // m
    /// What the author should know.
    warnings: Vec<String>,
}

/// The points of the file that a solid names; `None` where it names none.
fn cloud(solid: &mut v1::ElasticSolid, folder: &Path) -> Result<Option<Points>, String> {
    let Some(Cloud::File(name)) = &solid.cloud else {
        return Ok(None);
    };
    let path = folder.join(name);
    let unit = unit_scale(std::mem::take(&mut solid.file_unit_metres))?.unwrap_or(1.0);
    let spacing = std::mem::take(&mut solid.file_sample_spacing);
    let told = |error: &dyn std::error::Error| error.to_string();
    let (mut positions, warnings) = if spacing == 0.0 {
        let cloud = cloud::read(&path).map_err(|error| told(&error))?;
        (cloud.positions, Vec::new())
    } else {
        let skin = mesh::read(&path).map_err(|error| told(&error))?;
        let filled = sinew_mesh::fill(CellShape::Hexahedron, spacing / unit, &skin.grid);
        let filled = filled.map_err(|error| told(&error))?;
        let middle = |cell: &[u32]| {
            let corners = cell.iter().map(|&v| filled.positions[v as usize]);
            corners.sum::<Vector3<f64>>() / 8.0
        };
        let middles = filled.cells.connectivity.chunks(8).map(middle);
        (middles.collect(), skin.warnings)
    };
    for position in &mut positions {
        *position *= unit;
    }
    Ok(Some(Points {
        positions,
        warnings,
    }))
}

fn surface_file(scene: &v1::Scene) -> Option<(&str, f64)> {
    match scene.motion.as_ref()?.source.as_ref()? {
        v1::motion::Source::Particles(particles) => {
            let surface = particles.surface.as_ref()?;
            Some((&*surface.file, surface.file_unit_metres)).filter(|(name, _)| !name.is_empty())
        }
        v1::motion::Source::External(_)
        | v1::motion::Source::MassSpring(_)
        | v1::motion::Source::Elastic(_) => None,
    }
}

fn mesh_file(scene: &v1::Scene) -> Option<(&str, f64)> {
    let mesh = scene.mesh.as_ref()?;
    match mesh.source.as_ref()? {
        v1::mesh::Source::File(name) => Some((name, mesh.file_unit_metres)),
        v1::mesh::Source::Grid(_) | v1::mesh::Source::Asset(_) | v1::mesh::Source::Lattice(_) => {
            None
        }
    }
}

impl SceneFile {
    /// Lays the particles on a surface: one on each of its points, or on all points where there is none.
    fn lay(&mut self, grid: &Grid, unit: f64) {
        let Some(v1::motion::Source::Particles(particles)) =
            (self.scene.motion.as_mut()).and_then(|motion| motion.source.as_mut())
        else {
            return;
        };
        let surface = sinew_mesh::surface(&grid.cells);
        let mut positions = match &surface.vertices[..] {
            [] => grid.positions.clone(),
            vertices => vertices
                .iter()
                .map(|&i| grid.positions[i as usize])
                .collect(),
        };
        for position in &mut positions {
            *position *= unit;
        }
        particles.positions = Some(Reals::pack(&flatten(&positions), Precision::F64));
        let given = particles.surface.get_or_insert_default();
        given.file.clear();
        given.file_unit_metres = 0.0;
        given.triangles = Some(Indices::pack(surface.triangles.as_flattened()));
    }

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
    points.file_unit_metres = 0.0;
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
