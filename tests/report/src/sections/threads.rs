//! One thread and two, and interpolations of a million vertices.

use nalgebra::Vector3;
use sinew_engine::{
    Cost, Dimension, Filter, Geodesics, Mapping, Metric, MovingFit, Polynomial, RadialBasis,
    RadialFunction, Roots, Rule, Start, Weighting,
};
use sinew_mesh::shapes;

use crate::{
    fields::{TWIST, scattered},
    section::{Failure, Findings, Section, Table},
    sections::flood,
    timing::{Spread, one_and_two, time},
    worlds::{self, RIGID, build, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "threads",
    title: "One thread and two",
    measure,
};

/// 1,000,000 vertices.
const LARGE: usize = 99;
/// 103,823 vertices.
const MIDDLE: usize = 46;
/// For each work, s.
const BUDGET: f64 = 1.0;

const COLUMNS: [&str; 4] = ["what", "one thread, ms", "two threads, ms", "one over two"];

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "The same work on one thread and on two, by turns, by the clock: other programs count, and so does a machine of one \
         core. A weighted mean waits for the memory, of which one core takes nearly all; the others compute.",
    );
    let mut table = Table::new("A step", COLUMNS);
    let moving = Rule::MovingLeastSquares(MovingFit::Rigid);
    for (name, cubes, points, mapping) in [
        (
            "weighted mean of 8, 1,000,000 vertices",
            LARGE,
            40,
            worlds::mapping(Filter::KeepK(8), Rule::WeightedMean),
        ),
        (
            "rigid shape matching of 8, 1,000,000 vertices",
            LARGE,
            40,
            worlds::mapping(Filter::KeepK(8), RIGID),
        ),
        (
            "a whole fit of 8 for each of 103,823 vertices",
            MIDDLE,
            1000,
            worlds::mapping(Filter::KeepK(8), moving),
        ),
        (
            "RBF, Gaussian, 1,000 points, 103,823 vertices",
            MIDDLE,
            1000,
            interpolation(RadialFunction::Gaussian, 1000),
        ),
    ] {
        table.row(row(name, step(cubes, points, &mapping)?));
    }
    findings.table(table);
    let mut table = Table::new("Binding, 8 points, all kept", COLUMNS);
    let by_paths = flood::along(Dimension::Volume, Dimension::Face, Cost::Length);
    let geodesic = Weighting {
        metric: Metric::Geodesics(Geodesics {
            roots: Roots::Containing,
            start: Start::Distance,
        }),
        ..Weighting::default()
    };
    for (name, weighting) in [
        ("straight, 19,683 vertices", Weighting::default()),
        ("length, 105,456 volumes by faces", by_paths),
        ("geodesic, 19,683 vertices", geodesic),
    ] {
        let mapping = worlds::by(weighting, Filter::KeepK(8), Rule::WeightedMean);
        let rest = build(flood::tetrahedra(), &scattered(8), mapping.clone())?.rest();
        let times = one_and_two(BUDGET, &mut || drop(rest.bind(mapping.clone())));
        table.row(row(name, times));
    }
    findings.table(table);
    interpolations(&mut findings)?;
    Ok(findings)
}

/// Interpolations of a million vertices: a step's time, and what binding takes and keeps.
fn interpolations(findings: &mut Findings) -> Result<(), Failure> {
    let columns = [
        "points, function",
        "bind, ms",
        "system, MB",
        "one thread, ms",
        "two threads, ms",
        "ns per vertex and point",
    ];
    let mut table = Table::new("Radial basis functions, 1,000,000 vertices", columns);
    for points in [40, 1000] {
        for (name, function) in [
            ("cubic", RadialFunction::Cubic),
            ("Gaussian", RadialFunction::Gaussian),
        ] {
            let mapping = interpolation(function, points);
            let grid = shapes::hexahedra(LARGE, LARGE, LARGE);
            let rest = build(grid, &scattered(points), mapping.clone())?.rest();
            let bind = time(|| drop(rest.bind(mapping.clone())));
            drop(rest);
            let [one, two] = step(LARGE, points, &mapping)?;
            #[expect(clippy::cast_precision_loss, reason = "a thousand")]
            let rows = (points + 4) as f64;
            table.row([
                format!("{points}, {name}").into(),
                (1e3 * bind).into(),
                (8e-6 * rows * rows).into(),
                Spread::of(&one).times(1e3).into(),
                Spread::of(&two).times(1e3).into(),
                (1e3 * Spread::of(&one).median / (rows - 4.0)).into(),
            ]);
        }
    }
    findings.table(table);
    Ok(())
}

fn interpolation(function: RadialFunction, points: usize) -> Mapping {
    let rule = Rule::RadialBasis(RadialBasis {
        function,
        scale: None,
        polynomial: Polynomial::Linear,
    });
    worlds::mapping(Filter::KeepK(points), rule)
}

/// Seconds of a step on one thread and on two.
fn step(cubes: usize, points: usize, mapping: &Mapping) -> Result<[Vec<f64>; 2], Failure> {
    let rest: Vec<Vector3<f64>> = scattered(points);
    let now = moved(&rest, &TWIST);
    let grid = shapes::hexahedra(cubes, cubes, cubes);
    let mut world = build(grid, &rest, mapping.clone())?;
    Ok(one_and_two(BUDGET, &mut || {
        drop(move_to(&mut world, &now));
    }))
}

fn row(name: &str, [one, two]: [Vec<f64>; 2]) -> [crate::section::Cell; 4] {
    [
        name.into(),
        Spread::of(&one).times(1e3).into(),
        Spread::of(&two).times(1e3).into(),
        Spread::of_ratio(&one, &two).into(),
    ]
}
