//! How far distances along a mesh are from the true ones, and what they cost.

use nalgebra::Vector3;
use sinew_engine::{
    Cost, Dimension, Filter, Geodesics, Mapping, Metric, Paths, Roots, Rule, Start, Weighting,
};
use sinew_mesh::{Cell as MeshCell, Grid, shapes};

use crate::{
    fields::scattered,
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table, digits},
    timing::{Spread, by_turns, with_threads},
    worlds::{self, build},
};

pub(crate) const SECTION: Section = Section {
    name: "ways",
    title: "Distances along a mesh against true ones",
    measure,
};

/// Cubes along each edge, a multiple of 3: 82,944 tetrahedra.
const CUBES: usize = 24;
const POINTS: usize = 8;
/// For each kind and body, s.
const BUDGET: f64 = 0.5;
/// Relative errors below are drawn at this.
const FLOOR: f64 = 1e-5;
const THIRD: f64 = 1.0 / 3.0;

/// A kind of distance.
struct Kind {
    name: &'static str,
    ink: Ink,
    targets: Dimension,
    metric: fn() -> Metric,
}

const KINDS: [Kind; 6] = [
    Kind {
        name: "straight, vertices",
        ink: Ink::Grey,
        targets: Dimension::Vertex,
        metric: || Metric::Straight,
    },
    Kind {
        name: "length, vertices by edges",
        ink: Ink::Orange,
        targets: Dimension::Vertex,
        metric: || lengths(Dimension::Edge),
    },
    Kind {
        name: "length, vertices by volumes",
        ink: Ink::Vermilion,
        targets: Dimension::Vertex,
        metric: || lengths(Dimension::Volume),
    },
    Kind {
        name: "length, volumes by faces",
        ink: Ink::Purple,
        targets: Dimension::Volume,
        metric: || lengths(Dimension::Face),
    },
    Kind {
        name: "geodesic, vertices",
        ink: Ink::Blue,
        targets: Dimension::Vertex,
        metric: geodesics,
    },
    Kind {
        name: "geodesic, volumes",
        ink: Ink::Green,
        targets: Dimension::Volume,
        metric: geodesics,
    },
];

/// All start alike: at the vertices or cells of the volume that holds the point, as far from it as they are.
fn lengths(arcs: Dimension) -> Metric {
    Metric::Paths(Paths {
        arcs,
        roots: Roots::Containing,
        start: Start::Distance,
        cost: Cost::Length,
    })
}

fn geodesics() -> Metric {
    Metric::Geodesics(Geodesics {
        roots: Roots::Containing,
        start: Start::Distance,
    })
}

/// A body whose geodesics are known.
struct Body {
    name: &'static str,
    grid: fn() -> Grid,
    points: fn() -> Vec<Vector3<f64>>,
    truth: fn(&Vector3<f64>, &Vector3<f64>) -> f64,
}

const BODIES: [Body; 4] = [
    Body {
        name: "box, tetrahedra",
        grid: || shapes::tetrahedra(CUBES, CUBES, CUBES),
        points: || scattered(POINTS),
        truth: |a, b| (a - b).norm(),
    },
    Body {
        name: "box, hexahedra",
        grid: || shapes::hexahedra(CUBES, CUBES, CUBES),
        points: || scattered(POINTS),
        truth: |a, b| (a - b).norm(),
    },
    Body {
        name: "U, tetrahedra",
        grid: || u_of(&shapes::tetrahedra(CUBES, CUBES, CUBES)),
        points: in_one_arm,
        truth: in_a_u,
    },
    Body {
        name: "U, hexahedra",
        grid: || u_of(&shapes::hexahedra(CUBES, CUBES, CUBES)),
        points: in_one_arm,
        truth: in_a_u,
    },
];

/// A unit cube without its middle third along x, but for the first third along y.
fn u_of(cube: &Grid) -> Grid {
    let centre = |cell: &MeshCell<'_>| {
        let corners = cell.vertices.iter().map(|&v| cube.positions[v as usize]);
        #[expect(clippy::cast_precision_loss, reason = "a few corners")]
        let count = cell.vertices.len() as f64;
        corners.sum::<Vector3<f64>>() / count
    };
    let mut grid = Grid::default();
    let mut numbers = vec![None; cube.positions.len()];
    for cell in cube.cells.iter() {
        let at = centre(&cell);
        if (THIRD..1.0 - THIRD).contains(&at.x) && at.y > THIRD {
            continue;
        }
        let mut number = |&old: &u32| {
            *numbers[old as usize].get_or_insert_with(|| {
                grid.positions.push(cube.positions[old as usize]);
                u32::try_from(grid.positions.len() - 1).expect("fewer than the cube has")
            })
        };
        let vertices: Vec<u32> = cell.vertices.iter().map(&mut number).collect();
        grid.cells.push(MeshCell {
            vertices: &vertices,
            ..cell
        });
    }
    grid
}

fn in_one_arm() -> Vec<Vector3<f64>> {
    let into = |x: &Vector3<f64>| Vector3::new(0.9 * THIRD * x.x, x.y, x.z);
    scattered(POINTS).iter().map(into).collect()
}

/// The shortest way in the U: in the plane of x and y round one or both inner corners, along z straight.
fn in_a_u(from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let flat = |x: &Vector3<f64>| Vector3::new(x.x, x.y, 0.0);
    let corners = [THIRD, 1.0 - THIRD].map(|x| Vector3::new(x, THIRD, 0.0));
    let is_inside = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let (a, b) = if a.x < b.x { (a, b) } else { (b, a) };
        let (low, high) = (a.x.max(THIRD), b.x.min(1.0 - THIRD));
        let y = |x: f64| a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x);
        low >= high - 1e-9 || y(low).max(y(high)) <= THIRD + 1e-9
    };
    let ways = [&[][..], &corners[..1], &corners[1..], &corners];
    let lengths = ways.iter().map(|way| {
        let stops = [&[flat(from)], *way, &[flat(to)]].concat();
        let legs = stops.windows(2).map(|leg| {
            if is_inside(&leg[0], &leg[1]) {
                (leg[1] - leg[0]).norm()
            } else {
                f64::INFINITY
            }
        });
        legs.sum::<f64>()
    });
    let flat = lengths.fold(f64::INFINITY, f64::min);
    flat.hypot(to.z - from.z)
}

/// What a kind of distance costs in a body, and how wrong it is.
struct Outcome {
    /// ms
    time: Spread,
    /// For each target and point, ns.
    each: f64,
    /// Relative.
    mean: f64,
    max: f64,
}

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "Distances of 8 points from all vertices or all volumes of a unit cube, and of a U cut from it, whose shortest ways are \
         known: straight ones, and ones round its inner corners. Errors are relative to the true distance, from two cells on. \
         The time is that of all distances, neighbours being known, on one thread. Paths along arcs do not converge to the \
         truth however fine the mesh, and depend on how its diagonals run. Geodesics (`weighting.flood.geodesic`) do, for 15 \
         to 35 times the time of a flood along edges; they pay where a mesh bends, is cut or is uneven. Where it is convex and \
         whole, straight distances are the truth and the cheapest.",
    );
    let mut tables = Vec::new();
    let mut series: Vec<Series> = (KINDS.iter())
        .map(|kind| Series {
            label: kind.name.to_owned(),
            points: Vec::new(),
            ink: kind.ink,
        })
        .collect();
    for body in BODIES {
        let columns = [
            "distance",
            "mean error, %",
            "largest error, %",
            "all, ms",
            "each, ns",
        ];
        let mut table = Table::new(format!("{}, 8 points", body.name), columns);
        for (kind, series) in KINDS.iter().zip(&mut series) {
            let found = with_threads(1, || outcome(&body, kind))?;
            table.row([
                kind.name.into(),
                Cell::from(100.0 * found.mean),
                (100.0 * found.max).into(),
                found.time.into(),
                found.each.into(),
            ]);
            series.points.push(Point {
                x: found.each,
                y: found.mean.max(FLOOR),
                note: format!(
                    "{}: {} ns for each target and point, mean error {} %",
                    body.name,
                    digits(found.each),
                    digits(100.0 * found.mean)
                ),
            });
        }
        tables.push(table);
    }
    findings.plot(Plot {
        name: "errors".to_owned(),
        title: "Error of distances against their time, four bodies".to_owned(),
        x: Axis::new("time for each target and point, ns, one thread"),
        y: Axis::new("mean relative error").with_floor(FLOOR),
        series,
    });
    for table in tables {
        findings.table(table);
    }
    Ok(findings)
}

fn outcome(body: &Body, kind: &Kind) -> Result<Outcome, Failure> {
    let points = (body.points)();
    let grid = (body.grid)();
    let weighting = Weighting {
        metric: (kind.metric)(),
        targets: kind.targets,
        ..Weighting::default()
    };
    let mapping: Mapping = worlds::by(weighting, Filter::KeepK(POINTS), Rule::WeightedMean);
    let places = targets(&grid, kind.targets);
    let straight = worlds::mapping(Filter::KeepK(POINTS), Rule::WeightedMean);
    let rest = build(grid, &points, straight)?.rest();
    let found = rest.distances(&mapping)?;
    let mut times = || drop(rest.distances(&mapping));
    let time = Spread::of(&by_turns(BUDGET, &mut [&mut times])[0]);
    let (mut sum, mut count, mut max) = (0.0, 0.0, 0.0_f64);
    #[expect(clippy::cast_precision_loss, reason = "24")]
    let near = 2.0 / CUBES as f64;
    for (target, place) in places.iter().enumerate() {
        for (point, distance) in found.row(target) {
            let truth = (body.truth)(&points[point as usize], place);
            if truth > near {
                let error = (distance / truth - 1.0).abs();
                (sum, count, max) = (sum + error, count + 1.0, max.max(error));
            }
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
    let pairs = (places.len() * POINTS) as f64;
    Ok(Outcome {
        time: time.times(1e3),
        each: 1e9 * time.median / pairs,
        mean: sum / count,
        max,
    })
}

/// Where the targets are, m.
fn targets(grid: &Grid, dimension: Dimension) -> Vec<Vector3<f64>> {
    match dimension {
        Dimension::Volume => {
            let centre = |cell: MeshCell<'_>| {
                let corners = cell.vertices.iter().map(|&v| grid.positions[v as usize]);
                #[expect(clippy::cast_precision_loss, reason = "a few corners")]
                let count = cell.vertices.len() as f64;
                corners.sum::<Vector3<f64>>() / count
            };
            grid.cells.iter().map(centre).collect()
        }
        Dimension::Vertex | Dimension::Edge | Dimension::Face => grid.positions.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_in_the_u_are_straight_in_an_arm_and_bend_round_the_corners() {
        let at = |x, y| Vector3::new(x, y, 0.5);
        assert!((in_a_u(&at(0.1, 0.2), &at(0.9, 0.3)) - 0.8_f64.hypot(0.1)).abs() < 1e-12);
        let across = in_a_u(&at(THIRD, 0.9), &at(1.0 - THIRD, 0.9));
        assert!((across - (2.0 * (0.9 - THIRD) + THIRD)).abs() < 1e-12);
    }
}
