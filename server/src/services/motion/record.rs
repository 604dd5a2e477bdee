//! RecordMotion: what a session was given, nothing left out.

use std::{pin::Pin, sync::Arc};

use futures::{Stream, stream};
use sinew_engine::{Drag, MotionSample};
use sinew_proto::v1::{self, Precision, Reals, record_motion_response::Item};
use tokio::sync::{
    broadcast::{self, error::RecvError},
    watch,
};
use tonic::Status;

use super::super::session::digest;
use crate::{
    end::End,
    error::ServiceError,
    given::{Given, Input},
    registry::Entry,
    session::Wish,
};

pub(super) type Records =
    Pin<Box<dyn Stream<Item = Result<v1::RecordMotionResponse, Status>> + Send>>;

/// The record of a session from now on.
pub(super) async fn records(entry: Arc<Entry>) -> Result<Records, ServiceError> {
    // First listen, then ask: nothing falls between.
    let given = entry.handle.outlets.inputs.listen();
    let (_, end) = entry.handle.outlets.subscribe();
    let report = entry.handle.ask(Wish::Describe).await?;
    let start = v1::RecordStart {
        labels: entry.labels.clone(),
        step: report.frame.step,
        digest: digest(report.digest),
        time_step_seconds: entry.time_step,
    };
    let recorder = Recorder {
        after: report.inputs,
        given,
        end,
        entry,
    };
    let first = stream::iter([Ok(Item::Start(start))]);
    let rest = stream::unfold(Some(recorder), async |recorder| recorder?.next().await);
    let items = stream::StreamExt::chain(first, rest);
    Ok(Box::pin(stream::StreamExt::map(items, |item| {
        item.map(|item| v1::RecordMotionResponse { item: Some(item) })
            .map_err(Status::from)
    })))
}

struct Recorder {
    /// The last input that is not in the record, by its number.
    after: u64,
    given: broadcast::Receiver<Given>,
    end: watch::Receiver<Option<End>>,
    entry: Arc<Entry>,
}

impl Recorder {
    async fn next(mut self) -> Option<(Result<Item, ServiceError>, Option<Self>)> {
        loop {
            let given = tokio::select! {
                biased;
                given = self.given.recv() => given,
                _ = self.end.wait_for(Option::is_some) => return None,
            };
            match given {
                Ok(given) if given.number <= self.after => {}
                Ok(Given { input, .. }) => {
                    let item = item(&input, &self.entry.labels);
                    return Some((Ok(item), Some(self)));
                }
                Err(RecvError::Lagged(_)) => {
                    return Some((Err(ServiceError::SubscriberTooSlow), None));
                }
                Err(RecvError::Closed) => return None,
            }
        }
    }
}

fn item(input: &Input, labels: &[String]) -> Item {
    match input {
        Input::Motion { step, sample } => Item::Frame(frame(*step, sample)),
        Input::Drags { step, drags } => Item::Frame(v1::MotionFrame {
            sequence: *step,
            drags: drags.iter().map(|drag| told(drag, labels)).collect(),
            ..v1::MotionFrame::default()
        }),
        Input::Mapping {
            mapping,
            blend_seconds,
        } => Item::Mapping(v1::RecordedMapping {
            mapping: Some(v1::Mapping::clone(mapping)),
            blend_seconds: *blend_seconds,
        }),
        Input::Edits(edits) => Item::Edits(v1::RecordedEdits {
            edits: edits.to_vec(),
        }),
    }
}

fn told(drag: &Drag, labels: &[String]) -> v1::Drag {
    v1::Drag {
        point: labels[drag.point as usize].clone(),
        position: drag.target.map(|target| v1::Vector3 {
            x: target.x,
            y: target.y,
            z: target.z,
        }),
    }
}

fn frame(step: u64, sample: &MotionSample) -> v1::MotionFrame {
    let flags = match sample.seen.iter().all(|seen| *seen) {
        true => bytes::Bytes::new(),
        false => sample.seen.iter().map(|seen| u8::from(!seen)).collect(),
    };
    v1::MotionFrame {
        sequence: step,
        capture_time_seconds: sample.time,
        positions: Some(Reals::pack(
            bytemuck::cast_slice(&sample.positions),
            Precision::F64,
        )),
        flags,
        source_sequence: Some(sample.sequence),
        drags: Vec::new(),
    }
}
