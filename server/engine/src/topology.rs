//! Changes of the mesh: from what is asked to what came of it.

use std::sync::Arc;

use nalgebra::Vector3;
use sinew_mesh::{Cells, Grid};
use sinew_tearing::{Answer, Body, BodyError, Done, Patch, Refusal, Request, View};

use crate::{
    change::{Change, Event, EventKind},
    digest::Digest,
    frame::{Frame, Layout},
    scene::{Metric, SceneError},
    wiring::Turn,
    world::{StepError, World},
};

/// Why a mesh is not edited. It is as it was, but after [`EditError::Step`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The mesh is none that can change.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The mesh would have to come apart for that.
    #[error(
        "parts of the mesh touch without a face in common; repair it, or give its scene a rule that changes it: it comes apart there when the session is made"
    )]
    NoManifold,
    /// What came of the edit cannot be posed. The world is spent.
    #[error(transparent)]
    Step(#[from] StepError),
}

/// What came of an edit.
#[derive(Clone, Debug)]
pub struct Edited {
    /// One for each request.
    pub answers: Vec<Answer>,
    /// The state afterwards; `None` where all was refused.
    pub frame: Option<Arc<Frame>>,
}

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

    /// What the mesh as it is does not tell of its changes. Nothing before the first.
    pub(crate) fn digest(&self, digest: &mut Digest) {
        if self.body.version() > 0 {
            digest.vectors(self.body.rest());
            let sizes = self.body.fragment_sizes().iter();
            digest.words(&sizes.map(|&size| size.into()).collect::<Vec<_>>());
        }
    }
}

impl World {
    /// Changes the mesh between two steps: each request wholly or not at all, all of them as one change. Points are
    /// separated only where the mapping can show it, as in rules.
    ///
    /// # Errors
    /// [`EditError`].
    pub fn edit(&mut self, requests: Vec<Request>) -> Result<Edited, EditError> {
        if self.topology.is_none() {
            self.topology = Some(Box::new(self.body()?));
        }
        let ask = |request| Ask {
            position: self.place(&request),
            request,
            rule: None,
        };
        let floods = self.bound.mapping.recipe.weighting.metric != Metric::Straight;
        let is_shown = |request: &Request| floods || !matches!(request, Request::Separate { .. });
        let shown: Vec<bool> = requests.iter().map(is_shown).collect();
        let asks: Vec<Ask> = requests.into_iter().filter(is_shown).map(ask).collect();
        let mut next = Frame {
            change: None,
            ..Frame::clone(&self.frame)
        };
        let version = self.layout.topology_version;
        let mut done = self.change(&mut next, Vec::new(), &asks)?.into_iter();
        let refused = || Answer::Refused(Refusal::Straight);
        let answer = |is_shown: bool| {
            let done = is_shown.then(|| done.next()).flatten();
            done.unwrap_or_else(refused)
        };
        let answers = shown.into_iter().map(answer).collect();
        let changed = self.layout.topology_version > version;
        let frame = changed.then(|| self.publish(next));
        Ok(Edited { answers, frame })
    }

    /// The mesh as one that can change, where that changes nothing of it.
    fn body(&self) -> Result<Topology, EditError> {
        let (body, _) = Body::new(Grid {
            positions: self.rest.vertices.clone(),
            cells: Cells::clone(&self.layout.cells),
        })?;
        if body.hash() != self.layout.hash || body.rest().len() != self.rest.vertices.len() {
            return Err(EditError::NoManifold);
        }
        Ok(Topology::new(body))
    }

    /// The middle of what a request names, m; the origin where that is nothing.
    fn place(&self, request: &Request) -> Vector3<f64> {
        let middle = |vertices: &[u32]| {
            let places = vertices
                .iter()
                .filter_map(|&v| self.frame.vertices.get(v as usize));
            let places: Vec<_> = places.collect();
            let count = places.len().max(1) as f64;
            places.into_iter().sum::<Vector3<f64>>() / count
        };
        let cells: Vec<u32> = match request {
            Request::Open { facets } => facets.as_flattened().to_vec(),
            Request::Glue { facets } => facets.iter().flatten().map(|facet| facet.cell).collect(),
            Request::Add { facets, .. } => facets.iter().map(|facet| facet.cell).collect(),
            Request::Remove { cells } | Request::Subdivide { cells } => cells.clone(),
            Request::Separate { points } => {
                let known = points
                    .iter()
                    .filter_map(|&point| self.frame.points.get(point as usize));
                return known.sum::<Vector3<f64>>() / 2.0;
            }
            Request::Bisect { edges } => return middle(edges.as_flattened()),
            Request::Collapse { edge } => return middle(edge),
            Request::Close { .. } => Vec::new(),
        };
        let known = cells
            .iter()
            .filter(|&&cell| (cell as usize) < self.layout.cells.len());
        let vertices = known.flat_map(|&cell| self.layout.cells.cell(cell as usize).vertices);
        middle(&vertices.copied().collect::<Vec<_>>())
    }

    /// Does what is asked, as one change, and poses `next` on what comes of it. Nothing is changed where nothing comes of
    /// it.
    pub(crate) fn change(
        &mut self,
        next: &mut Frame,
        mut events: Vec<Event>,
        asks: &[Ask],
    ) -> Result<Vec<Answer>, StepError> {
        let mut answers = Vec::new();
        let (mut patch, mut stale) = (None, None);
        if let Some(topology) = self.topology.as_mut().filter(|_| !asks.is_empty()) {
            let view = View {
                binding: &self.bound.binding,
                points: &self.rest.points,
                now: &next.vertices,
            };
            let requests: Vec<_> = asks.iter().map(|ask| ask.request.clone()).collect();
            let outcome = topology.body.apply(&requests, &view);
            (answers, patch) = (outcome.answers, outcome.patch);
            match patch.as_ref().map(|patch| self.follow(patch, next.step)) {
                None => {}
                Some(Ok(vertices)) => stale = vertices,
                Some(Err(error)) => {
                    self.revert();
                    let reason = error.message;
                    answers.fill(Answer::Refused(Refusal::Unfollowed { reason }));
                    patch = None;
                }
            }
            for (ask, answer) in asks.iter().zip(&answers) {
                events.extend(tell(ask, answer));
            }
        }
        if patch.is_some() {
            next.layout = Arc::clone(&self.layout);
            next.vertices
                .resize(self.rest.vertices.len(), Vector3::zeros());
            match stale.filter(|_| self.bound.is_posed) {
                Some(vertices) => self.pose_alone(next, &vertices)?,
                None => self.pose(next)?,
            }
        }
        if !events.is_empty() || patch.is_some() {
            next.change = Some(Arc::new(Change { events, patch }));
        }
        Ok(answers)
    }

    /// Takes back what was done to the body alone.
    fn revert(&mut self) {
        let topology = self.topology.as_mut();
        topology.expect("what made a patch").body.revert();
    }

    /// Takes over a change of the body: everything that counts vertices or cells. Gives the vertices that have to be posed
    /// where all others were on the same points; `None` where all have to.
    ///
    /// # Errors
    /// As [`Rest::bind`]; nothing but the body is changed then.
    fn follow(&mut self, patch: &Patch, step: u64) -> Result<Option<Vec<u32>>, SceneError> {
        let topology = self.topology.as_mut().expect("what made a patch");
        let body = &topology.body;
        let vertices = body.rest().len();
        let cells = self
            .layout
            .cells
            .patched(&patch.slots, &patch.cells, vertices);
        let cells = Arc::new(cells.expect("the body's patches fit its cells"));
        let (version, places) = (body.version(), body.rest().to_vec());
        let rest = self.rest.changed(version, places, Arc::clone(&cells));
        let moved = moved(&self.rest.vertices, &rest.vertices, patch);
        let turn = Turn {
            rest: &rest,
            patch,
            moved: &moved,
            cells: &self.layout.cells,
            body,
        };
        let bound = self.bound.rebound(&turn)?;
        if let Some(blend) = &mut self.blend {
            blend.follow(&turn)?;
        }
        // While the mesh blends, its vertices are no pose of one binding.
        let stale = bound.stale().filter(|_| self.blend.is_none());
        self.bound.take(bound, version);
        topology.changed_at.resize(vertices, None);
        for &vertex in &patch.cells.connectivity {
            topology.changed_at[vertex as usize] = Some(step);
        }
        if let Some(rules) = &mut self.rules {
            rules.follow(
                patch,
                &topology.body,
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
        self.rest = Arc::new(rest);
        Ok(stale)
    }
}

/// The vertices of changed cells that are elsewhere at rest than before, ascending.
fn moved(before: &[Vector3<f64>], after: &[Vector3<f64>], patch: &Patch) -> Vec<u32> {
    let mut moved = patch.cells.connectivity.clone();
    moved.sort_unstable();
    moved.dedup();
    moved.retain(|&vertex| {
        let before = before.get(vertex as usize);
        before.is_some_and(|before| *before != after[vertex as usize])
    });
    moved
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
        .map(|effect| event(EventKind::Followed(*effect), Vec::new()));
    std::iter::once(first).chain(effects).collect()
}

fn kind(request: &Request, done: &Done) -> EventKind {
    match request {
        Request::Separate { .. } | Request::Open { .. } => EventKind::Torn { faces: done.opened },
        Request::Glue { .. } | Request::Close { .. } => EventKind::Glued { faces: done.closed },
        Request::Remove { .. } => EventKind::Removed,
        Request::Collapse { .. } => EventKind::Collapsed,
        Request::Add { .. } => EventKind::Added,
        Request::Subdivide { .. } | Request::Bisect { .. } => EventKind::Divided,
    }
}
