//! What it costs to measure, and to come apart.

use nalgebra::Vector3;
use sinew_engine::{
    Action, Cost, Dimension, Filter, Frame, Limits, Mapping, Measure, Metric, Pairs, Patch, Paths,
    Request, Roots, Rule, Scene, Start, Strain, TopologyRule, Weighting, World,
};
use sinew_mesh::{Cells, shapes};

use crate::{
    fields::{TWIST, scattered},
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Section, Table, digits},
    timing::{Spread, by_turns, exponent, time, with_threads},
    worlds::{self, RIGID, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "tearing",
    title: "Tearing",
    measure,
};

/// Cubes along each edge, six tetrahedra each: 10,368 to 998,250 cells; and how many events happen at each size.
const SIZES: [(usize, u32); 3] = [(12, 21), (26, 15), (55, 5)];
/// For each rule that measures, s.
const BUDGET: f64 = 0.5;
/// To 1,000 cells.
const POINTS: usize = 8;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "Boxes of tetrahedra follow 8 points to 1,000 cells, eight of them each vertex, on one thread, in processor time. An \
         event opens up to eight cells, one beside the other, against their neighbours; its time holds the edit of the map, \
         the patch, what is bound anew and the pose, not the plain step that goes before it. Bytes are those of the columns \
         that travel: of a keyframe cells and positions, of a patch what it changes and the positions of that step, all \
         positions as binary32.",
    );
    findings.text(
        "What measures cost is shown at its worst: at every step all points leap between a fifth and two fifths of a twist, \
         so that what is known of how far cells are from a threshold is soon used up.",
    );
    findings.table(with_threads(1, measures)?);
    let mut growth = Plot {
        name: "events".to_owned(),
        title: "An event and a plain step against the size of the mesh".to_owned(),
        x: Axis::new("cells"),
        y: Axis::new("time, ms, one thread"),
        series: Vec::new(),
    };
    let mut table = Table::new(
        "A step with an event",
        [
            "mapping",
            "cells",
            "touched",
            "step, ms",
            "event, ms",
            "with event over plain",
            "all bound anew over event",
            "keyframe over patch, bytes",
            "the same without positions",
            "events per second",
        ],
    );
    for (name, ink, mapping) in mappings() {
        let sizes = with_threads(1, || {
            let sizes = SIZES.iter();
            sizes
                .map(|&size| events(size, &mapping))
                .collect::<Result<Vec<_>, _>>()
        })?;
        for size in &sizes {
            table.row(size.row(name));
        }
        let ends = [("event", ink), ("plain step", Ink::Grey)];
        for ((what, ink), of) in ends
            .into_iter()
            .zip([Size::event as fn(&Size) -> f64, Size::step])
        {
            growth
                .series
                .push(series(&format!("{name}, {what}"), ink, &sizes, of));
        }
    }
    findings.plot(growth);
    findings.table(table);
    Ok(findings)
}

fn mappings() -> [(&'static str, Ink, Mapping); 3] {
    let flood = Weighting {
        metric: Metric::Paths(Paths {
            arcs: Dimension::Edge,
            roots: Roots::Nearest,
            start: Start::Distance,
            cost: Cost::Length,
        }),
        ..Weighting::default()
    };
    let eight = Filter::KeepK(8);
    [
        (
            "straight",
            Ink::Blue,
            worlds::mapping(eight.clone(), Rule::WeightedMean),
        ),
        (
            "shape matching",
            Ink::Green,
            worlds::mapping(eight.clone(), RIGID),
        ),
        (
            "flood",
            Ink::Vermilion,
            worlds::by(flood, eight, Rule::WeightedMean),
        ),
    ]
}

fn rule(measure: Measure, threshold: f64, action: Action) -> TopologyRule {
    TopologyRule {
        measure,
        threshold,
        hysteresis: 0.0,
        limits: Limits::default(),
        action,
    }
}

/// Steps of a twisting box, without rules and with one of each measure.
fn measures() -> Result<Table, Failure> {
    let cubes = SIZES[1].0;
    let grid = shapes::tetrahedra(cubes, cubes, cubes);
    let rest = scattered(POINTS * grid.cells.len() / 1000);
    let poses = [0.2, 0.4].map(|part| {
        let there = moved(&rest, &TWIST);
        let poses = rest
            .iter()
            .zip(there)
            .map(|(from, to)| from.lerp(&to, part));
        poses.collect::<Vec<_>>()
    });
    let measures = [
        (
            "points",
            Measure::Points {
                strain: Strain::Elongation,
                pairs: Pairs::Within(0.2),
            },
        ),
        ("edges", Measure::Edges(Strain::Elongation)),
        ("faces", Measure::Faces(Strain::Elongation)),
        ("volumes", Measure::Volumes(Strain::Elongation)),
        ("fit", Measure::Fit),
    ];
    let mut table = Table::new(
        format!(
            "Measuring {} cells at each step, as a part of the same step without rules",
            6 * cubes.pow(3)
        ),
        [
            "measure",
            "far from the threshold",
            "just below it",
            "all of it measured",
        ],
    );
    for (name, measure) in measures {
        let rule = match measure {
            Measure::Fit => RIGID,
            Measure::Points { .. }
            | Measure::Edges(_)
            | Measure::Faces(_)
            | Measure::Volumes(_)
            | Measure::Gaps => Rule::WeightedMean,
        };
        let mapping = worlds::mapping(Filter::KeepK(8), rule);
        let scene = worlds::scene(grid.clone(), &rest, mapping);
        let parts = parts_of_a_step(&scene, &measure, &poses)?;
        table.row([name.into()].into_iter().chain(parts.map(Cell::from)));
    }
    Ok(table)
}

/// What a measure adds to a step over that step: far from its threshold, just below it, and beyond it everywhere.
fn parts_of_a_step(
    scene: &Scene,
    measure: &Measure,
    poses: &[Vec<Vector3<f64>>],
) -> Result<[Spread; 3], Failure> {
    const BEYOND: f64 = 1e-6;
    let world = |threshold: Option<f64>| {
        let rules = threshold.map(|threshold| rule(measure.clone(), threshold, Action::Report));
        World::build(Scene {
            rules: rules.into_iter().collect(),
            ..scene.clone()
        })
    };
    let mut seen = world(Some(BEYOND))?;
    let measured = poses.iter().map(|pose| {
        let frame = move_to(&mut seen, pose);
        frame.measures[0].greatest
    });
    let greatest = measured.fold(0.0, f64::max);
    let thresholds = [
        None,
        Some(20.0 * greatest),
        Some(1.05 * greatest),
        Some(BEYOND),
    ];
    let worlds = thresholds.into_iter().map(world);
    let mut worlds = worlds.collect::<Result<Vec<_>, _>>()?;
    let steps = worlds.iter_mut().map(|world| {
        let mut poses = poses.iter().cycle();
        move || {
            let pose = poses.next().expect("a cycle has no end");
            drop(move_to(world, pose));
        }
    });
    let mut steps: Vec<_> = steps.collect();
    let mut contenders: Vec<_> = steps
        .iter_mut()
        .map(|step| step as &mut dyn FnMut())
        .collect();
    let seconds = by_turns(BUDGET, &mut contenders);
    Ok([1, 2, 3].map(|at| {
        let pairs = seconds[at].iter().zip(&seconds[0]);
        let more: Vec<_> = pairs.map(|(with, without)| with - without).collect();
        Spread::of_ratio(&more, &seconds[0])
    }))
}

/// What events cost at one size.
struct Size {
    cells: f64,
    touched: f64,
    step: Spread,
    event: Spread,
    bind: Spread,
    /// Bytes of the whole and of a patch, with positions.
    bytes: [f64; 2],
    /// Of which positions.
    positions: f64,
}

impl Size {
    fn event(&self) -> f64 {
        self.event.median
    }

    fn step(&self) -> f64 {
        self.step.median
    }

    fn row(&self, name: &'static str) -> Vec<Cell> {
        let (step, event) = (self.step.median, self.event.median);
        let [whole, patch] = self.bytes;
        vec![
            name.into(),
            format!("{}", self.cells).into(),
            self.touched.into(),
            self.step.times(1e3).into(),
            self.event.times(1e3).into(),
            ((step + event) / step).into(),
            (self.bind.median / event).into(),
            (whole / patch).into(),
            ((whole - self.positions) / (patch - self.positions)).into(),
            (1.0 / (step + event)).into(),
        ]
    }
}

fn events((cubes, count): (usize, u32), mapping: &Mapping) -> Result<Size, Failure> {
    let grid = shapes::tetrahedra(cubes, cubes, cubes);
    let cells = grid.cells.len();
    let rest = scattered(POINTS * cells / 1000);
    let scene = worlds::scene(grid, &rest, mapping.clone());
    let far = rule(Measure::Edges(Strain::Elongation), 10.0, Action::Open);
    let mut world = World::build(Scene {
        rules: vec![far],
        ..scene
    })?;
    let (mut steps, mut events, mut touched, mut bytes) =
        (Vec::new(), Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    let mut positions = 0.0;
    for at in 0..count {
        let by = Vector3::new(1e-3 * f64::from(at), 0.0, 0.0);
        let now: Vec<_> = rest.iter().map(|p| p + by).collect();
        for _ in 0..2 {
            steps.push(time(|| drop(move_to(&mut world, &now))));
        }
        let places = 2 * u32::try_from(cells)? / (2 * count);
        let request = crack(&world.frame(), at * places);
        let mut edited = None;
        events.push(time(|| edited = world.edit(vec![request]).ok()));
        let frame = edited
            .and_then(|edited| edited.frame)
            .ok_or("an event that opens nothing")?;
        let change = frame.change.as_ref().ok_or("an event without a change")?;
        let patch = change.patch.as_ref().ok_or("an event without a patch")?;
        touched.push(patch.slots.len() as f64);
        positions = 12.0 * frame.vertices.len() as f64;
        bytes[0].push(cell_bytes(&frame.layout.cells) + positions);
        bytes[1].push(patch_bytes(patch) + positions);
    }
    let pose = world.rest();
    // Long enough by itself on large meshes.
    let bind = (0..count / 5).map(|_| time(|| drop(pose.bind(mapping.clone()))));
    Ok(Size {
        cells: cells as f64,
        touched: Spread::of(&touched).median,
        step: Spread::of(&steps),
        event: Spread::of(&events),
        bind: Spread::of(&bind.collect::<Vec<_>>()),
        bytes: bytes.map(|bytes| Spread::of(&bytes).median),
        positions,
    })
}

/// Opens up to eight cells against their neighbours among those after them.
fn crack(frame: &Frame, first: u32) -> Request {
    let cells = &frame.layout.cells;
    let faces = |cell: u32| -> Vec<Vec<u32>> {
        let faces = cells.cell(cell as usize).faces().map(|face| {
            let mut face: Vec<u32> = face.vertices().collect();
            face.sort_unstable();
            face
        });
        faces.collect()
    };
    let mut facets = Vec::new();
    for one in first..first + 8 {
        for other in one + 1..first + 16 {
            let theirs = faces(other);
            if faces(one).iter().any(|face| theirs.contains(face)) {
                facets.push([one, other]);
            }
        }
    }
    Request::Open { facets }
}

fn cell_bytes(cells: &Cells) -> f64 {
    let Cells {
        types,
        connectivity,
        offsets,
        faces,
        face_offsets,
    } = cells;
    let words = connectivity.len() + offsets.len() + faces.len() + face_offsets.len();
    (types.len() + 4 * words) as f64
}

fn patch_bytes(patch: &Patch) -> f64 {
    let seams = patch
        .seams
        .iter()
        .map(|seam| 1 + 4 * (3 + seam.vertices.len()));
    let words = patch.vertex_parents.len()
        + patch.vertex_parent_offsets.len()
        + patch.slots.len()
        + patch.cell_parents.len();
    cell_bytes(&patch.cells) + (4 * words + seams.sum::<usize>()) as f64
}

fn series(label: &str, ink: Ink, sizes: &[Size], of: fn(&Size) -> f64) -> Series {
    let points: Vec<_> = sizes.iter().map(|size| (size.cells, of(size))).collect();
    let point = |&(cells, seconds): &(f64, f64)| Point {
        x: cells,
        y: 1e3 * seconds,
        note: format!("{cells} cells, {} ms", digits(1e3 * seconds)),
    };
    Series {
        label: format!("{label}: e = {}", digits(exponent(&points))),
        ink,
        points: points.iter().map(point).collect(),
    }
}
