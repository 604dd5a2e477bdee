//! What double precision costs, and what single precision would lose.

use std::hint::black_box;

use sinew_engine::{Filter, Rule};
use sinew_mesh::shapes;

use crate::{
    fields::{TWIST, scattered},
    peers::{Peers, error_of},
    section::{Cell, Failure, Findings, Section, Table},
    timing::{Spread, by_turns, with_threads},
    worlds::{self, build, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "precision",
    title: "Single and double precision",
    measure,
};

/// 10⁶ vertices.
const CUBES: usize = 99;
const POINTS: usize = 40;
const KEPT: usize = 8;
/// s
const BUDGET: f64 = 10.0;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "The engine computes in f64 throughout and sends f32, or f64 where asked. The two loops are no part of it: they are \
         the weighted mean of the same points and weights written plainly in either precision, to show what an engine in \
         single precision could gain here, and what it would lose far from the origin. The triad (a = b + s c, as in STREAM) \
         moves as many bytes as the engine’s step: no loop over them is faster.",
    );
    findings.table(with_threads(1, times)?);
    let beside = beside_peers(&mut findings);
    findings.peers(beside);
    findings.table(with_threads(1, far)?);
    Ok(findings)
}

/// The weighted mean as rows of so many points and weights.
struct Loop<T> {
    points: Vec<[u32; KEPT]>,
    weights: Vec<[T; KEPT]>,
    rest: Vec<[T; 3]>,
    out: Vec<[T; 3]>,
}

impl<T> Loop<T>
where
    T: Copy + Default + std::ops::Mul<Output = T> + std::ops::AddAssign,
{
    fn run(&mut self, moves: &[[T; 3]]) {
        let rows = self.points.iter().zip(&self.weights).zip(&self.rest);
        for (((points, weights), rest), out) in rows.zip(&mut self.out) {
            let mut sum = *rest;
            for (&point, &weight) in points.iter().zip(weights) {
                let by = moves[point as usize];
                for axis in 0..3 {
                    sum[axis] += weight * by[axis];
                }
            }
            *out = sum;
        }
        black_box(&mut self.out);
    }
}

fn times() -> Result<Table, Failure> {
    let rest = scattered(POINTS);
    let now = moved(&rest, &TWIST);
    let mapping = worlds::mapping(Filter::KeepK(KEPT), Rule::WeightedMean);
    let mut world = build(shapes::hexahedra(CUBES, CUBES, CUBES), &rest, mapping)?;
    let start = world.frame();
    let mut double = Loop {
        points: Vec::new(),
        weights: Vec::new(),
        rest: start.vertices.iter().map(|&v| v.into()).collect(),
        out: vec![[0.0; 3]; start.vertices.len()],
    };
    for vertex in 0..start.vertices.len() {
        let why = world.explain(vertex).ok_or("no such vertex")?;
        let of = |i: usize| &why.influences[i];
        double.points.push(std::array::from_fn(|i| of(i).point));
        double.weights.push(std::array::from_fn(|i| of(i).weight));
    }
    let mut single = Loop {
        points: double.points.clone(),
        weights: double.weights.iter().map(|row| row.map(narrow)).collect(),
        rest: double.rest.iter().map(|row| row.map(narrow)).collect(),
        out: vec![[0.0; 3]; start.vertices.len()],
    };
    let moves: Vec<[f64; 3]> = now
        .iter()
        .zip(&rest)
        .map(|(p, p0)| (p - p0).into())
        .collect();
    let narrow_moves: Vec<[f32; 3]> = moves.iter().map(|by| by.map(narrow)).collect();
    // 8 weights of 8 bytes and indices of 4, and a position read and one written.
    let third = (KEPT * 12 + 48) * start.vertices.len() / 24;
    let mut triad = [vec![0.0; third], vec![1.0; third], vec![2.0; third]];
    let seconds = by_turns(
        BUDGET,
        &mut [
            &mut || drop(move_to(&mut world, &now)),
            &mut || double.run(&moves),
            &mut || single.run(&narrow_moves),
            &mut || {
                let [a, b, c] = &mut triad;
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = *b + black_box(0.5) * *c;
                }
            },
        ],
    );
    let truth = &world.frame().vertices;
    let rows = [
        ("the engine’s step, f64", 0.0),
        ("a plain loop, f64", worst(truth, &double.out)),
        ("a plain loop, f32", worst(truth, &widened(&single.out))),
        ("triad", 0.0),
    ];
    let title = "Weighted mean, 1,000,000 vertices, 8 points each, one thread";
    let columns = [
        "",
        "ns per vertex",
        "over the f64 loop",
        "largest difference, m",
    ];
    let mut table = Table::new(title, columns);
    for ((name, error), times) in rows.into_iter().zip(&seconds) {
        table.row([
            name.into(),
            Spread::of(times).times(1e9 / 1e6).into(),
            Spread::of_ratio(times, &seconds[1]).into(),
            error.into(),
        ]);
    }
    Ok(table)
}

/// Sparse matrices and compiled loops of others on as many vertices and points per vertex.
fn beside_peers(findings: &mut Findings) -> Result<(), Failure> {
    let peers = match Peers::find() {
        Ok(peers) => peers,
        Err(absent) => {
            findings.text(absent);
            return Ok(());
        }
    };
    let figures = peers.python("4_blend/run.py", &[], &[("TH", "1")])?;
    let columns = [
        "points, precision",
        "who",
        "ns per vertex",
        "largest error, m",
    ];
    let mut table = Table::new("The same sizes by others, just after, one thread", columns);
    for figure in figures {
        let error = error_of(&figure, "max_abs").map_or("not told".into(), Cell::from);
        table.row([
            figure.n.into(),
            format!("{} {}", figure.peer, figure.version).into(),
            (1e3 * figure.seconds).into(),
            error,
        ]);
    }
    findings.table(table);
    Ok(())
}

/// How far f32 is from f64 on a mesh of 1 m that stands elsewhere.
fn far() -> Result<Table, Failure> {
    let mut table = Table::new(
        "A mesh of 1 m far from the origin: the largest error of positions held as f32",
        ["distance from the origin, m", "error, m"],
    );
    for distance in [0.0, 10.0, 1e3, 1e5] {
        let away = nalgebra::Vector3::repeat(distance);
        let rest: Vec<_> = scattered(POINTS).iter().map(|p| p + away).collect();
        let mut grid = shapes::hexahedra(19, 19, 19);
        for position in &mut grid.positions {
            *position += away;
        }
        let mapping = worlds::mapping(Filter::KeepK(KEPT), Rule::WeightedMean);
        let mut world = build(grid, &rest, mapping)?;
        let now: Vec<_> = rest
            .iter()
            .map(|p| p + nalgebra::Vector3::new(0.1, 0.2, 0.3))
            .collect();
        let exact = &move_to(&mut world, &now).vertices;
        let rounded: Vec<[f32; 3]> = exact
            .iter()
            .map(|v| <[f64; 3]>::from(*v).map(narrow))
            .collect();
        table.row([
            Cell::from(distance),
            worst(exact, &widened(&rounded)).into(),
        ]);
    }
    Ok(table)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding is what is measured"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}

fn widened(positions: &[[f32; 3]]) -> Vec<[f64; 3]> {
    positions.iter().map(|p| p.map(f64::from)).collect()
}

/// The largest difference of a coordinate, m.
fn worst(exact: &[nalgebra::Vector3<f64>], other: &[[f64; 3]]) -> f64 {
    let pairs = exact
        .iter()
        .flat_map(|v| v.iter())
        .zip(other.iter().flatten());
    pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
