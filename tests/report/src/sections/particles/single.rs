//! What pair forces in single precision would gain, and what they would cost: a prototype of the one loop.

use std::hint::black_box;

use nalgebra::Vector3;
use sinew_particles::System;

use crate::{
    section::{Cell, Failure, Findings, Table, digits},
    timing::{Spread, by_turns},
};

/// Pairs act within this distance, and are listed up to the other.
const REACH: f32 = 2.5;
const LISTED: f64 = 3.0;
/// Pairs that are weighed at once.
const BATCH: usize = 256;
/// Speed from which single precision would pay.
const AIM: f64 = 1.5;

pub(super) fn measure(findings: &mut Findings, melt: &System) -> Result<(), Failure> {
    let places = sorted(melt.positions());
    let list = List::new(&places)?;
    let middle = places.iter().sum::<Vector3<f64>>() / f64::from(u32::try_from(places.len())?);
    let double: Vec<[f64; 3]> = places.iter().map(|x| (x - middle).into()).collect();
    #[expect(
        clippy::cast_possible_truncation,
        reason = "single precision is the question"
    )]
    let single: Vec<[f32; 3]> = double.iter().map(|x| x.map(|c| c as f32)).collect();
    let mut forces = [double.clone(), double.clone()];
    let [exact, rounded] = &mut forces;
    let seconds = by_turns(
        4.0,
        &mut [
            &mut || in_double(black_box(&double), &list, exact),
            &mut || in_single(black_box(&single), &list, rounded),
        ],
    );
    let gain = Spread::of_ratio(&seconds[0], &seconds[1]);
    let pairs = exact.iter().zip(rounded.iter());
    let off: f64 = pairs.map(|(a, b)| apart(*a, *b)).sum();
    let size: f64 = exact.iter().map(|f| apart(*f, [0.0; 3])).sum();
    let error = (off / size).sqrt();
    findings.text(format!(
        "Why forces are in double precision: a prototype of the loop over the listed pairs of a melt of {} particles, once in \
         double precision and once with places and pair forces in single precision and sums in double. It is offered where it \
         gains {AIM}; the rest of a step, which makes lists and moves particles, gains nothing.",
        places.len(),
    ));
    let mut table = Table::new(
        "Pair forces in single precision",
        [
            "double over single, time",
            "rms error of forces, relative",
            "pairs listed",
        ],
    );
    let verdict = Cell::Verdict {
        holds: gain.median < AIM,
        figure: format!(
            "{} ({} to {})",
            digits(gain.median),
            digits(gain.low),
            digits(gain.high)
        ),
    };
    table.row([
        verdict,
        error.into(),
        list.partners.len().to_string().into(),
    ]);
    findings.table(table);
    Ok(())
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum()
}

/// The places in the order of slabs, rows and cells of a grid.
fn sorted(places: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut sorted = places.to_vec();
    let cell = |x: &Vector3<f64>| {
        let [a, b, c]: [f64; 3] = x.map(|c| (c / LISTED).floor()).into();
        [a, b, c]
    };
    sorted.sort_by(|a, b| cell(a).partial_cmp(&cell(b)).expect("places are finite"));
    sorted
}

/// For each place those after it that are near.
struct List {
    ends: Vec<usize>,
    partners: Vec<u32>,
}

impl List {
    /// Slabs of the first axis bound the search, which is enough for a prototype.
    fn new(places: &[Vector3<f64>]) -> Result<Self, Failure> {
        let mut list = Self {
            ends: Vec::new(),
            partners: Vec::new(),
        };
        for (i, x) in places.iter().enumerate() {
            let slab = (x.x / LISTED).floor() + 2.0;
            let near = ((i + 1)..)
                .zip(&places[i + 1..])
                .take_while(|(_, y)| (y.x / LISTED).floor() < slab)
                .filter(|(_, y)| (*y - x).norm_squared() < LISTED * LISTED);
            for (j, _) in near {
                list.partners.push(u32::try_from(j)?);
            }
            list.ends.push(list.partners.len());
        }
        Ok(list)
    }
}

/// The loop of the engine's kernel for 12-6 with ε = σ = 1: pairs within reach are picked, weighed together, and summed.
macro_rules! forces {
    ($name:ident, $real:ident) => {
        fn $name(places: &[[$real; 3]], list: &List, forces: &mut [[f64; 3]]) {
            forces.fill([0.0; 3]);
            let mut partner = [0_u32; BATCH];
            let mut apart = [[0.0 as $real; 3]; BATCH];
            let mut weight = [0.0 as $real; BATCH];
            let mut start = 0;
            for (i, &end) in list.ends.iter().enumerate() {
                let at = places[i];
                let mut own = [0.0; 3];
                for row in list.partners[start..end].chunks(BATCH) {
                    let mut count = 0;
                    for &j in row {
                        let r = [0, 1, 2].map(|axis| places[j as usize][axis] - at[axis]);
                        let square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
                        (partner[count], apart[count], weight[count]) = (j, r, square);
                        count += usize::from(square < $real::from(REACH * REACH));
                    }
                    for square in &mut weight[..count] {
                        let inverse = square.recip();
                        let x = inverse * inverse * inverse;
                        *square = 24.0 * inverse * x * (2.0 * x - 1.0);
                    }
                    for k in 0..count {
                        let push = apart[k].map(|r| f64::from(r * weight[k]));
                        for axis in 0..3 {
                            own[axis] -= push[axis];
                            forces[partner[k] as usize][axis] += push[axis];
                        }
                    }
                }
                for axis in 0..3 {
                    forces[i][axis] += own[axis];
                }
                start = end;
            }
        }
    };
}

forces!(in_double, f64);
forces!(in_single, f32);
