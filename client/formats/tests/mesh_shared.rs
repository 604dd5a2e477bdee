//! Every mesh of the shared data, where it is present: what its manifest says is what is read.

#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read its data has failed"
)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sinew_formats::mesh::{Format, read};
use sinew_mesh::{CellType, volume};

use CellType::{
    HexagonalPrism, Hexahedron, PentagonalPrism, Polyhedron, Pyramid, Tetrahedron, Wedge,
};

fn shared() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let present = folder.is_dir();
    if !present {
        eprintln!("skipped: {} is not present", folder.display());
    }
    present.then_some(folder)
}

/// The names of the files in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// File, format, vertices, cells of each type, cells with a negative volume.
type Volume = (
    &'static str,
    Format,
    usize,
    &'static [(CellType, usize)],
    usize,
);

/// As the manifest has them. Not in the manifest: the hexagonal prisms of PentaHexa are wound inside out.
const VOLUMES: [Volume; 29] = [
    (
        "hex/cinolib_rockerarm.mesh",
        Format::Medit,
        12751,
        &[(Hexahedron, 10600)],
        0,
    ),
    (
        "hex/mfem_beam-hex.mesh",
        Format::Mfem,
        36,
        &[(Hexahedron, 8)],
        0,
    ),
    (
        "hex/mfem_fichera.mesh",
        Format::Mfem,
        26,
        &[(Hexahedron, 7)],
        0,
    ),
    (
        "hex/sofa_nine_hexa.msh",
        Format::Gmsh,
        32,
        &[(Hexahedron, 9)],
        0,
    ),
    (
        "hex/vega_beam3_hex.veg",
        Format::Vega,
        208,
        &[(Hexahedron, 75)],
        0,
    ),
    (
        "hex/vega_simpleBridge_hex.veg",
        Format::Vega,
        3923,
        &[(Hexahedron, 1736)],
        0,
    ),
    (
        "mixed/mfem_beam-wedge.mesh",
        Format::Mfem,
        27,
        &[(Wedge, 8)],
        0,
    ),
    (
        "mixed/mfem_fichera-mixed.mesh",
        Format::Mfem,
        26,
        &[(Tetrahedron, 5), (Hexahedron, 3), (Wedge, 6)],
        0,
    ),
    (
        "mixed/mfem_tinyzoo-3d.mesh",
        Format::Mfem,
        12,
        &[(Tetrahedron, 1), (Hexahedron, 1), (Wedge, 1), (Pyramid, 1)],
        0,
    ),
    (
        "mixed/vtk_Cells_HexagonalPrism.vtu",
        Format::VtkXml,
        12,
        &[(HexagonalPrism, 1)],
        0,
    ),
    (
        "mixed/vtk_PentaHexa.vtk",
        Format::VtkLegacy,
        401,
        &[(PentagonalPrism, 60), (HexagonalPrism, 150)],
        150,
    ),
    (
        "poly/cinolib_eight_voronoi.hedra",
        Format::Hedra,
        18341,
        &[(Polyhedron, 2162)],
        0,
    ),
    (
        "poly/ovm_Cube_with_props.ovm",
        Format::Ovm,
        8,
        &[(Polyhedron, 1)],
        0,
    ),
    (
        "poly/ovm_Cylinder.ovm",
        Format::Ovm,
        399,
        &[(Polyhedron, 288)],
        0,
    ),
    (
        "tet/cinolib_sphere.mesh",
        Format::Medit,
        4505,
        &[(Tetrahedron, 24013)],
        0,
    ),
    // 29 inverted, and 7 of the 25 whose volume is 0 but for rounding.
    (
        "tet/codimipc_skirt_0.005mm_inverted.vtk",
        Format::VtkLegacy,
        16242,
        &[(Tetrahedron, 47683)],
        36,
    ),
    (
        "tet/codimipc_sphere12K.vtk",
        Format::VtkLegacy,
        18596,
        &[(Tetrahedron, 76336)],
        0,
    ),
    (
        "tet/codimipc_sphere1K.vtk",
        Format::VtkLegacy,
        1760,
        &[(Tetrahedron, 6851)],
        0,
    ),
    (
        "tet/mfem_escher.mesh",
        Format::Mfem,
        26,
        &[(Tetrahedron, 42)],
        0,
    ),
    (
        "tet/mfem_nested_cubes.msh",
        Format::Gmsh,
        138,
        &[(Tetrahedron, 520)],
        0,
    ),
    (
        "tet/polyfem_22_binary.msh",
        Format::Gmsh,
        8,
        &[(Tetrahedron, 5)],
        0,
    ),
    (
        "tet/sofa_6_tetra_bad.msh",
        Format::Gmsh,
        17,
        &[(Tetrahedron, 6)],
        1,
    ),
    (
        "tet/sofa_Ossicles.vtu",
        Format::VtkXml,
        1733,
        &[(Tetrahedron, 5058)],
        0,
    ),
    (
        "tet/sofa_liver.msh",
        Format::Gmsh,
        181,
        &[(Tetrahedron, 596)],
        0,
    ),
    (
        "tet/sofa_raptor_8418.vtu",
        Format::VtkXml,
        2996,
        &[(Tetrahedron, 8418)],
        0,
    ),
    (
        "tet/sofa_seaMonster.vtu",
        Format::VtkXml,
        1175,
        &[(Tetrahedron, 3376)],
        0,
    ),
    (
        "tet/vega_beam3_tet.veg",
        Format::Vega,
        208,
        &[(Tetrahedron, 450)],
        0,
    ),
    (
        "tet/vega_simpleBridge_tet.veg",
        Format::Vega,
        4000,
        &[(Tetrahedron, 12827)],
        0,
    ),
    (
        "tet/vega_turtle.veg",
        Format::Vega,
        347,
        &[(Tetrahedron, 1185)],
        0,
    ),
];

const REFUSED: [(&str, &str); 1] = [(
    "hex/mfem_toroid-hex.mesh",
    ", line 57: the mesh is curved (its nodes are a grid function), and Sinew's cells are straight; \
     save it with SetCurvature(1) and vertices",
)];

#[test]
fn every_shared_volume_is_read_as_the_manifest_has_it() {
    let Some(folder) = shared() else { return };
    for (name, format, vertices, cells, inverted) in VOLUMES {
        let loaded = read(&folder.join("volume").join(name)).unwrap();
        let grid = loaded.grid;
        let mut counts = BTreeMap::new();
        for cell in grid.cells.iter() {
            *counts.entry(cell.kind).or_insert(0) += 1;
        }
        let negative = (0..grid.cells.len()).filter(|&cell| volume(&grid, cell) < 0.0);
        assert_eq!(loaded.format, format, "{name}");
        assert_eq!(grid.positions.len(), vertices, "{name}");
        assert_eq!(counts, BTreeMap::from_iter(cells.iter().copied()), "{name}");
        assert_eq!(negative.count(), inverted, "{name}");
    }
}

#[test]
fn what_is_refused_of_the_shared_volumes_is_refused_with_its_reason() {
    let Some(folder) = shared() else { return };
    for (name, reason) in REFUSED {
        let path = folder.join("volume").join(name);
        let error = read(&path).unwrap_err().to_string();
        assert_eq!(error, format!("{}{reason}", path.display()));
    }
}

#[test]
fn no_shared_volume_is_forgotten() {
    let Some(folder) = shared() else { return };
    let mut found = Vec::new();
    for kind in names(&folder.join("volume")) {
        let files = names(&folder.join("volume").join(&kind));
        found.extend(files.into_iter().map(|file| format!("{kind}/{file}")));
    }
    let volumes = VOLUMES.iter().map(|volume| volume.0);
    let mut expected: Vec<&str> = volumes.chain(REFUSED.map(|refused| refused.0)).collect();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

/// File, vertices, faces, and triangles when every face is cut into such: the count of the manifest.
const SURFACES: [(&str, usize, usize, usize); 20] = [
    ("blub_fish.obj", 945, 1886, 1886),
    ("cinolib_bamboo_pen.obj", 1146, 1160, 2320),
    ("cinolib_two_spheres.obj", 1060, 2112, 2112),
    ("derived_pants_casualsuit04.obj", 886, 1712, 1712),
    ("gen_octopus.ply", 13945, 27886, 27886),
    ("koala_low_resolution.obj", 3560, 7116, 7116),
    ("makehuman_male_casualsuit04.obj", 1696, 1620, 3240),
    ("makehuman_male_generic.obj", 13652, 13650, 27300),
    ("makehuman_tightshelper.obj", 2674, 2650, 5300),
    ("partickle_octopus.obj", 6970, 13936, 13936),
    ("penguin.obj", 3362, 6720, 6720),
    ("spot_low_resolution.obj", 829, 1654, 1654),
    ("trimesh_featuretype.STL", 1722, 3476, 3476),
    ("trimesh_multibody_bad_winding.stl", 20, 32, 32),
    // The file itself says 288 vertices; the manifest counts 44 places.
    ("trimesh_not_convex_nonmanifold.obj", 288, 96, 96),
    ("trimesh_pins.glb", 1698, 3408, 3408),
    ("trimesh_soup.stl", 300, 100, 100),
    ("trimesh_testplate.glb", 130, 264, 264),
    // 13 polygons on 92 vertices; the manifest counts 35 places.
    ("trimesh_wallhole_degenerate.obj", 92, 13, 66),
    ("wingnut.obj", 3047, 6090, 6090),
];

#[test]
fn every_shared_surface_is_read_as_the_manifest_has_it() {
    let Some(folder) = shared() else { return };
    let folder = folder.join("surface");
    assert_eq!(names(&folder), SURFACES.map(|surface| surface.0));
    for (name, vertices, faces, triangles) in SURFACES {
        let grid = read(&folder.join(name)).unwrap().grid;
        let cut: usize = grid.cells.iter().map(|cell| cell.vertices.len() - 2).sum();
        let found = (grid.positions.len(), grid.cells.len(), cut);
        assert_eq!(found, (vertices, faces, triangles), "{name}");
    }
}
