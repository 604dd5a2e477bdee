//! Formats that repeat a vertex in every triangle lose what is connected; welding finds it again.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// Of the greatest extent: a few times what 32-bit coordinates resolve. Writers that compute a vertex anew for each
/// triangle get it a last bit apart, and exactly equal positions alone would leave cracks.
const TOLERANCE: f64 = 1.0 / (1 << 22) as f64;

/// The vertices that `corners` stand for, in order of appearance, and the vertex of each corner; `None` beyond 2^32.
///
/// Equal corners always get the same vertex, and corners further apart than the tolerance never do.
pub(super) fn weld(corners: &[Vector3<f64>]) -> Option<(Vec<Vector3<f64>>, Vec<u32>)> {
    let extent = (0..3).map(|axis| {
        let along = || corners.iter().map(|corner| corner[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    });
    let tolerance = TOLERANCE * extent.fold(0.0, f64::max);
    let steps = [0, 1, 2].map(|axis| steps(corners, axis, tolerance));
    let mut vertices = BTreeMap::new();
    let mut positions = Vec::new();
    let mut indices = Vec::with_capacity(corners.len());
    for (number, corner) in corners.iter().enumerate() {
        let next = u32::try_from(positions.len()).ok()?;
        let place = [0, 1, 2].map(|axis: usize| steps[axis][number]);
        let vertex = *vertices.entry(place).or_insert(next);
        if vertex == next {
            positions.push(*corner);
        }
        indices.push(vertex);
    }
    Some((positions, indices))
}

/// For each corner, which group of nearby coordinates its own is in.
fn steps(corners: &[Vector3<f64>], axis: usize, tolerance: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.sort_by(|&a, &b| corners[a][axis].total_cmp(&corners[b][axis]));
    let mut steps = vec![0; corners.len()];
    let mut step = 0;
    let mut first = order.first().map_or(0.0, |&corner| corners[corner][axis]);
    for corner in order {
        // A group never grows beyond the tolerance, however dense the coordinates are.
        if corners[corner][axis] - first > tolerance {
            first = corners[corner][axis];
            step += 1;
        }
        steps[corner] = step;
    }
    steps
}
