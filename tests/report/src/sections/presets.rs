//! The methods of the literature, as the paper's table 1 has them.

use sinew_engine::{Mapping, Preset};
use sinew_mesh::shapes;

use crate::{
    fields::{BEND, Field, Gap, TWIST, scattered},
    section::{Cell, Failure, Findings, Section, Table},
    timing::{Spread, by_turns, time, with_threads},
    worlds::{build, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "presets",
    title: "Methods of the literature",
    measure,
};

/// Cubes along each edge: 29,791 vertices.
const CUBES: usize = 30;
const POINTS: usize = 40;
/// For each preset, s.
const BUDGET: f64 = 1.0;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "The rows of the paper’s table 1, each a preset: 29,791 vertices of a unit cube that follow 40 points, one thread. \
         Errors are rms, in edges of the cube. What is refused is said with the reason: MHTG05 asks for points in the volumes \
         around each vertex, as coarse meshes have.",
    );
    let columns = [
        "preset",
        "bind, ms",
        "ns per vertex and step",
        "bend",
        "twist",
    ];
    let mut table = Table::new("Presets, 40 points", columns);
    for preset in Preset::ALL {
        table.row(with_threads(1, || row(preset)));
    }
    findings.table(table);
    Ok(findings)
}

fn row(preset: Preset) -> [Cell; 5] {
    let rest = scattered(POINTS);
    let mapping = Mapping {
        recipe: preset.recipe(),
        points: Vec::new(),
    };
    let grid = shapes::hexahedra(CUBES, CUBES, CUBES);
    let name = Cell::from(format!("{preset:?}").to_uppercase());
    let mut world = match build(grid, &rest, mapping.clone()) {
        Ok(world) => world,
        Err(refusal) => {
            return [
                name,
                refusal.to_string().into(),
                "".into(),
                "".into(),
                "".into(),
            ];
        }
    };
    let start = world.frame();
    let pose = world.rest();
    let mut gap = |field: &Field| {
        let frame = move_to(&mut world, &moved(&rest, field));
        Gap::between(&frame.vertices, &moved(&start.vertices, field)).rms
    };
    let (bend, twist) = (gap(&BEND), gap(&TWIST));
    let bind = time(|| drop(pose.bind(mapping)));
    let now = moved(&rest, &TWIST);
    let mut step = || drop(move_to(&mut world, &now));
    let step = Spread::of(&by_turns(BUDGET, &mut [&mut step])[0]);
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 vertices")]
    let per_vertex = step.times(1e9 / start.vertices.len() as f64);
    [
        name,
        (1e3 * bind).into(),
        per_vertex.into(),
        bend.into(),
        twist.into(),
    ]
}
