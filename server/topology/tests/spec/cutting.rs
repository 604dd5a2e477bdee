//! Cuts through edges and through vertices, for any polyhedron.

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_mesh::{Grid, shapes};
use sinew_topology::{Cell, Changes, Cut, Dart, EditError, Event, Map, Place, Vertex, Volume};

use crate::shapes::{Census, Positions, census, in_the_midst, map_of, mesh, volumes};

/// Below, on or above the plane `normal`·x = `height`, near which everything counts as on it.
fn place(position: Vector3<f64>, normal: Vector3<f64>, height: f64) -> Place {
    match position.dot(&normal) - height {
        off if off.abs() < 1e-9 => Place::On,
        off if off < 0.0 => Place::Below,
        _ => Place::Above,
    }
}

/// Cuts along a plane and puts new vertices where their edges meet it.
fn cut(
    map: &mut Map,
    positions: &mut Positions,
    targets: &[Cell<Volume>],
    normal: Vector3<f64>,
    height: f64,
) -> Result<(Cut, Changes), EditError> {
    let of = |vertex: Cell<Vertex>| place(positions[vertex], normal, height);
    let (cut, changes) = map.edit(|edit| edit.cut(targets, of))?;
    positions.follow(&changes, &in_the_midst());
    for event in &changes.events {
        if let Event::Born {
            cell: sinew_topology::AnyCell::Vertex(vertex),
            among,
            ..
        } = event
        {
            let ends = &changes.among[among.start as usize..among.end as usize];
            let [a, b] = [0, 1].map(|end| positions[ends[end]]);
            let [from, to] = [a, b].map(|end| end.dot(&normal) - height);
            positions[*vertex] = a + (b - a) * (from / (from - to));
        }
    }
    Ok((cut, changes))
}

fn start(grid: &Grid) -> (Map, Positions) {
    (map_of(grid), Positions::from_values(grid.positions.clone()))
}

fn one_tetrahedron() -> Grid {
    let mut grid = mesh(4, sinew_mesh::CellType::Tetrahedron, &[&[0, 1, 2, 3]]);
    grid.positions[1].x = 1.0;
    grid.positions[2].y = 1.0;
    grid.positions[3].z = 1.0;
    grid
}

#[test]
fn a_tetrahedron_is_cut_through_edges_only_and_through_vertices() {
    // Vertices are named by place: through three edges, through four, one vertex and two edges, two vertices and an edge.
    use Place::{Above, Below, On};
    let cases: [([Place; 4], [usize; 4]); 4] = [
        ([Below, Above, Above, Above], [7, 12, 8, 2]),
        ([Below, Below, Above, Above], [8, 14, 9, 2]),
        ([Below, On, Above, Above], [6, 11, 8, 2]),
        ([On, On, Below, Above], [5, 9, 7, 2]),
    ];
    for (places, counts) in cases {
        let mut map = map_of(&one_tetrahedron());
        let volume = map.cells().next().unwrap();
        let (cut, _) = map
            .edit(|edit| edit.cut(&[volume], |v| places[v.index()]))
            .unwrap();
        assert_eq!(map.violations(), []);
        assert_eq!(
            (census(&map), cut.faces.len()),
            (Census::from(counts), 1),
            "{places:?}"
        );
        // Opened, the parts have nothing in common.
        map.edit(|edit| edit.unsew3(edit.map().dart(cut.faces[0])))
            .unwrap();
        assert_eq!(map.components().len(), 2);
    }
}

#[test]
fn a_plane_that_only_touches_cuts_nothing() {
    use Place::{Above, On};
    let mut map = map_of(&one_tetrahedron());
    let before = map.digest();
    let volume = map.cells().next().unwrap();
    for places in [
        [On, Above, Above, Above],
        [On, On, Above, Above],
        [On, On, On, Above],
    ] {
        let (cut, _) = map
            .edit(|edit| edit.cut(&[volume], |v| places[v.index()]))
            .unwrap();
        assert_eq!((cut, map.digest()), (Cut::default(), before));
    }
}

#[test]
fn a_local_cut_leaves_its_neighbours_whole() {
    let (mut map, mut positions) = start(&shapes::hexahedra(3, 3, 3));
    let centre = map.cells::<Volume>().nth(13).unwrap();
    let before: f64 = volumes(&map, &positions).iter().sum();
    cut(
        &mut map,
        &mut positions,
        &[centre],
        Vector3::new(1.0, 0.3, 0.2),
        0.76,
    )
    .unwrap();
    assert_eq!(map.count::<Volume>(), 28);
    let after: f64 = volumes(&map, &positions).iter().sum();
    assert!((after - before).abs() <= 1e-12 * before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn cutting_again_and_again_conserves_the_volume(
        planes in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, 0.1..1.0f64, 0.2..0.8f64), 1..5),
        shape in 0..3usize,
    ) {
        let grid = match shape {
            0 => shapes::tetrahedra(2, 2, 2),
            1 => shapes::hexahedra(2, 2, 2),
            _ => one_tetrahedron(),
        };
        let (mut map, mut positions) = start(&grid);
        let before: f64 = volumes(&map, &positions).iter().sum();
        for (x, y, z, height) in planes {
            let normal = Vector3::new(x, y, z).normalize();
            let height = normal.dot(&Vector3::repeat(height));
            let targets: Vec<_> = map.cells::<Volume>().collect();
            let cells = targets.len();
            let (cut, _) = cut(&mut map, &mut positions, &targets, normal, height).unwrap();
            prop_assert_eq!(map.count::<Volume>(), cells + cut.volumes.len());
            prop_assert_eq!(cut.volumes.len(), cut.faces.len());
            prop_assert_eq!(map.violations(), []);
            let now = volumes(&map, &positions);
            prop_assert!(now.iter().all(|&volume| volume > -1e-15));
            let total: f64 = now.iter().sum();
            prop_assert!((total - before).abs() <= 1e-12 * before, "{} became {}", before, total);
            // No edge is left that goes from one side to the other.
            for edge in map.cells::<sinew_topology::Edge>() {
                let ends = map.ends(edge).map(|end| positions[end].dot(&normal) - height);
                prop_assert!(ends[0] * ends[1] > -1e-12);
            }
        }
    }
}

#[test]
fn an_edge_that_a_face_passes_there_and_back_is_split_once() {
    // Two faces of a cube folded together: the faces beside them pass an edge of both in one direction, then the other.
    let mut map = map_of(&shapes::hexahedra(1, 1, 1));
    let dart = map.darts().next().unwrap();
    let across = map.beta2(dart).unwrap();
    map.edit(|edit| edit.sew3(dart, across)).unwrap();
    let is_folded = |dart: &Dart| map.edge(*dart) == map.edge(map.beta1(*dart));
    let folded: Vec<_> = map.darts().filter(is_folded).collect();
    assert_eq!(folded.len(), 2);
    for dart in folded {
        let length = map.ring(dart).count();
        let edge = map.edge(dart);
        map.edit(|edit| edit.split_edge(edge)).unwrap();
        assert_eq!(map.violations(), []);
        assert_eq!(map.ring(dart).count(), length + 2);
    }
}
