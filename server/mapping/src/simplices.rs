//! Geodesic floods: a front that goes straight through the cells of a body.

use nalgebra::Vector3;

use crate::MappingError;
use crate::front::{Front, Medium};
use crate::wave::{Reached, Step, through_edge, through_triangle};

/// In place of the third of the other corners, where a simplex is a triangle.
const NO_CORNER: u32 = u32::MAX;

/// Beside this, a double has 40 bits below the point.
const ROUNDER: f64 = 1.5 * (1_u64 << 12) as f64;

/// By less than this, relative to what is known, nothing comes sooner.
const SAME: f64 = 1.0 - 1e-9;

/// In an obtuse cell a corner may be reached before all of those that the wave comes through: so many parts of the longest
/// edge later it is still corrected. Later ones hardly matter, and looking at them costs as much as all others.
const LATE: f64 = 8.0;

/// A body as tetrahedra, and triangles where it is a shell: what geodesics go through. `[W12]`
///
/// Two cells that share no corner, such as the two sides of a tear, are no neighbours: a geodesic goes round.
#[derive(Clone, Debug)]
pub struct Simplices {
    places: Vec<Vector3<f64>>,
    /// Of each corner, where the simplices at it are in `others`.
    starts: Vec<u32>,
    /// The other corners of each simplex.
    others: Vec<[u32; 3]>,
    /// m
    longest: f64,
    /// Until when a corner is corrected after it was left, m.
    late: f64,
    /// What rounds distances when it is added and taken away again: to 2⁻⁴⁰ of the longest edge, so that equal ways tie.
    rounder: f64,
}

impl Simplices {
    /// * `places` – of the corners, m.
    /// * `tetrahedra`, `triangles` – by their corners, in any order.
    ///
    /// # Errors
    /// A corner that does not exist.
    pub fn new(
        places: &[Vector3<f64>],
        tetrahedra: &[[u32; 4]],
        triangles: &[[u32; 3]],
    ) -> Result<Self, MappingError> {
        let nodes = places.len();
        let corners = tetrahedra.as_flattened().iter();
        let mut corners = corners.chain(triangles.as_flattened());
        if let Some(&node) = corners.find(|&&corner| corner as usize >= nodes) {
            return Err(MappingError::Node { node, nodes });
        }
        let pyramids = tetrahedra.iter().flat_map(|&[a, b, c, d]| {
            [
                (a, [b, c, d]),
                (b, [a, c, d]),
                (c, [a, b, d]),
                (d, [a, b, c]),
            ]
        });
        let flat = triangles.iter().flat_map(|&[a, b, c]| {
            [(a, [b, c]), (b, [a, c]), (c, [a, b])].map(|(p, [q, r])| (p, [q, r, NO_CORNER]))
        });
        let all = || pyramids.clone().chain(flat.clone());
        let mut starts = vec![0_u32; nodes + 1];
        for (corner, _) in all() {
            starts[corner as usize + 1] += 1;
        }
        for corner in 0..nodes {
            starts[corner + 1] += starts[corner];
        }
        let mut ends = starts.clone();
        let mut others = vec![[NO_CORNER; 3]; starts[nodes] as usize];
        let mut longest = 0.0_f64;
        for (corner, other) in all() {
            let end = &mut ends[corner as usize];
            others[*end as usize] = other;
            *end += 1;
            for q in other.into_iter().filter(|&q| q != NO_CORNER) {
                let edge = places[corner as usize] - places[q as usize];
                longest = longest.max(edge.norm());
            }
        }
        Ok(Self {
            places: places.to_vec(),
            starts,
            others,
            longest,
            late: longest / LATE,
            rounder: longest.log2().ceil().exp2() * ROUNDER,
        })
    }

    /// The other corners of each simplex at a corner.
    fn around(&self, corner: usize) -> &[[u32; 3]] {
        &self.others[self.starts[corner] as usize..self.starts[corner + 1] as usize]
    }

    /// The corners that share a simplex with this one, some of them more than once.
    pub(crate) fn neighbours(&self, corner: usize) -> impl Iterator<Item = u32> + '_ {
        let others = self.around(corner).iter().flatten().copied();
        others.filter(|&other| other != NO_CORNER)
    }

    /// The least way to `goal` from a corner that is left now through those of its simplex that were left before; infinite
    /// where it is none below what is known.
    fn step(&self, goal: u32, known: f64, now: (u32, f64), others: [(u32, f64); 2]) -> f64 {
        let goal = self.places[goal as usize];
        let seen = |(corner, distance): (u32, f64)| Reached {
            from: self.places[corner as usize] - goal,
            distance,
        };
        let p = seen(now);
        // The others have their turn when they are left.
        let [q, r] = others.map(|other| (other.1 <= now.1).then(|| seen(other)));
        let mut sides = [true; 2];
        if let (Some(q), Some(r)) = (&q, &r) {
            match through_triangle(&p, q, r, known) {
                Step::Hit(found) => return found,
                Step::Late => return f64::INFINITY,
                Step::Miss(beside) => sides = beside,
            }
        }
        let mut least = f64::INFINITY;
        for (other, is_there) in [q, r].iter().zip(sides) {
            if let Some(other) = other.as_ref().filter(|_| is_there) {
                least = least.min(through_edge(&p, other));
            }
        }
        if least < known { least } else { p.along_edge() }
    }
}

impl Medium for Simplices {
    fn nodes(&self) -> usize {
        self.places.len()
    }

    fn range(&self) -> [f64; 2] {
        [0.0, self.longest]
    }

    fn round(&self, distance: f64) -> f64 {
        distance + self.rounder - self.rounder
    }

    fn leave(&self, node: u32, distance: f64, front: &mut impl Front) {
        for &others in self.around(node as usize) {
            let known = others.map(|other| match other {
                NO_CORNER => f64::INFINITY,
                corner => front.known(corner),
            });
            for goal in 0..3 {
                if others[goal] == NO_CORNER || known[goal] <= distance - self.late {
                    continue;
                }
                let before = [(goal + 1) % 3, (goal + 2) % 3].map(|i| (others[i], known[i]));
                let found = self.round(self.step(
                    others[goal],
                    known[goal] * SAME,
                    (node, distance),
                    before,
                ));
                if found < known[goal] {
                    front.reach(others[goal], found);
                }
            }
        }
    }
}
