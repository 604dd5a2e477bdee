//! All views of a sweep in one Rerun recording.

use std::path::Path;

use re_sdk::blueprint::{Blueprint, BlueprintActivation, ContainerLike, Grid, Spatial3DView};
use re_sdk::{RecordingStream, RecordingStreamBuilder};
use re_sdk_types::archetypes::{Mesh3D, Points3D, ViewCoordinates};
use re_sdk_types::components::{Color, Radius};
use sinew_client::sweep::Shot;
use sinew_mesh::vertex_normals;
use sinew_proto::v1::UpAxis;

use super::{picture::Light, sheet::encoded, skin::Skin};
use crate::Failure;

/// A recording that is being written.
pub(crate) struct Recording {
    stream: RecordingStream,
}

/// The entity of a view.
fn entity(view: usize) -> String {
    format!("view_{view}")
}

impl Recording {
    /// Makes the file, with one labelled view per label.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub(crate) fn create(
        path: &Path,
        labels: &[&str],
        columns: usize,
        up: UpAxis,
    ) -> Result<Self, Failure> {
        let stream = RecordingStreamBuilder::new("sinew_sweep").save(path)?;
        let views = labels
            .iter()
            .enumerate()
            .map(|(view, label)| -> ContainerLike {
                Spatial3DView::new(*label)
                    .with_origin(format!("/{}", entity(view)))
                    .into()
            });
        let grid = Grid::new(views).with_grid_columns(u32::try_from(columns)?);
        Blueprint::new(grid)
            .with_auto_views(false)
            .with_auto_layout(false)
            .send(&stream, BlueprintActivation::default())?;
        let coordinates = match up {
            UpAxis::Y => ViewCoordinates::RIGHT_HAND_Y_UP(),
            UpAxis::Unspecified | UpAxis::Z => ViewCoordinates::RIGHT_HAND_Z_UP(),
        };
        for view in 0..labels.len() {
            stream.log_static(entity(view), &coordinates)?;
        }
        Ok(Self { stream })
    }

    /// Adds a view's mesh and points at one step: the whole of them where the mesh is another than before, else what
    /// moved.
    ///
    /// # Errors
    /// Where Rerun cannot take it.
    pub(crate) fn add(
        &self,
        view: usize,
        shot: &Shot,
        Skin {
            surface,
            colours,
            points: own,
        }: &Skin,
        changed: bool,
    ) -> Result<(), Failure> {
        self.stream
            .set_time_sequence("step", i64::try_from(shot.step)?);
        self.stream
            .set_duration_secs("simulation_time", shot.time_seconds);
        let mut normals = Vec::new();
        vertex_normals(&shot.grid.positions, surface, &mut normals);
        let narrow = |position: &nalgebra::Vector3<f64>| <[f32; 3]>::from(position.cast::<f32>());
        let corners = surface
            .vertices
            .iter()
            .map(|&v| narrow(&shot.grid.positions[v as usize]));
        let points = shot.points.iter().map(narrow);
        let coloured = |light: &Light| {
            let [r, g, b] = encoded(light);
            Color::from_rgb(r, g, b)
        };
        let (mut mesh, mut points) = if changed {
            let mesh = Mesh3D::new(corners)
                .with_triangle_indices(surface.triangles.iter().copied())
                .with_vertex_colors(colours.iter().map(coloured));
            let points = Points3D::new(points)
                .with_radii([Radius::new_ui_points(3.0)])
                .with_colors([Color::from_rgb(200, 40, 30)]);
            (mesh, points)
        } else {
            let mesh = Mesh3D::update_fields().with_vertex_positions(corners);
            (mesh, Points3D::update_fields().with_positions(points))
        };
        if let Some(own) = own {
            mesh = mesh.with_vertex_colors(colours.iter().map(coloured));
            points = points.with_colors(own.iter().map(coloured));
        }
        self.stream.log(
            format!("{}/mesh", entity(view)),
            &mesh.with_vertex_normals(normals),
        )?;
        self.stream
            .log(format!("{}/points", entity(view)), &points)?;
        Ok(())
    }

    /// Waits until the file is whole.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        Ok(self.stream.flush_blocking()?)
    }
}
