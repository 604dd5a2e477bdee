//! What each particle sees of the body at rest, and what it sees no more once the body is torn.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use super::{
    Metric, Reach, SolidSpec,
    geodesic::{Search, Seen, neighbourhoods},
    graph::{Graph, Places, Pricing, pair},
    stencil::{Sight, kernel},
};

/// Eigenvalues of a moment matrix below this part of the greatest are directions that no neighbour shows.
const HIDDEN: f64 = 1e-6;
/// Those below this part are shown so faintly that derivatives along them, and with them the stiffness, are out of all
/// proportion: where the reach may grow, it does, and else they are not seen, either. `[B15]`
const FAINT: f64 = 0.02;
/// By what a reach grows where the neighbours show too few directions, and up to how much in all.
const GROWTH: f64 = 1.25;
const GROWN: f64 = 2.0;

/// Who can see whom.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    pub(super) places: Places,
    graph: Graph,
    metric: Metric,
    /// Of each particle, m, and by how much it may grow.
    reach: Vec<f64>,
    most: f64,
    dimension: usize,
    /// Pairs that see each other no more.
    severed: BTreeSet<[u32; 2]>,
}

impl Surroundings {
    pub(super) fn new(spec: &SolidSpec, places: Places, spacings: &[f64]) -> Self {
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
        let graph = Graph::new(&places, &reach, &Pricing::new(metric, spacings, &reach));
        Self {
            places,
            graph,
            metric,
            reach,
            most,
            dimension: dimension.count(),
            severed: BTreeSet::new(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.reach.len()
    }

    /// At rest, m.
    pub(super) fn positions(&self) -> &[Vector3<f64>] {
        &self.places.positions
    }

    /// Who stands so near a particle that they may see each other.
    pub(super) fn bonds(&self, i: usize) -> impl Iterator<Item = u32> {
        let arcs = self.graph.row(i).iter();
        let open = arcs.filter(move |arc| match self.metric {
            // The cheapest path may cost this much, once all others are cut.
            Metric::Geodesic { .. } => true,
            Metric::Graded { .. } => {
                arc.cost <= self.most * self.reach[i].max(self.reach[arc.to as usize])
            }
        });
        open.map(|arc| arc.to)
    }

    /// Lets no particle of a pair see the other again; the particles whose neighbourhoods may be others now, ascending.
    ///
    /// Where a distance is the length of a path, these are near the pairs. The cheapest path of an exponent may run anywhere:
    /// these are all.
    pub(super) fn sever(&mut self, pairs: &[[u32; 2]]) -> Vec<usize> {
        self.severed.extend(pairs);
        self.graph.sever(&self.severed);
        let widest = self.most * self.reach.iter().copied().fold(0.0, f64::max);
        let touched = match self.metric {
            Metric::Geodesic { exponent } if exponent > 1.0 => (0..self.len()).collect(),
            Metric::Geodesic { .. } | Metric::Graded { .. } => {
                let mut ends: Vec<u32> = pairs.iter().flatten().copied().collect();
                ends.sort_unstable();
                ends.dedup();
                let near = ends.par_iter().flat_map_iter(|&end| {
                    let near = self.places.near(end as usize, widest).into_iter();
                    let reached = |(i, distance): (u32, f64)| {
                        (distance <= self.most * self.reach[i as usize]).then_some(i as usize)
                    };
                    near.filter_map(reached).chain([end as usize])
                });
                near.collect::<BTreeSet<_>>()
            }
        };
        touched.into_iter().collect()
    }

    /// What some particles see, widened where it shows too few directions.
    pub(super) fn rows(&self, of: &[usize]) -> Vec<(Vec<Seen>, Sight)> {
        let rows = neighbourhoods(&self.graph, self.metric, &self.reach, of);
        let rows = of.par_iter().zip(rows);
        rows.map_init(
            || Search::new(self.len()),
            |search, (&i, seen)| self.until_seen(search, i, seen),
        )
        .collect()
    }

    /// Where no reach shows enough, the first.
    fn until_seen(&self, search: &mut Search, i: usize, seen: Vec<Seen>) -> (Vec<Seen>, Sight) {
        let reach = self.reach[i];
        // A wider look for the cheapest path of an exponent may search the whole body: only where there is no other way.
        let bar = match self.metric {
            Metric::Geodesic { exponent } if exponent > 1.0 => HIDDEN,
            Metric::Geodesic { .. } | Metric::Graded { .. } if self.most > 1.0 => FAINT,
            Metric::Geodesic { .. } | Metric::Graded { .. } => HIDDEN,
        };
        let enough = |(row, sight): &(Vec<Seen>, Sight)| {
            sight.rank >= self.dimension && row.len() > self.dimension
        };
        let first = self.sight(i, seen, reach, bar);
        if enough(&first) {
            return first;
        }
        let mut wider = reach * GROWTH;
        while wider <= reach * self.most {
            let near = self
                .places
                .near(i, wider)
                .into_iter()
                .map(|(other, _)| other);
            let own = u32::try_from(i).expect("particles are counted in 32 bits");
            let near: Vec<u32> = near
                .filter(|&other| !self.severed.contains(&pair(own, other)))
                .collect();
            let found = search.within_reach(&self.graph, self.metric, i, wider, &near);
            let seen = search.settle(&self.graph, i, found, &[]);
            let grown = self.sight(i, seen, wider, bar);
            if enough(&grown) {
                return grown;
            }
            wider *= GROWTH;
        }
        first
    }

    /// Drops those without weight; what is left may be no one. Directions below a `bar` count as not seen.
    fn sight(&self, i: usize, mut seen: Vec<Seen>, reach: f64, bar: f64) -> (Vec<Seen>, Sight) {
        seen.retain(|&(_, distance)| kernel(distance, reach) > 0.0);
        let mut moment = Matrix3::zeros();
        let mut weight = 0.0;
        for &(other, distance) in &seen {
            let w = kernel(distance, reach);
            let x = self.positions()[other as usize] - self.positions()[i];
            weight += w;
            moment += x * x.transpose() * w;
        }
        let (inverse, axes, rank) = pseudo_inverse(&moment, bar);
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
fn pseudo_inverse(moment: &Matrix3<f64>, bar: f64) -> (Matrix3<f64>, Matrix3<f64>, usize) {
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = moment.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigenvalues[b].total_cmp(&eigenvalues[a]));
    let greatest = eigenvalues[order[0]];
    let seen = order
        .iter()
        .filter(|&&k| greatest > 0.0 && eigenvalues[k] > bar * greatest);
    let rank = seen.count();
    let axes = Matrix3::from_columns(&order.map(|k| eigenvectors.column(k).into_owned()));
    let terms = order[..rank].iter().zip(axes.column_iter());
    let inverse = terms
        .map(|(&k, axis)| axis * axis.transpose() / eigenvalues[k])
        .sum();
    (inverse, axes, rank)
}
