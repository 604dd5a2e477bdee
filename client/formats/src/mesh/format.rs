//! Which formats there are, and how to tell them apart.

use std::fmt;

use super::stl;
use super::{off, scalar::Endian};

/// A kind of mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Format {
    /// Legacy VTK: text or binary, unstructured grid or polygonal data.
    VtkLegacy,
    /// VTK's XML: text, inline or appended, raw, base64 or zlib; unstructured grid or polygonal data.
    VtkXml,
    /// Gmsh 1, 2 and 4.1, text or binary.
    Gmsh,
    /// Medit, text.
    Medit,
    /// Medit, binary.
    MeditBinary,
    /// MFEM v1.0, straight edges.
    Mfem,
    /// Vega.
    Vega,
    /// TetGen: a file of vertices and a file of tetrahedra.
    TetGen,
    /// HEDRA: polyhedra.
    Hedra,
    /// OpenVolumeMesh, text: polyhedra.
    Ovm,
    /// Wavefront.
    Obj,
    /// Stanford polygons, text or binary.
    Ply,
    /// Stereolithography, text or binary.
    Stl,
    /// Geomview, text.
    Off,
    /// glTF, binary: triangles.
    Glb,
}

impl Format {
    /// Every format, volumes before surfaces.
    pub const ALL: [Self; 15] = [
        Self::VtkLegacy,
        Self::VtkXml,
        Self::Gmsh,
        Self::Medit,
        Self::MeditBinary,
        Self::Mfem,
        Self::Vega,
        Self::TetGen,
        Self::Hedra,
        Self::Ovm,
        Self::Obj,
        Self::Ply,
        Self::Stl,
        Self::Off,
        Self::Glb,
    ];

    /// The usual extensions, lower case, without the dot. `mesh` is shared by Medit and MFEM.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::VtkLegacy => &["vtk"],
            Self::VtkXml => &["vtu", "vtp"],
            Self::Gmsh => &["msh"],
            Self::Medit | Self::Mfem => &["mesh"],
            Self::MeditBinary => &["meshb"],
            Self::Vega => &["veg"],
            Self::TetGen => &["ele", "node"],
            Self::Hedra => &["hedra"],
            Self::Ovm => &["ovm"],
            Self::Obj => &["obj"],
            Self::Ply => &["ply"],
            Self::Stl => &["stl"],
            Self::Off => &["off"],
            Self::Glb => &["glb"],
        }
    }

    /// The format that an extension stands for.
    pub(super) fn of_extension(extension: &str) -> Option<Self> {
        let extension = extension.to_ascii_lowercase();
        Self::ALL
            .into_iter()
            .find(|format| format.extensions().contains(&extension.as_str()))
    }

    /// The format that the content itself declares.
    pub(super) fn of_content(bytes: &[u8]) -> Option<Self> {
        let start = bytes.trim_ascii_start();
        let first = first_word(bytes);
        Some(match first {
            _ if start.starts_with(b"# vtk DataFile") => Self::VtkLegacy,
            _ if start.starts_with(b"<?xml") || start.starts_with(b"<VTKFile") => Self::VtkXml,
            b"$MeshFormat" | b"$NOD" | b"$Comments" => Self::Gmsh,
            b"MeshVersionFormatted" => Self::Medit,
            b"MFEM" => Self::Mfem,
            b"ply" => Self::Ply,
            b"OVM" => Self::Ovm,
            _ if off::HEADERS.contains(&first) => Self::Off,
            _ if first.eq_ignore_ascii_case(b"*VERTICES") => Self::Vega,
            _ if bytes.starts_with(b"glTF") => Self::Glb,
            _ if medit_byte_order(bytes).is_some() => Self::MeditBinary,
            _ if stl::has_binary_length(bytes) => Self::Stl,
            b"solid" => Self::Stl,
            _ => return None,
        })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::VtkLegacy => "legacy VTK",
            Self::VtkXml => "VTK XML",
            Self::Gmsh => "Gmsh",
            Self::Medit => "Medit",
            Self::MeditBinary => "binary Medit",
            Self::Mfem => "MFEM",
            Self::Vega => "Vega",
            Self::TetGen => "TetGen",
            Self::Hedra => "HEDRA",
            Self::Ovm => "OpenVolumeMesh",
            Self::Obj => "Wavefront OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Glb => "binary glTF",
        })
    }
}

/// The byte order of a binary Medit file, which starts with the number 1 and a version from 1 to 4.
pub(super) fn medit_byte_order(bytes: &[u8]) -> Option<Endian> {
    match bytes {
        [1, 0, 0, 0, 1..=4, 0, 0, 0, ..] => Some(Endian::Little),
        [0, 0, 0, 1, 0, 0, 0, 1..=4, ..] => Some(Endian::Big),
        _ => None,
    }
}

/// The first word outside comments.
fn first_word(bytes: &[u8]) -> &[u8] {
    let mut rest = bytes.trim_ascii_start();
    while rest.first() == Some(&b'#') {
        let end = rest.iter().position(|&byte| byte == b'\n');
        rest = end.map_or(&[][..], |end| rest[end..].trim_ascii_start());
    }
    let end = rest.iter().position(u8::is_ascii_whitespace);
    &rest[..end.unwrap_or(rest.len())]
}
