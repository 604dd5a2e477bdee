use rayon::prelude::*;

use crate::distance::Distances;

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
    /// The points of each cluster.
    pub(crate) fn sets(&self) -> impl Iterator<Item = &[u32]> {
        self.first
            .windows(2)
            .map(|ends| &self.members[ends[0]..ends[1]])
    }
}
