//! Attributes follow edits by their rules.

use sinew_mesh::shapes;
use sinew_topology::{Column, Event, Face, Rules, Vertex};

use crate::shapes::{map_of, two_tetrahedra};

#[test]
fn values_are_shared_out_on_splitting_and_summed_on_merging() {
    let mut map = map_of(&two_tetrahedra());
    let mut mass = Column::<Vertex, f64>::new(&map, 1.0);
    let rules = Rules {
        split: |mass| *mass,
        merge: |kept, gone| kept + gone,
        make: |_| 0.0,
    };
    let dart = map
        .cells::<Face>()
        .map(|face| map.dart(face))
        .find(|&d| map.beta3(d).is_some());
    let dart = dart.unwrap();
    let (other, changes) = map.edit(|edit| edit.unsew3(dart)).unwrap();
    mass.follow(&changes, &rules);
    let total = |map: &sinew_topology::Map, mass: &Column<Vertex, f64>| -> f64 {
        map.cells::<Vertex>().map(|vertex| mass[vertex]).sum()
    };
    assert_eq!(total(&map, &mass), 8.0);
    let (_, changes) = map.edit(|edit| edit.sew3(dart, other)).unwrap();
    mass.follow(&changes, &rules);
    assert_eq!(total(&map, &mass), 8.0);
}

#[test]
fn an_id_outlives_its_cell_but_finds_no_other() {
    let mut map = map_of(&shapes::hexahedra(2, 1, 1));
    let dart = map
        .cells::<Face>()
        .map(|face| map.dart(face))
        .find(|&d| map.beta3(d).is_some());
    let dart = dart.unwrap();
    let (other, changes) = map.edit(|edit| edit.unsew3(dart)).unwrap();
    let born: Vec<_> = (changes.events.iter())
        .filter_map(|event| match event {
            Event::Born {
                cell: sinew_topology::AnyCell::Vertex(vertex),
                ..
            } => Some(*vertex),
            Event::Born { .. } | Event::Died { .. } => None,
        })
        .collect();
    assert_eq!(
        born.iter().map(|v| v.index()).collect::<Vec<_>>(),
        [12, 13, 14, 15]
    );
    let id = map.id(born[0]);
    assert_eq!(map.find::<Vertex>(id), Some(born[0]));
    map.edit(|edit| edit.sew3(dart, other)).unwrap();
    assert_eq!(map.find::<Vertex>(id), None);
    // Vertices are appended until their slots are reclaimed.
    let (_, changes) = map.edit(|edit| edit.unsew3(dart)).unwrap();
    assert!(changes.events.iter().all(|event| match event {
        Event::Born {
            cell: sinew_topology::AnyCell::Vertex(vertex),
            ..
        } => vertex.index() > 15,
        Event::Born { .. } | Event::Died { .. } => true,
    }));
    map.edit(|edit| edit.sew3(dart, other)).unwrap();
    map.reclaim();
    map.edit(|edit| edit.unsew3(dart)).unwrap();
    assert_eq!(map.slot_count::<Vertex>(), 20);
    assert_eq!(map.find::<Vertex>(id), None);
}
