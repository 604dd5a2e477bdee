//! What the topology kernel costs, and what a scene that never changes its mesh pays for it.

use std::collections::BTreeMap;
use std::hint::black_box;

use sinew_engine::{Action, Filter, Limits, Measure, Rule, Scene, Strain, TopologyRule, World};
use sinew_mesh::{Grid, shapes};
use sinew_topology::{Adjacency, Face, Map, MeshCells, NonManifold, Volume, Walk};

use crate::{
    fields::{TWIST, scattered},
    peers::Peers,
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table, digits},
    timing::{Spread, by_turns, exponent, with_threads},
    worlds::{self, moved},
};

/// The kernel's own benchmark: one measurement, two tables.
#[path = "../../../../server/topology/benches/map/kernel.rs"]
#[expect(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]
mod kernel;
#[path = "../../../../server/topology/benches/map/peer.rs"]
#[expect(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]
mod peer;

pub(crate) const SECTION: Section = Section {
    name: "topology",
    title: "Topology",
    measure,
};

/// Cubes along each edge, six tetrahedra each: 10,368, 105,456 and 1,053,696 cells; and how often each is measured.
const SIZES: [(usize, usize); 3] = [(12, 7), (26, 5), (56, 3)];
/// Of each peer variant.
const PEER_ROUNDS: [usize; 3] = [3, 3, 1];
const POINTS: usize = 40;
/// s
const BUDGET: f64 = 1.5;
/// Section 5 of the paper: of a flood over 100,000 cells, 60 % of 3.5 s.
const PAPER_ADJACENCY: f64 = 0.6 * 3.5;

/// Figures by row and who was measured, one list for each size.
type Figures = BTreeMap<(String, &'static str), Vec<Vec<f64>>>;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "Maps of boxes of tetrahedra, on one thread, in processor time. The exponent p is that of time = c · cellsᵖ over all \
         sizes: 1 is linear. CGAL is its linear cell complex on the same meshes in the same run, with numbers on the points \
         alone (lean) or on all cells, as the map always has them (full); × is its time over ours at the largest size.",
    );
    let peer = match cgal() {
        Ok(peer) => Some(peer),
        Err(why) => {
            findings.text(why);
            None
        }
    };
    let mut figures = Figures::new();
    for (size, (cubes, rounds)) in SIZES.into_iter().enumerate() {
        let mesh = shapes::tetrahedra(cubes, cubes, cubes);
        with_threads(1, || measure_map(&mesh, size, rounds, &mut figures));
        if let Some(peer) = &peer {
            measure_peer(peer, &mesh, size, &mut figures);
        }
    }
    findings.plot(growth(&figures));
    findings.table(rows(&figures));
    findings.table(with_more_threads());
    findings.table(with_threads(1, adjacency));
    findings.table(with_threads(1, without_rules)?);
    Ok(findings)
}

fn cgal() -> Result<peer::Peer, String> {
    let program = Peers::find()?.folder().join("build/cgal_rows");
    match program.exists() {
        true => Ok(peer::Peer::new(program)),
        false => Err(format!(
            "CGAL was not measured: there is no {}, a program as the kernel’s benchmark (cargo bench -p sinew-topology) \
             describes it.",
            program.display()
        )),
    }
}

fn add(figures: &mut Figures, row: &str, who: &'static str, size: usize, figure: f64) {
    let sizes = figures.entry((row.to_owned(), who)).or_default();
    sizes.resize(SIZES.len(), Vec::new());
    sizes[size].push(figure);
}

fn measure_map(mesh: &Grid, size: usize, rounds: usize, figures: &mut Figures) {
    for _ in 0..rounds {
        kernel::measure(mesh, &mut |row, figure| {
            add(figures, row, "map", size, figure);
        });
    }
}

fn measure_peer(peer: &peer::Peer, mesh: &Grid, size: usize, figures: &mut Figures) {
    let input = peer.write(mesh);
    for _ in 0..PEER_ROUNDS[size] {
        peer.measure(&input, &mut |row, variant, figure| {
            add(figures, row, variant, size, figure);
        });
    }
}

/// What was measured of a row at each size.
fn spreads(figures: &Figures, row: &str, who: &'static str) -> Option<Vec<Spread>> {
    let sizes = figures.get(&(row.to_owned(), who))?;
    Some(sizes.iter().map(|figures| Spread::of(figures)).collect())
}

fn cells_of(cubes: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 cells")]
    let cells = 6.0 * cubes.pow(3) as f64;
    cells
}

/// Of figures per unit, hence the 1.
fn growth_of(spreads: &[Spread]) -> f64 {
    let sizes = SIZES.iter().map(|&(cubes, _)| cells_of(cubes));
    let points: Vec<_> = sizes.zip(spreads.iter().map(|of| of.median)).collect();
    1.0 + exponent(&points)
}

fn rows(figures: &Figures) -> Table {
    let sizes = SIZES.map(|(cubes, _)| format!("{} cells", 6 * cubes.pow(3)));
    let names = ["row", "unit"].map(str::to_owned).into_iter().chain(sizes);
    let more = ["p", "CGAL lean, ×", "CGAL full, ×"].map(str::to_owned);
    let mut table = Table::new("The map", names.chain(more));
    for (row, unit) in kernel::ROWS {
        let Some(ours) = spreads(figures, row, "map") else {
            continue;
        };
        let over = |who| match spreads(figures, row, who) {
            Some(theirs) => {
                Cell::from(theirs[SIZES.len() - 1].median / ours[SIZES.len() - 1].median)
            }
            None => "–".into(),
        };
        let of_row = [row.replace('_', " ").into(), unit.into()];
        let growth = [growth_of(&ours).into(), over("lean"), over("full")];
        let sizes = ours.iter().map(|&spread| Cell::from(spread));
        table.row(of_row.into_iter().chain(sizes).chain(growth));
    }
    table
}

fn growth(figures: &Figures) -> Plot {
    let shown = [
        ("build", Ink::Blue),
        ("orbit_vertex", Ink::Green),
        ("adjacency_vertex_random", Ink::Purple),
        ("resew3", Ink::Orange),
        ("cut", Ink::Vermilion),
    ];
    let series = shown.into_iter().filter_map(|(row, ink)| {
        let spreads = spreads(figures, row, "map")?;
        let unit = kernel::ROWS.iter().find(|(name, _)| *name == row)?.1;
        let point = |(&(cubes, _), spread): (&(usize, usize), &Spread)| Point {
            x: cells_of(cubes),
            y: spread.median,
            note: format!(
                "{} cells, {} {unit}",
                cells_of(cubes),
                digits(spread.median)
            ),
        };
        Some(Series {
            label: format!("{}, {unit}", row.replace('_', " ")),
            ink,
            points: SIZES.iter().zip(&spreads).map(point).collect(),
        })
    });
    Plot {
        name: "growth".to_owned(),
        title: "Cost per unit: level is linear".to_owned(),
        x: Axis::new("cells"),
        y: Axis::new("ns per unit, one thread"),
        series: series.collect(),
    }
}

fn cells(mesh: &Grid) -> MeshCells<'_> {
    MeshCells {
        vertices: mesh.positions.len(),
        types: &mesh.cells.types,
        connectivity: &mesh.cells.connectivity,
        offsets: &mesh.cells.offsets,
        faces: &mesh.cells.faces,
        face_offsets: &mesh.cells.face_offsets,
    }
}

/// A sound mesh is built in one pass over its cells, by one thread. One with cells inside out is surveyed first, on all.
fn with_more_threads() -> Table {
    let sound = shapes::tetrahedra(SIZES[1].0, SIZES[1].0, SIZES[1].0);
    let mut odd = sound.clone();
    for corners in odd.cells.connectivity.chunks_exact_mut(40) {
        corners.swap(0, 1);
    }
    let build = |mesh: &Grid, threads| {
        let mut work = || drop(black_box(Map::build(&cells(mesh), NonManifold::Refuse)));
        with_threads(threads, || {
            Spread::of(&by_turns(BUDGET, &mut [&mut work])[0])
        })
        .times(1e3)
    };
    let mut table = Table::new(
        "Building the map of 105,456 cells, ms of wall time",
        ["mesh", "1 thread", "2 threads"],
    );
    for (name, mesh) in [("as it is", &sound), ("every tenth cell inside out", &odd)] {
        table.row([name.into(), build(mesh, 1).into(), build(mesh, 2).into()]);
    }
    table
}

/// The retrieval that takes most of the paper's flood.
fn adjacency() -> Table {
    let mesh = shapes::tetrahedra(SIZES[1].0, SIZES[1].0, SIZES[1].0);
    let (map, _) = Map::build(&cells(&mesh), NonManifold::Refuse).expect("a sound mesh");
    let mut walk = Walk::default();
    let mut one_by_one = || {
        for volume in map.cells::<Volume>() {
            black_box(map.adjacent::<Volume, Face>(volume, &mut walk).count());
        }
    };
    let mut at_once = || drop(black_box(Adjacency::<Volume, Face>::new(&map)));
    let seconds = by_turns(BUDGET, &mut [&mut one_by_one, &mut at_once]);
    let mut table = Table::new(
        "Which of 105,456 volumes have a face in common, one thread, s",
        ["how", "paper", "ours", "paper over ours"],
    );
    for (how, seconds) in ["one by one, as asked", "all at once, as flat rows"]
        .into_iter()
        .zip(seconds)
    {
        let ours = Spread::of(&seconds);
        let ratio = PAPER_ADJACENCY / ours.median;
        table.row([
            how.into(),
            PAPER_ADJACENCY.into(),
            ours.into(),
            ratio.into(),
        ]);
    }
    table
}

/// The same scene without rules, with one that only reports, and with one that would open the mesh but never has to.
fn without_rules() -> Result<Table, Failure> {
    let rule = |action| TopologyRule {
        measure: Measure::Edges(Strain::Elongation),
        threshold: 1e3,
        hysteresis: 0.0,
        limits: Limits::default(),
        action,
    };
    let scenes = [
        ("no rule", Vec::new()),
        ("a rule that reports", vec![rule(Action::Report)]),
        ("a rule that opens", vec![rule(Action::Open)]),
    ];
    let mut table = Table::new(
        "A scene of 105,456 cells by its rules, one thread",
        [
            "scene",
            "map, bytes",
            "build, ms",
            "step, ms",
            "step over no rule",
        ],
    );
    let rest = scattered(POINTS);
    let now = moved(&rest, &TWIST);
    let grid = shapes::tetrahedra(SIZES[1].0, SIZES[1].0, SIZES[1].0);
    let mapping = worlds::mapping(Filter::KeepK(8), Rule::WeightedMean);
    let make = |rules: &Vec<TopologyRule>| {
        World::build(Scene {
            rules: rules.clone(),
            ..worlds::scene(grid.clone(), &rest, mapping.clone())
        })
    };
    let mut worlds = Vec::new();
    for (_, rules) in &scenes {
        worlds.push(make(rules)?);
    }
    let bytes: Vec<_> = worlds.iter().map(World::map_bytes).collect();
    let builds = scenes.iter().map(|(_, rules)| || drop(make(rules)));
    let builds = all_by_turns(builds);
    let steps = worlds
        .iter_mut()
        .map(|world| || drop(worlds::move_to(world, &now)));
    let steps = all_by_turns(steps);
    for (at, (name, _)) in scenes.iter().enumerate() {
        table.row([
            (*name).into(),
            bytes[at].to_string().into(),
            Spread::of(&builds[at]).times(1e3).into(),
            Spread::of(&steps[at]).times(1e3).into(),
            Spread::of_ratio(&steps[at], &steps[0]).into(),
        ]);
    }
    Ok(table)
}

fn all_by_turns(works: impl Iterator<Item = impl FnMut()>) -> Vec<Vec<f64>> {
    let mut works: Vec<_> = works.collect();
    let mut contenders: Vec<_> = works
        .iter_mut()
        .map(|work| work as &mut dyn FnMut())
        .collect();
    by_turns(BUDGET, &mut contenders)
}
