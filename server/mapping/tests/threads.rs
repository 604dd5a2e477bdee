//! The same bits for any number of threads.

use nalgebra::{Rotation3, Vector3};
use sinew_mapping::{
    Filter, Fit, MovingFit, Polynomial, RadialBasis, RadialFunction, Recipe, Reference, Rule,
    ShapeMatching, Weighting, bind,
};

fn scattered(n: usize) -> Vec<Vector3<f64>> {
    let step = Vector3::new(0.819_172_513, 0.671_043_606, 0.549_700_477);
    (0..n).map(|i| (step * i as f64).map(f64::fract)).collect()
}

#[test]
fn bound_and_posed_bits_do_not_depend_on_the_number_of_threads() {
    let (vertices, points) = (scattered(40_000), scattered(60));
    let basis = |function| {
        Rule::RadialBasis(RadialBasis {
            function,
            scale: None,
            polynomial: Polynomial::Linear,
        })
    };
    let rules = [
        Rule::Direct,
        Rule::Mean,
        Rule::WeightedMean,
        Rule::Barycentric,
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Rigid)),
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Linear { beta: 0.9 })),
        Rule::ShapeMatching(ShapeMatching::alike(Fit::Quadratic { beta: 0.9 })),
        Rule::MovingLeastSquares(MovingFit::Affine),
        Rule::MovingLeastSquares(MovingFit::Rigid),
        basis(RadialFunction::Cubic),
    ];
    let references = [Reference::Initial, Reference::Previous];
    let filtered = (rules.into_iter().map(|rule| (rule, Filter::KeepK(12))))
        .chain([(basis(RadialFunction::Cubic), Filter::KeepK(60))]);
    for ((rule, filter), reference) in
        filtered.flat_map(|rule| references.map(|r| (rule.clone(), r)))
    {
        let recipe = Recipe {
            weighting: Weighting::default(),
            filter,
            rule,
            reference,
        };
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let mut binding = bind(&vertices, &points, &[true; 60], &recipe).unwrap();
                let mut out = vec![Vector3::zeros(); vertices.len()];
                for frame in 0..3 {
                    let turn = Rotation3::from_euler_angles(0.3, 0.2 * f64::from(frame), -0.5);
                    let bend = |p: &Vector3<f64>| turn * p + Vector3::new(p.y * p.y, 0.0, 0.1);
                    let now: Vec<_> = points.iter().map(bend).collect();
                    binding.pose(&now, &mut out).unwrap();
                }
                let bits = |x: &Vector3<f64>| x.data.0[0].map(f64::to_bits);
                out.iter().map(bits).collect::<Vec<_>>()
            })
        };
        let alone = run(1);
        assert_eq!(alone, run(2));
        assert_eq!(alone, run(8));
    }
}
