//! What filters keep of distances along paths, and what vertices follow of what their cells keep.

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_mapping::{
    Cells, Cost, Dimension, Filter, Graph, MappingError, Mesh, Metric, Paths, Recipe, Reference,
    Roots, Rows, Rule, Start, Weighting, bind_mesh,
};

const NODES: u32 = 40;

fn paths(cost: Cost, start: Start) -> Metric {
    Metric::Paths(Paths {
        arcs: Dimension::Edge,
        roots: Roots::Nearest,
        start,
        cost,
    })
}

/// Vertices along the x axis, 1 m apart, each an arc from the next but where it is cut.
fn line(cut: Option<u32>) -> (Vec<Vector3<f64>>, Graph) {
    let vertices = (0..NODES).map(|x| Vector3::new(f64::from(x), 0.0, 0.0));
    let mut starts = vec![0];
    let mut ends = Vec::new();
    for node in 0..NODES {
        let joined = |a: u32, b: u32| b < NODES && Some(a.max(b)) != cut;
        let near = [node.wrapping_sub(1), node + 1];
        ends.extend(near.into_iter().filter(|&other| joined(node, other)));
        starts.push(u32::try_from(ends.len()).expect("few"));
    }
    let graph = Graph::new(Rows::new(starts, ends), Vec::new()).expect("sound");
    (vertices.collect(), graph)
}

fn recipe(metric: Metric, filter: Filter) -> Recipe {
    Recipe {
        weighting: Weighting {
            metric,
            ..Weighting::default()
        },
        filter,
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    }
}

/// The points of each vertex, with their weights.
fn kept(
    mesh: &Mesh<'_>,
    points: &[Vector3<f64>],
    recipe: &Recipe,
) -> Result<Vec<Vec<(u32, f64)>>, MappingError> {
    let binding = bind_mesh(mesh, points, &vec![true; points.len()], recipe)?;
    Ok((0..mesh.vertices.len())
        .map(|v| binding.weights(v))
        .collect())
}

fn at(places: &[f64]) -> Vec<Vector3<f64>> {
    places.iter().map(|&x| Vector3::new(x, 0.0, 0.0)).collect()
}

proptest! {
    /// On a line of vertices one step apart, paths from a point at a vertex are as long as straight lines.
    #[test]
    fn filters_keep_the_same_of_paths_as_of_straight_lines(
        places in prop::collection::vec(0..NODES, 1..12),
        coefficients in prop::collection::vec(prop::sample::select(vec![0.5, 1.0, 1.0, 2.0]), 12..=12),
        weighted in any::<bool>(),
        k in 1..6_usize,
        within in (0..12_u32).prop_map(f64::from),
        which in 0..6_usize,
    ) {
        let (vertices, graph) = line(None);
        let points = at(&places.iter().map(|&x| f64::from(x)).collect::<Vec<_>>());
        let filter = match which {
            0 => Filter::KeepK(k),
            1 => Filter::Interval { nearest: 0.0, farthest: within },
            2 => Filter::KeepAtLeast { k, within },
            3 => Filter::Sequence(vec![
                Filter::Interval { nearest: 0.0, farthest: 20.0 + within },
                Filter::KeepK(k),
            ]),
            4 => Filter::Sequence(vec![
                Filter::KeepAtLeast { k: 8, within },
                Filter::Interval { nearest: 0.0, farthest: 30.0 },
                Filter::KeepK(k),
            ]),
            _ => Filter::Interval { nearest: 1.0, farthest: 60.0 },
        };
        let mut mesh = Mesh::of_vertices(&vertices);
        mesh.graph = Some(&graph);
        let of = |metric| {
            let mut recipe = recipe(metric, filter.clone());
            recipe.weighting.scale = Some(3.0);
            if weighted {
                recipe.weighting.coefficients = coefficients[..points.len()].to_vec();
            }
            kept(&mesh, &points, &recipe)
        };
        let (straight, paths) = (of(Metric::Straight), of(paths(Cost::Hops, Start::Zero)));
        if let Ok(rows) = &paths {
            for row in rows {
                let sum: f64 = row.iter().map(|entry| entry.1).sum();
                prop_assert!((sum - 1.0).abs() < 1e-12);
            }
        }
        prop_assert_eq!(straight, paths);
    }
}

#[test]
fn what_no_path_leads_to_is_named() {
    let (vertices, graph) = line(Some(30));
    let mut mesh = Mesh::of_vertices(&vertices);
    mesh.graph = Some(&graph);
    let hops = || paths(Cost::Hops, Start::Zero);
    let refusal = kept(&mesh, &at(&[3.0, 8.0]), &recipe(hops(), Filter::KeepK(1))).unwrap_err();
    let MappingError::Unreached { targets, cells } = &refusal else {
        panic!("{refusal}");
    };
    assert_eq!(*targets, Dimension::Vertex);
    assert_eq!(*cells, (30..40).collect::<Vec<usize>>());
    assert!(refusal.to_string().contains("10 vertices, 30, 31"));
    // One point there is enough; each part follows its own.
    let rows = kept(&mesh, &at(&[3.0, 33.0]), &recipe(hops(), Filter::KeepK(2))).unwrap();
    assert_eq!(rows[29], [(0, 1.0)]);
    assert_eq!(rows[30], [(1, 1.0)]);
}

#[test]
fn paths_that_mean_nothing_are_refused() {
    let (vertices, graph) = line(None);
    let mut mesh = Mesh::of_vertices(&vertices);
    mesh.graph = Some(&graph);
    let refusal = |metric| kept(&mesh, &at(&[3.0]), &recipe(metric, Filter::KeepK(1))).unwrap_err();
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let ball = Metric::Paths(Paths {
            arcs: Dimension::Edge,
            roots: Roots::Ball(radius),
            start: Start::Zero,
            cost: Cost::Hops,
        });
        assert!(matches!(refusal(ball), MappingError::Radius { .. }));
    }
    let arcs = Metric::Paths(Paths {
        arcs: Dimension::Vertex,
        roots: Roots::Nearest,
        start: Start::Zero,
        cost: Cost::Hops,
    });
    assert_eq!(refusal(arcs), MappingError::Arcs);
}

#[test]
fn balls_start_paths_at_all_targets_in_them_and_distances_count_from_the_point() {
    let (vertices, graph) = line(None);
    let mut mesh = Mesh::of_vertices(&vertices);
    mesh.graph = Some(&graph);
    let distances = |roots, start| {
        let weighting = Weighting {
            metric: Metric::Paths(Paths {
                arcs: Dimension::Edge,
                roots,
                start,
                cost: Cost::Length,
            }),
            ..Weighting::default()
        };
        let points = at(&[10.25]);
        let found = sinew_mapping::distances(&mesh, &points, &[true], &weighting).unwrap();
        [7, 9, 12].map(|node| found.row(node).next().unwrap().1)
    };
    // Arcs of one step each, from 9 to 12, or from the nearest at 10.
    assert_eq!(distances(Roots::Ball(1.8), Start::Zero), [2.0, 0.0, 0.0]);
    assert_eq!(distances(Roots::Nearest, Start::Zero), [3.0, 1.0, 2.0]);
    assert_eq!(
        distances(Roots::Nearest, Start::Distance),
        [3.25, 1.25, 2.25]
    );
}

#[test]
fn a_vertex_follows_what_its_cells_keep_at_the_least_distance() {
    // Cells of two vertices each along the x axis; each keeps its nearest point.
    let vertices = at(&[0.0, 1.0, 2.0, 3.0]);
    let centres = at(&[0.5, 1.5, 2.5]);
    let rows = Rows::new(vec![0, 1, 3, 5, 6], vec![0, 0, 1, 1, 2, 2]);
    let mesh = Mesh {
        cells: Some(Cells {
            centres: &centres,
            at_vertices: &rows,
        }),
        ..Mesh::of_vertices(&vertices)
    };
    let mut recipe = recipe(Metric::Straight, Filter::KeepK(1));
    recipe.weighting.targets = Dimension::Edge;
    recipe.weighting.scale = Some(1.0);
    let points = at(&[0.25, 2.5]);
    let sets: Vec<Vec<u32>> = kept(&mesh, &points, &recipe)
        .unwrap()
        .into_iter()
        .map(|row| row.into_iter().map(|entry| entry.0).collect())
        .collect();
    assert_eq!(sets, [vec![0], vec![0, 1], vec![1], vec![1]]);
    let row = &kept(&mesh, &points, &recipe).unwrap()[1];
    let ratio = (-0.5 * (1.0_f64 - 0.25 * 0.25)).exp(); // of r = 1, cell 1, to r = 0.25, cell 0
    assert!((row[1].1 / row[0].1 - ratio).abs() < 1e-12);

    let lonely = Rows::new(vec![0, 1, 3, 5, 5], vec![0, 0, 1, 1, 2]);
    let mesh = Mesh {
        cells: Some(Cells {
            centres: &centres,
            at_vertices: &lonely,
        }),
        ..mesh
    };
    let refusal = kept(&mesh, &points, &recipe).unwrap_err();
    let targets = Dimension::Edge;
    let vertices = vec![3];
    assert_eq!(refusal, MappingError::NoTargets { targets, vertices });
}

#[test]
fn points_are_kept_by_the_targets_whose_volumes_hold_them() {
    let vertices = at(&[0.0, 1.0, 2.0]);
    let holding = Rows::new(vec![0, 2, 4, 4], vec![0, 1, 1, 2]);
    let mut mesh = Mesh::of_vertices(&vertices);
    mesh.holding = Some(&holding);
    let points = at(&[0.5, 1.5, 0.1]);
    let recipe = recipe(Metric::Straight, Filter::InVolume);
    let rows = kept(&mesh, &points, &recipe).unwrap();
    let sets: Vec<Vec<u32>> = rows
        .into_iter()
        .map(|row| row.into_iter().map(|entry| entry.0).collect())
        .collect();
    assert_eq!(sets, [vec![0], vec![0, 1], vec![1]]);
    let nobody = Rows::new(vec![0, 0, 2, 2], vec![1, 2]);
    mesh.holding = Some(&nobody);
    let refusal = kept(&mesh, &points, &recipe).unwrap_err();
    let (targets, cells) = (Dimension::Vertex, vec![0]);
    assert_eq!(refusal, MappingError::KeepsNoneAt { targets, cells });
}

#[test]
fn four_that_span_a_volume_are_found_however_many_lie_in_a_plane_before_them() {
    let (vertices, graph) = line(None);
    let mut mesh = Mesh::of_vertices(&vertices);
    mesh.graph = Some(&graph);
    // 60 points in the plane z = 0, then one out of it at the far end.
    let mut points: Vec<Vector3<f64>> = (0..60)
        .map(|i| Vector3::new(f64::from(i) / 10.0, f64::from(i % 3) / 10.0, 0.0))
        .collect();
    points.push(Vector3::new(39.0, 0.0, 0.3));
    for metric in [Metric::Straight, paths(Cost::Hops, Start::Zero)] {
        let four = Filter::FourSpanning { within: 0.0 };
        let rows = kept(&mesh, &points, &recipe(metric.clone(), four)).unwrap();
        for row in rows {
            assert_eq!(row.len(), 4);
            assert!(row.iter().any(|entry| entry.0 == 60));
        }
        let near = Filter::FourSpanning { within: 2.0 };
        let rows = kept(&mesh, &points, &recipe(metric.clone(), near.clone())).unwrap();
        assert!(rows[0].len() > 4);
        let refusal = kept(&mesh, &points[..60], &recipe(metric, near)).unwrap_err();
        assert!(matches!(&refusal, MappingError::SpansNone { cells, .. } if cells.len() == 40));
    }
}
