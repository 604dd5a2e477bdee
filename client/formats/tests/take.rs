//! What every take promises, whatever file it came from.

use nalgebra::Vector3;
use sinew_formats::take::{self, Format, Options, PointGaps, Take, TakeFileError};

fn at(x: f64) -> Option<Vector3<f64>> {
    Some(Vector3::new(x, 2.0 * x, 3.0 * x))
}

/// Three points over four frames: always seen, seen in the middle, never seen.
fn gappy() -> Take {
    Take::new(
        ["always", "sometimes", "never"],
        50.0,
        [
            [at(1.0), None, None],
            [at(2.0), at(5.0), None],
            [at(3.0), at(6.0), None],
            [at(4.0), None, None],
        ]
        .concat(),
    )
}

#[test]
fn a_hidden_sample_repeats_where_its_point_was_seen() {
    let take = gappy();
    assert_eq!(take.frames(), 4);
    let column = |point: usize| {
        (0..4)
            .map(|frame| take.frame(frame).0[point].x)
            .collect::<Vec<_>>()
    };
    assert_eq!(column(0), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(column(1), [5.0, 5.0, 6.0, 6.0]);
    assert_eq!(column(2), [0.0; 4]);
    assert_eq!(take.frame(3).1, [true, false, false]);
}

#[test]
fn the_reference_is_the_first_frame_with_the_most_points_in_sight() {
    let reference = gappy().reference();
    assert_eq!(reference.frame, 1);
    assert_eq!(reference.absent, [false, false, true]);
    assert_eq!(
        reference.positions[..2],
        [at(2.0).unwrap(), at(5.0).unwrap()]
    );
}

#[test]
fn gaps_are_counted_per_point() {
    let gaps = gappy().gaps();
    let gap = |missing, gaps, longest| PointGaps {
        missing,
        gaps,
        longest,
    };
    assert_eq!(gaps, [gap(0, 0, 0), gap(2, 2, 1), gap(4, 1, 4)]);
    assert_eq!(gaps[1].missing_share(4), 0.5);
}

#[test]
fn labels_are_unique_even_where_the_numbered_name_is_taken() {
    let take = Take::new(["hip", "hip_2", "hip", "", "hip"], 1.0, [at(1.0); 5]);
    assert_eq!(take.labels(), ["hip", "hip_2", "hip_3", "point_4", "hip_4"]);
    assert_eq!(take.warnings().len(), 2);
}

#[test]
fn an_unknown_extension_is_refused_with_a_list_of_the_known() {
    for name in ["walk.fbx", "walk.c3", "walk", "c3d"] {
        let error = take::parse(name, &[], &Options::default()).unwrap_err();
        assert!(matches!(error, TakeFileError::UnknownFormat { .. }));
        let text = error.to_string();
        assert!(
            text.starts_with(name) && text.contains(".c3d .trc .bvh .mot"),
            "{text}"
        );
    }
    assert_eq!(Format::of("WALK.C3D".as_ref()), Some(Format::C3d));
}

#[test]
fn a_file_that_is_not_there_is_refused_with_its_path() {
    let error = take::read("no/such/walk.trc", &Options::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("no/such/walk.trc"), "{error}");
}

#[test]
fn a_unit_scale_that_is_no_length_is_refused() {
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = Options {
            unit_scale: Some(scale),
        };
        let error = take::parse("walk.bvh", &[], &options).unwrap_err();
        assert!(matches!(error, TakeFileError::UnitScale(_)));
    }
}
