//! Where the paths of each point start.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{Root, Roots, Rows, Start};

/// Targets that share a box: so small that few beside the nearest are looked at, so large that boxes are few.
const BOXED: usize = 64;

/// Targets are as near as the nearest to this, relative to its distance.
pub(crate) const TIE: f64 = 1e-9;

/// The roots of the usable points, by rising point. [`Roots`] says which.
///
/// # Panics
/// If the paths start in volumes, and `holding` does not tell which hold a point.
pub(crate) fn roots(
    (from, start): (Roots, Start),
    centres: &[Vector3<f64>],
    points: &[Vector3<f64>],
    usable: &[u32],
    holding: Option<&Rows>,
) -> Vec<Root> {
    let boxes = Boxes::new(centres);
    let of_point = |&source: &u32| -> Vec<Root> {
        let point = &points[source as usize];
        let nodes = match from {
            Roots::Nearest => boxes.nearest(point),
            Roots::Ball(radius) => boxes.within(point, radius * radius),
            Roots::Containing => {
                let holding = holding.expect("the mesh tells which volumes hold a point");
                match holding.row(source as usize) {
                    [] => boxes.nearest(point),
                    held => held.to_vec(),
                }
            }
        };
        let start = |node: u32| match start {
            Start::Zero => 0.0,
            Start::Distance => (centres[node as usize] - point).norm(),
        };
        let root = |node| Root {
            node,
            source,
            start: start(node),
        };
        nodes.into_iter().map(root).collect()
    };
    let found: Vec<Vec<Root>> = usable.par_iter().map(of_point).collect();
    found.into_iter().flatten().collect()
}

/// The targets in boxes, by their order: as far apart in a mesh as in its numbers, or else merely slower.
struct Boxes<'a> {
    centres: &'a [Vector3<f64>],
    /// The lowest and the highest corner of each, m.
    corners: Vec<[Vector3<f64>; 2]>,
}

impl<'a> Boxes<'a> {
    fn new(centres: &'a [Vector3<f64>]) -> Self {
        let corners = centres.chunks(BOXED).map(|boxed| {
            let nothing = [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat);
            boxed
                .iter()
                .fold(nothing, |[low, high], x| [low.inf(x), high.sup(x)])
        });
        Self {
            centres,
            corners: corners.collect(),
        }
    }

    /// The least squared distance that a target in a box may have from a place, m².
    fn least(&self, index: usize, place: &Vector3<f64>) -> f64 {
        let [low, high] = self.corners[index];
        (low - place)
            .sup(&(place - high))
            .sup(&Vector3::zeros())
            .norm_squared()
    }

    fn nearest(&self, place: &Vector3<f64>) -> Vec<u32> {
        let mut boxes: Vec<(f64, usize)> = (0..self.corners.len())
            .map(|index| (self.least(index, place), index))
            .collect();
        let mut nearest = f64::INFINITY;
        // The most promising box first: it rules out nearly all others.
        if let Some(first) = (0..boxes.len()).min_by(|&a, &b| boxes[a].0.total_cmp(&boxes[b].0)) {
            boxes.swap(0, first);
        }
        for (least, index) in boxes {
            if least < nearest {
                let boxed = self.centres.chunks(BOXED).nth(index).unwrap_or_default();
                let squares = boxed.iter().map(|x| (x - place).norm_squared());
                nearest = squares.fold(nearest, f64::min);
            }
        }
        if nearest == f64::INFINITY {
            return Vec::new(); // no target is anywhere
        }
        self.within(place, nearest * (1.0 + TIE) * (1.0 + TIE))
    }

    fn within(&self, place: &Vector3<f64>, squared: f64) -> Vec<u32> {
        let mut found = Vec::new();
        let numbers = (0_u32..).step_by(BOXED);
        for ((index, boxed), first) in self.centres.chunks(BOXED).enumerate().zip(numbers) {
            if self.least(index, place) <= squared {
                let near = (first..)
                    .zip(boxed)
                    .filter(|(_, x)| (*x - place).norm_squared() <= squared);
                found.extend(near.map(|(node, _)| node));
            }
        }
        found
    }
}
