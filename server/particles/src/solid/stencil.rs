//! How derivatives at a particle follow from the particles around it.

use nalgebra::{Matrix3, Vector3};

use super::{geodesic::Seen, surroundings::Surroundings};

/// Rows of particles that each particle sees.
#[derive(Clone, Debug)]
pub(crate) struct Stencils {
    /// Row i is from `start[i]` up to `start[i + 1]`.
    pub(crate) start: Vec<usize>,
    pub(crate) other: Vec<u32>,
    /// Along the body, m.
    pub(crate) distance: Vec<f64>,
    /// Of the kernel; a row sums to 1, or has nothing.
    pub(crate) share: Vec<f64>,
    /// What a value at the other adds to the gradient, 1/m, and its opposite at the particle itself.
    pub(crate) gradient: Vec<Vector3<f64>>,
    /// One per particle.
    pub(crate) sight: Vec<Sight>,
    /// Slots in which a particle is the other: of particle j from `incoming_start[j]` on.
    pub(crate) incoming_start: Vec<usize>,
    pub(crate) incoming: Vec<u32>,
    /// The piece that each particle hangs together with, from 0.
    pub(crate) pieces: Vec<u32>,
}

/// What a particle sees of the directions of space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// How far, m.
    pub(crate) reach: f64,
    /// The sum of the kernel's weights, without a unit.
    pub(crate) weight: f64,
    /// `A⁺`, 1/m².
    pub(crate) inverse: Matrix3<f64>,
    /// Unit vectors; the first `rank` are those it sees.
    pub(crate) axes: Matrix3<f64>,
    pub(crate) rank: usize,
}

impl Sight {
    /// `A A⁺`: the identity where every direction is seen.
    pub(crate) fn projector(&self) -> Matrix3<f64> {
        if self.rank == 3 {
            return Matrix3::identity();
        }
        let axes = (0..self.rank).map(|k| self.axes.column(k).into_owned());
        axes.map(|a| a * a.transpose()).sum()
    }
}

impl Stencils {
    /// Neighbourhoods and derivatives of the particles at rest, by moving least squares.
    pub(super) fn new(surroundings: &Surroundings) -> Self {
        let all: Vec<usize> = (0..surroundings.len()).collect();
        let rows = surroundings.rows(&all);
        Self::gather(rows, surroundings)
    }

    /// Takes the neighbourhoods and derivatives of some particles anew, ascending; the others stay as they are.
    pub(super) fn renew(&mut self, surroundings: &Surroundings, touched: &[usize]) {
        let mut renewed = touched.iter().zip(surroundings.rows(touched)).peekable();
        let mut next = Self::empty(self.other.len(), self.sight.len());
        for i in 0..self.sight.len() {
            if let Some((_, (row, sight))) = renewed.next_if(|(touched, _)| **touched == i) {
                next.push(i, row, sight, surroundings.positions());
            } else {
                let row = self.row(i);
                next.other.extend_from_slice(&self.other[row.clone()]);
                next.distance.extend_from_slice(&self.distance[row.clone()]);
                next.share.extend_from_slice(&self.share[row.clone()]);
                next.gradient.extend_from_slice(&self.gradient[row]);
                next.sight.push(self.sight[i]);
                next.start.push(next.other.len());
            }
        }
        next.turn_round();
        next.pieces = next.pieces();
        *self = next;
    }

    fn gather(rows: Vec<(Vec<Seen>, Sight)>, surroundings: &Surroundings) -> Self {
        let slots = rows.iter().map(|(row, _)| row.len()).sum();
        let mut stencils = Self::empty(slots, rows.len());
        for (i, (row, sight)) in rows.into_iter().enumerate() {
            stencils.push(i, row, sight, surroundings.positions());
        }
        stencils.turn_round();
        stencils.pieces = stencils.pieces();
        stencils
    }

    pub(super) fn empty(slots: usize, particles: usize) -> Self {
        Self {
            start: vec![0],
            other: Vec::with_capacity(slots),
            distance: Vec::with_capacity(slots),
            share: Vec::with_capacity(slots),
            gradient: Vec::with_capacity(slots),
            sight: Vec::with_capacity(particles),
            incoming_start: Vec::new(),
            incoming: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// Appends the row of particle `i`.
    fn push(&mut self, i: usize, row: Vec<Seen>, sight: Sight, positions: &[Vector3<f64>]) {
        for (other, distance) in row {
            let w = kernel(distance, sight.reach);
            let x = positions[other as usize] - positions[i];
            self.other.push(other);
            self.distance.push(distance);
            self.share.push(w / sight.weight);
            self.gradient.push(sight.inverse * x * w);
        }
        self.sight.push(sight);
        self.start.push(self.other.len());
    }

    /// Finds the slots in which each particle is the other.
    pub(super) fn turn_round(&mut self) {
        let mut start = vec![0_usize; self.sight.len() + 1];
        for &other in &self.other {
            start[other as usize + 1] += 1;
        }
        for i in 0..self.sight.len() {
            start[i + 1] += start[i];
        }
        let mut free = start.clone();
        self.incoming = vec![0; self.other.len()];
        for (slot, &other) in (0_u32..).zip(&self.other) {
            let at = &mut free[other as usize];
            self.incoming[*at] = slot;
            *at += 1;
        }
        self.incoming_start = start;
    }

    /// For each particle the piece that it hangs together with, from 0 in the order of their first particles.
    fn pieces(&self) -> Vec<u32> {
        const NONE: u32 = u32::MAX;
        let mut of = vec![NONE; self.sight.len()];
        let mut open = Vec::new();
        let mut piece = 0;
        for first in 0..of.len() {
            if of[first] != NONE {
                continue;
            }
            of[first] = piece;
            open.push(first);
            while let Some(i) = open.pop() {
                let owners = self.into(i).map(|slot| self.owner(slot));
                let seen = self.row(i).map(|slot| self.other[slot] as usize);
                for to in seen.chain(owners) {
                    if of[to] == NONE {
                        of[to] = piece;
                        open.push(to);
                    }
                }
            }
            piece += 1;
        }
        of
    }

    /// The particle whose slot it is.
    fn owner(&self, slot: usize) -> usize {
        self.start.partition_point(|&start| start <= slot) - 1
    }

    /// Pieces that nothing holds together, particles alone counted.
    pub(super) fn components(&self) -> usize {
        self.pieces
            .iter()
            .max()
            .map_or(0, |last| *last as usize + 1)
    }

    /// The slots of a particle.
    pub(crate) fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.start[i]..self.start[i + 1]
    }

    /// The slots in which a particle is the other.
    pub(crate) fn into(&self, i: usize) -> impl Iterator<Item = usize> {
        let slots = self.incoming_start[i]..self.incoming_start[i + 1];
        self.incoming[slots].iter().map(|&slot| slot as usize)
    }

    /// `Σ_j (v_j − v_i) ⊗ g_ij`. `[B4]`
    pub(crate) fn derivative(&self, i: usize, v: &[Vector3<f64>]) -> Matrix3<f64> {
        let slots = self.row(i);
        let mut sum = Matrix3::zeros();
        for (&other, gradient) in self.other[slots.clone()].iter().zip(&self.gradient[slots]) {
            sum += (v[other as usize] - v[i]) * gradient.transpose();
        }
        sum
    }
}

/// `w(D) = (1 − (D/h)²)³` `[B4]`
pub(super) fn kernel(distance: f64, reach: f64) -> f64 {
    (1.0 - (distance / reach).powi(2)).max(0.0).powi(3)
}
