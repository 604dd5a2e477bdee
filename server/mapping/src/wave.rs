//! Steps of a wave from corners that it has reached to the next one: the local solves of geodesic floods. `[W12]`

use nalgebra::Vector3;

/// A corner that a wave has reached, seen from the corner that it goes to.
#[derive(Clone, Copy)]
pub(crate) struct Reached {
    /// Where it is from there, m.
    pub(crate) from: Vector3<f64>,
    /// How far from the source, m.
    pub(crate) distance: f64,
}

/// How a wave that comes through a triangle goes on.
pub(crate) enum Step {
    /// It comes after so many m.
    Hit(f64),
    /// It does not come sooner than is known.
    Late,
    /// Its ray passes beside the triangle: on the far side of the edge from the first corner to the second, or to the third.
    Miss([bool; 2]),
}

impl Reached {
    /// Along the edge.
    pub(crate) fn along_edge(&self) -> f64 {
        self.distance + self.from.norm()
    }
}

/// Through the edge between two corners of a triangle, whose third the wave goes to; infinite where its ray passes beside the
/// edge.
pub(crate) fn through_edge(p: &Reached, q: &Reached) -> f64 {
    let edge = q.from - p.from;
    let square = edge.norm_squared();
    let per_square = square.recip();
    // Along the edge from p in edges, and the square off it, m²: the source on one side, where the wave goes on the other.
    let [near, far] = [p.distance * p.distance, q.distance * q.distance];
    let source = 0.5 * (near - far + square) * per_square;
    let goal = -p.from.dot(&edge) * per_square;
    let source_off = (near - source * source * square).sqrt();
    let goal_off = (p.from.norm_squared() - goal * goal * square)
        .max(0.0)
        .sqrt();
    let off = source_off + goal_off;
    let hit = source * goal_off + goal * source_off;
    // Written so that what is not a number fails it.
    if off > 0.0 && hit >= 0.0 && hit <= off {
        (off * off + (goal - source) * (goal - source) * square).sqrt()
    } else {
        f64::INFINITY
    }
}

/// Through the triangle of three corners of a tetrahedron, whose fourth the wave goes to.
pub(crate) fn through_triangle(p: &Reached, q: &Reached, r: &Reached, known: f64) -> Step {
    let (a, b) = (q.from - p.from, r.from - p.from);
    let normal = a.cross(&b);
    let per_area = normal.norm_squared().recip();
    let (aa, ab, bb) = (a.norm_squared(), a.dot(&b), b.norm_squared());
    // In the plane by a and b from p, and off it: the source on one side, where the wave goes on the other.
    let square = |x: f64| x * x;
    let along_a = 0.5 * (square(p.distance) - square(q.distance) + aa);
    let along_b = 0.5 * (square(p.distance) - square(r.distance) + bb);
    let source = [
        (along_a * bb - along_b * ab) * per_area,
        (along_b * aa - along_a * ab) * per_area,
    ];
    let source_off = (square(p.distance) - source[0] * along_a - source[1] * along_b).sqrt();
    let goal = [
        b.cross(&p.from).dot(&normal) * per_area,
        p.from.cross(&a).dot(&normal) * per_area,
    ];
    let goal_off = p.from.dot(&normal).abs() * per_area.sqrt();
    let off = source_off + goal_off;
    let by = [goal[0] - source[0], goal[1] - source[1]];
    let in_plane = by[0] * by[0] * aa + 2.0 * by[0] * by[1] * ab + by[1] * by[1] * bb;
    let free = in_plane + off * off;
    if free >= known * known {
        return Step::Late;
    }
    let hit = [0, 1].map(|i| source[i] * goal_off + goal[i] * source_off);
    // Written so that what is not a number fails it.
    if off > 0.0 && hit[0] >= 0.0 && hit[1] >= 0.0 && hit[0] + hit[1] <= off {
        Step::Hit(free.sqrt())
    } else if off.is_nan() {
        Step::Miss([true; 2]) // no source has these distances
    } else {
        Step::Miss([hit[1] < 0.0, hit[0] < 0.0])
    }
}
