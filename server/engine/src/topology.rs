//! Changes of the mesh: from what is asked to what came of it.

use std::sync::Arc;

use nalgebra::Vector3;
use sinew_tearing::{Answer, Body, Done, Effect, Patch, Request, View};

use crate::{
    change::{Change, Event, EventKind},
    frame::{Frame, Layout},
    rest::Rest,
    world::{StepError, World},
};

/// A change that is asked for.
#[derive(Clone, Debug)]
pub(crate) struct Ask {
    pub(crate) request: Request,
    /// The rule that asks, by index; `None` for a client.
    pub(crate) rule: Option<u32>,
    /// Where, m.
    pub(crate) position: Vector3<f64>,
}

/// A mesh that can change.
#[derive(Clone, Debug)]
pub(crate) struct Topology {
    pub(crate) body: Body,
    /// By vertex slot, steps taken when a cell of it changed last; `None` where none did.
    pub(crate) changed_at: Vec<Option<u64>>,
}

impl Topology {
    pub(crate) fn new(body: Body) -> Self {
        let changed_at = vec![None; body.rest().len()];
        Self { body, changed_at }
    }
}

impl World {
    /// Does what is asked, as one change, and poses `next` on what comes of it. Nothing is changed where nothing comes of
    /// it.
    pub(crate) fn change(
        &mut self,
        next: &mut Frame,
        mut events: Vec<Event>,
        asks: &[Ask],
    ) -> Result<Vec<Answer>, StepError> {
        let mut answers = Vec::new();
        let mut patch = None;
        if let Some(topology) = self.topology.as_mut().filter(|_| !asks.is_empty()) {
            let view = View {
                binding: &self.bound.binding,
                points: &self.rest.points,
                now: &next.vertices,
            };
            let requests: Vec<_> = asks.iter().map(|ask| ask.request.clone()).collect();
            let outcome = topology.body.apply(&requests, &view);
            for (ask, answer) in asks.iter().zip(&outcome.answers) {
                events.extend(tell(ask, answer));
            }
            (answers, patch) = (outcome.answers, outcome.patch);
        }
        if let Some(patch) = &patch {
            self.follow(patch, next.step)?;
            next.layout = Arc::clone(&self.layout);
            next.vertices
                .resize(self.rest.vertices.len(), Vector3::zeros());
            self.pose(next)?;
        }
        if !events.is_empty() || patch.is_some() {
            next.change = Some(Arc::new(Change { events, patch }));
        }
        Ok(answers)
    }

    /// Takes over a change of the body: everything that counts vertices or cells.
    fn follow(&mut self, patch: &Patch, step: u64) -> Result<(), StepError> {
        let topology = self.topology.as_mut().expect("what made a patch");
        let body = &topology.body;
        let vertices = body.rest().len();
        topology.changed_at.resize(vertices, None);
        for &vertex in &patch.cells.connectivity {
            topology.changed_at[vertex as usize] = Some(step);
        }
        let rest = Arc::new(Rest {
            version: body.version(),
            vertices: body.rest().to_vec(),
            ..Rest::clone(&self.rest)
        });
        self.bound.follow(&rest, patch)?;
        if let Some(blend) = &mut self.blend {
            blend.follow(&rest, patch)?;
        }
        let cells = self
            .layout
            .cells
            .patched(&patch.slots, &patch.cells, vertices);
        let cells = cells.expect("the body's patches fit its cells");
        if let Some(rules) = &mut self.rules {
            rules.follow(
                patch,
                self.layout.cells.len(),
                &self.bound.scale(&cells, &rest),
            );
        }
        self.layout = Arc::new(Layout {
            epoch: self.layout.epoch,
            topology_version: patch.from_version + 1,
            hash: patch.hash,
            dominant: self.bound.binding.dominant().to_vec(),
            cells,
        });
        self.rest = rest;
        Ok(())
    }
}

/// What came of an ask, as events.
fn tell(ask: &Ask, answer: &Answer) -> Vec<Event> {
    let event = |kind, cells| Event {
        kind,
        rule: ask.rule,
        position: ask.position,
        cells,
    };
    let done = match answer {
        Answer::Applied(done) | Answer::Refined { done, .. } => done,
        Answer::Refused(refusal) => {
            let kind = EventKind::Refused(refusal.to_string());
            return vec![event(kind, refusal.cells().to_vec())];
        }
    };
    let first = event(kind(&ask.request, done), done.cells.clone());
    let effects = done
        .effects
        .iter()
        .map(|effect| event(followed(*effect), Vec::new()));
    std::iter::once(first).chain(effects).collect()
}

fn kind(request: &Request, done: &Done) -> EventKind {
    match request {
        Request::Separate { .. } | Request::Open { .. } => EventKind::Torn { faces: done.opened },
        Request::Glue { .. } | Request::Close { .. } => EventKind::Glued { faces: done.closed },
        Request::Remove { .. } | Request::Collapse { .. } => EventKind::Removed,
        Request::Add { .. } => EventKind::Added,
        Request::Subdivide { .. } | Request::Bisect { .. } => EventKind::Divided,
    }
}

fn followed(effect: Effect) -> EventKind {
    match effect {
        Effect::FragmentBorn {
            fragment,
            parent,
            cells,
        } => EventKind::FragmentBorn {
            fragment,
            parent,
            cells,
        },
        Effect::FragmentsJoined { fragment, absorbed } => {
            EventKind::FragmentsJoined { fragment, absorbed }
        }
        Effect::InnerFracture => EventKind::InnerFracture,
        Effect::FractureOpened => EventKind::FractureOpened,
    }
}
