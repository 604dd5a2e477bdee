//! Laws of the distance between two particles. A positive force pushes apart.

/// A force along the line between two particles, with a potential.
pub(crate) trait RadialLaw: Sync {
    /// Force, N, at a distance, m, > 0.
    fn force(&self, r: f64) -> f64;
    /// Derivative of the force, N/m.
    fn slope(&self, r: f64) -> f64;
    /// Energy, J, zero at infinity.
    fn energy(&self, r: f64) -> f64;
    /// Distance below which the force stays what it is there, m: a wall that no number is lost at.
    fn core(&self) -> f64;
    /// Force over distance, N/m, at a squared distance, m².
    fn over_distance(&self, square: f64) -> f64 {
        let r = square.sqrt();
        self.force(r) / r
    }
}

impl<L: RadialLaw> RadialLaw for &L {
    fn force(&self, r: f64) -> f64 {
        (**self).force(r)
    }

    fn slope(&self, r: f64) -> f64 {
        (**self).slope(r)
    }

    fn energy(&self, r: f64) -> f64 {
        (**self).energy(r)
    }

    fn core(&self) -> f64 {
        (**self).core()
    }

    fn over_distance(&self, square: f64) -> f64 {
        (**self).over_distance(square)
    }
}

/// Cores, in rest lengths.
const CORE: f64 = 1e-3;

/// `[P18]`, with the exponent n of the attraction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LennardJones {
    pub(crate) stiffness: f64,   // N/m, at rest
    pub(crate) rest_length: f64, // m
    pub(crate) exponent: i32,
}

impl RadialLaw for LennardJones {
    fn force(&self, r: f64) -> f64 {
        let n = f64::from(self.exponent);
        let x = (self.rest_length / r).powi(self.exponent);
        self.stiffness * self.rest_length / n * (x * x - x)
    }

    fn slope(&self, r: f64) -> f64 {
        let x = (self.rest_length / r).powi(self.exponent);
        self.stiffness * self.rest_length / r * (x - 2.0 * x * x)
    }

    fn energy(&self, r: f64) -> f64 {
        let n = f64::from(self.exponent);
        let x = self.rest_length / r;
        let attraction = x.powi(self.exponent - 1) / (n - 1.0);
        let repulsion = x.powi(2 * self.exponent - 1) / (2.0 * n - 1.0);
        self.stiffness * self.rest_length.powi(2) / n * (repulsion - attraction)
    }

    fn core(&self) -> f64 {
        CORE * self.rest_length
    }
}

/// The potential of 12 and 6 of molecular dynamics. `[P19]`
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwelveSix {
    pub(crate) depth: f64, // J
    pub(crate) size: f64,  // m, where the potential is zero
}

impl RadialLaw for TwelveSix {
    fn force(&self, r: f64) -> f64 {
        self.over_distance(r * r) * r
    }

    fn slope(&self, r: f64) -> f64 {
        let x = (self.size / r).powi(6);
        24.0 * self.depth / (r * r) * x * (7.0 - 26.0 * x)
    }

    fn energy(&self, r: f64) -> f64 {
        let x = (self.size / r).powi(6);
        4.0 * self.depth * (x * x - x)
    }

    fn core(&self) -> f64 {
        CORE * self.size
    }

    fn over_distance(&self, square: f64) -> f64 {
        let inverse = square.recip();
        let x = self.size * self.size * inverse;
        let x = x * x * x;
        24.0 * self.depth * inverse * x * (2.0 * x - 1.0)
    }
}

/// The cohesion force, free of scale. `[P20]`
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cohesion {
    pub(crate) stiffness: f64,   // N/m
    pub(crate) rest_length: f64, // m
    pub(crate) sharpness: f64,   // no unit
}

impl Cohesion {
    /// The force over stiffness and rest length, at a distance in rest lengths. `[P20]`
    pub(crate) fn shape(sharpness: f64, x: f64) -> f64 {
        let u = 1.0 - x;
        u * u * u / x * (-sharpness * u * u).exp()
    }

    /// Minus the integral of the shape from infinity.
    pub(crate) fn potential(sharpness: f64, x: f64) -> f64 {
        // In the logarithm of x the integrand has no wall; beyond the end it is below rounding.
        let end = (1.0 + 7.0 / sharpness.sqrt()).max(x).ln();
        let start = x.ln();
        let panels = 96;
        let width = (end - start) / f64::from(panels);
        let integrand = |t: f64| {
            let x = t.exp();
            Self::shape(sharpness, x) * x
        };
        let panel = |k: i32| {
            let middle = start + (f64::from(k) + 0.5) * width;
            let points = GAUSS.iter();
            points
                .map(|&[at, weight]| {
                    let at = 0.5 * at * width;
                    weight * (integrand(middle - at) + integrand(middle + at))
                })
                .sum::<f64>()
        };
        0.5 * width * (0..panels).map(panel).sum::<f64>()
    }
}

/// The positive nodes and the weights of Gauss and Legendre's rule of six points on −1 to 1.
const GAUSS: [[f64; 2]; 3] = [
    [0.238_619_186_083_196_9, 0.467_913_934_572_691_04],
    [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
    [0.932_469_514_203_152, 0.171_324_492_379_170_36],
];

impl RadialLaw for Cohesion {
    fn force(&self, r: f64) -> f64 {
        self.stiffness * self.rest_length * Self::shape(self.sharpness, r / self.rest_length)
    }

    fn slope(&self, r: f64) -> f64 {
        let x = r / self.rest_length;
        let u = 1.0 - x;
        let inner = 2.0 * self.sharpness * u * u * x - 3.0 * x - u;
        self.stiffness * u * u * (-self.sharpness * u * u).exp() * inner / (x * x)
    }

    fn energy(&self, r: f64) -> f64 {
        let x = r / self.rest_length;
        self.stiffness * self.rest_length.powi(2) * Self::potential(self.sharpness, x)
    }

    fn core(&self) -> f64 {
        CORE * self.rest_length
    }
}

/// `[P21]`
#[derive(Clone, Copy, Debug)]
pub(crate) struct Repelling {
    pub(crate) strength: f64, // N
    pub(crate) length: f64,   // m
}

impl RadialLaw for Repelling {
    fn force(&self, r: f64) -> f64 {
        self.strength * (-r / self.length).exp()
    }

    fn slope(&self, r: f64) -> f64 {
        -self.force(r) / self.length
    }

    fn energy(&self, r: f64) -> f64 {
        self.force(r) * self.length
    }

    fn core(&self) -> f64 {
        CORE * self.length
    }
}

/// Any law of the distance alone.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Law {
    LennardJones(LennardJones),
    TwelveSix(TwelveSix),
    Cohesion(Cohesion),
}

impl Law {
    /// Distance from which the law is as good as nothing, m.
    pub(crate) fn range(&self) -> f64 {
        match self {
            Self::LennardJones(law) => 20.0 * law.rest_length,
            Self::TwelveSix(law) => 10.0 * law.size,
            Self::Cohesion(law) => law.rest_length * (1.0 + 7.0 / law.sharpness.sqrt()),
        }
    }
}

impl RadialLaw for Law {
    fn force(&self, r: f64) -> f64 {
        match self {
            Self::LennardJones(law) => law.force(r),
            Self::TwelveSix(law) => law.force(r),
            Self::Cohesion(law) => law.force(r),
        }
    }

    fn slope(&self, r: f64) -> f64 {
        match self {
            Self::LennardJones(law) => law.slope(r),
            Self::TwelveSix(law) => law.slope(r),
            Self::Cohesion(law) => law.slope(r),
        }
    }

    fn energy(&self, r: f64) -> f64 {
        match self {
            Self::LennardJones(law) => law.energy(r),
            Self::TwelveSix(law) => law.energy(r),
            Self::Cohesion(law) => law.energy(r),
        }
    }

    fn core(&self) -> f64 {
        match self {
            Self::LennardJones(law) => law.core(),
            Self::TwelveSix(law) => law.core(),
            Self::Cohesion(law) => law.core(),
        }
    }
}

/// A law that ends at a distance.
#[derive(Clone, Debug)]
pub(crate) struct Ending<L> {
    pub(crate) law: L,
    /// m; infinite where the law does not end.
    pub(crate) reach: f64,
    /// What is taken off the force, N: with the force at the reach it ends without a jump.
    shift: f64,
    /// Distance that pairs have at least, m.
    pub(crate) core: f64,
}

impl<L: RadialLaw> Ending<L> {
    /// A law whose force jumps to zero at its reach.
    pub(crate) fn sharp(law: L, reach: f64) -> Self {
        Self {
            core: law.core(),
            reach,
            shift: 0.0,
            law,
        }
    }

    /// A law whose force is moved so that it ends without a jump.
    pub(crate) fn shifted(law: L, reach: f64) -> Self {
        Self {
            shift: law.force(reach),
            ..Self::sharp(law, reach)
        }
    }

    /// The same ending of a law that stands for this one.
    pub(crate) fn of<M>(&self, law: M) -> Ending<M> {
        Ending {
            law,
            reach: self.reach,
            shift: self.shift,
            core: self.core,
        }
    }

    /// Force over distance, N/m, at a squared distance from core to reach, m².
    pub(crate) fn over_distance(&self, square: f64) -> f64 {
        let whole = self.law.over_distance(square);
        if self.shift == 0.0 {
            whole
        } else {
            whole - self.shift / square.sqrt()
        }
    }

    /// Turns squared distances from core to reach, m², into force over distance, N/m.
    pub(crate) fn weigh(&self, squares: &mut [f64]) {
        // One loop for either ending, so that the processor's wide arithmetic serves both.
        if self.shift == 0.0 {
            for square in squares {
                *square = self.law.over_distance(*square);
            }
        } else {
            for square in squares {
                *square = self.law.over_distance(*square) - self.shift / square.sqrt();
            }
        }
    }

    /// J, zero at the reach.
    pub(crate) fn energy(&self, r: f64) -> f64 {
        if r >= self.reach {
            return 0.0;
        }
        if r < self.core {
            let force = self.over_distance(self.core * self.core) * self.core;
            return self.energy(self.core) + force * (self.core - r);
        }
        let energy = self.law.energy(r);
        if self.reach == f64::INFINITY {
            energy
        } else {
            energy - self.law.energy(self.reach) - self.shift * (self.reach - r)
        }
    }

    /// The greatest stiffness of a pair at a distance, along it or across, N/m.
    pub(crate) fn stiffness(&self, r: f64) -> f64 {
        if r >= self.reach {
            return 0.0;
        }
        let r = r.max(self.core);
        self.law.slope(r).abs().max(self.over_distance(r * r).abs())
    }
}
