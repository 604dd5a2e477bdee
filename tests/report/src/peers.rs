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

    /// Runs a LAMMPS script whose first run is not counted.
    ///
    /// # Errors
    /// Where it cannot be run, or does not say what it took.
    pub(crate) fn lammps(
        &self,
        script: &str,
        arguments: &[&str],
        threads: usize,
    ) -> Result<Lammps, Failure> {
        let program = self.folder.join("venv/bin/lmp");
        let file = std::env::temp_dir().join(format!("sinew-report-{}.lmp", std::process::id()));
        fs::write(&file, script)?;
        let output = Command::new(&program)
            .args(["-log", "none", "-in"])
            .arg(&file)
            .args(arguments)
            .env("OMP_NUM_THREADS", threads.to_string())
            .current_dir(&self.folder)
            .output()
            .map_err(|error| format!("cannot run {}: {error}", program.display()));
        fs::remove_file(&file)?;
        Lammps::read(&String::from_utf8_lossy(&output?.stdout), threads)
    }

    /// Reads positions from a file of little-endian f64 in the peers' `data`.
    ///
    /// # Errors
    /// Where it cannot be read or ends within a position.
    pub(crate) fn positions(&self, name: &str) -> Result<Vec<Vector3<f64>>, Failure> {
        let numbers = self.numbers(name, f64::from_le_bytes)?;
        let (positions, more) = numbers.as_chunks::<3>();
        if !more.is_empty() {
            return Err(format!("{name} ends within a position").into());
        }
        Ok(positions.iter().map(|p| Vector3::from(*p)).collect())
    }

    /// Reads numbers of `N` bytes each from a file in the peers' `data`.
    ///
    /// # Errors
    /// Where it cannot be read or ends within a number.
    pub(crate) fn numbers<T, const N: usize>(
        &self,
        name: &str,
        number: fn([u8; N]) -> T,
    ) -> Result<Vec<T>, Failure> {
        let bytes = read(&self.folder.join("data").join(name))?;
        let (numbers, rest) = bytes.as_chunks::<N>();
        if !rest.is_empty() {
            return Err(format!("{name} ends within a number").into());
        }
        Ok(numbers.iter().map(|bytes| number(*bytes)).collect())
    }
}

/// What LAMMPS says of its runs.
pub(crate) struct Lammps {
    /// Of each run but the first, for which it kept the processor, per thread.
    pub(crate) seconds: Vec<f64>,
    /// Per particle after the first run.
    pub(crate) energy: f64,
}

impl Lammps {
    fn read(said: &str, threads: usize) -> Result<Self, Failure> {
        let mut lines = said
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>());
        let mut seconds = Vec::new();
        let mut energy = None;
        let mut last = Vec::new();
        for words in &mut lines {
            if let ["Loop", "time", "of", time, ..] = words[..] {
                energy = energy.or(last.get(1).and_then(|word: &&str| word.parse().ok()));
                seconds.push(time.parse::<f64>()?);
            }
            // Of all threads together.
            if let ([percent, "CPU", "use", ..], Some(last)) = (&words[..], seconds.last_mut()) {
                #[expect(clippy::cast_precision_loss, reason = "a few threads")]
                let whole = 100.0 * threads as f64;
                *last *= percent.trim_end_matches('%').parse::<f64>()? / whole;
            }
            last = words;
        }
        match energy {
            Some(energy) if seconds.len() > 1 => {
                seconds.remove(0);
                Ok(Self { seconds, energy })
            }
            _ => {
                let last = said.lines().last().unwrap_or("nothing");
                Err(format!("LAMMPS did not run, and said: {last}").into())
            }
        }
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
