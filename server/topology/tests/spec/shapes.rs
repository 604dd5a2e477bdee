//! Meshes to build maps of, and what to count in them.

use sinew_mesh::{Cell as MeshCell, CellType, Cells, Grid};
use sinew_topology::{BuildReport, Edge, Face, Map, MeshCells, NonManifold, Vertex, Volume};

/// How many cells a map has, by dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Census {
    pub(crate) vertices: usize,
    pub(crate) edges: usize,
    pub(crate) faces: usize,
    pub(crate) volumes: usize,
}

pub(crate) fn census(map: &Map) -> Census {
    Census {
        vertices: map.count::<Vertex>(),
        edges: map.count::<Edge>(),
        faces: map.count::<Face>(),
        volumes: map.count::<Volume>(),
    }
}

impl From<[usize; 4]> for Census {
    fn from([vertices, edges, faces, volumes]: [usize; 4]) -> Self {
        Self {
            vertices,
            edges,
            faces,
            volumes,
        }
    }
}

pub(crate) fn view(grid: &Grid) -> MeshCells<'_> {
    let cells = &grid.cells;
    MeshCells {
        vertices: grid.positions.len(),
        types: &cells.types,
        connectivity: &cells.connectivity,
        offsets: &cells.offsets,
        faces: &cells.faces,
        face_offsets: &cells.face_offsets,
    }
}

/// A map of a mesh that must need no repair.
pub(crate) fn map_of(grid: &Grid) -> Map {
    let (map, report) = Map::build(&view(grid), NonManifold::Refuse).expect("a manifold");
    assert_eq!(report, BuildReport::default());
    assert_eq!(map.violations(), []);
    map
}

/// Cells of one kind. Positions are zero: for meshes of which only the topology counts.
pub(crate) fn mesh(vertices: usize, kind: CellType, cells: &[&[u32]]) -> Grid {
    let mut columns = Cells::default();
    for vertices in cells {
        columns.push(MeshCell {
            kind,
            vertices,
            face_stream: &[],
        });
    }
    Grid {
        positions: vec![nalgebra::Vector3::zeros(); vertices],
        cells: columns,
    }
}

/// Two tetrahedra on the face of vertices 1, 2 and 3.
pub(crate) fn two_tetrahedra() -> Grid {
    mesh(5, CellType::Tetrahedron, &[&[0, 1, 2, 3], &[1, 2, 3, 4]])
}

/// Positions of a map's vertices, by slot.
pub(crate) type Positions = sinew_topology::Column<Vertex, nalgebra::Vector3<f64>>;

/// New vertices stand in the mean of those that they are put among; of two merged, the kept one stays.
pub(crate) fn in_the_midst() -> sinew_topology::Rules<nalgebra::Vector3<f64>> {
    sinew_topology::Rules {
        split: |&position| position,
        merge: |&kept, _| kept,
        make: |among| among.iter().sum::<nalgebra::Vector3<f64>>() / among.len().max(1) as f64,
    }
}

/// A map as a mesh with these positions.
pub(crate) fn grid_of(map: &Map, positions: &Positions) -> Grid {
    let out = map.export();
    let grid = Grid {
        positions: positions.values().to_vec(),
        cells: Cells {
            types: out.types,
            connectivity: out.connectivity,
            offsets: out.offsets,
            faces: out.faces,
            face_offsets: out.face_offsets,
        },
    };
    grid.check().expect("a map gives sound columns");
    grid
}

/// Signed volumes of all volumes, m³.
pub(crate) fn volumes(map: &Map, positions: &Positions) -> Vec<f64> {
    let grid = grid_of(map, positions);
    (0..grid.cells.len())
        .map(|cell| sinew_mesh::volume(&grid, cell))
        .collect()
}

/// A ring of `count` hexahedra.
pub(crate) fn torus(count: u32) -> Grid {
    let cells: Vec<Vec<u32>> = (0..count)
        .map(|at| {
            let next = (at + 1) % count;
            let slice = |at: u32| (0..4).map(move |corner| 4 * at + corner);
            slice(at).chain(slice(next)).collect()
        })
        .collect();
    let cells: Vec<_> = cells.iter().map(Vec::as_slice).collect();
    mesh(4 * count as usize, CellType::Hexahedron, &cells)
}

/// A surface of `nx` × `ny` squares.
pub(crate) fn sheet(nx: u32, ny: u32) -> Grid {
    let vertex = |x: u32, y: u32| y * (nx + 1) + x;
    let squares: Vec<_> = (0..nx * ny)
        .map(|at| {
            let [x, y] = [at % nx, at / nx];
            [
                vertex(x, y),
                vertex(x + 1, y),
                vertex(x + 1, y + 1),
                vertex(x, y + 1),
            ]
        })
        .collect();
    let cells: Vec<_> = squares.iter().map(<[u32; 4]>::as_slice).collect();
    let vertices = (nx + 1) * (ny + 1);
    mesh(vertices as usize, CellType::Quad, &cells)
}

/// The surface of a tetrahedron.
pub(crate) fn hollow_tetrahedron() -> Grid {
    let triangles: [&[u32]; 4] = [&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]];
    mesh(4, CellType::Triangle, &triangles)
}
