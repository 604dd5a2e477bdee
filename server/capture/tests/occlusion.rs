//! How far markers that are not seen are from where they are: on a real walk, seen whole, that loses samples by chance.

use std::path::Path;

use nalgebra::Vector3;
use sinew_capture::{Buffer, Doubt, Sample, Settings, Tracker};
use sinew_formats::take::{self, Options, Take};

const SHARES: [u32; 7] = [5, 10, 20, 30, 40, 50, 60];

fn walk() -> Take {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../client/formats/tests/data/take/cmu_02_01.c3d");
    take::read(path, &Options::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Uniform numbers in [0, 1), always the same.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// What is seen of a take where markers vanish for `length` frames on average, and are hidden for `percent` of all.
fn seen(take: &Take, percent: u32, length: u32) -> Vec<Vec<bool>> {
    let share = f64::from(percent) / 100.0;
    let returns = f64::from(length).recip().min(1.0 - share);
    let vanishes = returns * share / (1.0 - share);
    let mut chance = Chance(u64::from(percent) << 8 | u64::from(length));
    let mut now = vec![true; take.labels().len()];
    let whole = 30..take.frames() - 30;
    let mut step = |frame: usize| -> Vec<bool> {
        for seen in &mut now {
            let change = if *seen { vanishes } else { returns };
            *seen = (*seen != (chance.next() < change)) || !whole.contains(&frame);
        }
        now.clone()
    };
    (0..take.frames()).map(&mut step).collect()
}

/// Root mean squares over all hidden samples, m: by the tracker, and where each marker was seen last.
struct Errors {
    ours: f64,
    hold: f64,
}

/// * `ahead` - how many frames are here when one is due.
fn play(take: &Take, seen: &[Vec<bool>], ahead: usize) -> Errors {
    let reference = take.reference();
    let present: Vec<bool> = reference.absent.iter().map(|absent| !absent).collect();
    let step = take.rate_hz().recip();
    let mut tracker = Tracker::new(&reference.positions, &present, step, Settings::default())
        .expect("good settings");
    let mut buffer = Buffer::new(64, 0.05, tracker.settings().max_speed_change);
    let sample = |frame: usize| Sample {
        sequence: frame as u64,
        time: frame as f64 * step,
        positions: (take.frame(frame).0.iter().zip(&seen[frame]))
            .map(|(place, seen)| {
                if *seen {
                    *place
                } else {
                    Vector3::repeat(f64::NAN)
                }
            })
            .collect(),
        seen: seen[frame].clone(),
    };
    let (mut ours, mut hold, mut hidden) = (0.0, 0.0, 0_u32);
    let mut last = reference.positions.clone();
    let mut came = 0;
    for (frame, seen) in seen.iter().enumerate() {
        while came < take.frames().min(frame + ahead + 1) {
            buffer.insert(sample(came));
            came += 1;
        }
        tracker.step(buffer.at(frame as f64 * step).as_ref());
        assert!(
            tracker.doubts().all(|doubt| doubt == Doubt::None),
            "{frame}"
        );
        for (i, truth) in take.frame(frame).0.iter().enumerate() {
            match seen[i] {
                true => last[i] = *truth,
                false => {
                    ours += (tracker.positions()[i] - truth).norm_squared();
                    hold += (last[i] - truth).norm_squared();
                    hidden += 1;
                }
            }
        }
    }
    let rms = |sum: f64| (sum / f64::from(hidden)).sqrt();
    Errors {
        ours: rms(ours),
        hold: rms(hold),
    }
}

#[test]
fn hidden_markers_are_far_nearer_than_where_they_were_seen_last() {
    let take = walk();
    for length in [1, 3, 10, 30] {
        for percent in SHARES {
            let Errors { ours, hold } = play(&take, &seen(&take, percent, length), 0);
            println!("{length} frames, {percent} %: {ours} m, hold {hold} m");
            assert!(4.0 * ours < hold, "{ours} m, hold {hold} m");
        }
    }
}

#[test]
fn markers_that_flicker_are_on_their_lines_where_frames_wait() {
    let take = walk();
    for percent in SHARES {
        let seen = seen(&take, percent, 1);
        let errors = [0, 1, 3, 6].map(|ahead| play(&take, &seen, ahead).ours);
        println!("{percent} %: {errors:?} m");
        assert!(errors[3] < errors[0], "{errors:?}");
        assert!(percent > 20 || errors[2] < 1e-3, "{errors:?}");
    }
}
