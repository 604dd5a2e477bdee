//! Mesh files of every common format, read into grids.
//!
//! ```
//! let square = b"OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
//! let loaded = sinew_formats::mesh::parse("square.off", square)?;
//! assert_eq!(loaded.grid.positions.len(), 4);
//! assert_eq!(loaded.format.to_string(), "OFF");
//! # Ok::<(), sinew_formats::mesh::MeshFileError>(())
//! ```

mod assembly;
pub(crate) mod cursor;
pub(crate) mod error;
mod format;
mod glb;
mod gmsh;
mod gmsh_elements;
mod hedra;
mod labels;
mod medit;
mod mfem;
mod obj;
mod off;
mod ovm;
pub(crate) mod ply;
pub(crate) mod scalar;
mod shell;
mod stl;
mod tetgen;
mod vega;
mod vtk_cells;
mod vtk_legacy;
mod vtk_xml;
mod vtk_xml_data;
mod weld;

use std::path::Path;

use sinew_mesh::Grid;

use assembly::Assembly;
use error::{Flaw, Parsed};
pub use error::{MeshFileError, Place};
pub use format::Format;

/// A mesh file, read.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The mesh, in the file's own unit of length; [`Grid::check`] holds. Cells of the highest dimension only.
    pub grid: Grid,
    /// What the file was.
    pub format: Format,
    /// What was left out or looks odd, in sentences for the user.
    pub warnings: Vec<String>,
}

/// Reads a mesh file. TetGen's other file is looked for beside the one given.
///
/// # Errors
/// [`MeshFileError`] with the file, the place and the reason.
pub fn read(path: &Path) -> Result<Loaded, MeshFileError> {
    let name = path.display().to_string();
    let bytes = load(path)?;
    match declared(&name, &bytes) {
        Some(Format::TetGen) => {
            let nodes_path = path.with_extension("node");
            let nodes_name = nodes_path.display().to_string();
            let elements_path = path.with_extension("ele");
            let elements_name = elements_path.display().to_string();
            let nodes =
                tetgen::parse_nodes(&load(&nodes_path)?).map_err(|flaw| flaw.of(&nodes_name))?;
            let elements = load(&elements_path)?;
            tetgen::parse_elements(nodes, &elements)
                .and_then(|assembly| finish(assembly, Format::TetGen))
                .map_err(|flaw| flaw.of(&elements_name))
        }
        _ => parse(&name, &bytes),
    }
}

/// Reads a mesh from bytes. What the content declares itself to be counts more than the extension of `name`.
///
/// # Errors
/// [`MeshFileError::Content`] with `name`, the place and the reason. TetGen's pair of files needs [`read`].
pub fn parse(name: &str, bytes: &[u8]) -> Result<Loaded, MeshFileError> {
    let loaded = match declared(name, bytes) {
        Some(format) => parse_as(format, bytes).and_then(|assembly| finish(assembly, format)),
        None => Err(Flaw::whole(format!(
            "neither the content nor the extension is that of a mesh; known are {}",
            known_extensions()
        ))),
    };
    let mut loaded = loaded.map_err(|flaw| flaw.of(name))?;
    let format = loaded.format;
    match Format::of_extension(extension(name)) {
        Some(other) if !format.extensions().contains(&other.extensions()[0]) => loaded
            .warnings
            .push(format!("the name is that of {other}, the content {format}")),
        _ => {}
    }
    Ok(loaded)
}

fn load(path: &Path) -> Result<Vec<u8>, MeshFileError> {
    std::fs::read(path).map_err(|source| MeshFileError::Io {
        file: path.to_owned(),
        source,
    })
}

fn extension(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(_, extension)| extension)
}

fn declared(name: &str, bytes: &[u8]) -> Option<Format> {
    Format::of_content(bytes).or_else(|| Format::of_extension(extension(name)))
}

fn known_extensions() -> String {
    let mut known: Vec<_> = Vec::new();
    for extension in Format::ALL.iter().flat_map(|format| format.extensions()) {
        let dotted = format!(".{extension}");
        // Two formats share one.
        if !known.contains(&dotted) {
            known.push(dotted);
        }
    }
    known.join(" ")
}

fn parse_as(format: Format, bytes: &[u8]) -> Parsed<Assembly> {
    match format {
        Format::VtkLegacy => vtk_legacy::parse(bytes),
        Format::VtkXml => vtk_xml::parse(bytes),
        Format::Gmsh => gmsh::parse(bytes),
        Format::Medit => medit::parse(bytes),
        Format::MeditBinary => medit::parse_binary(bytes),
        Format::Mfem => mfem::parse(bytes),
        Format::Vega => vega::parse(bytes),
        Format::TetGen => Err(Flaw::whole(
            "TetGen's vertices and tetrahedra are two files; both are read from a folder only",
        )),
        Format::Hedra => hedra::parse(bytes),
        Format::Ovm => ovm::parse(bytes),
        Format::Obj => obj::parse(bytes),
        Format::Ply => ply::parse(bytes),
        Format::Stl => stl::parse(bytes),
        Format::Off => off::parse(bytes),
        Format::Glb => glb::parse(bytes),
    }
}

fn finish(assembly: Assembly, format: Format) -> Parsed<Loaded> {
    let (grid, warnings) = assembly.finish()?;
    // What every reader promises; a file that gets past one is still no grid.
    grid.check()
        .map_err(|error| Flaw::whole(error.to_string()))?;
    Ok(Loaded {
        grid,
        format,
        warnings,
    })
}
