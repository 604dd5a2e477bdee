//! The experiments of the paper on oriented particles, beside what it claims.

mod clusters;
mod networks;
mod objects;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sinew_particles::{
    Attraction, AttractionLaw, EndingKind, ExternalForce, Form, FrameSpec, Gradient, Integrator,
    Normalisation, PairFriction, PairSpec, Repulsion, System, SystemSpec, Track, Weighting,
    arc_chain,
};

use crate::{
    section::{Cell, Failure, Findings, Section, Table, digits},
    timing::time,
};

pub(crate) const SECTION: Section = Section {
    name: "oriented",
    title: "Oriented particles: the paper’s experiments",
    measure,
};

fn measure() -> Result<Findings, Failure> {
    let mut lab = Lab {
        findings: Findings::default(),
        claims: Table::new(
            "The paper’s claims",
            ["claim of the paper", "found here", "why"],
        ),
        costs: Table::new(
            "Real time of the scenes of both papers: a step over the time that it simulates (the paper: 3; aim: 0.01)",
            ["scene", "bodies", "step, µs", "simulated, ms", "factor"],
        ),
    };
    lab.findings.text(
        "Each experiment of the paper on oriented particles, what it claims of it, and what is found here. Rest length, \
         mass and stiffness are 1 where nothing else is said; O(t) is the paper’s measure of oscillation with the 1/N that \
         its formula lacks.",
    );
    clusters::triangle(&mut lab)?;
    clusters::clusters(&mut lab)?;
    objects::spiral(&mut lab)?;
    objects::hinge(&mut lab)?;
    objects::collision(&mut lab)?;
    gradients(&mut lab)?;
    networks::time(&mut lab)?;
    lab.findings.table(lab.claims);
    lab.findings.table(lab.costs);
    Ok(lab.findings)
}

/// What the experiments have shown so far.
struct Lab {
    findings: Findings,
    claims: Table,
    costs: Table,
}

impl Lab {
    /// Notes a claim, whether it holds, what was found and why.
    fn claim(&mut self, what: &str, holds: bool, figure: String, why: &str) {
        let verdict = Cell::Verdict { holds, figure };
        self.claims.row([what.into(), verdict, why.into()]);
    }

    /// Takes some steps of `dt` seconds and notes what they cost.
    fn time(
        &mut self,
        scene: &str,
        system: &mut System,
        [steps, dt]: [f64; 2],
    ) -> Result<(), Failure> {
        let mut outcome = Ok(());
        let seconds = time(|| outcome = run(system, steps * dt, dt)) / steps;
        outcome?;
        let bodies = system.positions().len();
        self.costs.row([
            scene.into(),
            bodies.to_string().into(),
            (1e6 * seconds).into(),
            (1e3 * dt).into(),
            Cell::Verdict {
                holds: seconds <= 0.01 * dt,
                figure: digits(seconds / dt),
            },
        ]);
        Ok(())
    }
}

/// Takes steps of `dt` for so long, both s.
fn run(system: &mut System, seconds: f64, dt: f64) -> Result<(), Failure> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some thousand steps"
    )]
    let steps = (seconds / dt).round() as usize;
    for _ in 0..steps {
        system.step(dt)?;
    }
    Ok(())
}

fn points(positions: Vec<Vector3<f64>>) -> SystemSpec {
    SystemSpec {
        velocities: vec![Vector3::zeros(); positions.len()],
        masses: vec![1.0; positions.len()],
        positions,
        ..SystemSpec::default()
    }
}

fn attraction(law: AttractionLaw) -> Option<Attraction> {
    Some(Attraction {
        law,
        ending: EndingKind::Shifted,
        table: None,
    })
}

const LENNARD_JONES: AttractionLaw = AttractionLaw::LennardJones {
    stiffness: 1.0,
    rest_length: 1.0,
    exponent: 4,
};

/// Cohesion whose greatest attraction is that of [`LENNARD_JONES`], 1/16.
fn cohesion(sharpness: f64) -> AttractionLaw {
    let shape = |x: f64| (x - 1.0).powi(3) / x * (-sharpness * (x - 1.0).powi(2)).exp();
    let most = (1..4_000).map(|k| shape(1.0 + 1e-3 * f64::from(k)));
    AttractionLaw::Cohesion {
        stiffness: 0.0625 / most.fold(0.0, f64::max),
        rest_length: 1.0,
        sharpness,
    }
}

/// Bodies of these orientations with a moment of 0.1 kg m² about every axis.
fn bodies(orientations: Vec<UnitQuaternion<f64>>) -> Option<FrameSpec> {
    let count = orientations.len();
    Some(FrameSpec {
        orientations,
        spins: vec![Vector3::zeros(); count],
        moments: vec![Vector3::repeat(0.1); count],
        damping: 0.0,
    })
}

fn form(strength: f64, curvatures: Vec<[f64; 2]>, gradient: Gradient) -> Option<Form> {
    Some(Form {
        form: strength,
        coplanarity: strength,
        conormality: 0.0,
        cocircularity: 0.0,
        curvatures,
        weighting: Weighting::Wendland { reach: 3.0 },
        normalisation: Normalisation::SquaredDistance,
        gradient,
    })
}

const FRICTION: Option<PairFriction> = Some(PairFriction {
    sliding: 1.0,
    turning: 0.1,
});

fn repulsion(strength: f64, length: f64) -> Option<Repulsion> {
    Some(Repulsion {
        strength,
        length,
        reach: 3.0,
    })
}

/// A force that grows for 10 s from a start, stays up to an end, and stops.
fn pull(particle: u32, force: Vector3<f64>, [start, end]: [f64; 2]) -> ExternalForce {
    let (times, none) = (vec![start, start + 10.0, end, end + 0.02], Vector3::zeros());
    ExternalForce {
        particle,
        force: Track {
            times,
            values: vec![none, force, force, none],
        },
    }
}

/// How far positions are from others, whichever way these are moved and turned, over their radius of gyration.
fn residual(rest: &[Vector3<f64>], now: &[Vector3<f64>]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a few bodies")]
    let count = rest.len() as f64;
    let middle = |x: &[Vector3<f64>]| x.iter().sum::<Vector3<f64>>() / count;
    let (from, to) = (middle(rest), middle(now));
    let pairs = || rest.iter().zip(now).map(|(a, b)| (a - from, b - to));
    let spread: Matrix3<f64> = pairs().map(|(a, b)| b * a.transpose()).sum();
    let svd = spread.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return f64::NAN;
    };
    let flip = Vector3::new(1.0, 1.0, (u * v).determinant().signum());
    let turn = u * Matrix3::from_diagonal(&flip) * v;
    let gap: f64 = pairs().map(|(a, b)| (b - turn * a).norm_squared()).sum();
    let size: f64 = pairs().map(|(a, _)| a.norm_squared()).sum();
    (gap / size).sqrt()
}

/// Energy over many steps, by whole gradients and by those of the paper.
fn gradients(lab: &mut Lab) -> Result<(), Failure> {
    let curvatures = [0.24, 0.5, 0.8, 0.5];
    let chain = arc_chain(&curvatures, 1.05)?;
    let mut table = Table::new(
        "Energy of a chain of four bodies without friction, velocity Verlet, dt 0.01 s",
        [
            "forces",
            "at the start, J",
            "greatest change within 1,000 steps, J",
            "within 100,000 steps, J",
        ],
    );
    let mut found = Vec::new();
    for (name, gradient) in [
        ("whole gradient", Gradient::Whole),
        (
            "without the weight’s, as the paper has it",
            Gradient::WithoutWeight,
        ),
    ] {
        let mut system = System::new(SystemSpec {
            integrator: Integrator::VelocityVerlet,
            frames: bodies(chain.iter().map(|body| body.rotation).collect()),
            pairs: Some(PairSpec {
                attraction: attraction(LENNARD_JONES),
                form: form(0.5, curvatures.map(|k| [0.8 * k; 2]).to_vec(), gradient),
                bonds: Some(vec![[0, 1], [1, 2], [2, 3]]),
                repulsion: repulsion(20.0, 0.15),
                ..PairSpec::default()
            }),
            ..points(chain.iter().map(|body| body.translation.vector).collect())
        })?;
        let start = system.energy();
        let mut drift = [0.0_f64; 2];
        for step in 1..=100_000 {
            system.step(0.01)?;
            let off = (system.energy() - start).abs();
            if step <= 1_000 {
                drift[0] = drift[0].max(off);
            }
            drift[1] = drift[1].max(off);
        }
        table.row([name.into(), start.into(), drift[0].into(), drift[1].into()]);
        found.push(drift);
    }
    lab.findings.table(table);
    lab.claim("Forces are potentials’ gradients weighted by distance, which is stable",
        found[1][1] < 10.0 * found[0][1],
        format!(
            "energy changes by {} J; with the weight’s own gradient by {} J",
            digits(found[1][1]),
            digits(found[0][1])
        ),
        "Multiplying a gradient by the weight leaves out the weight’s slope: such forces conserve momenta but no energy, and \
         need friction.",
    );
    Ok(())
}
