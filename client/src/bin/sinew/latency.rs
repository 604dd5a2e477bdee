//! Where the time goes between a motion frame and the mesh that follows it.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{SystemTime, UNIX_EPOCH},
};

use sinew_proto::v1::Frame;

use crate::{percentiles::percentile, table::Table};

/// This machine's clock, ns since the Unix epoch, as in `sinew.v1.Timing`.
pub(crate) fn now() -> u64 {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// When each motion frame left; shared between the task that sends and the one that receives.
#[derive(Clone)]
pub(crate) struct SendTimes(Arc<[AtomicU64]>);

impl SendTimes {
    /// For frames numbered from 1 to `count`.
    pub(crate) fn new(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU64::new(0)).collect())
    }

    /// The frame leaves now.
    pub(crate) fn note(&self, sequence: u64) {
        if let Some(time) = self.slot(sequence) {
            time.store(now(), Ordering::Relaxed);
        }
    }

    fn get(&self, sequence: u64) -> u64 {
        self.slot(sequence)
            .map_or(0, |time| time.load(Ordering::Relaxed))
    }

    fn slot(&self, sequence: u64) -> Option<&AtomicU64> {
        self.0.get(usize::try_from(sequence.checked_sub(1)?).ok()?)
    }
}

/// Stages in order; the last one spans all others.
const STAGES: [&str; 5] = ["send", "queue", "step", "deliver", "end to end"];

/// Latencies of the frames received, per stage, s.
#[derive(Default)]
pub(crate) struct Latencies {
    stages: [Vec<f64>; STAGES.len()],
}

impl Latencies {
    /// Takes note of a frame that arrived at `arrived`, ns. A stage whose ends are not both known is left out.
    pub(crate) fn record(&mut self, frame: &Frame, sent: &SendTimes, arrived: u64) {
        let Some(timing) = &frame.timing else { return };
        let left = frame
            .motion_sequence
            .map_or(0, |sequence| sent.get(sequence));
        let spans = [
            (left, timing.received),
            (timing.received, timing.step_started),
            (timing.step_started, timing.published),
            (timing.published, arrived),
            (left, arrived),
        ];
        for (stage, (start, end)) in self.stages.iter_mut().zip(spans) {
            if start != 0 && end != 0 {
                // Clocks may be set back between two readings.
                #[expect(clippy::cast_precision_loss, reason = "a span is far below 2^53 ns")]
                stage.push(end.saturating_sub(start) as f64 * 1e-9);
            }
        }
    }

    /// The median from publishing to arrival, s.
    pub(crate) fn deliver_median(&self) -> Option<f64> {
        percentile(&self.stages[3], 0.5)
    }

    /// One row for each stage that was seen.
    pub(crate) fn rows(&self, table: &mut Table) {
        for (name, stage) in STAGES.iter().zip(&self.stages) {
            if let (Some(median), Some(high)) = (percentile(stage, 0.5), percentile(stage, 0.99)) {
                table.row([(*name).to_owned(), milliseconds(median), milliseconds(high)]);
            }
        }
    }
}

/// Seconds, shown in ms.
pub(crate) fn milliseconds(seconds: f64) -> String {
    format!("{:.2} ms", seconds * 1e3)
}

#[cfg(test)]
mod tests {
    use sinew_proto::v1::Timing;

    use super::*;

    fn frame(motion_sequence: Option<u64>, received: u64) -> Frame {
        Frame {
            motion_sequence,
            timing: Some(Timing {
                received,
                step_started: 3_000_000,
                published: 7_000_000,
                sent: 7_500_000,
            }),
            ..Frame::default()
        }
    }

    #[test]
    fn the_stages_between_send_and_arrival_add_up_to_the_whole() {
        let sent = SendTimes::new(2);
        sent.0[1].store(1_000_000, Ordering::Relaxed);
        let mut latencies = Latencies::default();
        latencies.record(&frame(Some(2), 2_000_000), &sent, 11_000_000);
        let mut table = Table::of_numbers();
        latencies.rows(&mut table);
        assert_eq!(
            table.to_string(),
            "send         1.00 ms   1.00 ms\n\
             queue        1.00 ms   1.00 ms\n\
             step         4.00 ms   4.00 ms\n\
             deliver      4.00 ms   4.00 ms\n\
             end to end  10.00 ms  10.00 ms\n"
        );
    }

    #[test]
    fn motion_of_the_servers_own_has_no_send_and_no_queue() {
        let mut latencies = Latencies::default();
        latencies.record(&frame(None, 0), &SendTimes::new(0), 11_000_000);
        let mut table = Table::of_numbers();
        latencies.rows(&mut table);
        assert_eq!(
            table.to_string(),
            "step     4.00 ms  4.00 ms\ndeliver  4.00 ms  4.00 ms\n"
        );
    }
}
