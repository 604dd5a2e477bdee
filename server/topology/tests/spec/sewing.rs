//! Sewing, unsewing, and what they do to cells.

use sinew_mesh::shapes;
use sinew_topology::{Dart, Dimension, Edit, EditError, Face, Map};

use crate::shapes::{census, map_of, two_tetrahedra};

fn inner_faces(map: &Map) -> Vec<Dart> {
    let faces = map.cells::<Face>().map(|face| map.dart(face));
    faces.filter(|&dart| map.beta3(dart).is_some()).collect()
}

#[test]
fn unsewing_two_tetrahedra_parts_all_that_they_share() {
    let mut map = map_of(&two_tetrahedra());
    let before = map.structure_digest();
    let dart = inner_faces(&map)[0];
    let (other, _) = map.edit(|edit| edit.unsew3(dart)).unwrap();
    assert_eq!(census(&map), [8, 12, 8, 2].into());
    assert_eq!(map.violations(), []);
    map.edit(|edit| edit.sew3(dart, other)).unwrap();
    assert_eq!(census(&map), [5, 9, 7, 2].into());
    assert_eq!(map.structure_digest(), before);
}

#[test]
fn sewing_undoes_unsewing_face_by_face_and_all_at_once() {
    for grid in [shapes::tetrahedra(3, 2, 2), shapes::hexahedra(3, 3, 3)] {
        let mut map = map_of(&grid);
        let before = map.structure_digest();
        let faces = inner_faces(&map);
        let mut pairs = Vec::new();
        for &dart in &faces {
            let (other, _) = map.edit(|edit| edit.unsew3(dart)).unwrap();
            pairs.push((dart, other));
        }
        let volumes = map.count::<sinew_topology::Volume>();
        let each = if grid.cells.types[0] == 10 {
            [4, 6, 4, 1]
        } else {
            [8, 12, 6, 1]
        };
        assert_eq!(census(&map), each.map(|count| count * volumes).into());
        for &(dart, other) in &pairs {
            map.edit(|edit| edit.sew3(dart, other)).unwrap();
        }
        assert_eq!(map.structure_digest(), before);
        let batch = map.edit(|edit| {
            let others = faces.iter().map(|&dart| edit.unlink3(dart));
            others.collect::<Result<Vec<_>, EditError>>()
        });
        batch.unwrap();
        assert_eq!(census(&map), each.map(|count| count * volumes).into());
        map.edit(|edit| pairs.iter().try_for_each(|&(a, b)| edit.link3(a, b)))
            .unwrap();
        assert_eq!(map.structure_digest(), before);
    }
}

#[test]
fn a_surface_is_sewn_of_single_darts() {
    let mut map = Map::new(Dimension::Two);
    let ((), changes) = map
        .edit(|edit| {
            let mut triangle = || -> Result<[Dart; 3], EditError> {
                let darts = [edit.add_dart()?, edit.add_dart()?, edit.add_dart()?];
                for at in 0..3 {
                    edit.sew1(darts[at], darts[(at + 1) % 3])?;
                }
                Ok(darts)
            };
            let [one, other] = [triangle()?, triangle()?];
            edit.sew2(one[0], other[0])
        })
        .unwrap();
    assert_eq!(map.violations(), []);
    assert_eq!(census(&map), [4, 5, 2, 1].into());
    assert!(!changes.events.is_empty());
    assert_eq!(map.components()[0].euler_characteristic(&map), 1);
}

#[test]
fn a_face_may_be_opened_within_an_edit_but_not_left_open() {
    let mut map = map_of(&two_tetrahedra());
    let before = map.digest();
    let dart = inner_faces(&map)[0];
    let error = map.edit(|edit| edit.unsew1(dart)).unwrap_err();
    assert!(matches!(error, EditError::OpenFace { .. }));
    assert_eq!(map.digest(), before);
    map.edit(|edit| {
        let next = edit.unsew1(dart)?;
        // Whole faces alone can be sewn.
        let refused = edit.unsew3(dart).unwrap_err();
        assert!(matches!(refused, EditError::OpenFace { .. }));
        edit.sew1(dart, next)
    })
    .unwrap();
    assert_eq!(map.digest(), before);
}

#[test]
fn refusals_name_the_darts_and_change_nothing() {
    let mut map = map_of(&shapes::hexahedra(2, 1, 1));
    let before = map.digest();
    let inner = inner_faces(&map)[0];
    let outer = map.darts().find(|&dart| map.beta3(dart).is_none()).unwrap();
    let beyond = map.beta3(inner).unwrap();
    let cases = [
        (
            map.edit(|edit| edit.sew3(inner, outer)),
            EditError::NotFree {
                beta: 3,
                one: inner,
                other: outer,
                taken: inner,
            },
        ),
        (
            map.edit(|edit| edit.unsew3(outer).map(drop)),
            EditError::Free {
                beta: 3,
                dart: outer,
            },
        ),
        (
            map.edit(|edit| edit.sew3(outer, edit.map().beta1(outer))),
            EditError::SameSide {
                one: outer,
                other: map.beta1(outer),
            },
        ),
        (
            map.edit(|edit| edit.link1(inner, beyond)),
            EditError::NotFree {
                beta: 1,
                one: inner,
                other: beyond,
                taken: inner,
            },
        ),
    ];
    for (result, expected) in cases {
        assert_eq!(result.unwrap_err(), expected);
    }
    assert_eq!(map.digest(), before);
}

#[test]
fn a_face_whose_sides_differ_is_refused_until_both_are_linked_alike() {
    let mut map = map_of(&shapes::hexahedra(2, 1, 1));
    let before = map.digest();
    let near = inner_faces(&map)[0];
    let ring: Vec<_> = map.ring(near).collect();
    let facing: Vec<_> = ring.iter().map(|&dart| map.beta3(dart).unwrap()).collect();
    // One side of the quad becomes two rings of two darts, the other stays a ring of four.
    let one_side = |edit: &mut Edit<'_>| {
        edit.unlink1(ring[1])?;
        edit.unlink1(ring[3])?;
        edit.link1(ring[1], ring[0])?;
        edit.link1(ring[3], ring[2])
    };
    let error = map.edit(one_side).unwrap_err();
    assert!(matches!(error, EditError::SidesDiffer { .. }), "{error}");
    assert_eq!(map.digest(), before);
    map.edit(|edit| {
        one_side(edit)?;
        let refused = edit.unsew3(near).unwrap_err();
        assert!(matches!(refused, EditError::SidesDiffer { .. }));
        edit.unlink1(facing[0])?;
        edit.unlink1(facing[2])?;
        edit.link1(facing[0], facing[1])?;
        edit.link1(facing[2], facing[3])
    })
    .unwrap();
    assert_eq!(map.violations(), []);
}

#[test]
fn faces_linked_with_a_turn_share_other_cells() {
    let mut map = map_of(&two_tetrahedra());
    let before = map.structure_digest();
    let dart = inner_faces(&map)[0];
    let turn = |map: &mut Map| {
        map.edit(|edit| {
            let facing = edit.unlink3(dart)?;
            edit.link3(dart, edit.map().beta1(facing))
        })
        .unwrap();
        assert_eq!(census(map), [5, 9, 7, 2].into());
        map.structure_digest()
    };
    let digests = [(); 3].map(|()| turn(&mut map));
    assert_ne!(digests[0], before);
    assert_ne!(digests[1], before);
    // Three turns by a third are none.
    assert_eq!(digests[2], before);
}
