//! Every motion mapping: time per vertex against error.

use sinew_engine::{
    Filter, Frame, Mapping, MovingFit, Polynomial, RadialBasis, RadialFunction, Rule, SceneError,
    World,
};
use sinew_mesh::shapes;

use crate::{
    fields::{self, Field, Gap, scattered},
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table},
    timing::{Spread, by_turns, with_threads},
    worlds::{self, LINEAR, QUADRATIC, RIGID, build, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "mapping",
    title: "Motion mappings",
    measure,
};

/// Points that drive the cube.
const POINTS: [usize; 3] = [8, 40, 200];
/// Cubes along each edge: 8,000 vertices to compare errors with those of NUMERICS C.3.
const FINE_ENOUGH: usize = 19;
/// The same to measure time: 50,653 vertices, so that operators leave the caches.
const LARGE: usize = 36;
/// For all rules of a row of [`POINTS`], s.
const BUDGET: f64 = 12.0;
/// Rounding, m: errors below are exact.
const EXACT: f64 = 1e-14;

/// A rule at work in the plots.
struct Contender {
    name: &'static str,
    ink: Ink,
    /// Of as many points as there are.
    mapping: fn(usize) -> Mapping,
}

const CONTENDERS: [Contender; 16] = [
    contender("direct", Ink::Grey, |_| {
        worlds::mapping(Filter::KeepK(1), Rule::Direct)
    }),
    contender("mean of 8", Ink::Grey, |_| {
        worlds::mapping(Filter::KeepK(8), Rule::Mean)
    }),
    contender("mean of all", Ink::Grey, |n| {
        worlds::mapping(Filter::KeepK(n), Rule::Mean)
    }),
    contender("weighted, 8", Ink::Blue, |_| {
        worlds::mapping(Filter::KeepK(8), Rule::WeightedMean)
    }),
    contender("weighted, all", Ink::Blue, |n| {
        let weighting = worlds::gaussian(Some(spacing(n) / 2.0));
        worlds::by(weighting, Filter::KeepK(n), Rule::WeightedMean)
    }),
    contender("barycentric", Ink::Blue, |_| {
        worlds::mapping(Filter::KeepK(32), Rule::Barycentric)
    }),
    contender("rigid, 10", Ink::Green, |_| {
        worlds::mapping(Filter::KeepK(10), RIGID)
    }),
    contender("rigid, 24", Ink::Green, |_| {
        worlds::mapping(Filter::KeepK(24), RIGID)
    }),
    contender("linear, 10", Ink::Green, |_| {
        worlds::mapping(Filter::KeepK(10), LINEAR)
    }),
    contender("quadratic, all", Ink::Green, |n| {
        worlds::mapping(Filter::KeepK(n), QUADRATIC)
    }),
    contender("MLS affine, 10", Ink::Orange, |_| {
        let rule = Rule::MovingLeastSquares(MovingFit::Affine);
        worlds::mapping(Filter::KeepK(10), rule)
    }),
    contender("MLS rigid, 10", Ink::Orange, |_| {
        let rule = Rule::MovingLeastSquares(MovingFit::Rigid);
        worlds::mapping(Filter::KeepK(10), rule)
    }),
    contender("RBF Gaussian", Ink::Purple, |n| {
        worlds::mapping(Filter::KeepK(n), basis(RadialFunction::Gaussian, n))
    }),
    contender("RBF multiquadric", Ink::Purple, |n| {
        worlds::mapping(Filter::KeepK(n), basis(RadialFunction::Multiquadric, n))
    }),
    contender("RBF cubic", Ink::Vermilion, |n| {
        worlds::mapping(Filter::KeepK(n), basis(RadialFunction::Cubic, n))
    }),
    contender("RBF cubic, 24", Ink::Vermilion, |n| {
        worlds::mapping(Filter::KeepK(24), basis(RadialFunction::Cubic, n))
    }),
];

const fn contender(name: &'static str, ink: Ink, mapping: fn(usize) -> Mapping) -> Contender {
    Contender { name, ink, mapping }
}

fn basis(function: RadialFunction, points: usize) -> Rule {
    Rule::RadialBasis(RadialBasis {
        function,
        scale: Some(spacing(points)),
        polynomial: Polynomial::Linear,
    })
}

/// How far points are apart, m, as NUMERICS C.3 takes it.
#[expect(clippy::cast_precision_loss, reason = "a few points")]
fn spacing(points: usize) -> f64 {
    1.2 / (points as f64).cbrt()
}

/// What a contender costs and how far it is from each field.
struct Outcome {
    points: usize,
    /// ns
    per_vertex: Spread,
    gaps: Vec<Gap>,
}

fn measure() -> Result<Findings, Failure> {
    let mut outcomes: Vec<Vec<Outcome>> = CONTENDERS.iter().map(|_| Vec::new()).collect();
    let mut findings = Findings::default();
    findings.text(
        "A unit cube follows points scattered evenly in it. The time is that of a whole step of the engine, on one thread; \
         the error is the distance of the cube’s vertices from where the field takes them, the edge of the cube being 1. \
         Each line runs from 8 over 40 to 200 points, its name beside the 200.",
    );
    for points in POINTS {
        for (contender, outcome) in with_threads(1, || measure_all(points))? {
            outcomes[contender].push(outcome);
        }
    }
    for (index, field) in fields::ALL.iter().enumerate() {
        findings.plot(plot(field, "rms", &outcomes, |outcome| {
            outcome.gaps[index].rms
        }));
        findings.plot(plot(field, "max", &outcomes, |outcome| {
            outcome.gaps[index].max
        }));
    }
    for points in POINTS {
        findings.table(table(points, &outcomes));
    }
    Ok(findings)
}

/// Outcomes by the index of their contender.
fn measure_all(points: usize) -> Result<Vec<(usize, Outcome)>, SceneError> {
    let rest = scattered(points);
    let turned = moved(&rest, &fields::TWIST);
    let mut worlds = Vec::new();
    for contender in &CONTENDERS {
        let large = shapes::hexahedra(LARGE, LARGE, LARGE);
        worlds.push(build(large, &rest, (contender.mapping)(points))?);
    }
    let vertices = worlds[0].frame().vertices.len();
    let mut steps: Vec<_> = worlds
        .iter_mut()
        .map(|world| || drop(move_to(world, &turned)))
        .collect();
    let mut turns: Vec<&mut dyn FnMut()> = Vec::new();
    for step in &mut steps {
        turns.push(step);
    }
    let seconds = by_turns(BUDGET, &mut turns);
    let mut outcomes = Vec::new();
    for (index, contender) in CONTENDERS.iter().enumerate() {
        let grid = shapes::hexahedra(FINE_ENOUGH, FINE_ENOUGH, FINE_ENOUGH);
        let mut world = build(grid, &rest, (contender.mapping)(points))?;
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 vertices")]
        let per_vertex = Spread::of(&seconds[index]).times(1e9 / vertices as f64);
        let rest = world.frame();
        let gap = |field| gap(&mut world, &rest, field);
        let gaps = fields::ALL.iter().map(gap).collect();
        let outcome = Outcome {
            points,
            per_vertex,
            gaps,
        };
        outcomes.push((index, outcome));
    }
    Ok(outcomes)
}

/// How far a world is from where a field takes its vertices.
fn gap(world: &mut World, rest: &Frame, field: &Field) -> Gap {
    let frame = move_to(world, &moved(&rest.points, field));
    Gap::between(&frame.vertices, &moved(&rest.vertices, field))
}

fn plot(
    field: &Field,
    kind: &str,
    outcomes: &[Vec<Outcome>],
    error: impl Fn(&Outcome) -> f64,
) -> Plot {
    let series = |(contender, outcomes): (&Contender, &Vec<Outcome>)| Series {
        label: contender.name.to_owned(),
        ink: contender.ink,
        points: outcomes
            .iter()
            .map(|outcome| Point {
                x: outcome.per_vertex.median,
                y: error(outcome),
                note: format!(
                    "{} points, {:.2} ns per vertex, {kind} error {:.2e}",
                    outcome.points,
                    outcome.per_vertex.median,
                    error(outcome)
                ),
            })
            .collect(),
    };
    Plot {
        name: format!("{}-{kind}", field.name),
        title: format!(
            "{}: {kind} error against time, 8 to 40 to 200 points",
            capital(field.name)
        ),
        x: Axis::new("time per vertex and step, ns, one thread"),
        y: Axis::new(format!("{kind} error, edges of the cube; 0.001 is exact")).with_floor(1e-3),
        series: CONTENDERS.iter().zip(outcomes).map(series).collect(),
    }
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters
        .next()
        .into_iter()
        .flat_map(char::to_uppercase)
        .chain(letters)
        .collect()
}

fn table(points: usize, outcomes: &[Vec<Outcome>]) -> Table {
    let fields = fields::ALL
        .iter()
        .map(|field| format!("{}, rms (max)", field.name));
    let columns = ["mapping".to_owned(), "ns per vertex".to_owned()]
        .into_iter()
        .chain(fields);
    let mut table = Table::new(format!("{points} points"), columns);
    for (contender, outcomes) in CONTENDERS.iter().zip(outcomes) {
        for outcome in outcomes.iter().filter(|outcome| outcome.points == points) {
            let head = [contender.name.into(), outcome.per_vertex.into()];
            let gaps = outcome.gaps.iter().map(shown);
            table.row(head.into_iter().chain(gaps));
        }
    }
    table
}

fn shown(gap: &Gap) -> Cell {
    if gap.max < EXACT {
        "exact".into()
    } else {
        format!("{:.4} ({:.3})", gap.rms, gap.max).into()
    }
}
