//! Radial basis functions: which, how wide, of how many points, and how others do.

use nalgebra::Vector3;
use sinew_engine::{
    Filter, Mapping, Polynomial, RadialBasis, RadialFunction, Rule, SceneError, World,
};
use sinew_mesh::shapes;

use crate::{
    fields::{BEND, Field, Gap, TWIST, scattered},
    peers::{Figure, Peers, error_of},
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table, digits},
    timing::{Spread, by_turns, time, with_threads},
    worlds::{self, build, cloud, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "rbf",
    title: "Radial basis functions",
    measure,
};

/// Cubes along each edge: 15,625 vertices.
const CUBES: usize = 24;
/// For each function, s.
const BUDGET: f64 = 0.7;

const FUNCTIONS: [(&str, RadialFunction); 9] = [
    ("Gaussian", RadialFunction::Gaussian),
    ("shifted log", RadialFunction::ShiftedLog),
    ("multiquadric", RadialFunction::Multiquadric),
    ("inverse multiquadric", RadialFunction::InverseMultiquadric),
    ("inverse quadratic", RadialFunction::InverseQuadratic),
    ("Wendland C²", RadialFunction::Wendland),
    ("thin plate", RadialFunction::ThinPlate),
    ("cubic", RadialFunction::Cubic),
    ("linear", RadialFunction::Linear),
];

fn basis(function: RadialFunction, scale: Option<f64>) -> Rule {
    Rule::RadialBasis(RadialBasis {
        function,
        scale,
        polynomial: Polynomial::Linear,
    })
}

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "All with a linear polynomial, so that affine motions are exact; one thread. Binding factors one system of n + 4 rows \
         and keeps 8 (n + 4)² bytes; a step solves it for this frame’s displacements and evaluates the function for each pair \
         of vertex and point, with no memory per pair.",
    );
    for points in [40, 200, 1000] {
        findings.table(with_threads(1, || functions(points))?);
    }
    findings.text(
        "Wide functions are smoother and more exact until the system loses its digits: from there on the engine refuses with \
         the condition number, and the lines end.",
    );
    for field in [BEND, TWIST] {
        findings.plot(with_threads(1, || widths(&field))?);
    }
    findings.text(
        "The knob between error and speed is the filter: each vertex interpolates its k nearest points alone, by weights that \
         binding computes. Clusters of vertices with the same points share one system; few points give many small ones, and \
         binding takes longer.",
    );
    findings.plot(with_threads(1, knob)?);
    let beside = beside_peers(&mut findings);
    findings.peers(beside);
    Ok(findings)
}

/// A cube bound by one rule.
struct Cube {
    world: World,
    mapping: Mapping,
    /// The points at rest.
    rest: Vec<Vector3<f64>>,
    vertices: Vec<Vector3<f64>>,
}

impl Cube {
    fn new(points: usize, kept: usize, rule: Rule) -> Result<Self, SceneError> {
        let rest = scattered(points);
        let mapping = worlds::mapping(Filter::KeepK(kept), rule);
        let grid = shapes::hexahedra(CUBES, CUBES, CUBES);
        let world = build(grid, &rest, mapping.clone())?;
        let vertices = world.frame().vertices.clone();
        Ok(Self {
            world,
            mapping,
            rest,
            vertices,
        })
    }

    fn gap(&mut self, field: &Field) -> Gap {
        let frame = move_to(&mut self.world, &moved(&self.rest, field));
        Gap::between(&frame.vertices, &moved(&self.vertices, field))
    }

    /// What binding takes, s: once, since it is long.
    fn bind(&self) -> f64 {
        let rest = self.world.rest();
        time(|| drop(rest.bind(self.mapping.clone())))
    }

    fn step(&mut self) -> Spread {
        let now = moved(&self.rest, &TWIST);
        let mut step = || drop(move_to(&mut self.world, &now));
        Spread::of(&by_turns(BUDGET, &mut [&mut step])[0])
    }
}

fn functions(points: usize) -> Result<Table, Failure> {
    let mut table = Table::new(
        format!("{points} points, all of them on each of 15,625 vertices, default scales"),
        [
            "function",
            "bind, ms",
            "step, ms",
            "bend, rms",
            "bend, max",
            "twist, rms",
            "twist, max",
        ],
    );
    for (name, function) in FUNCTIONS {
        let mut cube = Cube::new(points, points, basis(function, None))?;
        let (bend, twist) = (cube.gap(&BEND), cube.gap(&TWIST));
        table.row([
            name.into(),
            (1e3 * cube.bind()).into(),
            cube.step().times(1e3).into(),
            bend.rms.into(),
            bend.max.into(),
            twist.rms.into(),
            twist.max.into(),
        ]);
    }
    Ok(table)
}

/// Error against width, 40 points.
fn widths(field: &Field) -> Result<Plot, Failure> {
    const POINTS: usize = 40;
    let rest = scattered(POINTS);
    #[expect(clippy::cast_precision_loss, reason = "40")]
    let spacing = 1.2 / (POINTS as f64).cbrt();
    let mut series = Vec::new();
    let inks = [Ink::Purple, Ink::Orange, Ink::Blue, Ink::Grey, Ink::Green];
    for ((name, function), ink) in FUNCTIONS.into_iter().zip(inks) {
        let mut points = Vec::new();
        for tenths in [3, 5, 7, 10, 15, 20, 30, 40, 60, 80, 120] {
            let width = f64::from(tenths) / 10.0;
            let rule = basis(function, Some(width * spacing));
            let grid = shapes::hexahedra(19, 19, 19);
            let Ok(mut world) = build(grid, &rest, worlds::mapping(Filter::KeepK(POINTS), rule))
            else {
                break; // ill-conditioned from here on
            };
            let start = world.frame();
            let frame = move_to(&mut world, &moved(&rest, field));
            let gap = Gap::between(&frame.vertices, &moved(&start.vertices, field));
            let note = format!("s = {width} h: rms error {}", digits(gap.rms));
            points.push(Point {
                x: width,
                y: gap.rms,
                note,
            });
        }
        let label = name.to_owned();
        series.push(Series { label, points, ink });
    }
    Ok(Plot {
        name: format!("width-{}", field.name),
        title: format!(
            "{}: rms error against the width of the function, 40 points",
            field.name
        ),
        x: Axis::new("scale s over the points’ spacing h"),
        y: Axis::new("rms error, edges of the cube"),
        series,
    })
}

/// Error against time as fewer points are kept.
fn knob() -> Result<Plot, Failure> {
    let mut series = Vec::new();
    let few = [8, 12, 16, 24, 32].as_slice();
    let cases = [
        ("200 points, k = 8 to 32", 200, few, Ink::Vermilion),
        ("all 200", 200, &[200], Ink::Orange),
        ("1000 points, k = 8 to 32", 1000, few, Ink::Purple),
        ("all 1000", 1000, &[1000], Ink::Blue),
    ];
    for (label, points, kept, ink) in cases {
        let mut marks = Vec::new();
        for &kept in kept {
            let mut cube = Cube::new(points, kept, basis(RadialFunction::Cubic, None))?;
            let (twist, step) = (cube.gap(&TWIST), cube.step());
            let note = format!(
                "k = {kept}: bind {} ms, step {} ms, rms error {}",
                digits(1e3 * cube.bind()),
                digits(1e3 * step.median),
                digits(twist.rms)
            );
            #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 vertices")]
            let x = 1e9 * step.median / cube.vertices.len() as f64;
            marks.push(Point {
                x,
                y: twist.rms,
                note,
            });
        }
        let (label, points) = (label.to_owned(), marks);
        series.push(Series { label, points, ink });
    }
    Ok(Plot {
        name: "knob".to_owned(),
        title: "Twist: error against time as k falls, cubic, one thread".to_owned(),
        x: Axis::new("time per vertex and step, ns"),
        y: Axis::new("rms error, edges of the cube"),
        series,
    })
}

/// A function as the peers call it, and as it is here with the peers' scale.
const SHARED: [(&str, RadialFunction); 4] = [
    ("gaussian", RadialFunction::Gaussian),
    ("invquad", RadialFunction::InverseQuadratic),
    ("tps", RadialFunction::ThinPlate),
    ("cubic", RadialFunction::Cubic),
];

fn beside_peers(findings: &mut Findings) -> Result<(), Failure> {
    let peers = match Peers::find() {
        Ok(peers) => peers,
        Err(absent) => {
            findings.text(absent);
            return Ok(());
        }
    };
    findings.text(
        "Beside other libraries: a beam of 4 × 1 × 1 m bent and twisted by 40 and by 1,000 centres, 100,000 free vertices, one \
         thread, the same files. A peer’s frame is its fit and its evaluation; ours a step, its binding apart. Peers ran just \
         before ours, not by turns.",
    );
    let cases = [("CASES", "40x100000,1000x100000")];
    let figures = peers.python("2_rbf/run.py", &[], &cases)?;
    let mut table = Table::new(
        "Evaluation, 100,000 vertices",
        [
            "centres, function",
            "who",
            "bind or fit, ms",
            "frame, ms",
            "rms error, m",
            "frame over ours",
        ],
    );
    for centres in [40, 1000] {
        for (name, function) in SHARED {
            let ours = with_threads(1, || on_the_beam(&peers, centres, function))?;
            rows(&mut table, centres, name, &ours, &figures);
        }
    }
    findings.table(table);
    Ok(())
}

struct Beam {
    /// s
    bind: f64,
    step: Spread,
    gap: Gap,
}

/// The peers' beam, by the engine.
fn on_the_beam(peers: &Peers, centres: usize, function: RadialFunction) -> Result<Beam, Failure> {
    let rest = peers.positions(&format!("rbf_C{centres}.f64"))?;
    let moves = peers.positions(&format!("rbf_D{centres}.f64"))?;
    let now: Vec<_> = rest.iter().zip(&moves).map(|(p, d)| p + d).collect();
    let vertices = peers.positions("rbf_V100000.f64")?;
    let truth: Vec<_> = vertices.iter().map(bent_beam).collect();
    #[expect(clippy::cast_precision_loss, reason = "few centres")]
    let scale = 1.5 * (4.0 / centres as f64).cbrt();
    let mapping = worlds::mapping(Filter::KeepK(centres), basis(function, Some(scale)));
    let mut world = build(cloud(vertices), &rest, mapping.clone())?;
    let pose = world.rest();
    let gap = Gap::between(&move_to(&mut world, &now).vertices, &truth);
    let mut step = || drop(move_to(&mut world, &now));
    let step = Spread::of(&by_turns(BUDGET, &mut [&mut step])[0]);
    let bind = time(|| drop(pose.bind(mapping.clone())));
    Ok(Beam { bind, step, gap })
}

/// The peers' analytic motion: a twist of 0.9 rad along a beam of 4 m, then a bend of curvature 0.4 1/m.
fn bent_beam(at: &Vector3<f64>) -> Vector3<f64> {
    let (y, z) = (at.y - 0.5, at.z - 0.5);
    let (sin, cos) = (0.9 * at.x / 4.0).sin_cos();
    let (y, z) = (cos * y - sin * z, sin * y + cos * z);
    let (sin, cos) = (0.4 * at.x).sin_cos();
    Vector3::new((2.5 - y) * sin, 2.5 - (2.5 - y) * cos + 0.5, z + 0.5)
}

fn rows(table: &mut Table, centres: usize, name: &str, ours: &Beam, figures: &[Figure]) {
    let what = format!("{centres}, {name}");
    table.row([
        what.clone().into(),
        "Sinew".into(),
        (1e3 * ours.bind).into(),
        ours.step.times(1e3).into(),
        format!("{:.10}", ours.gap.rms).into(),
        "".into(),
    ]);
    let (fitted, evaluated) = (
        format!("N{centres}/{name}"),
        format!("N{centres}/M100000/{name}"),
    );
    for figure in figures.iter().filter(|figure| figure.n == evaluated) {
        let is_fit = |other: &&Figure| other.n == fitted && other.peer == figure.peer;
        let fit = figures.iter().find(is_fit).map_or(0.0, |fit| fit.seconds);
        let frame = fit + figure.seconds;
        let error = error_of(figure, "rms").map(|rms| format!("{rms:.10}"));
        table.row([
            what.clone().into(),
            format!("{} {}", figure.peer, figure.version).into(),
            (1e3 * fit).into(),
            (1e3 * frame).into(),
            error.map_or("not told".into(), Cell::from),
            (frame / ours.step.median).into(),
        ]);
    }
}
