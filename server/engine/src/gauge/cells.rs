//! Measures on the geometric side: a value per cell, the greatest of its parts.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use rayon::prelude::*;
use sinew_mapping::Binding;
use sinew_mesh::{Cell, Cells};
use sinew_tearing::{Body, Patch};

use super::{
    latch::{CellCrossing, Latch, Reading},
    parts::{Kind, Parts, worst},
    standing::Standing,
};
use crate::rule::Strain;

/// Cells measured together.
const BLOCK: usize = 256;

/// More points than this make a bound that costs more than what it saves.
const BOUNDED: usize = 256;

/// Sizes are compared more strictly than by rounding first, and then exactly.
const ROUNDING: f64 = 1e-9;

/// Weights of two vertices whose sums differ by more do not move alike with the points.
const UNEQUAL: f64 = 1e-9;

/// What the geometric side is measured by.
pub(crate) struct Scale<'a> {
    pub(crate) cells: &'a Cells,
    /// By vertex slot, m.
    pub(crate) rest: &'a [Vector3<f64>],
    pub(crate) binding: &'a Binding,
}

/// One step as measures see it.
pub(crate) struct Moment<'a> {
    pub(crate) scale: Scale<'a>,
    /// m
    pub(crate) vertices: &'a [Vector3<f64>],
    /// m
    pub(crate) points: &'a [Vector3<f64>],
    /// One per point.
    pub(crate) standing: &'a [Standing],
    /// Whether the vertices are those that the binding alone makes of the points.
    pub(crate) posed_alone: bool,
}

/// A change of the cells.
pub(crate) struct Turn<'a> {
    pub(crate) patch: &'a Patch,
    pub(crate) body: &'a Body,
    /// Slots before.
    pub(crate) cells: usize,
    /// Whether the rule watches new material in a slot.
    pub(crate) admits: &'a dyn Fn(u32) -> bool,
    /// Whether the rule watches the two sides of a face of cells that are torn apart.
    pub(crate) parts: &'a dyn Fn([u32; 2]) -> bool,
}

impl Turn<'_> {
    /// The cell that an appended one was split from; `None` for new material.
    pub(crate) fn parent(&self, slot: u32) -> Option<u32> {
        let parent = self.patch.cell_parents[slot as usize - self.cells];
        (parent != slot).then_some(parent)
    }
}

/// One rule's watch over the cells.
#[derive(Clone, Debug)]
pub(crate) struct CellGauge {
    kind: Kind,
    strain: Strain,
    latch: Latch,
    blocks: Vec<Block>,
    /// By slot, the block of each cell that is watched.
    block_of: Vec<Option<usize>>,
}

/// Some cells, the parts of them that are measured, and how far the points may drift before any can cross.
#[derive(Clone, Debug)]
struct Block {
    /// By slot, ascending.
    cells: Vec<u32>,
    parts: Parts,
    /// The points that move them, ascending. Empty where no bound is kept.
    support: Vec<u32>,
    /// The greatest change of a vertex's place against another's in the same part, for points that drift apart by 1.
    sensitivity: f64,
    /// Where the support was when the parts were measured last, m.
    reference: Vec<Vector3<f64>>,
    /// How far apart the support may drift from there, m, until a part can cross.
    allowance: f64,
    /// The greatest departure among the parts when they were measured last.
    greatest: f64,
    /// Cells that crossed and have not come back, by slot.
    spent: BTreeSet<u32>,
}

impl CellGauge {
    pub(crate) fn new(
        kind: Kind,
        strain: Strain,
        latch: Latch,
        watched: &[u32],
        scale: &Scale<'_>,
    ) -> Self {
        let mut block_of = vec![None; scale.cells.len()];
        for (block, cells) in watched.chunks(BLOCK).enumerate() {
            for &cell in cells {
                block_of[cell as usize] = Some(block);
            }
        }
        let compiled = |cells: &[u32]| {
            let mut block = Block::new(cells.to_vec());
            block.compile(kind, scale);
            block
        };
        Self {
            kind,
            strain,
            latch,
            blocks: watched.par_chunks(BLOCK).map(compiled).collect(),
            block_of,
        }
    }

    /// Measures a step. `[E3]` The cells that cross come by slot, ascending. Where none of a block can have crossed, the
    /// greatest is that of the last time that they were measured.
    pub(crate) fn measure(&mut self, moment: &Moment<'_>) -> Reading<CellCrossing> {
        let Self {
            kind,
            strain,
            latch,
            ref mut blocks,
            block_of: _,
        } = *self;
        let look = |block: &mut Block| {
            if block.is_safe(moment) {
                return Vec::new();
            }
            let nearest = block.parts.nearest(strain, latch.threshold, moment);
            block.greatest = nearest.greatest;
            if nearest.greatest < latch.threshold - ROUNDING && block.spent.is_empty() {
                block.remember(nearest.slack, moment);
                return Vec::new();
            }
            block.allowance = 0.0;
            let measured = |cell: &Cell<'_>| worst(kind, strain, cell, moment);
            latch.turn(&block.cells, &mut block.spent, measured, moment)
        };
        let crossings = blocks.par_iter_mut().with_min_len(16).map(look);
        let mut crossings: Vec<_> = crossings.flatten_iter().collect();
        crossings.sort_unstable_by_key(|crossing: &CellCrossing| crossing.cell);
        Reading {
            greatest: blocks.iter().map(|block| block.greatest).reduce(f64::max),
            crossings,
        }
    }

    /// Compiles anew whatever stands on the binding.
    pub(crate) fn rebind(&mut self, scale: &Scale<'_>) {
        let kind = self.kind;
        (self.blocks.par_iter_mut()).for_each(|block| block.compile(kind, scale));
    }

    /// Takes over cells that changed: those that came apart from others are watched like these.
    pub(crate) fn follow(&mut self, turn: &Turn<'_>, scale: &Scale<'_>) {
        let mut dirty = BTreeSet::new();
        for &slot in &turn.patch.slots {
            if let Some(&known) = self.block_of.get(slot as usize) {
                dirty.extend(known);
                continue;
            }
            let block = match turn.parent(slot) {
                Some(parent) => {
                    let block = self.block_of[parent as usize];
                    if let Some(block) = block.map(|block| &mut self.blocks[block])
                        && block.spent.contains(&parent)
                    {
                        block.spent.insert(slot);
                    }
                    block
                }
                None => (turn.admits)(slot).then(|| self.blocks.len() - 1),
            };
            if let Some(block) = block {
                self.blocks[block].cells.push(slot);
            }
            self.block_of.push(block);
            dirty.extend(block);
        }
        for block in dirty {
            self.blocks[block].compile(self.kind, scale);
        }
    }

    pub(crate) fn spent(&self) -> impl Iterator<Item = u32> {
        self.blocks
            .iter()
            .flat_map(|block| block.spent.iter().copied())
    }
}

impl Block {
    fn new(cells: Vec<u32>) -> Self {
        Self {
            cells,
            parts: Parts::Edges(Vec::new()),
            support: Vec::new(),
            sensitivity: 0.0,
            reference: Vec::new(),
            allowance: 0.0,
            greatest: f64::NEG_INFINITY,
            spent: BTreeSet::new(),
        }
    }

    /// Takes the parts of the cells as they are now, and measures them at the next step.
    fn compile(&mut self, kind: Kind, scale: &Scale<'_>) {
        let live = |slot: &u32| scale.cells.types[*slot as usize] != 0;
        self.cells.retain(live);
        self.spent.retain(live);
        self.parts = Parts::of(kind, &self.cells, scale);
        (self.support, self.sensitivity) = bound(&self.parts, scale);
        self.reference.resize(self.support.len(), Vector3::zeros());
        self.allowance = 0.0;
        self.greatest = f64::NEG_INFINITY;
    }

    /// Whether no part can have crossed since they were measured. `[E4]`
    fn is_safe(&self, moment: &Moment<'_>) -> bool {
        if self.allowance <= 0.0 || !moment.posed_alone {
            return false;
        }
        let (mut least, mut most) = (
            Vector3::repeat(f64::INFINITY),
            Vector3::repeat(f64::NEG_INFINITY),
        );
        for (&point, then) in self.support.iter().zip(&self.reference) {
            let drift = moment.points[point as usize] - then;
            least = least.inf(&drift);
            most = most.sup(&drift);
        }
        (most - least).norm_squared() < self.allowance * self.allowance
    }

    /// Takes down from where the points may drift, and how far. `[E4]`
    fn remember(&mut self, slack: f64, moment: &Moment<'_>) {
        self.allowance = if moment.posed_alone && !self.support.is_empty() {
            // A little less, since positions are rounded.
            slack * (1.0 - 1e-6) / self.sensitivity
        } else {
            0.0
        };
        for (&point, then) in self.support.iter().zip(&mut self.reference) {
            *then = moment.points[point as usize];
        }
    }
}

/// The points that move the vertices of these parts, and how far, in the part's unit, two vertices of a part may move
/// against each other where no two points drift apart by more than 1 m. `[E4]` No points where there is no such bound.
fn bound(parts: &Parts, scale: &Scale<'_>) -> (Vec<u32>, f64) {
    const NONE: (Vec<u32>, f64) = (Vec::new(), 0.0);
    let Scale {
        cells: _,
        rest: _,
        binding,
    } = scale;
    if !binding.is_linear() {
        return NONE;
    }
    let spans = parts.spans(scale);
    let mut vertices: Vec<u32> = spans.iter().flat_map(|(part, _)| *part).copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    // Those of an interpolation of many points are not at hand.
    if (vertices.first()).is_some_and(|&vertex| binding.weights(vertex as usize).len() > BOUNDED) {
        return NONE;
    }
    let (mut starts, mut entries) = (vec![0], Vec::new());
    for &vertex in &vertices {
        let start = entries.len();
        binding.visit(vertex as usize, |point, weight| {
            entries.push((point, weight))
        });
        entries[start..].sort_unstable_by_key(|&(point, _)| point);
        starts.push(entries.len());
    }
    let mut support: Vec<u32> = entries.iter().map(|(point, _)| *point).collect();
    support.sort_unstable();
    support.dedup();
    if support.len() > BOUNDED {
        return NONE;
    }
    let row_of = |vertex: u32| {
        let at = vertices.partition_point(|&known| known < vertex);
        &entries[starts[at]..starts[at + 1]]
    };
    let mut sensitivity = 0.0_f64;
    for (part, unit) in spans {
        let first = row_of(part[0]);
        for &vertex in &part[1..] {
            let (sum, size) = difference(first, row_of(vertex));
            if f64::abs(sum) > UNEQUAL {
                return NONE;
            }
            sensitivity = sensitivity.max(size / 2.0 / unit);
        }
    }
    (support, sensitivity.max(f64::MIN_POSITIVE))
}

/// The sum of the differences of two rows of weights, and that of their sizes. Points ascend in both.
fn difference(mut a: &[(u32, f64)], mut b: &[(u32, f64)]) -> (f64, f64) {
    let next = |row: &[(u32, f64)]| row.first().map_or(u32::MAX, |entry| entry.0);
    let (mut sum, mut size) = (0.0, 0.0);
    while !(a.is_empty() && b.is_empty()) {
        let point = next(a).min(next(b));
        let take = |row: &mut &[(u32, f64)]| match row.split_first() {
            Some((entry, rest)) if entry.0 == point => {
                *row = rest;
                entry.1
            }
            Some(_) | None => 0.0,
        };
        let difference = take(&mut a) - take(&mut b);
        sum += difference;
        size += f64::abs(difference);
    }
    (sum, size)
}
