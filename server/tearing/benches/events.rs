//! What events cost beside a plain step, which is a pose: `cargo bench -p sinew-tearing`.
//!
//! Boxes of 10k, 100k and 1M tetrahedra, 64 points to 1,000 cells, each vertex moved by the nearest eight or, where points are
//! separated, the nearest one. An event opens the faces of up to 100 cells around a vertex, or tears a frontier between two
//! points; both include the patch. Wall time, medians; the last column compares with a pose on the same threads. Before each
//! event the whole body is bound anew, out of the clock, so that events find cold caches.
//!
//! On two busy cores: opening 194 µs at 105k tetrahedra (1.5 poses, 5,200 events per second) and 416 µs at 1M, tearing between
//! points 610 µs (4.8 poses) and 7.5 ms: the areas are found by one look at every vertex.

#![allow(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]

use std::hint::black_box;
use std::time::Instant;

use nalgebra::Vector3;
use sinew_mapping::{Binding, Filter, Recipe, Reference, Rule, Weighting, bind};
use sinew_mesh::shapes;
use sinew_tearing::{Answer, Body, Outcome, Request, View};
use sinew_topology::{Edge, Vertex, Volume, Walk};

/// Cubes along an axis; six tetrahedra each.
const SIZES: [usize; 3] = [12, 26, 55];
const EVENTS: usize = 31;
/// An event touches no more cells.
const MOST: usize = 100;

/// Scattered evenly in the unit cube: the additive recurrence of the plastic number's powers.
fn scattered(n: usize) -> Vec<Vector3<f64>> {
    let step = Vector3::new(
        0.819_172_513_396_164,
        0.671_043_606_703_789,
        0.549_700_477_901_97,
    );
    (1..=n).map(|i| (step * i as f64).map(f64::fract)).collect()
}

fn bound(body: &Body, points: &[Vector3<f64>], kept: usize) -> Binding {
    let recipe = Recipe {
        weighting: Weighting::default(),
        filter: Filter::KeepK(kept),
        rule: Rule::WeightedMean,
        reference: Reference::Initial,
    };
    bind(body.rest(), points, &vec![true; points.len()], &recipe).unwrap()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}

fn timed<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = black_box(run());
    (value, start.elapsed().as_secs_f64())
}

/// The faces of a half of the cells around a vertex towards the others.
fn crack(body: &Body, vertex: usize, walk: &mut Walk) -> Option<Request> {
    let map = body.map();
    let vertex = map.cell_at::<Vertex>(vertex)?;
    let mut volumes: Vec<_> = map.incident::<Vertex, Volume>(vertex, walk).collect();
    volumes.sort_unstable();
    let (some, others) = volumes.split_at(volumes.len() / 2);
    let mut facets = Vec::new();
    for &one in some {
        let near = map.adjacent::<Volume, sinew_topology::Face>(one, walk);
        let near = near.filter(|other| others.contains(other));
        facets.extend(near.map(|other| [body.slot(one), body.slot(other)]));
    }
    (!facets.is_empty()).then_some(Request::Open { facets })
}

/// Pairs of points whose areas have an edge between them.
fn neighbours(body: &Body, binding: &Binding) -> Vec<Request> {
    let map = body.map();
    let owner = |vertex: sinew_topology::Cell<Vertex>| binding.dominant()[vertex.index()];
    let ends = map.cells::<Edge>().map(|edge| map.ends(edge).map(owner));
    let mut pairs: Vec<[u32; 2]> = ends.filter(|[a, b]| a < b).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let ask = |points| Request::Separate { points };
    pairs.into_iter().map(ask).collect()
}

fn touched(outcome: &Outcome) -> usize {
    outcome.patch.as_ref().map_or(0, |patch| patch.slots.len())
}

fn report(row: &str, cells: usize, times: Vec<f64>, touched: Vec<f64>, pose: f64) {
    let (events, time) = (times.len(), median(times));
    println!(
        "{cells:>8} {row:<10} {events:>3} events of {:>3.0} cells {:>9.1} us {:>8.0} per s {:>6.2} poses",
        median(touched),
        time * 1e6,
        time.recip(),
        time / pose
    );
}

fn main() {
    for cubes in SIZES {
        let mut body = Body::new(shapes::tetrahedra(cubes, cubes, cubes))
            .unwrap()
            .0;
        let cells = body.slot_count();
        let points = scattered(64 * cells / 1000);
        let now = body.rest().to_vec();
        let (mut eight, bind_time) = timed(|| bound(&body, &points, 8));
        let mut posed = now.clone();
        let pose = (0..EVENTS).map(|_| timed(|| eight.pose(&points, &mut posed).unwrap()).1);
        let pose = median(pose.collect());
        println!(
            "{cells:>8} pose {:>9.1} us, bind {:>9.1} us",
            pose * 1e6,
            bind_time * 1e6
        );

        let mut walk = Walk::default();
        let (mut times, mut sizes) = (Vec::new(), Vec::new());
        let mut torn = body.clone();
        for at in 0..EVENTS {
            let vertex = (2 * at + 1) * now.len() / (2 * EVENTS);
            let Some(request) = crack(&torn, vertex, &mut walk) else {
                continue;
            };
            // Every event finds the body bound; new vertices are not asked about.
            let binding = bound(&torn, &points[..1], 1);
            let now = torn.rest().to_vec();
            let view = View {
                binding: &binding,
                points: &points,
                now: &now,
            };
            let (outcome, time) = timed(|| torn.apply(&[request], &view));
            assert!(matches!(outcome.answers[0], Answer::Applied(_)));
            if touched(&outcome) <= MOST {
                times.push(time);
                sizes.push(touched(&outcome) as f64);
            }
        }
        report("open", cells, times, sizes, pose);

        let one = bound(&body, &points, 1);
        let view = View {
            binding: &one,
            points: &points,
            now: &now,
        };
        let asks = neighbours(&body, &one);
        let (mut times, mut sizes) = (Vec::new(), Vec::new());
        let mut torn = body.clone();
        for ask in asks.iter().step_by(asks.len().div_ceil(EVENTS)) {
            let one = bound(&torn, &points, 1);
            let now = torn.rest().to_vec();
            let view = View {
                binding: &one,
                points: &points,
                now: &now,
            };
            let (outcome, time) = timed(|| torn.apply(std::slice::from_ref(ask), &view));
            // Straight distances know of no tear: what was torn before may be in the way.
            if matches!(outcome.answers[0], Answer::Applied(_)) && touched(&outcome) <= MOST {
                times.push(time);
                sizes.push(touched(&outcome) as f64);
            }
        }
        report("separate", cells, times, sizes, pose);
        let (_, time) = timed(|| body.apply(&asks[..asks.len().min(1000)], &view));
        println!(
            "{cells:>8} {} pairs in one batch {:>9.1} ms",
            asks.len().min(1000),
            time * 1e3
        );
    }
}
