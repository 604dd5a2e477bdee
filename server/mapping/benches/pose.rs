//! Pose and bind of 100,000 vertices by 40 points, 8 each (interpolations: all), beside a triad (a = b + s c, as in STREAM)
//! that moves as many bytes. All on one thread. The summary at the end takes triad and pose by turns and compares their
//! medians.

use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, Throughput};
use nalgebra::{Rotation3, Vector3};
use sinew_mapping::{
    Binding, Filter, Fit, Polynomial, RadialBasis, RadialFunction, Recipe, Reference, Rule,
    ShapeMatching, Weighting, bind,
};

const VERTICES: usize = 100_000;
const POINTS: usize = 40;
const KEPT: usize = 8;
const ROUNDS: usize = 301;

/// Scattered evenly in the unit cube: the additive recurrence of the plastic number's powers.
fn scattered(n: usize, start: f64) -> Vec<Vector3<f64>> {
    let step = Vector3::new(
        0.819_172_513_396_164,
        0.671_043_606_703_789,
        0.549_700_477_901_97,
    );
    (0..n)
        .map(|i| (step * (start + i as f64)).map(f64::fract))
        .collect()
}

fn recipe(rule: Rule) -> Recipe {
    Recipe {
        weighting: Weighting::default(),
        filter: match rule {
            Rule::RadialBasis(_) => Filter::KeepK(POINTS),
            Rule::Barycentric => Filter::KeepK(4 * KEPT),
            Rule::Direct
            | Rule::Mean
            | Rule::WeightedMean
            | Rule::ShapeMatching(_)
            | Rule::MovingLeastSquares(_) => Filter::KeepK(KEPT),
        },
        rule,
        reference: Reference::Initial,
    }
}

/// Three arrays that together are as many bytes as a pose moves.
struct Triad {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Triad {
    fn moving(bytes: usize) -> Self {
        let n = bytes / (3 * size_of::<f64>());
        Self {
            a: vec![0.0; n],
            b: vec![1.0; n],
            c: vec![2.0; n],
        }
    }

    fn run(&mut self, s: f64) {
        for ((a, b), c) in self.a.iter_mut().zip(&self.b).zip(&self.c) {
            *a = b + s * c;
        }
        black_box(&mut self.a);
    }
}

/// A binding at work: the points turn a little further each time.
struct Bench {
    rest: Vec<Vector3<f64>>,
    now: Vec<Vector3<f64>>,
    out: Vec<Vector3<f64>>,
    binding: Binding,
    angle: f64,
}

impl Bench {
    fn new(rule: Rule) -> Self {
        let rest = scattered(POINTS, 0.5);
        let vertices = scattered(VERTICES, 0.0);
        let binding = bind(&vertices, &rest, &[true; POINTS], &recipe(rule)).expect("sound");
        Self {
            now: rest.clone(),
            rest,
            out: vertices,
            binding,
            angle: 0.0,
        }
    }

    fn run(&mut self) {
        self.angle += 0.01;
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), self.angle);
        for (now, rest) in self.now.iter_mut().zip(&self.rest) {
            *now = turn * rest + Vector3::new(0.0, 0.0, 0.1 * (3.0 * rest.x + self.angle).sin());
        }
        self.binding.pose(&self.now, &mut self.out).expect("bound");
        black_box(&mut self.out);
    }
}

const RULES: [(&str, Rule); 9] = [
    ("direct", Rule::Direct),
    ("mean", Rule::Mean),
    ("weighted mean", Rule::WeightedMean),
    ("barycentric", Rule::Barycentric),
    (
        "shape, rigid",
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
    ),
    (
        "shape, linear",
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 1.0 })),
    ),
    (
        "shape, quadratic",
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 1.0 })),
    ),
    ("rbf, cubic", interpolation(RadialFunction::Cubic)),
    ("rbf, Gaussian", interpolation(RadialFunction::Gaussian)),
];

const fn interpolation(function: RadialFunction) -> Rule {
    Rule::RadialBasis(RadialBasis {
        function,
        scale: None,
        polynomial: Polynomial::Linear,
    })
}

fn measure(criterion: &mut Criterion) {
    let rest = scattered(POINTS, 0.5);
    let vertices = scattered(VERTICES, 0.0);
    for (name, rule) in RULES {
        let mut bench = Bench::new(rule);
        let bytes = bench.binding.bytes();
        let mut triad = Triad::moving(bytes);
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Bytes(bytes as u64));
        group.bench_function("triad", |b| b.iter(|| triad.run(black_box(0.5))));
        group.bench_function("pose", |b| b.iter(|| bench.run()));
        group.throughput(Throughput::Elements(VERTICES as u64));
        group.sample_size(10);
        group.bench_function("bind", |b| {
            b.iter(|| bind(&vertices, &rest, &[true; POINTS], &recipe(rule)));
        });
        group.finish();
    }
}

fn summarise() {
    println!(
        "\n{VERTICES} vertices, {POINTS} points, {KEPT} each, one thread, medians of {ROUNDS}:"
    );
    for (name, rule) in RULES {
        let mut bench = Bench::new(rule);
        let bytes = bench.binding.bytes();
        let mut triad = Triad::moving(bytes);
        let (mut poses, mut triads) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            triads.push(seconds(|| triad.run(black_box(0.5))));
            poses.push(seconds(|| bench.run()));
        }
        let (pose, triad) = (median(poses), median(triads));
        let rate = |seconds: f64| bytes as f64 / seconds / 1e9;
        println!(
            "{name:>16}: {:.2} MB, {} clusters; pose {:.2} ns a vertex = {:.1} GB/s, triad {:.2} ns = {:.1} GB/s: {:.0} %",
            bytes as f64 / 1e6,
            bench.binding.rotations().len(),
            pose * 1e9 / VERTICES as f64,
            rate(pose),
            triad * 1e9 / VERTICES as f64,
            rate(triad),
            100.0 * triad / pose,
        );
    }
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    one.install(|| {
        let mut criterion = Criterion::default().configure_from_args();
        measure(&mut criterion);
        criterion.final_summary();
        // Not when a test runner asks what there is, or whether it runs at all.
        if std::env::args().any(|argument| argument == "--bench") {
            summarise();
        }
    });
}
