//! What the tracker makes of real captures: what is seen is shown as it is.

use std::path::{Path, PathBuf};

use sinew_capture::{Doubt, Sample, Settings, Tracker};
use sinew_formats::take::{self, Options, Take};

/// Plays a take; how many samples were doubted as a swap and for their speed, and how many of those seen are not shown
/// where they are, other than on their way back.
fn play(take: &Take) -> [usize; 3] {
    let reference = take.reference();
    let present: Vec<bool> = reference.absent.iter().map(|absent| !absent).collect();
    let step = take.rate_hz().recip();
    let settings = Settings::default();
    let mut tracker =
        Tracker::new(&reference.positions, &present, step, settings).expect("good settings");
    let mut counts = [0; 3];
    for index in 0..take.frames() {
        let (positions, seen) = take.frame(index);
        tracker.step(Some(&Sample {
            sequence: index as u64,
            time: index as f64 * step,
            positions: positions.to_vec(),
            seen: seen.to_vec(),
        }));
        for (point, doubt) in tracker.doubts().enumerate() {
            counts[0] += usize::from(doubt == Doubt::Swap);
            counts[1] += usize::from(doubt == Doubt::Speed);
            let valid = tracker.states().nth(point) == Some(sinew_capture::State::Valid);
            counts[2] += usize::from(valid && tracker.positions()[point] != positions[point]);
        }
    }
    counts
}

fn read(path: &Path) -> Take {
    take::read(path, &Options::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn captures_that_were_cleaned_are_shown_as_they_are() {
    for file in [
        "client/demo/walk.bvh",
        "client/formats/tests/data/take/cmu_02_01.c3d",
    ] {
        assert_eq!(play(&read(&workspace().join(file))), [0; 3], "{file}");
    }
}

#[test]
fn of_the_shared_captures_few_samples_are_doubted() {
    let folder = workspace().join("../shared/data/mocap");
    if !folder.is_dir() {
        eprintln!("skipped: no shared data at {}", folder.display());
        return;
    }
    for kind in ["bvh", "c3d", "trc", "csv"] {
        for entry in folder.join(kind).read_dir().unwrap() {
            let path = entry.unwrap().path();
            let Ok(take) = take::read(&path, &Options::default()) else {
                continue; // the one without a marker
            };
            let counts = play(&take);
            let samples = take.visible().iter().filter(|seen| **seen).count();
            println!("{}: {counts:?} of {samples}", path.display());
            let doubted: usize = counts.iter().sum();
            assert!(
                5000 * doubted <= samples + 5000,
                "{doubted} of {samples} in {}",
                path.display()
            );
        }
    }
}
