//! Derivatives under which a constant stress pushes no inner particle, so that irregular clouds converge, too.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::stencil::Stencils;

/// What is left of the pushes, as a fraction of their start, and the most iterations.
const ENOUGH: f64 = 1e-12;
const ITERATIONS: usize = 200;

impl Stencils {
    /// Adds to the gradients of some particles what shows them curved fields, and then the least that makes
    /// `Σ_i (V_i g_ij − V_j g_ji)` vanish, at them and at all that they see, in every direction in which nothing but the
    /// body is there. No derivative of a linear field changes. `[B5]`
    ///
    /// * `of` – ascending; their gradients are by moving least squares. Those of the others stay as they are.
    pub(super) fn make_consistent(
        &mut self,
        positions: &[Vector3<f64>],
        volumes: &[f64],
        of: &[usize],
    ) {
        let part = Part::new(self, positions, volumes, of);
        let curvature = part.stencils.curvature(&part.positions);
        part.add_to(self, &curvature);
        let pushes = self.pushes(volumes, &part.members);
        let within = self.within(positions, &part.members);
        let pairs = pushes.iter().zip(&within);
        let pushes: Vec<_> = pairs.map(|(push, within)| within * push).collect();
        let equations = Equations {
            stencils: &part.stencils,
            positions: &part.positions,
            scale: part.scales(),
            within,
        };
        let multipliers = equations.solve(&pushes);
        let mut corrections = equations.corrections(&multipliers);
        for (i, volume) in part.volumes.iter().enumerate() {
            let row = &mut corrections[part.stencils.row(i)];
            row.iter_mut().for_each(|correction| *correction /= *volume);
        }
        part.add_to(self, &corrections);
    }

    /// By what a constant stress of 1 Pa pushes particles, m².
    fn pushes(&self, volumes: &[f64], members: &[usize]) -> Vec<Vector3<f64>> {
        let mut owner = vec![0.0; self.other.len()];
        for (i, volume) in volumes.iter().enumerate() {
            owner[self.row(i)].fill(*volume);
        }
        let pushes = members.par_iter().map(|&i| {
            let push = |slot: usize| self.gradient[slot] * owner[slot];
            let arriving: Vector3<f64> = self.into(i).map(push).sum();
            arriving - self.row(i).map(push).sum::<Vector3<f64>>()
        });
        pushes.collect()
    }
}

/// Some rows of stencils, by themselves: of particles, and without slots of those that they see.
struct Part {
    /// Which particles these are, ascending.
    members: Vec<usize>,
    stencils: Stencils,
    positions: Vec<Vector3<f64>>,
    /// m³.
    volumes: Vec<f64>,
    /// In the whole, of each slot.
    slots: Vec<usize>,
}

impl Part {
    fn new(whole: &Stencils, positions: &[Vector3<f64>], volumes: &[f64], of: &[usize]) -> Self {
        let seen = of.iter().flat_map(|&i| &whole.other[whole.row(i)]);
        let mut members: Vec<usize> = seen
            .map(|&j| j as usize)
            .chain(of.iter().copied())
            .collect();
        members.sort_unstable();
        members.dedup();
        let mut place = vec![0_u32; positions.len()];
        for (at, &member) in (0..).zip(&members) {
            place[member] = at;
        }
        let mut stencils = Stencils::empty(0, members.len());
        let mut slots = Vec::new();
        let mut rows = of.iter().peekable();
        for &member in &members {
            if rows.next_if(|&&i| i == member).is_some() {
                let row = whole.row(member);
                let others = whole.other[row.clone()].iter();
                stencils.other.extend(others.map(|&j| place[j as usize]));
                stencils.share.extend_from_slice(&whole.share[row.clone()]);
                stencils
                    .gradient
                    .extend_from_slice(&whole.gradient[row.clone()]);
                slots.extend(row);
            }
            stencils.sight.push(whole.sight[member]);
            stencils.start.push(stencils.other.len());
        }
        stencils.turn_round();
        Self {
            positions: members.iter().map(|&i| positions[i]).collect(),
            volumes: members.iter().map(|&i| volumes[i]).collect(),
            members,
            stencils,
            slots,
        }
    }

    /// Adds a column of the part's slots to the gradients of the whole.
    fn add_to(&self, whole: &mut Stencils, column: &[Vector3<f64>]) {
        for (&slot, more) in self.slots.iter().zip(column) {
            whole.gradient[slot] += more;
        }
    }

    /// `w V²` of every slot, in units of the row's kernel.
    fn scales(&self) -> Vec<f64> {
        let mut scales = Vec::with_capacity(self.slots.len());
        for (i, sight) in self.stencils.sight.iter().enumerate() {
            let square = sight.weight * self.volumes[i].powi(2);
            let shares = &self.stencils.share[self.stencils.row(i)];
            scales.extend(shares.iter().map(|share| share * square));
        }
        scales
    }
}

/// The normal equations of the multipliers, one vector per particle: symmetric, and positive where a multiplier is no
/// linear function of place.
struct Equations<'a> {
    stencils: &'a Stencils,
    positions: &'a [Vector3<f64>],
    /// Per slot.
    scale: Vec<f64>,
    /// The directions that a multiplier may have.
    within: Vec<Matrix3<f64>>,
}

impl Equations<'_> {
    /// What the multipliers add to `V_i g_ij`: what their linear part leaves.
    fn corrections(&self, multipliers: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let Self {
            stencils,
            positions,
            scale,
            ..
        } = self;
        let rows = (0..multipliers.len()).into_par_iter();
        let slots = rows.flat_map_iter(|i| {
            let linear = stencils.derivative(i, multipliers);
            stencils.row(i).map(move |slot| {
                let j = stencils.other[slot] as usize;
                let difference = multipliers[j] - multipliers[i];
                (difference - linear * (positions[j] - positions[i])) * scale[slot]
            })
        });
        slots.collect()
    }

    fn apply(&self, multipliers: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let corrections = self.corrections(multipliers);
        let stencils = self.stencils;
        let rows = (0..multipliers.len()).into_par_iter();
        let sums = rows.map(|i| {
            let arriving: Vector3<f64> = stencils.into(i).map(|slot| corrections[slot]).sum();
            let leaving: Vector3<f64> = stencils.row(i).map(|slot| corrections[slot]).sum();
            self.within[i] * (arriving - leaving)
        });
        sums.collect()
    }

    /// The multipliers that take back the pushes, by conjugate gradients.
    fn solve(&self, pushes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let n = pushes.len();
        let mut diagonal = vec![0.0; n];
        for i in 0..n {
            for slot in self.stencils.row(i) {
                diagonal[i] += self.scale[slot];
                diagonal[self.stencils.other[slot] as usize] += self.scale[slot];
            }
        }
        let conditioned = |residual: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            let pairs = residual.iter().zip(&diagonal);
            pairs
                .map(|(r, &d)| if d > 0.0 { r / d } else { Vector3::zeros() })
                .collect()
        };
        let mut x = vec![Vector3::zeros(); n];
        let mut residual: Vec<_> = pushes.iter().map(|push| -push).collect();
        let mut direction = conditioned(&residual);
        let mut size = dot(&residual, &direction);
        let enough = size * (ENOUGH * ENOUGH);
        for _ in 0..ITERATIONS {
            if size <= enough {
                break;
            }
            let product = self.apply(&direction);
            let step = size / dot(&direction, &product);
            for i in 0..n {
                x[i] += direction[i] * step;
                residual[i] -= product[i] * step;
            }
            let next = conditioned(&residual);
            let smaller = dot(&residual, &next);
            for (direction, next) in direction.iter_mut().zip(&next) {
                *direction = next + *direction * (smaller / size);
            }
            size = smaller;
        }
        x
    }
}

/// The product of two columns of vectors.
fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
