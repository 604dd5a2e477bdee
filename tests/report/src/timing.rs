//! Times on a machine that drifts.

use std::time::Instant;

use cpu_time::{ProcessTime, ThreadTime};
use serde::Serialize;

/// Rounds at most: beyond, a median hardly changes.
const ROUNDS: usize = 31;
/// Rounds at least, so that quartiles mean something.
const LEAST: usize = 5;

/// A median with its quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Spread {
    pub(crate) low: f64,
    pub(crate) median: f64,
    pub(crate) high: f64,
    pub(crate) samples: usize,
}

impl Spread {
    /// Of at least one sample.
    pub(crate) fn of(samples: &[f64]) -> Self {
        let mut sorted = samples.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |quarter: usize| sorted[quarter * (sorted.len() - 1) / 4];
        Self {
            low: at(1),
            median: at(2),
            high: at(3),
            samples: sorted.len(),
        }
    }

    /// Of the quotients round by round: what both had to bear in a round cancels.
    pub(crate) fn of_ratio(over: &[f64], under: &[f64]) -> Self {
        let quotients: Vec<f64> = over.iter().zip(under).map(|(a, b)| a / b).collect();
        Self::of(&quotients)
    }

    /// The same in another unit.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            low: self.low * factor,
            median: self.median * factor,
            high: self.high * factor,
            samples: self.samples,
        }
    }

    /// Whether the middle half of the samples lies so far apart that the median says little.
    pub(crate) fn is_noisy(self) -> bool {
        self.high - self.low > 0.25 * self.median
    }
}

/// Seconds of each contender in each round. Every round runs all of them, one after the other, after a round that is not
/// counted; rounds go on until `budget` seconds are spent, at least 5 and at most 31 of them.
pub(crate) fn by_turns(budget: f64, contenders: &mut [&mut dyn FnMut()]) -> Vec<Vec<f64>> {
    for contender in &mut *contenders {
        contender();
    }
    let mut seconds = vec![Vec::new(); contenders.len()];
    let start = Instant::now();
    for round in 0..ROUNDS {
        if round >= LEAST && start.elapsed().as_secs_f64() > budget {
            break;
        }
        for (contender, seconds) in contenders.iter_mut().zip(&mut seconds) {
            seconds.push(time(contender));
        }
    }
    seconds
}

/// Seconds for which some work keeps the processor: what other programs take meanwhile does not count. On the threads of a
/// pool of more than one only what this thread does is seen.
pub(crate) fn time(work: impl FnOnce()) -> f64 {
    let start = ThreadTime::now();
    work();
    start.elapsed().as_secs_f64()
}

/// Seconds for which some work keeps each of so many threads, on average: what other programs take meanwhile does not
/// count.
pub(crate) fn time_per_thread(threads: usize, work: impl FnOnce()) -> f64 {
    let start = ProcessTime::now();
    work();
    #[expect(clippy::cast_precision_loss, reason = "a few threads")]
    let threads = threads as f64;
    start.elapsed().as_secs_f64() / threads
}

/// Seconds of some work on one thread and on two, by turns, by the clock; rounds as in [`by_turns`].
///
/// # Panics
/// If the machine gives no threads.
pub(crate) fn one_and_two(budget: f64, work: &mut (dyn FnMut() + Send)) -> [Vec<f64>; 2] {
    let pools = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a machine with threads")
    });
    let mut seconds = [Vec::new(), Vec::new()];
    pools[0].install(&mut *work);
    let start = Instant::now();
    for round in 0..ROUNDS {
        if round >= LEAST && start.elapsed().as_secs_f64() > budget {
            break;
        }
        for (pool, seconds) in pools.iter().zip(&mut seconds) {
            let start = Instant::now();
            pool.install(&mut *work);
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    seconds
}

/// Runs some work with so many threads, as the engine takes them from the caller's pool.
///
/// # Panics
/// If the machine gives no threads.
pub(crate) fn with_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("a machine with threads")
        .install(work)
}

/// The exponent e of y = c xᵉ that fits best, by least squares of the logarithms.
pub(crate) fn exponent(points: &[(f64, f64)]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a few points")]
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (x, y) = logs
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (x, y) = (x / n, y / n);
    let slope =
        |(over, under), (a, b): &(f64, f64)| (over + (a - x) * (b - y), under + (a - x) * (a - x));
    let (over, under) = logs.iter().fold((0.0, 0.0), slope);
    over / under
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_its_quartiles_and_knows_its_noise() {
        let quiet = Spread::of(&[1.02, 1.0, 1.01, 1.03, 0.99]);
        assert_eq!((quiet.low, quiet.median, quiet.high), (1.0, 1.01, 1.02));
        assert!(!quiet.is_noisy());
        assert!(Spread::of(&[1.0, 2.0, 3.0]).is_noisy());
    }

    #[test]
    fn a_ratio_is_taken_round_by_round() {
        let ratio = Spread::of_ratio(&[2.0, 20.0, 4.0], &[1.0, 10.0, 2.0]);
        assert_eq!((ratio.median, ratio.is_noisy()), (2.0, false));
    }

    #[test]
    fn the_exponent_of_a_power_law_is_found() {
        let points = [1e4, 1e5, 1e6].map(|x: f64| (x, 3.0 * x.powf(1.1)));
        assert!((exponent(&points) - 1.1).abs() < 1e-12);
    }
}
