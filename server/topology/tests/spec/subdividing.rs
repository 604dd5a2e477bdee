//! Regular subdivisions, and their inverse.

use sinew_mesh::shapes;
use sinew_topology::{Edge, EditError, Face, Vertex, Volume};

use crate::shapes::{Positions, census, in_the_midst, map_of, torus, two_tetrahedra, volumes};

#[test]
fn a_tetrahedron_becomes_four_around_its_centre() {
    let grid = shapes::tetrahedra(1, 1, 1);
    let mut map = map_of(&grid);
    let mut positions = Positions::from_values(grid.positions.clone());
    for volume in map.cells().collect::<Vec<_>>() {
        let (_, changes) = map.edit(|edit| edit.star(volume)).unwrap();
        positions.follow(&changes, &in_the_midst());
    }
    assert_eq!(map.violations(), []);
    // To each of the six: a vertex, 4 edges, 6 faces and 3 volumes more.
    assert_eq!(census(&map), [8 + 6, 19 + 24, 18 + 36, 6 + 18].into());
    assert!(map.export().types.iter().all(|&kind| kind == 10));
    for volume in volumes(&map, &positions) {
        assert!((volume - 1.0 / 24.0).abs() < 1e-15);
    }
}

#[test]
fn bisecting_an_edge_halves_all_tetrahedra_around_it() {
    let grid = shapes::tetrahedra(2, 2, 2);
    for edge in 0..map_of(&grid).count::<Edge>() {
        let mut map = map_of(&grid);
        let mut positions = Positions::from_values(grid.positions.clone());
        let edge = map.cell_at::<Edge>(edge).unwrap();
        let around = map
            .incident::<Edge, Volume>(edge, &mut sinew_topology::Walk::default())
            .count();
        let (_, changes) = map.edit(|edit| edit.bisect(edge)).unwrap();
        positions.follow(&changes, &in_the_midst());
        assert_eq!(map.count::<Volume>(), 48 + around);
        assert!(map.export().types.iter().all(|&kind| kind == 10));
        let halves = volumes(&map, &positions).into_iter();
        let whole = 1.0 / 48.0;
        assert_eq!(
            halves
                .filter(|half| (half - whole / 2.0).abs() < 1e-15)
                .count(),
            2 * around
        );
    }
}

#[test]
fn hexahedra_become_eight_each_with_all_that_they_share_split_once() {
    for grid in [
        shapes::hexahedra(1, 1, 1),
        shapes::hexahedra(2, 3, 2),
        torus(5),
    ] {
        let mut map = map_of(&grid);
        let all: Vec<_> = map.cells::<Volume>().collect();
        let [v, e, f, c] = [census(&map)].map(|c| [c.vertices, c.edges, c.faces, c.volumes])[0];
        map.edit(|edit| edit.split_hexahedra(&all)).unwrap();
        assert_eq!(map.violations(), []);
        let expected = [v + e + f + c, 2 * e + 4 * f + 6 * c, 4 * f + 12 * c, 8 * c];
        assert_eq!(census(&map), expected.into());
        assert!(map.export().types.iter().all(|&kind| kind == 12));
    }
}

#[test]
fn the_eighths_of_a_cube_are_equal() {
    let grid = shapes::hexahedra(1, 1, 1);
    let mut map = map_of(&grid);
    let mut positions = Positions::from_values(grid.positions.clone());
    for _ in 0..2 {
        let all: Vec<_> = map.cells::<Volume>().collect();
        let (_, changes) = map.edit(|edit| edit.split_hexahedra(&all)).unwrap();
        positions.follow(&changes, &in_the_midst());
    }
    assert!(
        volumes(&map, &positions)
            .iter()
            .all(|volume| (volume - 1.0 / 64.0).abs() < 1e-15)
    );
}

#[test]
fn a_hexahedron_beside_one_that_was_split_is_refused() {
    let mut map = map_of(&shapes::hexahedra(2, 1, 1));
    let [left, right] = [0, 1].map(|at| map.cell_at::<Volume>(at).unwrap());
    map.edit(|edit| edit.split_hexahedra(&[left])).unwrap();
    let before = map.digest();
    let error = map.edit(|edit| edit.split_hexahedra(&[right])).unwrap_err();
    assert!(matches!(error, EditError::WrongShape { .. }));
    assert_eq!((map.digest(), map.violations()), (before, vec![]));
}

#[test]
fn a_face_becomes_triangles_on_both_of_its_sides() {
    let mut map = map_of(&two_tetrahedra());
    let inner = map
        .cells::<Face>()
        .find(|&face| map.volumes_of(face).1.is_some())
        .unwrap();
    map.edit(|edit| edit.star_face(inner)).unwrap();
    assert_eq!(map.violations(), []);
    assert_eq!(census(&map), [6, 12, 9, 2].into());
}

#[test]
fn collapsing_undoes_bisecting() {
    let grid = shapes::tetrahedra(2, 2, 2);
    for index in 0..map_of(&grid).count::<Edge>() {
        let mut map = map_of(&grid);
        let before = census(&map);
        let edge = map.cell_at::<Edge>(index).unwrap();
        let (vertex, _) = map.edit(|edit| edit.bisect(edge)).unwrap();
        let [kept, drawn] = map.ends(edge);
        assert_eq!(drawn, vertex);
        map.edit(|edit| edit.collapse(edge, kept)).unwrap();
        assert_eq!((map.violations(), census(&map)), (vec![], before));
        assert_eq!(map.cell_at::<Vertex>(vertex.index()), None);
    }
}

#[test]
fn a_collapse_that_would_change_the_topology_is_refused_and_changes_nothing() {
    let mut map = map_of(&shapes::tetrahedra(3, 2, 2));
    let (mut done, mut refused) = (0, 0);
    for index in 0..map.slot_count::<Edge>() {
        let Some(edge) = map.cell_at::<Edge>(index) else {
            continue;
        };
        let before = map.digest();
        // Either end may stay.
        let mut ends = map.ends(edge);
        ends.rotate_left(index % 2);
        let [kept, drawn] = ends;
        match map.edit(|edit| edit.collapse(edge, kept)) {
            Ok(_) => {
                done += 1;
                let left = [kept, drawn].map(|vertex| map.try_dart(vertex).is_some());
                assert_eq!(left, [true, false]);
            }
            Err(_) => {
                refused += 1;
                assert_eq!(map.digest(), before);
            }
        }
        let found = map.components();
        assert_eq!((found.len(), found[0].euler_characteristic(&map)), (1, 1));
    }
    assert!(done > 5 && refused > 5, "{done} done, {refused} refused");
}
