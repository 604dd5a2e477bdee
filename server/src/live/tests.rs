//! Scripted networks, and what steps are given through them.

use std::collections::VecDeque;

use super::*;

/// Of frames and of steps, Hz.
const RATE: f64 = 120.0;
const STEP: f64 = 1.0 / 100.0;
/// Faster than the point, m/s.
const LEAP: f64 = 12.0;
/// What the session's clock shows when the source's shows 0, s.
const OFFSET: f64 = 73.25;

/// Uniform numbers in (0, 1), always the same.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = (self.0.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }
}

/// A network with exponential waits of this mean on top of 0.3 ms, s, and a source whose clock runs slow.
struct Wire {
    chance: Chance,
    jitter: f64,
    skew: f64,
}

impl Wire {
    fn ours(&self, source: f64) -> f64 {
        OFFSET + source * (1.0 + self.skew)
    }

    fn wait(&mut self) -> f64 {
        3e-4 - self.jitter * self.chance.next().ln()
    }
}

enum Said {
    Frame(MotionSample),
    Ping(Exchange),
}

/// Where the one point is at a time, m.
fn truth(time: f64) -> f64 {
    (3.0 * time).sin()
}

fn sample(sequence: u64) -> MotionSample {
    let time = sequence as f64 / RATE;
    MotionSample {
        sequence,
        time,
        positions: vec![Vector3::new(truth(time), 0.0, 0.0)],
        seen: vec![true],
    }
}

/// All that a source says in `seconds`, by when it arrives: frames 2 ms after their capture, and pings ten times a
/// second, each known one ping later.
fn said(wire: &mut Wire, seconds: u32, lost: fn(u64) -> bool) -> VecDeque<(f64, Said)> {
    let mut said = Vec::new();
    for ping in 0..10 * seconds {
        let sent = f64::from(ping) * 0.1;
        let received = wire.ours(sent) + wire.wait();
        let returned = (received + wire.wait() - OFFSET) / (1.0 + wire.skew);
        let exchange = Exchange {
            sent,
            received,
            answered: received,
            returned,
        };
        said.push((
            received.max(wire.ours(returned)) + 0.1,
            Said::Ping(exchange),
        ));
    }
    for sequence in (1..=u64::from(seconds) * 120).filter(|sequence| !lost(*sequence)) {
        let arrives = wire.ours(sequence as f64 / RATE) + 2e-3 + wire.wait();
        said.push((arrives, Said::Frame(sample(sequence))));
    }
    said.sort_by(|a, b| a.0.total_cmp(&b.0));
    said.into()
}

fn arrival(sample: MotionSample, received: f64) -> Arrival {
    Arrival {
        sequence: sample.sequence,
        sample,
        received,
        received_nanos: 1,
    }
}

/// Lets time pass: what arrives is taken in, and each step when it is due. The steps by when they were taken.
fn play(live: &mut Live, mut said: VecDeque<(f64, Said)>) -> Vec<(f64, MotionSample)> {
    let mut steps = Vec::new();
    while let Some((arrives, _)) = said.front() {
        match live.due() {
            Some(due) if due < *arrives => {
                let step = live.take(Some(due)).unwrap();
                steps.push((due, step.sample));
            }
            _ => match said.pop_front().unwrap() {
                (received, Said::Frame(sample)) => {
                    live.frame(arrival(sample, received));
                }
                (_, Said::Ping(exchange)) => live.ping(exchange),
            },
        }
    }
    steps
}

fn live() -> Live {
    Live::new(1, 1.0 / RATE, STEP, LEAP)
}

#[test]
fn through_jitter_and_skew_steps_see_what_was_captured_at_their_moments() {
    for skew in [-2e-4, 0.0, 2e-4] {
        for jitter in [1e-4, 1e-3, 5e-3] {
            let mut wire = Wire {
                chance: Chance(11),
                jitter,
                skew,
            };
            let said = said(&mut wire, 30, |_| false);
            let mut live = live();
            let steps = play(&mut live, said);
            let settled: Vec<_> = steps.iter().skip(600).collect();
            assert!(settled.len() > 2300);
            let blind = settled.iter().filter(|(_, s)| !s.seen[0]).count();
            let (mut error, mut clock, mut after) = (0.0_f64, 0.0_f64, 0.0_f64);
            for (at, sample) in &settled {
                if sample.seen[0] {
                    error = error.max((sample.positions[0].x - truth(sample.time)).abs());
                }
                after = after.max(at - wire.ours(sample.time));
            }
            for (_, sample) in &settled[settled.len() - 500..] {
                let off = live.clock.to_ours(sample.time) - wire.ours(sample.time);
                clock = clock.max(off.abs());
            }
            let counts = live.buffer.counts();
            println!(
                "jitter {:.1} ms, skew {:+.0} ppm: late {}, blind steps {blind}, clock off by {:.3} ms, played within {:.1} ms, error {:.4} mm",
                jitter * 1e3,
                skew * 1e6,
                counts.late,
                clock * 1e3,
                after * 1e3,
                error * 1e3
            );
            // A chord of one or two frames on an acceleration of 9 m/s².
            assert!(error < 9.0 * (2.0 / RATE).powi(2) / 8.0 + 1e-12);
            assert!(clock < 1e-3);
            assert!(blind * 100 <= settled.len(), "{blind}");
            // The delay leaves out the slowest of 100 frames: ln 100 mean waits, half as much again for chance.
            assert!(after < 3.5e-3 + 1.0 / RATE + 7.0 * jitter, "{after}");
        }
    }
}

#[test]
fn moments_are_one_step_apart_whatever_the_network_does() {
    let mut wire = Wire {
        chance: Chance(5),
        jitter: 4e-3,
        skew: 1e-4,
    };
    let steps = {
        let said = said(&mut wire, 5, |sequence| sequence % 7 == 0);
        play(&mut live(), said)
    };
    for (k, (_, sample)) in steps.iter().enumerate() {
        assert!((sample.time - (steps[0].1.time + k as f64 * STEP)).abs() < 1e-12);
    }
}

#[test]
fn through_a_gap_steps_go_on_and_see_nothing() {
    let mut wire = Wire {
        chance: Chance(5),
        jitter: 1e-4,
        skew: 0.0,
    };
    let said = said(&mut wire, 4, |sequence| (240..300).contains(&sequence));
    let steps = play(&mut live(), said);
    for (_, sample) in &steps[50..] {
        let gap = 239.0 / RATE + 1e-4..300.0 / RATE - 1e-4;
        assert_eq!(
            sample.seen[0],
            !gap.contains(&sample.time),
            "{}",
            sample.time
        );
    }
}

#[test]
fn after_a_pause_the_session_skips_to_the_present() {
    let mut live = live();
    for sequence in 1..=30 {
        let received = OFFSET + sequence as f64 / RATE;
        live.frame(arrival(sample(sequence), received));
    }
    let due = live.due().unwrap();
    let first = live.take(Some(due)).unwrap().sample.time;
    // Its frames went on, and found no room after a second.
    for sequence in 31..=600 {
        let received = OFFSET + sequence as f64 / RATE;
        live.frame(arrival(sample(sequence), received));
    }
    assert!(live.buffer.counts().refused > 400);
    let now = OFFSET + 5.0;
    let step = live.take(Some(now)).unwrap().sample;
    assert!(
        (step.time - (now - OFFSET - live.wait())).abs() < STEP,
        "{}",
        step.time
    );
    let steps = (step.time - first) / STEP;
    assert!((steps - steps.round()).abs() < 1e-6, "on the same grid");
    assert!(!step.seen[0]);
    // The buffer's frames are past, and there is room again.
    let next = arrival(sample(601), now);
    assert_eq!(live.frame(next), Verdict::Taken);
}

#[test]
fn a_closed_stream_is_played_to_its_last_frame_and_no_further() {
    let mut live = live();
    for sequence in 1..=13 {
        live.frame(arrival(sample(sequence), 1.0));
    }
    live.close();
    assert!(!live.is_over());
    let mut steps = 0;
    while live.due().is_some() {
        assert_eq!(live.waiting(), 11 - steps);
        assert!(live.take(None).unwrap().sample.seen[0]);
        steps += 1;
    }
    // 12 frames apart at 120 Hz are 0.1 s.
    assert_eq!(steps, 11);
    assert!(live.is_over());
}

#[test]
fn how_fast_a_point_is_believed_to_be_says_what_is_a_jump() {
    for (leap, between) in [(12.0, 0.0), (f64::INFINITY, 0.4)] {
        let mut live = Live::new(1, 1.0 / RATE, STEP, leap);
        for sequence in 0..4 {
            let mut sample = sample(sequence);
            sample.positions[0].x = sequence as f64; // 120 m/s
            live.frame(arrival(sample, 0.0));
        }
        let first = live.take(None).unwrap();
        let second = live.take(None).unwrap(); // 1.2 frames later
        assert_eq!(first.sample.positions[0].x, 0.0);
        let x = second.sample.positions[0].x;
        assert!(
            (x - (1.0 + between / 2.0)).abs() < 1e-9,
            "{x} for {leap} m/s"
        );
    }
}
