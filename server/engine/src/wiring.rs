//! What a change of the mesh leaves other than it was, as far as a mapping has to know.

use sinew_mapping::{Rows, Wiring};
use sinew_mesh::Cells;
use sinew_tearing::{Body, Patch};

use crate::{
    cells::{cells_of, cost_between},
    rest::Rest,
    scene::{Dimension, Metric, Recipe},
};

/// A change of the mesh, for what follows it.
pub(crate) struct Turn<'a> {
    /// After it.
    pub(crate) rest: &'a Rest,
    pub(crate) patch: &'a Patch,
    /// Vertices of changed cells that are elsewhere at rest than before, ascending.
    pub(crate) moved: &'a [u32],
    /// Before it.
    pub(crate) cells: &'a Cells,
    /// After it.
    pub(crate) body: &'a Body,
}

/// The nodes of a flood that have other neighbours or costs, and these.
pub(crate) struct Rewiring {
    nodes: Vec<u32>,
    arcs: Rows,
    costs: Vec<f64>,
}

impl Rewiring {
    /// `None` where the mapping floods no vertices.
    pub(crate) fn new(turn: &Turn<'_>, vertices: usize, recipe: &Recipe) -> Option<Self> {
        let weighting = &recipe.weighting;
        let Metric::Paths(paths) = &weighting.metric else {
            return None;
        };
        if weighting.targets != Dimension::Vertex || paths.arcs == Dimension::Vertex {
            return None;
        }
        let cost = cost_between(&paths.cost, &turn.rest.vertices)?;
        let through = cells_of(paths.arcs);
        let nodes = turn.vertices(vertices, through);
        let (mut starts, mut arcs, mut costs) = (vec![0], Vec::new(), Vec::new());
        for (&node, row) in nodes.iter().zip(turn.body.beside_vertices(&nodes, through)) {
            costs.extend(row.iter().filter_map(|&other| cost.of(node, other)));
            arcs.extend(row);
            starts.push(u32::try_from(arcs.len()).ok()?);
        }
        Some(Self {
            nodes,
            arcs: Rows::new(starts, arcs),
            costs,
        })
    }

    pub(crate) fn wiring(&self) -> Wiring<'_> {
        Wiring {
            nodes: &self.nodes,
            arcs: &self.arcs,
            costs: &self.costs,
        }
    }
}

impl Turn<'_> {
    /// The vertices of cells that changed, as they were and as they are, all new ones, and those beside any that moved;
    /// ascending. There were so many vertices before.
    fn vertices(&self, before: usize, through: sinew_mesh::Dimension) -> Vec<u32> {
        let old = self.patch.slots.iter().map(|&slot| slot as usize);
        let old = old.filter(|&slot| slot < self.cells.len());
        let mut all: Vec<u32> = (old)
            .flat_map(|slot| self.cells.cell(slot).vertices)
            .chain(&self.patch.cells.connectivity)
            .chain(self.moved)
            .copied()
            .collect();
        let beside = self.body.beside_vertices(self.moved, through);
        all.extend(beside.into_iter().flatten());
        let new = before..self.rest.vertices.len();
        all.extend(new.map(|vertex| u32::try_from(vertex).expect("slots are u32")));
        all.sort_unstable();
        all.dedup();
        all
    }
}
