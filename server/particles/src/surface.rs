//! Frames and curvatures of bodies that make up a surface, estimated from where they are.

use std::{cmp::Reverse, collections::BinaryHeap};

use nalgebra::{Matrix2, Matrix3, Matrix5, Rotation3, UnitQuaternion, Vector3, Vector5};

use crate::{
    Fault, SpecError,
    check::{self, Checked, POSITIVE, positive, refuse},
    neighbours::{Neighbours, Search},
};

/// What bodies on a surface need to keep its shape by the form interaction. One entry per body.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// World from body: x is the normal, y and z are the directions of greatest and least curvature.
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// Curvature along y and along z, 1/m, as [`Form::curvatures`](crate::Form::curvatures) has it: positive where the
    /// surface bends away from the normal.
    pub curvatures: Vec<[f64; 2]>,
}

/// What a fit asks for: five coefficients.
const LEAST: usize = 5;
/// How often a normal is corrected by the slope of the surface over its plane.
const ROUNDS: usize = 3;

/// Estimates the frames and curvatures of a surface from points on it, by a quadric through each point's neighbours. `[P35]`
///
/// * `points` – one per body, m.
/// * `triangles` – with points as corners, counterclockwise as seen from outside; empty for a cloud of points, whose
///   normals then point the same way from neighbour to neighbour, outwards at the top (z) of each part.
/// * `reach` – how far neighbours are, m: a few distances between points. Shorter follows details, longer averages.
///
/// # Errors
/// [`SpecError`] where a point is not finite, a corner does not exist, or a point has fewer than five neighbours.
pub fn surface(
    points: &[Vector3<f64>],
    triangles: &[[u32; 3]],
    reach: f64,
) -> Result<Surface, SpecError> {
    check_all(points, triangles, reach)?;
    let near = neighbours(points, reach)?;
    if near.iter().any(|near| near.len() < LEAST) {
        let rule = "so long that every point has five others within it";
        return Err(refuse("reach", Fault::Value { value: reach, rule }));
    }
    let planes = points.iter().zip(&near);
    let mut normals: Vec<_> = planes.map(|(x, near)| plane(x, near, points)).collect();
    if triangles.is_empty() {
        align(points, &near, &mut normals);
    } else {
        face(points, triangles, &mut normals);
    }
    let bodies = points.iter().zip(&near).zip(&normals);
    let (orientations, curvatures) = bodies
        .map(|((x, near), normal)| fit(x, *normal, near, points, reach))
        .unzip();
    Ok(Surface {
        orientations,
        curvatures,
    })
}

fn check_all(points: &[Vector3<f64>], triangles: &[[u32; 3]], reach: f64) -> Checked {
    check::finite("points", points)?;
    for (entry, corners) in triangles.iter().enumerate() {
        for &corner in corners {
            check::exists(&format!("triangles[{entry}]"), corner, points.len())?;
        }
    }
    check::number("reach", reach, positive, POSITIVE)
}

/// For each point those within reach.
fn neighbours(points: &[Vector3<f64>], reach: f64) -> Result<Vec<Vec<u32>>, SpecError> {
    let search = Search {
        reach: [reach, 0.0],
        skin: 0.0,
    };
    let mut found = Neighbours::default();
    (found.update(&search, points, |_, _| Some(0))).map_err(|_| refuse("reach", Fault::Crowded))?;
    let mut near = vec![Vec::new(); points.len()];
    found.rows[0].for_each_end(|a, b, _| near[found.order[a] as usize].push(found.order[b]));
    Ok(near)
}

/// The normal of the plane that is nearest to a point and its neighbours.
fn plane(x: &Vector3<f64>, near: &[u32], points: &[Vector3<f64>]) -> Vector3<f64> {
    let r = || near.iter().map(|&i| points[i as usize] - x);
    #[expect(clippy::cast_precision_loss, reason = "a few neighbours")]
    let mean = r().sum::<Vector3<f64>>() / (near.len() + 1) as f64;
    let spread: Matrix3<f64> = r().map(|r| (r - mean) * (r - mean).transpose()).sum();
    let spread = (spread + mean * mean.transpose()).symmetric_eigen();
    spread.eigenvectors.column(spread.eigenvalues.imin()).into()
}

/// Turns normals to the side from which the triangles around them are counterclockwise.
fn face(points: &[Vector3<f64>], triangles: &[[u32; 3]], normals: &mut [Vector3<f64>]) {
    let mut outside = vec![Vector3::zeros(); points.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        for &corner in corners {
            outside[corner as usize] += (b - a).cross(&(c - a));
        }
    }
    for (normal, outside) in normals.iter_mut().zip(&outside) {
        if normal.dot(outside) < 0.0 {
            *normal = -*normal;
        }
    }
}

/// Turns normals to the side of their neighbours', along a tree of the least bends: Hoppe and others, SIGGRAPH 1992.
fn align(points: &[Vector3<f64>], near: &[Vec<u32>], normals: &mut [Vector3<f64>]) {
    let mut from_top: Vec<usize> = (0..points.len()).collect();
    from_top.sort_by(|&a, &b| points[b].z.total_cmp(&points[a].z));
    let mut is_done = vec![false; points.len()];
    for top in from_top {
        if is_done[top] {
            continue;
        }
        if normals[top].z < 0.0 {
            normals[top] = -normals[top];
        }
        // Bends are not negative, so their bits are in their order.
        let mut next = BinaryHeap::from([Reverse((0_u64, top, top))]);
        while let Some(Reverse((_, from, to))) = next.pop() {
            if std::mem::replace(&mut is_done[to], true) {
                continue;
            }
            if normals[from].dot(&normals[to]) < 0.0 {
                normals[to] = -normals[to];
            }
            for other in near[to].iter().map(|&other| other as usize) {
                if !is_done[other] {
                    let bend = (1.0 - normals[to].dot(&normals[other]).abs()).max(0.0);
                    next.push(Reverse((bend.to_bits(), to, other)));
                }
            }
        }
    }
}

/// The frame and the curvatures of the quadric `h = a u² + b u v + c v² + d u + e v` over the tangent plane. `[P35]`
fn fit(
    x: &Vector3<f64>,
    mut normal: Vector3<f64>,
    near: &[u32],
    points: &[Vector3<f64>],
    reach: f64,
) -> (UnitQuaternion<f64>, [f64; 2]) {
    let mut bend = Matrix2::zeros();
    let mut axes = [Vector3::zeros(); 2];
    for _ in 0..ROUNDS {
        let u = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
        axes = [u, normal.cross(&u)];
        let (mut matrix, mut right) = (Matrix5::zeros(), Vector5::zeros());
        for &other in near {
            // In units of the reach, so that all coefficients weigh alike.
            let r = (points[other as usize] - x) / reach;
            let [u, v] = axes.map(|axis| axis.dot(&r));
            let row = Vector5::new(u * u, u * v, v * v, u, v);
            let weight = (1.0 - r.norm_squared()).max(0.0);
            matrix += row * row.transpose() * weight;
            right += row * (normal.dot(&r) * weight);
        }
        // Neighbours on one line say nothing of what is beside it: the least solution is flat there.
        let solved = matrix.svd(true, true).solve(&right, 1e-12 * matrix.norm());
        let [a, b, c, d, e] = solved.map_or([0.0; 5], |solved| solved.into());
        bend = Matrix2::new(2.0 * a, b, b, 2.0 * c) / -reach;
        normal = (normal - axes[0] * d - axes[1] * e).normalize();
    }
    let bend = bend.symmetric_eigen();
    let most = bend.eigenvalues.imax();
    let along = bend.eigenvectors.column(most);
    let y = axes[0] * along[0] + axes[1] * along[1];
    let y = (y - normal * normal.dot(&y)).normalize();
    let frame = Rotation3::from_basis_unchecked(&[normal, y, normal.cross(&y)]);
    (
        UnitQuaternion::from_rotation_matrix(&frame),
        [bend.eigenvalues[most], bend.eigenvalues[1 - most]],
    )
}
