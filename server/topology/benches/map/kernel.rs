//! The rows, and how the map does in each.

use std::hint::black_box;

use nalgebra::Vector3;
use rustix::time::{ClockId, clock_gettime};
use sinew_mesh::Grid;
use sinew_topology::{
    Adjacency, Cell, Column, Dart, Edge, Edit, EditError, Face, Kind, Map, MeshCells, NonManifold,
    Place, Rules, Vertex, Volume, Walk,
};

/// Random queries of each kind.
const QUERIES: usize = 100_000;
/// One in so many interior faces is sewn.
const SEWN: u64 = 10;

/// Names and units. `relink3` and `resew3` are half of an unlinking and a linking (an unsewing and a sewing).
pub(crate) const ROWS: [(&str, &str); 18] = [
    ("build", "ns per dart"),
    ("bytes", "per dart"),
    ("orbit_vertex", "ns per dart"),
    ("orbit_edge", "ns per dart"),
    ("orbit_face", "ns per dart"),
    ("orbit_volume", "ns per dart"),
    ("adjacency_vertex_snapshot", "ns per entry"),
    ("adjacency_volume_snapshot", "ns per entry"),
    ("adjacency_vertex_random", "ns per query"),
    ("adjacency_volume_random", "ns per query"),
    ("relink3", "ns per face"),
    ("unsew3", "ns per face"),
    ("sew3", "ns per face"),
    ("resew3", "ns per face"),
    ("unsew3_rolled_back", "ns per face"),
    ("tear_unsew3", "ns per face"),
    ("tear_sew3", "ns per face"),
    ("cut", "ns per tetrahedron"),
];

type Add<'a> = dyn FnMut(&'static str, f64) + 'a;

pub(crate) fn measure(mesh: &Grid, add: &mut Add<'_>) {
    let cells = &mesh.cells;
    let input = MeshCells {
        vertices: mesh.positions.len(),
        types: &cells.types,
        connectivity: &cells.connectivity,
        offsets: &cells.offsets,
        faces: &cells.faces,
        face_offsets: &cells.face_offsets,
    };
    let (built, nanoseconds) = time(|| Map::build(&input, NonManifold::Refuse));
    let (mut map, _) = built.unwrap();
    let darts = map.dart_count() as f64;
    add("build", nanoseconds / darts);
    add("bytes", map.bytes() as f64 / darts);

    add("orbit_vertex", orbits::<Vertex>(&map));
    add("orbit_edge", orbits::<Edge>(&map));
    add("orbit_face", orbits::<Face>(&map));
    add("orbit_volume", orbits::<Volume>(&map));

    add("adjacency_vertex_snapshot", snapshot::<Vertex, Edge>(&map));
    add("adjacency_volume_snapshot", snapshot::<Volume, Face>(&map));
    let mut random = Random(88_172_645_463_325_252);
    add(
        "adjacency_vertex_random",
        queries::<Vertex, Edge>(&map, &mut random),
    );
    add(
        "adjacency_volume_random",
        queries::<Volume, Face>(&map, &mut random),
    );

    let mut points = Points(Column::from_values(mesh.positions.clone()));
    sew(&mut map, &mut points, add);
    tear(&mut map, mesh, &mut points, add);
    cut(&mut map, mesh, &mut points, add);
}

/// The attribute that follows the edits which are counted with attributes.
struct Points(Column<Vertex, Vector3<f64>>);

impl Points {
    const RULES: Rules<Vector3<f64>> = Rules {
        split: |point| *point,
        merge: |kept, _| *kept,
        make: |around| around.iter().sum::<Vector3<f64>>() / around.len() as f64,
    };

    /// Nanoseconds that a batch takes, with the points.
    fn edit(
        &mut self,
        map: &mut Map,
        batch: impl FnOnce(&mut Edit<'_>) -> Result<(), EditError>,
    ) -> f64 {
        let (done, nanoseconds) = time(|| {
            let ((), changes) = map.edit(batch)?;
            self.0.follow(&changes, &Self::RULES);
            Ok::<_, EditError>(changes)
        });
        done.unwrap();
        nanoseconds
    }
}

/// Nanoseconds per dart of a visit to every orbit of every `K`-cell.
fn orbits<K: Kind>(map: &Map) -> f64 {
    let mut walk = Walk::default();
    let (met, nanoseconds) = time(|| {
        let cells = map.cells::<K>();
        cells
            .map(|cell| map.orbit(cell, &mut walk).count())
            .sum::<usize>()
    });
    assert_eq!(met, map.dart_count());
    nanoseconds / met as f64
}

/// Nanoseconds per entry of the flat rows of cells adjacent through `J`-cells.
fn snapshot<I: Kind, J: Kind>(map: &Map) -> f64 {
    let (adjacency, nanoseconds) = time(|| Adjacency::<I, J>::new(map));
    nanoseconds / adjacency.entries().len() as f64
}

/// Nanoseconds per query of the cells adjacent to one.
fn queries<I: Kind, J: Kind>(map: &Map, random: &mut Random) -> f64 {
    let mut walk = Walk::default();
    let slots = map.slot_count::<I>();
    let (_, nanoseconds) = time(|| {
        let cells = (0..QUERIES).map(|_| map.cell_at::<I>(random.below(slots)).unwrap());
        let found = cells.map(|cell| {
            let others = map.adjacent::<I, J>(cell, &mut walk);
            others.map(Cell::index).sum::<usize>()
        });
        found.fold(0, usize::wrapping_add)
    });
    nanoseconds / QUERIES as f64
}

/// Parts a tenth of the interior faces and joins them again: by β alone, with the cells, and with a change of mind.
fn sew(map: &mut Map, points: &mut Points, add: &mut Add<'_>) {
    let drawn = interior(map).enumerate().filter(|&(index, _)| {
        let hash = (index as u64).wrapping_mul(2_654_435_761);
        hash.is_multiple_of(SEWN)
    });
    let faces: Vec<_> = drawn.map(|(_, face)| face).collect();
    let before = map.structure_digest();
    // The first time warms up.
    for is_warm in [false, true] {
        let (done, nanoseconds) = time(|| {
            map.edit(|edit| {
                let unlink = |&[one, _]: &[Dart; 2]| edit.unlink3(one).map(drop);
                faces.iter().try_for_each(unlink)?;
                let link = |&[one, other]: &[Dart; 2]| edit.link3(one, other);
                faces.iter().try_for_each(link)
            })
        });
        done.unwrap();
        let [unsew, sew] = apart_and_back(map, &faces, points);
        if is_warm {
            add("relink3", nanoseconds / (2 * faces.len()) as f64);
            add("unsew3", unsew);
            add("sew3", sew);
            add("resew3", 0.5 * (unsew + sew));
        }
    }
    let (_, nanoseconds) = time(|| {
        map.edit(|edit| {
            for &[one, _] in &faces {
                edit.unsew3(one)?;
            }
            // As good an error as any.
            edit.unsew3(faces[0][0]).map(drop)
        })
        .unwrap_err()
    });
    add("unsew3_rolled_back", nanoseconds / faces.len() as f64);
    assert_eq!(map.structure_digest(), before);
}

/// Parts the mesh along its middle plane, where every vertex falls in two, and joins it again.
fn tear(map: &mut Map, mesh: &Grid, points: &mut Points, add: &mut Add<'_>) {
    let middle = 0.5 * mesh.positions.iter().map(|p| p.x).fold(0.0, f64::max);
    let is_left = |dart: Dart| {
        let corners = mesh.cells.cell(map.volume(dart).index()).vertices;
        let x: f64 = corners.iter().map(|&v| mesh.positions[v as usize].x).sum();
        x < corners.len() as f64 * middle
    };
    let faces: Vec<_> = interior(map)
        .filter(|&[one, other]| is_left(one) != is_left(other))
        .collect();
    let vertices = map.count::<Vertex>();
    let [unsew, sew] = apart_and_back(map, &faces, points);
    add("tear_unsew3", unsew);
    add("tear_sew3", sew);
    assert!(points.0.values().len() > vertices);
    assert_eq!(map.count::<Vertex>(), vertices);
}

/// Cuts one tetrahedron in every second cube along each axis, between its first vertex and the others.
fn cut(map: &mut Map, mesh: &Grid, points: &mut Points, add: &mut Add<'_>) {
    let side = (1usize..)
        .find(|n| 6 * n.pow(3) >= mesh.cells.len())
        .unwrap();
    let even = || (0..side).step_by(2);
    let cubes = even().flat_map(|z| even().flat_map(move |y| even().map(move |x| [x, y, z])));
    let drawn = cubes.map(|[x, y, z]| 6 * (x + side * (y + side * z)));
    let cells: Vec<_> = drawn
        .map(|index| {
            let apex = mesh.cells.cell(index).vertices[0] as usize;
            (
                map.cell_at::<Volume>(index).unwrap(),
                map.cell_at::<Vertex>(apex).unwrap(),
            )
        })
        .collect();
    let volumes = map.count::<Volume>();
    let nanoseconds = points.edit(map, |edit| {
        for &(volume, apex) in &cells {
            edit.cut(&[volume], |vertex| match vertex == apex {
                true => Place::Below,
                false => Place::Above,
            })?;
        }
        Ok(())
    });
    assert_eq!(map.count::<Volume>(), volumes + cells.len());
    add("cut", nanoseconds / cells.len() as f64);
}

/// Two darts of each face with a volume on both sides, one of each side.
fn interior(map: &Map) -> impl Iterator<Item = [Dart; 2]> + '_ {
    let darts = map.cells::<Face>().map(|face| map.dart(face));
    darts.filter_map(|dart| Some([dart, map.beta3(dart)?]))
}

/// Nanoseconds per face of a batch that unsews all, and of one that sews them again.
fn apart_and_back(map: &mut Map, faces: &[[Dart; 2]], points: &mut Points) -> [f64; 2] {
    let unsew = points.edit(map, |edit| {
        faces
            .iter()
            .try_for_each(|&[one, _]| edit.unsew3(one).map(drop))
    });
    let sew = points.edit(map, |edit| {
        faces
            .iter()
            .try_for_each(|&[one, other]| edit.sew3(one, other))
    });
    [unsew, sew].map(|nanoseconds| nanoseconds / faces.len() as f64)
}

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 32) as usize * bound) >> 32
    }
}

/// What `f` returns, and the nanoseconds of processor time that it took.
fn time<T>(f: impl FnOnce() -> T) -> (T, f64) {
    let now = || {
        let now = clock_gettime(ClockId::ProcessCPUTime);
        now.tv_sec as f64 * 1e9 + now.tv_nsec as f64
    };
    let start = now();
    let value = black_box(f());
    (value, now() - start)
}
