//! Where a marker should be, by those around it.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// How many markers speak for one that is not seen.
const MOST: usize = 16;
/// What [`Rotation3::from_matrix_eps`] calls done, rad, and after how many steps it gives up.
const ANGLE: f64 = 1e-12;
const STEPS: usize = 100;
/// Neighbours are in a line where their second extent is less than a fifth of the first, squared.
const SLENDER: f64 = 0.04;
/// Arms this small beside the places that they are told from are their rounding.
const ROUNDING: f64 = 1e-12;

/// The markers nearest to one at rest, and how much each has to say.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    rest: Vector3<f64>,
    /// Index, place at rest, weight 1/d².
    around: Vec<(usize, Vector3<f64>, f64)>,
}

/// A rigid motion of a marker's surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Guess {
    /// Where the marker is if it moved with them.
    pub(crate) position: Vector3<f64>,
    /// How they turned since rest.
    pub(crate) turn: Rotation3<f64>,
}

impl Neighbours {
    /// The nearest present markers of `marker`; ties go to the lower index.
    pub(crate) fn of(marker: usize, rest: &[Vector3<f64>], present: &[bool]) -> Self {
        let squared = |other: usize| (rest[other] - rest[marker]).norm_squared();
        let mut others: Vec<usize> = (0..rest.len())
            .filter(|&other| other != marker && present[other])
            .collect();
        others.sort_by(|&a, &b| squared(a).total_cmp(&squared(b)).then(a.cmp(&b)));
        others.truncate(MOST);
        // Of two markers in one place neither says all.
        let floor = others.last().map_or(1.0, |&far| 1e-4 * squared(far));
        let weight = |other: usize| squared(other).max(floor.max(f64::MIN_POSITIVE)).recip();
        Self {
            rest: rest[marker],
            around: (others.iter())
                .map(|&other| (other, rest[other], weight(other)))
                .collect(),
        }
    }

    /// Which of them are in `usable`, one bit each.
    pub(crate) fn who(&self, usable: &[bool]) -> u16 {
        let bit =
            |(i, &(other, ..)): (usize, &(usize, Vector3<f64>, f64))| u16::from(usable[other]) << i;
        self.around.iter().enumerate().map(bit).sum()
    }

    /// The rigid motion that takes those of `who` from rest to `now`, by weighted least squares (as `[M3]`), and the
    /// marker with it; `None` where `who` is nobody. Where they leave the turn open, it is the one nearest to `last`.
    pub(crate) fn guess(
        &self,
        who: u16,
        now: &[Vector3<f64>],
        last: &Rotation3<f64>,
    ) -> Option<Guess> {
        let chosen = || {
            let mut around = self.around.iter().enumerate();
            std::iter::from_fn(move || around.by_ref().find(|(i, _)| who >> i & 1 == 1))
                .map(|(_, entry)| entry)
        };
        let total: f64 = chosen().map(|(_, _, weight)| weight).sum();
        if total <= 0.0 {
            return None;
        }
        let mean = |place: &dyn Fn(usize, &Vector3<f64>) -> Vector3<f64>| {
            let sum = chosen().map(|(other, rest, weight)| place(*other, rest) * *weight);
            sum.sum::<Vector3<f64>>() / total
        };
        let (centre, centre_rest) = (mean(&|other, _| now[other]), mean(&|_, rest| *rest));
        let arms = chosen().map(|&(other, rest, weight)| {
            (now[other] - centre) * (rest - centre_rest).transpose() * weight
        });
        let spread = chosen().map(|(_, rest, weight)| weight * (rest - centre_rest).norm_squared());
        let nothing = ROUNDING * (spread.sum::<f64>() + total * centre_rest.norm_squared());
        let extent: Matrix3<f64> = chosen()
            .map(|(_, rest, weight)| {
                (rest - centre_rest) * (rest - centre_rest).transpose() * *weight
            })
            .sum();
        let mut axes = extent.symmetric_eigenvalues();
        axes.as_mut_slice().sort_by(f64::total_cmp);
        // Neighbours in a line tell no turn about it.
        let turn = match axes[1] < SLENDER * axes[2] {
            true => *last,
            false => turn(&arms.sum(), nothing, last),
        };
        Some(Guess {
            position: centre + turn * (self.rest - centre_rest),
            turn,
        })
    }
}

/// The rotation R that maximises tr(Rᵀ a), nearest to `last` where that is not one.
///
/// * `nothing` - what is no larger is the rounding of a single place, and turns no way.
fn turn(a: &Matrix3<f64>, nothing: f64, last: &Rotation3<f64>) -> Rotation3<f64> {
    let size = a.norm();
    if size <= nothing || !size.is_normal() {
        return *last;
    }
    Rotation3::from_matrix_eps(&(a / size), ANGLE, STEPS, *last)
}
