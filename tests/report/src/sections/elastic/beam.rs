//! A cantilever: time for a simulated second against error, beside the peers on the same beam.

use nalgebra::Vector3;
use sinew_particles::{MaterialLaw, SolidSpec, Stepping, System, SystemSpec};

use super::{DENSITY, POISSON, YOUNG, material};
use crate::{
    peers::{Peers, error_of},
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Failure, Findings, Table},
    timing::{time, with_threads},
};

/// The beam of the peers, with the material of the section: m, m/s², 1/s.
const LENGTH: f64 = 1.0;
const HEIGHT: f64 = 0.2;
const GRAVITY: f64 = 0.5;
const DAMPING: f64 = 10.0;
/// The peers' beam, by finite elements of the second order, through whose height go so many.
const BRICKS: &str = "4";
/// Simulated time of the beam, s: after it, it rests.
const SETTLED: f64 = 2.0;

/// Timoshenko's deflection of the tip, shear by Cowper, m.
fn timoshenko() -> f64 {
    let (area, inertia) = (HEIGHT * HEIGHT, HEIGHT.powi(4) / 12.0);
    let weight = DENSITY * GRAVITY * area;
    let shear =
        YOUNG / (2.0 * (1.0 + POISSON)) * area * 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON);
    weight * LENGTH.powi(4) / (8.0 * YOUNG * inertia) + weight * LENGTH.powi(2) / (2.0 * shear)
}

/// One run of the beam.
struct Run {
    method: String,
    points: String,
    /// For a simulated second, s.
    seconds: f64,
    /// How far its tip sinks, m.
    tip: f64,
}

/// The peers' beam of so many points through its height.
///
/// The points at its ends lie on them, and own half a cube.
fn ours(through: u32) -> Result<Run, Failure> {
    let s = HEIGHT / f64::from(through);
    let mut points = Vec::new();
    let mut volumes = Vec::new();
    for z in 0..through {
        for y in 0..through {
            for x in 0..=5 * through {
                let at = [f64::from(x), f64::from(y) + 0.5, f64::from(z) + 0.5];
                points.push(Vector3::from(at) * s);
                let ends = x == 0 || x == 5 * through;
                volumes.push(s.powi(3) * if ends { 0.5 } else { 1.0 });
            }
        }
    }
    let count = points.len();
    let solid = SolidSpec {
        volumes: Some(volumes),
        damping: DAMPING,
        ..SolidSpec::new(material(MaterialLaw::Corotated), DENSITY)
    };
    let mut system = System::new(SystemSpec {
        velocities: vec![Vector3::zeros(); count],
        fixed: (0..)
            .zip(&points)
            .filter(|(_, x)| x.x == 0.0)
            .map(|(i, _)| i)
            .collect(),
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        positions: points.clone(),
        solid: Some(solid),
        stepping: Stepping::Fixed,
        ..SystemSpec::default()
    })?;
    let steps = (SETTLED / (0.8 * system.largest_stable_step())).ceil();
    let mut done = Ok(());
    let seconds = time(|| {
        let mut step = 0.0;
        while step < steps && done.is_ok() {
            done = system.step(SETTLED / steps);
            step += 1.0;
        }
    });
    done?;
    let end = points.iter().zip(system.positions());
    let end = end.filter(|(x, _)| x.x > LENGTH - 0.5 * s);
    let sinks: Vec<f64> = end.map(|(x, now)| x.z - now.z).collect();
    #[expect(clippy::cast_precision_loss, reason = "a count of points")]
    let tip = sinks.iter().sum::<f64>() / sinks.len() as f64;
    Ok(Run {
        method: "Sinew".to_owned(),
        points: count.to_string(),
        seconds: seconds / SETTLED,
        tip,
    })
}

/// A script of the peers, with arguments and environment, and what its figure names the tip.
struct Script {
    name: &'static str,
    script: &'static str,
    arguments: &'static [&'static [&'static str]],
    environment: &'static [(&'static str, &'static str)],
    tip: &'static str,
}

const SCRIPTS: [Script; 3] = [
    Script {
        name: "taichi's material point method",
        script: "6_elastic/taichi_mpm.py",
        arguments: &[&["0.04", "6600", "3e-4"], &["0.02", "13200", "1.5e-4"]],
        environment: &[("DAMP", "10")],
        tip: "tip",
    },
    Script {
        name: "SPlisHSPlasH's elastic solids",
        script: "6_elastic/sph_peer.py",
        arguments: &[&["kugel", "0.04", "1500", "2e-3"]],
        environment: &[
            ("VISC", "0.01"),
            ("ALPHA", "0.1"),
            ("LD_PRELOAD", "/lib/x86_64-linux-gnu/libGLdispatch.so.0"),
        ],
        tip: "static_mean_last_1s",
    },
    Script {
        name: "LAMMPS's total Lagrangian SPH",
        script: "6_elastic/run_tlsph.py",
        arguments: &[&["0.04", "2e-4", "2000", "10", "10"]],
        environment: &[],
        tip: "tip",
    },
];

impl Script {
    fn runs(&self) -> Result<Vec<Run>, Failure> {
        let peers = Peers::find()?;
        let mut runs = Vec::new();
        for arguments in self.arguments {
            let figures = peers.python(self.script, arguments, self.environment)?;
            let figure = figures.into_iter().next().ok_or("it printed nothing")?;
            let simulated = error_of(&figure, "sim_time").ok_or("no sim_time")?;
            runs.push(Run {
                method: format!("{} {}", figure.peer, figure.version),
                // The scripts time one of six equal parts of their run.
                seconds: 6.0 * figure.seconds / simulated,
                tip: error_of(&figure, self.tip).ok_or("no tip")?,
                points: figure.n,
            });
        }
        Ok(runs)
    }
}

/// The tip by finite elements, m.
fn reference() -> Result<f64, Failure> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/beam.py");
    let figures = Peers::find()?.python(script, &[BRICKS], &[])?;
    let tip = figures.first().and_then(|figure| error_of(figure, "tip"));
    Ok(tip.ok_or("beam.py printed no tip")?)
}

pub(super) fn measure(findings: &mut Findings) -> Result<(), Failure> {
    let (exact, of) = match reference() {
        Ok(tip) => (tip, "finite elements of the second order"),
        Err(why) => {
            findings.text(format!("Finite elements were not measured: {why}"));
            (timoshenko(), "Timoshenko's theory")
        }
    };
    findings.text(format!(
        "A beam of 1 m × 0.2 m × 0.2 m, clamped at one end, under its weight, in space, damped until it rests; the error is \
         that of its tip against {of}, whose tip is {:+.2} % off Timoshenko's theory: a root that is clamped in all \
         directions is stiffer. Time is for a simulated second, on one thread: a method that takes many cheap steps can \
         still lose. The peers' scripts were tuned by others, as their README says.",
        100.0 * (exact / timoshenko() - 1.0),
    ));
    let mut table = Table::new(
        "Time for a simulated second against error of the tip",
        [
            "method",
            "points",
            "s per simulated second",
            "error of the tip",
        ],
    );
    let mut plot = Plot {
        name: "beam".to_owned(),
        title: "A cantilever under its weight".to_owned(),
        x: Axis::new("s per simulated second"),
        y: Axis::new("error of the tip").with_floor(1e-3),
        series: Vec::new(),
    };
    let mut show = |runs: Vec<Run>, ink: Ink| {
        let mut series = Series {
            label: String::new(),
            points: Vec::new(),
            ink,
        };
        for run in runs {
            let error = run.tip / exact - 1.0;
            series.label.clone_from(&run.method);
            series.points.push(Point {
                x: run.seconds,
                y: error.abs(),
                note: run.points.clone(),
            });
            table.row([
                run.method.into(),
                run.points.into(),
                run.seconds.into(),
                error.into(),
            ]);
        }
        plot.series.push(series);
    };
    let runs = [3, 4, 5, 7, 10].map(|through| with_threads(1, || ours(through)));
    show(runs.into_iter().collect::<Result<_, _>>()?, Ink::Blue);
    for (script, ink) in SCRIPTS.iter().zip([Ink::Orange, Ink::Green, Ink::Purple]) {
        match script.runs() {
            Ok(runs) => show(runs, ink),
            Err(why) => findings.text(format!("{} were not measured: {why}", script.name)),
        }
    }
    findings.table(table);
    findings.plot(plot);
    Ok(())
}
