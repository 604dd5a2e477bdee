//! What a lattice fills, and the grid that it is made on.

use nalgebra::Vector3;

use crate::{Cell, CellShape, CellType, Cells, Grid, LatticeError, stuffing};

/// The most cells that [`lattice`](crate::lattice) and [`fill`](crate::fill) make.
pub const MOST_CELLS: u64 = 20_000_000;

/// The farthest that a solid may reach from the origin along an axis, in spacings.
const REACH: f64 = (1 << 19) as f64;

/// How deep a point of the grid lies in one part of a solid.
pub(crate) struct Sample {
    pub(crate) place: Place,
    pub(crate) part: u32,
    /// m.
    pub(crate) depth: f64,
}

/// What a lattice fills.
pub(crate) trait Solid {
    /// Calls `visit` with `[x, y, z]`, a part and the depth in it, m, for each point `(index + shift) spacing` that is
    /// inside or no farther than `margin` from the surface, once or more for each part near it. No such point is left
    /// out; others may come too.
    fn sample(&self, spacing: f64, shift: f64, margin: f64, visit: impl FnMut([i64; 3], u32, f64));

    /// Of all samples of a point, how deep it lies: above 0 inside, below 0 outside.
    fn depth(&self, samples: &[Sample]) -> f64;

    /// Where the surface is between two points, as a fraction of the way from the first, which is inside and has the
    /// samples `near`, to the second, which is outside. With each point comes its depth.
    fn crossing(&self, near: &[Sample], from: (Vector3<f64>, f64), to: (Vector3<f64>, f64)) -> f64;

    /// About how many cubes of edge `spacing` lie in the solid or cross its surface.
    fn cubes(&self, spacing: f64) -> f64;
}

/// A lattice in `solid`; it may be without cells.
pub(crate) fn build(
    shape: CellShape,
    spacing: f64,
    solid: &impl Solid,
) -> Result<Grid, LatticeError> {
    let per_cube = match shape {
        CellShape::Hexahedron => 1.0,
        CellShape::Tetrahedron => 12.0,
    };
    let cells = per_cube * solid.cubes(spacing);
    if cells > MOST_CELLS as f64 {
        let mut enough = spacing;
        while per_cube * solid.cubes(enough) > MOST_CELLS as f64 && enough.is_finite() {
            enough *= 1.1;
        }
        return Err(LatticeError::TooMany { cells, enough });
    }
    Ok(match shape {
        CellShape::Hexahedron => stack_cubes(spacing, solid),
        CellShape::Tetrahedron => stuffing::stuff(spacing, solid),
    })
}

pub(crate) fn check_spacing(spacing: f64) -> Result<(), LatticeError> {
    if spacing.is_finite() && spacing > 0.0 {
        Ok(())
    } else {
        Err(LatticeError::Spacing { value: spacing })
    }
}

/// The largest coordinate that a solid may have, m.
pub(crate) fn limit(spacing: f64) -> f64 {
    (REACH - 4.0) * spacing
}

/// The places of the points `(index + shift) spacing` from the lowest to the highest along an axis, and perhaps one
/// beyond each.
pub(crate) fn between(
    low: f64,
    high: f64,
    spacing: f64,
    shift: f64,
) -> std::ops::RangeInclusive<i64> {
    whole((low / spacing - shift).floor())..=whole((high / spacing - shift).ceil())
}

/// `value` is a whole number, at most a few times [`REACH`].
#[expect(clippy::cast_possible_truncation, reason = "whole and far below 2^63")]
pub(crate) fn whole(value: f64) -> i64 {
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

/// The cubes whose centre lies in the solid.
fn stack_cubes(spacing: f64, solid: &impl Solid) -> Grid {
    let mut cubes = Vec::new();
    solid.sample(spacing, 0.5, 0.0, |index, _, depth| {
        if depth >= 0.0 {
            cubes.push(Place::new(index));
        }
    });
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
