//! Objects of many bodies: that uncoil, fold and collide.

use nalgebra::{UnitQuaternion, Vector3};
use sinew_particles::{AttractionLaw, Gradient, PairSpec, System, SystemSpec, arc_chain};

use super::{
    FRICTION, Lab, attraction, bodies, clusters::packing, form, points, pull, repulsion, residual,
    run,
};
use crate::section::{Cell, Failure, Table, digits};

pub(super) fn spiral(lab: &mut Lab) -> Result<(), Failure> {
    const DT: f64 = 0.02;
    let ratio: f64 = 1.4 / 0.24;
    let curvatures: Vec<f64> = (0..10)
        .map(|i| 0.24 * ratio.powf(f64::from(i) / 9.0))
        .collect();
    let chain = arc_chain(&curvatures, 1.0)?;
    let places: Vec<_> = chain.iter().map(|body| body.translation.vector).collect();
    let along = (places[9] - places[0]).normalize() * 0.4;
    let mut system = System::new(SystemSpec {
        damping: 0.02,
        forces: vec![
            pull(0, -along, [150.0, 210.0]),
            pull(9, along, [150.0, 210.0]),
        ],
        frames: bodies(chain.iter().map(|body| body.rotation).collect()),
        pairs: Some(PairSpec {
            attraction: attraction(AttractionLaw::Cohesion {
                stiffness: 100.0,
                rest_length: 1.0,
                sharpness: 4.0,
            }),
            form: form(
                1.0,
                curvatures.iter().map(|&k| [k; 2]).collect(),
                Gradient::WithoutWeight,
            ),
            friction: FRICTION,
            bonds: Some((0..9).map(|i| [i, i + 1]).collect()),
            repulsion: repulsion(200.0, 0.15),
            ..PairSpec::default()
        }),
        ..points(places)
    })?;
    let ends = |system: &System| (system.positions()[9] - system.positions()[0]).norm();
    lab.time("spiral of ten", &mut system, [7_500.0, DT])?;
    let rest = system.positions().to_vec();
    let mut table = Table::new(
        "A spiral of ten bodies, its ends pulled apart by 0.4 N for 60 s and let go",
        [
            "after the release, s",
            "ends apart, m",
            "residual, rms over radius of gyration",
        ],
    );
    run(&mut system, 60.0, DT)?;
    let (coiled, uncoiled) = ((rest[9] - rest[0]).norm(), ends(&system));
    let mut last = 0.0;
    let mut row = |system: &System, after: f64| {
        last = residual(&rest, system.positions());
        table.row([after.into(), ends(system).into(), last.into()]);
    };
    row(&system, 0.0);
    for (after, more) in [(30.0, 30.0), (60.0, 30.0), (100.0, 40.0), (200.0, 100.0)] {
        run(&mut system, more, DT)?;
        row(&system, after);
    }
    lab.findings.table(table);
    lab.claim("A spiral with a curvature for each body, uncoiled by forces on its ends, comes back to its shape",
        uncoiled > 3.0 * coiled && last < 1e-2,
        format!(
            "ends {} → {} m; residual {} after 200 s",
            digits(coiled),
            digits(uncoiled),
            digits(last)
        ),
        "With bonds, co-planarity and repulsion. The torque as the paper prints it has the wrong sign, and explodes.",
    );
    Ok(())
}

/// Two parts in the plane and the hinge between them.
struct Hinged {
    name: &'static str,
    places: Vec<Vector3<f64>>,
    /// Bodies of each part; the hinge stands between them.
    part: usize,
    /// The first and the last body along each part.
    span: [[usize; 2]; 2],
}

impl Hinged {
    /// Two strips of triangles, one above the line and one below, and the hinge between them on the line.
    fn braced() -> Self {
        let strip = |from: f64, top: f64, side: f64| {
            (0..4).map(f64::from).flat_map(move |k| {
                let height = side * 0.75_f64.sqrt();
                [
                    Vector3::new(from + k, 0.0, 0.0),
                    Vector3::new(top + k, height, 0.0),
                ]
            })
        };
        let hinge = Vector3::new(4.0, 0.0, 0.0);
        let places = (strip(0.0, 0.5, 1.0).chain([hinge])).chain(strip(5.0, 4.5, -1.0));
        Self {
            name: "strips of triangles",
            places: places.collect(),
            part: 8,
            span: [[0, 6], [9, 15]],
        }
    }

    /// All bodies in one line.
    fn rows() -> Self {
        Self {
            name: "single rows",
            places: (0..9)
                .map(|k| Vector3::new(f64::from(k), 0.0, 0.0))
                .collect(),
            part: 4,
            span: [[0, 3], [5, 8]],
        }
    }

    fn system(&self) -> Result<System, Failure> {
        let bodies_of = self.places.len();
        let normal =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let mut kinds = vec![1; bodies_of];
        kinds[self.part] = 0;
        kinds[self.part + 1..].fill(2);
        let end = u32::try_from(self.span[1][1])?;
        Ok(System::new(SystemSpec {
            damping: 0.1,
            fixed: vec![0, 1],
            forces: vec![pull(end, Vector3::new(0.0, 0.1, 0.0), [50.0, 90.0])],
            frames: bodies(vec![normal; bodies_of]),
            pairs: Some(PairSpec {
                attraction: attraction(AttractionLaw::LennardJones {
                    stiffness: 100.0,
                    rest_length: 1.0,
                    exponent: 4,
                }),
                form: form(0.3, vec![[0.0; 2]; bodies_of], Gradient::Whole),
                friction: FRICTION,
                reach: 1.4,
                kinds,
                repulsion: repulsion(20.0, 0.15),
                ..PairSpec::default()
            }),
            ..points(self.places.clone())
        })?)
    }

    /// The angle between the parts, °, and how much each is bent, % of its radius of gyration.
    fn shape(&self, rest: &[Vector3<f64>], x: &[Vector3<f64>]) -> [f64; 3] {
        let [one, two] = self.span.map(|[from, to]| x[to] - x[from]);
        let parts = [0..self.part, self.part + 1..x.len()];
        let [a, b] = parts.map(|part| 100.0 * residual(&rest[part.clone()], &x[part]));
        [one.angle(&two).to_degrees(), a, b]
    }
}

pub(super) fn hinge(lab: &mut Lab) -> Result<(), Failure> {
    const DT: f64 = 0.01;
    let mut table = Table::new(
        "Two parts and the hinge between them, one end pulled aside by 0.1 N for 40 s",
        [
            "parts",
            "t, s",
            "angle between the parts, °",
            "first part bent by, %",
            "second part bent by, %",
        ],
    );
    let mut most = Vec::new();
    for setup in [Hinged::braced(), Hinged::rows()] {
        let mut system = setup.system()?;
        run(&mut system, 50.0, DT)?;
        let rest = system.positions().to_vec();
        for (more, until) in [(10.0, 10.0), (30.0, 40.0), (60.0, 100.0)] {
            run(&mut system, more, DT)?;
            let found = setup.shape(&rest, system.positions());
            if until == 40.0 {
                most.push(found);
            }
            let figures = found.map(Cell::from);
            table.row([setup.name.into(), until.into()].into_iter().chain(figures));
        }
        if setup.part == 8 {
            lab.time("hinged parts", &mut system, [10_000.0, DT])?;
        }
    }
    lab.findings.table(table);
    let (braced, rows) = (most[0], most[1]);
    lab.claim(
        "Parts of one type keep their shape and turn about a hinge that is complete with both",
        braced[0] > 20.0 && braced[1].max(braced[2]) < 3.0,
        format!(
            "braced: turned by {}°, bent by {} %; single rows: bent by {} %",
            digits(braced[0]),
            digits(braced[1].max(braced[2])),
            digits(rows[1].max(rows[2]))
        ),
        "For parts that are braced. In a single row every body is a joint like the hinge: pairs resist bending by their form alone, so that a row bends as its hinge does, and does not keep the shape the paper shows.",
    );
    Ok(())
}

/// Bodies of each of two objects.
const PART: usize = 13;

/// Two objects that fly at each other along x, each at a speed, m/s.
fn facing(positions: Vec<Vector3<f64>>, speed: f64) -> SystemSpec {
    let speeds = [[speed; PART], [-speed; PART]].concat();
    SystemSpec {
        velocities: speeds.into_iter().map(|v| Vector3::x() * v).collect(),
        frames: bodies(vec![UnitQuaternion::identity(); 2 * PART]),
        pairs: Some(PairSpec {
            attraction: attraction(AttractionLaw::LennardJones {
                stiffness: 30.0,
                rest_length: 1.0,
                exponent: 4,
            }),
            friction: FRICTION,
            reach: 1.3,
            objects: [[0; PART], [1; PART]].concat(),
            repulsion: repulsion(50.0, 0.15),
            ..PairSpec::default()
        }),
        ..points(positions)
    }
}

pub(super) fn collision(lab: &mut Lab) -> Result<(), Failure> {
    const DT: f64 = 0.02;
    let first = packing(PART);
    let away = Vector3::new(6.0, 0.3, 0.2);
    let places = first.iter().copied().chain(first.iter().map(|x| x + away));
    let mut relaxed = System::new(facing(places.collect(), 0.0))?;
    run(&mut relaxed, 100.0, DT)?;
    let rest = relaxed.positions().to_vec();
    let mut system = System::new(facing(rest.clone(), 0.25))?;
    let gap = |x: &[Vector3<f64>]| {
        let pairs = x[..PART]
            .iter()
            .flat_map(|a| x[PART..].iter().map(move |b| (a - b).norm()));
        pairs.fold(f64::INFINITY, f64::min)
    };
    let mut nearest = f64::INFINITY;
    for _ in 0..2_500 {
        system.step(DT)?;
        nearest = nearest.min(gap(system.positions()));
    }
    let velocity = |range: std::ops::Range<usize>| {
        system.velocities()[range].iter().sum::<Vector3<f64>>() / 13.0
    };
    let (one, two) = (velocity(0..PART), velocity(PART..2 * PART));
    let shape =
        |part: std::ops::Range<usize>| residual(&rest[part.clone()], &system.positions()[part]);
    let shapes = [shape(0..PART), shape(PART..2 * PART)];
    let mut table = Table::new(
        "Two bodies of 13 fly at each other at 0.5 m/s",
        [
            "nearest approach, m",
            "relative speed after, m/s",
            "momentum lost, N s",
            "residual of the shapes",
        ],
    );
    let lost = (one + two).norm() * 13.0;
    let worst = shapes[0].max(shapes[1]);
    table.row([
        nearest.into(),
        (two - one).x.into(),
        lost.into(),
        worst.into(),
    ]);
    lab.findings.table(table);
    lab.claim(
        "Objects that collide push each other away and keep their shapes",
        (two - one).x > 0.0 && worst < 0.05 && lost < 1e-9,
        format!(
            "bounce; residual {}; momentum kept to {} N s",
            digits(worst),
            digits(lost)
        ),
        "Particles of different objects repel; friction within each takes up part of the motion.",
    );
    lab.time("two objects", &mut system, [5_000.0, DT])
}
