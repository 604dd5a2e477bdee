//! Fits of shape matching, beside a plain loop over singular values.

use nalgebra::{Matrix3, Vector3};
use sinew_engine::{Filter, MovingFit, Rule, World};
use sinew_mesh::shapes;

use crate::{
    fields::{TWIST, scattered},
    section::{Cell, Failure, Findings, Section, Table},
    timing::{Spread, by_turns, with_threads},
    worlds::{self, build, move_to, moved},
};

pub(crate) const SECTION: Section = Section {
    name: "fits",
    title: "Fits of shape matching",
    measure,
};

/// Cubes along each edge: 8,000 vertices.
const CUBES: usize = 19;
const POINTS: usize = 1000;
/// For each number of points, s.
const BUDGET: f64 = 2.0;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text(
        "A fit of its own for each of 8,000 vertices (rigid moving least squares), of its nearest of 1,000 points: centroid, \
         covariance, rotation, and the vertex moved; one thread. The plain loop does the same with the same weights by \
         nalgebra’s singular values, reflections undone. Both keep the arms of the points at rest.",
    );
    let columns = [
        "points per fit",
        "the engine, ns per fit",
        "plain loop, ns per fit",
        "plain over the engine",
        "largest difference, m",
    ];
    let mut table = Table::new("Whole fits", columns);
    for kept in [8, 32, 128] {
        table.row(with_threads(1, || of(kept))?);
    }
    findings.table(table);
    Ok(findings)
}

/// What one fit has to know of one point.
struct Member {
    point: usize,
    share: f64,
    arm: Vector3<f64>,
}

/// A vertex and the points of its fit.
struct Plain {
    offset: Vector3<f64>,
    members: Vec<Member>,
}

impl Plain {
    fn of(world: &World, vertex: usize, rest: &[Vector3<f64>]) -> Option<Self> {
        let influences = world.explain(vertex)?.influences;
        let at = |i: &sinew_engine::Influence| rest[i.point as usize];
        let centre: Vector3<f64> = influences.iter().map(|i| at(i) * i.weight).sum();
        let member = |i: &sinew_engine::Influence| Member {
            point: i.point as usize,
            share: i.weight,
            arm: at(i) - centre,
        };
        Some(Self {
            offset: world.frame().vertices[vertex] - centre,
            members: influences.iter().map(member).collect(),
        })
    }

    fn pose(&self, now: &[Vector3<f64>]) -> Vector3<f64> {
        let members = || self.members.iter();
        let centre: Vector3<f64> = members().map(|m| now[m.point] * m.share).sum();
        let covariance: Matrix3<f64> = members()
            .map(|m| (now[m.point] - centre) * m.share * m.arm.transpose())
            .sum();
        let svd = covariance.svd(true, true);
        let (Some(mut u), Some(v)) = (svd.u, svd.v_t) else {
            return centre + self.offset;
        };
        if (u * v).determinant() < 0.0 {
            u.column_mut(svd.singular_values.imin()).neg_mut();
        }
        centre + u * v * self.offset
    }
}

fn of(kept: usize) -> Result<Vec<Cell>, Failure> {
    let rest = scattered(POINTS);
    let now = moved(&rest, &TWIST);
    let rule = Rule::MovingLeastSquares(MovingFit::Rigid);
    let mapping = worlds::mapping(Filter::KeepK(kept), rule);
    let mut world = build(shapes::hexahedra(CUBES, CUBES, CUBES), &rest, mapping)?;
    let count = world.frame().vertices.len();
    let fits: Option<Vec<Plain>> = (0..count).map(|v| Plain::of(&world, v, &rest)).collect();
    let fits = fits.ok_or("no such vertex")?;
    let mut out = vec![Vector3::zeros(); count];
    let seconds = by_turns(
        BUDGET,
        &mut [&mut || drop(move_to(&mut world, &now)), &mut || {
            for (out, fit) in out.iter_mut().zip(&fits) {
                *out = fit.pose(&now);
            }
        }],
    );
    let frame = world.frame();
    let gaps = frame.vertices.iter().zip(&out).map(|(a, b)| (a - b).norm());
    #[expect(clippy::cast_precision_loss, reason = "8,000")]
    let per_fit = |seconds: &[f64]| Spread::of(seconds).times(1e9 / count as f64);
    Ok(vec![
        kept.to_string().into(),
        per_fit(&seconds[0]).into(),
        per_fit(&seconds[1]).into(),
        Spread::of_ratio(&seconds[1], &seconds[0]).into(),
        gaps.fold(0.0, f64::max).into(),
    ])
}
