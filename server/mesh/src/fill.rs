//! A closed surface filled with cells, so that what is torn shows an inside (paper 000, figure 12).

use nalgebra::Vector3;
use thiserror::Error;

use crate::measure::cone_volume;
use crate::solid::{Sample, Solid, between, build, check_spacing, limit};
use crate::winding::{EdgeUse, by_edge, edge_uses};
use crate::{CellShape, Grid, LatticeError, surface};

/// The most triangles of a surface to fill: each meets some fifty points of the grid, together a gibibyte.
const MOST_TRIANGLES: usize = 1_000_000;

/// The part of a [`Sample`] that says no more than that its point is inside.
const INSIDE: u32 = u32::MAX;

/// Why a surface cannot be filled.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FillError {
    /// A cell that is no piece of a surface.
    #[error("cell {cell} encloses a volume; only surfaces can be filled, so use the mesh as it is")]
    Volume {
        /// The cell.
        cell: usize,
    },
    /// A surface with a rim, or wound both ways.
    #[error(
        "the surface is not closed and wound one way: {edges} of its edges are not used as often in one direction as in the other, the first of vertices {} and {}; close the holes, and wind the faces alike (`sinew inspect FILE --repair OUT`)", first[0], first[1]
    )]
    Open {
        /// How many edges.
        edges: usize,
        /// The vertices of the first.
        first: [u32; 2],
    },
    /// A vertex farther from the origin than cells can be numbered.
    #[error(
        "vertex {vertex} is {reach} m from the origin along an axis; with a spacing of {spacing} m it must stay within {limit} m: move the surface, or use a larger spacing"
    )]
    OutOfReach {
        /// The vertex.
        vertex: usize,
        /// Its largest coordinate, m.
        reach: f64,
        /// The spacing, m.
        spacing: f64,
        /// The largest coordinate allowed, m.
        limit: f64,
    },
    /// A surface of too many triangles.
    #[error("the surface has {triangles} triangles, more than {MOST_TRIANGLES}; simplify it")]
    TooManyTriangles {
        /// How many.
        triangles: usize,
    },
    /// No cell lies inside.
    #[error(
        "no cell of {spacing} m fits into the surface, which encloses {volume} m³; use a smaller spacing"
    )]
    NoCells {
        /// The spacing, m.
        spacing: f64,
        /// What the surface encloses, m³.
        volume: f64,
    },
    /// A spacing that makes no lattice.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
}

/// Fills the closed surface that the checked grid `skin` is with the cells of a [`lattice`](crate::lattice). A point is
/// inside where the surface winds around it: parts that overlap are filled once, and a part that is wound the other way
/// inside another one leaves a hollow. Edges sharper than the lattice are rounded off by up to a `spacing`; walls and
/// gaps thinner than that may be missing.
///
/// # Errors
/// [`FillError`], before anything large is allocated.
pub fn fill(shape: CellShape, spacing: f64, skin: &Grid) -> Result<Grid, FillError> {
    if let Some(cell) = skin.cells.iter().position(|cell| cell.kind.is_volume()) {
        return Err(FillError::Volume { cell });
    }
    check_spacing(spacing)?;
    check_closed(skin)?;
    let limit = limit(spacing);
    for (vertex, position) in skin.positions.iter().enumerate() {
        let reach = position.amax();
        if reach > limit {
            return Err(FillError::OutOfReach {
                vertex,
                reach,
                spacing,
                limit,
            });
        }
    }
    let shell = Shell::new(skin);
    let triangles = shell.triangles.len();
    if triangles > MOST_TRIANGLES {
        return Err(FillError::TooManyTriangles { triangles });
    }
    let grid = build(shape, spacing, &shell)?;
    if grid.cells.is_empty() {
        let volume = shell.volume;
        return Err(FillError::NoCells { spacing, volume });
    }
    Ok(grid)
}

fn check_closed(skin: &Grid) -> Result<(), FillError> {
    let faces = (0u32..).zip(skin.cells.iter().flat_map(|cell| cell.faces()));
    let uses = edge_uses(faces);
    let balanced =
        |edge: &[EdgeUse]| 2 * edge.iter().filter(|side| side.descends).count() == edge.len();
    let mut open = by_edge(&uses).filter(|edge| !balanced(edge));
    match open.next() {
        None => Ok(()),
        Some(edge) => Err(FillError::Open {
            edges: 1 + open.count(),
            first: edge[0].ends,
        }),
    }
}

/// What a closed surface of triangles winds around.
struct Shell {
    positions: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Enclosed, m³, without sign.
    volume: f64,
    /// m².
    area: f64,
}

/// Where a row of grid points along x pierces the surface.
struct Pierce {
    /// The row's z and y.
    row: [i64; 2],
    /// m.
    x: f64,
    /// Whether the surface winds once more or once less around what follows.
    step: i32,
}

impl Shell {
    fn new(skin: &Grid) -> Self {
        let skinned = surface(&skin.cells);
        let positions: Vec<_> = (skinned.vertices.iter())
            .map(|&vertex| skin.positions[vertex as usize])
            .collect();
        let origin = skin.positions.first().copied().unwrap_or_default();
        let at = |vertex: u32| skin.positions[vertex as usize] - origin;
        let cones = skin.cells.iter().flat_map(|cell| cell.faces());
        let volume: f64 = cones.map(|face| cone_volume(&face, &at)).sum();
        let mut shell = Self {
            positions,
            triangles: skinned.triangles,
            volume: volume.abs(),
            area: 0.0,
        };
        let double = |[a, b, c]: [Vector3<f64>; 3]| (b - a).cross(&(c - a)).norm();
        shell.area = (0..shell.triangles.len())
            .map(|triangle| 0.5 * double(shell.corners(triangle)))
            .sum();
        shell
    }

    fn corners(&self, triangle: usize) -> [Vector3<f64>; 3] {
        self.triangles[triangle].map(|corner| self.positions[corner as usize])
    }

    /// Where the surface pierces rows, by ascending row and then x. A row that meets an edge or a vertex passes beside it,
    /// for all triangles there on the same side, so that what is closed is closed for each row.
    fn pierces(&self, spacing: f64, shift: f64) -> Vec<Pierce> {
        let mut pierces = Vec::new();
        let at = |index: i64| (index as f64 + shift) * spacing;
        for (number, triangle) in self.triangles.iter().enumerate() {
            let corners = self.corners(number);
            let [low, high] = extent(&corners, 2);
            for k in between(low, high, spacing, shift) {
                let Some([rising, falling]) = self.section(triangle, at(k)) else {
                    continue;
                };
                let (first, last) = (rising.min(falling), rising.max(falling));
                for j in between(first, last, spacing, shift) {
                    if at(j) > first && at(j) <= last {
                        pierces.push(Pierce {
                            row: [k, j],
                            x: x_of_plane(&corners, at(j), at(k)),
                            step: if rising > falling { 1 } else { -1 },
                        });
                    }
                }
            }
        }
        pierces.sort_unstable_by(|a, b| a.row.cmp(&b.row).then(a.x.total_cmp(&b.x)));
        pierces
    }

    /// The y where the plane at `z` meets the edge of the triangle that rises through it, and the one that falls.
    fn section(&self, triangle: &[u32; 3], z: f64) -> Option<[f64; 2]> {
        let (mut rising, mut falling) = (None, None);
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (from, to) = (triangle[from], triangle[to]);
            let below = |vertex: u32| self.positions[vertex as usize].z <= z;
            // By vertex number, so that both triangles of an edge find the same.
            let ends = [from.min(to), from.max(to)].map(|vertex| self.positions[vertex as usize]);
            let y = || {
                let fraction = (z - ends[0].z) / (ends[1].z - ends[0].z);
                ends[0].y + (ends[1].y - ends[0].y) * fraction
            };
            match (below(from), below(to)) {
                (true, false) => rising = Some(y()),
                (false, true) => falling = Some(y()),
                (true, true) | (false, false) => {}
            }
        }
        Some([rising?, falling?])
    }

    /// Pieces of the triangles no longer than a few spacings, so that the box around each is not much larger than itself.
    fn pieces(&self, spacing: f64, mut visit: impl FnMut(u32, [Vector3<f64>; 3])) {
        for number in 0..self.triangles.len() {
            let part = u32::try_from(number).expect("fewer triangles than a grid has corners");
            let mut rest = vec![self.corners(number)];
            while let Some([a, b, c]) = rest.pop() {
                let edges = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
                let longest = (0..3).fold(0, |most, edge| {
                    if edges[edge] > edges[most] {
                        edge
                    } else {
                        most
                    }
                });
                let [a, b, c] = [[a, b, c], [b, c, a], [c, a, b]][longest];
                if edges[longest] <= 4.0 * spacing {
                    visit(part, [a, b, c]);
                } else {
                    let middle = (a + b) / 2.0;
                    rest.extend([[a, middle, c], [middle, b, c]]);
                }
            }
        }
    }
}

impl Solid for Shell {
    fn sample(
        &self,
        spacing: f64,
        shift: f64,
        margin: f64,
        mut visit: impl FnMut([i64; 3], u32, f64),
    ) {
        let at = |index: i64| (index as f64 + shift) * spacing;
        // Without a margin only what is inside counts.
        if margin > 0.0 {
            self.pieces(spacing, |part, piece| {
                let range = |axis: usize| {
                    let [low, high] = extent(&piece, axis);
                    between(low - margin, high + margin, spacing, shift)
                };
                for z in range(2) {
                    for y in range(1) {
                        for x in range(0) {
                            let point = Vector3::new(at(x), at(y), at(z));
                            visit([x, y, z], part, -distance(&point, &piece));
                        }
                    }
                }
            });
        }
        for row in self.pierces(spacing, shift).chunk_by(|a, b| a.row == b.row) {
            let mut winding = 0;
            for pair in row.windows(2) {
                winding += pair[0].step;
                if winding == 0 {
                    continue;
                }
                for x in between(pair[0].x, pair[1].x, spacing, shift) {
                    if at(x) >= pair[0].x && at(x) < pair[1].x {
                        visit([x, pair[0].row[1], pair[0].row[0]], INSIDE, margin);
                    }
                }
            }
        }
    }

    fn depth(&self, samples: &[Sample]) -> f64 {
        let distances = samples.iter().map(|sample| sample.depth.abs());
        let distance = distances.fold(f64::INFINITY, f64::min);
        if samples.iter().any(|sample| sample.part == INSIDE) {
            distance
        } else {
            -distance
        }
    }

    fn crossing(
        &self,
        near: &[Sample],
        (from, inside): (Vector3<f64>, f64),
        (to, outside): (Vector3<f64>, f64),
    ) -> f64 {
        let parts = near.iter().filter(|sample| sample.part != INSIDE);
        let met =
            parts.filter_map(|sample| meeting(&self.corners(sample.part as usize), &from, &to));
        // The last one: those before it may be walls of parts that overlap. None, where rounding lets the way slip
        // through between two triangles: then by the distances to the surface.
        met.reduce(f64::max)
            .unwrap_or_else(|| inside / (inside - outside))
    }

    fn cubes(&self, spacing: f64) -> f64 {
        (self.volume + 0.5 * spacing * self.area) / spacing.powi(3)
    }
}

fn extent(corners: &[Vector3<f64>; 3], axis: usize) -> [f64; 2] {
    let [a, b, c] = corners.map(|corner| corner[axis]);
    [a.min(b).min(c), a.max(b).max(c)]
}

/// The x of the triangle's plane at `y` and `z`, kept to the triangle's own where the plane is steep.
fn x_of_plane(corners: &[Vector3<f64>; 3], y: f64, z: f64) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let [low, high] = extent(corners, 0);
    let x = a.x - (normal.y * (y - a.y) + normal.z * (z - a.z)) / normal.x;
    if x.is_nan() { low } else { x.clamp(low, high) }
}

/// How far a point is from a triangle, m.
fn distance(point: &Vector3<f64>, &[a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let edges = [(a, b), (b, c), (c, a)];
    let above = |(from, to): (Vector3<f64>, Vector3<f64>)| {
        (to - from).cross(&(point - from)).dot(&normal) >= 0.0
    };
    let length = normal.norm();
    if length > 0.0 && edges.into_iter().all(above) {
        return (point - a).dot(&normal).abs() / length;
    }
    let to_edge = |(from, to): (Vector3<f64>, Vector3<f64>)| {
        let along = to - from;
        let squared = along.norm_squared();
        let fraction = if squared > 0.0 {
            ((point - from).dot(&along) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (point - from - along * fraction).norm()
    };
    edges.into_iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Where the way between two points meets a triangle, as a fraction of it.
fn meeting(&[a, b, c]: &[Vector3<f64>; 3], from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
    /// Of a triangle's extent: what slips through between two of them for rounding is met by both.
    const SLACK: f64 = 1e-12;
    /// Sine of the least angle: along a triangle's plane rounding alone would say where it is met.
    const STEEP: f64 = 1e-9;
    let (way, normal) = (to - from, (b - a).cross(&(c - a)));
    let steepness = -way.dot(&normal);
    if steepness.abs() <= STEEP * way.norm() * normal.norm() {
        return None;
    }
    let start = from - a;
    let turned = start.cross(&way);
    let fraction = start.dot(&normal) / steepness;
    let second = (c - a).dot(&turned) / steepness;
    let third = -(b - a).dot(&turned) / steepness;
    let met = second >= -SLACK
        && third >= -SLACK
        && second + third <= 1.0 + SLACK
        && (0.0..=1.0).contains(&fraction);
    met.then_some(fraction)
}
