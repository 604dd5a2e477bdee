//! Grids made to fill a solid: cubes, or tetrahedra with a smooth surface.

use nalgebra::Vector3;
use thiserror::Error;

use crate::{Cell, CellShape, CellType, Cells, Grid, stuffing};

/// The most cells that [`lattice`] makes.
pub const MOST_CELLS: u64 = 20_000_000;

/// The farthest that a solid may reach from the origin along an axis, in spacings.
const REACH: f64 = (1 << 19) as f64;

/// All points within `radius` of the segment from `start` to `end`; a ball where these are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end, m.
    pub start: Vector3<f64>,
    /// The other end, m.
    pub end: Vector3<f64>,
    /// m, above 0.
    pub radius: f64,
}

impl Capsule {
    /// How deep `point` lies inside, m: the distance to the capsule's surface, negative outside.
    pub fn depth(&self, point: &Vector3<f64>) -> f64 {
        let along = self.end - self.start;
        let from_start = point - self.start;
        let squared_length = along.norm_squared();
        let fraction = if squared_length > 0.0 {
            (from_start.dot(&along) / squared_length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        self.radius - (from_start - along * fraction).norm()
    }

    /// Capsules of moderate length with the same union, so that the box around each is not much larger than itself.
    fn pieces(&self, spacing: f64) -> impl Iterator<Item = Self> {
        let along = self.end - self.start;
        let count = (along.norm() / (2.0 * (self.radius + spacing)))
            .ceil()
            .max(1.0);
        let at = move |piece: i64| self.start + along * (piece as f64 / count);
        (0..whole(count)).map(move |piece| Self {
            start: at(piece),
            end: if piece + 1 == whole(count) {
                self.end
            } else {
                at(piece + 1)
            },
            radius: self.radius,
        })
    }

    fn volume(&self) -> f64 {
        let length = (self.end - self.start).norm();
        std::f64::consts::PI * self.radius.powi(2) * (length + 4.0 / 3.0 * self.radius)
    }
}

/// Why no lattice can be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LatticeError {
    /// A spacing that is no positive number.
    #[error("the spacing is {value}; it must be finite and above 0")]
    Spacing {
        /// The spacing, m.
        value: f64,
    },
    /// A radius that is no positive number.
    #[error("the radius of capsule {capsule} is {value}; it must be finite and above 0")]
    Radius {
        /// The capsule.
        capsule: usize,
        /// Its radius, m.
        value: f64,
    },
    /// A capsule that is not finite, or farther from the origin than cells can be numbered.
    #[error(
        "capsule {capsule} reaches {reach} m from the origin; with a spacing of {spacing} m it must stay within {limit} m: move the solid, or use a larger spacing"
    )]
    OutOfReach {
        /// The capsule.
        capsule: usize,
        /// Its largest coordinate, m.
        reach: f64,
        /// The spacing, m.
        spacing: f64,
        /// The largest coordinate allowed, m.
        limit: f64,
    },
    /// More cells than [`MOST_CELLS`].
    #[error(
        "about {cells:.0} cells would result, more than {MOST_CELLS}; a spacing of {enough:.3e} m is large enough"
    )]
    TooMany {
        /// Number of cells, estimated.
        cells: f64,
        /// A spacing that suffices, m.
        enough: f64,
    },
    /// No cell lies in the solid.
    #[error(
        "no cell of {spacing} m fits into the solid, whose largest radius is {radius} m; use a spacing of at most the radius"
    )]
    NoCells {
        /// The spacing, m.
        spacing: f64,
        /// The largest radius, m; 0 without capsules.
        radius: f64,
    },
}

/// Fills the union of the capsules `solid` with cells on a grid that is aligned with the world's axes and passes
/// through its origin. `spacing` is the edge of the grid's cubes, m.
///
/// * [`CellShape::Hexahedron`]: the cubes whose centre lies in the solid.
/// * [`CellShape::Tetrahedron`]: isosurface stuffing, 12 tetrahedra per cube inside; vertices of the surface lie on that
///   of the solid. Dihedral angles, measured over 22 million tetrahedra in random solids: 10.1° to 157.7°. Parts
///   thinner than the spacing may be missing.
///
/// Vertices and cells are numbered by their place in the world, not by the order of the capsules. Time and memory are
/// proportional to the number of cells near each capsule.
///
/// # Errors
/// [`LatticeError`], before anything large is allocated.
pub fn lattice(shape: CellShape, spacing: f64, solid: &[Capsule]) -> Result<Grid, LatticeError> {
    validate(spacing, solid)?;
    let per_cube = match shape {
        CellShape::Hexahedron => 1.0,
        CellShape::Tetrahedron => 12.0,
    };
    let cells = per_cube * cubes(spacing, solid);
    if cells > MOST_CELLS as f64 {
        let mut enough = spacing;
        while per_cube * cubes(enough, solid) > MOST_CELLS as f64 && enough.is_finite() {
            enough *= 1.1;
        }
        return Err(LatticeError::TooMany { cells, enough });
    }
    let pieces: Vec<_> = (solid.iter())
        .flat_map(|capsule| capsule.pieces(spacing))
        .collect();
    let grid = match shape {
        CellShape::Hexahedron => stack_cubes(spacing, &pieces),
        CellShape::Tetrahedron => stuffing::stuff(spacing, &pieces),
    };
    if grid.cells.is_empty() {
        let radius = solid
            .iter()
            .map(|capsule| capsule.radius)
            .fold(0.0, f64::max);
        return Err(LatticeError::NoCells { spacing, radius });
    }
    Ok(grid)
}

fn validate(spacing: f64, solid: &[Capsule]) -> Result<(), LatticeError> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    if !positive(spacing) {
        return Err(LatticeError::Spacing { value: spacing });
    }
    let limit = (REACH - 4.0) * spacing;
    for (capsule, Capsule { start, end, radius }) in solid.iter().enumerate() {
        if !positive(*radius) {
            let value = *radius;
            return Err(LatticeError::Radius { capsule, value });
        }
        let coordinates = || start.iter().chain(end.iter()).map(|at| at.abs());
        // f64::max passes over a NaN.
        let reach = match coordinates().find(|at| at.is_nan()) {
            Some(nan) => nan,
            None => coordinates().fold(0.0, f64::max) + radius,
        };
        let within = reach <= limit;
        if !within {
            return Err(LatticeError::OutOfReach {
                capsule,
                reach,
                spacing,
                limit,
            });
        }
    }
    Ok(())
}

/// About how many cubes lie in the solid or cross its surface, overlaps counted twice.
fn cubes(spacing: f64, solid: &[Capsule]) -> f64 {
    let grown = solid.iter().map(|capsule| Capsule {
        radius: capsule.radius + 0.5 * spacing,
        ..*capsule
    });
    grown.map(|capsule| capsule.volume()).sum::<f64>() / spacing.powi(3)
}

/// Calls `visit` with `[x, y, z]` and the depth of each point `(index + shift) spacing` that lies in a piece's box
/// grown by `margin`.
pub(crate) fn for_each_near(
    piece: &Capsule,
    spacing: f64,
    shift: f64,
    margin: f64,
    mut visit: impl FnMut([i64; 3], f64),
) {
    let reach = piece.radius + margin;
    let range = |axis: usize| {
        let (low, high) = (
            piece.start[axis].min(piece.end[axis]),
            piece.start[axis].max(piece.end[axis]),
        );
        let first = whole(((low - reach) / spacing - shift).ceil());
        first..=whole(((high + reach) / spacing - shift).floor())
    };
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                let index = Vector3::new(x as f64, y as f64, z as f64);
                visit([x, y, z], piece.depth(&(index.add_scalar(shift) * spacing)));
            }
        }
    }
}

/// `value` is a whole number that `validate` has bounded by a few times [`REACH`].
#[expect(clippy::cast_possible_truncation, reason = "whole and far below 2^63")]
fn whole(value: f64) -> i64 {
    value as i64
}

/// Number of bits that a [`Place`] spends on each axis.
const BITS: u32 = 21;

/// A point of an integer grid, packed so that places compare by z, then y, then x, and that a constant step is a
/// constant difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place(i64);

impl Place {
    /// Each coordinate must stay within ±2²⁰.
    pub(crate) fn new([x, y, z]: [i64; 3]) -> Self {
        Self(x + (y << BITS) + (z << (2 * BITS)))
    }

    pub(crate) fn coordinates(self) -> [i64; 3] {
        let half = 1 << (BITS - 1);
        let lowest = |packed: i64| ((packed + half) & (2 * half - 1)) - half;
        let x = lowest(self.0);
        let y = lowest((self.0 - x) >> BITS);
        let z = (((self.0 - x) >> BITS) - y) >> BITS;
        [x, y, z]
    }

    pub(crate) fn step(self, by: [i64; 3]) -> Self {
        Self(self.0 + Self::new(by).0)
    }

    pub(crate) fn position(self, spacing: f64) -> Vector3<f64> {
        Vector3::from(self.coordinates().map(|at| at as f64)) * spacing
    }
}

/// For ascending `queries`, where each stands in the ascending `places`, if it does: one sweep, no search.
pub(crate) fn find_sorted(
    places: &[Place],
    queries: impl Iterator<Item = Place>,
) -> impl Iterator<Item = Option<usize>> {
    let mut at = 0;
    queries.map(move |query| {
        while at < places.len() && places[at] < query {
            at += 1;
        }
        (places.get(at) == Some(&query)).then_some(at)
    })
}

/// The cubes whose centre lies in a piece.
fn stack_cubes(spacing: f64, pieces: &[Capsule]) -> Grid {
    let mut cubes = Vec::new();
    for piece in pieces {
        for_each_near(piece, spacing, 0.5, 0.0, |index, depth| {
            if depth >= 0.0 {
                cubes.push(Place::new(index));
            }
        });
    }
    cubes.sort_unstable();
    cubes.dedup();

    let mut corners = cubes.clone();
    for step in [[1, 0, 0], [0, 1, 0], [0, 0, 1]] {
        let stepped: Vec<_> = corners.iter().map(|corner| corner.step(step)).collect();
        corners.extend(stepped);
        // Two ascending runs: the stable sort merges them in one pass.
        corners.sort();
        corners.dedup();
    }
    let around = [
        [0, 0, 0],
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 0],
        [0, 0, 1],
        [1, 0, 1],
        [1, 1, 1],
        [0, 1, 1],
    ];
    let mut found =
        around.map(|step| find_sorted(&corners, cubes.iter().map(move |cube| cube.step(step))));
    let mut cells = Cells::default();
    for _ in &cubes {
        let vertices = found.each_mut().map(|corner| {
            let corner = corner
                .next()
                .flatten()
                .expect("every cube's corners are in the list");
            u32::try_from(corner).expect("MOST_CELLS bounds the corners")
        });
        cells.push(Cell {
            kind: CellType::Hexahedron,
            vertices: &vertices,
            face_stream: &[],
        });
    }
    let positions = corners
        .iter()
        .map(|corner| corner.position(spacing))
        .collect();
    Grid { positions, cells }
}
