//! MeshService: a session's frames to whoever subscribes.

use std::{sync::Arc, time::Duration};

use prost::Message as _;
use sinew_proto::v1::{
    self, Content, GoodbyeReason, Precision, mesh_service_server::MeshService,
    subscribe_response::Item,
};
use tokio::{
    sync::{
        broadcast::{self, error::RecvError},
        mpsc, watch,
    },
    time::Instant,
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status};

use super::{Shared, session::count};
use crate::{
    convert::known,
    end::End,
    error::{ServiceError, invalid},
    metrics::Metrics,
    outlets::Published,
    registry::Entry,
    timing::now_nanos,
};

/// Items larger than this come in chunks where the reader does not say: gRPC libraries take 4 MiB.
const DEFAULT_MESSAGE: usize = (4 << 20) - (64 << 10);
const SMALLEST_MESSAGE: usize = 64 << 10;
/// Bytes of a chunk's message beside its data.
const CHUNK_OVERHEAD: usize = 64;
/// Seconds between keyframes where the reader does not say.
const DEFAULT_KEYFRAMES: f64 = 10.0;

type Told = Result<v1::SubscribeResponse, Status>;

#[tonic::async_trait]
impl MeshService for Shared {
    type SubscribeStream = ReceiverStream<Told>;

    async fn subscribe(
        &self,
        request: Request<v1::SubscribeRequest>,
    ) -> Result<Response<Self::SubscribeStream>, Status> {
        let request = request.into_inner();
        let entry = self.registry.get(&request.session)?;
        let wanted = Wanted::read(&request)?;
        // One slot: what waits here is the only frame between the newest state and the transport.
        let (outbox, told) = mpsc::channel(1);
        let (recent, end) = entry.handle.outlets.subscribe();
        let subscriber = Subscriber {
            entry,
            wanted,
            recent,
            end,
            outbox,
            last: 0,
            metrics: Arc::clone(&self.metrics),
        };
        self.tasks.spawn(subscriber.run());
        Ok(Response::new(ReceiverStream::new(told)))
    }
}

/// What a reader asked for.
struct Wanted {
    mesh: bool,
    points: bool,
    precision: Precision,
    keyframes: Duration,
    message: usize,
}

impl Wanted {
    fn read(request: &v1::SubscribeRequest) -> Result<Self, ServiceError> {
        let content = known::<Content>(request.content, "content")?;
        let keyframes = match request.keyframe_interval_seconds {
            0.0 => DEFAULT_KEYFRAMES,
            given if (1.0..=86_400.0).contains(&given) => given,
            given => {
                let field = "keyframe_interval_seconds";
                return Err(invalid(
                    "VALUE_OUT_OF_RANGE",
                    field,
                    format!("is {given}"),
                    "give 1 to 86,400 s",
                ));
            }
        };
        let message = match request.max_message_bytes as usize {
            0 => DEFAULT_MESSAGE,
            given if given >= SMALLEST_MESSAGE => given,
            given => {
                let field = "max_message_bytes";
                return Err(invalid(
                    "VALUE_OUT_OF_RANGE",
                    field,
                    format!("is {given}"),
                    "give 65,536 or more",
                ));
            }
        };
        Ok(Self {
            mesh: content != Content::Points,
            points: content != Content::Mesh,
            precision: known(request.precision, "precision")?,
            keyframes: Duration::from_secs_f64(keyframes),
            message,
        })
    }
}

/// The task behind one stream.
struct Subscriber {
    entry: Arc<Entry>,
    wanted: Wanted,
    recent: broadcast::Receiver<Arc<Published>>,
    end: watch::Receiver<Option<End>>,
    outbox: mpsc::Sender<Told>,
    /// Sequence of the last frame sent.
    last: u64,
    metrics: Arc<Metrics>,
}

/// The reader is gone.
struct Gone;

impl Subscriber {
    async fn run(mut self) {
        self.metrics.subscribers.inc();
        // Whether it ended with a goodbye or because the reader left, there is nobody to tell.
        let _ = self.serve().await;
        self.metrics.subscribers.dec();
    }

    async fn serve(&mut self) -> Result<(), Gone> {
        let first = self.entry.handle.outlets.latest();
        let mut keyframe_sent = Instant::now();
        self.send(Item::Keyframe(self.keyframe(&first)), &first)
            .await?;
        loop {
            // Room first, then the newest frame: nothing grows old while it waits for the transport.
            let room = self.outbox.reserve().await.map_err(|_| Gone)?;
            drop(room);
            match self.next().await? {
                Next::Frame(published) => {
                    let item = if keyframe_sent.elapsed() >= self.wanted.keyframes {
                        keyframe_sent = Instant::now();
                        Item::Keyframe(self.keyframe(&published))
                    } else {
                        Item::Frame(self.frame(&published))
                    };
                    self.send(item, &published).await?;
                }
                Next::End(end) => return self.part(&end).await,
            }
        }
    }

    async fn next(&mut self) -> Result<Next, Gone> {
        loop {
            tokio::select! {
                biased; // frames before the end: the last frame is news too
                received = self.recent.recv() => match received {
                    Ok(published) if published.sequence > self.last => return Ok(Next::Frame(published)),
                    Ok(_) => {} // older than the keyframe
                    Err(RecvError::Lagged(_)) => {
                        // Skip to the newest frame.
                        self.recent = self.recent.resubscribe();
                        let published = self.entry.handle.outlets.latest();
                        if published.sequence > self.last {
                            return Ok(Next::Frame(published));
                        }
                    }
                    Err(RecvError::Closed) => return Ok(Next::End(End::Deleted)),
                },
                ended = self.end.wait_for(Option::is_some) => {
                    let end = ended.ok().and_then(|end| end.clone());
                    // Published between the two looks.
                    if let Ok(published) = self.recent.try_recv() {
                        if published.sequence > self.last {
                            return Ok(Next::Frame(published));
                        }
                        continue;
                    }
                    return Ok(Next::End(end.unwrap_or(End::Deleted)));
                }
                () = self.outbox.closed() => return Err(Gone),
            }
        }
    }

    async fn send(&mut self, item: Item, published: &Published) -> Result<(), Gone> {
        self.metrics.frames_sent.inc();
        if self.last > 0 {
            self.metrics
                .frames_missed
                .inc_by(published.sequence - self.last - 1);
        }
        self.last = published.sequence;
        self.put(v1::SubscribeResponse { item: Some(item) }).await
    }

    /// Sends an item, in chunks where it is larger than the reader takes.
    async fn put(&self, response: v1::SubscribeResponse) -> Result<(), Gone> {
        let size = response.encoded_len();
        if size <= self.wanted.message {
            return self.outbox.send(Ok(response)).await.map_err(|_| Gone);
        }
        let encoded = bytes::Bytes::from(response.encode_to_vec());
        let length = self.wanted.message - CHUNK_OVERHEAD;
        let chunks = size.div_ceil(length);
        for index in 0..chunks {
            let data = encoded.slice(index * length..size.min((index + 1) * length));
            let chunk = v1::Chunk {
                index: count(index),
                count: count(chunks),
                data,
            };
            let response = v1::SubscribeResponse {
                item: Some(Item::Chunk(chunk)),
            };
            self.outbox.send(Ok(response)).await.map_err(|_| Gone)?;
        }
        Ok(())
    }

    async fn part(&mut self, end: &End) -> Result<(), Gone> {
        let reason = match end {
            End::Deleted => GoodbyeReason::Deleted,
            End::Shutdown => GoodbyeReason::Shutdown,
            End::Faulted(_) => {
                let status = ServiceError::Ended(end.clone()).into();
                return self.outbox.send(Err(status)).await.map_err(|_| Gone);
            }
        };
        let last_sequence = self.entry.handle.outlets.latest().sequence;
        let goodbye = v1::Goodbye {
            reason: reason.into(),
            last_sequence,
        };
        self.put(v1::SubscribeResponse {
            item: Some(Item::Goodbye(goodbye)),
        })
        .await
    }

    fn keyframe(&self, published: &Published) -> v1::Keyframe {
        let grid = self
            .wanted
            .mesh
            .then(|| self.entry.handle.outlets.grid(&published.frame.layout));
        v1::Keyframe {
            grid,
            labels: self.entry.labels.clone(),
            frame: Some(self.frame(published)),
        }
    }

    fn frame(&self, published: &Published) -> v1::Frame {
        let frame = &published.frame;
        let Wanted {
            mesh,
            points,
            precision,
            ..
        } = self.wanted;
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
            vertices: mesh.then(|| published.vertices(precision)),
            points: points.then(|| published.points(precision)),
            point_states: if points {
                published.point_states()
            } else {
                bytes::Bytes::new()
            },
            timing: Some(v1::Timing {
                received: published.timing.received,
                step_started: published.timing.started,
                published: published.timing.published,
                sent: now_nanos(),
            }),
        }
    }
}

enum Next {
    Frame(Arc<Published>),
    End(End),
}
