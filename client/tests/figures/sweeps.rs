//! The figures of the paper on motion/geometry mapping, as sweeps through a server: each shows what it is said to show.

use nalgebra::Vector3;
use sinew_client::{
    Client,
    sweep::{Shot, Sweep, View},
};

use crate::{load, start};

/// A view's mesh and points at rest and at the end.
async fn ends(client: &Client, sweep: &Sweep, view: &View) -> [Shot; 2] {
    let mut shots = Vec::new();
    let run = sweep.run(client, view, sweep.frames, |shot| shots.push(shot));
    run.await.expect("a run");
    shots.try_into().expect("a shot at each end")
}

/// How far the vertex nearest to each moving point is, at the end, from where the point's own motion takes it, m: the
/// root of the mean square.
fn missed([rest, end]: &[Shot; 2]) -> f64 {
    let points = rest.points.iter().zip(&end.points);
    let squares: Vec<f64> = points
        .map(|(p0, p)| {
            let vertices = rest.grid.positions.iter().zip(&end.grid.positions);
            let away = |x0: &Vector3<f64>| (x0 - p0).norm_squared();
            let (x0, x) = vertices
                .min_by(|(a, _), (b, _)| away(a).total_cmp(&away(b)))
                .expect("a vertex");
            ((x - x0) - (p - p0)).norm_squared()
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// The greatest change of an edge's length over its length at rest.
fn stretch([rest, end]: &[Shot; 2]) -> f64 {
    let mut greatest: f64 = 0.0;
    for cell in rest.grid.cells.iter() {
        for (i, &a) in cell.vertices.iter().enumerate() {
            for &b in &cell.vertices[..i] {
                let length = |shot: &Shot| {
                    (shot.grid.positions[a as usize] - shot.grid.positions[b as usize]).norm()
                };
                greatest = greatest.max((length(end) / length(rest) - 1.0).abs());
            }
        }
    }
    greatest
}

#[tokio::test]
async fn figure_3_a_point_of_shorter_distances_wins_ground_and_one_of_longer_loses_it() {
    let (server, client) = start().await;
    let sweep = load("figure-3.toml");
    let [alike, half, double] = &sweep.views[..] else {
        panic!("{} views", sweep.views.len())
    };
    let [rest, _] = ends(&client, &sweep, alike).await;
    // Every fifth vertex tells as much.
    let all = u32::try_from(rest.grid.positions.len()).unwrap();
    let vertices: Vec<u32> = (0..all).step_by(5).collect();
    let strongest = async |view| sweep.strongest(&client, view, &vertices).await.unwrap();
    let (alike, half, double) = (
        strongest(alike).await,
        strongest(half).await,
        strongest(double).await,
    );
    for (i, &vertex) in vertices.iter().enumerate() {
        assert!(
            alike[i] != 2 || half[i] == 2,
            "vertex {vertex} is lost, though point 2 gained"
        );
        assert!(
            double[i] != 2 || alike[i] == 2,
            "vertex {vertex} is won, though point 2 lost"
        );
    }
    let ground = |of: &[u32]| of.iter().filter(|point| **point == 2).count();
    assert!(
        ground(&half) > ground(&alike) * 3 / 2,
        "{} {}",
        ground(&half),
        ground(&alike)
    );
    assert!(
        ground(&double) * 3 / 2 < ground(&alike),
        "{} {}",
        ground(&double),
        ground(&alike)
    );
    server.shutdown().await;
}

#[tokio::test]
async fn figure_7_interpolations_meet_the_points_and_means_the_less_the_more_they_keep() {
    let (server, client) = start().await;
    let mut sweep = load("figure-7.toml");
    assert_eq!((sweep.views.len(), sweep.columns), (6, 2));
    sweep.frames = 150;
    let mut errors = Vec::new();
    for view in &sweep.views {
        errors.push(missed(&ends(&client, &sweep, view).await));
    }
    let [gauss_10, gauss_24, spline_10, spline_24, mean_10, mean_24] = errors[..] else {
        unreachable!()
    };
    for interpolated in [gauss_10, gauss_24, spline_10, spline_24] {
        assert!(interpolated * 5.0 < mean_10, "{errors:?}");
    }
    assert!(mean_10 * 1.5 < mean_24, "{errors:?}");
    server.shutdown().await;
}

#[tokio::test]
async fn figure_8_the_spline_is_smoothest_and_the_clusters_break_the_surface() {
    let (server, client) = start().await;
    let mut sweep = load("figure-8.toml");
    sweep.frames = 150;
    let mut stretches = Vec::new();
    for view in &sweep.views {
        stretches.push(stretch(&ends(&client, &sweep, view).await));
    }
    let [spline, clusters, wrinkles] = stretches[..] else {
        panic!("{stretches:?}")
    };
    assert!(
        spline * 2.0 < clusters && spline * 2.0 < wrinkles,
        "{stretches:?}"
    );
    server.shutdown().await;
}
