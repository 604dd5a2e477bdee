//! Which vertex lists are the same set: the one question behind neighbours, boundaries and duplicates.

use crate::{CellType, Cells};

/// Sets of vertices, numbered in the order of their arrival, each kept sorted.
pub(crate) struct VertexSets {
    vertices: Vec<u32>,
    starts: Vec<usize>,
}

impl VertexSets {
    fn with_capacity(sets: usize, vertices: usize) -> Self {
        let mut starts = Vec::with_capacity(sets + 1);
        starts.push(0);
        Self {
            vertices: Vec::with_capacity(vertices),
            starts,
        }
    }

    fn push(&mut self, vertices: impl Iterator<Item = u32>) {
        let start = self.vertices.len();
        self.vertices.extend(vertices);
        let set = &mut self.vertices[start..];
        match set {
            // Three of four faces are triangles: this is the innermost loop of every topology change.
            [a, b, c] => {
                let (low, high) = ((*a).min(*b), (*a).max(*b));
                (*a, *b, *c) = (low.min(*c), high.min(low.max(*c)), high.max(*c));
            }
            _ => set.sort_unstable(),
        }
        self.starts.push(self.vertices.len());
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn get(&self, set: u32) -> &[u32] {
        let set = set as usize;
        &self.vertices[self.starts[set]..self.starts[set + 1]]
    }

    /// The numbers of the sets, equal sets beside each other by ascending number.
    ///
    /// Buckets by the smallest vertex first: a vertex is the smallest of few sets, so that the sort within a bucket is
    /// short, and the whole is linear for any reasonable mesh.
    pub(crate) fn grouped(&self) -> Vec<Member> {
        let smallest = |set: usize| self.vertices[self.starts[set]] as usize;
        let buckets = self
            .vertices
            .iter()
            .max()
            .map_or(0, |&most| most as usize + 1);
        let mut ends = vec![0u32; buckets + 1];
        for set in 0..self.len() {
            ends[smallest(set) + 1] += 1;
        }
        for bucket in 0..buckets {
            ends[bucket + 1] += ends[bucket];
        }
        let mut members = vec![Member::default(); self.len()];
        for set in 0..self.len() {
            let end = &mut ends[smallest(set)];
            members[*end as usize] = self.member(set);
            *end += 1;
        }
        // Placing moved each entry of `ends` from its bucket's start to its end.
        let mut start = 0;
        for &end in &ends[..buckets] {
            let bucket = &mut members[start..end as usize];
            bucket.sort_unstable_by(|a, b| {
                let further = || self.get(a.set).cmp(self.get(b.set));
                (a.next.cmp(&b.next))
                    .then_with(further)
                    .then_with(|| a.set.cmp(&b.set))
            });
            start = end as usize;
        }
        members
    }

    fn member(&self, set: usize) -> Member {
        let vertices = &self.vertices[self.starts[set]..self.starts[set + 1]];
        let vertex = |at: usize| vertices.get(at).map_or(0, |&vertex| u64::from(vertex));
        Member {
            next: vertex(1) << 32 | vertex(2),
            set: u32::try_from(set).expect("checked grids have less than u32::MAX faces"),
        }
    }

    /// Walks groups of equal sets: of each, the numbers in ascending order.
    pub(crate) fn for_each_group(&self, mut visit: impl FnMut(&[Member])) {
        let members = self.grouped();
        for group in members.chunk_by(|a, b| a.next == b.next && self.get(a.set) == self.get(b.set))
        {
            visit(group);
        }
    }
}

/// A set's number, with its second and third vertex at hand for quick comparison.
#[derive(Clone, Copy, Default)]
pub(crate) struct Member {
    next: u64,
    pub(crate) set: u32,
}

/// The faces of all cells: first those of cells that enclose a volume, then the surface cells, each by ascending cell.
pub(crate) struct FaceSets {
    pub(crate) sets: VertexSets,
    /// Number of faces that belong to cells which enclose a volume.
    pub(crate) of_volumes: usize,
}

impl FaceSets {
    pub(crate) fn new(cells: &Cells) -> Self {
        // Exact for tetrahedra, too much for others, never out of proportion.
        let mut sets =
            VertexSets::with_capacity(cells.connectivity.len(), 3 * cells.connectivity.len());
        for cell in cells.iter().filter(|cell| cell.kind.is_volume()) {
            for face in cell.faces() {
                sets.push(face.vertices());
            }
        }
        let of_volumes = sets.len();
        for cell in cells.iter().filter(|cell| cell.kind.is_surface()) {
            sets.push(cell.vertices.iter().copied());
        }
        Self { sets, of_volumes }
    }

    /// Per face, whether it is seen from outside: a face of exactly one volume, or a surface cell that is no face of
    /// any. `crowded` is called for each face that more than two volumes share.
    pub(crate) fn exposed(&self, mut crowded: impl FnMut(&[u32])) -> Vec<bool> {
        let mut exposed = vec![false; self.sets.len()];
        self.sets.for_each_group(|group| {
            let volumes = group.partition_point(|member| (member.set as usize) < self.of_volumes);
            match volumes {
                0 => {
                    for member in group {
                        exposed[member.set as usize] = true;
                    }
                }
                1 => exposed[group[0].set as usize] = true,
                2 => {}
                _ => crowded(self.sets.get(group[0].set)),
            }
        });
        exposed
    }
}

/// Each cell with the same vertices as an earlier one, and the first such; ascending.
pub(crate) fn duplicate_cells(cells: &Cells) -> Vec<[u32; 2]> {
    let mut sets = VertexSets::with_capacity(cells.len(), cells.connectivity.len());
    let mut ids = Vec::with_capacity(cells.len());
    for (id, cell) in (0u32..).zip(cells.iter()) {
        if cell.kind != CellType::Empty {
            sets.push(cell.vertices.iter().copied());
            ids.push(id);
        }
    }
    let id = |member: &Member| ids[member.set as usize];
    let mut duplicates = Vec::new();
    sets.for_each_group(|group| {
        duplicates.extend(group[1..].iter().map(|again| [id(again), id(&group[0])]));
    });
    duplicates.sort_unstable();
    duplicates
}
