//! What the clock makes of scripted packets.

use sinew_capture::{Clock, Delay, Exchange};

/// Uniform numbers in (0, 1), always the same.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Exponential of this mean: what queues do to packets.
    fn wait(&mut self, mean: f64) -> f64 {
        -mean * self.next().ln()
    }
}

const OFFSET: f64 = 1_700_000_000.25;

fn ours(source: f64, skew: f64) -> f64 {
    OFFSET + source * (1.0 + skew)
}

fn source(ours: f64, skew: f64) -> f64 {
    (ours - OFFSET) / (1.0 + skew)
}

/// Ten pings a second for `seconds`, each way 0.2 ms and a random wait; and how far off the clock was after the first five
/// seconds.
fn pinged(seconds: u32, skew: f64, jitter: f64, seed: u64) -> (Clock, f64) {
    let mut chance = Chance(seed);
    let mut clock = Clock::default();
    let mut worst: f64 = 0.0;
    for ping in 0..10 * seconds {
        let sent = 4000.0 + f64::from(ping) * 0.1;
        let received = ours(sent, skew) + 2e-4 + chance.wait(jitter);
        let answered = received + 5e-5;
        let back = answered + 2e-4 + chance.wait(jitter);
        clock.exchange(Exchange {
            sent,
            received,
            answered,
            returned: source(back, skew),
        });
        if ping >= 50 {
            worst = worst.max((clock.to_ours(sent) - ours(sent, skew)).abs());
        }
    }
    (clock, worst)
}

#[test]
fn under_jitter_and_skew_the_clock_is_within_a_millisecond_after_five_seconds() {
    for seed in 1..8 {
        for skew in [-2e-4, 0.0, 2e-4] {
            for jitter in [1e-4, 1e-3, 5e-3] {
                let (_, worst) = pinged(30, skew, jitter, seed);
                assert!(worst < 1e-3, "{worst} s at {skew}, {jitter}, seed {seed}");
            }
        }
    }
}

#[test]
fn without_jitter_the_clock_is_exact_and_so_is_its_skew() {
    for skew in [-2e-4, 0.0, 1.5e-4] {
        let (clock, worst) = pinged(10, skew, 1e-12, 7);
        assert!(worst < 1e-6, "{worst}"); // f64 seconds since 1970 end at 2.4e-7
        assert!(
            (clock.skew() - skew).abs() < 1e-6,
            "{} for {skew}",
            clock.skew()
        );
    }
}

#[test]
fn there_and_back_is_the_same_moment() {
    let (clock, _) = pinged(10, 1.5e-4, 1e-3, 3);
    for time in [0.0, 4000.0, 4100.5] {
        let back = clock.to_source(clock.to_ours(time));
        assert!((back - time).abs() < 1e-6, "{back} for {time}");
    }
    assert_eq!(Clock::default().to_source(5.0), 5.0);
}

#[test]
fn of_a_source_that_does_not_ping_the_clock_is_late_by_the_least_delay() {
    let (skew, mut chance, mut clock) = (1e-4, Chance(3), Clock::default());
    for frame in 0..2000 {
        let captured = f64::from(frame) / 120.0;
        let received = ours(captured, skew) + 0.004 + chance.wait(0.002);
        clock.frame(captured, received);
        if frame > 240 {
            let late = clock.to_ours(captured) - ours(captured, skew);
            assert!((0.0035..0.0055).contains(&late), "{late} at {frame}");
        }
    }
}

#[test]
fn the_delay_covers_all_but_one_in_a_hundred_and_falls_again() {
    let (mut chance, mut delay) = (Chance(5), Delay::default());
    let (mut late, mut all) = (0, 0);
    for frame in 0..5000 {
        let lateness = 0.003 + chance.wait(0.004);
        if frame > 512 {
            all += 1;
            late += u32::from(lateness > delay.seconds());
        }
        delay.observe(lateness);
    }
    assert!(late * 100 <= all, "{late} of {all}");
    let before = delay.seconds();
    for _ in 0..1000 {
        delay.observe(0.001);
    }
    assert!(
        delay.seconds() < 0.002 && before > 0.01,
        "{before} → {}",
        delay.seconds()
    );
}
