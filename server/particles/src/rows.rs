//! Pairs of particles, ordered so that their forces can be summed by many threads to the same bits.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::pairs::PairLoad;

/// Particles per block: enough work to pay for a task, few enough for every thread to get some.
pub(crate) const BLOCK: usize = 8192;

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
/// A pair within a block of [`BLOCK`] particles stands in one row and serves both of its ends. A pair across blocks
/// stands in the rows of both ends, so that no block writes into another: a little more arithmetic, but neither locks
/// nor an order that depends on the threads.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows<P> {
    /// Row i is `partners[start[i]..start[i + 1]]`, within the block up to `split[i]`.
    start: Vec<usize>,
    split: Vec<usize>,
    partners: Vec<P>,
}

impl<P: Partner> Rows<P> {
    /// The rows of `particles` from pairs in order; `partner` makes a row's entry from the other end and the pair.
    pub(crate) fn new(
        particles: usize,
        pairs: &[[u32; 2]],
        partner: impl Fn(u32, usize) -> P,
    ) -> Self {
        let block = |i: u32| i as usize / BLOCK;
        let mut inside = vec![0_usize; particles];
        let mut border = vec![0_usize; particles];
        for &[a, b] in pairs {
            if block(a) == block(b) {
                inside[a.min(b) as usize] += 1;
            } else {
                border[a as usize] += 1;
                border[b as usize] += 1;
            }
        }
        let mut start = Vec::with_capacity(particles + 1);
        let mut split = Vec::with_capacity(particles);
        let mut end = 0;
        for (inside, border) in inside.iter().zip(&border) {
            start.push(end);
            split.push(end + inside);
            end += inside + border;
        }
        start.push(end);
        let mut free: [Vec<usize>; 2] = [start.clone(), split.clone()];
        let mut slots = vec![None; end];
        let mut put = |part: usize, row: u32, other: u32, pair: usize| {
            let at = &mut free[part][row as usize];
            slots[*at] = Some(partner(other, pair));
            *at += 1;
        };
        for (pair, &[a, b]) in pairs.iter().enumerate() {
            if block(a) == block(b) {
                put(0, a.min(b), a.max(b), pair);
            } else {
                put(1, a, b, pair);
                put(1, b, a, pair);
            }
        }
        let partners = slots.into_iter().flatten().collect();
        Self {
            start,
            split,
            partners,
        }
    }

    /// Rows from those of consecutive blocks: for each row how many partners it has within the block and across, and
    /// all partners.
    pub(crate) fn joined(blocks: impl Iterator<Item = (Vec<usize>, Vec<usize>, Vec<P>)>) -> Self {
        let mut rows = Self {
            start: vec![0],
            split: Vec::new(),
            partners: Vec::new(),
        };
        let mut end = 0;
        for (inside, border, mut partners) in blocks {
            for (inside, border) in inside.iter().zip(&border) {
                rows.split.push(end + inside);
                end += inside + border;
                rows.start.push(end);
            }
            rows.partners.append(&mut partners);
        }
        rows
    }

    /// The pairs that a particle evaluates: for both ends, and for itself alone.
    pub(crate) fn row(&self, i: usize) -> (&[P], &[P]) {
        let row = &self.partners[self.start[i]..self.start[i + 1]];
        row.split_at(self.split[i] - self.start[i])
    }

    /// Every pair at each of its ends, in the order in which forces are summed.
    pub(crate) fn for_each_end(&self, mut visit: impl FnMut(usize, usize, P)) {
        for i in 0..self.split.len() {
            let (inside, border) = self.row(i);
            for &p in inside {
                visit(i, p.other(), p);
                visit(p.other(), i, p);
            }
            for &p in border {
                visit(i, p.other(), p);
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
        let add = |first: usize, force: &mut [Vector3<f64>]| {
            for i in first..first + force.len() {
                let mut own = Vector3::zeros();
                let (inside, border) = self.row(i);
                for &p in inside {
                    let push = push(i, p);
                    own -= push;
                    force[p.other() - first] += push;
                }
                for &p in border {
                    own -= push(i, p);
                }
                force[i - first] += own;
            }
        };
        for_each_block(force, add);
    }
}

impl Rows<u32> {
    /// Adds to every particle the forces and torques of its pairs; `load(a, b)` is what a pair does.
    pub(crate) fn add_loads(
        &self,
        loads: &mut [[Vector3<f64>; 2]],
        load: impl Fn(usize, usize) -> PairLoad + Sync,
    ) {
        let add = |first: usize, loads: &mut [[Vector3<f64>; 2]]| {
            for a in first..first + loads.len() {
                let [mut force, mut torque] = [Vector3::zeros(); 2];
                let (inside, border) = self.row(a);
                for &b in inside {
                    let b = b as usize;
                    let PairLoad { push, torques } = load(a, b);
                    force -= push;
                    torque += torques[0];
                    loads[b - first][0] += push;
                    loads[b - first][1] += torques[1];
                }
                for &b in border {
                    let PairLoad { push, torques } = load(a, b as usize);
                    force -= push;
                    torque += torques[0];
                }
                loads[a - first][0] += force;
                loads[a - first][1] += torque;
            }
        };
        for_each_block(loads, add);
    }
}

/// Works on blocks of [`BLOCK`] entries, each with the index of its first; by several threads where that pays.
pub(crate) fn for_each_block<T: Send>(column: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    if is_shared(column.len()) {
        column
            .par_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(block, part)| work(block * BLOCK, part));
    } else {
        for (block, part) in column.chunks_mut(BLOCK).enumerate() {
            work(block * BLOCK, part);
        }
    }
}
