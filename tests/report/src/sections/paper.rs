//! The paper's own figures beside ours.

use sinew_engine::{Cost, Dimension, Filter, Rule};
use sinew_mesh::shapes;

use crate::{
    fields::scattered,
    section::{Cell, Failure, Findings, Section, Table},
    sections::flood,
    timing::{Spread, by_turns, with_threads},
    worlds::{self, build},
};

pub(crate) const SECTION: Section = Section {
    name: "paper",
    title: "The paper’s figures",
    measure,
};

/// Cubes along each edge: 103,823 vertices.
const CUBES: usize = 46;
/// As the paper has it.
const POINTS: usize = 8;
/// s
const BUDGET: f64 = 3.0;
/// Section 5 of the paper: geometrical distance, s.
const GEOMETRICAL: f64 = 0.2;
/// The same: topological distance, adjacency included, s.
const TOPOLOGICAL: f64 = 3.5;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "The paper (section 5) gives two times, for 100,000 topological cells and 8 particles, on one core of a desktop \
         computer of its day: part of any ratio is the machine. Ours is the whole binding: weights, filter and what is \
         compiled of them for the steps to come.",
    );
    let mut table = Table::new(
        "Geometrical mapping of 100,000 cells, 8 points, one thread",
        ["what", "paper, s", "ours, s", "paper over ours"],
    );
    let ours = with_threads(1, geometrical)?;
    table.row(row(
        "103,823 vertices by distance, all 8 kept",
        GEOMETRICAL,
        ours,
    ));
    let volumes = flood::along(Dimension::Volume, Dimension::Face, Cost::Length);
    let ours = with_threads(1, || flood::bind(&volumes, POINTS, POINTS))?;
    table.row(row(
        "105,456 volumes by flood, all 8 kept",
        TOPOLOGICAL,
        ours,
    ));
    findings.table(table);
    Ok(findings)
}

fn row(what: &str, paper: f64, ours: Spread) -> [Cell; 4] {
    [
        what.into(),
        paper.into(),
        ours.into(),
        (paper / ours.median).into(),
    ]
}

fn geometrical() -> Result<Spread, Failure> {
    let mapping = worlds::mapping(Filter::KeepK(POINTS), Rule::WeightedMean);
    let grid = shapes::hexahedra(CUBES, CUBES, CUBES);
    let rest = build(grid, &scattered(POINTS), mapping.clone())?.rest();
    let mut bind = || drop(rest.bind(mapping.clone()));
    Ok(Spread::of(&by_turns(BUDGET, &mut [&mut bind])[0]))
}
