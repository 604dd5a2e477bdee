//! Motion capture with markers that vanish: Sinew beside the usual ways to fill gaps.

use std::path::Path;

use nalgebra::Vector3;
use sinew_engine::{
    Buffer, ExternalPoints, Filter, MeshSource, Motion, MotionSample, Rule, Scene, Tracking,
    UpAxis, World,
};
use sinew_formats::take::{self, Options, Take};

use crate::{
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Failure, Findings, Section, Table},
    worlds,
};

pub(crate) const SECTION: Section = Section {
    name: "capture",
    title: "Markers that vanish",
    measure,
};

/// A walk of 41 markers at 120 Hz, all of them seen always.
const TAKE: &str = "../../client/formats/tests/data/take/cmu_02_01.c3d";
/// Shares of samples that are hidden, percent.
const SHARES: [u32; 7] = [5, 10, 20, 30, 40, 50, 60];
/// Frames that a live session waits for: the next one at least, more where they come in disorder.
const AHEAD: [usize; 3] = [0, 1, 3];
/// Across how long a session puts points on a line, s.
const BRIDGE: f64 = 0.05;
/// Mean length of a gap, frames.
const LENGTHS: [(&str, &str, u32); 2] = [
    ("gaps", "a quarter of a second", 30),
    ("flicker", "single frames, by chance", 1),
];

fn measure() -> Result<Findings, Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(TAKE);
    let take = take::read(path, &Options::default())?;
    let mut findings = Findings::default();
    findings.text(format!(
        "A real walk ({} markers, {} frames at {} Hz, seen whole) loses samples by chance, and each way fills them. The \
         error is the root mean square of the distance from where the hidden markers were. Hold, and Sinew where each frame \
         is one step, know only what came before. A live session waits for the next frame at least, or for as many as \
         its jitter asks for (+1, +3), and uses them. The line and the spline (through two samples on each side) wait \
         for the markers' return, however long that takes, and so cannot be used live.",
        take.labels().len(),
        take.frames(),
        take.rate_hz(),
    ));
    for lengths in LENGTHS {
        errors(&take, lengths, &mut findings)?;
    }
    Ok(findings)
}

/// Each way's error against the share that is hidden.
fn errors(
    take: &Take,
    (name, title, length): (&str, &str, u32),
    findings: &mut Findings,
) -> Result<(), Failure> {
    let columns = [
        "hidden, %",
        "hold, mm",
        "linear, mm",
        "spline, mm",
        "Sinew, mm",
        "Sinew + 1 frame, mm",
        "Sinew + 3 frames, mm",
        "Sinew at most, mm",
    ];
    let mut table = Table::new(format!("Gaps of {title}"), columns);
    let mut series = [
        ("hold", Ink::Grey),
        ("linear (not live)", Ink::Orange),
        ("spline (not live)", Ink::Green),
        ("Sinew", Ink::Blue),
        ("Sinew + 1 frame", Ink::Purple),
        ("Sinew + 3 frames", Ink::Vermilion),
    ]
    .map(|(label, ink)| Series {
        label: label.to_owned(),
        points: Vec::new(),
        ink,
    });
    for percent in SHARES {
        let seen = hidden(take, percent, length);
        let filled = [hold, linear, spline].map(|way| Errors::of(take, &seen, &way(take, &seen)));
        let mut all = filled.to_vec();
        for ahead in AHEAD {
            all.push(Errors::of(take, &seen, &tracked(take, &seen, ahead)?));
        }
        for (series, errors) in series.iter_mut().zip(&all) {
            series.points.push(Point {
                x: f64::from(percent),
                y: 1e3 * errors.rms,
                note: format!(
                    "{}: {:.1} mm at {percent} %",
                    series.label,
                    1e3 * errors.rms
                ),
            });
        }
        let rms = all.iter().map(|errors| (1e3 * errors.rms).into());
        let most = (1e3 * all[filled.len()].most).into();
        let share = f64::from(percent).into();
        table.row(std::iter::once(share).chain(rms).chain([most]));
    }
    findings.table(table);
    findings.plot(Plot {
        name: name.to_owned(),
        title: format!("Error of hidden markers, gaps of {title}"),
        x: Axis::new("hidden, %"),
        y: Axis::new("rms error, mm"),
        series: series.into(),
    });
    Ok(())
}

/// Uniform numbers in [0, 1), always the same.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// What is seen of a take where each marker vanishes and returns by chance: gaps of this mean length, as long as makes
/// the share. The first and the last quarter of a second are seen whole, so that every gap has two ends.
fn hidden(take: &Take, percent: u32, length: u32) -> Vec<Vec<bool>> {
    let share = f64::from(percent) / 100.0;
    let returns = f64::from(length).recip();
    let vanishes = returns * share / (1.0 - share);
    let mut chance = Chance(u64::from(percent) << 8 | u64::from(length));
    let points = take.labels().len();
    let mut now = vec![true; points];
    let whole = 30..take.frames() - 30;
    let mut step = |frame: usize| -> Vec<bool> {
        for seen in &mut now {
            *seen = match (length, *seen) {
                (1, _) => chance.next() >= share,
                (_, true) => chance.next() >= vanishes,
                (_, false) => chance.next() < returns,
            } || !whole.contains(&frame);
        }
        now.clone()
    };
    (0..take.frames()).map(&mut step).collect()
}

type Filled = Vec<Vec<Vector3<f64>>>;

/// * `ahead` - how many frames are here when one is due.
fn tracked(take: &Take, seen: &[Vec<bool>], ahead: usize) -> Result<Filled, Failure> {
    let rest = take.frame(0).0.to_vec();
    let mut world = World::build(Scene {
        title: String::new(),
        motion: Motion::External(ExternalPoints {
            labels: take.labels().to_vec(),
            rest: rest.clone(),
            absent: Vec::new(),
            tracking: Tracking::default(),
        }),
        mesh: MeshSource::Grid(worlds::cloud(rest)),
        mapping: worlds::mapping(Filter::KeepK(1), Rule::Direct),
        rules: Vec::new(),
        time_step: take.rate_hz().recip(),
        up: UpAxis::Z,
        probes: Vec::new(),
    })?;
    let mut buffer = Buffer::new(64, BRIDGE, Tracking::default().max_speed_change);
    let mut filled = Filled::new();
    let time = |frame: usize| frame as f64 / take.rate_hz();
    let mut came = 0;
    for frame in 0..take.frames() {
        while came < take.frames().min(frame + ahead + 1) {
            buffer.insert(MotionSample {
                sequence: came as u64 + 1,
                time: time(came),
                positions: take.frame(came).0.to_vec(),
                seen: seen[came].clone(),
            });
            came += 1;
        }
        let sample = buffer.at(time(frame));
        filled.push(world.step(sample.as_ref())?.points.clone());
    }
    Ok(filled)
}

/// Fills each gap by a function of the frames of the last two samples before it, the first two after it, and the frame
/// between.
fn by_neighbours(
    take: &Take,
    seen: &[Vec<bool>],
    fill: impl Fn([usize; 4], usize, &dyn Fn(usize) -> Vector3<f64>) -> Vector3<f64>,
) -> Filled {
    let mut filled: Filled = (0..take.frames())
        .map(|frame| take.frame(frame).0.to_vec())
        .collect();
    for point in 0..take.labels().len() {
        let samples: Vec<usize> = (0..take.frames())
            .filter(|&frame| seen[frame][point])
            .collect();
        let at = |frame: usize| take.frame(frame).0[point];
        for frame in (0..take.frames()).filter(|&frame| !seen[frame][point]) {
            let after = samples.partition_point(|&sample| sample < frame);
            let ends = [after - 2, after - 1, after, after + 1].map(|i| samples[i]);
            filled[frame][point] = fill(ends, frame, &at);
        }
    }
    filled
}

fn hold(take: &Take, seen: &[Vec<bool>]) -> Filled {
    by_neighbours(take, seen, |[_, before, ..], _, at| at(before))
}

fn linear(take: &Take, seen: &[Vec<bool>]) -> Filled {
    by_neighbours(take, seen, |[_, a, b, _], frame, at| {
        at(a).lerp(&at(b), (frame - a) as f64 / (b - a) as f64)
    })
}

/// Hermite's cubic between the gap's ends, with the speeds that the samples beyond them tell.
fn spline(take: &Take, seen: &[Vec<bool>]) -> Filled {
    by_neighbours(take, seen, |[before, a, b, after], frame, at| {
        let length = (b - a) as f64;
        let t = (frame - a) as f64 / length;
        let start = (at(a) - at(before)) * (length / (a - before) as f64);
        let end = (at(after) - at(b)) * (length / (after - b) as f64);
        let (t2, t3) = (t * t, t * t * t);
        at(a) * (2.0 * t3 - 3.0 * t2 + 1.0)
            + start * (t3 - 2.0 * t2 + t)
            + at(b) * (3.0 * t2 - 2.0 * t3)
            + end * (t3 - t2)
    })
}

/// Of hidden samples, m.
#[derive(Clone, Copy)]
struct Errors {
    rms: f64,
    most: f64,
}

impl Errors {
    fn of(take: &Take, seen: &[Vec<bool>], filled: &Filled) -> Self {
        let (mut sum, mut count, mut most) = (0.0, 0_u32, 0.0_f64);
        for (frame, (seen, filled)) in seen.iter().zip(filled).enumerate() {
            let truth = take.frame(frame).0;
            for (point, _) in seen.iter().enumerate().filter(|(_, seen)| !**seen) {
                let error = (filled[point] - truth[point]).norm();
                sum += error * error;
                count += 1;
                most = most.max(error);
            }
        }
        let rms = (sum / f64::from(count.max(1))).sqrt();
        Self { rms, most }
    }
}
