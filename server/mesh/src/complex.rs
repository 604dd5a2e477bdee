//! The cells of every dimension, what bounds what, and which are neighbours.

use std::sync::{Arc, OnceLock};

use nalgebra::Vector3;

use crate::adjacency::FaceSets;
use crate::holders::holders;
use crate::measure::cell_volume;
use crate::{Cell, CellType, Cells, Face, surface, vertex_normals};

/// The most neighbours, counted from each side, and once for each way in which two cells are: 1 GB of them.
pub const MOST_NEIGHBOURS: usize = 1 << 28;

/// How many dimensions a cell has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Dimension {
    /// A vertex.
    Vertex = 0,
    /// An edge between two vertices.
    Edge = 1,
    /// A face of a volume, or a surface cell.
    Face = 2,
    /// A cell that encloses a volume.
    Volume = 3,
}

/// Rows of numbers: row i is `items[starts[i]..starts[i + 1]]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// One more than rows, rising from 0.
    pub starts: Vec<u32>,
    /// The rows, one after the other.
    pub items: Vec<u32>,
}

/// So many neighbours that they are not listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the cells have {neighbours} neighbours, and {MOST_NEIGHBOURS} are the most: choose cells that share less"
)]
pub struct TooManyNeighbours {
    /// As counted for [`MOST_NEIGHBOURS`].
    pub neighbours: usize,
}

/// All cells of a checked grid, of every dimension. Nothing is made before it is asked for.
///
/// Vertices have the grid's numbers, and volumes are its cells that enclose one, in its order. Edges are ordered by their
/// vertices, the lower one first; faces by theirs, ascending.
#[derive(Clone, Debug)]
pub struct Complex {
    cells: Arc<Cells>,
    vertices: usize,
    /// The index of each volume among the cells.
    volumes: Vec<u32>,
    edges: OnceLock<Table>,
    faces: OnceLock<Faces>,
    adjacent: [[OnceLock<Table>; 4]; 4],
}

#[derive(Clone, Debug)]
struct Faces {
    vertices: Table,
    /// The face that each side of a cell is: first those of volumes, then the surface cells, each by ascending cell.
    of_sides: Vec<u32>,
}

impl Complex {
    /// Of a checked grid of so many vertices.
    pub fn new(cells: Arc<Cells>, vertices: usize) -> Self {
        let volumes = (0..).zip(cells.iter());
        let volumes = volumes.filter(|(_, cell)| cell.kind.is_volume());
        Self {
            volumes: volumes.map(|(index, _)| index).collect(),
            cells,
            vertices,
            edges: OnceLock::new(),
            faces: OnceLock::new(),
            adjacent: Default::default(),
        }
    }

    /// How many cells of a dimension there are.
    pub fn count(&self, dimension: Dimension) -> usize {
        match dimension {
            Dimension::Vertex => self.vertices,
            Dimension::Edge => self.edges().items.len(),
            Dimension::Face => self.faces().vertices.len(),
            Dimension::Volume => self.volumes.len(),
        }
    }

    /// For each cell of the higher dimension, the cells of the lower one that bound it, ascending.
    ///
    /// # Panics
    /// If `lower` is not lower than `higher`.
    pub fn bounds(&self, higher: Dimension, lower: Dimension) -> Table {
        use Dimension::{Edge, Face, Vertex, Volume};
        match (higher, lower) {
            (Edge, Vertex) => {
                let edges = self.edges();
                let rows = (0..).zip(edges.rows());
                Table::new(rows.flat_map(|(low, row)| row.iter().map(move |&high| [low, high])))
            }
            (Face, Vertex) => self.faces().vertices.clone(),
            (Volume, Vertex) => Table::new(self.volumes().map(|cell| cell.vertices.to_vec())),
            (Face, Edge) => {
                let mut edges = vec![Vec::new(); self.count(Face)];
                let sides = self.volumes().chain(self.surface_cells());
                let sides = sides.flat_map(|cell| cell.faces());
                for (&face, side) in self.faces().of_sides.iter().zip(sides) {
                    if edges[face as usize].is_empty() {
                        edges[face as usize] = side.edges().map(|edge| self.edge(edge)).collect();
                    }
                }
                Table::new(edges.into_iter())
            }
            (Volume, Edge) => Table::new(self.volumes().map(|cell| {
                let edges = cell
                    .faces()
                    .flat_map(|face| face.edges().collect::<Vec<_>>());
                edges.map(|edge| self.edge(edge)).collect::<Vec<_>>()
            })),
            (Volume, Face) => {
                let mut sides = self.faces().of_sides.iter().copied();
                let faces = self.volumes().map(|cell| cell.faces().count());
                Table::new(faces.map(|count| sides.by_ref().take(count).collect::<Vec<_>>()))
            }
            (Vertex, _)
            | (Edge, Edge | Face | Volume)
            | (Face, Face | Volume)
            | (Volume, Volume) => {
                panic!("{lower:?} does not bound {higher:?}")
            }
        }
    }

    /// For each node the other nodes that share an arc with it, ascending: the cells of a dimension, two of which are
    /// neighbours if a cell of the other dimension bounds both or is bounded by both. Made once.
    ///
    /// # Errors
    /// [`TooManyNeighbours`].
    ///
    /// # Panics
    /// If the dimensions are equal.
    pub fn neighbours(
        &self,
        nodes: Dimension,
        arcs: Dimension,
    ) -> Result<&Table, TooManyNeighbours> {
        let made = &self.adjacent[nodes as usize][arcs as usize];
        if let Some(table) = made.get() {
            return Ok(table);
        }
        let of_arcs = if nodes < arcs {
            self.bounds(arcs, nodes)
        } else {
            self.bounds(nodes, arcs).transposed(self.count(arcs))
        };
        let neighbours = of_arcs
            .rows()
            .map(|row| row.len() * row.len().saturating_sub(1))
            .sum();
        if neighbours > MOST_NEIGHBOURS {
            return Err(TooManyNeighbours { neighbours });
        }
        Ok(made.get_or_init(|| joined(&of_arcs, self.count(nodes))))
    }

    /// All volumes as tetrahedra, and all surface cells as triangles, by their vertices: each cell as the fan of its first
    /// vertex, which fills what is convex.
    pub fn simplices(&self) -> (Vec<[u32; 4]>, Vec<[u32; 3]>) {
        let tetrahedra = self.volumes().flat_map(|cell| {
            let apex = cell.vertices[0];
            let faces = cell.faces();
            let beyond = faces.filter(move |face| face.vertices().all(|vertex| vertex != apex));
            beyond.flat_map(fan).map(move |[a, b, c]| [apex, a, b, c])
        });
        let triangles = self
            .surface_cells()
            .flat_map(|cell| cell.faces().flat_map(fan));
        (tetrahedra.collect(), triangles.collect())
    }

    /// The mean of the vertices of each cell, m.
    pub fn centres(&self, dimension: Dimension, positions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        if dimension == Dimension::Vertex {
            return positions.to_vec();
        }
        let mean = |row: &[u32]| {
            let sum: Vector3<f64> = row.iter().map(|&vertex| positions[vertex as usize]).sum();
            sum / row.len() as f64
        };
        let rows = self.bounds(dimension, Dimension::Vertex);
        rows.rows().map(mean).collect()
    }

    /// The volume of each cell over the mean volume; of a cell that encloses none, the mean over the volumes that it
    /// bounds, or 1 where it bounds none. `None` without volumes, or where all are flat.
    pub fn sizes(&self, dimension: Dimension, positions: &[Vector3<f64>]) -> Option<Vec<f64>> {
        let mut volumes: Vec<f64> = self
            .volumes()
            .map(|cell| cell_volume(positions, &cell).abs())
            .collect();
        let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }
        volumes.iter_mut().for_each(|volume| *volume /= mean);
        if dimension == Dimension::Volume {
            return Some(volumes);
        }
        let of_cells = self
            .bounds(Dimension::Volume, dimension)
            .transposed(self.count(dimension));
        let size = |row: &[u32]| match row.len() {
            0 => 1.0,
            count => row.iter().map(|&v| volumes[v as usize]).sum::<f64>() / count as f64,
        };
        Some(of_cells.rows().map(size).collect())
    }

    /// The unit normal of the surface at each cell, the mean of those at its vertices; zero inside, and where they cancel.
    pub fn normals(&self, dimension: Dimension, positions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let surface = surface(&self.cells);
        let mut found = Vec::new();
        vertex_normals(positions, &surface, &mut found);
        let mut normals = vec![Vector3::zeros(); self.vertices];
        for (&vertex, normal) in surface.vertices.iter().zip(found) {
            normals[vertex as usize] = Vector3::from(normal).cast();
        }
        let unit = |sum: Vector3<f64>| sum.try_normalize(1e-6).unwrap_or_default();
        if dimension == Dimension::Vertex {
            return normals.into_iter().map(unit).collect(); // f32 as they come
        }
        let rows = self.bounds(dimension, Dimension::Vertex);
        let sum = |row: &[u32]| row.iter().map(|&vertex| normals[vertex as usize]).sum();
        rows.rows().map(|row| unit(sum(row))).collect()
    }

    /// For each place the cells of the volumes that hold it, ascending: inside, or on the boundary to a relative 10⁻⁹.
    /// Places that are not finite are nowhere.
    pub fn holding(
        &self,
        dimension: Dimension,
        positions: &[Vector3<f64>],
        places: &[Vector3<f64>],
    ) -> Table {
        let holders = holders(positions, self.volumes(), places);
        if dimension == Dimension::Volume {
            return holders;
        }
        let bounds = self.bounds(Dimension::Volume, dimension);
        Table::new(holders.rows().map(|volumes| {
            let cells = volumes
                .iter()
                .flat_map(|&volume| bounds.row(volume as usize));
            cells.copied().collect::<Vec<_>>()
        }))
    }

    fn volumes(&self) -> impl Iterator<Item = Cell<'_>> {
        self.volumes
            .iter()
            .map(|&index| self.cells.cell(index as usize))
    }

    fn surface_cells(&self) -> impl Iterator<Item = Cell<'_>> {
        let others = |cell: &Cell<'_>| !cell.kind.is_volume() && cell.kind != CellType::Empty;
        self.cells.iter().filter(others)
    }

    /// Of each vertex, the higher ends of the edges of which it is the lower.
    fn edges(&self) -> &Table {
        self.edges.get_or_init(|| {
            let faces = self
                .volumes()
                .chain(self.surface_cells())
                .flat_map(|cell| cell.faces());
            let ends: Vec<[u32; 2]> = faces
                .flat_map(|face| face.edges().collect::<Vec<_>>())
                .map(|[a, b]| [a.min(b), a.max(b)])
                .collect();
            let mut rows = Table::grouped(self.vertices, ends.into_iter());
            rows.sort_and_dedup();
            rows
        })
    }

    fn edge(&self, [a, b]: [u32; 2]) -> u32 {
        let edges = self.edges();
        let low = a.min(b) as usize;
        let found = edges.row(low).binary_search(&a.max(b));
        let place = found.expect("each side of a face is an edge");
        edges.starts[low] + number(place)
    }

    fn faces(&self) -> &Faces {
        self.faces.get_or_init(|| {
            let FaceSets { sets, .. } = FaceSets::new(&self.cells);
            let mut of_sides = vec![0; sets.len()];
            let mut first = Vec::new();
            sets.for_each_group(|group| {
                for member in group {
                    of_sides[member.set as usize] = number(first.len());
                }
                first.push(group[0].set);
            });
            let vertices = Table::new(first.iter().map(|&set| sets.get(set).to_vec()));
            Faces { vertices, of_sides }
        })
    }
}

/// The triangles of a face as the fan of its first vertex.
fn fan(face: Face<'_>) -> impl Iterator<Item = [u32; 3]> {
    let first = face.vertex(0);
    let edges = face.edges().skip(1).take(face.len() - 2);
    edges.map(move |[a, b]| [first, a, b])
}

/// The other members of all rows that each of so many numbers is in, ascending.
fn joined(rows: &Table, numbers: usize) -> Table {
    let of_each = rows.transposed(numbers);
    let mut seen = vec![u32::MAX; numbers];
    let mut joined = Table {
        starts: Vec::with_capacity(numbers + 1),
        items: Vec::new(),
    };
    joined.starts.push(0);
    for (own, memberships) in (0..).zip(of_each.rows()) {
        seen[own as usize] = own;
        let start = joined.items.len();
        for &row in memberships {
            for &other in rows.row(row as usize) {
                if std::mem::replace(&mut seen[other as usize], own) != own {
                    joined.items.push(other);
                }
            }
        }
        joined.items[start..].sort_unstable();
        joined.starts.push(number(joined.items.len()));
    }
    joined
}

fn number(index: usize) -> u32 {
    u32::try_from(index)
        .expect("checked grids have less than u32::MAX faces, and neighbours are counted")
}

impl Table {
    /// Of these rows, each sorted and without repetitions.
    fn new<R: AsRef<[u32]>>(rows: impl Iterator<Item = R>) -> Self {
        let mut table = Self {
            starts: vec![0],
            items: Vec::new(),
        };
        for row in rows {
            table.items.extend_from_slice(row.as_ref());
            table.starts.push(number(table.items.len()));
        }
        table.sort_and_dedup();
        table
    }

    /// The second numbers of the pairs, by the first ones, which are below `rows`.
    pub(crate) fn grouped(rows: usize, pairs: impl Iterator<Item = [u32; 2]> + Clone) -> Self {
        let mut starts = vec![0; rows + 1];
        for [row, _] in pairs.clone() {
            starts[row as usize + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let mut places = starts.clone();
        let mut items = vec![0; starts[rows] as usize];
        for [row, item] in pairs {
            let place = &mut places[row as usize];
            items[*place as usize] = item;
            *place += 1;
        }
        Self { starts, items }
    }

    fn sort_and_dedup(&mut self) {
        let Self { starts, items } = self;
        let mut kept = 0;
        let mut start = 0;
        for end in &mut starts[1..] {
            let row = start..*end as usize;
            items[row.clone()].sort_unstable();
            let first = kept;
            for place in row {
                if kept == first || items[kept - 1] != items[place] {
                    items[kept] = items[place];
                    kept += 1;
                }
            }
            start = std::mem::replace(end, number(kept)) as usize;
        }
        items.truncate(kept);
    }

    /// The rows that hold each of so many numbers, ascending. All items have to be below that.
    ///
    /// # Panics
    /// If one is not.
    #[must_use]
    pub fn transposed(&self, numbers: usize) -> Self {
        let rows = (0..).zip(self.starts.windows(2));
        let pairs = rows.flat_map(|(row, ends)| {
            let items = &self.items[ends[0] as usize..ends[1] as usize];
            items.iter().map(move |&item| [item, row])
        });
        Self::grouped(numbers, pairs)
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The items of a row.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, row: usize) -> &[u32] {
        &self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// All rows.
    pub fn rows(&self) -> impl Iterator<Item = &[u32]> + Clone {
        let ends = self.starts.windows(2);
        ends.map(|ends| &self.items[ends[0] as usize..ends[1] as usize])
    }
}
