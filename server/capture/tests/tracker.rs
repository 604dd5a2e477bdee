//! What the tracker makes of markers that vanish, swap and jump.

use nalgebra::{Rotation3, Vector3};
use sinew_capture::{Doubt, Sample, Settings, State, Tracker};

const STEP: f64 = 1.0 / 120.0;

/// Eleven markers, no four of them in a plane through others.
fn rest() -> Vec<Vector3<f64>> {
    (0..11)
        .map(|i| {
            let t = f64::from(i);
            Vector3::new(0.3 * (2.4 * t).cos(), 0.3 * (2.4 * t).sin(), 0.15 * t)
        })
        .collect()
}

/// A body that walks and turns.
fn rigid(rest: &Vector3<f64>, step: u32) -> Vector3<f64> {
    let t = f64::from(step) * STEP;
    let turn = Rotation3::from_euler_angles(0.3 * t.sin(), 0.2 * t, 0.9 * t);
    turn * rest + Vector3::new(1.3 * t, 0.2 * (3.0 * t).sin(), 0.0)
}

/// The same body, bending and breathing.
fn soft(rest: &Vector3<f64>, step: u32) -> Vector3<f64> {
    let t = f64::from(step) * STEP;
    let bent = Rotation3::from_euler_angles(0.2 * rest.z * (5.0 * t).sin(), 0.0, 0.0) * rest;
    rigid(&(bent * (1.0 + 0.05 * (4.0 * t).sin())), step)
}

fn tracker() -> Tracker {
    let rest = rest();
    Tracker::new(&rest, &vec![true; rest.len()], STEP, Settings::default()).expect("good settings")
}

fn sample(motion: impl Fn(&Vector3<f64>, u32) -> Vector3<f64>, step: u32) -> Sample {
    let positions: Vec<_> = rest().iter().map(|rest| motion(rest, step)).collect();
    Sample {
        sequence: u64::from(step),
        time: f64::from(step) * STEP,
        seen: vec![true; positions.len()],
        positions,
    }
}

fn states(tracker: &Tracker) -> Vec<State> {
    tracker.states().collect()
}

fn farthest(shown: &[Vector3<f64>], truth: &[Vector3<f64>]) -> f64 {
    let off = shown.iter().zip(truth).map(|(a, b)| (a - b).norm());
    off.fold(0.0, f64::max)
}

#[test]
fn what_is_seen_is_shown_as_it_is() {
    let mut tracker = tracker();
    for step in 1..300 {
        let sample = sample(soft, step);
        tracker.step(Some(&sample));
        assert_eq!(tracker.positions(), sample.positions);
        assert!(tracker.states().all(|state| state == State::Valid));
        assert!(tracker.doubts().all(|doubt| doubt == Doubt::None));
    }
}

#[test]
fn markers_of_a_rigid_body_are_where_they_would_be_seen_however_long_they_are_not() {
    let mut tracker = tracker();
    for step in 1..1200 {
        let mut sample = sample(rigid, step);
        let truth = sample.positions.clone();
        for hidden in [1, 4, 5, 9] {
            sample.seen[hidden] = step <= 200 || step > 1000;
            if !sample.seen[hidden] {
                sample.positions[hidden] = Vector3::repeat(f64::NAN);
            }
        }
        tracker.step(Some(&sample));
        let off = farthest(tracker.positions(), &truth);
        assert!(off < 1e-9, "{off} m at step {step}");
    }
}

#[test]
fn the_states_follow_the_times_of_the_settings() {
    let mut tracker = tracker();
    let mut seen = Vec::new();
    for step in 1..200 {
        let mut sample = sample(rigid, step);
        sample.seen[3] = !(10..110).contains(&step);
        tracker.step(Some(&sample));
        seen.push(states(&tracker)[3]);
    }
    let count = |state| seen.iter().filter(|s| **s == state).count();
    assert_eq!(count(State::Predicted), 12); // 0.1 s
    assert_eq!(count(State::Lost), 100 - 60); // from 0.5 s on
    assert_eq!(count(State::Held), 48 + 11); // until then, and 0.1 s on the way back
    assert_eq!(seen[8], State::Valid);
    assert_eq!(seen[9], State::Predicted);
    assert_eq!(seen[198], State::Valid);
}

#[test]
fn nothing_jumps_when_markers_blink() {
    let mut tracker = tracker();
    let mut before: Option<Vec<_>> = None;
    let (mut carried, mut frozen, mut last_seen) = (0.0, 0.0, rest());
    for step in 1..2000 {
        let mut sample = sample(soft, step);
        // Each marker blinks in a rhythm of its own, from one frame to two seconds; up to 7 of 11 at once.
        for (i, seen) in (0..).zip(&mut sample.seen) {
            let (period, length) = (97 + 41 * i, 1 + 23 * i);
            *seen = (step + 7 * i) % period < period - length;
        }
        tracker.step(Some(&sample));
        let shown = tracker.positions();
        assert!(shown.iter().all(|p| p.iter().all(|x| x.is_finite())));
        if let Some(before) = before.filter(|_| step > 2) {
            // The body's own fastest marker makes 4 m/s; a way back of 0.1 s may add some.
            let most = farthest(shown, &before) / STEP;
            assert!(most < 12.0, "{most} m/s at step {step}");
        }
        before = Some(shown.to_vec());
        for (i, seen) in sample.seen.iter().enumerate() {
            match seen {
                true => last_seen[i] = sample.positions[i],
                false => {
                    carried += (shown[i] - sample.positions[i]).norm_squared();
                    frozen += (last_seen[i] - sample.positions[i]).norm_squared();
                }
            }
        }
    }
    let gain = (frozen / carried).sqrt();
    assert!(
        gain > 5.0,
        "{gain} times nearer than where they were seen last"
    );
}

#[test]
fn alone_a_marker_goes_on_as_it_went_and_comes_to_rest() {
    let settings = Settings::default();
    let mut tracker = Tracker::new(&[Vector3::zeros()], &[true], STEP, settings).unwrap();
    let at = |step: u32| Vector3::new(2.0 * f64::from(step) * STEP, 0.0, 0.0);
    for step in 1..100 {
        tracker.step(Some(&Sample {
            sequence: u64::from(step),
            time: f64::from(step) * STEP,
            positions: vec![at(step)],
            seen: vec![true],
        }));
    }
    tracker.step(None);
    assert!((tracker.positions()[0] - at(100)).norm() < 1e-9);
    for _ in 0..1000 {
        tracker.step(None);
    }
    let far = (tracker.positions()[0] - at(99)).norm();
    // Speed times the time that it goes on for, and that it dies away in.
    assert!(far < 2.0 * (0.1 + 0.11), "{far}");
}

#[test]
fn markers_under_each_others_names_are_told_apart_at_once() {
    let cycles: [&[usize]; 3] = [&[2, 7], &[0, 4, 8], &[1, 2, 3, 5]];
    for cycle in cycles {
        let mut tracker = tracker();
        for step in 1..400 {
            let mut sample = sample(soft, step);
            let truth = sample.positions.clone();
            if (100..250).contains(&step) {
                for (i, &to) in cycle.iter().enumerate() {
                    sample.positions[to] = truth[cycle[(i + 1) % cycle.len()]];
                }
            }
            tracker.step(Some(&sample));
            assert_eq!(tracker.positions(), truth, "{cycle:?} at {step}");
            let flagged: Vec<_> = (0..truth.len())
                .filter(|&i| tracker.doubts().nth(i) == Some(Doubt::Swap))
                .collect();
            let mut expected = cycle.to_vec();
            expected.sort_unstable();
            let at_once = step == 100 || step == 250;
            assert_eq!(
                flagged,
                if at_once { expected } else { vec![] },
                "at {step}"
            );
        }
    }
}

#[test]
fn a_name_that_goes_over_to_a_hidden_neighbour_is_noticed() {
    let mut tracker = tracker();
    for step in 1..200 {
        let mut sample = sample(soft, step);
        let truth = sample.positions.clone();
        if step >= 100 {
            // Marker 6 is hidden; its place is reported as marker 5's.
            sample.positions[5] = truth[6];
            sample.seen[6] = false;
        }
        tracker.step(Some(&sample));
        assert_eq!(tracker.positions()[6], truth[6], "at {step}");
        assert!((tracker.positions()[5] - truth[5]).norm() < 0.1);
    }
}

#[test]
fn a_marker_that_teleports_is_not_followed_until_it_stays() {
    let mut tracker = tracker();
    let away = Vector3::new(0.0, 3.0, 0.0);
    for step in 1..400 {
        let mut sample = sample(rigid, step);
        let truth = sample.positions.clone();
        if step >= 100 {
            sample.positions[2] += away;
        }
        tracker.step(Some(&sample));
        let off = (tracker.positions()[2] - truth[2]).norm();
        match step {
            ..100 => assert!(off < 1e-12),
            100..220 => {
                assert!(off < 1e-6, "{off} at {step}");
                assert_eq!(tracker.doubts().nth(2), Some(Doubt::Speed));
                assert_ne!(states(&tracker)[2], State::Valid);
            }
            // Believed after a second, and taken over smoothly.
            220..240 => assert!(off < 3.0 + 1e-6),
            _ => assert!((off - 3.0).abs() < 1e-9 && states(&tracker)[2] == State::Valid),
        }
    }
}

#[test]
fn where_all_markers_jump_the_motion_is_cut_and_they_are_followed() {
    let mut tracker = tracker();
    for step in 1..300 {
        let mut sample = sample(rigid, step);
        for position in &mut sample.positions {
            position.y += f64::from(step / 50) * 5.0;
        }
        let truth = sample.positions.clone();
        sample.seen[8] = step < 220;
        tracker.step(Some(&sample));
        let off = farthest(tracker.positions(), &truth);
        assert!(off < 1e-9, "{off} at {step}");
        assert!(tracker.doubts().all(|doubt| doubt == Doubt::None));
    }
}

#[test]
fn a_marker_without_a_place_at_rest_is_never_anywhere() {
    let rest = rest();
    let mut present = vec![true; rest.len()];
    present[4] = false;
    let mut tracker = Tracker::new(&rest, &present, STEP, Settings::default()).unwrap();
    for step in 1..50 {
        tracker.step(Some(&sample(rigid, step)));
        assert_eq!(tracker.positions()[4], rest[4]);
        assert_eq!(states(&tracker)[4], State::Absent);
    }
}

#[test]
fn where_all_is_believed_jumps_and_swaps_are_shown_as_they_come() {
    let rest = rest();
    let all = Settings {
        max_speed_change: f64::INFINITY,
        ..Settings::default()
    };
    let mut tracker = Tracker::new(&rest, &vec![true; rest.len()], STEP, all).unwrap();
    for step in 1..50 {
        let mut sample = sample(rigid, step);
        if step % 10 == 0 {
            sample.positions.swap(2, 7);
            sample.positions[4].y += 50.0;
        }
        tracker.step(Some(&sample));
        assert_eq!(tracker.positions(), sample.positions);
        assert!(tracker.states().all(|state| state == State::Valid));
    }
}

#[test]
fn settings_that_are_none_are_refused_by_name() {
    let late = Settings {
        release_seconds: 0.05,
        ..Settings::default()
    };
    let error = Tracker::new(&[], &[], STEP, late).unwrap_err();
    assert_eq!(
        (error.field, error.value, error.least),
        ("release_seconds", 0.05, 0.1)
    );
}

/// The same number always, below `most`.
fn chance(seed: u32, most: u32) -> u32 {
    let mixed = (u64::from(seed) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (mixed >> 32) as u32 % most
}

/// Each marker is hidden in each step by chance: few are seen twice running, and in some steps none is.
#[test]
fn markers_that_flicker_are_far_nearer_than_where_they_were_seen_last() {
    for (percent, most) in [(20, 0.01), (40, 0.02), (60, 0.05)] {
        for motion in [rigid, soft] {
            let mut tracker = tracker();
            let (mut worst, mut carried, mut held, mut last_seen) = (0.0_f64, 0.0, 0.0, rest());
            for step in 1..2000 {
                let mut sample = sample(motion, step);
                let truth = sample.positions.clone();
                for (i, seen) in (0..).zip(&mut sample.seen) {
                    *seen = step < 10 || chance(step * 11 + i, 100) >= percent;
                }
                tracker.step(Some(&sample));
                let shown = tracker.positions();
                worst = worst.max(farthest(shown, &truth));
                for (i, seen) in sample.seen.iter().enumerate() {
                    match seen {
                        true => last_seen[i] = truth[i],
                        false => {
                            carried += (shown[i] - truth[i]).norm_squared();
                            held += (last_seen[i] - truth[i]).norm_squared();
                        }
                    }
                }
            }
            let gain = (held / carried).sqrt();
            println!("{percent} %: {worst} m at most, {gain} times nearer");
            assert!(worst < most, "{worst} m at {percent} %");
            assert!(gain > 15.0, "{gain} at {percent} %");
        }
    }
}

#[test]
fn a_marker_that_was_never_seen_is_where_it_rests_among_the_others() {
    let corner = |i: u32| Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let rest: Vec<_> = (0..8).map(corner).collect();
    for hidden in 0..8 {
        let settings = Settings::default();
        let mut tracker = Tracker::new(&rest, &[true; 8], STEP, settings).expect("good settings");
        for step in 1..4 {
            let mut seen = vec![true; 8];
            seen[hidden] = false;
            tracker.step(Some(&Sample {
                sequence: step,
                time: step as f64 * STEP,
                positions: rest.clone(),
                seen,
            }));
            let off = tracker.positions()[hidden] - rest[hidden];
            assert_eq!(off, Vector3::zeros(), "{hidden} at {step}");
        }
    }
}
