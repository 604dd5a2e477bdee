//! `sinew inspect`: what a file holds.

mod cloud;
mod mesh;
mod take;

use std::path::PathBuf;

use clap::Args;

use crate::Failure;

/// Shows what a mesh, a take or a cloud of points holds and what is wrong with it, with the ids of cells, vertices and
/// points.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew inspect walk.c3d                       points, rate, gaps
  sinew inspect walk.c3d --gaps                when each point is seen, as a picture
  sinew inspect scan.ply                       points without faces: spacing, pieces, outliers, twins
  sinew inspect scan.csv --cloud               the same of a table, which else is a take
  sinew inspect liver.msh                      cells, volume, inverted and degenerate cells
  sinew inspect liver.msh --json               the same for programs
  sinew inspect liver.msh --repair liver.vtu   writes it repaired: all cells the right way out, none degenerate")]
pub(crate) struct Arguments {
    /// A mesh (VTK, VTU, Gmsh, Medit, OBJ, PLY, STL, OFF and others) or a take (C3D, TRC, BVH,
    /// MOT, STO, the CSV and TSV exports of Motive, Nexus and Qualisys, plain tables, LAMMPS dumps, XYZ, GSD).
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Take the file for a cloud of points: PLY, CSV, XYZ or BGEO.
    #[arg(long, conflicts_with_all = ["gaps", "repair"])]
    cloud: bool,
    /// Print JSON, with all ids.
    #[arg(long)]
    json: bool,
    /// Show when each point of a take is seen, as a picture.
    #[arg(long, conflicts_with = "json")]
    gaps: bool,
    /// Write the mesh, repaired, to a .vtk or .vtu file.
    #[arg(long, value_name = "OUT")]
    repair: Option<PathBuf>,
    /// Metres per unit of length in a take or a cloud. Without it: what the file says; centimetres for BVH, which says
    /// nothing.
    #[arg(long, value_name = "METRES")]
    unit_scale: Option<f64>,
}

pub(crate) fn inspect(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.cloud || sinew_formats::cloud::is_one(&arguments.file)? {
        cloud::inspect(arguments)
    } else if sinew_formats::take::Format::of(&arguments.file).is_some() {
        if arguments.repair.is_some() {
            return Err("--repair is for meshes; this is a take".into());
        }
        take::inspect(arguments)
    } else if arguments.gaps {
        Err("--gaps is for takes; this is none by its name".into())
    } else {
        mesh::inspect(arguments)
    }
}

/// Ids, as many as fit a line.
fn some<T: std::fmt::Display>(ids: &[T]) -> String {
    const SHOWN: usize = 8;
    let mut text: Vec<String> = ids.iter().take(SHOWN).map(ToString::to_string).collect();
    if ids.len() > SHOWN {
        text.push(format!(
            "… ({} in all; --json shows them)",
            crate::table::count(ids.len() as u64)
        ));
    }
    text.join(" ")
}
