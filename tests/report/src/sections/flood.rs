//! Weights along paths over the mesh, beside straight ones.

use nalgebra::Vector3;
use sinew_engine::{
    Cost, Dimension, Filter, Geodesics, Metric, Paths, Roots, Rule, Start, Weighting,
};
use sinew_mesh::{Grid, shapes};

use crate::{
    fields::scattered,
    peers::Peers,
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

/// Weights by the shortest way inside the mesh.
fn inside(targets: Dimension) -> Weighting {
    Weighting {
        metric: Metric::Geodesics(Geodesics {
            roots: Roots::Containing,
            start: Start::Distance,
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
        ("geodesic, vertices", inside(vertices)),
        ("geodesic, volumes", inside(volumes)),
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
    let beside = beside_peers(&mut findings);
    findings.peers(beside);
    Ok(findings)
}

/// The peers' meshes, in their order and in any, with the paths of 8 points.
fn beside_peers(findings: &mut Findings) -> Result<(), Failure> {
    let peers = match Peers::find() {
        Ok(peers) => peers,
        Err(absent) => {
            findings.text(absent);
            return Ok(());
        }
    };
    findings.text(
        "Beside other libraries: 8 sources on the same meshes, arcs by length, one thread. Theirs is the flood of a graph that \
         they are given; ours that of a mesh whose neighbours are known: costs of arcs, roots and floods. `perm` has vertices \
         and cells in random order.",
    );
    let tags = ["100k", "100k_perm", "1m", "1m_perm"];
    let only = [("PEERS", "scipy"), ("REPS", "2")];
    let figures = peers.python("1_flood/run8.py", &tags, &only)?;
    let columns = ["mesh, nodes", "who", "ms", "over ours"];
    let mut table = Table::new("Floods of 8 sources", columns);
    for tag in tags {
        let folder = format!("mesh_{tag}");
        let grid = peers.tetrahedra(&folder)?;
        let corners = peers.indices(&format!("{folder}/tets.i32"))?;
        let middle = |cell: u32| {
            let corners = &corners.as_chunks::<4>().0[cell as usize];
            let corners = corners.iter().map(|&v| grid.positions[v as usize]);
            corners.sum::<Vector3<f64>>() / 4.0
        };
        for (name, targets, arcs) in [
            ("prim", Dimension::Vertex, Dimension::Edge),
            ("dual", Dimension::Volume, Dimension::Face),
        ] {
            let seeds = peers.indices(&format!("{folder}/seeds_{name}8.i32"))?;
            let place = |&seed: &u32| match targets {
                Dimension::Volume => middle(seed),
                Dimension::Vertex | Dimension::Edge | Dimension::Face => {
                    grid.positions[seed as usize]
                }
            };
            let points: Vec<_> = seeds.iter().map(place).collect();
            let weighting = along(targets, arcs, Cost::Length);
            let ours = with_threads(1, || flood_grid(grid.clone(), &weighting, &points))?;
            let what = format!("{tag}, {name}");
            table.row([
                what.clone().into(),
                "Sinew".into(),
                ours.times(1e3).into(),
                "".into(),
            ]);
            let start = format!("{tag}/{name}/K8/");
            let all = figures
                .iter()
                .filter(|f| f.n.starts_with(&start) && f.item == "1_flood_all_euclid");
            for figure in all {
                table.row([
                    what.clone().into(),
                    format!("{} {}", figure.peer, figure.version).into(),
                    (1e3 * figure.seconds).into(),
                    (figure.seconds / ours.median).into(),
                ]);
            }
        }
    }
    findings.table(table);
    Ok(())
}

pub(crate) fn tetrahedra() -> Grid {
    shapes::tetrahedra(CUBES, CUBES, CUBES)
}

pub(crate) fn bind(weighting: &Weighting, points: usize, kept: usize) -> Result<Spread, Failure> {
    bind_grid(tetrahedra(), weighting, &scattered(points), kept)
}

/// All distances of a mesh whose neighbours are known.
fn flood_grid(
    grid: Grid,
    weighting: &Weighting,
    points: &[Vector3<f64>],
) -> Result<Spread, Failure> {
    let mapping = worlds::by(weighting.clone(), Filter::KeepK(8), Rule::WeightedMean);
    let straight = worlds::mapping(Filter::KeepK(8), Rule::WeightedMean);
    let rest = build(grid, points, straight)?.rest();
    let mut flood = || drop(rest.distances(&mapping));
    Ok(Spread::of(&by_turns(BUDGET, &mut [&mut flood])[0]))
}

fn bind_grid(
    grid: Grid,
    weighting: &Weighting,
    points: &[Vector3<f64>],
    kept: usize,
) -> Result<Spread, Failure> {
    let mapping = worlds::by(weighting.clone(), Filter::KeepK(kept), Rule::WeightedMean);
    let rest = build(grid, points, mapping.clone())?.rest();
    let mut bind = || drop(rest.bind(mapping.clone()));
    Ok(Spread::of(&by_turns(BUDGET, &mut [&mut bind])[0]))
}
