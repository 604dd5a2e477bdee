//! Particles without orientation: what holds together, and how fast it comes to rest.

use nalgebra::Vector3;
use sinew_particles::{AttractionLaw, PairSpec, System, SystemSpec, oscillation};

use super::{LENNARD_JONES, Lab, attraction, cohesion, points, run};
use crate::{
    fields::scattered,
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Table, digits},
};

pub(super) fn triangle(lab: &mut Lab) -> Result<(), Failure> {
    let mut table = Table::new(
        "A triangle let go at p % of its rest length, dt 0.1 s, drag 0.01",
        ["p, %", "Lennard-Jones, n = 4", "cohesion, a = 10"],
    );
    let build = |percent: u32, law: AttractionLaw| {
        let corner = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 3.0;
            Vector3::new(angle.cos(), angle.sin(), 0.0) * (f64::from(percent) / 173.205_080_756_9)
        };
        System::new(SystemSpec {
            damping: 0.01,
            pairs: Some(PairSpec {
                attraction: attraction(law),
                bonds: Some(vec![[0, 1], [1, 2], [2, 0]]),
                ..PairSpec::default()
            }),
            ..points((0..3).map(corner).collect())
        })
    };
    let mut lowest = [100; 2];
    for percent in (50..=100).rev().step_by(5) {
        let mut row: Vec<Cell> = vec![percent.to_string().into()];
        for (lowest, law) in lowest.iter_mut().zip([LENNARD_JONES, cohesion(10.0)]) {
            let mut system = build(percent, law)?;
            run(&mut system, 60.0, 0.1)?;
            let side = (system.positions()[1] - system.positions()[0]).norm();
            let returns = side < 6.0;
            if returns && percent + 5 >= *lowest {
                *lowest = percent;
            }
            row.push(if returns { "returns" } else { "flies apart" }.into());
        }
        table.rows.push(row);
    }
    lab.findings.table(table);
    lab.claim("Lennard-Jones diverges from 80 % on, cohesion still converges at 60 %",
        lowest == [85, 60],
        format!("return down to {} % and {} %", lowest[0], lowest[1]),
        "Not numerical: below 80.9 and 59.2 % the energy at the start is that of free particles. Thresholds depend on n \
         and a; with noticeable drag both return from farther.",
    );
    lab.time("triangle", &mut build(60, cohesion(10.0))?, [20_000.0, 0.1])
}

/// The n points of a face-centred lattice of spacing 1 that are nearest to a place between them.
pub(super) fn packing(n: usize) -> Vec<Vector3<f64>> {
    let middle = Vector3::new(0.21, 0.17, 0.13);
    let mut places: Vec<Vector3<f64>> = (-3..=3_i32)
        .flat_map(|i| (-3..=3_i32).flat_map(move |j| (-3..=3_i32).map(move |k| [i, j, k])))
        .map(|[i, j, k]| {
            let at = |a: i32, b: i32| f64::from(a + b) * std::f64::consts::FRAC_1_SQRT_2;
            Vector3::new(at(i, j), at(j, k), at(k, i))
        })
        .collect();
    places.sort_by(|a, b| (a - middle).norm().total_cmp(&(b - middle).norm()));
    places.truncate(n);
    places
}

/// O(t) of a packing at rest whose particles were moved by 5 %, s and m.
fn oscillations(n: usize, law: &AttractionLaw) -> Result<Vec<[f64; 2]>, Failure> {
    let spec = |positions, damping| SystemSpec {
        damping,
        pairs: Some(PairSpec {
            attraction: attraction(law.clone()),
            reach: 2.5,
            ..PairSpec::default()
        }),
        ..points(positions)
    };
    let mut relaxed = System::new(spec(packing(n), 1.0))?;
    run(&mut relaxed, 600.0, 0.05)?;
    let noise = scattered(n)
        .into_iter()
        .map(|x| (x - Vector3::repeat(0.5)) * 0.1);
    let moved = relaxed.positions().iter().zip(noise).map(|(x, by)| x + by);
    let mut system = System::new(spec(moved.collect(), 0.1))?;
    let masses = vec![1.0; n];
    let mut found = Vec::new();
    for step in 1..=8_000 {
        let before = system.positions().to_vec();
        system.step(0.05)?;
        let moved: Vec<_> = system
            .positions()
            .iter()
            .zip(&before)
            .map(|(x, b)| x - b)
            .collect();
        found.push([0.05 * f64::from(step), oscillation(&moved, &masses)]);
    }
    Ok(found)
}

/// From when on O stays below a level, s.
fn quiet_from(found: &[[f64; 2]], level: f64) -> f64 {
    found
        .iter()
        .rev()
        .find(|[_, o]| *o >= level)
        .map_or(0.0, |[t, _]| *t)
}

pub(super) fn clusters(lab: &mut Lab) -> Result<(), Failure> {
    let mut table = Table::new(
        "Clusters moved by 5 % from their rest, drag 0.1, dt 0.05 s: from when on O stays below",
        [
            "particles",
            "law",
            "1 % of its most, s",
            "1e-3 m, s",
            "1e-4 of its most, s",
        ],
    );
    let mut series = Vec::new();
    let (mut faster, mut slower) = (0, 0);
    for n in [3, 10, 50] {
        let laws = [
            ("Lennard-Jones, n = 4", LENNARD_JONES, Ink::Vermilion),
            ("cohesion, a = 16/3", cohesion(16.0 / 3.0), Ink::Green),
            ("cohesion, a = 15", cohesion(15.0), Ink::Blue),
        ];
        let mut reference = None;
        for (name, law, ink) in laws {
            let found = oscillations(n, &law)?;
            let most = found.iter().map(|[_, o]| *o).fold(0.0, f64::max);
            let percent = quiet_from(&found, 0.01 * most);
            match reference {
                None => reference = Some(percent),
                Some(reference) if percent < reference => faster += 1,
                Some(_) => slower += 1,
            }
            table.row([
                n.to_string().into(),
                name.into(),
                percent.into(),
                quiet_from(&found, 1e-3).into(),
                quiet_from(&found, 1e-4 * most).into(),
            ]);
            if n == 10 {
                series.push(series_of(name, ink, &found));
            }
        }
    }
    lab.findings.table(table);
    lab.findings.plot(Plot {
        name: "oscillation".to_owned(),
        title: "Ten particles moved by 5 %: O(t)".to_owned(),
        x: Axis::new("t, s"),
        y: Axis::new("O, m per step").with_floor(1e-8),
        series,
    });
    lab.claim("Cohesion always converges faster than Lennard-Jones",
        slower == 0,
        format!("to 1 %: faster in {faster} of {} cases", faster + slower),
        "A flat well stores less and damps 4/3 as fast, but has no stiffness at rest: in the end |x − r₀| falls as a root of \
         time where Lennard-Jones falls exponentially, and packings of many re-arrange.",
    );
    let mut cluster = System::new(SystemSpec {
        damping: 0.1,
        pairs: Some(PairSpec {
            attraction: attraction(cohesion(15.0)),
            reach: 2.5,
            ..PairSpec::default()
        }),
        ..points(packing(50))
    })?;
    lab.time("cluster of 50", &mut cluster, [2_000.0, 0.05])
}

/// Every twentieth step.
fn series_of(label: &str, ink: Ink, found: &[[f64; 2]]) -> Series {
    let point = |&[x, y]: &[f64; 2]| Point {
        x,
        y,
        note: format!("t = {} s: {}", digits(x), digits(y)),
    };
    Series {
        label: label.to_owned(),
        points: found.iter().step_by(100).map(point).collect(),
        ink,
    }
}
