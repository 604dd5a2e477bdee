//! Single stages against the independent reference: see `tests/data/README.md`.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector3;
use serde_json::Value;

use crate::clusters::{Clusters, cluster};
use crate::distance::{Distances, nearest, scaled};
use crate::filter::Surroundings;
use crate::shape::Shape;
use crate::{Dimension, Filter, Fit, Kernel, MappingError, barycentric, filter, weights};

fn cases(text: &str) -> Vec<Value> {
    let golden: Value = serde_json::from_str(text).unwrap();
    golden["cases"].as_array().unwrap().clone()
}

/// Rows nearest first from a matrix whose entries may be the string `inf`.
fn distances(matrix: &Value) -> Distances {
    let rows = matrix.as_array().unwrap();
    let mut distances = Distances {
        stride: rows[0].as_array().unwrap().len(),
        points: Vec::new(),
        squared: Vec::new(),
    };
    for row in rows {
        let row = row.as_array().unwrap().iter();
        let mut row: Vec<(f64, u32)> = row
            .map(|distance| distance.as_f64().unwrap_or(f64::INFINITY).powi(2))
            .zip(0..)
            .collect();
        row.sort_by(|a, b| a.partial_cmp(b).unwrap());
        distances.points.extend(row.iter().map(|entry| entry.1));
        distances.squared.extend(row.iter().map(|entry| entry.0));
    }
    distances
}

/// The points of each row that are in reach.
fn sets(distances: &Distances) -> Vec<Vec<u32>> {
    let rows = distances.points.chunks(distances.stride);
    rows.zip(distances.squared.chunks(distances.stride))
        .map(|(points, squared)| {
            let in_reach = points.iter().zip(squared).filter(|(_, d)| d.is_finite());
            in_reach.map(|(&point, _)| point).collect()
        })
        .collect()
}

#[test]
fn distances_agree_with_the_golden() {
    for case in cases(include_str!("../tests/data/C02_weights.json")) {
        let points: Vec<[f64; 3]> =
            serde_json::from_value(case["in"]["particles"].clone()).unwrap();
        let points: Vec<Vector3<f64>> = points.into_iter().map(Vector3::from).collect();
        let expected: Vec<Vec<f64>> = serde_json::from_value(case["out"]["W"].clone()).unwrap();
        let steps = [0.0, 0.5, 1.0];
        let vertices: Vec<Vector3<f64>> = (0..27)
            .map(|i| Vector3::new(steps[i / 9], steps[i / 3 % 3], steps[i % 3]))
            .collect();
        let found = nearest(&vertices, &points, &[0, 1, 2, 3], 9);
        assert_eq!((found.stride, found.points.len()), (4, 27 * 4));
        for (entry, (&point, squared)) in found.points.iter().zip(&found.squared).enumerate() {
            let expected = expected[entry / 4][point as usize];
            assert!((squared.sqrt() - expected).abs() < 1e-12);
        }
    }
}

const AROUND: Surroundings<'static> = Surroundings {
    targets: Dimension::Vertex,
    points: &[],
    holding: None,
};

/// The fifth vertex of the golden has no point in reach, and is named.
fn agrees(case: &Value, choice: Filter) -> Distances {
    let given = distances(&case["in"]["W"]);
    let kept = filter::select(given.clone(), &choice, &AROUND);
    assert_eq!(serde_json::json!(sets(&kept)), case["out"]["sets"]);
    let refusal = filter::filter(given, &choice, &AROUND).unwrap_err();
    let sets = case["out"]["sets"].as_array().unwrap();
    let empty = |&vertex: &usize| sets[vertex].as_array().unwrap().is_empty();
    let cells = (0..sets.len()).filter(empty).collect();
    let targets = Dimension::Vertex;
    assert_eq!(refusal, MappingError::KeepsNoneAt { targets, cells });
    kept
}

#[test]
fn filters_and_clusters_agree_with_the_golden() {
    let cases = cases(include_str!("../tests/data/C03_filters.json"));
    let [
        coefficients,
        minimum,
        keep,
        interval,
        at_least,
        four,
        clusters,
    ] = &cases[..]
    else {
        panic!("seven cases expected");
    };
    agrees(minimum, Filter::KeepK(1));
    let [nearest, farthest] = ["a", "b"].map(|bound| interval["in"][bound].as_f64().unwrap());
    agrees(interval, Filter::Interval { nearest, farthest });
    let within = at_least["in"]["b"].as_f64().unwrap();
    agrees(at_least, Filter::KeepAtLeast { k: 2, within });
    let points: Vec<[f64; 3]> = serde_json::from_value(four["in"]["particles"].clone()).unwrap();
    let points: Vec<Vector3<f64>> = points.into_iter().map(Vector3::from).collect();
    let expected: Vec<Vec<u32>> = serde_json::from_value(four["out"]["sets"].clone()).unwrap();
    for (set, expected) in sets(&distances(&four["in"]["W"])).iter().zip(expected) {
        let found = barycentric::four(set, &points);
        let expected: Option<[u32; 4]> = expected.try_into().ok(); // fewer than 4 span no volume
        assert_eq!(found, expected);
    }

    let fours = filter::select(
        distances(&four["in"]["W"]),
        &Filter::FourSpanning { within: 0.0 },
        &Surroundings {
            points: &points,
            ..AROUND
        },
    );
    let spanning: Vec<Vec<u32>> = serde_json::from_value(four["out"]["sets"].clone()).unwrap();
    for (found, mut expected) in sets(&fours).into_iter().zip(spanning) {
        if expected.len() < 4 {
            expected.clear(); // keeps none rather than too few
        }
        assert_eq!(found, expected);
    }

    let factors: Vec<f64> = serde_json::from_value(coefficients["in"]["coef"].clone()).unwrap();
    let scaled = scaled(distances(&coefficients["in"]["W"]), &factors);
    assert_eq!(scaled, distances(&coefficients["out"]["scaled"]));
    let kept = agrees(keep, Filter::KeepK(2));
    assert_eq!(clusters["in"]["sets"], keep["out"]["sets"]);

    let found = cluster(&kept);
    let mut by_set = BTreeMap::<String, Vec<u32>>::new();
    let names: Vec<String> = found
        .sets()
        .map(|set| set.iter().map(u32::to_string).collect::<Vec<_>>().join(","))
        .collect();
    for (vertex, &cluster) in (0..).zip(&found.of_vertex) {
        by_set
            .entry(names[cluster as usize].clone())
            .or_default()
            .push(vertex);
    }
    let expected: BTreeMap<String, Vec<u32>> =
        serde_json::from_value(clusters["out"]["clusters"].clone()).unwrap();
    assert_eq!(by_set, expected);
}

#[test]
fn weighted_fits_agree_with_the_golden() {
    let vectors = |value: &Value| -> Vec<Vector3<f64>> {
        let rows: Vec<[f64; 3]> = serde_json::from_value(value.clone()).unwrap();
        rows.into_iter().map(Vector3::from).collect()
    };
    let cases = cases(include_str!("../tests/data/C04_mappings.json"));
    let weighted: Vec<&Value> = (cases.iter())
        .filter(|case| case["in"]["w"].is_array())
        .collect();
    assert_eq!(weighted.len(), 3);
    for case in weighted {
        let (rest, now) = (vectors(&case["in"]["P0"]), vectors(&case["in"]["P1"]));
        let vertices = vectors(&case["in"]["X"]);
        let values: Vec<f64> = serde_json::from_value(case["in"]["w"].clone()).unwrap();
        let sum: f64 = values.iter().sum();
        let weights = weights::Weights {
            stride: rest.len(),
            points: (0..)
                .take(rest.len())
                .collect::<Vec<_>>()
                .repeat(vertices.len()),
            values: (values.iter().map(|w| w / sum).collect::<Vec<_>>()).repeat(vertices.len()),
        };
        let shared = Clusters {
            of_vertex: vec![0; vertices.len()],
            first: vec![0, rest.len()],
            members: (0..).take(rest.len()).collect(),
        };
        let shares = shared.means(&weights);
        for (clusters, shares) in [(shared, shares), Clusters::of_rows(&weights)] {
            let mut shape = Shape::new(&vertices, &rest, Arc::new(clusters), shares, Fit::Rigid);
            let mut posed = vec![Vector3::zeros(); vertices.len()];
            shape.pose(&now, &mut posed);
            for (x, expected) in posed.iter().zip(vectors(&case["out"]["X1"])) {
                assert!((x - expected).amax() < 1e-12, "{x} {expected}");
            }
        }
    }
}

#[test]
fn points_out_of_reach_have_no_weight_and_a_row_without_points_stays_zero() {
    let matrix = serde_json::json!([[0.5, "inf"], ["inf", "inf"]]);
    for kernel in [Kernel::Gaussian, Kernel::InverseSquare] {
        let weights = weights::normalise(distances(&matrix), kernel, 1.0);
        assert_eq!(weights.values, [1.0, 0.0, 0.0, 0.0]);
    }
}
