//! Pairs of particles, ordered so that their forces can be summed by many threads to the same bits.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::pairs::PairLoad;

/// Least particles per block: enough work to pay for a task.
const BLOCK: usize = 8192;
/// Most blocks: pairs across them are evaluated twice, so more threads than these would gain little.
const BLOCKS: usize = 16;

/// Particles per block of so many: of their number alone, not of the threads, so that sums have the same bits.
pub(crate) fn block_of(particles: usize) -> usize {
    particles.div_ceil(BLOCKS).max(BLOCK)
}

/// Whether a column of `len` entries pays for waking the other threads.
pub(crate) fn is_shared(len: usize) -> bool {
    len > BLOCK && rayon::current_num_threads() > 1
}

/// Fills two columns of equal length, entry by entry.
pub(crate) fn fill<A: Send, B: Send>(
    left: &mut [A],
    right: &mut [B],
    entry: impl Fn(usize) -> (A, B) + Sync,
) {
    let fill_block = |first: usize, left: &mut [A], right: &mut [B]| {
        for (i, (a, b)) in (first..).zip(left.iter_mut().zip(right)) {
            (*a, *b) = entry(i);
        }
    };
    if is_shared(left.len()) {
        (left.par_chunks_mut(BLOCK).zip(right.par_chunks_mut(BLOCK)))
            .enumerate()
            .for_each(|(block, (left, right))| fill_block(block * BLOCK, left, right));
    } else {
        fill_block(0, left, right);
    }
}

/// What a row holds of a pair: the other particle, and whatever else tells the pair.
pub(crate) trait Partner: Copy + Send + Sync {
    /// The other particle.
    fn other(self) -> usize;
}

impl Partner for u32 {
    fn other(self) -> usize {
        self as usize
    }
}

/// For each particle the pairs that it evaluates.
///
/// A pair within a block of particles ([`block_of`]) stands in one row and serves both of its ends. A pair across blocks
/// stands in the rows of both ends, so that no block writes into another: a little more arithmetic, but neither locks
/// nor an order that depends on the threads.
#[derive(Clone, Debug)]
pub(crate) struct Rows<P> {
    particles: usize,
    blocks: Vec<Block<P>>,
}

impl<P> Default for Rows<P> {
    fn default() -> Self {
        Self {
            particles: 0,
            blocks: Vec::new(),
        }
    }
}

/// The rows of one block of particles.
#[derive(Clone, Debug)]
pub(crate) struct Block<P> {
    /// Where each row ends.
    ends: Vec<usize>,
    partners: Vec<P>,
}

impl<P: Copy> Block<P> {
    const EMPTY: Self = Self {
        ends: Vec::new(),
        partners: Vec::new(),
    };

    /// Forgets all rows and keeps their memory.
    pub(crate) fn clear(&mut self) {
        self.ends.clear();
        self.partners.clear();
    }

    pub(crate) fn push_row(&mut self, partners: impl Iterator<Item = P>) {
        self.partners.extend(partners);
        self.ends.push(self.partners.len());
    }

    /// Partners in all rows.
    pub(crate) fn len(&self) -> usize {
        self.partners.len()
    }

    fn rows(&self) -> impl Iterator<Item = &[P]> {
        let mut start = 0;
        self.ends.iter().map(move |&end| {
            let row = &self.partners[start..end];
            start = end;
            row
        })
    }
}

/// Whether a pair of so many particles stands in one row.
fn is_inside(particles: usize, a: usize, b: usize) -> bool {
    let block = block_of(particles);
    a / block == b / block
}

impl<P: Partner> Rows<P> {
    /// The rows of `particles` from pairs in order; `partner` makes a row's entry from the other end and the pair.
    pub(crate) fn new(
        particles: usize,
        pairs: &[[u32; 2]],
        partner: impl Fn(u32, usize) -> P,
    ) -> Self {
        let ends = |&[a, b]: &[u32; 2]| {
            let first = [a.min(b), a.max(b)];
            let second =
                (!is_inside(particles, a as usize, b as usize)).then_some([first[1], first[0]]);
            [Some(first), second].into_iter().flatten()
        };
        let mut start = vec![0; particles + 1];
        for [row, _] in pairs.iter().flat_map(ends) {
            start[row as usize + 1] += 1;
        }
        for row in 0..particles {
            start[row + 1] += start[row];
        }
        let mut free = start.clone();
        let mut slots = vec![None; start[particles]];
        for (pair, both) in pairs.iter().enumerate() {
            for [row, other] in ends(both) {
                let at = &mut free[row as usize];
                slots[*at] = Some(partner(other, pair));
                *at += 1;
            }
        }
        let mut rows = Self::default();
        let size = block_of(particles);
        for (i, block) in rows.blocks_of(particles).iter_mut().enumerate() {
            for row in i * size..particles.min((i + 1) * size) {
                block.push_row(slots[start[row]..start[row + 1]].iter().copied().flatten());
            }
        }
        rows
    }

    /// The blocks of `particles`, all without rows.
    pub(crate) fn blocks_of(&mut self, particles: usize) -> &mut [Block<P>] {
        self.particles = particles;
        self.blocks.iter_mut().for_each(Block::clear);
        let blocks = particles.div_ceil(block_of(particles));
        self.blocks.resize(blocks, Block::EMPTY);
        &mut self.blocks
    }

    /// The particles of the block that starts with `first`, and the pairs that each evaluates.
    pub(crate) fn of_block(&self, first: usize) -> impl Iterator<Item = (usize, &[P])> {
        (first..).zip(self.blocks[first / block_of(self.particles)].rows())
    }

    /// Every pair at each of its ends, in the order in which forces are summed.
    pub(crate) fn for_each_end(&self, mut visit: impl FnMut(usize, usize, P)) {
        let rows = self.blocks.iter().flat_map(Block::rows);
        for (i, row) in rows.enumerate() {
            for &p in row {
                visit(i, p.other(), p);
                if is_inside(self.particles, i, p.other()) {
                    visit(p.other(), i, p);
                }
            }
        }
    }

    /// Every pair once.
    pub(crate) fn for_each_pair(&self, mut visit: impl FnMut(usize, usize)) {
        self.for_each_end(|a, b, _| {
            if a < b {
                visit(a, b);
            }
        });
    }

    /// Adds to every particle the forces of its pairs: `push(i, p)` acts on the partner `p`, its opposite on `i`.
    pub(crate) fn add_pushes(
        &self,
        force: &mut [Vector3<f64>],
        push: impl Fn(usize, P) -> Vector3<f64> + Sync,
    ) {
        for_each_block(force, |first, force| {
            for (i, row) in self.of_block(first) {
                let mut own = Vector3::zeros();
                for &p in row {
                    let push = push(i, p);
                    own -= push;
                    // A partner of another block has its own row.
                    if let Some(other) = force.get_mut(p.other().wrapping_sub(first)) {
                        *other += push;
                    }
                }
                force[i - first] += own;
            }
        });
    }
}

impl Rows<u32> {
    /// Adds to every particle the forces and torques of its pairs; `load(a, b)` is what a pair does.
    pub(crate) fn add_loads(
        &self,
        loads: &mut [[Vector3<f64>; 2]],
        load: impl Fn(usize, usize) -> PairLoad + Sync,
    ) {
        for_each_block(loads, |first, loads| {
            for (a, row) in self.of_block(first) {
                let [mut force, mut torque] = [Vector3::zeros(); 2];
                for &b in row {
                    let b = b as usize;
                    let PairLoad { push, torques } = load(a, b);
                    force -= push;
                    torque += torques[0];
                    if let Some(other) = loads.get_mut(b.wrapping_sub(first)) {
                        other[0] += push;
                        other[1] += torques[1];
                    }
                }
                loads[a - first][0] += force;
                loads[a - first][1] += torque;
            }
        });
    }
}

/// Works on blocks of entries, each with the index of its first; by several threads where that pays.
pub(crate) fn for_each_block<T: Send>(column: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    let size = block_of(column.len());
    if is_shared(column.len()) {
        column
            .par_chunks_mut(size)
            .enumerate()
            .for_each(|(block, part)| work(block * size, part));
    } else {
        for (block, part) in column.chunks_mut(size).enumerate() {
            work(block * size, part);
        }
    }
}
