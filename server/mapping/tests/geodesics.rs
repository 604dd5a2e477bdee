//! Geodesic floods against ways that are known: straight ones, ones round corners, and those of a shell that unrolls.

use nalgebra::Vector3;
use rayon::ThreadPoolBuilder;
use sinew_mapping::{Flood, Graph, MappingError, Nearest, Root, Rows, Simplices};

/// A box of cubes of six tetrahedra each, without those that `is_out` says.
struct Block {
    side: usize,
    places: Vec<Vector3<f64>>,
    tetrahedra: Vec<[u32; 4]>,
}

const AXES: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

impl Block {
    fn new(side: usize, is_out: impl Fn([usize; 3]) -> bool) -> Self {
        let cells = |n: usize| (0..n.pow(3)).map(move |i| [i / (n * n), i / n % n, i % n]);
        let places = cells(side + 1).map(|at| Vector3::from(at.map(|i| i as f64 / side as f64)));
        let mut tetrahedra = Vec::new();
        for at in cells(side).filter(|&at| !is_out(at)) {
            for axes in AXES {
                let mut corner = at;
                let mut corners = [index(side, corner); 4];
                for (place, axis) in axes.into_iter().enumerate() {
                    corner[axis] += 1;
                    corners[place + 1] = index(side, corner);
                }
                tetrahedra.push(corners);
            }
        }
        Self {
            side,
            places: places.collect(),
            tetrahedra,
        }
    }

    /// Moves what is inside by up to 0.15 of a cube: cells of all shapes, obtuse ones too.
    fn shaken(mut self) -> Self {
        let mut seed = 1_u64;
        let mut any = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for place in &mut self.places {
            let by = Vector3::from_fn(|_, _| any()) * 0.3 / self.side as f64;
            if place.iter().all(|c| (1e-9..1.0 - 1e-9).contains(c)) {
                *place += by;
            }
        }
        self
    }

    fn simplices(&self) -> Simplices {
        Simplices::new(&self.places, &self.tetrahedra, &[]).expect("its own corners")
    }

    /// Roots at all corners of the cube that holds each point.
    fn roots(&self, points: &[Vector3<f64>]) -> Vec<Root> {
        let mut roots = Vec::new();
        for (source, point) in (0..).zip(points) {
            let low = [0, 1, 2].map(|axis| {
                let numbers = (0..self.side).rev();
                let mut numbers = numbers.filter(|&n| n as f64 / self.side as f64 <= point[axis]);
                numbers.next().expect("points in the box")
            });
            for corner in 0..8 {
                let at = [0, 1, 2].map(|axis| low[axis] + (corner >> axis & 1));
                let node = index(self.side, at);
                let start = (self.places[node as usize] - point).norm();
                roots.push(Root {
                    node,
                    source,
                    start,
                });
            }
        }
        roots
    }

    fn corners(&self) -> Vec<usize> {
        let mut corners: Vec<usize> = (self.tetrahedra.as_flattened().iter())
            .map(|&corner| corner as usize)
            .collect();
        corners.sort_unstable();
        corners.dedup();
        corners
    }
}

fn index(side: usize, [x, y, z]: [usize; 3]) -> u32 {
    u32::try_from((x * (side + 1) + y) * (side + 1) + z).expect("small boxes")
}

fn flood(simplices: &Simplices, roots: &[Root], count: usize) -> Nearest {
    Flood {
        graph: simplices,
        roots,
        coefficients: &[],
        limit: f64::INFINITY,
    }
    .nearest(count)
}

fn points() -> [Vector3<f64>; 4] {
    [
        Vector3::new(0.12, 0.83, 0.31),
        Vector3::new(0.21, 0.07, 0.55),
        Vector3::new(0.05, 0.52, 0.94),
        Vector3::new(0.3, 0.95, 0.62),
    ]
}

/// The mean and the largest error of distances from two cubes on, relative to the true ones.
fn errors(
    block: &Block,
    found: &Nearest,
    truth: impl Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
) -> (f64, f64) {
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
    for corner in block.corners() {
        for (source, distance) in found.row(corner) {
            let (point, place) = (points()[source as usize], block.places[corner]);
            let truth = truth(&point, &place);
            assert!(distance > truth * (1.0 - 1e-2), "{distance} for {truth}");
            if truth > 2.0 / block.side as f64 {
                let error = (distance / truth - 1.0).abs();
                (sum, count, largest) = (sum + error, count + 1.0, largest.max(error));
            }
        }
    }
    (sum / count, largest)
}

#[test]
fn in_a_convex_body_a_geodesic_is_straight() {
    let straight = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm();
    for (block, mean, most) in [
        (Block::new(12, |_| false), 1e-3, 0.03),
        (Block::new(12, |_| false).shaken(), 2e-3, 0.1),
    ] {
        let found = flood(&block.simplices(), &block.roots(&points()), 4);
        let (found_mean, found_most) = errors(&block, &found, straight);
        assert!(found_mean < mean, "{found_mean}");
        assert!(found_most < most, "{found_most}");
        for corner in block.corners() {
            for (source, distance) in found.row(corner) {
                let straight = straight(&points()[source as usize], &block.places[corner]);
                assert!(distance > straight * (1.0 - 1e-9) - 1e-9);
            }
        }
    }
}

/// The shortest way in a U: a box without the middle third beyond the first third along y. Along z it goes straight.
fn in_a_u(point: &Vector3<f64>, place: &Vector3<f64>) -> f64 {
    let third = 1.0 / 3.0;
    let corners = [third, 1.0 - third].map(|x| Vector3::new(x, third, 0.0));
    let flat = |x: &Vector3<f64>| Vector3::new(x.x, x.y, 0.0);
    let (from, to) = (flat(point), flat(place));
    let is_inside = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let (a, b) = if a.x < b.x { (a, b) } else { (b, a) };
        let (low, high) = (a.x.max(third), b.x.min(1.0 - third));
        let y = |x: f64| a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x);
        low >= high - 1e-9 || y(low).max(y(high)) <= third + 1e-9
    };
    let ways = [vec![], vec![corners[0]], vec![corners[1]], corners.to_vec()];
    let lengths = ways.iter().map(|way| {
        let stops = [&[from], &way[..], &[to]].concat();
        let legs = stops.windows(2);
        legs.map(|leg| match is_inside(&leg[0], &leg[1]) {
            true => (leg[1] - leg[0]).norm(),
            false => f64::INFINITY,
        })
        .sum::<f64>()
    });
    lengths
        .fold(f64::INFINITY, f64::min)
        .hypot(place.z - point.z)
}

#[test]
fn round_a_corner_a_geodesic_bends() {
    let block = Block::new(15, |[x, y, _]| (5..10).contains(&x) && y >= 5);
    let found = flood(&block.simplices(), &block.roots(&points()), 4);
    let (mean, most) = errors(&block, &found, in_a_u);
    assert!(mean < 5e-3, "{mean}");
    assert!(most < 0.05, "{most}");
}

#[test]
fn a_shell_that_unrolls_has_the_distances_of_the_plane() {
    // Half a turn of a cylinder of radius 1, in triangles.
    let (around, along) = (48, 24);
    let at = |i: usize, j: usize| u32::try_from(i * (along + 1) + j).unwrap();
    let (mut places, mut unrolled, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..=around).flat_map(|i| (0..=along).map(move |j| (i, j))) {
        let angle = std::f64::consts::PI * i as f64 / around as f64;
        let height = 2.0 * j as f64 / along as f64;
        places.push(Vector3::new(angle.cos(), angle.sin(), height));
        // Of the prism whose edges are on the cylinder.
        let chord = 2.0 * (0.5 * std::f64::consts::PI / around as f64).sin();
        unrolled.push(Vector3::new(chord * i as f64, height, 0.0));
        if i < around && j < along {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let shell = Simplices::new(&places, &[], &triangles).unwrap();
    let root = Root {
        node: at(9, 5),
        source: 0,
        start: 0.0,
    };
    let found = flood(&shell, &[root], 1);
    for (corner, place) in unrolled.iter().enumerate() {
        let truth = (place - unrolled[root.node as usize]).norm();
        let (_, distance) = found.row(corner).next().unwrap();
        assert!(
            (distance - truth).abs() < 1e-9 + 0.02 * truth,
            "{distance} for {truth}"
        );
    }
}

#[test]
fn a_geodesic_does_not_cross_where_cells_share_no_corner() {
    // Two halves with a gap of no width between them, joined on one side of the box: a crack.
    let mut block = Block::new(10, |_| false);
    let mut twins = vec![None; block.places.len()];
    for tetrahedron in &mut block.tetrahedra {
        let middle: Vector3<f64> = tetrahedron.iter().map(|&c| block.places[c as usize]).sum();
        if middle.x / 4.0 < 0.5 {
            continue;
        }
        for corner in tetrahedron {
            let place = block.places[*corner as usize];
            if place.x == 0.5 && place.y > 0.2 {
                *corner = *twins[*corner as usize].get_or_insert_with(|| {
                    block.places.push(place);
                    u32::try_from(block.places.len() - 1).unwrap()
                });
            }
        }
    }
    let point = Vector3::new(0.44, 0.96, 0.52);
    let found = flood(&block.simplices(), &block.roots(&[point]), 1);
    let edge = Vector3::new(0.5, 0.2, 0.0);
    for corner in block.corners() {
        let place = block.places[corner];
        let is_beyond = place.x > 0.5;
        let y = point.y + (place.y - point.y) * (0.5 - point.x) / (place.x - point.x);
        if is_beyond && y > 0.2 {
            let flat = |a: Vector3<f64>| (a - edge).xy().norm();
            let truth = (flat(point) + flat(place)).hypot(place.z - point.z);
            let (_, distance) = found.row(corner).next().unwrap();
            assert!(
                (distance / truth - 1.0).abs() < 0.04,
                "{distance} for {truth}"
            );
        }
    }
}

#[test]
fn what_no_cell_joins_is_not_reached() {
    let block = Block::new(6, |[x, _, _]| x == 3);
    let point = Vector3::new(0.2, 0.5, 0.5);
    let found = flood(&block.simplices(), &block.roots(&[point]), 1);
    for corner in block.corners() {
        let is_reached = found.row(corner).count() == 1;
        assert_eq!(is_reached, block.places[corner].x <= 0.5);
    }
}

#[test]
fn the_nearest_of_many_are_those_of_a_flood_each() {
    let block = Block::new(10, |_| false).shaken();
    let simplices = block.simplices();
    let roots = block.roots(&points());
    let (all, few) = (flood(&simplices, &roots, 4), flood(&simplices, &roots, 2));
    let (mut sum, mut count) = (0.0, 0.0);
    for corner in block.corners() {
        let all: Vec<_> = all.row(corner).collect();
        for (rank, (source, distance)) in few.row(corner).enumerate() {
            // A source that is crowded out beside helps its own wave no more.
            let alone = all.iter().find(|entry| entry.0 == source).unwrap().1;
            assert!(distance > alone * (1.0 - 1e-9) && distance < alone * 1.1);
            assert!(distance < all[rank].1 * 1.1);
            (sum, count) = (sum + distance / alone - 1.0, count + 1.0);
        }
    }
    assert!(sum / count < 2e-3, "{}", sum / count);
}

#[test]
fn a_geodesic_flood_has_the_same_bits_for_any_number_of_threads_and_any_order_of_points() {
    let block = Block::new(9, |_| false).shaken();
    let (simplices, roots) = (block.simplices(), block.roots(&points()));
    // The last point first.
    let turned = |source: u32| 3 - source;
    let others: Vec<Root> = (roots.iter().rev())
        .map(|root| Root {
            source: turned(root.source),
            ..*root
        })
        .collect();
    for count in [2, 4] {
        let expected = flood(&simplices, &roots, count);
        for threads in [1, 2, 7] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.unwrap();
            assert_eq!(pool.install(|| flood(&simplices, &roots, count)), expected);
            let found = pool.install(|| flood(&simplices, &others, count));
            for corner in block.corners() {
                let found: Vec<_> = (found.row(corner).map(|(s, d)| (turned(s), d))).collect();
                assert_eq!(found, expected.row(corner).collect::<Vec<_>>());
            }
        }
    }
}

#[test]
fn a_geodesic_is_no_longer_than_a_path_along_edges() {
    let block = Block::new(8, |[x, y, _]| x == 4 && y > 1).shaken();
    let mut rows = vec![Vec::new(); block.places.len()];
    for corners in &block.tetrahedra {
        for &a in corners {
            rows[a as usize].extend(corners.iter().copied().filter(|&b| b != a));
        }
    }
    let (mut starts, mut ends, mut costs) = (vec![0], Vec::new(), Vec::new());
    for (a, mut row) in rows.into_iter().enumerate() {
        row.sort_unstable();
        row.dedup();
        for b in row {
            ends.push(b);
            costs.push((block.places[a] - block.places[b as usize]).norm());
        }
        starts.push(u32::try_from(ends.len()).unwrap());
    }
    let graph = Graph::new(Rows::new(starts, ends), costs).unwrap();
    let roots = block.roots(&points());
    let along = Flood {
        graph: &graph,
        roots: &roots,
        coefficients: &[],
        limit: f64::INFINITY,
    }
    .nearest(4);
    let inside = flood(&block.simplices(), &roots, 4);
    for corner in block.corners() {
        let along: Vec<_> = along.row(corner).collect();
        for (source, distance) in inside.row(corner) {
            let path = along.iter().find(|entry| entry.0 == source).unwrap();
            assert!(distance <= path.1 * (1.0 + 1e-9));
        }
    }
}

#[test]
fn corners_that_do_not_exist_are_refused() {
    let places = [Vector3::zeros(); 4];
    let refusal = Simplices::new(&places, &[[0, 1, 2, 4]], &[]).unwrap_err();
    assert_eq!(refusal, MappingError::Node { node: 4, nodes: 4 });
    let refusal = Simplices::new(&places, &[], &[[7, 1, 2]]).unwrap_err();
    assert_eq!(refusal, MappingError::Node { node: 7, nodes: 4 });
}

#[test]
fn cells_without_size_neither_stall_nor_overflow() {
    let places = [Vector3::zeros(); 4];
    let simplices = Simplices::new(&places, &[[0, 1, 2, 3]], &[[0, 0, 1]]).unwrap();
    let root = Root {
        node: 0,
        source: 0,
        start: 2.0,
    };
    let found = flood(&simplices, &[root], 1);
    for corner in 0..4 {
        assert_eq!(found.row(corner).next(), Some((0, 2.0)));
    }
}
