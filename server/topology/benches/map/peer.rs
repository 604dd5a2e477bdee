//! The program to compare with: one that takes a folder and a variant as arguments, reads `points.f64` and `tets.i32`
//! there (rows of three and four, little-endian), and prints lines `row variant figure …`, named as in [`super::kernel`].

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sinew_mesh::Grid;

/// Numbers on the points only, as few as such a program can keep; and numbers on every kind of cell, as the map keeps.
const VARIANTS: [&str; 2] = ["lean", "full"];

pub(crate) struct Peer {
    program: PathBuf,
}

/// A mesh in files, which are removed when this is dropped.
pub(crate) struct Input {
    folder: PathBuf,
}

impl Peer {
    pub(crate) fn new(program: PathBuf) -> Self {
        Self { program }
    }

    pub(crate) fn write(&self, mesh: &Grid) -> Input {
        let folder = std::env::temp_dir().join(format!("sinew-map-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let points = mesh.positions.iter().flat_map(|p| p.iter().copied());
        let corners = mesh.cells.connectivity.iter();
        write(&folder.join("points.f64"), points.map(f64::to_le_bytes));
        write(&folder.join("tets.i32"), corners.map(|v| v.to_le_bytes()));
        Input { folder }
    }

    pub(crate) fn measure(&self, input: &Input, add: &mut dyn FnMut(&str, &'static str, f64)) {
        for variant in VARIANTS {
            let mut command = Command::new(&self.program);
            let output = command.arg(&input.folder).arg(variant).output().unwrap();
            assert!(output.status.success(), "the peer failed: {output:?}");
            for line in String::from_utf8(output.stdout).unwrap().lines() {
                let words: Vec<_> = line.split_whitespace().collect();
                assert_eq!(words[1], variant, "in {line:?}");
                add(words[0], variant, words[2].parse().unwrap());
            }
        }
    }
}

impl Drop for Input {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.folder).ok();
    }
}

fn write<const N: usize>(path: &Path, numbers: impl Iterator<Item = [u8; N]>) {
    fs::write(path, numbers.flatten().collect::<Vec<_>>()).unwrap();
}
