//! How derivatives at a particle follow from the particles around it.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use super::{
    Metric, Reach, SolidSpec,
    geodesic::{Search, Seen, neighbourhoods},
    graph::{Graph, Places, Pricing},
};

/// Eigenvalues of a moment matrix below this part of the greatest are directions that no neighbour shows.
const HIDDEN: f64 = 1e-6;
/// By what a reach grows where the neighbours show too few directions, and up to how much in all.
const GROWTH: f64 = 1.25;
const GROWN: f64 = 2.0;

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
    pub(super) fn new(spec: &SolidSpec, places: &Places, spacings: &[f64]) -> Self {
        let SolidSpec {
            dimension,
            metric,
            reach,
            ..
        } = *spec;
        let most = match reach {
            Reach::Length(_) => 1.0,
            Reach::Spacings(_) => GROWN,
        };
        let reach = reach.of(spacings);
        let pricing = Pricing::new(metric, spacings, &reach);
        let graph = Graph::new(places, &reach, &pricing);
        let rows = neighbourhoods(&graph, metric, &reach);
        let grow = Grow {
            graph: &graph,
            metric,
            places,
            dimension: dimension.count(),
            most,
        };
        let rows = rows.into_par_iter().enumerate();
        let rows: Vec<(Vec<Seen>, Sight)> = rows
            .map_init(
                || Search::new(graph.len()),
                |search, (i, seen)| grow.until_seen(search, i, seen, reach[i]),
            )
            .collect();
        Self::gather(rows, places.positions, graph.pieces())
    }

    fn gather(rows: Vec<(Vec<Seen>, Sight)>, positions: &[Vector3<f64>], pieces: Vec<u32>) -> Self {
        let mut start = vec![0];
        start.extend(rows.iter().scan(0, |end, (row, _)| {
            *end += row.len();
            Some(*end)
        }));
        let count = start[rows.len()];
        let mut stencils = Self {
            start,
            other: Vec::with_capacity(count),
            distance: Vec::with_capacity(count),
            share: Vec::with_capacity(count),
            gradient: Vec::with_capacity(count),
            sight: Vec::with_capacity(rows.len()),
            incoming_start: Vec::new(),
            incoming: Vec::new(),
            pieces,
        };
        for (i, (row, sight)) in rows.into_iter().enumerate() {
            for (other, distance) in row {
                let w = kernel(distance, sight.reach);
                let x = positions[other as usize] - positions[i];
                stencils.other.push(other);
                stencils.distance.push(distance);
                stencils.share.push(w / sight.weight);
                stencils.gradient.push(sight.inverse * x * w);
            }
            stencils.sight.push(sight);
        }
        stencils.turn_round();
        stencils
    }

    /// Finds the slots in which each particle is the other.
    fn turn_round(&mut self) {
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

/// Widens the reach of particles whose neighbours show too few directions.
struct Grow<'a> {
    graph: &'a Graph,
    metric: Metric,
    places: &'a Places<'a>,
    dimension: usize,
    /// By how much in all.
    most: f64,
}

impl Grow<'_> {
    /// Where no reach shows more, the first.
    fn until_seen(
        &self,
        search: &mut Search,
        i: usize,
        seen: Vec<Seen>,
        reach: f64,
    ) -> (Vec<Seen>, Sight) {
        let first = self.sight(i, seen, reach);
        let enough = |(row, sight): &(Vec<Seen>, Sight)| {
            sight.rank >= self.dimension && row.len() > self.dimension
        };
        if enough(&first) {
            return first;
        }
        let mut wider = reach * GROWTH;
        while wider <= reach * self.most {
            let near = self.places.near(i, wider).into_iter();
            let near: Vec<u32> = near.map(|(other, _)| other).collect();
            let found = search.within_reach(self.graph, self.metric, i, wider, &near);
            let seen = search.settle(self.graph, i, found, &[]);
            let grown = self.sight(i, seen, wider);
            if enough(&grown) {
                return grown;
            }
            wider *= GROWTH;
        }
        first
    }

    /// Drops those without weight; what is left may be no one.
    fn sight(&self, i: usize, mut seen: Vec<Seen>, reach: f64) -> (Vec<Seen>, Sight) {
        seen.retain(|&(_, distance)| kernel(distance, reach) > 0.0);
        let mut moment = Matrix3::zeros();
        let mut weight = 0.0;
        for &(other, distance) in &seen {
            let w = kernel(distance, reach);
            let x = self.places.positions[other as usize] - self.places.positions[i];
            weight += w;
            moment += x * x.transpose() * w;
        }
        let (inverse, axes, rank) = pseudo_inverse(&moment);
        let sight = Sight {
            reach,
            weight,
            inverse,
            axes,
            rank,
        };
        (seen, sight)
    }
}

/// The inverse on the directions that a moment matrix has, all directions, those it has first, and how many they are.
/// `[B4]`
fn pseudo_inverse(moment: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>, usize) {
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = moment.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigenvalues[b].total_cmp(&eigenvalues[a]));
    let greatest = eigenvalues[order[0]];
    let seen = order
        .iter()
        .filter(|&&k| greatest > 0.0 && eigenvalues[k] > HIDDEN * greatest);
    let rank = seen.count();
    let axes = Matrix3::from_columns(&order.map(|k| eigenvectors.column(k).into_owned()));
    let terms = order[..rank].iter().zip(axes.column_iter());
    let inverse = terms
        .map(|(&k, axis)| axis * axis.transpose() / eigenvalues[k])
        .sum();
    (inverse, axes, rank)
}
