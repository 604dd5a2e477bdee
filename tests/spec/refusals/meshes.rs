//! Meshes: grids, assets and lattices.

use sinew_mesh::{Grid, shapes};
use sinew_proto::v1::{Bone, CellShape, Fill, Indices, Lattice, Scene, mesh};
use sinew_tests::{live, scenes as posted};
use tonic::Code;

use super::{Witness, each};

/// Puts a changed box of 2 × 2 × 2 cubes in place of the scene's mesh.
fn change_mesh(scene: &mut Scene, change: fn(&mut Grid)) {
    let mut grid = shapes::hexahedra(2, 2, 2);
    change(&mut grid);
    *posted::mesh(scene) = posted::grid(&grid);
}

#[test]
fn meshes_that_are_none() {
    const GRID: &str = "scene.mesh.grid";
    each(
        posted::small,
        &[
            (
                |s| change_mesh(s, |g| g.positions[13].y = f64::NAN),
                "VALUE_NOT_FINITE",
                GRID,
            ),
            (
                |s| change_mesh(s, |g| g.positions[0].x = f64::NEG_INFINITY),
                "VALUE_NOT_FINITE",
                GRID,
            ),
            // Finite, but nothing that could travel as binary32.
            (
                |s| change_mesh(s, |g| g.positions[0].x = -1e40),
                "VALUE_OUT_OF_RANGE",
                "scene.mesh.grid.positions[0]",
            ),
            (
                |s| change_mesh(s, |g| g.cells.connectivity[3] = 27),
                "INDEX_OUT_OF_RANGE",
                GRID,
            ),
            (
                |s| change_mesh(s, |g| g.cells.connectivity[0] = u32::MAX),
                "INDEX_OUT_OF_RANGE",
                GRID,
            ),
            (
                |s| change_mesh(s, |g| g.cells.types[1] = 99),
                "MESH_MALFORMED",
                GRID,
            ),
            (
                |s| change_mesh(s, |g| g.cells.offsets[4] = u32::MAX),
                "MESH_MALFORMED",
                GRID,
            ),
            (
                |s| change_mesh(s, |g| g.cells.offsets.clear()),
                "MESH_MALFORMED",
                GRID,
            ),
            (
                |s| posted::mesh(s).positions = Some(posted::reals(&[0.0; 4])),
                "LENGTH_MISMATCH",
                "scene.mesh.grid.positions",
            ),
        ],
    );
}

#[test]
fn cells_inverted_or_without_volume() {
    const GRID: &str = "scene.mesh.grid";
    each(
        posted::small,
        &[
            // One cube with its bottom for its top.
            (
                |s| change_mesh(s, |g| g.cells.connectivity[8..16].rotate_left(4)),
                "CELL_INVERTED",
                GRID,
            ),
            // The mirror image of everything.
            (
                |s| change_mesh(s, |g| g.positions.iter_mut().for_each(|p| p.x = -p.x)),
                "CELL_INVERTED",
                GRID,
            ),
            // The middle layer of vertices on the lowest one.
            (
                |s| change_mesh(s, |g| g.positions[9..18].iter_mut().for_each(|p| p.z = 0.0)),
                "CELL_ZERO_VOLUME",
                GRID,
            ),
            // All vertices in a plane.
            (
                |s| change_mesh(s, |g| g.positions.iter_mut().for_each(|p| p.z = 0.0)),
                "CELL_ZERO_VOLUME",
                GRID,
            ),
        ],
    );
}

#[test]
fn an_asset_that_was_never_uploaded() {
    live(async {
        let witness = Witness::start().await;
        for name in ["assets/0", "", "sessions/witness"] {
            let mut scene = posted::small();
            scene.mesh = posted::meshed(mesh::Source::Asset(name.to_owned()));
            witness
                .refuses(posted::creation(scene), Code::NotFound, "ASSET_UNKNOWN")
                .await;
        }
    });
}

#[test]
fn a_mesh_file_that_the_client_did_not_resolve() {
    each(
        posted::small,
        &[(
            |s| {
                s.mesh = posted::meshed(mesh::Source::File("/etc/passwd".to_owned()));
            },
            "FILE_NOT_RESOLVED",
            "scene.mesh.file",
        )],
    );
}

/// An external scene with a lattice around one bone.
fn boned() -> Scene {
    Scene {
        mesh: posted::meshed(mesh::Source::Lattice(Lattice {
            shape: CellShape::Tetrahedron.into(),
            spacing: 0.1,
            radius: 0.2,
            bones: vec![Bone {
                from: "p0".to_owned(),
                to: "p1".to_owned(),
                radius: 0.0,
            }],
        })),
        ..posted::small()
    }
}

fn bone(scene: &mut Scene) -> &mut Bone {
    &mut posted::lattice(scene).bones[0]
}

fn skinned() -> Scene {
    posted::filled(8, 2, posted::Rule::Mean)
}

fn fill(scene: &mut Scene) -> &mut Option<Fill> {
    &mut scene.mesh.get_or_insert_default().fill
}

fn space(scene: &mut Scene, spacing: f64) {
    fill(scene).get_or_insert_default().spacing = spacing;
}

#[test]
fn surfaces_that_cannot_be_filled() {
    const FILL: &str = "scene.mesh.fill";
    each(posted::small, &[(|s| space(s, 0.5), "FILL_REFUSED", FILL)]);
    each(boned, &[(|s| space(s, 0.5), "CONFLICT", FILL)]);
    each(
        skinned,
        &[
            (|s| space(s, 0.0), "FILL_REFUSED", FILL),
            (|s| space(s, f64::NAN), "FILL_REFUSED", FILL),
            (|s| space(s, 1e-4), "FILL_REFUSED", FILL),
            (|s| space(s, 1e-9), "FILL_REFUSED", FILL),
            (|s| space(s, 100.0), "FILL_REFUSED", FILL),
            (
                |s| fill(s).get_or_insert_default().shape = 7,
                "ENUM_UNKNOWN",
                "scene.mesh.fill.shape",
            ),
            (
                |s| {
                    let grid = posted::mesh(s);
                    grid.connectivity = Some(Indices::pack(&[0, 1, 2]));
                    grid.offsets = Some(Indices::pack(&[0, 3]));
                    grid.cell_types.truncate(1);
                },
                "FILL_REFUSED",
                FILL,
            ),
        ],
    );
}

#[test]
fn lattices_that_cannot_be_made() {
    const LATTICE: &str = "scene.mesh.lattice";
    each(
        boned,
        &[
            (
                |s| posted::lattice(s).spacing = 0.0,
                "LATTICE_REFUSED",
                LATTICE,
            ),
            (
                |s| posted::lattice(s).spacing = -0.1,
                "LATTICE_REFUSED",
                LATTICE,
            ),
            (
                |s| posted::lattice(s).spacing = f64::NAN,
                "LATTICE_REFUSED",
                LATTICE,
            ),
            (
                |s| posted::lattice(s).spacing = 1e-9,
                "LATTICE_REFUSED",
                LATTICE,
            ),
            (
                |s| {
                    posted::lattice(s).bones.clear();
                    posted::lattice(s).radius = 0.0;
                },
                "LATTICE_REFUSED",
                LATTICE,
            ),
            (
                |s| bone(s).from = "p8".to_owned(),
                "LABEL_UNKNOWN",
                "scene.mesh.lattice.bones[0].from",
            ),
            (
                |s| bone(s).to.clear(),
                "LABEL_UNKNOWN",
                "scene.mesh.lattice.bones[0].to",
            ),
            (
                |s| posted::points(s).absent = Some(Indices::pack(&[1])),
                "POINT_ABSENT",
                "scene.mesh.lattice.bones[0].to",
            ),
            (
                |s| bone(s).radius = -1.0,
                "VALUE_OUT_OF_RANGE",
                "scene.mesh.lattice.bones[0].radius",
            ),
            (
                |s| bone(s).radius = f64::NAN,
                "VALUE_OUT_OF_RANGE",
                "scene.mesh.lattice.bones[0].radius",
            ),
        ],
    );
}
