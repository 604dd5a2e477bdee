//! A body, and somebody who follows it by its patches alone.

use std::collections::BTreeMap;
use std::ops::Deref;

use sinew_mesh::{Cells, Grid};
use sinew_tearing::{Body, Outcome, Patch, Request};
use sinew_topology::{Face, Volume, Walk};

/// Checks after each batch that a copy of the cells that knows only the patches is the body's.
pub(crate) struct Followed {
    body: Body,
    copy: Cells,
    vertices: usize,
}

impl Followed {
    pub(crate) fn new(mesh: Grid) -> Self {
        let (body, _) = Body::new(mesh).expect("a body can be made of it");
        let copy = body.cells();
        let vertices = body.rest().len();
        Self {
            body,
            copy,
            vertices,
        }
    }

    pub(crate) fn apply(&mut self, requests: &[Request]) -> Outcome {
        let version = self.body.version();
        let outcome = self.body.apply(requests);
        if let Some(patch) = &outcome.patch {
            assert_eq!(
                (patch.from_version, self.body.version()),
                (version, version + 1)
            );
            self.follow(patch);
        } else {
            assert_eq!(self.body.version(), version);
        }
        assert_eq!(self.copy, self.body.cells());
        assert_eq!(self.vertices, self.body.rest().len());
        outcome
    }

    fn follow(&mut self, patch: &Patch) {
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
            .expect("it fits");
        assert_eq!(self.copy.hash(), patch.hash);
    }
}

impl Deref for Followed {
    type Target = Body;

    fn deref(&self) -> &Body {
        &self.body
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
