use rayon::prelude::*;

use crate::distance::Distances;
use crate::weights::Weights;

/// Vertices that keep the same set of points share a cluster. `[C1]`
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clusters {
    /// Per vertex.
    pub(crate) of_vertex: Vec<u32>,
    /// The points of cluster c are `members[first[c]..first[c + 1]]`, rising.
    pub(crate) first: Vec<usize>,
    pub(crate) members: Vec<u32>,
}

/// Groups the vertices by their sets of points: the third stage. Clusters are ordered by their points. O(k V log V).
pub(crate) fn cluster(distances: &Distances) -> Clusters {
    let stride = distances.stride;
    let mut sets = distances.points.clone();
    let mut sizes = Vec::with_capacity(sets.len() / stride);
    for (vertex, set) in sets.chunks_exact_mut(stride).enumerate() {
        let size = distances.in_reach(vertex);
        set[..size].sort_unstable();
        sizes.push(size);
    }
    let set_of = |vertex: u32| {
        let start = vertex as usize * stride;
        &sets[start..start + sizes[vertex as usize]]
    };
    let mut vertices: Vec<u32> = (0..).take(sizes.len()).collect();
    vertices.par_sort_unstable_by(|&a, &b| set_of(a).cmp(set_of(b)));

    let mut clusters = Clusters {
        of_vertex: vec![0; vertices.len()],
        first: vec![0],
        members: Vec::new(),
    };
    let groups = vertices.chunk_by(|&a, &b| set_of(a) == set_of(b));
    for (cluster, same) in (0..).zip(groups) {
        for &vertex in same {
            clusters.of_vertex[vertex as usize] = cluster;
        }
        clusters.members.extend_from_slice(set_of(same[0]));
        clusters.first.push(clusters.members.len());
    }
    clusters
}

impl Clusters {
    /// A cluster for each row of weights. `[M15]`
    pub(crate) fn of_rows(weights: &Weights) -> (Self, Vec<f64>) {
        let mut clusters = Self {
            of_vertex: Vec::new(),
            first: vec![0],
            members: Vec::with_capacity(weights.points.len()),
        };
        let mut shares = Vec::with_capacity(weights.points.len());
        for (cluster, vertex) in (0..).zip(0..weights.points.len() / weights.stride) {
            for (point, share) in weights.row(vertex) {
                clusters.members.push(point);
                shares.push(share);
            }
            clusters.of_vertex.push(cluster);
            clusters.first.push(clusters.members.len());
        }
        (clusters, shares)
    }

    /// The cluster that has these points, ascending, if there is one. Of [`cluster`]'s, which are ordered by their points.
    pub(crate) fn find(&self, set: &[u32]) -> Option<u32> {
        let at = |cluster: u32| {
            let cluster = cluster as usize;
            &self.members[self.first[cluster]..self.first[cluster + 1]]
        };
        let count = u32::try_from(self.first.len() - 1).expect("no more than vertices");
        let (mut low, mut high) = (0, count);
        while low < high {
            let middle = low + (high - low) / 2;
            if at(middle) < set {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < count && at(low) == set).then_some(low)
    }

    /// Appends the clusters of other vertices, which come after these.
    pub(crate) fn append(&mut self, more: &Self) {
        let clusters = u32::try_from(self.first.len() - 1).expect("no more than vertices");
        let members = self.members.len();
        let of_vertex = more.of_vertex.iter();
        self.of_vertex.extend(of_vertex.map(|own| clusters + own));
        self.first
            .extend(more.first[1..].iter().map(|end| members + end));
        self.members.extend_from_slice(&more.members);
    }

    /// The points of each cluster.
    pub(crate) fn sets(&self) -> impl Iterator<Item = &[u32]> {
        self.columns(&self.members)
    }

    /// What a column with one entry per member holds for each cluster.
    pub(crate) fn columns<'a, T>(&self, column: &'a [T]) -> impl Iterator<Item = &'a [T]> {
        (self.first.windows(2)).map(move |ends| &column[ends[0]..ends[1]])
    }

    /// The same share for each member of a cluster.
    pub(crate) fn alike(&self) -> Vec<f64> {
        let shares = |set: &[u32]| std::iter::repeat_n((set.len() as f64).recip(), set.len());
        self.sets().flat_map(shares).collect()
    }

    /// The mean of the members' weights over the vertices of each cluster. `[M13]`
    pub(crate) fn means(&self, weights: &Weights) -> Vec<f64> {
        let mut shares = vec![0.0; self.members.len()];
        for (vertex, &cluster) in self.of_vertex.iter().enumerate() {
            let range = self.first[cluster as usize]..self.first[cluster as usize + 1];
            let set = &self.members[range.clone()];
            for (point, weight) in weights.row(vertex) {
                let place = set.binary_search(&point);
                shares[range.start + place.expect("a vertex keeps its cluster's points")] += weight;
            }
        }
        for ends in self.first.windows(2) {
            let shares = &mut shares[ends[0]..ends[1]];
            let sum: f64 = shares.iter().sum();
            shares.iter_mut().for_each(|share| *share /= sum);
        }
        shares
    }
}
