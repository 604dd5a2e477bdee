//! C3D files written byte by byte, to hold what no sample at hand holds.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use nalgebra::Vector3;
use sinew_formats::take::{self, Options, Place, Take, TakeFileError};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Processor {
    Intel = 84,
    Dec = 85,
    Mips = 86,
}

impl Processor {
    const ALL: [Self; 3] = [Self::Intel, Self::Dec, Self::Mips];

    fn word(self, value: u16) -> [u8; 2] {
        match self {
            Self::Intel | Self::Dec => value.to_le_bytes(),
            Self::Mips => value.to_be_bytes(),
        }
    }

    fn float(self, value: f32) -> [u8; 4] {
        match self {
            Self::Intel => value.to_le_bytes(),
            Self::Mips => value.to_be_bytes(),
            Self::Dec => {
                // The exponent's bias is 128 and the fraction begins with 0.1₂: the same bits mean a quarter.
                let [a, b, c, d] = (value * 4.0).to_le_bytes();
                [c, d, a, b]
            }
        }
    }
}

/// A file of one frame type: `samples` are frame-major quadruples of x, y, z and the fourth word.
struct File {
    processor: Processor,
    points: u16,
    analog: u16,
    first: u16,
    last: u16,
    scale: f32,
    groups: Vec<(&'static str, Vec<(&'static str, Array)>)>,
    samples: Vec<[f32; 4]>,
    /// Blocks from 1.
    parameter_block: u8,
    data_block: u16,
}

#[derive(Clone)]
enum Array {
    Text(u8, Vec<String>),
    Words(Vec<u16>),
    Floats(Vec<f32>),
}

impl File {
    /// Two points over two frames, the second point hidden in the second frame.
    fn small(processor: Processor, scale: f32) -> Self {
        let labels = vec!["A".to_owned(), "B".to_owned()];
        Self {
            processor,
            points: 2,
            analog: 3,
            first: 5,
            last: 6,
            scale,
            groups: vec![(
                "POINT",
                vec![
                    ("USED", Array::Words(vec![2])),
                    ("SCALE", Array::Floats(vec![scale])),
                    ("RATE", Array::Floats(vec![100.0])),
                    ("UNITS", Array::Text(2, vec!["mm".into()])),
                    ("LABELS", Array::Text(4, labels)),
                ],
            )],
            samples: vec![
                [10.0, -20.0, 30.0, 0.0],
                [100.0, 200.0, -300.0, 0.0],
                [12.0, -22.0, 32.0, 0.0],
                [7.0, 7.0, 7.0, -1.0],
            ],
            parameter_block: 3,
            data_block: 5,
        }
    }

    fn set(mut self, group: &'static str, name: &'static str, array: Array) -> Self {
        let at = self.groups.iter().position(|(other, _)| *other == group);
        let at = at.unwrap_or_else(|| {
            self.groups.push((group, Vec::new()));
            self.groups.len() - 1
        });
        let members = &mut self.groups[at].1;
        members.retain(|(other, _)| *other != name);
        members.push((name, array));
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; 512 * (usize::from(self.data_block) - 1)];
        let word = |value| self.processor.word(value);
        bytes[0] = self.parameter_block;
        bytes[1] = 0x50;
        for (at, value) in [
            (2, self.points),
            (4, self.analog),
            (6, self.first),
            (8, self.last),
            (16, self.data_block),
            (18, u16::from(self.analog > 0)),
        ] {
            bytes[at..at + 2].copy_from_slice(&word(value));
        }
        bytes[12..16].copy_from_slice(&self.processor.float(self.scale));
        bytes[20..24].copy_from_slice(&self.processor.float(100.0));
        let section = self.section();
        let start = 512 * (usize::from(self.parameter_block) - 1);
        bytes[start..start + section.len()].copy_from_slice(&section);
        for frame in self.samples.chunks(usize::from(self.points).max(1)) {
            for value in frame.iter().flatten() {
                self.push_number(&mut bytes, *value);
            }
            for _ in 0..self.analog {
                self.push_number(&mut bytes, 99.0);
            }
        }
        bytes
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "the samples are small whole numbers"
    )]
    fn push_number(&self, bytes: &mut Vec<u8>, value: f32) {
        if self.scale < 0.0 {
            bytes.extend(self.processor.float(value));
        } else {
            bytes.extend(self.processor.word((value as i16).cast_unsigned()));
        }
    }

    fn section(&self) -> Vec<u8> {
        // A block count of 0, as some programs write it.
        let mut section = vec![1, 0x50, 0, self.processor as u8];
        for ((group, members), id) in self.groups.iter().zip(1_u8..) {
            self.push_record(&mut section, id.wrapping_neg(), group, &[0]);
            for (name, array) in members {
                self.push_record(&mut section, id, name, &self.array(array));
            }
        }
        section.extend([0, 0]);
        section
    }

    fn push_record(&self, section: &mut Vec<u8>, id: u8, name: &str, body: &[u8]) {
        section.extend([u8::try_from(name.len()).unwrap(), id]);
        section.extend(name.as_bytes());
        section.extend(self.processor.word(u16::try_from(body.len() + 2).unwrap()));
        section.extend(body);
    }

    fn array(&self, array: &Array) -> Vec<u8> {
        let count = |len: usize| u8::try_from(len).unwrap();
        let mut body = Vec::new();
        match array {
            Array::Text(length, strings) => {
                body.extend([0xff, 2, *length, count(strings.len())]);
                for string in strings {
                    let padded = format!("{string:0$}", usize::from(*length));
                    body.extend(padded.as_bytes());
                }
            }
            Array::Words(words) => {
                body.extend([2, 1, count(words.len())]);
                words
                    .iter()
                    .for_each(|&value| body.extend(self.processor.word(value)));
            }
            Array::Floats(floats) => {
                body.extend([4, 1, count(floats.len())]);
                floats
                    .iter()
                    .for_each(|&value| body.extend(self.processor.float(value)));
            }
        }
        body.push(0); // no description
        body
    }

    fn parse(&self) -> Result<Take, TakeFileError> {
        take::parse("made.c3d", &self.bytes(), &Options::default())
    }
}

fn refusal(file: &File) -> (Place, String) {
    match file.parse() {
        Err(TakeFileError::Malformed { place, problem, .. }) => (place, problem),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_processor_and_encoding_holds_the_same_take() {
    for processor in Processor::ALL {
        for (scale, step) in [(-1.0, 1.0), (0.5, 0.5)] {
            let take = File::small(processor, scale).parse().unwrap();
            assert_eq!(take.labels(), ["A", "B"]);
            assert_eq!(take.visible(), [true, true, true, false]);
            let expected = [
                Vector3::new(10.0, -20.0, 30.0),
                Vector3::new(100.0, 200.0, -300.0),
                Vector3::new(12.0, -22.0, 32.0),
                Vector3::new(100.0, 200.0, -300.0), // hidden: where it was last seen
            ];
            for (position, millimetres) in take.positions().iter().zip(expected) {
                assert!(
                    (position - millimetres * step * 1e-3).amax() < 1e-12,
                    "{processor:?} {scale}"
                );
            }
            assert_eq!((take.rate_hz(), take.first_time_seconds()), (100.0, 0.04));
            assert_eq!(take.warnings(), [""; 0]);
        }
    }
}

#[test]
fn gaps_are_negative_fourth_words_and_coordinates_that_are_no_numbers() {
    for processor in [Processor::Intel, Processor::Mips] {
        let mut file = File::small(processor, -1.0);
        file.samples[0][1] = f32::NAN;
        file.samples[1][2] = f32::INFINITY;
        file.samples[2][3] = f32::NAN; // the integer −1 in a float's place
        let take = file.parse().unwrap();
        assert_eq!(take.visible(), [false; 4]);
        assert_eq!(take.positions(), [Vector3::zeros(); 4]);
    }
}

#[test]
fn units_of_length_are_honoured_and_the_option_overrides_them() {
    for (unit, metres) in [
        ("mm", 1e-3),
        ("cm", 1e-2),
        ("m", 1.0),
        ("in", 0.0254),
        ("MM", 1e-3),
    ] {
        let units = Array::Text(4, vec![unit.into()]);
        let file = File::small(Processor::Intel, -1.0).set("POINT", "UNITS", units);
        assert!(
            (file.parse().unwrap().positions()[0].x - 10.0 * metres).abs() < 1e-12,
            "{unit}"
        );
        let options = Options {
            unit_scale: Some(2.0),
        };
        let scaled = take::parse("made.c3d", &file.bytes(), &options).unwrap();
        assert_eq!(scaled.positions()[0].x, 20.0);
    }
    let furlongs = Array::Text(4, vec!["fur".into()]);
    let (place, problem) =
        refusal(&File::small(Processor::Intel, -1.0).set("POINT", "UNITS", furlongs));
    assert!(
        matches!(place, Place::Byte(at) if at > 1024) && problem.contains("fur"),
        "{problem}"
    );
}

#[test]
fn more_labels_than_one_parameter_holds_continue_in_the_next() {
    let mut file = File::small(Processor::Intel, 1.0);
    (
        file.points,
        file.analog,
        file.first,
        file.last,
        file.data_block,
    ) = (600, 0, 1, 1, 12);
    file.samples = vec![[1.0, 1.0, 1.0, 0.0]; 600];
    let names =
        |range: std::ops::Range<u32>| Array::Text(4, range.map(|n| format!("M{n}")).collect());
    let file = file
        .set("POINT", "USED", Array::Words(vec![600]))
        .set("POINT", "LABELS", names(0..255))
        .set("POINT", "LABELS2", names(255..510))
        .set("POINT", "LABELS3", names(510..600));
    let take = file.parse().unwrap();
    assert_eq!(take.labels()[599], "M599");
    assert_eq!(take.warnings(), [""; 0]);
}

#[test]
fn missing_and_repeated_labels_are_made_up_with_a_warning() {
    let labels = Array::Text(4, vec!["A".into()]);
    let take = File::small(Processor::Intel, 1.0)
        .set("POINT", "LABELS", labels)
        .parse()
        .unwrap();
    assert_eq!(take.labels(), ["A", "point_2"]);
    let labels = Array::Text(4, vec!["A".into(), "A".into()]);
    let take = File::small(Processor::Intel, 1.0)
        .set("POINT", "LABELS", labels)
        .parse()
        .unwrap();
    assert_eq!(take.labels(), ["A", "A_2"]);
    assert_eq!(take.warnings().len(), 1);
}

/// 70000 frames of one point.
fn long() -> File {
    let mut file = File::small(Processor::Intel, 1.0);
    (file.points, file.analog, file.first) = (1, 0, 1);
    file.samples = vec![[1.0, 2.0, 3.0, 0.0]; 70_000];
    file.set("POINT", "USED", Array::Words(vec![1]))
}

#[test]
fn more_frames_than_the_header_can_count_are_read() {
    let field = |number: u32| {
        let [low, high] = [number & 0xffff, number >> 16].map(|half| u16::try_from(half).unwrap());
        Array::Words(vec![low, high])
    };
    // The header's last frame: saturated, and wrapped around.
    for last in [65_535, 4_464] {
        let long_with_last = || File { last, ..long() };
        let files = [
            long_with_last().set("POINT", "LONG_FRAMES", Array::Floats(vec![70_000.0])),
            long_with_last().set("POINT", "FRAMES", Array::Floats(vec![70_000.0])),
            long_with_last()
                .set("TRIAL", "ACTUAL_START_FIELD", field(1))
                .set("TRIAL", "ACTUAL_END_FIELD", field(70_000)),
        ];
        for file in files {
            assert_eq!(file.parse().unwrap().frames(), 70_000, "last = {last}");
        }
    }
    // A short piece cut from late in a long trial: only its frame numbers are large.
    let mut late = File {
        first: 65_535,
        last: 65_535,
        ..long()
    };
    late.samples.truncate(10);
    let take = late
        .set("TRIAL", "ACTUAL_START_FIELD", field(100_001))
        .set("TRIAL", "ACTUAL_END_FIELD", field(100_010))
        .parse()
        .unwrap();
    assert_eq!((take.frames(), take.first_time_seconds()), (10, 1000.0));
    assert_eq!(take.warnings(), [""; 0]);
}

#[test]
fn frames_that_the_file_does_not_hold_are_missed_with_a_warning() {
    let mut file = File::small(Processor::Dec, -1.0);
    file.last = 1004;
    let take = file.parse().unwrap();
    assert_eq!(take.frames(), 2);
    assert!(
        take.warnings()[0].contains("with 2 whole frames of 1000"),
        "{:?}",
        take.warnings()
    );
}

#[test]
fn the_header_is_believed_against_the_parameters() {
    let file = File::small(Processor::Intel, 1.0)
        .set("POINT", "USED", Array::Words(vec![40]))
        .set("POINT", "DATA_START", Array::Words(vec![2]))
        .set("POINT", "FRAMES", Array::Words(vec![7]));
    let take = file.parse().unwrap();
    assert_eq!((take.labels().len(), take.frames()), (2, 2));
    assert_eq!(take.warnings().len(), 3);
}

#[test]
fn lies_are_refused_where_they_stand() {
    let small = || File::small(Processor::Intel, 1.0);
    for (file, byte, words) in [
        (
            File {
                points: 0,
                ..small().set("POINT", "USED", Array::Words(vec![0]))
            },
            2,
            "no points",
        ),
        (File { last: 4, ..small() }, 6, "before the first, 5"),
        (
            File {
                points: 60_000,
                ..small()
            },
            2048,
            "no room for one frame",
        ),
        (
            small().set("POINT", "USED", Array::Text(1, vec!["2".into()])),
            1118,
            "text where numbers",
        ),
    ] {
        let (place, problem) = refusal(&file);
        assert_eq!(place, Place::Byte(byte), "{problem}");
        assert!(problem.contains(words), "{problem}");
    }
    let good = small().bytes();
    for (at, value, byte, words) in [
        (1, 0x51, 0, "0x03 0x51"),
        (0, 0, 0, "0x00 0x50"),
        (0, 200, 101_891, "ends at byte 2092"),
        (1027, 83, 1027, "83"),
        (17, 0xff, 16, "block 65285"),
        (1036, 0xff, 1035, "bytes further"),
    ] {
        let mut bytes = good.clone();
        bytes[at] = value;
        match take::parse("lie.c3d", &bytes, &Options::default()) {
            Err(TakeFileError::Malformed { place, problem, .. }) => {
                assert_eq!(place, Place::Byte(byte), "{problem}");
                assert!(problem.contains(words), "{problem}");
            }
            other => panic!("byte {at}: {other:?}"),
        }
    }
}

#[test]
fn a_spoilt_parameter_that_nobody_needs_spoils_nothing() {
    let mut bytes = File::small(Processor::Intel, 1.0)
        .set("FORCE_PLATFORM", "ORIGIN", Array::Floats(vec![1.0, 2.0]))
        .bytes();
    let at = bytes
        .windows(6)
        .position(|window| window == b"ORIGIN")
        .unwrap();
    bytes[at + 10] = 200; // the array's length, where it holds two numbers
    assert!(take::parse("spoilt.c3d", &bytes, &Options::default()).is_ok());
}
