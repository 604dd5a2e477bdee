//! MotionService: frames from a client into a session's queue.

use std::{
    pin::Pin,
    sync::{Arc, atomic::Ordering},
};

use futures::{Stream, stream};
use sinew_engine::MotionSample;
use sinew_proto::v1::{
    self, motion_service_server::MotionService, stream_motion_request::Item as Asked,
    stream_motion_response::Item as Told,
};
use tokio::sync::watch;
use tonic::{Request, Response, Status, Streaming};

use super::{Shared, session::count};
use crate::{
    convert,
    error::{ServiceError, invalid},
    registry::Entry,
    session::{Arrival, MOTION_QUEUE},
    status,
    timing::now_nanos,
};

/// Bit of a point's flag byte that says it is occluded.
const OCCLUDED: u8 = 1;

type Answer = Result<v1::StreamMotionResponse, Status>;

#[tonic::async_trait]
impl MotionService for Shared {
    type StreamMotionStream = Pin<Box<dyn Stream<Item = Answer> + Send>>;

    async fn stream_motion(
        &self,
        request: Request<Streaming<v1::StreamMotionRequest>>,
    ) -> Result<Response<Self::StreamMotionStream>, Status> {
        let mut requests = request.into_inner();
        let hello = match next(&mut requests).await? {
            Some(Asked::Hello(hello)) => hello,
            Some(Asked::Frame(_)) | None => return Err(ServiceError::MotionHelloMissing.into()),
        };
        let source = Source::open(self, &hello)?;
        let first = Told::Accepted(v1::Accepted {
            point_count: count(source.entry.labels.len()),
            queue_capacity: count(MOTION_QUEUE),
        });
        // Acks are cumulative: a client that reads slowly gets the newest.
        let (acks, told) = watch::channel(first);
        let reader = self.tasks.spawn(source.read(requests, acks));
        let responses = stream::unfold(Some((Some(first), told, reader)), |state| async move {
            let (first, mut told, reader) = state?;
            if let Some(item) = first {
                return Some((
                    Ok(v1::StreamMotionResponse { item: Some(item) }),
                    Some((None, told, reader)),
                ));
            }
            if told.changed().await.is_ok() {
                let item = Some(*told.borrow_and_update());
                return Some((
                    Ok(v1::StreamMotionResponse { item }),
                    Some((None, told, reader)),
                ));
            }
            // The reader is done: its error is the stream's last word.
            match reader.await {
                Ok(Ok(())) => None,
                Ok(Err(error)) => Some((Err(error.into()), None)),
                Err(join) => Some((Err(ServiceError::Internal(join.to_string()).into()), None)),
            }
        });
        Ok(Response::new(Box::pin(responses)))
    }
}

/// The next item; `None` where the client is done or gone.
async fn next(
    requests: &mut Streaming<v1::StreamMotionRequest>,
) -> Result<Option<Asked>, ServiceError> {
    loop {
        match requests.message().await {
            // An item of a newer API than ours is passed over.
            Ok(Some(v1::StreamMotionRequest { item: None })) => {}
            Ok(Some(v1::StreamMotionRequest { item })) => return Ok(item),
            Ok(None) => return Ok(None),
            Err(status) => return status::unreadable(&status).map_or(Ok(None), Err),
        }
    }
}

/// A client's stream of motion, the only one of its session.
struct Source {
    entry: Arc<Entry>,
    /// For each point of a frame its index in the session; none where the orders agree.
    order: Option<Vec<usize>>,
    last: Option<(u64, f64)>,
    shared: Shared,
}

impl Drop for Source {
    fn drop(&mut self) {
        self.entry.streaming.store(false, Ordering::Release);
    }
}

impl Source {
    fn open(shared: &Shared, hello: &v1::Hello) -> Result<Self, ServiceError> {
        let entry = shared.registry.get(&hello.session)?;
        if !entry.external {
            return Err(ServiceError::MotionNotExternal);
        }
        let order = order(&hello.labels, &entry.labels)?;
        if entry.streaming.swap(true, Ordering::AcqRel) {
            return Err(ServiceError::MotionSourceBusy);
        }
        tracing::info!(
            session = entry.name,
            source = hello.source,
            "motion stream opened"
        );
        Ok(Self {
            entry,
            order,
            last: None,
            shared: shared.clone(),
        })
    }

    /// Takes frames until the client is done or something is wrong.
    async fn read(
        mut self,
        mut requests: Streaming<v1::StreamMotionRequest>,
        acks: watch::Sender<Told>,
    ) -> Result<(), ServiceError> {
        let cancel = self.entry.handle.cancel.clone();
        loop {
            let item = tokio::select! {
                () = cancel.cancelled() => return Err(self.ended()),
                item = next(&mut requests) => item?,
            };
            let received_nanos = now_nanos();
            let sample = match item {
                None => return Ok(()),
                Some(Asked::Hello(_)) => return Err(ServiceError::MotionHelloRepeated),
                Some(Asked::Frame(frame)) => self.sample(frame)?,
            };
            self.shared.metrics.motion_frames.inc();
            let sequence = sample.sequence;
            tokio::select! {
                () = cancel.cancelled() => return Err(self.ended()),
                // The client left while its frame waited: its place is for another source.
                () = acks.closed() => return Ok(()),
                sent = self.entry.handle.motion.send(Arrival { sample, received_nanos }) => {
                    sent.map_err(|_| self.ended())?;
                }
            }
            let step = self.entry.handle.outlets.latest().frame.step;
            acks.send_replace(Told::Ack(v1::Ack { sequence, step }));
        }
    }

    fn ended(&self) -> ServiceError {
        ServiceError::Ended(self.entry.handle.outlets.end())
    }

    /// Checks a frame and brings it into the session's order.
    fn sample(&mut self, frame: v1::MotionFrame) -> Result<MotionSample, ServiceError> {
        let v1::MotionFrame {
            sequence,
            capture_time_seconds: time,
            positions,
            flags,
        } = frame;
        let points = self.entry.labels.len();
        let positions = convert::vectors(positions.as_ref(), "frame.positions")?;
        let wrong_length = |field, found: usize| {
            let problem = format!("has {found} entries for {points} points");
            invalid(
                "MOTION_WRONG_LENGTH",
                field,
                problem,
                "send every point in every frame; flag those not seen",
            )
        };
        if positions.len() != points {
            return Err(wrong_length("frame.positions", positions.len()));
        }
        if !flags.is_empty() && flags.len() != points {
            return Err(wrong_length("frame.flags", flags.len()));
        }
        if !time.is_finite() {
            let problem = format!("is {time}");
            return Err(invalid(
                "VALUE_NOT_FINITE",
                "frame.capture_time_seconds",
                problem,
                "send finite seconds",
            ));
        }
        self.check_order(sequence, time)?;
        let seen: Vec<bool> = match flags.is_empty() {
            true => vec![true; points],
            false => flags.iter().map(|flag| flag & OCCLUDED == 0).collect(),
        };
        for (i, (position, seen)) in positions.iter().zip(&seen).enumerate() {
            if *seen && !position.iter().all(|x| x.abs() <= LARGEST) {
                return Err(invalid(
                    "VALUE_NOT_FINITE",
                    format!("frame.positions[{i}]"),
                    format!("is {:?} in frame {sequence}", position.as_slice()),
                    "send finite metres, or flag the point as occluded",
                ));
            }
        }
        let (positions, seen) = match &self.order {
            None => (positions, seen),
            Some(order) => (scatter(&positions, order), scatter(&seen, order)),
        };
        Ok(MotionSample {
            sequence,
            time,
            positions,
            seen,
        })
    }

    fn check_order(&mut self, sequence: u64, time: f64) -> Result<(), ServiceError> {
        let Some((before, time_before)) = self.last.replace((sequence, time)) else {
            return Ok(());
        };
        let backwards = |field, before: String, after: String, rule| {
            Err(ServiceError::MotionBackwards {
                field,
                before,
                after,
                rule,
            })
        };
        if sequence <= before {
            backwards("sequence", before.to_string(), sequence.to_string(), "grow")
        } else if time < time_before {
            backwards(
                "capture_time_seconds",
                time_before.to_string(),
                time.to_string(),
                "never go back",
            )
        } else {
            Ok(())
        }
    }
}

/// Largest coordinate that a mesh can follow and still travel as binary32, m.
const LARGEST: f64 = 1e12;

/// Where in the session each point of a frame stands.
fn order(labels: &[String], known: &[String]) -> Result<Option<Vec<usize>>, ServiceError> {
    if labels.is_empty() || labels == known {
        return Ok(None);
    }
    let mut order = Vec::with_capacity(known.len());
    let mut taken = vec![false; known.len()];
    for (i, label) in labels.iter().enumerate() {
        let field = format!("hello.labels[{i}]");
        let Some(point) = known.iter().position(|name| name == label) else {
            let problem = format!("is `{label}`, which no point of the session has");
            return Err(invalid(
                "LABEL_UNKNOWN",
                field,
                problem,
                "stream the points of the scene",
            ));
        };
        if std::mem::replace(&mut taken[point], true) {
            let problem = format!("is `{label}` for the second time");
            return Err(invalid(
                "LABEL_DUPLICATE",
                field,
                problem,
                "name each point once",
            ));
        }
        order.push(point);
    }
    if let Some(absent) = taken.iter().position(|taken| !taken) {
        let problem = format!("lacks `{}`", known[absent]);
        return Err(invalid(
            "LABEL_MISSING",
            "hello.labels",
            problem,
            "name every point of the scene",
        ));
    }
    Ok(Some(order))
}

fn scatter<T: Copy>(values: &[T], order: &[usize]) -> Vec<T> {
    let mut placed = values.to_vec();
    for (value, slot) in values.iter().zip(order) {
        placed[*slot] = *value;
    }
    placed
}
