//! Opening faces and removing cells: what falls apart, what stays, and what a follower is told.

use crate::common::{Followed, census, count_fragments, done};
use proptest::prelude::*;
use sinew_mesh::shapes;
use sinew_tearing::{Answer, Effect, Refusal, Request, SeamKind};

#[test]
fn opening_the_face_of_two_cubes_makes_two_fragments() {
    let mut body = Followed::new(shapes::hexahedra(2, 1, 1));
    assert_eq!(census(&body), [12, 20, 11, 2]);
    let outcome = body.apply(&[Request::Open {
        facets: vec![[0, 1]],
    }]);
    assert_eq!(census(&body), [16, 24, 12, 2]);
    let done = done(&outcome.answers[0]);
    assert_eq!((done.opened, &*done.cells), (1, &[0, 1][..]));
    assert_eq!(done.vertices, 12..16);
    let born = Effect::FragmentBorn {
        fragment: 1,
        parent: 0,
        cells: 1,
    };
    assert_eq!(done.effects, [born]);
    let patch = outcome.patch.unwrap();
    assert_eq!(patch.seams.len(), 1);
    assert_eq!(patch.seams[0].kind, SeamKind::Opened);
    assert_eq!(patch.seams[0].cells, [0, 1]);
    for (at, &parent) in patch.vertex_parents.iter().enumerate() {
        assert_eq!(body.rest()[12 + at], body.rest()[parent as usize]);
    }
}

#[test]
fn a_fracture_inside_is_not_seen_until_it_reaches_the_surface() {
    // Cells of a block of 5³ are 5 apart in y, 25 in z; 62 is the one in the middle.
    let mut body = Followed::new(shapes::hexahedra(5, 5, 5));
    let mut open = |pair: [u32; 2]| {
        let outcome = body.apply(&[Request::Open { facets: vec![pair] }]);
        done(&outcome.answers[0]).effects.clone()
    };
    assert_eq!(open([62, 63]), [Effect::InnerFracture]);
    assert_eq!(open([57, 58]), [Effect::InnerFracture]);
    // The face in the outer layer meets the surface along an edge.
    assert_eq!(open([52, 53]), [Effect::FractureOpened]);
    // One at the surface that meets no fracture inside opens none.
    assert_eq!(open([0, 1]), []);
}

#[test]
fn a_cell_cut_out_inside_is_a_fragment_that_nobody_sees() {
    let mut body = Followed::new(shapes::hexahedra(3, 3, 3));
    let facets = [4, 10, 12, 14, 16, 22].map(|other| [13, other]).to_vec();
    let outcome = body.apply(&[Request::Open { facets }]);
    let born = Effect::FragmentBorn {
        fragment: 1,
        parent: 0,
        cells: 1,
    };
    let expected = [born, Effect::InnerFracture];
    assert_eq!(done(&outcome.answers[0]).effects, expected);
    // Taking a neighbour at the surface away shows it.
    let outcome = body.apply(&[Request::Remove { cells: vec![4] }]);
    let effects = &done(&outcome.answers[0]).effects;
    assert_eq!(*effects, [Effect::FractureOpened]);
}

#[test]
fn of_a_body_that_falls_apart_the_greatest_part_keeps_the_number() {
    let mut body = Followed::new(shapes::hexahedra(7, 1, 1));
    let outcome = body.apply(&[Request::Remove { cells: vec![1, 4] }]);
    let born = |fragment, cells| Effect::FragmentBorn {
        fragment,
        parent: 0,
        cells,
    };
    // Cells 2, 3 keep it; 5, 6 are as many but come later.
    let effects = &done(&outcome.answers[0]).effects;
    assert_eq!(*effects, [born(1, 2), born(2, 1)]);
    assert_eq!(body.fragment_sizes(), [2, 2, 1]);
    let patch = outcome.patch.unwrap();
    assert_eq!((patch.slots, patch.cells.types), (vec![1, 4], vec![0, 0]));
}

#[test]
fn a_refused_request_changes_nothing_and_the_next_one_goes_on() {
    let mut body = Followed::new(shapes::tetrahedra(2, 2, 2));
    let before = (body.map().digest(), body.fragment_sizes().to_vec());
    let outcome = body.apply(&[
        Request::Open {
            facets: vec![[0, 1], [0, 47]],
        },
        Request::Remove { cells: vec![0, 99] },
        Request::Remove { cells: vec![] },
    ]);
    let refused = [
        Refusal::NoFacet { cells: [0, 47] },
        Refusal::NoCell { cell: 99 },
        Refusal::Nothing,
    ];
    assert_eq!(outcome.answers, refused.map(Answer::Refused));
    assert_eq!(outcome.patch, None);
    let after = (body.map().digest(), body.fragment_sizes().to_vec());
    assert_eq!(after, before);
    let outcome = body.apply(&[
        Request::Remove { cells: vec![99] },
        Request::Remove { cells: vec![0] },
    ]);
    assert!(matches!(outcome.answers[1], Answer::Applied(_)));
    assert_eq!(outcome.patch.unwrap().cells.types[0], 0);
}

proptest! {
    #[test]
    fn fragments_are_the_connected_components(
        requests in prop::collection::vec((any::<bool>(), prop::collection::vec((0_u32..27, 0_usize..3), 1..12)), 1..12)
    ) {
        let mut body = Followed::new(shapes::hexahedra(3, 3, 3));
        for (opens, cells) in requests {
            // Each pair by itself, since some cells are gone or have no such neighbour.
            let batch: Vec<_> = cells.iter().map(|&(cell, axis)| match opens {
                true => Request::Open { facets: vec![[cell, cell + [1, 3, 9][axis]]] },
                false => Request::Remove { cells: vec![cell] },
            }).collect();
            body.apply(&batch);
            prop_assert_eq!(count_fragments(&body), body.map().components().len());
        }
    }
}
