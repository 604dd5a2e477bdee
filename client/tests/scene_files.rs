//! Scene files with the takes and meshes that they name.

#![expect(
    clippy::unwrap_used,
    reason = "these functions are tests or serve them alone"
)]

use std::{
    fs,
    path::{Path, PathBuf},
};

use sinew_client::{SceneFile, SceneFileError, load_mapping};
use sinew_proto::v1;

const TAKE: &str = "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n\
                    End Site\n{\nOFFSET 0 100 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.02\n50 0 0\n60 0 0\n";

const MESH: &str = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";

/// A folder of this test's own with a take, a mesh and the scene.
fn folder(test: &str, scene: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(folder.join("takes")).unwrap();
    fs::write(folder.join("takes/rise.bvh"), TAKE).unwrap();
    fs::write(folder.join("shell.off"), MESH).unwrap();
    fs::write(folder.join("scene.toml"), scene).unwrap();
    folder.join("scene.toml")
}

fn external(scene: &v1::Scene) -> &v1::ExternalPoints {
    match scene.motion.as_ref().unwrap().source.as_ref().unwrap() {
        v1::motion::Source::External(points) => points,
        v1::motion::Source::MassSpring(_)
        | v1::motion::Source::Particles(_)
        | v1::motion::Source::Elastic(_) => panic!("particles"),
    }
}

fn lattice(scene: &v1::Scene) -> &v1::Lattice {
    match scene.mesh.as_ref().unwrap().source.as_ref().unwrap() {
        v1::mesh::Source::Lattice(lattice) => lattice,
        v1::mesh::Source::Grid(_) | v1::mesh::Source::Asset(_) | v1::mesh::Source::File(_) => {
            panic!("no lattice")
        }
    }
}

#[test]
fn a_take_fills_what_the_scene_leaves_open() {
    let path = folder(
        "fill",
        "motion.external.file = \"takes/rise.bvh\"\nmesh.lattice = { spacing = 0.1, radius = 0.2 }\n",
    );
    let file = SceneFile::load(&path).unwrap();
    let points = external(&file.scene);
    assert_eq!(points.labels, ["hip", "hip_end"]);
    assert_eq!(points.rate_hz, 50.0);
    assert_eq!(points.file, "", "the server refuses a scene with a file");
    assert_eq!(
        points.rest_positions.as_ref().unwrap().unpack().unwrap(),
        [0.5, 0.0, 0.0, 0.5, 1.0, 0.0]
    );
    assert_eq!(points.absent, None);
    let [bone] = &lattice(&file.scene).bones[..] else {
        panic!("the skeleton has one bone")
    };
    assert_eq!((bone.from.as_str(), bone.to.as_str()), ("hip", "hip_end"));
    assert_eq!(file.scene.up(), v1::UpAxis::Y);
    assert_eq!(file.take.unwrap().frames(), 2);
}

#[test]
fn a_take_changes_nothing_that_the_scene_says() {
    let path = folder(
        "keep",
        "up = \"UP_AXIS_Z\"\n\
         [motion.external]\nfile = \"takes/rise.bvh\"\nrateHz = 25\nrestPositions.values = [0, 0, 0, 0, 1, 0]\n\
         [mesh.lattice]\nspacing = 0.1\nradius = 0.2\nbones = [{ from = \"hip_end\", to = \"hip\" }]\n",
    );
    let file = SceneFile::load(&path).unwrap();
    let points = external(&file.scene);
    assert_eq!(points.rate_hz, 25.0);
    assert_eq!(points.rest_positions.as_ref().unwrap().values[0], 0.0);
    assert_eq!(lattice(&file.scene).bones[0].from, "hip_end");
    assert_eq!(file.scene.up(), v1::UpAxis::Z);
}

#[test]
fn a_mesh_file_is_read_beside_the_scene() {
    let path = folder("mesh", "mesh.file = \"shell.off\"\n");
    let grid = SceneFile::load(&path).unwrap().grid.unwrap();
    assert_eq!((grid.positions.len(), grid.cells.len()), (4, 4));
}

#[test]
fn the_unit_of_a_file_scales_its_lengths_and_is_not_posted() {
    let text = "[motion.external]\nfile = \"takes/rise.bvh\"\nfile_unit_metres = 0.0254\n\
                [mesh]\nfile = \"shell.off\"\nfile_unit_metres = 0.1\n";
    let inches = SceneFile::load(&folder("units", text)).unwrap();
    let plain = text.replace("file_unit_metres = 0.0254\n", "");
    let centimetres = SceneFile::load(&folder("no-units", &plain)).unwrap();
    let rest = |file: &SceneFile| {
        let points = external(&file.scene);
        assert_eq!(points.file_unit_metres, 0.0);
        points.rest_positions.as_ref().unwrap().unpack().unwrap()
    };
    for (x, y) in rest(&inches).iter().zip(rest(&centimetres)) {
        assert!((x - 2.54 * y).abs() < 1e-12, "{x} and {y}");
    }
    let extent = inches
        .grid
        .unwrap()
        .positions
        .iter()
        .map(|p| p.max())
        .fold(0.0, f64::max);
    assert_eq!(extent, 0.1);
}

#[test]
fn errors_name_the_scene_the_field_and_the_file() {
    for (test, scene, field, named) in [
        (
            "no-take",
            "motion.external.file = \"none.c3d\"",
            "motion.external.file",
            "none.c3d",
        ),
        (
            "no-mesh",
            "mesh.file = \"none.vtk\"",
            "mesh.file",
            "none.vtk",
        ),
        (
            "no-format",
            "motion.external.file = \"a.txt\"",
            "motion.external.file",
            "a.txt",
        ),
        (
            "no-unit",
            "mesh.file = \"shell.off\"\nmesh.file_unit_metres = -1",
            "mesh.file_unit_metres",
            "-1",
        ),
    ] {
        let text = SceneFile::load(&folder(test, scene))
            .unwrap_err()
            .to_string();
        for part in ["scene.toml", field, named] {
            assert!(text.contains(part), "{text} does not name {part}");
        }
    }
    let text = SceneFile::load(&folder("bad-name", "titel = \"x\"\n"))
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("scene.toml, line 1: titel: unknown field"),
        "{text}"
    );
}

#[test]
fn a_scene_that_is_not_there_or_of_no_known_syntax_is_refused() {
    let missing = SceneFile::load("nowhere.json".as_ref());
    assert!(matches!(missing, Err(SceneFileError::Read { .. })));
    let path = folder("extension", "").with_file_name("shell.off");
    assert!(matches!(
        SceneFile::load(&path),
        Err(SceneFileError::Extension(_))
    ));
}

#[test]
fn the_scenes_shipped_with_sinew_load() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("demo");
    let walk = SceneFile::load(&folder.join("walk.json")).unwrap();
    assert_eq!(external(&walk.scene).labels.len(), 144);
    let bridge = SceneFile::load(&folder.join("bridge.toml")).unwrap();
    assert!(bridge.take.is_none() && bridge.warnings.is_empty());
    let scenes = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let ball = SceneFile::load(&scenes.join("ball.toml")).unwrap();
    let Some(v1::motion::Source::Particles(particles)) = ball.scene.motion.unwrap().source else {
        panic!("particles");
    };
    let surface = particles.surface.unwrap();
    assert!(surface.file.is_empty(), "resolved");
    assert_eq!(surface.triangles.unwrap().unpack().unwrap().len(), 3 * 320);
    assert_eq!(
        particles.positions.unwrap().unpack().unwrap().len(),
        3 * 162
    );
}

#[test]
fn a_file_may_hold_a_mapping_alone() {
    let scene = folder("mapping", "");
    let path = scene.with_file_name("soft.toml");
    fs::write(&path, "rule.shapeMatching = {}\nfilter.keep.k = 12\n").unwrap();
    let mapping = load_mapping(&path).unwrap();
    let json = serde_json::to_string(&mapping).unwrap();
    fs::write(scene.with_file_name("soft.json"), json).unwrap();
    assert_eq!(
        load_mapping(&scene.with_file_name("soft.json")).unwrap(),
        mapping
    );
    let keep = v1::filter::Kind::Keep(v1::KeepK { k: 12 });
    assert_eq!(mapping.filter.unwrap().kind, Some(keep));

    fs::write(&path, "[filter]\nkeep.n = 12\n").unwrap();
    let refusal = load_mapping(&path).unwrap_err().to_string();
    assert!(
        refusal.contains("soft.toml, line 2: keep.n: ")
            || refusal.contains("soft.toml, line 2: filter.keep.n: "),
        "{refusal}"
    );
}

#[test]
fn the_elastic_scenes_load_with_their_clouds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/elastic");
    for (name, points) in [
        ("two_bars_2d", 2_220),
        ("octopus", 8_267),
        ("pants_radial", 7_516),
    ] {
        let file = SceneFile::load(&folder.join(name).with_extension("toml")).unwrap();
        assert_eq!(cloud(&file.scene).len(), points, "{name}");
    }
}

#[test]
fn the_inside_of_a_surface_becomes_points_in_the_middles_of_cubes() {
    let scene =
        "[motion.elastic]\nfile = \"box.off\"\nfile_unit_metres = 0.1\nfile_sample_spacing = 0.1\n";
    let path = folder("sampled", scene);
    let skin = "OFF 8 6 0\n0 0 0\n4 0 0\n4 3 0\n0 3 0\n0 0 2\n4 0 2\n4 3 2\n0 3 2\n\
        4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
    fs::write(path.with_file_name("box.off"), skin).unwrap();
    let points = cloud(&SceneFile::load(&path).unwrap().scene);
    assert_eq!(points.len(), 24);
    for [x, y, z] in points {
        assert!((0.0..0.4).contains(&x) && (0.0..0.3).contains(&y) && (0.0..0.2).contains(&z));
    }
    let open = skin.replace("4 3 0 4 7\n", "").replace("8 6 0", "8 5 0");
    fs::write(path.with_file_name("box.off"), open).unwrap();
    let error = SceneFile::load(&path).unwrap_err().to_string();
    assert!(error.contains("motion.elastic.file"), "{error}");
}

/// The points of an elastic solid, m.
fn cloud(scene: &v1::Scene) -> Vec<[f64; 3]> {
    let Some(v1::motion::Source::Elastic(solid)) = &scene.motion.as_ref().unwrap().source else {
        panic!("no solid");
    };
    let Some(v1::elastic_solid::Cloud::Positions(positions)) = &solid.cloud else {
        panic!("no points");
    };
    positions.unpack().unwrap().as_chunks::<3>().0.to_vec()
}
