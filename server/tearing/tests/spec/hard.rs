//! Bodies that are hard to tear: flat, inside out, not manifold, of polyhedra.

use std::path::Path;

use crate::common::{Followed, count_fragments, done, number, volume};
use nalgebra::Vector3;
use sinew_mapping::Filter;
use sinew_mesh::{Grid, shapes};
use sinew_tearing::{Answer, Body, Request};
use sinew_topology::Edge;

/// Points throughout a mesh: some of its vertices.
fn points(mesh: &Grid, count: usize) -> Vec<Vector3<f64>> {
    let every = mesh.positions.len() / count;
    let chosen = mesh.positions.iter().skip(every / 2).step_by(every);
    chosen.take(count).copied().collect()
}

/// Tears all points apart at once whose areas have an edge between them, and counts what came of it: applied, refined,
/// refused.
fn tear_everything(mesh: Grid, count: usize) -> (Followed, [usize; 3]) {
    let points = points(&mesh, count);
    let mut body = Followed::bound(mesh, points.clone(), Filter::KeepK(1));
    let nearest = |body: &Body, vertex: usize| {
        let distances = points
            .iter()
            .map(|point| (point - body.rest()[vertex]).norm());
        let all = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        number(all.expect("there are points").0)
    };
    let map = body.map();
    let edges = map.cells::<Edge>().map(|edge| map.ends(edge));
    let mut pairs: Vec<[u32; 2]> = edges
        .map(|ends| ends.map(|end| nearest(&body, end.index())))
        .filter(|[one, other]| one < other)
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    assert!(pairs.len() > 5);
    let requests: Vec<_> = pairs
        .into_iter()
        .map(|points| Request::Separate { points })
        .collect();
    let outcome = body.apply(&requests);
    let mut counts = [0; 3];
    for answer in &outcome.answers {
        counts[match answer {
            Answer::Applied(_) => 0,
            Answer::Refined { .. } => 1,
            Answer::Refused(_) => 2,
        }] += 1;
    }
    assert_eq!(body.map().violations(), []);
    count_fragments(&body);
    (body, counts)
}

#[test]
fn flat_and_inverted_cells_tear_like_others() {
    for flatten in [0.0, -1.0, 1e-300] {
        let mut mesh = shapes::tetrahedra(5, 5, 5);
        // Up to the middle as they are, beyond it flat or folded over.
        for position in &mut mesh.positions {
            position.z = position.z.min(0.5) + flatten * (position.z - 0.5).max(0.0);
        }
        let before = volume(&Followed::new(mesh.clone()));
        let (body, counts) = tear_everything(mesh, 8);
        assert!(counts[0] + counts[1] > counts[2], "{counts:?}");
        assert!((volume(&body) - before).abs() < 1e-9);
        assert!(count_fragments(&body) > 3);
    }
}

#[test]
fn points_at_one_place_are_told_apart_by_their_numbers_or_refused() {
    let mut mesh = shapes::tetrahedra(3, 3, 3);
    mesh.positions
        .iter_mut()
        .for_each(|position| *position = Vector3::repeat(1.0));
    let mut body = Followed::bound(mesh, vec![Vector3::repeat(1.0); 2], Filter::KeepK(2));
    let outcome = body.apply(&[Request::Separate { points: [0, 1] }]);
    assert!(matches!(outcome.answers[0], Answer::Refused(_)));
    assert_eq!(body.version(), 0);
}

#[test]
fn every_cell_of_a_body_can_be_torn_from_every_other() {
    let mut body = Followed::new(shapes::tetrahedra(3, 3, 3));
    let map = body.map();
    let slots = |face| match map.volumes_of(face) {
        (one, Some(other)) => Some([body.slot(one), body.slot(other)]),
        (_, None) => None,
    };
    let facets: Vec<_> = map
        .cells::<sinew_topology::Face>()
        .filter_map(slots)
        .collect();
    let count = number(facets.len());
    let before = volume(&body);
    let outcome = body.apply(&[Request::Open { facets }]);
    assert_eq!(done(&outcome.answers[0]).opened, count);
    assert_eq!(count_fragments(&body), 162);
    assert_eq!(body.rest().len(), 4 * 162);
    assert_eq!(volume(&body), before);
}

#[test]
fn hard_files_tear_and_stay_maps() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/volume");
    if !root.is_dir() {
        println!("skipped: no shared data beside the project");
        return;
    }
    for (file, is_exact) in [
        ("tet/codimipc_skirt_0.005mm_inverted.vtk", true),
        ("tet/sofa_raptor_8418.vtu", true),
        ("poly/cinolib_eight_voronoi.hedra", false),
    ] {
        let mesh = sinew_formats::mesh::read(&root.join(file))
            .expect("it is read elsewhere")
            .grid;
        let before = volume(&Followed::new(mesh.clone()));
        let (body, counts) = tear_everything(mesh, 12);
        let change = (volume(&body) - before).abs() / before.abs();
        let parts = count_fragments(&body);
        println!(
            "{file}: applied, refined, refused {counts:?}; {parts} fragments; volume changed by {change:e}"
        );
        assert!(counts[0] + counts[1] > counts[2], "{file}: {counts:?}");
        // Polygons with rounded corners are not plane.
        assert!(
            change < if is_exact { 1e-9 } else { 1e-3 },
            "{file}: {change}"
        );
    }
}
