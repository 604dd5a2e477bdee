//! Frames out of order, twice and late.

use nalgebra::Vector3;
use proptest::prelude::*;
use sinew_capture::{Buffer, Sample, Verdict};

const RATE: f64 = 120.0;

/// A marker at x = t, seen always; a second one seen in every other frame.
fn frame(sequence: u64) -> Sample {
    let time = sequence as f64 / RATE;
    Sample {
        sequence,
        time,
        positions: vec![Vector3::new(time, 0.0, 1.0); 2],
        seen: vec![true, sequence.is_multiple_of(2)],
    }
}

fn buffer() -> Buffer {
    Buffer::new(64, 2.5 / RATE, 12.0)
}

#[test]
fn a_moment_between_two_frames_is_on_the_line_between_them() {
    let mut buffer = buffer();
    for sequence in 1..10 {
        assert_eq!(buffer.insert(frame(sequence)), Verdict::Taken);
    }
    let moment = buffer.at(4.25 / RATE).unwrap();
    assert!((moment.positions[0].x - 4.25 / RATE).abs() < 1e-15);
    assert_eq!(moment.sequence, 4);
    let exact = buffer.at(6.0 / RATE + 1e-9).unwrap();
    assert_eq!(exact.positions, frame(6).positions, "a frame's own moment");
    assert_eq!(exact.seen, [true, true]);
    let near = 7.0 / RATE + 2e-5;
    let moment = buffer.at(near).unwrap();
    assert!((moment.positions[0].x - near).abs() < 1e-15, "its own time");
}

#[test]
fn a_marker_that_blinks_is_on_its_line_where_the_frame_that_sees_it_again_is_here() {
    let mut buffer = buffer();
    for sequence in 1..6 {
        buffer.insert(frame(sequence));
    }
    for moment in [2.5, 3.0, 3.75] {
        let sample = buffer.at(moment / RATE).unwrap();
        assert_eq!(sample.seen, [true, true], "at {moment}");
        assert!((sample.positions[1].x - moment / RATE).abs() < 1e-15);
    }
    assert_eq!(
        buffer.at(4.5 / RATE).unwrap().seen,
        [true, false],
        "frame 6 is not here"
    );
    let hidden = Sample {
        seen: vec![true, false],
        ..frame(6)
    };
    buffer.insert(hidden);
    buffer.insert(frame(7));
    buffer.insert(frame(8));
    assert_eq!(
        buffer.at(5.0 / RATE).unwrap().seen,
        [true, false],
        "too long ago"
    );
}

#[test]
fn nothing_is_made_up_over_a_gap_or_beyond_the_last_frame() {
    let mut buffer = buffer();
    for sequence in [1, 2, 6, 7] {
        buffer.insert(frame(sequence));
    }
    assert_eq!(buffer.at(3.5 / RATE), None);
    assert!(buffer.at(6.5 / RATE).is_some());
    assert_eq!(buffer.at(7.5 / RATE), None);
    assert_eq!(buffer.insert(frame(3)), Verdict::Late);
}

#[test]
fn a_full_buffer_and_a_clock_that_goes_back_are_told() {
    let mut buffer = Buffer::new(2, 1.0, 12.0);
    buffer.insert(frame(1));
    let back = Sample {
        sequence: 2,
        ..frame(1)
    };
    assert_eq!(buffer.insert(back), Verdict::Late);
    buffer.insert(frame(2));
    assert_eq!(buffer.insert(frame(3)), Verdict::Full);
    assert_eq!(buffer.counts().refused, 1);
}

#[test]
fn a_marker_that_jumps_is_never_between_where_it_was_and_where_it_is() {
    let mut buffer = buffer();
    for sequence in 2..8 {
        let mut frame = frame(2 * sequence);
        frame.time = sequence as f64 / RATE;
        frame.positions[0].y = if sequence < 5 { 0.0 } else { 1.0 };
        buffer.insert(frame);
    }
    for (moment, y) in [(4.0, 0.0), (4.3, 0.0), (4.6, 1.0), (5.0, 1.0), (5.5, 1.0)] {
        let sample = buffer.at(moment / RATE).unwrap();
        assert!((sample.positions[0].y - y).abs() < 1e-12, "at {moment}");
    }
}

proptest! {
    /// However frames are shuffled, doubled and lost on the way: what comes out is what a line through those that came in
    /// time says, each frame is counted once, and nothing is out of order.
    #[test]
    fn order_of_arrival_does_not_matter(
        shift in prop::collection::vec(0u64..6, 60),
        lost in prop::collection::vec(prop::bool::weighted(0.1), 60),
    ) {
        let kept: Vec<(u64, u64)> = (1..)
            .zip(shift.iter().zip(&lost))
            .filter_map(|(sequence, (shift, lost))| (!lost).then_some((sequence, *shift)))
            .collect();
        let twice = |&(sequence, shift)| [(sequence + shift, sequence), (sequence + 7, sequence)];
        let mut arrivals: Vec<(u64, u64)> = kept.iter().flat_map(twice).collect();
        arrivals.sort_unstable();
        let mut shuffled = buffer();
        let mut straight = buffer();
        for (sequence, _) in &kept {
            straight.insert(frame(*sequence));
        }
        let mut taken = 0;
        for (_, sequence) in &arrivals {
            let verdict = shuffled.insert(frame(*sequence));
            taken += u64::from(matches!(verdict, Verdict::Taken | Verdict::Reordered));
        }
        let counts = shuffled.counts();
        prop_assert_eq!(counts.received, arrivals.len() as u64);
        prop_assert_eq!(taken + counts.duplicate, counts.received);
        for moment in 0..130 {
            let time = f64::from(moment) * 0.47 / RATE;
            prop_assert_eq!(shuffled.at(time), straight.at(time));
        }
    }
}
