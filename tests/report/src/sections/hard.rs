//! Where mappings have no easy answer: what is expected, what came.

use nalgebra::{Rotation3, Vector3};
use sinew_engine::{Filter, MovingFit, Polynomial, RadialBasis, RadialFunction, Rule};
use sinew_mesh::{Grid, shapes};

use crate::{
    fields::{Gap, scattered},
    section::{Cell, Failure, Findings, Section, Table, digits},
    worlds::{self, LINEAR, QUADRATIC, RIGID, build, cloud, move_to},
};

pub(crate) const SECTION: Section = Section {
    name: "hard",
    title: "Hard cases",
    measure,
};

/// Rounding on a mesh of 1 m.
const EXACT: f64 = 1e-9;

/// What came, and whether it is what was expected.
type Got = Result<(bool, String), Failure>;

type Positions = Vec<Vector3<f64>>;

/// A case, what is expected of it and how to try it.
type Case = (&'static str, &'static str, fn() -> Got);

const CASES: [Case; 13] = [
    ("one point", "every rule translates", || {
        follows_a_shift(&[Vector3::new(0.4, 0.6, 0.5)])
    }),
    (
        "two points",
        "every rule translates; shape matching turns with them, without twist",
        two,
    ),
    ("three points in a line", "every rule translates", || {
        follows_a_shift(&[0.2, 0.4, 0.9].map(Vector3::repeat))
    }),
    (
        "four points in a plane, turned",
        "shape matching turns and does not flatten",
        coplanar,
    ),
    (
        "four points in a plane, barycentric",
        "refused, with the vertices",
        || refused(&square(), Rule::Barycentric, 32),
    ),
    ("points 1e-12 m apart", "every rule translates", || {
        let near = Vector3::new(1e-12, -1e-12, 1e-12);
        follows_a_shift(
            &scattered(6)
                .iter()
                .flat_map(|p| [*p, p + near])
                .collect::<Vec<_>>(),
        )
    }),
    (
        "points 1e-12 m apart that part, interpolated",
        "refused or finite",
        torn_apart,
    ),
    ("5,000 points, weighted mean of 8", "translates", many),
    (
        "5,001 points, one interpolation",
        "refused, with the most there may be",
        || refused(&scattered(5001), cubic(), usize::MAX),
    ),
    (
        "a vertex equally far from 8 points, direct",
        "follows the first of them",
        equidistant,
    ),
    (
        "a mirrored configuration",
        "shape matching stays a rotation; an affine rule mirrors",
        mirrored,
    ),
    (
        "one end turned by 180°",
        "finite; the interpolation meets every point",
        half_turn,
    ),
    (
        "flattened to a plane and back",
        "every rule comes back to rest",
        flattened,
    ),
];

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    findings.text("Each case is tried through the engine with all rules that it is said for. Lengths are in edges of the cube that follows.");
    let mut table = Table::new("Cases", ["case", "expected", "got"]);
    for (case, expected, got) in CASES {
        let (holds, figure) = got()?;
        table.row([
            case.into(),
            expected.into(),
            Cell::Verdict { holds, figure },
        ]);
    }
    findings.table(table);
    Ok(findings)
}

fn cubic() -> Rule {
    Rule::RadialBasis(RadialBasis {
        function: RadialFunction::Cubic,
        scale: None,
        polynomial: Polynomial::Linear,
    })
}

/// All rules but the barycentric one, which needs four points that span a volume.
fn rules() -> [Rule; 9] {
    [
        Rule::Direct,
        Rule::Mean,
        Rule::WeightedMean,
        RIGID,
        LINEAR,
        QUADRATIC,
        Rule::MovingLeastSquares(MovingFit::Affine),
        Rule::MovingLeastSquares(MovingFit::Rigid),
        cubic(),
    ]
}

fn cube() -> Grid {
    shapes::hexahedra(5, 5, 5)
}

fn square() -> Vec<Vector3<f64>> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    corners.map(|[x, y]| Vector3::new(x, y, 0.5)).to_vec()
}

/// Vertices at rest, and where a rule moves them when its points move.
fn posed(
    rest: &[Vector3<f64>],
    rule: Rule,
    motion: impl Fn(&Vector3<f64>) -> Vector3<f64>,
) -> Result<(Positions, Positions), Failure> {
    let mut world = build(
        cube(),
        rest,
        worlds::mapping(Filter::KeepK(rest.len()), rule),
    )?;
    let start = world.frame().vertices.clone();
    let now: Vec<_> = rest.iter().map(motion).collect();
    Ok((start, move_to(&mut world, &now).vertices.clone()))
}

fn follows_a_shift(rest: &[Vector3<f64>]) -> Got {
    let shift = Vector3::new(0.4, -1.0, 2.0);
    let mut worst: f64 = 0.0;
    for rule in rules() {
        let (start, posed) = posed(rest, rule, |p| p + shift)?;
        let truth: Vec<_> = start.iter().map(|v| v + shift).collect();
        worst = worst.max(Gap::between(&posed, &truth).max);
    }
    Ok((worst < EXACT, format!("error at most {}", digits(worst))))
}

fn two() -> Got {
    let rest = [Vector3::new(0.2, 0.5, 0.5), Vector3::new(0.8, 0.5, 0.5)];
    let (holds, said) = follows_a_shift(&rest)?;
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 1.0);
    let (start, posed) = posed(&rest, RIGID, |p| turn * p)?;
    let truth: Vec<_> = start.iter().map(|v| turn * v).collect();
    let error = Gap::between(&posed, &truth).max;
    Ok((
        holds && error < EXACT,
        format!("{said}; turned, {}", digits(error)),
    ))
}

fn coplanar() -> Got {
    let turn = Rotation3::from_euler_angles(0.3, 2.0, -1.0);
    let mut worst: f64 = 0.0;
    for rule in [RIGID, LINEAR, QUADRATIC] {
        let (start, posed) = posed(&square(), rule, |p| turn * p)?;
        let truth: Vec<_> = start.iter().map(|v| turn * v).collect();
        worst = worst.max(Gap::between(&posed, &truth).max);
    }
    Ok((worst < EXACT, format!("error at most {}", digits(worst))))
}

fn refused(rest: &[Vector3<f64>], rule: Rule, kept: usize) -> Got {
    let outcome = build(cube(), rest, worlds::mapping(Filter::KeepK(kept), rule));
    Ok(match outcome {
        Ok(_) => (false, "it was taken".to_owned()),
        Err(refusal) => (true, refusal.to_string()),
    })
}

fn torn_apart() -> Got {
    let near = Vector3::new(1e-12, -1e-12, 1e-12);
    let rest: Vec<_> = scattered(6).iter().flat_map(|p| [*p, p + near]).collect();
    let mapping = worlds::mapping(Filter::KeepK(rest.len()), cubic());
    let mut world = match build(cube(), &rest, mapping) {
        Ok(world) => world,
        Err(refusal) => return Ok((true, refusal.to_string())),
    };
    let mut now = rest.clone();
    now[1].x += 0.1;
    let farthest = move_to(&mut world, &now)
        .vertices
        .iter()
        .map(|v| v.norm())
        .fold(0.0, f64::max);
    Ok((
        farthest < 10.0,
        format!("finite, within {} of the origin", digits(farthest)),
    ))
}

fn many() -> Got {
    let rest = scattered(5000);
    let mut world = build(
        cube(),
        &rest,
        worlds::mapping(Filter::KeepK(8), Rule::WeightedMean),
    )?;
    let start = world.frame();
    let shift = Vector3::new(0.4, -1.0, 2.0);
    let now: Vec<_> = rest.iter().map(|p| p + shift).collect();
    let truth: Vec<_> = start.vertices.iter().map(|v| v + shift).collect();
    let error = Gap::between(&move_to(&mut world, &now).vertices, &truth).max;
    Ok((error < EXACT, format!("error at most {}", digits(error))))
}

fn equidistant() -> Got {
    let bit = |i: u32, axis: u32| f64::from(i >> axis & 1);
    let rest: Vec<_> = (0..8)
        .map(|i| Vector3::new(bit(i, 0), bit(i, 1), bit(i, 2)))
        .collect();
    let mut vertices = [0, 1, 2, 4].map(|i: usize| rest[i]).to_vec();
    vertices.push(Vector3::repeat(0.5));
    let mapping = worlds::mapping(Filter::KeepK(1), Rule::Direct);
    let world = build(cloud(vertices), &rest, mapping)?;
    let why = world.explain(4).ok_or("no such vertex")?;
    let followed = why.influences.first().map(|influence| influence.point);
    Ok((
        followed == Some(0),
        followed.map_or("follows none".to_owned(), |point| {
            format!("follows point {point}")
        }),
    ))
}

fn mirrored() -> Got {
    let rest = scattered(12);
    let mirror = Vector3::new(-1.0, 1.0, 1.0);
    let volume = |rule| -> Result<f64, Failure> {
        let (_, posed) = posed(&rest, rule, |p| p.component_mul(&mirror))?;
        let [o, x, y, z] = [0, 1, 6, 36].map(|i| posed[i]);
        Ok(125.0 * (x - o).cross(&(y - o)).dot(&(z - o)))
    };
    let (rigid, affine) = (volume(RIGID)?, volume(LINEAR)?);
    let holds = (rigid - 1.0).abs() < EXACT && (affine + 1.0).abs() < EXACT;
    Ok((
        holds,
        format!("volume {} and {}", digits(rigid), digits(affine)),
    ))
}

fn half_turn() -> Got {
    let rest = scattered(40);
    let twist = |p: &Vector3<f64>| {
        let angle = std::f64::consts::PI * p.z;
        Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * p
    };
    let mut farthest: f64 = 0.0;
    for rule in rules() {
        let (_, posed) = posed(&rest, rule, twist)?;
        farthest = posed.iter().map(|v| v.norm()).fold(farthest, f64::max);
    }
    let now: Vec<_> = rest.iter().map(twist).collect();
    let mut world = build(
        cloud(rest.clone()),
        &rest,
        worlds::mapping(Filter::KeepK(40), cubic()),
    )?;
    let error = Gap::between(&move_to(&mut world, &now).vertices, &now).max;
    let said = format!(
        "within {} of the origin; met to {}",
        digits(farthest),
        digits(error)
    );
    Ok((farthest < 10.0 && error < EXACT, said))
}

fn flattened() -> Got {
    let rest = scattered(40);
    let mut worst: f64 = 0.0;
    for rule in rules().into_iter().chain([Rule::Barycentric]) {
        let mut world = build(cube(), &rest, worlds::mapping(Filter::KeepK(40), rule))?;
        let start = world.frame();
        let flat: Vec<_> = rest.iter().map(|p| Vector3::new(p.x, p.y, 0.5)).collect();
        move_to(&mut world, &flat);
        let back = move_to(&mut world, &rest);
        worst = worst.max(Gap::between(&back.vertices, &start.vertices).max);
    }
    Ok((worst < EXACT, format!("error at most {}", digits(worst))))
}
