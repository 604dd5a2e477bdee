//! What `/metrics` tells: the whole process, never one session.

use std::sync::atomic::AtomicU64;

use prometheus_client::{
    encoding::{EncodeLabelSet, EncodeLabelValue, text::encode},
    metrics::{
        counter::Counter,
        family::Family,
        gauge::Gauge,
        histogram::{Histogram, exponential_buckets},
    },
    registry::Registry,
};

use sinew_engine::{Doubt, Frame, PointState};

use crate::{inbox::Progress, timing::StepTiming};

/// What a point was at a step, or why its sample was not believed.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct PointLabel {
    is: PointIs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, EncodeLabelValue)]
enum PointIs {
    Valid,
    Predicted,
    Held,
    Lost,
    DoubtedSpeed,
    DoubtedSwap,
}

/// What became of a motion frame that was not simply taken.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct FateLabel {
    fate: Fate,
}

/// See `sinew.v1.Ack`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, EncodeLabelValue)]
pub(crate) enum Fate {
    Duplicate,
    Reordered,
    Late,
    Refused,
}

/// The server's metrics.
pub(crate) struct Metrics {
    registry: Registry,
    pub(crate) sessions: Gauge,
    pub(crate) subscribers: Gauge,
    pub(crate) steps: Counter,
    pub(crate) step_seconds: Histogram,
    pub(crate) latency_seconds: Histogram,
    pub(crate) motion_frames: Counter,
    fates: Family<FateLabel, Counter>,
    points: Family<PointLabel, Counter>,
    delay_seconds: Histogram,
    clock_skew: Gauge<f64, AtomicU64>,
    pub(crate) frames_sent: Counter,
    pub(crate) frames_missed: Counter,
    pub(crate) faults: Counter,
}

impl Metrics {
    pub(crate) fn new() -> Self {
        // 50 us to 1.6 s, doubling.
        let buckets = || exponential_buckets(50e-6, 2.0, 16);
        let mut metrics = Self {
            registry: Registry::with_prefix("sinew"),
            sessions: Gauge::default(),
            subscribers: Gauge::default(),
            steps: Counter::<u64, AtomicU64>::default(),
            step_seconds: Histogram::new(buckets()),
            latency_seconds: Histogram::new(buckets()),
            motion_frames: Counter::default(),
            fates: Family::default(),
            points: Family::default(),
            delay_seconds: Histogram::new(buckets()),
            clock_skew: Gauge::default(),
            frames_sent: Counter::default(),
            frames_missed: Counter::default(),
            faults: Counter::default(),
        };
        let registry = &mut metrics.registry;
        registry.register("sessions", "Sessions that exist", metrics.sessions.clone());
        registry.register(
            "subscribers",
            "Open mesh streams",
            metrics.subscribers.clone(),
        );
        registry.register("steps", "Steps taken", metrics.steps.clone());
        registry.register(
            "step_seconds",
            "Time of a step",
            metrics.step_seconds.clone(),
        );
        let help = "Time from receipt of a motion frame until its mesh is published";
        registry.register(
            "motion_latency_seconds",
            help,
            metrics.latency_seconds.clone(),
        );
        registry.register(
            "motion_frames",
            "Motion frames received",
            metrics.motion_frames.clone(),
        );
        let help = "Motion frames that came twice, out of order, too late or without room";
        registry.register("motion_frames_fate", help, metrics.fates.clone());
        let help = "Points at all steps, by what they were, and those not believed";
        registry.register("points", help, metrics.points.clone());
        let help = "Time from capture until a moment is played, at each live step";
        registry.register("motion_delay_seconds", help, metrics.delay_seconds.clone());
        let help = "How much faster this clock runs than the last live source's, parts of 1";
        registry.register("motion_clock_skew", help, metrics.clock_skew.clone());
        registry.register(
            "frames_sent",
            "Mesh frames sent to subscribers",
            metrics.frames_sent.clone(),
        );
        let help = "Mesh frames that slow subscribers missed";
        registry.register("frames_missed", help, metrics.frames_missed.clone());
        registry.register(
            "session_faults",
            "Sessions ended by a fault",
            metrics.faults.clone(),
        );
        metrics
    }

    /// Counts a step.
    pub(crate) fn stepped(&self, timing: StepTiming, frame: &Frame) {
        self.steps.inc();
        self.step_seconds.observe(timing.step_seconds());
        if let Some(latency) = timing.latency_seconds() {
            self.latency_seconds.observe(latency);
        }
        if frame.motion_sequence.is_some() {
            self.tracked(frame);
        }
    }

    /// Counts what points were.
    fn tracked(&self, frame: &Frame) {
        let add = |is, count| {
            if count > 0 {
                self.points.get_or_create(&PointLabel { is }).inc_by(count);
            }
        };
        let states = |wanted| frame.point_states.iter().filter(|s| **s == wanted).count() as u64;
        add(PointIs::Valid, states(PointState::Valid));
        add(PointIs::Predicted, states(PointState::Predicted));
        add(PointIs::Held, states(PointState::Held));
        add(PointIs::Lost, states(PointState::Lost));
        let doubts = |wanted| frame.doubts.iter().filter(|(_, d)| *d == wanted).count() as u64;
        add(PointIs::DoubtedSpeed, doubts(Doubt::Speed));
        add(PointIs::DoubtedSwap, doubts(Doubt::Swap));
    }

    /// Counts motion frames of one fate.
    pub(crate) fn fated(&self, fate: Fate, frames: u64) {
        if frames > 0 {
            self.fates.get_or_create(&FateLabel { fate }).inc_by(frames);
        }
    }

    /// Takes note of how a live stream goes, at a step.
    pub(crate) fn live(&self, progress: &Progress) {
        self.delay_seconds.observe(progress.delay);
        self.clock_skew.set(progress.skew);
    }

    /// The text exposition of OpenMetrics.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = encode(&mut text, &self.registry);
        text
    }
}
