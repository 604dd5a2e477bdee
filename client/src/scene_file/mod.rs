//! Scene files: `sinew.v1.Scene` in protobuf's JSON mapping, or TOML with the same names.
//!
//! Three fields exist in files only and are resolved here, before the scene is posted: `motion.external.file`, a take
//! (C3D, TRC, BVH and others), `motion.elastic.file`, a cloud of points (PLY, CSV, XYZ, BGEO) or a watertight surface to
//! be filled with points, and `mesh.file`, a mesh. Paths are relative to the scene file. From a take come
//!
//! * `motion.external.labels`, `restPositions`, `absent` and `rateHz`, each where the scene leaves it empty;
//! * `mesh.lattice.bones`, the take's skeleton, where the scene asks for a lattice and gives no bones;
//! * `up`, where the take knows it and the scene does not say.

mod parse;
mod resolve;

use std::{
    io,
    path::{Path, PathBuf},
};

pub use parse::{ParseError, Syntax};
use serde::de::DeserializeOwned;
use sinew_formats::take::Take;
use sinew_mesh::Grid;
use sinew_proto::v1::{self, elastic_solid::Cloud};

use crate::{Client, ClientError};

/// A scene with what its files hold.
#[derive(Debug)]
pub struct SceneFile {
    /// The scene, complete save for the mesh where [`SceneFile::grid`] holds it.
    pub scene: v1::Scene,
    /// The take that moves its points.
    pub take: Option<Take>,
    /// The mesh read from `mesh.file`.
    pub grid: Option<Grid>,
    /// What the author should know of the files.
    pub warnings: Vec<String>,
}

/// Why a scene file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneFileError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The scene file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The name does not tell the syntax.
    #[error("{}: a scene file ends in .json or .toml", .0.display())]
    Extension(PathBuf),
    /// The text is no scene.
    #[error("{}, {source}", path.display())]
    Parse {
        /// The scene file.
        path: PathBuf,
        /// Where and what.
        source: ParseError,
    },
    /// The file that a field names cannot be used.
    #[error("{}, {field}: {problem}", path.display())]
    File {
        /// The scene file.
        path: PathBuf,
        /// The field that names it.
        field: &'static str,
        /// What is wrong with it.
        problem: String,
    },
}

impl SceneFile {
    /// Reads a scene file and the files that it names.
    ///
    /// # Errors
    /// [`SceneFileError`]: which file, which line or field, what is wrong.
    pub fn load(path: &Path) -> Result<Self, SceneFileError> {
        resolve::files(read(path)?, path)
    }

    /// Makes a scene of a text and, where it names a take, of that take: what [`SceneFile::load`] does, without files.
    ///
    /// # Errors
    /// [`ParseError`] where the text is no scene.
    pub fn of_text(text: &str, syntax: Syntax, take: Option<Take>) -> Result<Self, ParseError> {
        let mut file = Self {
            scene: parse::message(text, syntax)?,
            take: None,
            grid: None,
            warnings: Vec::new(),
        };
        if let Some(take) = take {
            file.apply(take);
        }
        Ok(file)
    }

    /// The scene, ready to be posted: its mesh is inside, or uploaded where it is large.
    ///
    /// # Errors
    /// The server's refusal of the upload.
    pub async fn scene_for(&self, client: &Client) -> Result<v1::Scene, ClientError> {
        let mut scene = self.scene.clone();
        if let Some(grid) = &self.grid {
            let mesh = scene.mesh.get_or_insert_default();
            mesh.source = Some(client.mesh_source(grid).await?);
            mesh.file_unit_metres = 0.0;
        }
        if let Some(v1::motion::Source::Elastic(solid)) = scene
            .motion
            .as_mut()
            .and_then(|motion| motion.source.as_mut())
            && let Some(Cloud::Positions(positions)) = &mut solid.cloud
        {
            solid.cloud = Some(client.cloud(std::mem::take(positions)).await?);
        }
        Ok(scene)
    }
}

/// Reads a file that holds `sinew.v1.Mapping` alone, as it stands below `mapping` in a scene file.
///
/// # Errors
/// [`SceneFileError`]: which file, which line or field, what is wrong.
pub fn load_mapping(path: &Path) -> Result<v1::Mapping, SceneFileError> {
    read(path)
}

/// Reads a file that holds `sinew.v1.EditMeshRequest`, such as `{"edits": [{"remove": {"cells": {"values": [7]}}}]}`.
///
/// # Errors
/// [`SceneFileError`]: which file, which line or field, what is wrong.
pub fn load_edits(path: &Path) -> Result<v1::EditMeshRequest, SceneFileError> {
    read(path)
}

pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, SceneFileError> {
    let text = std::fs::read_to_string(path).map_err(|source| SceneFileError::Read {
        path: path.to_owned(),
        source,
    })?;
    let syntax = Syntax::of(path).ok_or_else(|| SceneFileError::Extension(path.to_owned()))?;
    parse::message(&text, syntax).map_err(|source| SceneFileError::Parse {
        path: path.to_owned(),
        source,
    })
}
