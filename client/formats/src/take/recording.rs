//! [`Take`]: what every reader gives.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::Format;

/// The axis that points away from the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// The second coordinate.
    Y,
    /// The third coordinate.
    Z,
}

/// A recording: labelled points, sampled at a fixed rate, each sample seen or not. At least one point and one frame.
///
/// Positions are finite and in metres, in the file's own axes. That of an invisible sample is **meaningless**: it
/// repeats the point's last visible one, before the first visible one that one, and is zero for a point never seen. It
/// is there so that no NaN is; ask [`Take::visible`] first.
#[derive(Clone, Debug, PartialEq)]
pub struct Take {
    labels: Vec<String>,
    rate_hz: f64,
    first_time_seconds: f64,
    positions: Vec<Vector3<f64>>, // frame-major, m
    visible: Vec<bool>,           // frame-major
    skeleton: Vec<[usize; 2]>,
    up: Option<Up>,
    warnings: Vec<String>,
    format: Option<Format>,
}

/// Where each point is to be taken as being at rest. Both columns hold one row per point.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The frame that was chosen.
    pub frame: usize,
    /// Positions in that frame, m; meaningless where absent.
    pub positions: Vec<Vector3<f64>>,
    /// True for the points not seen in that frame.
    pub absent: Vec<bool>,
}

/// How often one point is hidden, in frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PointGaps {
    /// Frames in which the point is not seen.
    pub missing: usize,
    /// Runs of such frames.
    pub gaps: usize,
    /// The longest run.
    pub longest: usize,
}

impl PointGaps {
    /// The share of `frames` in which the point is not seen, 0 to 1.
    #[must_use]
    #[expect(
        clippy::cast_precision_loss,
        reason = "frame counts are far below 2^53"
    )]
    pub fn missing_share(&self, frames: usize) -> f64 {
        self.missing as f64 / frames as f64
    }
}

impl Take {
    /// A take made in memory: `samples` frame by frame, `None` where a point is not seen. Starts at time 0.
    ///
    /// # Panics
    /// If there is no label, no sample, the samples do not fill whole frames, a coordinate is not finite, or the rate
    /// is not finite and positive.
    #[must_use]
    pub fn new<L: Into<String>>(
        labels: impl IntoIterator<Item = L>,
        rate_hz: f64,
        samples: impl IntoIterator<Item = Option<Vector3<f64>>>,
    ) -> Self {
        let labels = labels.into_iter().map(Into::into).collect();
        let mut recorder = Recorder::new(labels, rate_hz);
        for sample in samples {
            recorder.push(sample);
        }
        recorder.finish()
    }

    /// The points' names, unique and not empty.
    #[must_use]
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// Frames per second, finite and > 0.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The number of frames, at least 1.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.positions.len() / self.labels.len()
    }

    /// The capture time of frame 0, s; frame `i` is at `first_time_seconds + i / rate_hz`.
    #[must_use]
    pub fn first_time_seconds(&self) -> f64 {
        self.first_time_seconds
    }

    /// Every position, frame-major, m: `frames × labels` rows.
    #[must_use]
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.positions
    }

    /// Whether each of [`Take::positions`] was seen.
    #[must_use]
    pub fn visible(&self) -> &[bool] {
        &self.visible
    }

    /// The positions (m) and visibilities of frame `index`, one row per point.
    ///
    /// # Panics
    /// If `index` is not below [`Take::frames`].
    #[must_use]
    pub fn frame(&self, index: usize) -> (&[Vector3<f64>], &[bool]) {
        let rows = index * self.labels.len()..(index + 1) * self.labels.len();
        (&self.positions[rows.clone()], &self.visible[rows])
    }

    /// Bones as pairs of points, parent first; empty where the format has none.
    #[must_use]
    pub fn skeleton(&self) -> &[[usize; 2]] {
        &self.skeleton
    }

    /// The axis that points up, if the file or its format says.
    #[must_use]
    pub fn up(&self) -> Option<Up> {
        self.up
    }

    /// What was odd about the file, or had to be assumed; one sentence each.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The format of the file; `None` for a take made in memory.
    #[must_use]
    pub fn format(&self) -> Option<Format> {
        self.format
    }

    /// The first of the frames in which the most points are seen: one simultaneous pose, so that distances between
    /// points are ones that occurred.
    #[must_use]
    pub fn reference(&self) -> Reference {
        let mut most = (0, 0);
        for (index, row) in self.visible.chunks_exact(self.labels.len()).enumerate() {
            let seen = row.iter().filter(|&&visible| visible).count();
            if seen > most.1 {
                most = (index, seen);
            }
        }
        let (positions, visible) = self.frame(most.0);
        Reference {
            frame: most.0,
            positions: positions.to_vec(),
            absent: visible.iter().map(|visible| !visible).collect(),
        }
    }

    /// How often each point is hidden, one row per point.
    #[must_use]
    pub fn gaps(&self) -> Vec<PointGaps> {
        let mut gaps = vec![PointGaps::default(); self.labels.len()];
        let mut run = vec![0; self.labels.len()];
        for row in self.visible.chunks_exact(self.labels.len()) {
            for ((gap, run), visible) in gaps.iter_mut().zip(&mut run).zip(row) {
                if *visible {
                    *run = 0;
                } else {
                    *run += 1;
                    gap.missing += 1;
                    gap.gaps += usize::from(*run == 1);
                    gap.longest = gap.longest.max(*run);
                }
            }
        }
        gaps
    }
}

/// Builds a [`Take`] sample by sample, and keeps what it promises.
pub(super) struct Recorder {
    take: Take,
}

impl Recorder {
    pub(super) fn new(labels: Vec<String>, rate_hz: f64) -> Self {
        assert!(!labels.is_empty(), "a take has at least one point");
        assert!(
            rate_hz.is_finite() && rate_hz > 0.0,
            "a take has a rate, not {rate_hz} Hz"
        );
        let mut warnings = Vec::new();
        let labels = unique(labels, &mut warnings);
        Self {
            take: Take {
                labels,
                rate_hz,
                first_time_seconds: 0.0,
                positions: Vec::new(),
                visible: Vec::new(),
                skeleton: Vec::new(),
                up: None,
                warnings,
                format: None,
            },
        }
    }

    pub(super) fn format(&mut self, format: Format) {
        self.take.format = Some(format);
    }

    pub(super) fn first_time_seconds(&mut self, seconds: f64) {
        self.take.first_time_seconds = seconds;
    }

    pub(super) fn skeleton(&mut self, bones: Vec<[usize; 2]>) {
        self.take.skeleton = bones;
    }

    pub(super) fn up(&mut self, up: Option<Up>) {
        self.take.up = up;
    }

    pub(super) fn warn(&mut self, warning: impl Into<String>) {
        self.take.warnings.push(warning.into());
    }

    /// Room for exactly this many frames; the caller has seen that the file's bytes cover them.
    pub(super) fn reserve_frames(&mut self, frames: usize) {
        let samples = frames * self.take.labels.len();
        self.take.positions.reserve_exact(samples);
        self.take.visible.reserve_exact(samples);
    }

    /// The next sample: of the point after the last one's, or of the first point in the next frame.
    pub(super) fn push(&mut self, sample: Option<Vector3<f64>>) {
        let Take {
            labels,
            positions,
            visible,
            ..
        } = &mut self.take;
        let position = match sample {
            Some(position) => {
                assert!(
                    finite(position).is_some(),
                    "a visible sample is finite, not {position:?}"
                );
                position
            }
            None => match positions.len().checked_sub(labels.len()) {
                Some(previous) => positions[previous],
                None => Vector3::zeros(),
            },
        };
        positions.push(position);
        visible.push(sample.is_some());
    }

    /// Warns of markers exactly at the origin: cameras do not measure three zeros, but some programs write gaps so.
    pub(super) fn warn_of_samples_at_origin(&mut self) {
        let at_origin =
            |(position, visible): (&Vector3<f64>, &bool)| *visible && *position == Vector3::zeros();
        let Take {
            positions, visible, ..
        } = &self.take;
        let count = positions
            .iter()
            .zip(visible)
            .filter(|&row| at_origin(row))
            .count();
        if count > 0 {
            self.warn(format!(
                "{count} visible samples lie exactly at the origin; they may be gaps"
            ));
        }
    }

    pub(super) fn finish(mut self) -> Take {
        let take = &mut self.take;
        assert!(
            !take.positions.is_empty() && take.positions.len().is_multiple_of(take.labels.len()),
            "{} samples do not fill frames of {} points",
            take.positions.len(),
            take.labels.len()
        );
        let points = take.labels.len();
        for point in 0..points {
            let rows = (point..take.visible.len()).step_by(points);
            if let Some(first) = rows.clone().find(|&row| take.visible[row]) {
                let position = take.positions[first];
                rows.take_while(|&row| row < first)
                    .for_each(|row| take.positions[row] = position);
            }
        }
        self.take
    }
}

/// `position`, or `None`, which reads as "not seen", if a coordinate is NaN or infinite.
pub(super) fn finite(position: Vector3<f64>) -> Option<Vector3<f64>> {
    position.iter().all(|x| x.is_finite()).then_some(position)
}

/// Names the nameless `point_<number from 1>` and numbers what occurs twice: `hip`, `hip_2`, ….
fn unique(mut labels: Vec<String>, warnings: &mut Vec<String>) -> Vec<String> {
    let nameless = labels.iter().filter(|label| label.is_empty()).count();
    if nameless > 0 {
        warnings.push(format!(
            "{nameless} points have no label; they are called point_<number>"
        ));
    }
    for (index, label) in labels.iter_mut().enumerate() {
        if label.is_empty() {
            *label = format!("point_{}", index + 1);
        }
    }

    let renamed = numbered_repeats(&labels);
    if !renamed.is_empty() {
        let first: Vec<&str> = renamed.iter().take(3).map(|(_, name)| &**name).collect();
        warnings.push(format!(
            "{} labels occurred before and were numbered: {}{}",
            renamed.len(),
            first.join(", "),
            if renamed.len() > first.len() {
                ", …"
            } else {
                ""
            }
        ));
    }
    for (index, name) in renamed {
        labels[index] = name;
    }
    labels
}

/// New names for the labels that occurred before, with their places. They cannot meet each other: the part before the
/// last `_` is the label's own, and its numbers only grow.
fn numbered_repeats(labels: &[String]) -> Vec<(usize, String)> {
    let mut sorted: Vec<&str> = labels.iter().map(String::as_str).collect();
    sorted.sort_unstable();
    if sorted.windows(2).all(|pair| pair[0] != pair[1]) {
        return Vec::new();
    }
    let mut last: BTreeMap<&str, usize> = BTreeMap::new();
    let mut renamed = Vec::new();
    for (index, label) in labels.iter().enumerate() {
        let number = last.entry(label).or_insert(0);
        *number += 1;
        if *number == 1 {
            continue;
        }
        let mut name = format!("{label}_{number}");
        while sorted.binary_search(&&*name).is_ok() {
            *number += 1;
            name = format!("{label}_{number}");
        }
        renamed.push((index, name));
    }
    renamed
}
