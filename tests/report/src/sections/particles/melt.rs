//! A Lennard-Jones melt and a network of springs: time against size, and beside LAMMPS.

use nalgebra::Vector3;
use sinew_particles::{
    Attraction, AttractionLaw, Elastic, EndingKind, Integrator, LinkLaw, Links, PairSpec, System,
    SystemSpec,
};

use crate::{
    fields::scattered,
    peers::Peers,
    plot::{Axis, Ink, Plot, Point, Series},
    section::{Cell, Failure, Findings, Table, digits},
    timing::{Spread, exponent, time_per_thread, with_threads},
};

/// Rounds of each measurement.
const ROUNDS: usize = 3;

/// A system that both programs know, in the units of Lennard-Jones.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// 12-6 cut at 2.5, density 0.8442, temperature 1.44, in open space.
    Melt,
    /// A cubic grid with links to 26 neighbours, jittered.
    Springs,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Melt => "Lennard-Jones melt",
            Self::Springs => "springs, 13 per particle",
        }
    }

    fn dt(self) -> f64 {
        match self {
            Self::Melt => 0.005,
            Self::Springs => 0.01,
        }
    }

    /// About as many particles, made here.
    fn system(self, particles: u32) -> Result<System, Failure> {
        let side = |cells: f64| cells.cbrt().round();
        Ok(System::new(match self {
            Self::Melt => {
                let cells = grid(side(f64::from(particles) / 4.0));
                let edge = (4.0_f64 / 0.8442).cbrt();
                let base = [
                    [0.0, 0.0, 0.0],
                    [0.5, 0.5, 0.0],
                    [0.5, 0.0, 0.5],
                    [0.0, 0.5, 0.5],
                ];
                let places = cells
                    .iter()
                    .flat_map(|cell| base.map(|b| (cell + Vector3::from(b)) * edge));
                let places: Vec<_> = places.collect();
                let centred =
                    |x: Vector3<f64>| (x - Vector3::repeat(0.5)) * (12.0_f64 * 1.44).sqrt();
                let velocities = scattered(places.len()).into_iter().map(centred).collect();
                melt(places, velocities)
            }
            Self::Springs => {
                let places = grid(side(f64::from(particles)));
                let links = neighbours(side(f64::from(particles)));
                let lengths = links
                    .iter()
                    .map(|[a, b]| (places[*a as usize] - places[*b as usize]).norm())
                    .collect();
                let noise = scattered(places.len());
                let jitter =
                    |(x, by): (&Vector3<f64>, Vector3<f64>)| x + (by - Vector3::repeat(0.5)) * 0.1;
                springs(
                    places.iter().zip(noise).map(jitter).collect(),
                    links,
                    lengths,
                )
            }
        })?)
    }
}

fn grid(side: f64) -> Vec<Vector3<f64>> {
    let steps = || (0..).map(f64::from).take_while(move |i| *i < side);
    steps()
        .flat_map(|x| steps().flat_map(move |y| steps().map(move |z| Vector3::new(x, y, z))))
        .collect()
}

/// The links of a grid from each particle to those of its 26 neighbours that come after it.
fn neighbours(side: f64) -> Vec<[u32; 2]> {
    #[expect(clippy::cast_possible_truncation, reason = "at most 100")]
    let side = side as i64;
    let steps =
        || (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| [x, y, z])));
    let index = |at: [i64; 3]| {
        let inside = at.iter().all(|c| (0..side).contains(c));
        let index = (at[0] * side + at[1]) * side + at[2];
        u32::try_from(index).ok().filter(|_| inside)
    };
    let mut links = Vec::new();
    for i in 0..side * side * side {
        let at = [i / side / side, i / side % side, i % side];
        for step in steps().filter(|step| *step > [0; 3]) {
            let other = [0, 1, 2].map(|axis| at[axis] + step[axis]);
            links.extend(index(at).zip(index(other)).map(|(a, b)| [a, b]));
        }
    }
    links
}

fn melt(positions: Vec<Vector3<f64>>, velocities: Vec<Vector3<f64>>) -> SystemSpec {
    SystemSpec {
        masses: vec![1.0; positions.len()],
        positions,
        velocities,
        integrator: Integrator::VelocityVerlet,
        pairs: Some(PairSpec {
            attraction: Some(Attraction {
                law: AttractionLaw::TwelveSix {
                    depth: 1.0,
                    size: 1.0,
                },
                ending: EndingKind::Sharp,
                table: None,
            }),
            reach: 2.5,
            skin: Some(0.5),
            ..PairSpec::default()
        }),
        ..SystemSpec::default()
    }
}

fn springs(positions: Vec<Vector3<f64>>, ends: Vec<[u32; 2]>, lengths: Vec<f64>) -> SystemSpec {
    SystemSpec {
        masses: vec![1.0; positions.len()],
        velocities: vec![Vector3::zeros(); positions.len()],
        positions,
        integrator: Integrator::VelocityVerlet,
        links: vec![Links {
            law: LinkLaw::Spring(Elastic {
                stiffness: vec![100.0; ends.len()],
                damping: Vec::new(),
                rest_lengths: Some(lengths),
            }),
            ends,
        }],
        ..SystemSpec::default()
    }
}

/// A melt of about as many particles that is one: no lattice any more.
pub(super) fn stirred(particles: u32) -> Result<System, Failure> {
    let mut system = Kind::Melt.system(particles)?;
    seconds(&mut system, Kind::Melt, 1, 200)?;
    Ok(system)
}

/// Seconds of so many steps.
fn seconds(system: &mut System, kind: Kind, threads: usize, steps: u32) -> Result<f64, Failure> {
    let mut outcome = Ok(());
    let seconds = with_threads(threads, || {
        time_per_thread(threads, || {
            outcome = (0..steps).try_for_each(|_| system.step(kind.dt()));
        })
    });
    outcome?;
    Ok(seconds)
}

pub(super) fn scaling(findings: &mut Findings) -> Result<(), Failure> {
    findings.text(
        "A Lennard-Jones melt (neighbours searched again whenever a particle has moved by half the skin) and a network of \
         springs, velocity Verlet, double precision. The exponent e is that of time = c · particlesᵉ on one thread.",
    );
    let mut table = Table::new(
        "Time against size",
        [
            "system",
            "particles",
            "1 thread, ns per particle and step",
            "2 threads, ns",
            "1 thread over 2",
        ],
    );
    let mut series = Vec::new();
    for (kind, ink) in [(Kind::Melt, Ink::Vermilion), (Kind::Springs, Ink::Blue)] {
        let mut marks = Vec::new();
        for particles in [1_000, 8_000, 32_000, 125_000, 1_000_000] {
            let mut system = kind.system(particles)?;
            let count = f64::from(u32::try_from(system.positions().len())?);
            let steps = (400_000 / particles).clamp(1, 100);
            seconds(&mut system, kind, 1, (2 * steps).min(20))?;
            let mut found = [Vec::new(), Vec::new()];
            for _ in 0..ROUNDS {
                for (threads, found) in (1..).zip(&mut found) {
                    let taken = seconds(&mut system, kind, threads, steps)?;
                    found.push(1e9 * taken / count / f64::from(steps));
                }
            }
            let one = Spread::of(&found[0]);
            table.row([
                kind.name().into(),
                count.to_string().into(),
                one.into(),
                Spread::of(&found[1]).into(),
                Spread::of_ratio(&found[0], &found[1]).into(),
            ]);
            marks.push((count, one.median * count));
        }
        let label = format!("{}: e = {}", kind.name(), digits(exponent(&marks)));
        let point = |&(x, ns): &(f64, f64)| Point {
            x,
            y: 1e-6 * ns,
            note: format!("{x} particles: {} ms", digits(1e-6 * ns)),
        };
        let points = marks.iter().map(point).collect();
        series.push(Series { label, points, ink });
    }
    findings.table(table);
    findings.plot(Plot {
        name: "size".to_owned(),
        title: "A step against the number of particles, one thread".to_owned(),
        x: Axis::new("particles"),
        y: Axis::new("time of a step, ms"),
        series,
    });
    Ok(())
}

/// How LAMMPS is run: what it is called, its arguments, and threads.
const STYLES: [(&str, &[&str], usize); 3] = [
    ("LAMMPS opt", &["-sf", "opt"], 1),
    ("LAMMPS omp", &["-sf", "omp", "-pk", "omp", "1"], 1),
    ("LAMMPS omp", &["-sf", "omp", "-pk", "omp", "2"], 2),
];

impl Kind {
    /// What LAMMPS is told: the same particles, box, potential and step. The melt's lists are made anew every 20 steps,
    /// unchecked, as its benchmark has it; the network has no lists.
    fn script(self, particles: u32, steps: u32) -> String {
        let runs = format!("run {steps}\n").repeat(ROUNDS);
        match self {
            Self::Melt => format!(
                "units lj\natom_style atomic\nboundary s s s\nread_data data/lj_{particles}.data\npair_style lj/cut 2.5\n\
                 pair_modify shift yes\npair_coeff 1 1 1.0 1.0 2.5\nneighbor 0.3 bin\n\
                 neigh_modify delay 0 every 20 check no\nfix 1 all nve\nthermo_style custom step etotal\n\
                 thermo {steps}\nrun 20\n{runs}"
            ),
            Self::Springs => format!(
                "units lj\natom_style bond\nboundary s s s\nnewton on\nread_data data/spr_{particles}.data\n\
                 special_bonds lj/coul 1 1 1\npair_style zero 1.0 nocoeff\npair_coeff * *\ncomm_modify cutoff 3.0\n\
                 bond_style harmonic\nbond_coeff 1 50.0 1.0\nbond_coeff 2 50.0 1.4142135623730951\n\
                 bond_coeff 3 50.0 1.7320508075688772\nneighbor 0.3 bin\n\
                 neigh_modify delay 1000000 every 1000000 check no\nfix 1 all nve\ntimestep 0.01\n\
                 thermo_style custom step etotal\nthermo {steps}\nrun 20\n{runs}"
            ),
        }
    }

    /// The particles that LAMMPS reads.
    fn shared(self, peers: &Peers, particles: u32) -> Result<System, Failure> {
        Ok(System::new(match self {
            Self::Melt => melt(
                peers.positions(&format!("lj_{particles}.x.f64"))?,
                peers.positions(&format!("lj_{particles}.v.f64"))?,
            ),
            Self::Springs => {
                let ends =
                    peers.numbers(&format!("spr_{particles}.bonds.i32"), u32::from_le_bytes)?;
                let (ends, _) = ends.as_chunks::<2>();
                springs(
                    peers.positions(&format!("spr_{particles}.x.f64"))?,
                    ends.to_vec(),
                    peers.numbers(&format!("spr_{particles}.l0.f64"), f64::from_le_bytes)?,
                )
            }
        })?)
    }
}

pub(super) fn beside_lammps(findings: &mut Findings) -> Result<(), Failure> {
    let peers = match Peers::find() {
        Ok(peers) => peers,
        Err(absent) => {
            findings.text(absent);
            return Ok(());
        }
    };
    findings.text(
        "Beside LAMMPS: the same particles, potential, integrator and step, in open space, both in double precision. LAMMPS \
         makes the melt’s lists anew every 20 steps without looking whether that is enough; here a list is never too old. \
         Each style ran once between two rounds of ours. The energies per particle after the first 20 steps agree where both \
         do the same. Times are the processor’s, per thread: what other programs take meanwhile counts for neither, save where \
         LAMMPS’s second thread waits by spinning: with two threads only a quiet machine tells.",
    );
    let mut table = Table::new(
        "Time beside LAMMPS",
        [
            "system, particles",
            "who",
            "threads",
            "ns per particle and step",
            "over ours",
            "energy per particle after 20 steps",
        ],
    );
    let cases = [
        (Kind::Melt, 32_000, 40),
        (Kind::Melt, 256_000, 20),
        (Kind::Springs, 32_768, 100),
        (Kind::Springs, 262_144, 20),
    ];
    for (kind, particles, steps) in cases {
        compare(&mut table, &peers, kind, particles, steps)?;
    }
    findings.table(table);
    Ok(())
}

fn compare(
    table: &mut Table,
    peers: &Peers,
    kind: Kind,
    particles: u32,
    steps: u32,
) -> Result<(), Failure> {
    let mut system = kind.shared(peers, particles)?;
    seconds(&mut system, kind, 1, 20)?;
    let energy = system.energy() / f64::from(particles);
    let unit = 1e9 / f64::from(particles) / f64::from(steps);
    let what = format!("{}, {particles}", kind.name());
    for (name, arguments, threads) in STYLES {
        let mut ours = Vec::new();
        let mut round = |ours: &mut Vec<f64>| -> Result<(), Failure> {
            for _ in 0..ROUNDS {
                ours.push(unit * seconds(&mut system, kind, threads, steps)?);
            }
            Ok(())
        };
        round(&mut ours)?;
        let said = peers.lammps(&kind.script(particles, steps), arguments, threads)?;
        round(&mut ours)?;
        let (ours, theirs) = (Spread::of(&ours), Spread::of(&said.seconds).times(unit));
        let mut row = |who: &str, spread: Spread, over: Cell, energy: f64| {
            table.row([
                what.clone().into(),
                who.into(),
                threads.to_string().into(),
                spread.into(),
                over,
                format!("{energy:.6}").into(),
            ]);
        };
        row("Sinew", ours, "".into(), energy);
        let ratio = theirs.median / ours.median;
        let verdict = Cell::Verdict {
            holds: ratio >= 1.0,
            figure: digits(ratio),
        };
        row(name, theirs, verdict, said.energy);
    }
    Ok(())
}
