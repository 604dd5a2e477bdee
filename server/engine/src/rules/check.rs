//! What a rule must be.

use std::{collections::BTreeSet, fmt::Display};

use nalgebra::Vector3;
use sinew_mesh::Cell;

use super::middle;
use crate::{
    build::refuse,
    gauge::{CellGauge, FitGauge, GapGauge, Gauge, Kind, Latch, PairGauge, Scale},
    rest::Rest,
    rule::{Action, Limits, Measure, Pairs, Strain, TopologyRule},
    scene::{Metric, SceneError, Weighting},
};

/// Most pairs of points that one rule watches.
const PAIRS: usize = 1 << 20;

/// One rule's check.
pub(super) struct Check<'a> {
    rest: &'a Rest,
    scale: &'a Scale<'a>,
    /// Whether the mapping weighs along paths, which end where the mesh has come apart.
    floods: bool,
    field: String,
}

impl<'a> Check<'a> {
    pub(super) fn new(
        rule: usize,
        rest: &'a Rest,
        scale: &'a Scale<'a>,
        weighting: &Weighting,
    ) -> Self {
        Self {
            rest,
            scale,
            floods: weighting.metric != Metric::Straight,
            field: format!("scene.rules[{rule}]"),
        }
    }

    fn refuse(
        &self,
        reason: &'static str,
        field: &str,
        problem: impl Display,
        remedy: impl Display,
    ) -> SceneError {
        refuse(reason, format!("{}.{field}", self.field), problem, remedy)
    }

    /// Checks a rule and makes its gauge.
    pub(super) fn gauge(&self, rule: &TopologyRule) -> Result<Gauge, SceneError> {
        self.level(rule)?;
        self.limits(&rule.limits)?;
        self.action(rule)?;
        let latch = Latch {
            threshold: rule.threshold,
            rearm: rule.threshold - rule.hysteresis,
        };
        let cells = |kind, strain| {
            let watched = self.cells(&rule.limits)?;
            Ok(Gauge::Cells(CellGauge::new(
                kind, strain, latch, &watched, self.scale,
            )))
        };
        match &rule.measure {
            Measure::Points { strain, pairs } => {
                let pairs = self.pairs(pairs, &rule.limits)?;
                Ok(Gauge::Pairs(PairGauge::new(
                    *strain,
                    latch,
                    pairs,
                    &self.rest.points,
                )))
            }
            Measure::Edges(strain) => cells(Kind::Edges, *strain),
            Measure::Faces(strain) => cells(Kind::Faces, *strain),
            Measure::Volumes(strain) => cells(Kind::Volume, *strain),
            Measure::Fit if !self.fits() => {
                let problem =
                    "measures how points fit a rigid motion from rest, and the mapping fits none";
                let remedy = "use a shape matching rule with the initial reference in scene.mapping, or measure edges, faces or volumes";
                Err(self.refuse("RULE_UNFIT", "measure.fit", problem, remedy))
            }
            Measure::Fit => Ok(Gauge::Fit(FitGauge::new(latch, self.cells(&rule.limits)?))),
            Measure::Gaps => {
                self.seam(&rule.limits.seam)?;
                let apart = rule.threshold + rule.hysteresis;
                Ok(Gauge::Gaps(GapGauge::new(rule.threshold, apart)))
            }
        }
    }

    /// What is measured must be what is acted on.
    fn action(&self, rule: &TopologyRule) -> Result<(), SceneError> {
        let of_points = matches!(rule.measure, Measure::Points { .. });
        let of_gaps = rule.measure == Measure::Gaps;
        match rule.action {
            Action::Glue if !of_gaps => {
                let problem =
                    "makes one of the two sides of a gap, and the measure is of something else";
                Err(self.refuse("RULE_UNFIT", "action", problem, "measure gaps"))
            }
            Action::Open | Action::Remove | Action::Subdivide | Action::Separate if of_gaps => {
                let problem = "acts where a measure grows, and gaps are measured to close them";
                let remedy = "glue, or report";
                Err(self.refuse("RULE_UNFIT", "action", problem, remedy))
            }
            Action::Open | Action::Remove | Action::Subdivide if of_points => {
                let problem = "acts on measured cells, and the measure is of points";
                let remedy = "measure edges, faces or volumes, or report";
                Err(self.refuse("RULE_UNFIT", "action", problem, remedy))
            }
            Action::Separate if of_points && !self.floods => {
                let problem = "tears between areas, and the mapping weighs points by straight distances, which lead through a tear: its two sides would go on moving alike";
                let remedy = "use scene.mapping.weighting.flood, or measure cells and open them";
                Err(self.refuse("RULE_UNFIT", "action", problem, remedy))
            }
            Action::Separate if !of_points => {
                let problem = "tears between two points, and the measure is of cells";
                let remedy = "measure points, or open the measured cells";
                Err(self.refuse("RULE_UNFIT", "action", problem, remedy))
            }
            Action::Report
            | Action::Separate
            | Action::Open
            | Action::Remove
            | Action::Subdivide
            | Action::Glue => Ok(()),
        }
    }

    /// Whether the mapping fits motions to the rest pose.
    fn fits(&self) -> bool {
        let binding = self.scale.binding;
        binding.previous().is_none() && !binding.rotations().is_empty()
    }

    fn level(&self, rule: &TopologyRule) -> Result<(), SceneError> {
        let TopologyRule {
            threshold,
            hysteresis,
            ..
        } = *rule;
        let of_gaps = rule.measure == Measure::Gaps;
        if !(threshold.is_finite() && threshold > 0.0) {
            let problem = format!("is {threshold}");
            let remedy = if of_gaps {
                "give metres, above 0"
            } else {
                "give a share of the size at rest, above 0"
            };
            return Err(self.refuse("VALUE_OUT_OF_RANGE", "threshold", problem, remedy));
        }
        let shrinks = match &rule.measure {
            Measure::Points { strain, .. } | Measure::Edges(strain) | Measure::Faces(strain) => {
                *strain == Strain::Compression
            }
            Measure::Volumes(_) | Measure::Fit | Measure::Gaps => false,
        };
        if shrinks && threshold > 1.0 {
            let problem = format!("is {threshold}, and nothing shrinks by more than all of it");
            return Err(self.refuse("VALUE_OUT_OF_RANGE", "threshold", problem, "give 1 at most"));
        }
        let (most, remedy) = if of_gaps {
            (f64::MAX, "give metres, from 0".to_owned())
        } else {
            let remedy = format!("give 0 to the threshold, which is {threshold}");
            (threshold, remedy)
        };
        if !(0.0..=most).contains(&hysteresis) {
            let problem = format!("is {hysteresis}");
            return Err(self.refuse("VALUE_OUT_OF_RANGE", "hysteresis", problem, remedy));
        }
        Ok(())
    }

    fn limits(&self, limits: &Limits) -> Result<(), SceneError> {
        if let Some(region) = limits.region {
            for (name, corner) in [("min", region.min), ("max", region.max)] {
                if corner.iter().any(|x| x.is_nan()) {
                    let problem = format!("is {:?}", corner.as_slice());
                    let field = format!("limits.region.{name}");
                    return Err(self.refuse("VALUE_NOT_FINITE", &field, problem, "give metres"));
                }
            }
        }
        let (from, until) = (limits.from, limits.until);
        for (name, time) in [("from_seconds", from), ("until_seconds", until)] {
            if let Some(time) = time.filter(|time| !(time.is_finite() && *time >= 0.0)) {
                let (field, problem) = (format!("limits.{name}"), format!("is {time}"));
                let remedy = "give seconds of simulated time, from 0";
                return Err(self.refuse("VALUE_OUT_OF_RANGE", &field, problem, remedy));
            }
        }
        if let (Some(from), Some(until)) = (from, until)
            && from > until
        {
            let problem = format!("is {until}, before from_seconds, which is {from}");
            return Err(self.refuse(
                "VALUE_OUT_OF_RANGE",
                "limits.until_seconds",
                problem,
                "give a later time",
            ));
        }
        Ok(())
    }

    /// Each face of a seam must be one.
    fn seam(&self, seam: &[[u32; 2]]) -> Result<(), SceneError> {
        let cells = self.scale.cells;
        for (i, &[a, b]) in seam.iter().enumerate() {
            let field = format!("limits.seam[{i}]");
            if let Some(beyond) = [a, b].iter().find(|&&cell| cell as usize >= cells.len()) {
                let problem = format!("names cell {beyond}, and there are {}", cells.len());
                let remedy = "give the indices of cells";
                return Err(self.refuse("INDEX_OUT_OF_RANGE", &field, problem, remedy));
            }
            let other = faces(&cells.cell(b as usize));
            let shared = faces(&cells.cell(a as usize))
                .into_iter()
                .any(|face| other.contains(&face));
            if a == b || !shared {
                let problem = format!("names cells {a} and {b}, which share no face");
                let remedy = "give the two cells on the sides of each face";
                return Err(self.refuse("NO_SHARED_FACE", &field, problem, remedy));
            }
        }
        Ok(())
    }

    /// The cells that a rule watches, by slot, ascending.
    fn cells(&self, limits: &Limits) -> Result<Vec<u32>, SceneError> {
        let Scale { cells, rest, .. } = *self.scale;
        self.seam(&limits.seam)?;
        let seam: BTreeSet<u32> = limits.seam.iter().flatten().copied().collect();
        let beside_seam = |slot: &u32| seam.is_empty() || seam.contains(slot);
        let inside = |slot: &u32| limits.contain(&middle(cells, *slot, rest));
        let watched: Vec<u32> = (0..)
            .take(cells.len())
            .filter(|slot| beside_seam(slot) && inside(slot))
            .collect();
        if watched.is_empty() {
            return Err(self.nothing("no cell"));
        }
        Ok(watched)
    }

    /// The pairs of points that a rule watches.
    fn pairs(&self, pairs: &Pairs, limits: &Limits) -> Result<Vec<[u32; 2]>, SceneError> {
        let Rest {
            points, present, ..
        } = self.rest;
        let middle = |[a, b]: [u32; 2]| points[a as usize].lerp(&points[b as usize], 0.5);
        let found = match pairs {
            Pairs::Named(named) => {
                let pairs = named
                    .iter()
                    .enumerate()
                    .map(|(i, pair)| self.named(i, pair));
                pairs.collect::<Result<Vec<_>, _>>()?
            }
            &Pairs::Within(reach) => {
                if !(reach.is_finite() && reach > 0.0) {
                    let problem = format!("is {reach}");
                    let remedy = "give a positive number of metres";
                    return Err(self.refuse(
                        "VALUE_OUT_OF_RANGE",
                        "measure.points.within",
                        problem,
                        remedy,
                    ));
                }
                near(points, present, reach)
            }
        };
        let found: Vec<_> = found
            .into_iter()
            .filter(|&pair| limits.contain(&middle(pair)))
            .collect();
        if found.is_empty() {
            return Err(self.nothing("no pair of points"));
        }
        if found.len() > PAIRS {
            let problem = format!("makes more than {PAIRS} pairs");
            return Err(self.refuse(
                "TOO_MANY_PAIRS",
                "measure.points.within",
                problem,
                "give a shorter reach",
            ));
        }
        Ok(found)
    }

    fn named(&self, i: usize, labels: &[String; 2]) -> Result<[u32; 2], SceneError> {
        let Rest {
            labels: known,
            points,
            present,
            ..
        } = self.rest;
        let mut pair = [0; 2];
        for (label, index) in labels.iter().zip(&mut pair) {
            let field = format!("measure.points.pairs[{i}]");
            let Some(found) = known.iter().position(|known| known == label) else {
                let problem = format!("names `{label}`, which no point is called");
                return Err(self.refuse(
                    "LABEL_UNKNOWN",
                    &field,
                    problem,
                    "use the labels of the scene's points",
                ));
            };
            if !present[found] {
                let problem = format!("names `{label}`, which has no rest position");
                return Err(self.refuse(
                    "POINT_ABSENT",
                    &field,
                    problem,
                    "measure points that have one",
                ));
            }
            *index = u32::try_from(found).expect("points are counted by u32");
        }
        if points[pair[0] as usize] == points[pair[1] as usize] {
            let problem = format!(
                "names `{}` and `{}`, which are in one place at rest",
                labels[0], labels[1]
            );
            let field = format!("measure.points.pairs[{i}]");
            return Err(self.refuse(
                "POINTS_COINCIDE",
                &field,
                problem,
                "measure points that are apart",
            ));
        }
        Ok(pair)
    }

    fn nothing(&self, what: &str) -> SceneError {
        let problem = format!("leave {what} to watch");
        self.refuse(
            "RULE_EMPTY",
            "limits",
            problem,
            "widen them, or take the rule out",
        )
    }
}

/// The pairs of points that are apart, but no more than `reach`, m, at rest; at most one more than [`PAIRS`].
fn near(points: &[Vector3<f64>], present: &[bool], reach: f64) -> Vec<[u32; 2]> {
    let mut order: Vec<u32> = (0..)
        .zip(present)
        .filter(|(_, present)| **present)
        .map(|(i, _)| i)
        .collect();
    let at = |i: u32| points[i as usize];
    order.sort_by(|&a, &b| at(a).x.total_cmp(&at(b).x));
    let beyond = |n: usize| {
        let (here, order) = (order[n], &order);
        let slab = order[n + 1..]
            .iter()
            .take_while(move |&&other| at(other).x - at(here).x <= reach);
        slab.filter_map(move |&other| {
            let apart = (at(here) - at(other)).norm();
            (apart > 0.0 && apart <= reach).then_some([here.min(other), here.max(other)])
        })
    };
    let mut pairs: Vec<_> = (0..order.len()).flat_map(beyond).take(PAIRS + 1).collect();
    pairs.sort_unstable();
    pairs
}

/// The sets of vertices of a cell's faces.
fn faces(cell: &Cell<'_>) -> Vec<BTreeSet<u32>> {
    cell.faces().map(|face| face.vertices().collect()).collect()
}
