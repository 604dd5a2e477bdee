//! Every volume file of the shared data becomes a map and comes back, or is refused with its reason.

use std::path::{Path, PathBuf};

use sinew_topology::{Map, MeshCells, NonManifold};

use crate::shapes::{Census, census, view};

fn shared() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/volume");
    root.is_dir().then_some(root)
}

/// Each cell as its faces, each face as its vertices from the smallest on, all in order.
fn cells_as_sets(mesh: &MeshCells<'_>) -> Vec<Vec<Vec<usize>>> {
    let (map, _) = Map::build(mesh, NonManifold::Split).expect("it was built before");
    let mut walk = sinew_topology::Walk::default();
    let cells = map.cells::<sinew_topology::Volume>();
    cells
        .map(|volume| {
            let darts: Vec<_> = map.orbit(volume, &mut walk).collect();
            let mut rings: Vec<_> = darts
                .into_iter()
                .filter_map(|dart| {
                    let ring: Vec<_> = map.ring(dart).map(|d| map.vertex(d).index()).collect();
                    (ring.iter().min() == ring.first()).then_some(ring)
                })
                .collect();
            rings.sort_unstable();
            rings
        })
        .collect()
}

/// Builds one mesh, checks all that must hold, and says what it is like. Returns whether it could be built.
fn check(name: &str, grid: &sinew_mesh::Grid) -> bool {
    if let Err(error) = Map::build(&view(grid), NonManifold::Refuse) {
        println!("{name}: refused: {error}");
    }
    let (map, report) = match Map::build(&view(grid), NonManifold::Split) {
        Ok(built) => built,
        Err(error) => {
            println!("{name}: refused even if split: {error}");
            return false;
        }
    };
    assert_eq!(map.violations(), [], "{name}");
    let out = map.export();
    let (again, clean) =
        Map::build(&out.view(), NonManifold::Split).expect("what a map gives can be built");
    assert!(clean.turned.is_empty(), "{name}");
    assert!(clean.split_vertices.is_empty(), "{name}");
    assert_eq!(again.violations(), [], "{name}");
    let sets = cells_as_sets(&out.view());
    assert_eq!(sets, cells_as_sets(&again.export().view()), "{name}");
    if report.turned.is_empty() && report.split_vertices.is_empty() {
        assert_eq!(sets, cells_as_sets(&view(grid)), "{name}");
        if !grid.cells.types.contains(&42) {
            assert_eq!(out.connectivity, grid.cells.connectivity, "{name}");
        }
    }
    let components = map.components();
    let first = &components[0];
    println!(
        "{name}: {} darts; {} components, the first with characteristic {} and boundary {}; {report:?}",
        map.dart_count(),
        components.len(),
        first.euler_characteristic(&map),
        first.boundary,
    );
    if name == "cinolib_eight_voronoi.hedra" {
        let Census { faces, volumes, .. } = census(&map);
        assert_eq!((faces, volumes, first.boundary), (12541, 2162, 1987));
    }
    true
}

#[test]
fn every_volume_file_builds_or_says_why_not_and_comes_back() {
    let Some(root) = shared() else {
        println!("skipped: no shared data beside the project");
        return;
    };
    let mut files: Vec<_> = (std::fs::read_dir(root).unwrap())
        .flat_map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap())
        .map(|file| file.unwrap().path())
        .collect();
    files.sort();
    let mut built = 0;
    for file in &files {
        let name = file.file_name().unwrap().to_string_lossy();
        match sinew_formats::mesh::read(file) {
            Ok(loaded) => built += usize::from(check(&name, &loaded.grid)),
            Err(error) => println!("{name}: not read: {error}"),
        }
    }
    assert!(built + 3 > files.len(), "only {built} of {}", files.len());
}
