//! The body, and how requests are answered.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use sinew_mesh::{Cells, Dimension, Grid};
use sinew_topology::{
    Adjacency, BuildError, BuildReport, Cell, Edge, Face, Map, MeshCells, NonManifold, Vertex,
    Volume, Walk,
};
use thiserror::Error;

use crate::areas::View;
use crate::commit::Batch;
use crate::fractures::Fractures;
use crate::fragments::Fragments;
use crate::ledger::Ledger;
use crate::{Answer, Patch, Refusal, Request};

/// Why a mesh cannot become a body.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BodyError {
    /// It is no manifold of volumes.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// It is a surface.
    #[error("the mesh is a surface, which has no inside to tear; fill it with volumes first")]
    Surface,
}

/// What of a mesh was changed to make it a body.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BodyReport {
    /// What the map's builder found. Where it split vertices, these are appended to the mesh's.
    pub build: BuildReport,
}

/// A mesh that can come apart and grow together.
#[derive(Clone, Debug)]
pub struct Body {
    pub(crate) map: Map,
    /// By vertex slot.
    pub(crate) rest: Ledger<Vector3<f64>>,
    /// By cell slot; `None` where the cell is no more.
    pub(crate) volumes: Ledger<Option<Cell<Volume>>>,
    /// The slot of each of the map's volumes.
    pub(crate) slots: Ledger<u32>,
    pub(crate) fragments: Fragments,
    pub(crate) fractures: Fractures,
    /// Of each slot's cell.
    pub(crate) hashes: Ledger<u64>,
    /// The sum of `hashes`.
    pub(crate) hash: u64,
    pub(crate) version: u64,
    /// Points between which it was torn, the lower first.
    pub(crate) torn: BTreeSet<[u32; 2]>,
    /// The vertices at the other ends of each vertex's edges.
    pub(crate) adjacency: Adjacency<Vertex, Edge>,
    /// Before the last batch.
    pub(crate) kept: Kept,
    /// Scratch memory.
    pub(crate) walk: Walk,
}

/// What a batch of requests found, where that is no column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kept {
    hash: u64,
    version: u64,
    torn: BTreeSet<[u32; 2]>,
    /// The vertices whose neighbours it changed.
    pub(crate) touched: Vec<Cell<Vertex>>,
}

/// What came of a batch of requests.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// One for each request.
    pub answers: Vec<Answer>,
    /// What all of them did to the cells; `None` where all were refused.
    pub patch: Option<Patch>,
}

impl Body {
    /// Makes a body of a checked mesh. Vertices and cells have the mesh's numbers as their slots.
    ///
    /// Where the mesh is no manifold, parts that touch without a face in common come apart, and vertices are appended for
    /// that; cells that are inside out are turned. [`Body::cells`] and [`Body::rest`] have the result.
    ///
    /// # Errors
    /// [`BodyError`] for a surface, and for cells that cannot be made sense of together.
    pub fn new(mesh: Grid) -> Result<(Self, BodyReport), BodyError> {
        let Grid {
            positions: mut rest,
            cells,
        } = mesh;
        let view = MeshCells {
            vertices: rest.len(),
            types: &cells.types,
            connectivity: &cells.connectivity,
            offsets: &cells.offsets,
            faces: &cells.faces,
            face_offsets: &cells.face_offsets,
        };
        let (map, build) = Map::build(&view, NonManifold::Split)?;
        if map.dimension() == sinew_topology::Dimension::Two {
            return Err(BodyError::Surface);
        }
        for &(_, parent) in &build.split_vertices {
            rest.push(rest[parent as usize]);
        }
        let volumes: Vec<_> = map.cells().map(Some).collect();
        let slots = Ledger::new((0..number(volumes.len())).collect());
        let mut body = Self {
            fragments: Fragments::new(&map),
            fractures: Fractures::default(),
            hashes: Ledger::new(vec![0; volumes.len()]),
            hash: 0,
            version: 0,
            torn: BTreeSet::new(),
            adjacency: Adjacency::new(&map),
            walk: Walk::default(),
            map,
            rest: Ledger::new(rest),
            volumes: Ledger::new(volumes),
            slots,
            kept: Kept::default(),
        };
        let slots = body.all_slots();
        body.changed(&slots);
        body.keep();
        Ok((body, BodyReport { build }))
    }

    /// Answers requests in order, each wholly or not at all.
    ///
    /// # Panics
    /// If the binding or the positions are not those of all vertices of the body.
    pub fn apply(&mut self, requests: &[Request], view: &View<'_>) -> Outcome {
        let bound = view.binding.dominant().len();
        assert_eq!(bound, self.rest.len(), "the binding is not the body's");
        assert_eq!(view.now.len(), bound, "the positions are not the body's");
        self.keep();
        let mut batch = Batch::new(self);
        let answers = requests
            .iter()
            .map(|request| {
                self.answer(request, view, &mut batch)
                    .unwrap_or_else(Answer::Refused)
            })
            .collect();
        let patch = batch.finish(self);
        Outcome { answers, patch }
    }

    /// Takes back the last [`Body::apply`], at its cost. Nothing, where that was done already.
    pub fn revert(&mut self) {
        self.map.revert();
        self.rest.revert();
        self.volumes.revert();
        self.slots.revert();
        self.fragments.revert();
        self.fractures.revert();
        self.hashes.revert();
        self.hash = self.kept.hash;
        self.version = self.kept.version;
        self.torn.clone_from(&self.kept.torn);
        self.adjacency.refresh(&self.map, &self.kept.touched);
        self.kept.touched.clear();
    }

    /// Takes the body as it is as what to go back to.
    fn keep(&mut self) {
        self.map.keep();
        self.rest.keep();
        self.volumes.keep();
        self.slots.keep();
        self.fragments.keep();
        self.fractures.keep();
        self.hashes.keep();
        self.kept.hash = self.hash;
        self.kept.version = self.version;
        self.kept.torn.clone_from(&self.torn);
        self.kept.touched.clear();
    }

    fn answer(
        &mut self,
        request: &Request,
        view: &View<'_>,
        batch: &mut Batch,
    ) -> Result<Answer, Refusal> {
        let done = match request {
            Request::Separate { points } => return self.separate(*points, view, batch),
            Request::Open { facets } => self.open(facets, batch)?,
            Request::Glue { facets } => self.glue(facets, view, batch)?,
            Request::Close {
                fragments,
                distance,
            } => self.close(*fragments, *distance, view, batch)?,
            Request::Remove { cells } => self.remove(cells, batch)?,
            Request::Add { facets, thickness } => self.add(facets, *thickness, batch)?,
            Request::Subdivide { cells } => self.subdivide(cells, batch)?,
            Request::Bisect { edges } => self.bisect(edges, batch)?,
            Request::Collapse { edge } => self.collapse(*edge, batch)?,
        };
        Ok(Answer::Applied(done))
    }

    /// The map. Its vertices are the vertex slots; of its volumes, [`Body::slot`] tells the cell slot.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// Where each vertex is at rest, m, by slot.
    pub fn rest(&self) -> &[Vector3<f64>] {
        &self.rest
    }

    /// How many slots for cells there are, empty ones included.
    pub fn slot_count(&self) -> usize {
        self.volumes.len()
    }

    /// The volume in a slot, or `None` if there is none, or no more.
    pub fn volume(&self, slot: u32) -> Option<Cell<Volume>> {
        *self.volumes.get(slot as usize)?
    }

    /// The slot of a volume of the map.
    pub fn slot(&self, volume: Cell<Volume>) -> u32 {
        self.slots[volume.index()]
    }

    /// The vertices that edges join to a vertex, ascending.
    pub fn neighbours_of(&self, vertex: Cell<Vertex>) -> &[Cell<Vertex>] {
        self.adjacency.of(vertex)
    }

    /// Of each of these vertices, by slot, the other vertices of the cells of a dimension that it bounds, ascending; none of
    /// one that bounds no cell any more.
    ///
    /// # Panics
    /// If the dimension is that of vertices.
    pub fn beside_vertices(&self, vertices: &[u32], through: Dimension) -> Vec<Vec<u32>> {
        let mut walk = Walk::default();
        let mut beside = |vertex: &u32| {
            let Some(vertex) = self.map.cell_at::<Vertex>(*vertex as usize) else {
                return Vec::new();
            };
            let mut found: Vec<u32> = match through {
                Dimension::Vertex => panic!("vertices bound no vertex"),
                Dimension::Edge => slots(self.adjacency.of(vertex).iter().copied()),
                Dimension::Face => slots(self.map.adjacent::<_, Face>(vertex, &mut walk)),
                Dimension::Volume => slots(self.map.adjacent::<_, Volume>(vertex, &mut walk)),
            };
            found.sort_unstable();
            found
        };
        vertices.iter().map(&mut beside).collect()
    }

    /// The cells that share a face with a cell, by slot, ascending; none if there is no cell in the slot.
    pub fn beside(&self, slot: u32) -> Vec<u32> {
        let Some(volume) = self.volume(slot) else {
            return Vec::new();
        };
        let mut walk = Walk::default();
        let darts = self.map.orbit(volume, &mut walk);
        let beyond = darts.filter_map(|dart| self.map.beta3(dart));
        let mut slots: Vec<_> = beyond
            .map(|dart| self.slot(self.map.volume(dart)))
            .collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// The fragment that a cell is part of, or `None` if there is no cell in the slot.
    pub fn fragment(&self, slot: u32) -> Option<u32> {
        self.volume(slot)?;
        Some(self.fragments.of(slot))
    }

    /// How many cells each fragment has, by its number; 0 where it is no more.
    pub fn fragment_sizes(&self) -> &[u32] {
        self.fragments.sizes()
    }

    /// How many patches were made.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// All cells, by slot. Linear: whoever holds them already follows the patches instead.
    pub fn cells(&self) -> Cells {
        self.cells_in(&self.all_slots())
    }

    /// [`Cells::hash`] of all cells.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    fn all_slots(&self) -> Vec<u32> {
        (0..number(self.slot_count())).collect()
    }

    pub(crate) fn live(&self, slot: u32) -> Result<Cell<Volume>, Refusal> {
        self.volume(slot).ok_or(Refusal::NoCell { cell: slot })
    }
}

/// The slots of vertices.
fn slots(vertices: impl Iterator<Item = Cell<Vertex>>) -> Vec<u32> {
    vertices.map(|vertex| number(vertex.index())).collect()
}

pub(crate) fn number(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than the map's darts")
}
