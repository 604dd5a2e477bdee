//! One reader of a session: what it gets, and when.

use std::{collections::VecDeque, mem::size_of, sync::Arc};

use nalgebra::Vector3;
use prost::Message as _;
use sinew_proto::v1::{
    self, GoodbyeReason, SubscribeResponse, WatchRequest, subscribe_response::Item,
    watch_request::Item as Asked,
};
use tokio::{
    sync::{
        broadcast::{self, error::RecvError},
        mpsc, watch,
    },
    time::Instant,
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Status, Streaming};

use super::{
    Shared,
    frames::{self, Fit},
    mesh::{Mode, Wanted, events_after},
    session::count,
};
use crate::{
    end::End,
    error::{ServiceError, invalid},
    metrics::Metrics,
    outlets::{Outlets, Published},
    registry::Entry,
    status,
};

/// Bytes of a chunk's message beside its data.
const CHUNK_OVERHEAD: usize = 64;
/// Frames that may wait in order; with one more, only the newest is left.
const IN_ORDER: usize = 8;
/// Frames and bytes of positions that may wait for a reader that must get all.
const LOSSLESS: usize = 64;
const LOSSLESS_BYTES: usize = 64 << 20;
/// Frames that a reader takes before it gives credit, and that it may give credit for at once.
const FIRST_CREDIT: u32 = 3;
const MOST_CREDIT: u32 = 64;
/// Events in one item, and bytes of them.
const EVENTS: usize = 1000;
const EVENT_BYTES: usize = 256 << 10;

pub(super) type Told = Result<SubscribeResponse, Status>;

/// Why a reader's stream ends before the session.
enum Stop {
    /// The reader left.
    Gone,
    /// It is told why.
    Refused(ServiceError),
}

impl From<ServiceError> for Stop {
    fn from(error: ServiceError) -> Self {
        Self::Refused(error)
    }
}

/// The task behind one stream. It never waits for the reader alone, so that what the session gives out is taken at
/// once, and kept or dropped as the mode says.
pub(super) struct Reader {
    entry: Arc<Entry>,
    wanted: Wanted,
    recent: broadcast::Receiver<Arc<Published>>,
    end: watch::Receiver<Option<End>>,
    over: Option<End>,
    inbox: Option<Streaming<WatchRequest>>,
    /// Frames to be sent, oldest first.
    queue: VecDeque<Arc<Published>>,
    /// The next one: no newer frame takes its place.
    staged: Option<Arc<Published>>,
    /// One item's messages.
    out: VecDeque<SubscribeResponse>,
    /// Frames that the reader takes; `None` for any number.
    credit: Option<u32>,
    /// The mesh at the reader's; `None` where it needs a keyframe.
    held: Option<Fit>,
    keyframe_sent: Instant,
    /// Sequences of the last frame and of the last event sent.
    last: u64,
    last_event: u64,
    metrics: Arc<Metrics>,
}

impl Reader {
    /// Starts the task of a reader, whose requests are read on where it watches.
    pub(super) fn start(
        shared: &Shared,
        wanted: Wanted,
        inbox: Option<Streaming<WatchRequest>>,
    ) -> Result<ReceiverStream<Told>, ServiceError> {
        let entry = shared.registry.get(&wanted.session)?;
        let outlets = &entry.handle.outlets;
        let (recent, end) = outlets.subscribe();
        let first = outlets.latest();
        let last_event = first_event(outlets, &first, wanted.after_event)?;
        let queue = match wanted.mode {
            Mode::InOrder | Mode::Latest | Mode::Lossless => VecDeque::from([first]),
            Mode::EventsOnly => VecDeque::new(),
        };
        // One slot: what waits here is the only item between the newest state and the transport.
        let (outbox, told) = mpsc::channel(1);
        let reader = Self {
            entry,
            recent,
            end,
            over: None,
            credit: inbox.is_some().then_some(FIRST_CREDIT),
            inbox,
            queue,
            staged: None,
            out: VecDeque::new(),
            held: None,
            keyframe_sent: Instant::now(),
            last: 0,
            last_event,
            metrics: Arc::clone(&shared.metrics),
            wanted,
        };
        shared.tasks.spawn(reader.run(outbox));
        Ok(ReceiverStream::new(told))
    }

    async fn run(mut self, outbox: mpsc::Sender<Told>) {
        self.metrics.subscribers.inc();
        let stopped = self.serve(&outbox).await;
        self.metrics.subscribers.dec();
        let farewell = match stopped {
            Ok(farewell) => farewell,
            Err(Stop::Refused(error)) => Err(error.into()),
            Err(Stop::Gone) => return,
        };
        // What waited is let go before the reader takes its last item, which may be long.
        drop(self);
        outbox.send(farewell).await.ok(); // the reader may have left
    }

    /// Sends until the session is over or the reader stops; the stream's last word.
    async fn serve(&mut self, outbox: &mpsc::Sender<Told>) -> Result<Told, Stop> {
        loop {
            let news = self.has_news();
            if let (Some(end), false) = (&self.over, news) {
                return Ok(self.farewell(end));
            }
            tokio::select! {
                received = self.recent.recv(), if self.over.is_none() => self.receive(received)?,
                asked = ask(&mut self.inbox) => self.answer(asked?)?,
                room = outbox.reserve(), if news => {
                    let room = room.map_err(|_| Stop::Gone)?;
                    if self.out.is_empty() {
                        compose(self)?;
                    }
                    if let Some(message) = self.out.pop_front() {
                        room.send(Ok(message));
                    }
                }
                end = ended(&mut self.end), if self.over.is_none() => {
                    // The last frame is news too: it was published before the end.
                    while let Ok(published) = self.recent.try_recv() {
                        self.offer(published)?;
                    }
                    self.over = Some(end);
                }
                () = outbox.closed() => return Err(Stop::Gone),
            }
        }
    }

    fn outlets(&self) -> &Outlets {
        &self.entry.handle.outlets
    }

    /// Whether something could be sent now.
    fn has_news(&self) -> bool {
        !self.out.is_empty()
            || self.staged.is_some()
            || (!self.queue.is_empty() && self.credit != Some(0))
            || self.last_event < self.outlets().event_range().1
    }

    fn receive(&mut self, received: Result<Arc<Published>, RecvError>) -> Result<(), Stop> {
        match received {
            Ok(published) => self.offer(published),
            Err(RecvError::Lagged(_)) if self.wanted.mode == Mode::Lossless => {
                Err(ServiceError::SubscriberTooSlow.into())
            }
            Err(RecvError::Lagged(_)) => {
                self.recent = self.recent.resubscribe();
                self.queue.clear();
                let newest = self.outlets().latest();
                self.offer(newest)
            }
            Err(RecvError::Closed) => {
                self.over = Some(End::Deleted);
                Ok(())
            }
        }
    }

    /// Takes a frame, or not, as the mode says.
    fn offer(&mut self, published: Arc<Published>) -> Result<(), Stop> {
        let newest = self.queue.back().or(self.staged.as_ref());
        if published.sequence <= newest.map_or(self.last, |newest| newest.sequence) {
            return Ok(()); // older than the keyframe
        }
        match self.wanted.mode {
            Mode::EventsOnly => return Ok(()),
            Mode::Latest => self.queue.clear(),
            Mode::InOrder if self.queue.len() >= IN_ORDER => self.queue.clear(),
            Mode::InOrder => {}
            Mode::Lossless => {
                let frame = &published.frame;
                let bytes = size_of::<Vector3<f64>>() * (frame.vertices.len() + frame.points.len());
                if self.queue.len() >= (LOSSLESS_BYTES / bytes.max(1)).clamp(2, LOSSLESS) {
                    return Err(ServiceError::SubscriberTooSlow.into());
                }
            }
        }
        self.queue.push_back(published);
        Ok(())
    }

    fn answer(&mut self, asked: Option<Asked>) -> Result<(), Stop> {
        match asked {
            None => self.inbox = None,
            Some(Asked::Open(_)) => return Err(ServiceError::WatchOpenRepeated.into()),
            Some(Asked::Resync(_)) => self.held = None,
            Some(Asked::Credit(v1::Credit { frames })) => {
                if !(1..=MOST_CREDIT).contains(&frames) {
                    let (problem, remedy) = (format!("is {frames}"), "give 1 to 64");
                    let field = "credit.frames";
                    return Err(invalid("VALUE_OUT_OF_RANGE", field, problem, remedy).into());
                }
                let credit = self.credit.unwrap_or(0) + frames;
                self.credit = Some(credit.min(MOST_CREDIT));
            }
        }
        Ok(())
    }

    /// Puts an item out, in chunks where it is larger than the reader takes.
    fn put(&mut self, item: Item) {
        let response = SubscribeResponse { item: Some(item) };
        let size = response.encoded_len();
        if size <= self.wanted.message {
            return self.out.push_back(response);
        }
        let encoded = bytes::Bytes::from(response.encode_to_vec());
        let length = self.wanted.message - CHUNK_OVERHEAD;
        let chunks = size.div_ceil(length);
        self.out.extend((0..chunks).map(|index| {
            let chunk = v1::Chunk {
                index: count(index),
                count: count(chunks),
                data: encoded.slice(index * length..size.min((index + 1) * length)),
            };
            SubscribeResponse {
                item: Some(Item::Chunk(chunk)),
            }
        }));
    }

    fn farewell(&self, end: &End) -> Told {
        let reason = match end {
            End::Deleted => GoodbyeReason::Deleted,
            End::Shutdown => GoodbyeReason::Shutdown,
            End::Faulted(_) => return Err(ServiceError::Ended(end.clone()).into()),
        };
        let goodbye = v1::Goodbye {
            reason: reason.into(),
            last_sequence: self.outlets().latest().sequence,
            last_event: self.last_event,
        };
        Ok(SubscribeResponse {
            item: Some(Item::Goodbye(goodbye)),
        })
    }
}

/// The sequence after which a reader's events begin.
fn first_event(
    outlets: &Outlets,
    first: &Published,
    after: Option<u64>,
) -> Result<u64, ServiceError> {
    let Some(after) = after else {
        return Ok(first.event_sequence);
    };
    let (oldest, last) = outlets.event_range();
    if after > last {
        let problem = format!("is {after}, and the session's last event is {last}");
        let remedy = "give the sequence of an event seen in this session, or 0 for all";
        return Err(invalid("EVENT_UNKNOWN", "after_event", problem, remedy));
    }
    if after + 1 < oldest {
        return Err(ServiceError::EventsTrimmed { after, oldest });
    }
    Ok(after)
}

/// Puts the next item out. Events come before the frame of their step.
fn compose(reader: &mut Reader) -> Result<(), Stop> {
    if reader.staged.is_none() && reader.credit != Some(0) {
        reader.staged = reader.queue.pop_front();
        if let (Some(_), Some(credit)) = (&reader.staged, &mut reader.credit) {
            *credit -= 1;
        }
    }
    let told = |staged: &mut Arc<Published>| staged.event_sequence <= reader.last_event;
    if let Some(published) = reader.staged.take_if(told) {
        compose_frame(reader, &published);
        return Ok(());
    }
    let events = events_after(reader.outlets(), reader.last_event, EVENTS, EVENT_BYTES)?;
    if let Some(last) = events.last() {
        reader.last_event = last.sequence;
        reader.put(Item::Events(v1::Events { events }));
    }
    Ok(())
}

fn compose_frame(reader: &mut Reader, published: &Published) {
    reader.metrics.frames_sent.inc();
    if reader.last > 0 {
        let missed = published.sequence - reader.last - 1;
        reader.metrics.frames_missed.inc_by(missed);
    }
    reader.last = published.sequence;
    let fit = Fit::of(&published.frame.layout);
    let due = reader.keyframe_sent.elapsed() >= reader.wanted.keyframes;
    let held = reader.held.replace(fit).filter(|_| !due);
    if !held.is_some_and(|held| compose_change(reader, published, held, fit)) {
        reader.keyframe_sent = Instant::now();
        let keyframe = reader.wanted.keyframe(&reader.entry, published);
        reader.put(Item::Keyframe(keyframe));
    }
}

/// Puts out what leads from the mesh that the reader holds to a frame; `false` where a keyframe must.
fn compose_change(reader: &mut Reader, published: &Published, held: Fit, fit: Fit) -> bool {
    let frame = reader.wanted.frame(published);
    if held == fit || !reader.wanted.mesh {
        reader.put(Item::Frame(frame));
        return true;
    }
    let turns = (held.epoch == fit.epoch)
        .then(|| reader.outlets().turns(fit.epoch, held.version, fit.version))
        .flatten();
    let Some(turns) = turns else {
        return false;
    };
    let mut frame = Some(frame);
    for turn in turns {
        let own = frame.take_if(|_| turn.step == published.frame.step);
        reader.put(Item::Patch(frames::patch(&turn, own)));
    }
    if let Some(frame) = frame {
        reader.put(Item::Frame(frame));
    }
    true
}

async fn ended(end: &mut watch::Receiver<Option<End>>) -> End {
    let ended = end.wait_for(Option::is_some).await;
    let end = ended.ok().and_then(|end| end.clone());
    end.unwrap_or(End::Deleted)
}

/// The reader's next request; `None` where it makes no more. Without a stream of requests, never.
async fn ask(inbox: &mut Option<Streaming<WatchRequest>>) -> Result<Option<Asked>, Stop> {
    match inbox {
        Some(requests) => Ok(next(requests).await?),
        None => std::future::pending().await,
    }
}

/// The next request; `None` where the client is done or gone.
pub(super) async fn next(
    requests: &mut Streaming<WatchRequest>,
) -> Result<Option<Asked>, ServiceError> {
    loop {
        match requests.message().await {
            // An item of a newer API than ours is passed over.
            Ok(Some(WatchRequest { item: None })) => {}
            Ok(Some(WatchRequest { item })) => return Ok(item),
            Ok(None) => return Ok(None),
            Err(status) => return status::unreadable(&status).map_or(Ok(None), Err),
        }
    }
}
