//! Time against the size of the mesh.

use nalgebra::Vector3;
use sinew_engine::{
    Filter, Mapping, Polynomial, RadialBasis, RadialFunction, Rule, SceneError, World,
};
use sinew_mesh::shapes;

use crate::{
    fields::{TWIST, scattered},
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table, digits},
    timing::{Spread, by_turns, exponent, with_threads},
    worlds::{self, RIGID, build, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "scaling",
    title: "Scaling",
    measure,
};

/// Cubes along each edge, six tetrahedra each: 10,368 to 998,250 cells.
const CUBES: [usize; 5] = [12, 18, 26, 38, 55];
const POINTS: usize = 40;
/// For each size and work, s.
const BUDGET: f64 = 1.0;

/// A mapping, as it is shown.
struct Contender {
    name: &'static str,
    ink: Ink,
    mapping: fn() -> Mapping,
}

const CONTENDERS: [Contender; 4] = [
    Contender {
        name: "weighted mean, 8",
        ink: Ink::Blue,
        mapping: || worlds::mapping(Filter::KeepK(8), Rule::WeightedMean),
    },
    Contender {
        name: "rigid shape matching, 8",
        ink: Ink::Green,
        mapping: || worlds::mapping(Filter::KeepK(8), RIGID),
    },
    Contender {
        name: "RBF cubic, 24",
        ink: Ink::Vermilion,
        mapping: || worlds::mapping(Filter::KeepK(24), CUBIC),
    },
    Contender {
        name: "RBF cubic, all 40",
        ink: Ink::Purple,
        mapping: || worlds::mapping(Filter::KeepK(POINTS), CUBIC),
    },
];

const CUBIC: Rule = Rule::RadialBasis(RadialBasis {
    function: RadialFunction::Cubic,
    scale: None,
    polynomial: Polynomial::Linear,
});

/// Seconds at one size.
struct Times {
    cells: f64,
    bind: Spread,
    step: Spread,
}

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "Boxes of 10,368 to 998,250 tetrahedra follow 40 points, on one thread. Binding happens once, a step every frame. \
         The exponent e is that of time = c · cellsᵉ, fitted to all sizes: 1 is proportional.",
    );
    let rest = scattered(POINTS);
    let mut binds = table("Binding, ms");
    let mut steps = table("A step, ms");
    let (mut bind_plot, mut step_plot) = (plot("bind", "Binding"), plot("step", "A step"));
    for contender in &CONTENDERS {
        let times = with_threads(1, || measure_sizes(contender, &rest))?;
        for (table, plot, of) in [
            (
                &mut binds,
                &mut bind_plot,
                (|t| t.bind) as fn(&Times) -> Spread,
            ),
            (&mut steps, &mut step_plot, |t| t.step),
        ] {
            let points: Vec<_> = times.iter().map(|t| (t.cells, of(t).median)).collect();
            let cells = times.iter().map(|t| Cell::from(of(t).times(1e3)));
            let fitted = Cell::from(exponent(&points));
            table.row(
                [contender.name.into()]
                    .into_iter()
                    .chain(cells)
                    .chain([fitted]),
            );
            plot.series.push(series(contender, &points));
        }
    }
    findings.plot(bind_plot);
    findings.plot(step_plot);
    findings.table(binds);
    findings.table(steps);
    Ok(findings)
}

fn measure_sizes(contender: &Contender, rest: &[Vector3<f64>]) -> Result<Vec<Times>, SceneError> {
    let now = moved(rest, &TWIST);
    let mut sizes = Vec::new();
    for cubes in CUBES {
        let grid = shapes::tetrahedra(cubes, cubes, cubes);
        let cells = grid.cells.len();
        let mut world: World = build(grid, rest, (contender.mapping)())?;
        let pose = world.rest();
        let mapping = (contender.mapping)();
        let mut bind = || drop(pose.bind(mapping.clone()));
        let bind = Spread::of(&by_turns(BUDGET, &mut [&mut bind])[0]);
        let mut step = || drop(move_to(&mut world, &now));
        let step = Spread::of(&by_turns(BUDGET, &mut [&mut step])[0]);
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 cells")]
        let cells = cells as f64;
        sizes.push(Times { cells, bind, step });
    }
    Ok(sizes)
}

fn table(title: &str) -> Table {
    let sizes = CUBES.map(|cubes| format!("{} cells", 6 * cubes.pow(3)));
    let names = ["mapping".to_owned()].into_iter().chain(sizes);
    Table::new(title, names.chain(["exponent".to_owned()]))
}

fn plot(name: &str, title: &str) -> Plot {
    Plot {
        name: name.to_owned(),
        title: format!("{title} against the size of the mesh"),
        x: Axis::new("cells"),
        y: Axis::new("time, ms, one thread"),
        series: Vec::new(),
    }
}

fn series(contender: &Contender, times: &[(f64, f64)]) -> Series {
    let point = |&(cells, seconds): &(f64, f64)| Point {
        x: cells,
        y: 1e3 * seconds,
        note: format!("{cells} cells, {} ms", digits(1e3 * seconds)),
    };
    Series {
        label: format!("{}: e = {}", contender.name, digits(exponent(times))),
        ink: contender.ink,
        points: times.iter().map(point).collect(),
    }
}
