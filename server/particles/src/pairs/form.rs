//! Potentials of two bodies' orientations: forces and torques are their gradients, the weight included.

use nalgebra::{Matrix3, Vector3};

/// How strong each potential is; a body's normal is its x axis, the axis out of its plane its z axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Of form: neighbours lie on a circle of the bodies' curvature. `[P25]`
    pub form: f64,
    /// Of co-planarity: neighbours lie in the plane of the x and y axes. `[P26]`
    pub coplanarity: f64,
    /// Of co-normality: normals are parallel. `[P27]`
    pub conormality: f64,
    /// Of co-circularity: neighbours lie on some common circle. `[P28]`
    pub cocircularity: f64,
    /// Curvature of each body, 1/m, along its y and along its z axis; positive where its surface bends away from the
    /// normal. Equal ones mean the same in every direction. `[P29]`
    pub curvatures: Vec<[f64; 2]>,
    /// How the potentials fall with distance.
    pub weighting: Weighting,
    /// Whether all but co-normality are divided by the squared distance.
    pub normalisation: Normalisation,
    /// What forces are made of.
    pub gradient: Gradient,
}

/// A weight that falls with the distance r. `[P24]`
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Weighting {
    /// 1
    #[default]
    One,
    /// exp(−r²/2a²)
    Gaussian {
        /// a, m.
        width: f64,
    },
    /// (1 − r/a)⁴ (4 r/a + 1), 0 from a on.
    Wendland {
        /// a, m.
        reach: f64,
    },
}

/// What potentials are divided by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Normalisation {
    /// The squared distance, save for co-normality: strengths are then energies.
    #[default]
    SquaredDistance,
    /// Nothing.
    None,
}

/// What forces are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gradient {
    /// The whole gradient: energy is conserved.
    #[default]
    Whole,
    /// The gradient but for that of the weight, as the paper has it: energy grows without friction.
    WithoutWeight,
}

/// A pair as its potentials see it.
pub(crate) struct Pair<'a> {
    /// From the first to the second, m, not zero.
    pub(crate) r: Vector3<f64>,
    pub(crate) length: f64,
    /// World from body.
    pub(crate) frames: [&'a Matrix3<f64>; 2],
    pub(crate) curvatures: [[f64; 2]; 2],
}

/// What a pair does to its second end, and how it turns both.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PairLoad {
    pub(crate) push: Vector3<f64>,
    pub(crate) torques: [Vector3<f64>; 2],
}

/// A potential without its weight, J, and its gradients by `r` and by rotations of both ends.
struct Term {
    value: f64,
    by_r: Vector3<f64>,
    by_turn: [Vector3<f64>; 2],
}

impl Weighting {
    /// The weight and its derivative, 1/m. `[P24]`
    pub(crate) fn at(self, r: f64) -> [f64; 2] {
        match self {
            Self::One => [1.0, 0.0],
            Self::Gaussian { width } => {
                let w = (-0.5 * (r / width).powi(2)).exp();
                [w, -r / (width * width) * w]
            }
            Self::Wendland { reach } if r < reach => {
                let q = r / reach;
                let rest = (1.0 - q).powi(3);
                [rest * (1.0 - q) * (4.0 * q + 1.0), -20.0 * q * rest / reach]
            }
            Self::Wendland { .. } => [0.0, 0.0],
        }
    }
}

impl Form {
    /// Adds the pair's load. `[P23]`
    pub(crate) fn add_load(&self, pair: &Pair, load: &mut PairLoad) {
        let axis = pair.r / pair.length;
        for (strength, weight, term) in self.terms(pair) {
            let [w, slope] = weight.map(|w| strength * w);
            load.push -= term.by_r * w;
            match self.gradient {
                Gradient::Whole => load.push -= axis * (term.value * slope),
                Gradient::WithoutWeight => {}
            }
            for (torque, by_turn) in load.torques.iter_mut().zip(term.by_turn) {
                *torque -= by_turn * w;
            }
        }
    }

    /// J
    pub(crate) fn energy(&self, pair: &Pair) -> f64 {
        let terms = self.terms(pair);
        terms
            .map(|(strength, [w, _], term)| strength * w * term.value)
            .sum()
    }

    /// About the greatest stiffness of a pair that is near rest: N/m, N, N m.
    pub(crate) fn stiffness(&self, pair: &Pair) -> [f64; 3] {
        let [w, _] = self.weight(pair.length);
        let [plain, _] = self.weighting.at(pair.length);
        let r = pair.length;
        let greatest = |kappa: [f64; 2]| kappa[0].abs().max(kappa[1].abs());
        let kappa = 0.5 * (greatest(pair.curvatures[0]) + greatest(pair.curvatures[1]));
        let form = 2.0 * w * self.form;
        let planar = w * (4.0 * self.coplanarity + 8.0 * self.cocircularity);
        [
            form * kappa * kappa + planar,
            form * kappa + planar * r,
            form + planar * r * r + 2.0 * plain * self.conormality,
        ]
    }

    /// The weight of all but co-normality.
    fn weight(&self, r: f64) -> [f64; 2] {
        let [w, slope] = self.weighting.at(r);
        match self.normalisation {
            Normalisation::None => [w, slope],
            Normalisation::SquaredDistance => {
                let inverse = (r * r).recip();
                [w * inverse, (slope - 2.0 * w / r) * inverse]
            }
        }
    }

    /// The potentials that are there, with their strengths and weights.
    fn terms(&self, pair: &Pair) -> impl Iterator<Item = (f64, [f64; 2], Term)> {
        let weight = self.weight(pair.length);
        let plain = self.weighting.at(pair.length);
        let [a, b] = pair.frames;
        let axis = |frame: &Matrix3<f64>, k: usize| frame.column(k).into_owned();
        let normals = [axis(a, 0), axis(b, 0)];
        let planes = [axis(a, 2), axis(b, 2)];
        let r = pair.r;
        let some = |strength: f64, weight: [f64; 2], term: &dyn Fn() -> Term| {
            (strength != 0.0).then(|| (strength, weight, term()))
        };
        [
            some(self.form, weight, &|| form(pair, normals)),
            some(self.coplanarity, weight, &|| coplanarity(r, planes)),
            some(self.conormality, plain, &|| conormality(normals)),
            some(self.cocircularity, weight, &|| cocircularity(r, normals)),
        ]
        .into_iter()
        .flatten()
    }
}

/// `|κ r + n_A − n_B|²`, κ the mean of both curvatures in the direction of r. `[P25]`
fn form(pair: &Pair, [a, b]: [Vector3<f64>; 2]) -> Term {
    let ends = [0, 1].map(|end| curvature(pair.r, pair.frames[end], pair.curvatures[end]));
    let kappa = 0.5 * (ends[0].value + ends[1].value);
    let d = pair.r * kappa + (a - b);
    // Of κ: d(|d|²) = 2 (d·r) dκ
    let bend = d.dot(&pair.r);
    Term {
        value: d.norm_squared(),
        by_r: d * (2.0 * kappa) + (ends[0].by_r + ends[1].by_r) * bend,
        by_turn: [
            a.cross(&d) * 2.0 + ends[0].by_turn * bend,
            b.cross(&d) * -2.0 + ends[1].by_turn * bend,
        ],
    }
}

/// A body's curvature in a direction, 1/m, and its gradients. `[P29]`
struct Curvature {
    value: f64,
    by_r: Vector3<f64>,
    by_turn: Vector3<f64>,
}

/// Part of the squared distance that keeps the direction defined where r is along the normal.
const UPRIGHT: f64 = 1e-4;

fn curvature(r: Vector3<f64>, frame: &Matrix3<f64>, [along_y, along_z]: [f64; 2]) -> Curvature {
    if along_y == along_z {
        return Curvature {
            value: along_y,
            by_r: Vector3::zeros(),
            by_turn: Vector3::zeros(),
        };
    }
    let (y, z) = (frame.column(1).into_owned(), frame.column(2).into_owned());
    let [at_y, at_z] = [y.dot(&r), z.dot(&r)];
    let mean = 0.5 * (along_y + along_z);
    let upright = UPRIGHT * r.norm_squared();
    let square = at_y * at_y + at_z * at_z + upright;
    let value = (along_y * at_y * at_y + along_z * at_z * at_z + mean * upright) / square;
    let [to_y, to_z] = [
        2.0 * at_y * (along_y - value) / square,
        2.0 * at_z * (along_z - value) / square,
    ];
    Curvature {
        value,
        by_r: y * to_y + z * to_z + r * (2.0 * UPRIGHT * (mean - value) / square),
        by_turn: y.cross(&r) * to_y + z.cross(&r) * to_z,
    }
}

/// `(z_A·r)² + (z_B·r)²` `[P26]`
fn coplanarity(r: Vector3<f64>, axes: [Vector3<f64>; 2]) -> Term {
    let heights = axes.map(|axis| axis.dot(&r));
    Term {
        value: heights[0] * heights[0] + heights[1] * heights[1],
        by_r: (axes[0] * heights[0] + axes[1] * heights[1]) * 2.0,
        by_turn: [0, 1].map(|end| axes[end].cross(&r) * (2.0 * heights[end])),
    }
}

/// `|n_A − n_B|²` `[P27]`
fn conormality([a, b]: [Vector3<f64>; 2]) -> Term {
    let turn = a.cross(&b) * 2.0;
    Term {
        value: (a - b).norm_squared(),
        by_r: Vector3::zeros(),
        by_turn: [-turn, turn],
    }
}

/// `((n_A + n_B)·r)²` `[P28]`
fn cocircularity(r: Vector3<f64>, [a, b]: [Vector3<f64>; 2]) -> Term {
    let height = (a + b).dot(&r);
    Term {
        value: height * height,
        by_r: (a + b) * (2.0 * height),
        by_turn: [a, b].map(|normal| normal.cross(&r) * (2.0 * height)),
    }
}
