//! When a step did what.

use std::time::SystemTime;

/// Moments of one step, ns since the Unix epoch; `received` is 0 without a motion frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StepTiming {
    pub(crate) received: u64,
    pub(crate) started: u64,
    pub(crate) published: u64,
}

impl StepTiming {
    /// From the step's start until its frame was published, s.
    pub(crate) fn step_seconds(&self) -> f64 {
        self.published.saturating_sub(self.started) as f64 * 1e-9
    }

    /// From receipt of the motion frame until the mesh was published, s.
    pub(crate) fn latency_seconds(&self) -> Option<f64> {
        (self.received > 0).then(|| self.published.saturating_sub(self.received) as f64 * 1e-9)
    }
}

/// Nanoseconds since the Unix epoch.
pub(crate) fn now_nanos() -> u64 {
    SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0, |since| {
            u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
        })
}
