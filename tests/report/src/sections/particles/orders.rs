//! Every integrator with every law: the time that a trajectory of some error takes.

use nalgebra::{UnitQuaternion, Vector3};
use sinew_particles::{
    Attraction, AttractionLaw, Elastic, EndingKind, Form, FrameSpec, Gradient, Integrator, LinkLaw,
    Links, Normalisation, PairSpec, System, SystemSpec, Weighting,
};

use crate::{
    fields::scattered,
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Table, digits},
    timing::{time, with_threads},
};

/// Particles along each edge of a cube.
const SIDE: u32 = 3;
/// How long trajectories are, s.
const SECONDS: f64 = 4.0;
/// Errors to be reached, m.
const TARGETS: [f64; 2] = [1e-3, 1e-5];
/// The longest run, s.
const BUDGET: f64 = 0.1;

const INTEGRATORS: [(&str, Integrator, Ink); 5] = [
    (
        "semi-implicit Euler",
        Integrator::SemiImplicitEuler,
        Ink::Orange,
    ),
    ("velocity Verlet", Integrator::VelocityVerlet, Ink::Blue),
    ("Runge–Kutta 4", Integrator::RungeKutta4, Ink::Green),
    (
        "linearly implicit Euler",
        Integrator::LinearlyImplicitEuler,
        Ink::Grey,
    ),
    (
        "implicit midpoint",
        Integrator::ImplicitMidpoint,
        Ink::Purple,
    ),
];

pub(super) fn measure(findings: &mut Findings) -> Result<(), Failure> {
    findings.text(format!(
        "Every integrator with every law: a cube of {} particles is let go with its particles moved by up to 4 %; steps are \
         halved until the positions after {SECONDS} s are as close as asked to those of Runge and Kutta’s method with steps 16 \
         times shorter than stability asks for. Milliseconds for the whole trajectory, one thread; a dash where the error was \
         not reached within {BUDGET} s.",
        SIDE.pow(3)
    ));
    let mut tables = TARGETS.map(|target| {
        let columns = ["law"]
            .into_iter()
            .chain(INTEGRATORS.map(|(name, ..)| name));
        Table::new(format!("Time to an rms error of {target:e} m, ms"), columns)
    });
    for (name, spec) in laws() {
        let curves = with_threads(1, || curves(&spec))?;
        for (table, target) in tables.iter_mut().zip(TARGETS) {
            let mut row: Vec<Cell> = vec![name.into()];
            row.extend(curves.iter().map(|curve| {
                let reached = curve.iter().find(|[_, error]| *error <= target);
                reached.map_or("–".into(), |[seconds, _]| (1e3 * seconds).into())
            }));
            table.rows.push(row);
        }
        if matches!(name, "spring" | "cohesion") {
            findings.plot(plot(name, &curves));
        }
    }
    tables.into_iter().for_each(|table| findings.table(table));
    Ok(())
}

/// Seconds and error of each integrator as its steps are halved.
fn curves(spec: &SystemSpec) -> Result<Vec<Vec<[f64; 2]>>, Failure> {
    let build = |integrator| {
        System::new(SystemSpec {
            integrator,
            ..spec.clone()
        })
    };
    let stable = build(Integrator::VelocityVerlet)?.largest_stable_step();
    // Steps that divide the time, from about half of what is stable on.
    let whole = (2.0 * SECONDS / stable).log2().ceil().exp2();
    let mut truth = build(Integrator::RungeKutta4)?;
    go(&mut truth, 16.0 * whole)?;
    let mut curves = Vec::new();
    for (_, integrator, _) in INTEGRATORS {
        let mut curve = Vec::new();
        for halvings in 0..16 {
            let mut system = build(integrator)?;
            let mut outcome = Ok(());
            let steps = whole * 2.0_f64.powi(halvings);
            let seconds = time(|| outcome = go(&mut system, steps));
            if outcome.is_err() {
                continue; // too long a step for this integrator: it says so, and takes none
            }
            let pairs = system.positions().iter().zip(truth.positions());
            let error: f64 = pairs.map(|(a, b)| (a - b).norm_squared()).sum();
            let error = (error / f64::from(SIDE.pow(3))).sqrt();
            curve.push([seconds, error]);
            if error < TARGETS[1] || seconds > BUDGET {
                break;
            }
        }
        curves.push(curve);
    }
    Ok(curves)
}

fn go(system: &mut System, steps: f64) -> Result<(), Failure> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a power of two, not large"
    )]
    for _ in 0..steps as u64 {
        system.step(SECONDS / steps)?;
    }
    Ok(())
}

fn plot(name: &str, curves: &[Vec<[f64; 2]>]) -> Plot {
    let series = INTEGRATORS
        .iter()
        .zip(curves)
        .map(|((label, _, ink), curve)| Series {
            label: (*label).to_owned(),
            points: curve
                .iter()
                .map(|&[seconds, y]| Point {
                    x: 1e3 * seconds,
                    y,
                    note: format!("{} ms: {} m", digits(1e3 * seconds), digits(y)),
                })
                .collect(),
            ink: *ink,
        });
    Plot {
        name: name.to_owned(),
        title: format!("{name}: rms error after {SECONDS} s against the time it takes"),
        x: Axis::new("time, ms"),
        y: Axis::new("rms error, m").with_floor(1e-9),
        series: series.collect(),
    }
}

/// Laws, each with a cube that it holds together.
fn laws() -> Vec<(&'static str, SystemSpec)> {
    let mut laws = links();
    laws.extend(pairs());
    laws
}

fn links() -> Vec<(&'static str, SystemSpec)> {
    let ends = near();
    let elastic = |damping: f64| Elastic {
        stiffness: vec![10.0; ends.len()],
        damping: vec![damping; if damping > 0.0 { ends.len() } else { 0 }],
        rest_lengths: Some(lengths(&ends)),
    };
    let table = LinkLaw::Table {
        lengths: vec![0.8, 1.0, 1.4, 1.8],
        forces: vec![2.0, 0.0, -1.0, -5.0],
    };
    let linked = |law: LinkLaw| SystemSpec {
        links: vec![Links {
            ends: ends.clone(),
            law,
        }],
        ..cube()
    };
    vec![
        ("spring", linked(LinkLaw::Spring(elastic(0.0)))),
        ("damped spring", linked(LinkLaw::Spring(elastic(0.2)))),
        ("contact", linked(LinkLaw::Contact(elastic(0.0)))),
        ("piecewise linear link", linked(table)),
    ]
}

fn pairs() -> Vec<(&'static str, SystemSpec)> {
    let attracted = |law: AttractionLaw, table: Option<f64>, form: Option<Form>| SystemSpec {
        frames: form.as_ref().map(|_| frames()),
        pairs: Some(PairSpec {
            attraction: Some(Attraction {
                law,
                ending: EndingKind::Shifted,
                table,
            }),
            form,
            reach: 1.9,
            ..PairSpec::default()
        }),
        ..cube()
    };
    let lennard_jones = AttractionLaw::LennardJones {
        stiffness: 5.0,
        rest_length: 1.0,
        exponent: 4,
    };
    let twelve_six = AttractionLaw::TwelveSix {
        depth: 0.1,
        size: 0.5_f64.powf(1.0 / 6.0),
    };
    let (stiffness, sharpness) = (30.0, 10.0);
    let cohesion = AttractionLaw::Cohesion {
        stiffness,
        rest_length: 1.0,
        sharpness,
    };
    let directed = AttractionLaw::DirectedCohesion {
        stiffness,
        sharpness,
        radii: vec![Vector3::new(1.1, 1.0, 0.9); rest().len()],
    };
    let form = Some(bent());
    vec![
        (
            "Lennard-Jones",
            attracted(lennard_jones.clone(), None, None),
        ),
        ("12-6", attracted(twelve_six, None, None)),
        ("cohesion", attracted(cohesion.clone(), None, None)),
        (
            "cohesion, table of 1e-6",
            attracted(cohesion, Some(1e-6), None),
        ),
        (
            "cohesion by direction, and form",
            attracted(directed, None, form.clone()),
        ),
        (
            "Lennard-Jones and form",
            attracted(lennard_jones, None, form),
        ),
    ]
}

fn bent() -> Form {
    Form {
        form: 0.5,
        coplanarity: 0.2,
        conormality: 0.2,
        cocircularity: 0.0,
        curvatures: vec![[0.2; 2]; rest().len()],
        weighting: Weighting::Gaussian { width: 1.0 },
        normalisation: Normalisation::SquaredDistance,
        gradient: Gradient::Whole,
    }
}

fn rest() -> Vec<Vector3<f64>> {
    let at = |i: u32| Vector3::new(i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE).map(f64::from);
    (0..SIDE.pow(3)).map(at).collect()
}

fn cube() -> SystemSpec {
    let rest = rest();
    let noise = scattered(rest.len());
    let moved = rest
        .iter()
        .zip(noise)
        .map(|(x, by)| x + (by - Vector3::repeat(0.5)) * 0.08);
    SystemSpec {
        positions: moved.collect(),
        velocities: vec![Vector3::zeros(); rest.len()],
        masses: vec![1.0; rest.len()],
        ..SystemSpec::default()
    }
}

fn frames() -> FrameSpec {
    let count = SIDE.pow(3) as usize;
    FrameSpec {
        orientations: vec![UnitQuaternion::identity(); count],
        spins: vec![Vector3::zeros(); count],
        moments: vec![Vector3::repeat(0.1); count],
        damping: 0.0,
    }
}

/// Pairs of neighbours in the cube, along edges and diagonals.
fn near() -> Vec<[u32; 2]> {
    let rest = rest();
    let pairs = (0..SIDE.pow(3)).flat_map(|b| (0..b).map(move |a| [a, b]));
    pairs
        .filter(|[a, b]| (rest[*a as usize] - rest[*b as usize]).norm() < 1.8)
        .collect()
}

fn lengths(ends: &[[u32; 2]]) -> Vec<f64> {
    let rest = rest();
    ends.iter()
        .map(|[a, b]| (rest[*a as usize] - rest[*b as usize]).norm())
        .collect()
}
