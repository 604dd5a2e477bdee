//! Single stages against the independent reference: see `tests/data/README.md`.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde_json::Value;

use crate::clusters::cluster;
use crate::distance::{Distances, nearest};
use crate::filter::filter;
use crate::{Filter, Kernel, weights};

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
            .map(|weight| weight.as_f64().unwrap_or(f64::INFINITY))
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

#[test]
fn keep_k_and_clusters_agree_with_the_golden() {
    let cases = cases(include_str!("../tests/data/C03_filters.json"));
    let [keep, clusters] = &cases[..] else {
        panic!("two cases expected");
    };
    let kept = filter(distances(&keep["in"]["W"]), Filter::KeepK(2));
    let expected: Vec<Vec<u32>> = serde_json::from_value(keep["out"]["sets"].clone()).unwrap();
    assert_eq!(sets(&kept), expected);
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
fn points_out_of_reach_have_no_weight_and_a_row_without_points_stays_zero() {
    let matrix = serde_json::json!([[0.5, "inf"], ["inf", "inf"]]);
    for kernel in [Kernel::Gaussian, Kernel::InverseSquare] {
        let weights = weights::normalise(distances(&matrix), kernel, 1.0);
        assert_eq!(weights.values, [1.0, 0.0, 0.0, 0.0]);
    }
}
