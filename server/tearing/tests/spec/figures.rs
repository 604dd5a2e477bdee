//! The cases of figures 4 to 6 of the paper, each with its census before and after.

use std::collections::BTreeMap;

use crate::common::{Followed, census, count_fragments, done, volume};
use nalgebra::Vector3;
use sinew_mapping::{Filter, Recipe, Reference, Rule, Weighting};
use sinew_mesh::{Cell, CellType, Cells, Grid, shapes};
use sinew_tearing::{Answer, Body, Effect, Refusal, Request};
use sinew_topology::{self as topology, Edge, Vertex};

const SEPARATE: [Request; 1] = [Request::Separate { points: [0, 1] }];

fn along_x(places: &[f64]) -> Vec<Vector3<f64>> {
    places.iter().map(|&x| Vector3::new(x, 0.0, 0.0)).collect()
}

fn within(farthest: f64) -> Filter {
    Filter::Interval {
        nearest: 0.0,
        farthest,
    }
}

/// A row of cubes of edge 1, from 0 along x.
fn bar(cubes: usize) -> Grid {
    let mut grid = shapes::hexahedra(cubes, 1, 1);
    for position in &mut grid.positions {
        *position *= cubes as f64;
    }
    grid
}

#[test]
fn a_frontier_along_vertices_duplicates_them() {
    // Figure 4.1: both points act on the vertices in the middle.
    let mut body = Followed::bound(bar(4), along_x(&[0.0, 4.0]), within(2.5));
    assert_eq!(census(&body), [20, 36, 21, 4]);
    let outcome = body.apply(&SEPARATE);
    let Answer::Applied(done) = &outcome.answers[0] else {
        panic!("{:?}", outcome.answers)
    };
    assert_eq!(census(&body), [24, 40, 22, 4]);
    assert_eq!((done.opened, &*done.cells), (1, &[1, 2][..]));
    assert_eq!(body.fragment_sizes(), [2, 2]);
    assert!(outcome.patch.unwrap().cell_parents.is_empty());
}

#[test]
fn a_frontier_between_vertices_splits_edges_first() {
    // Figure 4.2: the plane midway between the points passes through the cube in the middle.
    let mut body = Followed::bound(bar(3), along_x(&[0.25, 2.5]), Filter::KeepK(1));
    assert_eq!(census(&body), [16, 28, 16, 3]);
    let outcome = body.apply(&SEPARATE);
    let Answer::Applied(done) = &outcome.answers[0] else {
        panic!("{:?}", outcome.answers)
    };
    assert_eq!(census(&body), [24, 40, 22, 4]);
    assert_eq!(body.fragment_sizes(), [2, 2]);
    for vertex in done.vertices.clone() {
        assert_eq!(body.rest()[vertex as usize].x, 1.375);
    }
    let patch = outcome.patch.unwrap();
    assert_eq!(patch.cell_parents, [1]);
    assert!(patch.cells.types.iter().all(|&kind| kind == 12));
    assert!((volume(&body) - 3.0).abs() < 1e-12);
}

#[test]
fn areas_that_share_cells_are_drawn_anew_with_fewer_points() {
    // Figure 5.1: both points act on most vertices; on the nearest alone if that is all that counts.
    let mut body = Followed::bound(bar(4), along_x(&[0.4, 3.5]), within(3.0));
    let outcome = body.apply(&SEPARATE);
    let Answer::Refined {
        kept: 1, grown: 0, ..
    } = outcome.answers[0]
    else {
        panic!("{:?}", outcome.answers)
    };
    assert_eq!(body.fragment_sizes(), [3, 2]);
}

#[test]
fn areas_that_do_not_meet_grow_until_they_do() {
    // Figure 5.2: between the two points' areas lies that of a third, two vertices along.
    let mut body = Followed::bound(bar(5), along_x(&[0.0, 5.0, 2.5]), Filter::KeepK(1));
    let outcome = body.apply(&SEPARATE);
    let Answer::Refined {
        kept: 1, grown: 1, ..
    } = outcome.answers[0]
    else {
        panic!("{:?}", outcome.answers)
    };
    assert_eq!(body.fragment_sizes(), [3, 3]);

    // Too far apart: refused, with the cells at which each area ends.
    let mut body = Followed::bound(bar(20), along_x(&[0.0, 20.0, 10.0]), Filter::KeepK(1));
    let outcome = body.apply(&SEPARATE);
    let expected = Refusal::Gap {
        points: [0, 1],
        cells: vec![4, 5, 14, 15],
    };
    assert_eq!(outcome.answers, [Answer::Refused(expected)]);
    assert_eq!((outcome.patch, body.version()), (None, 0));
}

#[test]
fn a_request_about_no_two_areas_is_refused() {
    let mut body = Followed::bound(bar(2), along_x(&[0.0, 2.0, 99.0]), within(5.0));
    let ask = |points| Request::Separate { points };
    let outcome = body.apply(&[ask([0, 0]), ask([0, 3]), ask([2, 1])]);
    let refused = [0, 3, 2].map(|point| Answer::Refused(Refusal::NoArea { point }));
    assert_eq!(outcome.answers, refused);
}

/// A cell with each vertex in the first point's area (-1), in the second's (1) or in both (0).
fn lone(kind: CellType, places: &[i32]) -> Followed {
    let count = places.len();
    // Around the axis through the points, at different distances from it so that no four are in a plane.
    let position = |(at, &place): (usize, &i32)| {
        let turn = 2.4 * at as f64;
        let radius = 0.5 + 0.5 * (at + 1) as f64 / count as f64;
        Vector3::new(f64::from(place), radius * turn.cos(), radius * turn.sin())
    };
    let positions = places.iter().enumerate().map(position).collect();
    let mut cells = Cells::default();
    cells.push(Cell {
        kind,
        vertices: &(0..)
            .zip(places)
            .map(|(vertex, _)| vertex)
            .collect::<Vec<_>>(),
        face_stream: &[],
    });
    Followed::bound(
        Grid { positions, cells },
        along_x(&[-1.0, 1.0]),
        within(1.6),
    )
}

fn assignments(count: u32) -> impl Iterator<Item = Vec<i32>> {
    let all = 3_i32.pow(count);
    (0..all).map(move |code| {
        let digits = (0..count).scan(code, |rest, _| {
            let digit = *rest % 3;
            *rest /= 3;
            Some(digit - 1)
        });
        digits.collect()
    })
}

#[test]
fn every_split_of_a_tetrahedron_gives_its_pieces() {
    // Figure 6. By how many vertices are before, on and beyond the frontier: the vertices afterwards, and the pieces.
    let expected: BTreeMap<[usize; 3], (usize, [u8; 2])> = BTreeMap::from([
        ([1, 0, 3], (10, [10, 13])),
        ([3, 0, 1], (10, [13, 10])),
        ([2, 0, 2], (12, [13, 13])),
        ([1, 1, 2], (9, [10, 14])),
        ([2, 1, 1], (9, [14, 10])),
        ([1, 2, 1], (8, [10, 10])),
    ]);
    for places in assignments(4) {
        let mut body = lone(CellType::Tetrahedron, &places);
        let before = volume(&body);
        let counts = [-1, 0, 1].map(|place| places.iter().filter(|&&p| p == place).count());
        let outcome = body.apply(&SEPARATE);
        match expected.get(&counts) {
            Some(&(vertices, pieces)) => {
                assert!(
                    matches!(outcome.answers[0], Answer::Applied(_)),
                    "{places:?}"
                );
                assert_eq!(census(&body)[0], vertices, "{places:?}");
                assert_eq!(body.cells().types, pieces, "{places:?}");
                assert_eq!(body.fragment_sizes(), [1, 1], "{places:?}");
                assert!((volume(&body) - before).abs() < 1e-12, "{places:?}");
            }
            // No clear frontier, unless what is on it is given to the first point alone.
            None if counts[1] > 0 && counts[2] > 0 => {
                let Answer::Refined {
                    kept: 1, grown: 0, ..
                } = outcome.answers[0]
                else {
                    panic!("{places:?}: {:?}", outcome.answers[0])
                };
            }
            None => {
                let refused = matches!(outcome.answers[0], Answer::Refused(_));
                assert!(refused, "{places:?}");
                assert_eq!(census(&body), [4, 6, 4, 1]);
            }
        }
    }
}

#[test]
fn every_split_of_any_cell_is_done_or_refused() {
    let mut parted = BTreeMap::new();
    for (kind, count) in [
        (CellType::Pyramid, 5),
        (CellType::Wedge, 6),
        (CellType::Hexahedron, 8),
    ] {
        for places in assignments(count) {
            let mut body = lone(kind, &places);
            let digest = body.map().digest();
            let outcome = body.apply(&SEPARATE);
            let has = [-1, 1].map(|place| places.contains(&place));
            match &outcome.answers[0] {
                Answer::Applied(_) | Answer::Refined { .. } => {
                    assert!(has.contains(&true), "{places:?}");
                    assert!(count_fragments(&body) > 1, "{places:?}");
                    *parted.entry(kind).or_insert(0) += 1;
                }
                Answer::Refused(_) => assert_eq!(body.map().digest(), digest),
            }
        }
    }
    // Those that a plane through edges and vertices can part.
    let expected = [
        (CellType::Hexahedron, 4584),
        (CellType::Wedge, 562),
        (CellType::Pyramid, 200),
    ];
    assert_eq!(parted, BTreeMap::from(expected));
}

#[test]
fn the_face_between_two_areas_is_just_unsewn() {
    // The simple case, which figure 6 leaves out: a face of which both points act on every vertex.
    let mut cells = Cells::default();
    for vertices in [[0, 1, 2, 3], [2, 1, 0, 4]] {
        cells.push(Cell {
            kind: CellType::Tetrahedron,
            vertices: &vertices,
            face_stream: &[],
        });
    }
    let around = |turn: f64| Vector3::new(0.0, turn.cos(), turn.sin());
    let mut positions = vec![around(0.0), around(2.0), around(4.0)];
    positions.extend(along_x(&[1.0, -1.0]));
    let mut body = Followed::bound(
        Grid { positions, cells },
        along_x(&[-1.0, 1.0]),
        within(1.6),
    );
    assert_eq!(census(&body), [5, 9, 7, 2]);
    let outcome = body.apply(&SEPARATE);
    assert_eq!(census(&body), [8, 12, 8, 2]);
    assert_eq!(done(&outcome.answers[0]).opened, 1);
}

#[test]
fn a_tear_through_a_vertex_of_sixty_volumes_parts_them_in_two_thirties() {
    // A ball of 60 tetrahedra around one vertex: rings of 10 at the equator and to either side, and the poles.
    let ring = |height: f64, at: u32| {
        let (turn, radius) = (
            f64::from(at) * 0.2 * std::f64::consts::PI,
            (1.0 - height * height).sqrt(),
        );
        Vector3::new(height, radius * turn.cos(), radius * turn.sin())
    };
    let mut positions = along_x(&[0.0, -1.0, 1.0]);
    for height in [-0.6, 0.0, 0.6] {
        positions.extend((0..10).map(|at| ring(height, at)));
    }
    let corner = |ring: u32, at: u32| 3 + 10 * ring + at % 10;
    let mut cells = Cells::default();
    let mut triangle = |vertices: [u32; 3]| {
        let [a, b, c] = vertices.map(|vertex| positions[vertex as usize]);
        let [_, b_, c_] = vertices;
        let (second, third) = if a.cross(&b).dot(&c) > 0.0 {
            (b_, c_)
        } else {
            (c_, b_)
        };
        cells.push(Cell {
            kind: CellType::Tetrahedron,
            vertices: &[0, vertices[0], second, third],
            face_stream: &[],
        });
    };
    for at in 0..10 {
        triangle([1, corner(0, at), corner(0, at + 1)]);
        triangle([2, corner(2, at), corner(2, at + 1)]);
        for below in [0, 1] {
            triangle([
                corner(below, at),
                corner(below, at + 1),
                corner(below + 1, at),
            ]);
            triangle([
                corner(below + 1, at),
                corner(below, at + 1),
                corner(below + 1, at + 1),
            ]);
        }
    }
    let mut body = Followed::bound(
        Grid { positions, cells },
        along_x(&[-1.0, 1.0]),
        within(1.45),
    );
    assert_eq!(census(&body)[3], 60);
    let outcome = body.apply(&SEPARATE);
    assert!(matches!(outcome.answers[0], Answer::Applied(_)));
    // The centre and the equator are there twice, and nothing was cut.
    assert_eq!(census(&body)[0], 33 + 11);
    assert_eq!(body.fragment_sizes(), [30, 30]);
}

#[test]
fn a_tear_that_closes_on_itself_frees_what_is_inside() {
    // Distances from the first point count six times, so that its area is a ball inside that of the second.
    let points = vec![Vector3::repeat(0.5), Vector3::new(2.0, 0.5, 0.5)];
    let recipe = Recipe {
        weighting: Weighting {
            coefficients: vec![6.0, 1.0],
            ..Weighting::default()
        },
        filter: Filter::KeepK(1),
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    };
    for grid in [shapes::hexahedra(5, 5, 5), shapes::tetrahedra(6, 6, 6)] {
        let mut body = Followed::with(grid, points.clone(), recipe.clone());
        let before = volume(&body);
        let outcome = body.apply(&SEPARATE);
        let effects = &done(&outcome.answers[0]).effects;
        let [
            Effect::FragmentBorn {
                fragment: 1,
                parent: 0,
                ..
            },
            Effect::InnerFracture,
        ] = **effects
        else {
            panic!("{effects:?}")
        };
        assert_eq!(body.map().components().len(), 2);
        assert!((volume(&body) - before).abs() < 1e-12);
    }
}

/// A request for each two points whose areas have an edge between them, if each vertex belongs to the nearest point.
fn neighbours(body: &Body, points: &[Vector3<f64>]) -> Vec<Request> {
    let nearest = |vertex: topology::Cell<Vertex>| {
        let distance = |point: &Vector3<f64>| (point - body.rest()[vertex.index()]).norm();
        let all = (0..).zip(points.iter().map(distance));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("there are points")
            .0
    };
    let map = body.map();
    let ends = map.cells::<Edge>().map(|edge| map.ends(edge).map(nearest));
    let mut pairs: Vec<[u32; 2]> = ends.filter(|[a, b]| a < b).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let separate = |points| Request::Separate { points };
    pairs.into_iter().map(separate).collect()
}

#[test]
fn all_pairs_torn_at_once_leave_no_fragment_of_many_points() {
    let points: Vec<_> = (0..27)
        .map(|at| {
            let [x, y, z] = [at % 3, at / 3 % 3, at / 9].map(f64::from);
            // Off the lattice, so that no two pairs are alike.
            let jitter = Vector3::new(
                (7.0 * z + y).sin(),
                (5.0 * x + z).sin(),
                (3.0 * y + x).sin(),
            );
            (Vector3::new(x, y, z) + Vector3::repeat(0.5) + 0.2 * jitter) / 3.0
        })
        .collect();
    let mut body = Followed::bound(
        shapes::tetrahedra(6, 6, 6),
        points.clone(),
        Filter::KeepK(1),
    );
    let before = volume(&body);
    let requests = neighbours(&body, &points);
    let outcome = body.apply(&requests);
    assert!((volume(&body) - before).abs() < 1e-9 * before);
    outcome.answers.iter().map(done).for_each(drop);
    // Where areas of three points and more meet, cells are left over.
    let greatest = body.fragment_sizes().iter().max().unwrap();
    assert!(count_fragments(&body) >= 27);
    assert!(4 * greatest < u32::try_from(body.slot_count()).unwrap());
}
