//! The frame of reference: what the previous frame costs in drift.

use nalgebra::{Rotation3, Vector3};
use sinew_engine::{Filter, MovingFit, Polynomial, RadialBasis, RadialFunction, Reference, Rule};
use sinew_mesh::shapes;

use crate::{
    fields::{Gap, scattered},
    section::{Failure, Findings, Section, Table},
    timing::time,
    worlds::{self, LINEAR, RIGID, build, move_to},
};

pub(crate) const SECTION: Section = Section {
    name: "drift",
    title: "Initial and previous frame",
    measure,
};

const FRAMES: u32 = 1000;
const POINTS: usize = 40;
const KEPT: usize = 10;

const RULES: [(&str, Rule); 7] = [
    ("direct", Rule::Direct),
    ("mean of 10", Rule::Mean),
    ("weighted mean of 10", Rule::WeightedMean),
    ("rigid shape matching, 10", RIGID),
    ("linear shape matching, 10", LINEAR),
    (
        "MLS affine, 10",
        Rule::MovingLeastSquares(MovingFit::Affine),
    ),
    (
        "RBF multiquadric, 10",
        Rule::RadialBasis(RadialBasis {
            function: RadialFunction::Multiquadric,
            scale: None,
            polynomial: Polynomial::Linear,
        }),
    ),
];

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(format!(
        "A unit cube of 1,331 vertices follows 40 points that turn about its centre by 1° a frame, {FRAMES} frames. The error \
         is the distance from the turned cube, at the last half turn (frame 900) and at the end; the last two columns are the \
         time of all frames."
    ));
    let columns = [
        "rule",
        "initial, rms at 900",
        "initial, rms at 1,000",
        "previous, rms at 900",
        "previous, rms at 1,000",
        "initial, ms",
        "previous, ms",
    ];
    let mut table = Table::new("1,000 frames of 1°", columns);
    for (name, rule) in RULES {
        let initial = turn(rule, Reference::Initial)?;
        let previous = turn(rule, Reference::Previous)?;
        table.row([
            name.into(),
            initial.half.into(),
            initial.end.into(),
            previous.half.into(),
            previous.end.into(),
            (1e3 * initial.seconds).into(),
            (1e3 * previous.seconds).into(),
        ]);
    }
    findings.table(table);
    Ok(findings)
}

struct Drift {
    half: f64,
    end: f64,
    seconds: f64,
}

fn turn(rule: Rule, reference: Reference) -> Result<Drift, Failure> {
    let rest = scattered(POINTS);
    let mut mapping = worlds::mapping(Filter::KeepK(KEPT), rule);
    mapping.recipe.reference = reference;
    let mut world = build(shapes::hexahedra(10, 10, 10), &rest, mapping)?;
    let start = world.frame();
    let mut errors = [0.0; 2];
    let seconds = time(|| {
        for frame in 1..=FRAMES {
            let turned = |x: &Vector3<f64>| turned(frame, x);
            let posed = move_to(&mut world, &rest.iter().map(turned).collect::<Vec<_>>());
            if let Some(at) = [900, FRAMES].iter().position(|at| *at == frame) {
                let truth: Vec<_> = start.vertices.iter().map(turned).collect();
                errors[at] = Gap::between(&posed.vertices, &truth).rms;
            }
        }
    });
    let [half, end] = errors;
    Ok(Drift { half, end, seconds })
}

fn turned(frame: u32, x: &Vector3<f64>) -> Vector3<f64> {
    let centre = Vector3::repeat(0.5);
    let angle = f64::from(frame).to_radians();
    centre + Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * (x - centre)
}
