//! Each kind of request by itself, and long random sequences of all of them.

use crate::common::{Followed, census, count_fragments, done, folded, inside_out, number, volume};
use nalgebra::Vector3;
use sinew_mapping::Filter;
use sinew_mesh::{Cell, CellType, Cells, Grid, shapes};
use sinew_tearing::{Answer, Effect, Facet, Refusal, Request};
use sinew_topology::{Edge, Face};

#[test]
fn what_was_torn_can_be_glued_again() {
    let mut body = Followed::new(shapes::hexahedra(4, 2, 2));
    let (before, whole) = (census(&body), body.map().components().len());
    let facets = [1, 5, 9, 13].map(|cell| [cell, cell + 1]).to_vec();
    let outcome = body.apply(&[Request::Open { facets }]);
    assert_eq!(body.fragment_sizes(), [8, 8]);
    // Two faces by name; the rest by being near.
    let seam = &outcome.patch.expect("it was torn").seams[0];
    let [near, far] = seam.cells;
    let at = |vertex: u32| body.rest()[vertex as usize];
    let facing: Vec<_> = body.cells().cell(far as usize).vertices.to_vec();
    let same = |vertex: &u32| seam.vertices.iter().any(|&other| at(other) == at(*vertex));
    let facets = vec![[
        Facet {
            cell: near,
            vertices: seam.vertices.clone(),
        },
        Facet {
            cell: far,
            vertices: facing.into_iter().filter(same).collect(),
        },
    ]];
    let outcome = body.apply(&[Request::Glue { facets }]);
    let joined = Effect::FragmentsJoined {
        fragment: 0,
        absorbed: 1,
    };
    assert_eq!(done(&outcome.answers[0]).effects, [joined]);
    let close = Request::Close {
        fragments: [0, 0],
        distance: 0.0,
    };
    let outcome = body.apply(&[close.clone(), close]);
    assert_eq!(done(&outcome.answers[0]).closed, 3);
    assert_eq!(outcome.answers[1], Answer::Refused(Refusal::Nothing));
    assert_eq!(
        (census(&body), body.map().components().len()),
        (before, whole)
    );
    assert_eq!(body.fragment_sizes(), [16, 0]);
}

#[test]
fn faces_that_were_never_one_are_not_glued() {
    let mut body = Followed::new(shapes::hexahedra(3, 1, 1));
    let cells = body.cells();
    let end = |cell: u32, x: f64| Facet {
        cell,
        vertices: (cells.cell(cell as usize).vertices.iter().copied())
            .filter(|&vertex| body.rest()[vertex as usize].x == x)
            .collect(),
    };
    let facets = vec![[end(0, 0.0), end(2, 1.0)]];
    let inner = vec![[
        end(0, 0.0),
        Facet {
            cell: 1,
            vertices: vec![0, 1, 2],
        },
    ]];
    let outcome = body.apply(&[Request::Glue { facets }, Request::Glue { facets: inner }]);
    let refused = [
        Refusal::Apart { cells: [0, 2] },
        Refusal::NoFreeFacet { cell: 1 },
    ];
    assert_eq!(outcome.answers, refused.map(Answer::Refused));
}

#[test]
fn material_grows_on_a_face_as_a_prism() {
    let mut body = Followed::new(shapes::tetrahedra(1, 1, 1));
    let dart = |body: &Followed| {
        let map = body.map();
        let free = map
            .cells::<Face>()
            .find(|&face| map.volumes_of(face).1.is_none());
        map.dart(free.expect("a boundary"))
    };
    let first = dart(&body);
    let vertices = body
        .map()
        .ring(first)
        .map(|dart| number(body.map().vertex(dart).index()))
        .collect();
    let cell = body.slot(body.map().volume(first));
    let request = Request::Add {
        facets: vec![Facet { cell, vertices }],
        thickness: 0.5,
    };
    let before = (census(&body), volume(&body));
    let outcome = body.apply(&[request]);
    assert_eq!(done(&outcome.answers[0]).closed, 1);
    let [vertices, edges, faces, volumes] = before.0;
    assert_eq!(
        census(&body),
        [vertices + 3, edges + 6, faces + 4, volumes + 1]
    );
    assert_eq!(body.cells().types[6], 13);
    assert!((volume(&body) - before.1 - 0.25).abs() < 1e-12);
    assert_eq!(body.fragment_sizes()[0], 7);
    assert_eq!(outcome.patch.expect("it grew").cell_parents, [6]);
}

#[test]
fn halved_edges_keep_the_volume_and_drawn_together_again_the_mesh() {
    let mut body = Followed::new(shapes::tetrahedra(2, 2, 2));
    let first = census(&body);
    let vertices = number(body.rest().len());
    let edges = vec![[0, 13]];
    let outcome = body.apply(&[Request::Bisect { edges }]);
    let halved = done(&outcome.answers[0]);
    // The diagonal of a cube: six tetrahedra around it.
    assert_eq!(
        (halved.cells.len(), halved.vertices.clone()),
        (6, vertices..vertices + 1)
    );
    let patch = outcome.patch.expect("it was halved");
    assert_eq!(patch.cell_parents, halved.cells);
    let mut parents = patch.vertex_parents;
    parents.sort_unstable();
    assert_eq!(parents, [0, 13]);
    assert!((volume(&body) - 1.0).abs() < 1e-12);
    let [v, e, f, c] = first;
    assert_eq!(census(&body), [v + 1, e + 7, f + 12, c + 6]);
    let edge = [0, vertices];
    body.apply(&[Request::Collapse { edge }]);
    assert_eq!((census(&body), folded(&body)), (first, vec![]));
    assert!((volume(&body) - 1.0).abs() < 1e-12);
    // Whichever end stays, the other is in no cell any more.
    for edge in [[0, vertices], [vertices, 0]] {
        let mut body = Followed::new(shapes::tetrahedra(2, 2, 2));
        let edges = vec![[0, 13]];
        let outcome = body.apply(&[Request::Bisect { edges }, Request::Collapse { edge }]);
        assert_eq!(done(&outcome.answers[1]).cells.len(), 6);
        let [kept, gone] = edge.map(|vertex| body.cells().connectivity.contains(&vertex));
        assert!(kept && !gone);
    }
}

#[test]
fn an_edge_that_cannot_be_drawn_together_is_refused_with_what_stands_in_the_way() {
    let body = Followed::new(shapes::tetrahedra(3, 3, 3));
    let before = (body.map().digest(), body.rest().to_vec());
    let mut counts = [0; 3];
    let map = body.map();
    let edges: Vec<_> = map
        .cells::<Edge>()
        .map(|edge| map.ends(edge).map(|end| number(end.index())))
        .collect();
    for ends in edges {
        for edge in [ends, [ends[1], ends[0]]] {
            let mut body = Followed::new(shapes::tetrahedra(3, 3, 3));
            let outcome = body.apply(&[Request::Collapse { edge }]);
            match &outcome.answers[0] {
                Answer::Applied(_) => {
                    counts[0] += 1;
                    assert!(folded(&body).is_empty(), "{edge:?}");
                }
                Answer::Refused(refusal @ Refusal::Folds { vertices, cells }) => {
                    counts[1] += 1;
                    assert_eq!(*vertices, edge);
                    assert!(!cells.is_empty() && refusal.to_string().contains("take another edge"));
                    assert_eq!((body.map().digest(), body.rest().to_vec()), before);
                }
                Answer::Refused(
                    refusal @ Refusal::Tangled {
                        vertices, cells, ..
                    },
                ) => {
                    counts[2] += 1;
                    assert_eq!(*vertices, edge);
                    assert!(!cells.is_empty() && refusal.to_string().contains("take another"));
                    assert_eq!((body.map().digest(), body.rest().to_vec()), before);
                }
                other @ (Answer::Refined { .. } | Answer::Refused(_)) => {
                    panic!("{edge:?}: {other:?}")
                }
            }
        }
    }
    assert!(counts.iter().all(|&count| count > 0), "{counts:?}");
}

#[test]
fn only_tetrahedra_are_halved() {
    let mut body = Followed::new(shapes::hexahedra(2, 1, 1));
    let outcome = body.apply(&[
        Request::Bisect {
            edges: vec![[0, 1]],
        },
        Request::Bisect {
            edges: vec![[0, 99]],
        },
    ]);
    let refused = [
        Refusal::NoTetrahedra { cells: vec![0] },
        Refusal::NoEdge { vertices: [0, 99] },
    ];
    assert_eq!(outcome.answers, refused.map(Answer::Refused));
}

#[test]
fn a_cell_whose_middle_does_not_see_all_of_it_is_not_divided() {
    // A wedge with a corner drawn over to another: its sides are too warped.
    for (drawn, is_divided) in [(0.0, true), (0.9, false)] {
        let mut cells = Cells::default();
        cells.push(Cell {
            kind: CellType::Wedge,
            vertices: &[0, 1, 2, 3, 4, 5],
            face_stream: &[],
        });
        let at = |x, y, z| Vector3::new(x, y, z);
        let positions = vec![
            at(0.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(1.0, 0.0, 0.0),
            at(0.0, 0.0, 1.0),
            at(0.0, 1.0, 1.0),
            at(1.0 - drawn, drawn, 1.0),
        ];
        let mut body = Followed::new(Grid { positions, cells });
        let before = volume(&body);
        let outcome = body.apply(&[Request::Subdivide { cells: vec![0] }]);
        assert!(folded(&body).is_empty());
        assert!((volume(&body) - before).abs() < 1e-12);
        let refused = Answer::Refused(Refusal::Blind { cells: vec![0] });
        assert_eq!(outcome.answers[0] != refused, is_divided);
    }
}

#[test]
fn divided_cells_keep_their_volume() {
    let mut body = Followed::new(shapes::hexahedra(2, 2, 2));
    body.apply(&[Request::Subdivide { cells: vec![0, 1] }]);
    assert_eq!(census(&body)[3], 6 + 16);
    assert!((volume(&body) - 1.0).abs() < 1e-12);
    let mut body = Followed::new(shapes::tetrahedra(2, 2, 2));
    let outcome = body.apply(&[
        Request::Subdivide { cells: vec![3] },
        Request::Bisect {
            edges: vec![[0, 1], [0, 13]],
        },
        Request::Collapse { edge: [0, 26] },
    ]);
    assert!(matches!(outcome.answers[1], Answer::Applied(_)));
    let refusal = Refusal::NoEdge { vertices: [0, 26] };
    assert_eq!(outcome.answers[2], Answer::Refused(refusal));
    assert!((volume(&body) - 1.0).abs() < 1e-12);
}

/// A sequence of numbers without a pattern.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let side = (x ^ (x >> 31)) % u64::from(number(sides));
        usize::try_from(side).expect("below `sides`")
    }

    fn slot(&mut self, body: &Followed) -> u32 {
        // One beyond the end now and then.
        number(self.roll(body.slot_count() + 1))
    }

    fn facet(&mut self, body: &Followed) -> Facet {
        let cell = self.slot(body);
        let map = body.map();
        let volume = body.volume(cell);
        let vertices = volume.map_or(Vec::new(), |volume| {
            let mut walk = sinew_topology::Walk::default();
            let darts: Vec<_> = map.orbit(volume, &mut walk).collect();
            let ring = map.ring(darts[self.roll(darts.len())]);
            ring.map(|dart| number(map.vertex(dart).index())).collect()
        });
        Facet { cell, vertices }
    }

    fn edge(&mut self, body: &Followed) -> [u32; 2] {
        let map = body.map();
        match map.cell_at::<Edge>(self.roll(map.slot_count::<Edge>())) {
            Some(edge) => map.ends(edge).map(|vertex| number(vertex.index())),
            None => [0, 0],
        }
    }

    fn request(&mut self, body: &Followed, points: usize) -> Request {
        match self.roll(16) {
            0..5 => Request::Separate {
                points: [self.roll(points), self.roll(points)].map(number),
            },
            5..9 => {
                let Facet { cell, .. } = self.facet(body);
                let near = body.volume(cell).and_then(|volume| {
                    let mut walk = sinew_topology::Walk::default();
                    let mut near = body
                        .map()
                        .adjacent::<sinew_topology::Volume, Face>(volume, &mut walk);
                    near.next().map(|other| body.slot(other))
                });
                Request::Open {
                    facets: vec![[cell, near.unwrap_or(0)]],
                }
            }
            9..11 => Request::Close {
                fragments: [0, 0].map(|_| number(self.roll(body.fragment_sizes().len()))),
                distance: 0.0,
            },
            11 => Request::Glue {
                facets: vec![[self.facet(body), self.facet(body)]],
            },
            12 => Request::Remove {
                cells: vec![self.slot(body)],
            },
            13 => Request::Add {
                facets: vec![self.facet(body)],
                thickness: 0.1,
            },
            14 if self.roll(2) == 0 => Request::Subdivide {
                cells: vec![self.slot(body)],
            },
            14 => Request::Bisect {
                edges: vec![self.edge(body)],
            },
            _ => Request::Collapse {
                edge: self.edge(body),
            },
        }
    }
}

/// Whether a request changes what the body is, not only how it hangs together.
fn keeps_volume(request: &Request) -> bool {
    match request {
        Request::Separate { .. }
        | Request::Open { .. }
        | Request::Glue { .. }
        | Request::Close { .. }
        | Request::Subdivide { .. }
        | Request::Bisect { .. } => true,
        Request::Remove { .. } | Request::Add { .. } | Request::Collapse { .. } => false,
    }
}

#[test]
fn no_sequence_of_requests_breaks_a_body() {
    let long = std::env::var_os("SINEW_LONG").is_some();
    let mut left = if long { 100_000 } else { 1_000 };
    let mut dice = Dice(1);
    let mut counts = [0; 3];
    while left > 0 {
        let mesh: Grid = match dice.roll(3) {
            0 => shapes::tetrahedra(2, 2, 2),
            1 => shapes::hexahedra(3, 3, 3),
            _ => shapes::tetrahedra(4, 1, 1),
        };
        let mut at = || dice.roll(1000) as f64 / 1000.0;
        let points: Vec<_> = (0..6).map(|_| Vector3::new(at(), at(), at())).collect();
        let kept = 1 + dice.roll(3);
        let mut body = Followed::bound(mesh, points, Filter::KeepK(kept));
        // A vertex that moved leaves faces of more than three corners curved, of which a cut changes the volume.
        let mut is_plane = true;
        for _ in 0..40.min(left) {
            left -= 1;
            let request = dice.request(&body, 7);
            let (digest, before) = (body.map().digest(), volume(&body));
            let is_upright = folded(&body).is_empty();
            let outcome = body.apply_again(std::slice::from_ref(&request));
            match &outcome.answers[0] {
                Answer::Refused(_) => {
                    counts[2] += 1;
                    assert_eq!(body.map().digest(), digest, "{request:?}");
                }
                Answer::Applied(_) => counts[0] += 1,
                Answer::Refined { .. } => counts[1] += 1,
            }
            assert_eq!(body.map().violations(), [], "{request:?}");
            count_fragments(&body);
            is_plane &= !matches!(request, Request::Collapse { .. })
                || matches!(outcome.answers[0], Answer::Refused(_));
            if is_upright && !matches!(request, Request::Separate { .. }) {
                assert!(folded(&body).is_empty(), "{request:?}");
            }
            if is_plane {
                assert!(inside_out(&body).is_empty(), "{request:?}");
            }
            if keeps_volume(&request) && is_plane {
                let change = (volume(&body) - before).abs();
                assert!(
                    change <= 1e-9 * before.abs().max(1e-3),
                    "{request:?}: {change}"
                );
            }
        }
    }
    println!("applied, refined, refused: {counts:?}");
    assert!(counts.iter().all(|&count| count > 0));
}
