//! Samples of a stream of LSL, protocol 1.10: a tag, perhaps a time, and one number for each channel.

use nalgebra::Vector3;

use super::info::{Format, Markers};
use crate::Frame;

/// The time follows from the one before.
const DEDUCED: u8 = 1;
/// The time is here.
const TRANSMITTED: u8 = 2;

/// Samples that come before a stream's own, with known numbers, by which both sides see that they understand each other.
pub(super) const PATTERNS: [u32; 2] = [4, 2];
const PATTERN_TIME: f64 = 123_456.789;

/// A sample's time, if it has one, and the bytes of its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample<'a> {
    pub(super) time: Option<f64>,
    numbers: &'a [u8],
    format: Format,
}

/// Why bytes are no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unread {
    /// Its end is not here yet.
    Partial,
    /// Its tag is none.
    Tag(u8),
}

/// The first sample in these bytes, and how long it is.
pub(super) fn read(
    bytes: &[u8],
    format: Format,
    channels: usize,
) -> Result<(Sample<'_>, usize), Unread> {
    let tag = *bytes.first().ok_or(Unread::Partial)?;
    let head = match tag {
        DEDUCED => 1,
        TRANSMITTED => 9,
        tag => return Err(Unread::Tag(tag)),
    };
    let length = head + channels * format.bytes();
    let sample = bytes.get(..length).ok_or(Unread::Partial)?;
    let time = sample[1..head].try_into().ok().map(f64::from_le_bytes);
    let sample = Sample {
        time,
        numbers: &sample[head..],
        format,
    };
    Ok((sample, length))
}

impl Sample<'_> {
    fn number(&self, channel: usize) -> f64 {
        let bytes = self.format.bytes();
        self.format
            .read(&self.numbers[channel * bytes..(channel + 1) * bytes])
    }

    /// The points at `time`. One without numbers, or without confidence, is not seen.
    pub(super) fn frame(&self, time: f64, markers: &Markers) -> Frame {
        let mut frame = Frame::unseen(time, markers.labels.len());
        let points = markers.axes.iter().zip(&markers.confidence).enumerate();
        for (point, (axes, confidence)) in points {
            // NaN is no confidence either.
            if confidence.is_none_or(|channel| self.number(channel) > 0.0) {
                frame.see(point, Vector3::from(axes.map(|axis| self.number(axis))), 0);
            }
        }
        frame
    }

    /// Whether it is the test pattern of this number: alternating numbers that count on from one that the format has.
    pub(super) fn is_pattern(&self, pattern: u32) -> bool {
        let first = f64::from(pattern)
            + match self.format {
                Format::F32 => 0.0,
                Format::F64 => 16_777_217.0,
                Format::I32 => 65_537.0,
                Format::I16 => 257.0,
                Format::I8 => 1.0,
                Format::I64 => 2_147_483_649.0,
            };
        let most = match self.format {
            Format::I8 => f64::from(i8::MAX),
            Format::I16 => f64::from(i16::MAX),
            Format::F32 | Format::F64 | Format::I32 | Format::I64 => f64::INFINITY,
        };
        #[expect(
            clippy::cast_precision_loss,
            reason = "there are at most 2^16 channels"
        )]
        let expected = |channel: usize| {
            let value = (channel as f64 + first) % most;
            if channel.is_multiple_of(2) {
                value
            } else {
                -value
            }
        };
        let count = self.numbers.len() / self.format.bytes();
        self.time == Some(PATTERN_TIME) && (0..count).all(|i| self.number(i) == expected(i))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn markers() -> Markers {
        Markers {
            labels: vec!["A".to_owned(), "B".to_owned()],
            axes: vec![[0, 1, 2], [4, 5, 6]],
            confidence: vec![Some(3), None],
            unit_metres: 1.0,
        }
    }

    fn bytes(time: Option<f64>, numbers: &[f32]) -> Vec<u8> {
        let mut bytes = match time {
            None => vec![DEDUCED],
            Some(time) => [&[TRANSMITTED][..], &time.to_le_bytes()].concat(),
        };
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_sample_is_read_once_it_is_whole() {
        let bytes = bytes(Some(1.5), &[1.0, 2.0, 3.0, 1.0, 4.0, f32::NAN, 6.0]);
        for cut in 0..bytes.len() {
            assert_eq!(read(&bytes[..cut], Format::F32, 7), Err(Unread::Partial));
        }
        let (sample, length) = read(&bytes, Format::F32, 7).unwrap();
        assert_eq!((sample.time, length), (Some(1.5), bytes.len()));
        let frame = sample.frame(1.5, &markers());
        assert_eq!(frame.flags, [0, crate::OCCLUDED]);
        assert_eq!(frame.positions[0], Vector3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn a_point_without_confidence_is_not_seen() {
        for confidence in [0.0, -1.0, f32::NAN] {
            let bytes = bytes(None, &[1.0, 2.0, 3.0, confidence, 4.0, 5.0, 6.0]);
            let (sample, _) = read(&bytes, Format::F32, 7).unwrap();
            assert_eq!(sample.time, None);
            assert_eq!(sample.frame(0.0, &markers()).flags, [crate::OCCLUDED, 0]);
        }
    }

    #[test]
    fn the_first_pattern_is_four_five_six_with_signs() {
        let good = bytes(Some(PATTERN_TIME), &[4.0, -5.0, 6.0]);
        let (sample, _) = read(&good, Format::F32, 3).unwrap();
        assert!(sample.is_pattern(4) && !sample.is_pattern(2));
        assert_eq!(read(&[7, 0, 0], Format::F32, 3), Err(Unread::Tag(7)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_sample_or_none(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
            if let Ok((sample, length)) = read(&bytes, Format::F32, 7) {
                prop_assert!(length <= bytes.len());
                let frame = sample.frame(0.0, &markers());
                prop_assert!(frame.positions.iter().flatten().all(|x| x.is_finite()));
            }
        }
    }
}
