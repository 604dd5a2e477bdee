//! Elastic solids of points: what parts a body, what neighbourhoods cost, and time against error of a beam.

mod beam;

use std::fs;

use nalgebra::Vector3;
use sinew_particles::{
    Dimension, Integration, Material, MaterialLaw, Metric, Reach, Solid, SolidSpec, Survey, System,
    SystemSpec,
};

use crate::{
    peers::Peers,
    section::{Cell, Failure, Findings, Section, Table},
    timing::{exponent, time, with_threads},
};

pub(crate) const SECTION: Section = Section {
    name: "elastic",
    title: "Elastic solids of points",
    measure,
};

/// kg/m³, Pa.
const DENSITY: f64 = 1_000.0;
const YOUNG: f64 = 1e6;
const POISSON: f64 = 0.3;
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
    steps(&mut findings)?;
    beam::measure(&mut findings)?;
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

/// What a step costs by the number of points, on one thread and on two.
fn steps(findings: &mut Findings) -> Result<(), Failure> {
    const STEPS: u32 = 20;
    let mut table = Table::new(
        "Cost of a step, ns per point",
        ["points", "1 thread", "2 threads, one of them"],
    );
    let mut sizes = Vec::new();
    for side in [10, 22, 46] {
        let points = cloud(side);
        #[expect(clippy::cast_precision_loss, reason = "a count of points")]
        let count = points.len() as f64;
        let solid = SolidSpec::new(material(MaterialLaw::Corotated), DENSITY);
        let mut system = System::new(SystemSpec {
            velocities: points
                .iter()
                .map(|x| Vector3::new(x.y, -x.x, 0.1))
                .collect(),
            positions: points,
            solid: Some(solid),
            ..SystemSpec::default()
        })?;
        let dt = 0.1 * system.largest_stable_step();
        let mut seconds = [0.0; 2];
        for (threads, seconds) in (1..).zip(&mut seconds) {
            let mut done = Ok(());
            let taken = with_threads(threads, || {
                time(|| {
                    for _ in 0..STEPS {
                        done = done.and(system.step(dt));
                    }
                })
            });
            done?;
            *seconds = taken / f64::from(STEPS);
        }
        sizes.push((count, seconds[0]));
        table.row([
            Cell::from(format!("{count}")),
            (1e9 * seconds[0] / count).into(),
            (1e9 * seconds[1] / count).into(),
        ]);
    }
    findings.text(format!(
        "A step of a free block of shaken points, explicit: on one thread the time goes by the number of points to the power \
         of {:.2}.",
        exponent(&sizes)
    ));
    findings.table(table);
    Ok(())
}
