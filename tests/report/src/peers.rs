//! Other programs, run on the same input in the same run.
//!
//! The environment's `SINEW_PEERS` names the folder where `setup.sh` of the peers was run.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use nalgebra::Vector3;
use serde::Deserialize;
use sinew_mesh::{Cell, CellType, Grid};

use crate::section::Failure;

/// The variable that names the folder of the peers.
pub(crate) const VARIABLE: &str = "SINEW_PEERS";

/// The peers' folder.
pub(crate) struct Peers {
    folder: PathBuf,
}

/// What a peer says of one measurement.
#[derive(Debug, Deserialize)]
pub(crate) struct Figure {
    /// What was measured.
    pub(crate) item: String,
    /// What of: sizes and variants, separated by `/`.
    pub(crate) n: String,
    pub(crate) peer: String,
    pub(crate) version: String,
    /// For which it kept the processor, the median.
    #[serde(rename = "user_median")]
    pub(crate) seconds: f64,
    #[serde(default)]
    pub(crate) error_metric: Option<serde_json::Value>,
}

impl Peers {
    /// The peers, or a plain word where they are not.
    pub(crate) fn find() -> Result<Self, String> {
        let folder = std::env::var_os(VARIABLE).map(PathBuf::from).ok_or_else(|| {
            format!("The peers were not measured: {VARIABLE} does not name the folder where their setup.sh was run.")
        })?;
        Ok(Self { folder })
    }

    /// Where they are.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Runs one of the peers' Python scripts on one thread and reads what it prints.
    ///
    /// # Errors
    /// Where it cannot be run, or says that it failed.
    pub(crate) fn python(
        &self,
        script: &str,
        arguments: &[&str],
        environment: &[(&str, &str)],
    ) -> Result<Vec<Figure>, Failure> {
        let python = self.folder.join("venv/bin/python");
        let output = Command::new(&python)
            .arg(script)
            .args(arguments)
            .env("TH", "1")
            .envs(environment.iter().copied())
            .current_dir(&self.folder)
            .output()
            .map_err(|error| format!("cannot run {}: {error}", python.display()))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().last().unwrap_or("nothing");
            return Err(format!("{script} failed, and said: {last}").into());
        }
        let lines = String::from_utf8(output.stdout)?;
        let figures = lines.lines().filter(|line| line.starts_with('{'));
        Ok(figures
            .map(serde_json::from_str)
            .collect::<Result<_, _>>()?)
    }

    /// Reads positions from a file of little-endian f64 in the peers' `data`.
    ///
    /// # Errors
    /// Where it cannot be read or ends within a position.
    pub(crate) fn positions(&self, name: &str) -> Result<Vec<Vector3<f64>>, Failure> {
        let path = self.folder.join("data").join(name);
        let bytes = read(&path)?;
        let (numbers, rest) = bytes.as_chunks::<8>();
        let numbers: Vec<f64> = numbers
            .iter()
            .map(|bytes| f64::from_le_bytes(*bytes))
            .collect();
        let (positions, more) = numbers.as_chunks::<3>();
        if !rest.is_empty() || !more.is_empty() {
            return Err(format!("{} ends within a position", path.display()).into());
        }
        Ok(positions.iter().map(|p| Vector3::from(*p)).collect())
    }
}

impl Peers {
    /// A mesh of tetrahedra in the peers' `data`.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub(crate) fn tetrahedra(&self, folder: &str) -> Result<Grid, Failure> {
        let mut grid = Grid {
            positions: self.positions(&format!("{folder}/points.f64"))?,
            ..Grid::default()
        };
        for vertices in self
            .indices(&format!("{folder}/tets.i32"))?
            .as_chunks::<4>()
            .0
        {
            grid.cells.push(Cell {
                kind: CellType::Tetrahedron,
                vertices,
                face_stream: &[],
            });
        }
        Ok(grid)
    }

    /// Reads indices from a file of little-endian i32 in the peers' `data`.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub(crate) fn indices(&self, name: &str) -> Result<Vec<u32>, Failure> {
        let bytes = read(&self.folder.join("data").join(name))?;
        let (numbers, _) = bytes.as_chunks::<4>();
        Ok(numbers
            .iter()
            .map(|bytes| u32::from_le_bytes(*bytes))
            .collect())
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()).into())
}

/// The same error to so many digits, as a script prints it.
pub(crate) fn error_of(figure: &Figure, name: &str) -> Option<f64> {
    figure.error_metric.as_ref()?.get(name)?.as_f64()
}
