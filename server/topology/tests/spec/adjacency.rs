//! Incidence and adjacency, asked one by one and taken down at once.

use sinew_mesh::shapes;
use sinew_topology::{Adjacency, Cell, Edge, Face, Incidence, Kind, Map, Vertex, Volume, Walk};

use crate::shapes::{map_of, two_tetrahedra};

/// What the definition says: cells that share a dart's orbit, looked up dart by dart.
fn incident_by_definition<I: Kind, J: Kind>(map: &Map, cell: Cell<I>) -> Vec<Cell<J>> {
    let mut found: Vec<_> = (map.darts())
        .filter(|&dart| map.cell::<I>(dart) == cell)
        .map(|dart| map.cell::<J>(dart))
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

fn check_pair<I: Kind, J: Kind>(map: &Map) {
    let (incidence, adjacency) = (Incidence::<I, J>::new(map), Adjacency::<I, J>::new(map));
    let mut walk = Walk::default();
    for cell in map.cells::<I>() {
        let wanted = incident_by_definition::<I, J>(map, cell);
        assert_eq!(incidence.of(cell), wanted);
        let mut asked: Vec<_> = map.incident::<I, J>(cell, &mut walk).collect();
        asked.sort_unstable();
        assert_eq!(asked, wanted);

        let mut wanted: Vec<_> = (wanted.into_iter())
            .flat_map(|between| incident_by_definition::<J, I>(map, between))
            .filter(|&other| other != cell)
            .collect();
        wanted.sort_unstable();
        wanted.dedup();
        assert_eq!(adjacency.of(cell), wanted);
        let mut asked: Vec<_> = map.adjacent::<I, J>(cell, &mut walk).collect();
        asked.sort_unstable();
        assert_eq!(asked, wanted);
    }
}

macro_rules! for_every_pair {
    ($call:ident($($argument:expr),*)) => {
        $call::<Vertex, Edge>($($argument),*);
        $call::<Vertex, Face>($($argument),*);
        $call::<Vertex, Volume>($($argument),*);
        $call::<Edge, Vertex>($($argument),*);
        $call::<Edge, Face>($($argument),*);
        $call::<Edge, Volume>($($argument),*);
        $call::<Face, Vertex>($($argument),*);
        $call::<Face, Edge>($($argument),*);
        $call::<Face, Volume>($($argument),*);
        $call::<Volume, Vertex>($($argument),*);
        $call::<Volume, Edge>($($argument),*);
        $call::<Volume, Face>($($argument),*);
    };
}

#[test]
fn every_pair_of_dimensions_is_as_the_orbits_say() {
    for grid in [
        two_tetrahedra(),
        shapes::tetrahedra(2, 1, 1),
        shapes::hexahedra(2, 2, 1),
    ] {
        let map = map_of(&grid);
        for_every_pair!(check_pair(&map));
    }
}

fn check_following<I: Kind, J: Kind>(grid: &sinew_mesh::Grid) {
    let mut map = map_of(grid);
    let mut incidence = Incidence::<I, J>::new(&map);
    let mut adjacency = Adjacency::<I, J>::new(&map);
    for step in 0..12 {
        let volumes: Vec<_> = map.cells::<Volume>().collect();
        let edges: Vec<_> = map.cells::<Edge>().collect();
        let faces: Vec<_> = map.cells::<Face>().collect();
        let inner: Vec<_> = faces
            .iter()
            .copied()
            .filter(|&f| map.volumes_of(f).1.is_some())
            .collect();
        let changes = map.edit(|edit| match step % 6 {
            0 => edit
                .unsew3(edit.map().dart(inner[step % inner.len()]))
                .map(drop),
            1 => edit.star(volumes[step % volumes.len()]).map(drop),
            2 => edit.bisect(edges[(7 * step) % edges.len()]).map(drop),
            3 => edit.remove_volume(volumes[step % volumes.len()]),
            4 => edit.split_edge(edges[(5 * step) % edges.len()]).map(drop),
            _ => edit.star_face(faces[(3 * step) % faces.len()]).map(drop),
        });
        let Ok(((), changes)) = changes else { continue };
        incidence.follow(&map, &changes);
        adjacency.follow(&map, &changes);
        let (fresh, fresh_adjacency) = (Incidence::<I, J>::new(&map), Adjacency::<I, J>::new(&map));
        for cell in map.cells::<I>() {
            assert_eq!(incidence.of(cell), fresh.of(cell), "step {step}, {cell}");
            assert_eq!(
                adjacency.of(cell),
                fresh_adjacency.of(cell),
                "step {step}, {cell}"
            );
        }
    }
}

#[test]
fn rows_that_follow_edits_are_those_of_a_fresh_look() {
    let grid = shapes::tetrahedra(2, 2, 1);
    for_every_pair!(check_following(&grid));
}
