//! MotionService: frames from a client into a session, and what steps were given out of it.

mod door;
mod record;

use std::{pin::Pin, sync::Arc};

use futures::{Stream, stream};
use sinew_engine::Exchange;
use sinew_proto::v1::{
    self, motion_service_server::MotionService, stream_motion_request::Item as Asked,
    stream_motion_response::Item as Told,
};
use tokio::{
    sync::{mpsc, oneshot, watch},
    task::JoinHandle,
};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status, Streaming};

use self::door::Door;
use super::{Shared, session::count};
use crate::{
    error::ServiceError,
    inbox::{Arrival, Delivery, Input, Item, MOTION_QUEUE, Progress},
    metrics::Fate,
    registry::Entry,
    status,
    timing::now_nanos,
};

/// Answers to pings that may wait for a client; one that reads more slowly goes without.
const ANSWERS: usize = 16;

type Answer = Result<v1::StreamMotionResponse, Status>;

#[tonic::async_trait]
impl MotionService for Shared {
    type StreamMotionStream = Pin<Box<dyn Stream<Item = Answer> + Send>>;
    type RecordMotionStream = record::Records;

    async fn stream_motion(
        &self,
        request: Request<Streaming<v1::StreamMotionRequest>>,
    ) -> Result<Response<Self::StreamMotionStream>, Status> {
        let mut requests = request.into_inner();
        let hello = match next(&mut requests).await? {
            Some(Asked::Hello(hello)) => hello,
            Some(Asked::Frame(_) | Asked::Ping(_)) | None => {
                return Err(ServiceError::MotionHelloMissing.into());
            }
        };
        let source = Source::open(self, &hello)?;
        let first = Told::Accepted(v1::Accepted {
            point_count: count(source.entry.labels.len()),
            queue_capacity: count(MOTION_QUEUE),
        });
        let (acks, acked) = watch::channel(v1::Ack::default());
        let (say, said) = mpsc::channel(ANSWERS);
        let reader = self.tasks.spawn(source.run(requests, Voice { acks, say }));
        let answers = Answers {
            first: Some(first),
            said,
            acked,
            reader,
        };
        let responses = stream::unfold(Some(answers), async |answers| {
            let (item, answers) = answers?.next().await?;
            let answer = item.map(|item| v1::StreamMotionResponse { item: Some(item) });
            Some((answer.map_err(Status::from), answers))
        });
        Ok(Response::new(Box::pin(responses)))
    }

    async fn record_motion(
        &self,
        request: Request<v1::RecordMotionRequest>,
    ) -> Result<Response<Self::RecordMotionStream>, Status> {
        let entry = self.registry.get(&request.into_inner().session)?;
        Ok(Response::new(record::records(entry).await?))
    }
}

/// What the client is told, on its way.
struct Answers {
    first: Option<Told>,
    said: mpsc::Receiver<Told>,
    /// Cumulative: a client that reads slowly gets the newest.
    acked: watch::Receiver<v1::Ack>,
    reader: JoinHandle<Result<(), ServiceError>>,
}

impl Answers {
    async fn next(mut self) -> Option<(Result<Told, ServiceError>, Option<Self>)> {
        if let Some(first) = self.first.take() {
            return Some((Ok(first), Some(self)));
        }
        let told = tokio::select! {
            biased;
            Some(told) = self.said.recv() => told,
            Ok(()) = self.acked.changed() => Told::Ack(*self.acked.borrow_and_update()),
            else => {
                // The reader is done: its error is the stream's last word.
                let end = self.reader.await;
                let end = end.unwrap_or_else(|join| Err(ServiceError::Internal(join.to_string())));
                return end.err().map(|error| (Err(error), None));
            }
        };
        Some((Ok(told), Some(self)))
    }
}

/// The reader's way to tell the client something.
struct Voice {
    acks: watch::Sender<v1::Ack>,
    say: mpsc::Sender<Told>,
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
    door: Door,
    delivery: Delivery,
    stream: u64,
    /// The session knows of the stream.
    opened: bool,
    superseded: CancellationToken,
    progress: watch::Receiver<Progress>,
    /// The last ping: sent on the source's clock, received and answered on ours, s.
    pinged: Option<(f64, f64, f64)>,
    /// Sequence of the last frame that has its place.
    queued: u64,
    /// What was said last.
    told: v1::Ack,
    shared: Shared,
}

impl Drop for Source {
    fn drop(&mut self) {
        self.entry.seat.leave(self.stream);
    }
}

impl Source {
    fn open(shared: &Shared, hello: &v1::Hello) -> Result<Self, ServiceError> {
        let entry = shared.registry.get(&hello.session)?;
        let door = Door::open(hello, &entry.labels, entry.up)?;
        let delivery = door::delivery(hello, entry.time_step)?;
        if !entry.external && delivery != Delivery::Each {
            return Err(ServiceError::MotionNotExternal);
        }
        let (stream, superseded) = entry.seat.take(hello.stream_epoch)?;
        tracing::info!(
            session = entry.name,
            source = hello.source,
            clock = hello.clock,
            "motion stream opened"
        );
        Ok(Self {
            progress: entry.handle.progress.clone(),
            entry,
            door,
            delivery,
            stream,
            opened: false,
            superseded,
            pinged: None,
            queued: 0,
            told: v1::Ack::default(),
            shared: shared.clone(),
        })
    }

    /// Takes items until the client is done or something is wrong.
    async fn run(
        mut self,
        requests: Streaming<v1::StreamMotionRequest>,
        voice: Voice,
    ) -> Result<(), ServiceError> {
        let cancel = self.entry.handle.cancel.clone();
        let superseded = self.superseded.clone();
        tokio::select! {
            biased;
            () = cancel.cancelled() => Err(self.ended()),
            () = superseded.cancelled() => Err(ServiceError::MotionSuperseded),
            done = self.read(requests, &voice) => done,
        }
    }

    async fn read(
        &mut self,
        mut requests: Streaming<v1::StreamMotionRequest>,
        voice: &Voice,
    ) -> Result<(), ServiceError> {
        let live = self.delivery != Delivery::Each;
        let mut refused = 0;
        let read = loop {
            let item = tokio::select! {
                item = next(&mut requests) => item,
                Ok(()) = self.progress.changed(), if live => {
                    let progress = self.tell(voice);
                    if progress.refused > refused {
                        refused = progress.refused;
                        let sequence = self.door.last();
                        voice.say.try_send(Told::Throttle(v1::Throttle { sequence })).ok();
                    }
                    continue;
                }
            };
            match item {
                Ok(None) => break Ok(()),
                Ok(Some(item)) => {
                    if let Err(error) = self.take(item, voice).await {
                        break Err(error);
                    }
                }
                Err(error) => break Err(error),
            }
        };
        if live {
            self.close(voice, read.is_ok()).await?;
        }
        read
    }

    async fn take(&mut self, item: Asked, voice: &Voice) -> Result<(), ServiceError> {
        let received = self.entry.handle.clock_seconds();
        let received_nanos = now_nanos();
        match item {
            Asked::Hello(_) => return Err(ServiceError::MotionHelloRepeated),
            Asked::Ping(ping) => return self.ping(ping, received, voice).await,
            Asked::Frame(frame) if !self.entry.external => {
                if let Some(drags) = self.door.admit_drags(frame, &self.entry.labels)? {
                    self.send(Item::Drags(drags), voice).await?;
                    self.queued = self.door.last();
                }
            }
            Asked::Frame(frame) => {
                self.shared.metrics.motion_frames.inc();
                let sequence = frame.sequence;
                if let Some(sample) = self.door.admit(frame)? {
                    let arrival = Arrival {
                        sequence,
                        sample,
                        received,
                        received_nanos,
                    };
                    self.send(Item::Frame(arrival), voice).await?;
                    self.queued = self.door.last();
                }
            }
        }
        if self.delivery == Delivery::Each {
            self.tell(voice);
        }
        Ok(())
    }

    /// Answers a ping; the one before it is then a whole exchange.
    async fn ping(
        &mut self,
        ping: v1::Ping,
        received: f64,
        voice: &Voice,
    ) -> Result<(), ServiceError> {
        let v1::Ping {
            sent_seconds: sent,
            returned_seconds: returned,
        } = ping;
        for (field, time) in [("sent_seconds", Some(sent)), ("returned_seconds", returned)] {
            door::check_time(&format!("ping.{field}"), time.unwrap_or_default())?;
        }
        if let (Some((sent, received, answered)), Some(returned)) = (self.pinged, returned)
            && self.delivery != Delivery::Each
        {
            let exchange = Exchange {
                sent,
                received,
                answered,
                returned,
            };
            self.send(Item::Ping(exchange), voice).await?;
        }
        let answered = self.entry.handle.clock_seconds();
        self.pinged = Some((sent, received, answered));
        let pong = v1::Pong {
            sent_seconds: sent,
            received_seconds: received,
            answered_seconds: answered,
        };
        voice.say.try_send(Told::Pong(pong)).ok();
        Ok(())
    }

    /// Waits until the last moment was played, where someone still listens.
    async fn close(&mut self, voice: &Voice, wanted: bool) -> Result<(), ServiceError> {
        let (played, mut over) = oneshot::channel();
        self.deliver(Item::Close(played)).await?;
        if !wanted {
            return Ok(());
        }
        loop {
            tokio::select! {
                _ = &mut over => break,
                () = voice.acks.closed() => break,
                Ok(()) = self.progress.changed() => { self.tell(voice); }
            }
        }
        self.tell(voice);
        Ok(())
    }

    /// Sends something to the session, unless the client leaves while it waits for room.
    async fn send(&mut self, item: Item, voice: &Voice) -> Result<(), ServiceError> {
        tokio::select! {
            sent = self.deliver(item) => sent,
            // Its place is for another source.
            () = voice.acks.closed() => Err(self.ended()),
        }
    }

    /// Sends something to the session. A stream that never has anything to say waits for no room.
    async fn deliver(&mut self, item: Item) -> Result<(), ServiceError> {
        let open = (!self.opened).then_some(Item::Open(self.delivery));
        for item in open.into_iter().chain([item]) {
            let input = Input {
                stream: self.stream,
                item,
            };
            let sent = self.entry.handle.motion.send(input).await;
            sent.map_err(|_| self.ended())?;
            self.opened = true;
        }
        Ok(())
    }

    /// Acknowledges.
    fn tell(&mut self, voice: &Voice) -> Progress {
        let progress = *self.progress.borrow_and_update();
        let progress = match progress.stream == self.stream {
            true => progress,
            false => Progress::default(),
        };
        let ack = v1::Ack {
            sequence: match self.delivery {
                Delivery::Each => self.queued,
                Delivery::Live { .. } => progress.used,
            },
            step: self.entry.handle.outlets.latest().frame.step,
            duplicates: self.door.duplicates(),
            reordered: progress.reordered,
            late: progress.late,
            refused: progress.refused,
            delay_seconds: progress.delay,
            clock_offset_seconds: progress.offset,
            clock_skew: progress.skew,
        };
        let metrics = &self.shared.metrics;
        let before = std::mem::replace(&mut self.told, ack);
        metrics.fated(Fate::Duplicate, ack.duplicates - before.duplicates);
        metrics.fated(
            Fate::Reordered,
            ack.reordered.saturating_sub(before.reordered),
        );
        metrics.fated(Fate::Late, ack.late.saturating_sub(before.late));
        metrics.fated(Fate::Refused, ack.refused.saturating_sub(before.refused));
        if self.delivery != Delivery::Each && ack.step > before.step {
            metrics.live(&progress);
        }
        voice.acks.send_replace(ack);
        progress
    }

    fn ended(&self) -> ServiceError {
        ServiceError::Ended(self.entry.handle.outlets.end())
    }
}
