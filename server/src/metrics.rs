//! What `/metrics` tells: the whole process, never one session.

use std::sync::atomic::AtomicU64;

use prometheus_client::{
    encoding::text::encode,
    metrics::{
        counter::Counter,
        gauge::Gauge,
        histogram::{Histogram, exponential_buckets},
    },
    registry::Registry,
};

use crate::timing::StepTiming;

/// The server's metrics.
pub(crate) struct Metrics {
    registry: Registry,
    pub(crate) sessions: Gauge,
    pub(crate) subscribers: Gauge,
    pub(crate) steps: Counter,
    pub(crate) step_seconds: Histogram,
    pub(crate) latency_seconds: Histogram,
    pub(crate) motion_frames: Counter,
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
    pub(crate) fn stepped(&self, timing: StepTiming) {
        self.steps.inc();
        self.step_seconds.observe(timing.step_seconds());
        if let Some(latency) = timing.latency_seconds() {
            self.latency_seconds.observe(latency);
        }
    }

    /// The text exposition of OpenMetrics.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = encode(&mut text, &self.registry);
        text
    }
}
