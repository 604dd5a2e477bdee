//! The rules of a scene at work: what they watch, and what they want done.

mod check;

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use sinew_mesh::Cells;
use sinew_tearing::{Body, Facet, Patch, Request};

use self::check::Check;
use crate::{
    change::{Event, EventKind},
    digest::Digest,
    frame::{Doubt, Measured, PointState},
    gauge::{Crossings, GapCrossing, Gauge, Moment, PairCrossing, Scale, Standings, Turn},
    rest::Rest,
    rule::{Action, TopologyRule},
    scene::{Metric, SceneError, Weighting},
    topology::Ask,
};

/// The rules of a scene, and what they know of the steps before.
#[derive(Clone, Debug)]
pub(crate) struct Rules {
    rules: Vec<(TopologyRule, Gauge)>,
    standings: Standings,
}

/// One step.
pub(crate) struct Step<'a> {
    /// Simulated, s.
    pub(crate) time: f64,
    pub(crate) states: &'a [PointState],
    /// What of the points was not believed.
    pub(crate) doubts: &'a [(u32, Doubt)],
    /// m
    pub(crate) points: &'a [Vector3<f64>],
    /// m
    pub(crate) vertices: &'a [Vector3<f64>],
    /// Whether the vertices are those that the binding alone makes of the points.
    pub(crate) posed_alone: bool,
}

impl Rules {
    /// Checks rules against a mesh at rest.
    ///
    /// # Errors
    /// [`SceneError`], whose field is below `scene.rules`.
    pub(crate) fn new(
        rules: Vec<TopologyRule>,
        rest: &Rest,
        scale: &Scale<'_>,
        weighting: &Weighting,
    ) -> Result<Self, SceneError> {
        let compile = |(i, rule): (usize, TopologyRule)| {
            let gauge = Check::new(i, rest, scale, weighting).gauge(&rule)?;
            Ok((rule, gauge))
        };
        let rules = rules.into_iter().enumerate().map(compile);
        Ok(Self {
            rules: rules.collect::<Result<_, _>>()?,
            standings: Standings::new(rest.points.len()),
        })
    }

    /// Whether a rule tears along frontiers, of which a mapping with this metric shows nothing.
    pub(crate) fn cannot_show(&self, metric: &Metric) -> bool {
        let separates = |(rule, _): &(TopologyRule, Gauge)| rule.action == Action::Separate;
        *metric == Metric::Straight && self.rules.iter().any(separates)
    }

    /// Measures a step: what crosses a threshold, by rule, and what is to be done about it.
    pub(crate) fn measure(
        &mut self,
        step: &Step<'_>,
        scale: Scale<'_>,
        body: Option<&Body>,
        measures: &mut Vec<Measured>,
    ) -> (Vec<Event>, Vec<Ask>) {
        let &Step {
            time,
            states,
            doubts,
            points,
            vertices,
            posed_alone,
        } = step;
        let standing = self.standings.judge(states, doubts);
        let moment = Moment {
            scale,
            vertices,
            points,
            standing,
            posed_alone,
        };
        let (mut events, mut asks) = (Vec::new(), Vec::new());
        for (index, (rule, gauge)) in (0..).zip(&mut self.rules) {
            if !rule.limits.open_at(time) {
                continue;
            }
            let threshold = rule.threshold;
            let (greatest, crossings) = gauge.measure(&moment);
            measures.extend(greatest.map(|greatest| Measured {
                rule: index,
                greatest,
                threshold,
            }));
            for finding in findings(crossings, &moment, body) {
                let request = body.and_then(|body| request(rule, &finding, body));
                let (measured, position) = (finding.measured, finding.position);
                asks.extend(request.map(|request| Ask {
                    request,
                    rule: Some(index),
                    position,
                }));
                events.push(Event {
                    kind: EventKind::Crossed {
                        measured,
                        threshold,
                    },
                    rule: Some(index),
                    position,
                    cells: finding.cells,
                });
            }
        }
        (events, asks)
    }

    /// Takes over cells that changed.
    pub(crate) fn follow(&mut self, patch: &Patch, body: &Body, cells: usize, scale: &Scale<'_>) {
        for (rule, gauge) in &mut self.rules {
            let limits = &rule.limits;
            let inside = |slot| limits.contain(&middle(scale.cells, slot, scale.rest));
            let admits = &|slot| limits.seam.is_empty() && inside(slot);
            let parts = &|[a, b]: [u32; 2]| {
                let seam = &limits.seam;
                let in_seam = seam.contains(&[a, b]) || seam.contains(&[b, a]);
                (seam.is_empty() || in_seam) && (inside(a) || inside(b))
            };
            let turn = Turn {
                patch,
                body,
                cells,
                admits,
                parts,
            };
            gauge.follow(&turn, scale);
        }
    }

    /// Takes over a binding that changed.
    pub(crate) fn rebind(&mut self, scale: &Scale<'_>) {
        for (_, gauge) in &mut self.rules {
            gauge.rebind(scale);
        }
    }

    /// All of the past that the next measures depend on.
    pub(crate) fn digest(&self, digest: &mut Digest) {
        self.standings.digest(digest);
        for (_, gauge) in &self.rules {
            gauge.digest(digest);
        }
    }
}

/// What crosses a threshold together: one pair of points, all cells of a step, or all gaps between two fragments.
struct Finding {
    /// The greatest among them.
    measured: f64,
    /// Where that is, m.
    position: Vector3<f64>,
    points: Option<[u32; 2]>,
    /// The two sides of faces.
    facets: Vec<[Facet; 2]>,
    /// By slot, ascending.
    cells: Vec<u32>,
}

/// Gaps by the fragments on their sides, in the order of these: what is glued in one piece.
fn by_fragments(
    gaps: Vec<GapCrossing>,
    body: Option<&Body>,
) -> BTreeMap<[Option<u32>; 2], Vec<GapCrossing>> {
    let mut groups = BTreeMap::<_, Vec<_>>::new();
    for gap in gaps {
        let fragment = |side: &Facet| body.and_then(|body| body.fragment(side.cell));
        let [one, other] = [&gap.sides[0], &gap.sides[1]].map(fragment);
        let between = [one.min(other), one.max(other)];
        groups.entry(between).or_default().push(gap);
    }
    groups
}

fn findings(crossings: Crossings, moment: &Moment<'_>, body: Option<&Body>) -> Vec<Finding> {
    match crossings {
        Crossings::Pairs(pairs) => {
            let finding = |pair: PairCrossing| {
                let [a, b] = pair.points.map(|point| moment.points[point as usize]);
                Finding {
                    measured: pair.measured,
                    position: a.lerp(&b, 0.5),
                    points: Some(pair.points),
                    facets: Vec::new(),
                    cells: Vec::new(),
                }
            };
            pairs.into_iter().map(finding).collect()
        }
        Crossings::Cells(cells) => {
            let worst = (cells.iter()).max_by(|a, b| a.measured.total_cmp(&b.measured));
            let finding = worst.map(|worst| Finding {
                measured: worst.measured,
                position: middle(moment.scale.cells, worst.cell, moment.vertices),
                points: None,
                facets: Vec::new(),
                cells: cells.iter().map(|crossing| crossing.cell).collect(),
            });
            finding.into_iter().collect()
        }
        Crossings::Gaps(gaps) => {
            let mut findings: Vec<Finding> = Vec::new();
            for (_, gaps) in by_fragments(gaps, body) {
                let widest = gaps.iter().max_by(|a, b| a.measured.total_cmp(&b.measured));
                let widest = widest.expect("a group has a member");
                let vertices = widest.sides.iter().flat_map(|side| &side.vertices);
                let sum: Vector3<f64> = vertices.map(|&v| moment.vertices[v as usize]).sum();
                let count = 2 * widest.sides[0].vertices.len();
                let slots = gaps.iter().flat_map(|gap| &gap.sides).map(|side| side.cell);
                let cells: BTreeSet<u32> = slots.collect();
                findings.push(Finding {
                    measured: widest.measured,
                    position: sum / count as f64,
                    points: None,
                    cells: cells.into_iter().collect(),
                    facets: gaps.into_iter().map(|gap| gap.sides).collect(),
                });
            }
            findings
        }
    }
}

/// What a rule wants done about a finding; `None` where there is nothing to do.
fn request(rule: &TopologyRule, finding: &Finding, body: &Body) -> Option<Request> {
    let cells = &finding.cells;
    match rule.action {
        Action::Report => None,
        Action::Separate => finding.points.map(|points| Request::Separate { points }),
        Action::Open => {
            let around = |&cell: &u32| {
                let beside = body.beside(cell).into_iter();
                beside.map(move |other| [cell.min(other), cell.max(other)])
            };
            let mut facets: Vec<_> = cells.iter().flat_map(around).collect();
            let seam = &rule.limits.seam;
            facets.retain(|[a, b]| {
                seam.is_empty() || seam.contains(&[*a, *b]) || seam.contains(&[*b, *a])
            });
            facets.sort_unstable();
            facets.dedup();
            (!facets.is_empty()).then_some(Request::Open { facets })
        }
        Action::Remove => Some(Request::Remove {
            cells: cells.clone(),
        }),
        Action::Subdivide => Some(Request::Subdivide {
            cells: cells.clone(),
        }),
        Action::Glue => Some(Request::Glue {
            facets: finding.facets.clone(),
        }),
    }
}

/// The mean of a cell's vertices, m.
fn middle(cells: &Cells, cell: u32, positions: &[Vector3<f64>]) -> Vector3<f64> {
    let vertices = cells.cell(cell as usize).vertices;
    let sum: Vector3<f64> = vertices
        .iter()
        .map(|&vertex| positions[vertex as usize])
        .sum();
    sum / vertices.len() as f64
}
