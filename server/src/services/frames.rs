//! What readers get of a frame.

use sinew_engine::{Doubt, Layout};
use sinew_proto::v1;

use super::{mesh::Wanted, modules::vectors, session::count};
use crate::{facts::Turn, outlets::Published, registry::Entry, timing::now_nanos};

impl Wanted {
    pub(super) fn keyframe(&self, entry: &Entry, published: &Published) -> v1::Keyframe {
        let layout = &published.frame.layout;
        v1::Keyframe {
            grid: self.mesh.then(|| entry.handle.outlets.grid(layout)),
            labels: entry.labels.clone(),
            frame: Some(self.frame(published)),
        }
    }

    pub(super) fn frame(&self, published: &Published) -> v1::Frame {
        let frame = &published.frame;
        let measures = frame.measures.iter().map(|measured| v1::Measured {
            rule: measured.rule,
            greatest: measured.greatest,
            threshold: measured.threshold,
        });
        v1::Frame {
            epoch: frame.layout.epoch,
            topology_version: frame.layout.topology_version,
            sequence: published.sequence,
            layout_hash: frame.layout.hash,
            vertex_count: count(frame.vertices.len()),
            step: frame.step,
            time_seconds: frame.time_seconds,
            capture_time_seconds: frame.capture_time_seconds,
            motion_sequence: frame.motion_sequence,
            vertices: self.mesh.then(|| published.vertices(self.precision)),
            points: self.points.then(|| published.points(self.precision)),
            point_states: if self.points {
                published.point_states()
            } else {
                bytes::Bytes::new()
            },
            orientations: match self.points && !frame.orientations.is_empty() {
                true => Some(published.orientations(self.precision)),
                false => None,
            },
            timing: Some(v1::Timing {
                received: published.timing.received,
                step_started: published.timing.started,
                published: published.timing.published,
                sent: now_nanos(),
            }),
            event_sequence: published.event_sequence,
            measures: measures.collect(),
            readings: (!frame.readings.is_empty())
                .then(|| vectors(&frame.readings, self.precision)),
            point_doubts: match self.points {
                true => frame.doubts.iter().map(doubt).collect(),
                false => Vec::new(),
            },
        }
    }
}

fn doubt(&(point, doubt): &(u32, Doubt)) -> v1::PointDoubt {
    let reason = match doubt {
        Doubt::None => v1::DoubtReason::Unspecified,
        Doubt::Speed => v1::DoubtReason::Speed,
        Doubt::Swap => v1::DoubtReason::Swap,
    };
    v1::PointDoubt {
        point,
        reason: reason.into(),
    }
}

/// A topology change with the positions of its step, if these are at hand.
pub(super) fn patch(turn: &Turn, frame: Option<v1::Frame>) -> v1::TopologyPatch {
    let bare = || v1::Frame {
        epoch: turn.epoch,
        topology_version: turn.from_version + 1,
        sequence: turn.sequence + 1,
        layout_hash: turn.hash,
        vertex_count: count(turn.vertex_count),
        step: turn.step,
        time_seconds: turn.time_seconds,
        event_sequence: turn.event_sequence,
        ..v1::Frame::default()
    };
    v1::TopologyPatch {
        frame: Some(frame.unwrap_or_else(bare)),
        ..turn.packed()
    }
}

/// Which mesh positions belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fit {
    pub(super) epoch: u64,
    pub(super) version: u64,
    hash: u64,
}

impl Fit {
    pub(super) fn of(layout: &Layout) -> Self {
        Self {
            epoch: layout.epoch,
            version: layout.topology_version,
            hash: layout.hash,
        }
    }
}
