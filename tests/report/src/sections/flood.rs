//! Weights along paths over the mesh, beside straight ones.

use sinew_engine::{Cost, Dimension, Filter, Metric, Paths, Roots, Rule, Start, Weighting};
use sinew_mesh::{Grid, shapes};

use crate::{
    fields::scattered,
    section::{Cell, Failure, Findings, Section, Table},
    timing::{Spread, by_turns, with_threads},
    worlds::{self, build},
};

pub(crate) const SECTION: Section = Section {
    name: "flood",
    title: "Floods",
    measure,
};

/// Cubes along each edge, six tetrahedra each: 105,456 cells, 19,683 vertices.
const CUBES: usize = 26;
/// For each variant, s.
const BUDGET: f64 = 1.5;

/// Weights along paths from the nearest target, targets joined by arcs.
pub(crate) fn along(targets: Dimension, arcs: Dimension, cost: Cost) -> Weighting {
    Weighting {
        metric: Metric::Paths(Paths {
            arcs,
            roots: Roots::Nearest,
            start: Start::Zero,
            cost,
        }),
        targets,
        ..Weighting::default()
    }
}

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "Binding the weighted mean of a box of 105,456 tetrahedra: weights, filter and operator, adjacency included, one \
         thread. A filter that keeps few points stops the floods early.",
    );
    let [vertices, edges, faces, volumes] = [
        Dimension::Vertex,
        Dimension::Edge,
        Dimension::Face,
        Dimension::Volume,
    ];
    let variants = [
        ("straight, vertices", Weighting::default()),
        (
            "hops, vertices by edges",
            along(vertices, edges, Cost::Hops),
        ),
        (
            "length, vertices by edges",
            along(vertices, edges, Cost::Length),
        ),
        (
            "length, vertices by volumes",
            along(vertices, volumes, Cost::Length),
        ),
        (
            "length, volumes by faces",
            along(volumes, faces, Cost::Length),
        ),
    ];
    let cases = [(8, 8), (100, 8), (100, 100)];
    let names = cases.map(|(points, kept)| format!("{points} points, keep {kept}, ms"));
    let mut table = Table::new("Binding", ["weights".to_owned()].into_iter().chain(names));
    for (name, weighting) in variants {
        let mut row = vec![Cell::from(name)];
        for (points, kept) in cases {
            let spread = with_threads(1, || bind(&weighting, points, kept))?;
            row.push(spread.times(1e3).into());
        }
        table.row(row);
    }
    findings.table(table);
    Ok(findings)
}

pub(crate) fn tetrahedra() -> Grid {
    shapes::tetrahedra(CUBES, CUBES, CUBES)
}

pub(crate) fn bind(weighting: &Weighting, points: usize, kept: usize) -> Result<Spread, Failure> {
    let mapping = worlds::by(weighting.clone(), Filter::KeepK(kept), Rule::WeightedMean);
    let rest = build(tetrahedra(), &scattered(points), mapping.clone())?.rest();
    let mut bind = || drop(rest.bind(mapping.clone()));
    Ok(Spread::of(&by_turns(BUDGET, &mut [&mut bind])[0]))
}
