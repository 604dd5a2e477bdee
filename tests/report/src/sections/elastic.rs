//! Elastic solids of points: what parts a body, what neighbourhoods cost, and time against error of a beam.

use std::fs;

use nalgebra::Vector3;
use sinew_particles::{
    Dimension, Integration, Material, MaterialLaw, Metric, Reach, Solid, SolidSpec, Stepping,
    Survey, System, SystemSpec,
};

use crate::{
    peers::{Peers, error_of},
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table},
    timing::{time, with_threads},
};

pub(crate) const SECTION: Section = Section {
    name: "elastic",
    title: "Elastic solids of points",
    measure,
};

/// The beam of the peers: m, kg/m³, Pa, m/s², 1/s.
const LENGTH: f64 = 1.0;
const HEIGHT: f64 = 0.2;
const DENSITY: f64 = 1_000.0;
const YOUNG: f64 = 1e6;
const POISSON: f64 = 0.3;
const GRAVITY: f64 = 0.5;
const DAMPING: f64 = 10.0;
/// Simulated time of the beam, s: after it, it rests.
const SETTLED: f64 = 2.0;
/// Distances searched within, in spacings.
const REACH: f64 = 1.9;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "Two bars in the plane, one held, the other hanging from the block that joins them at one end (the paper's figure 8): \
         points on a lattice of spacing s, rows of the bars facing each other at some distance, a point sees as far as 2.5 s \
         or, where that is not enough for straight distances to see across, 1.2 times the gap. Where a criterion sees across, \
         the lower bar sticks to the upper one. The paper's exponent flips from one to the other, at a gap that depends on \
         the length of the bars; the graded criterion goes over in between.",
    );
    findings.table(gaps()?);
    findings.text(
        "Neighbourhoods: all of a survey, which is spacings, graph, distances along the body, moment matrices, pieces and \
         twins, beside the pairs and the distances alone by scipy. One thread each; scipy's search is of some sources, times \
         the points that there are.",
    );
    findings.table(with_threads(1, neighbourhoods)?);
    beam(&mut findings)?;
    Ok(findings)
}

/// A lattice's bars: 25 columns, 5 rows each, and the block that joins them; with the number of the block's columns.
fn bars(gap: f64) -> (Vec<Vector3<f64>>, Vec<bool>, Vec<bool>) {
    let mut points = Vec::new();
    let mut rows: Vec<(f64, u32)> = (0..5_u32).map(|row| (f64::from(row), 25)).collect();
    // One row at least, so that the joint is no gap itself.
    let between = gap.round().max(2.0);
    let mut k = 1.0;
    while k < between {
        rows.push((4.0 + gap * k / between, 5));
        k += 1.0;
    }
    rows.extend((0..5_u32).map(|row| (4.0 + gap + f64::from(row), 25)));
    for (y, columns) in rows {
        points.extend((0..columns).map(|x| Vector3::new(f64::from(x), y, 0.0)));
    }
    // Rows further apart than the lattice's are joined by the block alone.
    let upper = points
        .iter()
        .map(|x| x.y > 4.0 + gap - 0.5 / between)
        .collect();
    let lower = points.iter().map(|x| x.y < 4.5).collect();
    (points, upper, lower)
}

fn gaps() -> Result<Table, Failure> {
    let criteria = [
        ("straight", Metric::Geodesic { exponent: 1.0 }),
        ("γ = 4", Metric::Geodesic { exponent: 4.0 }),
        ("γ = 15", Metric::Geodesic { exponent: 15.0 }),
        (
            "graded, exponent 2",
            Metric::Graded {
                gap: 1.5,
                exponent: 2.0,
            },
        ),
        (
            "graded, exponent 6",
            Metric::Graded {
                gap: 1.5,
                exponent: 6.0,
            },
        ),
    ];
    let columns = criteria.iter().flat_map(|(name, _)| {
        [
            format!("{name}: false neighbours"),
            format!("{name}: sinks"),
        ]
    });
    let mut table = Table::new(
        "False neighbours (directed pairs) and sinking of the tip, over that of bars 3 spacings apart",
        std::iter::once("gap / s".to_owned()).chain(columns),
    );
    let far = sag(3.0, Metric::Geodesic { exponent: 15.0 })?.1;
    for gap in [1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.4] {
        let mut row = vec![Cell::from(gap)];
        for (_, metric) in criteria {
            let (false_ones, sinks) = sag(gap, metric)?;
            row.extend([Cell::from(false_ones), Cell::from(sinks / far)]);
        }
        table.row(row);
    }
    Ok(table)
}

/// False neighbours, and how far the lower bar's end sinks in linear statics under a small weight, m.
fn sag(gap: f64, metric: Metric) -> Result<(f64, f64), Failure> {
    let (points, upper, lower) = bars(gap);
    let spec = SolidSpec {
        dimension: Dimension::Plane,
        metric,
        reach: Reach::Length(f64::max(2.5, 1.2 * gap)),
        integration: Integration::Nodal,
        volumes: Some(vec![1.0; points.len()]),
        ..SolidSpec::new(material(MaterialLaw::Linear), DENSITY)
    };
    let mut solid = Solid::new(&spec, &points)?;
    let beyond = (0..points.len()).filter(|&i| lower[i] && points[i].x > 8.0);
    let across = beyond
        .flat_map(|i| solid.neighbours(i))
        .filter(|(j, _)| upper[*j as usize]);
    #[expect(clippy::cast_precision_loss, reason = "a count of pairs")]
    let across = across.count() as f64;
    let load = lower
        .iter()
        .map(|&lower| Vector3::y() * if lower { -1.0 } else { 0.0 });
    let moved = statics(&mut solid, &points, &load.collect::<Vec<_>>(), &upper);
    let end = points
        .iter()
        .zip(&moved)
        .filter(|(x, _)| x.x > 23.5 && x.y < 4.5);
    Ok((across, end.map(|(_, u)| -u.y).sum::<f64>() / 5.0))
}

/// Displacements in linear statics, by conjugate gradients.
fn statics(
    solid: &mut Solid,
    rest: &[Vector3<f64>],
    load: &[Vector3<f64>],
    held: &[bool],
) -> Vec<Vector3<f64>> {
    let dot = |a: &[Vector3<f64>], b: &[Vector3<f64>]| -> f64 {
        a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
    };
    let mask = |values: &mut [Vector3<f64>]| {
        let held = values.iter_mut().zip(held).filter(|(_, held)| **held);
        held.for_each(|(value, _)| *value = Vector3::zeros());
    };
    let mut moved = vec![Vector3::zeros(); rest.len()];
    let mut residual = load.to_vec();
    mask(&mut residual);
    let mut way = residual.clone();
    let mut size = dot(&residual, &residual);
    let enough = 1e-16 * size;
    for _ in 0..50_000 {
        if size <= enough {
            break;
        }
        let at: Vec<_> = rest.iter().zip(&way).map(|(x, way)| x + way).collect();
        let mut product = solid.forces(&at);
        mask(&mut product);
        let step = -size / dot(&way, &product);
        for i in 0..rest.len() {
            moved[i] += way[i] * step;
            residual[i] += product[i] * step;
        }
        let smaller = dot(&residual, &residual);
        for (way, residual) in way.iter_mut().zip(&residual) {
            *way = residual + *way * (smaller / size);
        }
        size = smaller;
    }
    moved
}

fn material(law: MaterialLaw) -> Material {
    Material {
        young: YOUNG,
        poisson: POISSON,
        law,
    }
}

/// A block of points in the middles of cubes, shaken by 15 % of their spacing.
fn cloud(side: u32) -> Vec<Vector3<f64>> {
    let mut seed = 1_u64;
    let mut noise = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from((seed >> 33) as u32) / f64::from(1_u32 << 31) * 0.3 - 0.15
    };
    let mut points = Vec::new();
    for z in 0..side {
        for y in 0..side {
            for x in 0..side {
                let at = [x, y, z].map(|k| f64::from(k) + noise());
                points.push(Vector3::from(at));
            }
        }
    }
    points
}

fn neighbourhoods() -> Result<Table, Failure> {
    let mut table = Table::new(
        "Neighbourhoods of a cube of points, s",
        ["points", "Sinew", "scipy", "scipy / Sinew"],
    );
    let peers = Peers::find();
    for (side, sources) in [(22, 2_000), (46, 500), (100, 50)] {
        let points = cloud(side);
        let mut surveyed = Ok(());
        let ours = time(|| {
            surveyed = Survey::new(&points, Dimension::Space, REACH).map(drop);
        });
        surveyed?;
        let theirs = match &peers {
            Ok(peers) => scipy(peers, &points, sources)?,
            Err(_) => f64::NAN,
        };
        let cell = |number: f64| match number.is_nan() {
            true => Cell::from("not measured"),
            false => Cell::from(number),
        };
        table.row([
            Cell::from(format!("{}", points.len())),
            Cell::from(ours),
            cell(theirs),
            cell(theirs / ours),
        ]);
    }
    Ok(table)
}

fn scipy(peers: &Peers, points: &[Vector3<f64>], sources: u32) -> Result<f64, Failure> {
    let file = std::env::temp_dir().join(format!("sinew-report-{}.f64", std::process::id()));
    let bytes: Vec<u8> = points
        .iter()
        .flat_map(|x| x.iter().flat_map(|c| c.to_le_bytes()))
        .collect();
    fs::write(&file, bytes)?;
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/neighbourhoods.py");
    let name = file.display().to_string();
    let figures = peers.python(
        script,
        &[&name, &REACH.to_string(), &sources.to_string()],
        &[],
    );
    fs::remove_file(&file)?;
    let first = figures?.into_iter().next();
    Ok(first.ok_or("neighbourhoods.py printed nothing")?.seconds)
}

/// Timoshenko's deflection of the tip, shear by Cowper, m.
fn timoshenko() -> f64 {
    let (area, inertia) = (HEIGHT * HEIGHT, HEIGHT.powi(4) / 12.0);
    let weight = DENSITY * GRAVITY * area;
    let shear =
        YOUNG / (2.0 * (1.0 + POISSON)) * area * 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON);
    weight * LENGTH.powi(4) / (8.0 * YOUNG * inertia) + weight * LENGTH.powi(2) / (2.0 * shear)
}

/// The peers' beam of so many points through its height: seconds per simulated second, and the tip's error.
fn ours(through: u32) -> Result<(usize, f64, f64), Failure> {
    let s = HEIGHT / f64::from(through);
    let clamped = 4;
    let columns = clamped + 5 * through;
    let mut points = Vec::new();
    for z in 0..through {
        for y in 0..through {
            for x in 0..columns {
                // The last clamped points lie on the root's plane.
                let x = f64::from(x) - f64::from(clamped - 1);
                points.push(Vector3::new(x, f64::from(y) + 0.5, f64::from(z) + 0.5) * s);
            }
        }
    }
    let count = points.len();
    let solid = SolidSpec {
        volumes: Some(vec![s.powi(3); count]),
        damping: DAMPING,
        ..SolidSpec::new(material(MaterialLaw::Corotated), DENSITY)
    };
    let mut system = System::new(SystemSpec {
        velocities: vec![Vector3::zeros(); count],
        fixed: (0..)
            .zip(&points)
            .filter(|(_, x)| x.x < 0.5 * s)
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
    let last = points.iter().map(|x| x.x).fold(0.0, f64::max);
    let end = points
        .iter()
        .zip(system.positions())
        .filter(|(x, _)| x.x > last - 0.5 * s);
    let sinks: Vec<f64> = end.map(|(x, now)| x.z - now.z).collect();
    #[expect(clippy::cast_precision_loss, reason = "a count of points")]
    let tip = sinks.iter().sum::<f64>() / sinks.len() as f64;
    Ok((count, seconds / SETTLED, tip / timoshenko() - 1.0))
}

fn beam(findings: &mut Findings) -> Result<(), Failure> {
    findings.text(
        "A beam of 1 m × 0.2 m × 0.2 m, clamped at one end, under its weight, in space, damped until it rests; the error is \
         that of its tip against Timoshenko's theory. Time is for a simulated second, on one thread: a method that takes \
         many cheap steps can still lose. The peers' scripts were tuned by others, as their README says.",
    );
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
    let mut points = Vec::new();
    for through in [4, 5, 7, 10] {
        let (count, seconds, error) = with_threads(1, || ours(through))?;
        table.row([
            "Sinew".into(),
            count.to_string().into(),
            seconds.into(),
            error.into(),
        ]);
        points.push(Point {
            x: seconds,
            y: error.abs(),
            note: format!("{count} points"),
        });
    }
    plot.series.push(Series {
        label: "Sinew".to_owned(),
        points,
        ink: Ink::Blue,
    });
    if let Err(why) = mpm(&mut table, &mut plot) {
        findings.text(format!("The material point method was not measured: {why}"));
    }
    findings.table(table);
    findings.plot(plot);
    Ok(())
}

/// taichi's material point method on the same beam, by the peers' script.
fn mpm(table: &mut Table, plot: &mut Plot) -> Result<(), Failure> {
    let peers = Peers::find()?;
    for arguments in [["0.04", "6600", "3e-4"], ["0.02", "13200", "1.5e-4"]] {
        for figure in peers.python("6_elastic/taichi_mpm.py", &arguments, &[("DAMP", "10")])? {
            let simulated = error_of(&figure, "sim_time").ok_or("no sim_time")?;
            let error = error_of(&figure, "rel").ok_or("no rel")?;
            // The script times one of six equal parts of its run.
            let seconds = 6.0 * figure.seconds / simulated;
            let label = format!("{} {}", figure.peer, figure.version);
            table.row([
                label.clone().into(),
                figure.n.clone().into(),
                seconds.into(),
                error.into(),
            ]);
            plot.series.push(Series {
                label,
                points: vec![Point {
                    x: seconds,
                    y: error.abs(),
                    note: figure.n,
                }],
                ink: Ink::Orange,
            });
        }
    }
    Ok(())
}
