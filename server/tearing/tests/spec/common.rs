//! A body, and somebody who follows it by its patches alone.

use std::collections::BTreeMap;
use std::ops::Deref;

use nalgebra::Vector3;
use sinew_mapping::{Binding, Filter, Recipe, Reference, Rule, Weighting, bind};
use sinew_mesh::{Cells, Grid, cell_volume, scaled_jacobian};
use sinew_tearing::{Answer, Body, Done, Outcome, Patch, Request, View};
use sinew_topology::{Edge, Face, Vertex, Volume, Walk};

/// Checks after each batch that a copy of the cells that knows only the patches is the body's.
pub(crate) struct Followed {
    body: Body,
    points: Vec<Vector3<f64>>,
    recipe: Recipe,
    binding: Binding,
    copy: Cells,
    vertices: usize,
}

impl Followed {
    /// A body that follows a single point.
    pub(crate) fn new(mesh: Grid) -> Self {
        Self::bound(mesh, vec![Vector3::zeros()], Filter::KeepK(1))
    }

    /// A body of which each vertex follows the nearest points.
    pub(crate) fn bound(mesh: Grid, points: Vec<Vector3<f64>>, filter: Filter) -> Self {
        let recipe = Recipe {
            weighting: Weighting::default(),
            filter,
            rule: Rule::WeightedMean,
            reference: Reference::Initial,
        };
        Self::with(mesh, points, recipe)
    }

    pub(crate) fn with(mesh: Grid, points: Vec<Vector3<f64>>, recipe: Recipe) -> Self {
        let (body, _) = Body::new(mesh).expect("a body can be made of it");
        let copy = body.cells();
        let vertices = body.rest().len();
        Self {
            binding: bound(&body, &points, &recipe),
            points,
            recipe,
            body,
            copy,
            vertices,
        }
    }

    pub(crate) fn apply(&mut self, requests: &[Request]) -> Outcome {
        let version = self.body.version();
        let now = self.body.rest().to_vec();
        let view = View {
            binding: &self.binding,
            points: &self.points,
            now: &now,
        };
        let outcome = self.body.apply(requests, &view);
        self.binding = bound(&self.body, &self.points, &self.recipe);
        if let Some(patch) = &outcome.patch {
            assert_eq!(
                (patch.from_version, self.body.version()),
                (version, version + 1)
            );
            self.follow(patch, requests);
        } else {
            assert_eq!(self.body.version(), version);
        }
        assert_eq!(self.copy, self.body.cells());
        assert_eq!(self.vertices, self.body.rest().len());
        outcome
    }

    /// As [`Followed::apply`], after the same was done and taken back.
    pub(crate) fn apply_again(&mut self, requests: &[Request]) -> Outcome {
        let now = self.body.rest().to_vec();
        let view = View {
            binding: &self.binding,
            points: &self.points,
            now: &now,
        };
        let before = state(&self.body);
        let first = self.body.apply(requests, &view);
        self.body.revert();
        assert_eq!(state(&self.body), before, "{requests:?}");
        let second = self.apply(requests);
        assert_eq!(second, first, "{requests:?}");
        second
    }

    fn follow(&mut self, patch: &Patch, requests: &[Request]) {
        let Patch {
            vertex_parents,
            vertex_parent_offsets: offsets,
            slots,
            cells,
            cell_parents,
            ..
        } = patch;
        for ends in offsets.windows(2) {
            let parents = &vertex_parents[ends[0] as usize..ends[1] as usize];
            assert!(
                parents
                    .iter()
                    .all(|&parent| (parent as usize) < self.vertices)
            );
            self.vertices += 1;
        }
        let appended = slots
            .iter()
            .filter(|&&slot| slot as usize >= self.copy.len());
        for (&slot, &parent) in appended.zip(cell_parents) {
            assert!(parent <= slot);
        }
        self.copy = self
            .copy
            .patched(slots, cells, self.vertices)
            .unwrap_or_else(|error| panic!("{requests:?}: {error}"));
        assert_eq!(self.copy.hash(), patch.hash);
    }
}

impl Deref for Followed {
    type Target = Body;

    fn deref(&self) -> &Body {
        &self.body
    }
}

fn bound(body: &Body, points: &[Vector3<f64>], recipe: &Recipe) -> Binding {
    let usable = vec![true; points.len()];
    bind(body.rest(), points, &usable, recipe).expect("they can be bound")
}

/// All that a body tells of itself.
fn state(body: &Body) -> impl PartialEq + std::fmt::Debug + use<> {
    let map = body.map();
    let rest = body.rest().to_vec();
    let fragments: Vec<_> = (0..number(body.slot_count()))
        .map(|slot| body.fragment(slot))
        .collect();
    let near: Vec<_> = (0..rest.len())
        .filter_map(|vertex| map.cell_at::<Vertex>(vertex))
        .map(|vertex| body.neighbours_of(vertex).to_vec())
        .collect();
    let numbers = (map.digest(), body.hash(), body.version());
    let sizes = body.fragment_sizes().to_vec();
    (numbers, rest, body.cells(), fragments, sizes, near)
}

/// The volume of all cells, m³.
pub(crate) fn volume(body: &Body) -> f64 {
    let grid = Grid {
        positions: body.rest().to_vec(),
        cells: body.cells(),
    };
    (0..grid.cells.len())
        .map(|cell| sinew_mesh::volume(&grid, cell))
        .sum()
}

/// The cells that fold over, by slot.
pub(crate) fn folded(body: &Body) -> Vec<u32> {
    let (rest, cells) = (body.rest(), body.cells());
    let at = |vertex: u32| rest[vertex as usize];
    let folds = |slot: &u32| scaled_jacobian(&cells.cell(*slot as usize), at) < -1e-9;
    (0..number(cells.len())).filter(folds).collect()
}

/// The cells with a volume below 0, by slot.
pub(crate) fn inside_out(body: &Body) -> Vec<u32> {
    let (rest, cells) = (body.rest(), body.cells());
    let is_out = |slot: &u32| cell_volume(rest, &cells.cell(*slot as usize)) < -1e-12;
    (0..number(cells.len())).filter(is_out).collect()
}

/// Vertices, edges, faces and volumes.
pub(crate) fn census(body: &Body) -> [usize; 4] {
    let map = body.map();
    [
        map.count::<Vertex>(),
        map.count::<Edge>(),
        map.count::<Face>(),
        map.count::<Volume>(),
    ]
}

/// What was done.
pub(crate) fn done(answer: &Answer) -> &Done {
    match answer {
        Answer::Applied(done) | Answer::Refined { done, .. } => done,
        Answer::Refused(refusal) => panic!("refused: {refusal}"),
    }
}

/// How many numbers of fragments there are; panics where faces join two, or a size is wrong.
pub(crate) fn count_fragments(body: &Body) -> usize {
    let map = body.map();
    let mut sizes = BTreeMap::<u32, u32>::new();
    let mut walk = Walk::default();
    for volume in map.cells::<Volume>() {
        let fragment = body.fragment(body.slot(volume)).expect("alive");
        *sizes.entry(fragment).or_default() += 1;
        for next in map.adjacent::<Volume, Face>(volume, &mut walk) {
            assert_eq!(body.fragment(body.slot(next)), Some(fragment));
        }
    }
    for (fragment, &size) in (0..).zip(body.fragment_sizes()) {
        assert_eq!(sizes.get(&fragment).copied().unwrap_or(0), size);
    }
    sizes.len()
}

/// A count or an index as slots are.
pub(crate) fn number(count: usize) -> u32 {
    u32::try_from(count).expect("test bodies are small")
}
