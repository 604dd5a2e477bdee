//! MeshService: a session's frames and facts to whoever reads them.

use std::time::Duration;

use prost::Message as _;
use sinew_proto::v1::{
    self, Content, Precision, WatchMode, mesh_service_server::MeshService, watch_request::Item,
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};

use super::{
    Shared,
    page::{page_size, page_token, read_token},
    reader::{self, Reader, Told},
};
use crate::{
    convert::known,
    error::{ServiceError, invalid},
    outlets::Outlets,
};

/// Items larger than this come in chunks where the reader does not say: gRPC libraries take 4 MiB.
const DEFAULT_MESSAGE: usize = (4 << 20) - (64 << 10);
const SMALLEST_MESSAGE: usize = 64 << 10;
/// Seconds between keyframes where the reader does not say.
const DEFAULT_KEYFRAMES: f64 = 10.0;
/// Events on a page where the request does not say, and at most.
const PAGE: (usize, usize) = (1000, 10_000);
/// Bytes of events on a page, so that it fits any gRPC library's limit.
const PAGE_BYTES: usize = 2 << 20;

#[tonic::async_trait]
impl MeshService for Shared {
    type SubscribeStream = ReceiverStream<Told>;
    type WatchStream = ReceiverStream<Told>;

    async fn subscribe(
        &self,
        request: Request<v1::SubscribeRequest>,
    ) -> Result<Response<Self::SubscribeStream>, Status> {
        let wanted = Wanted::read(&request.into_inner())?;
        Ok(Response::new(Reader::start(self, wanted, None)?))
    }

    async fn watch(
        &self,
        request: Request<Streaming<v1::WatchRequest>>,
    ) -> Result<Response<Self::WatchStream>, Status> {
        let mut requests = request.into_inner();
        let open = match reader::next(&mut requests).await? {
            Some(Item::Open(open)) => open,
            Some(Item::Credit(_) | Item::Resync(_)) | None => {
                return Err(ServiceError::WatchOpenMissing.into());
            }
        };
        let mode = match known(open.mode, "open.mode")? {
            WatchMode::Unspecified | WatchMode::Latest => Mode::Latest,
            WatchMode::Lossless => Mode::Lossless,
            WatchMode::EventsOnly => Mode::EventsOnly,
        };
        let wanted = Wanted {
            mode,
            ..Wanted::read(&open.subscription.unwrap_or_default())?
        };
        Ok(Response::new(Reader::start(self, wanted, Some(requests))?))
    }

    async fn get_keyframe(
        &self,
        request: Request<v1::GetKeyframeRequest>,
    ) -> Result<Response<v1::Keyframe>, Status> {
        let v1::GetKeyframeRequest {
            session,
            content,
            precision,
            max_message_bytes,
        } = request.into_inner();
        let wanted = Wanted::read(&v1::SubscribeRequest {
            session,
            content,
            precision,
            max_message_bytes,
            ..v1::SubscribeRequest::default()
        })?;
        let entry = self.registry.get(&wanted.session)?;
        let keyframe = wanted.keyframe(&entry, &entry.handle.outlets.latest());
        let size = keyframe.encoded_len();
        if size > wanted.message {
            let limit = wanted.message;
            let what = format!("the keyframe has {size} bytes, and max_message_bytes is {limit}");
            return Err(ServiceError::MessageTooLarge(what).into());
        }
        Ok(Response::new(keyframe))
    }

    async fn list_events(
        &self,
        request: Request<v1::ListEventsRequest>,
    ) -> Result<Response<v1::ListEventsResponse>, Status> {
        let request = request.into_inner();
        let entry = self.registry.get(&request.session)?;
        Ok(Response::new(list(&entry.handle.outlets, &request)?))
    }
}

/// One page of events.
fn list(
    outlets: &Outlets,
    request: &v1::ListEventsRequest,
) -> Result<v1::ListEventsResponse, ServiceError> {
    let size = page_size(request.page_size, PAGE)?;
    let (oldest_sequence, last_sequence) = outlets.event_range();
    let after = match &*request.page_token {
        "" => (request.after_event).unwrap_or(oldest_sequence.saturating_sub(1)),
        token => read_token(token)?
            .parse()
            .map_err(|_| super::page::forged(token))?,
    };
    let events = events_after(outlets, after, size, PAGE_BYTES)?;
    let last = events.last().map_or(after, |event| event.sequence);
    Ok(v1::ListEventsResponse {
        next_page_token: if last < last_sequence {
            page_token(&last.to_string())
        } else {
            String::new()
        },
        events,
        oldest_sequence,
        last_sequence,
    })
}

pub(super) fn events_after(
    outlets: &Outlets,
    after: u64,
    most: usize,
    bytes: usize,
) -> Result<Vec<v1::Event>, ServiceError> {
    let found = outlets.events_after(after, most, bytes);
    found.map_err(|trimmed| ServiceError::EventsTrimmed {
        after,
        oldest: trimmed.oldest,
    })
}

/// What a reader must get.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// As Subscribe: in order as long as it keeps up, then the newest.
    InOrder,
    /// Whenever it can take one, the newest frame.
    Latest,
    /// Every frame.
    Lossless,
    /// Events alone.
    EventsOnly,
}

/// What a reader asked for.
pub(super) struct Wanted {
    pub(super) session: String,
    pub(super) mode: Mode,
    pub(super) mesh: bool,
    pub(super) points: bool,
    pub(super) precision: Precision,
    pub(super) keyframes: Duration,
    pub(super) message: usize,
    pub(super) after_event: Option<u64>,
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
            session: request.session.clone(),
            mode: Mode::InOrder,
            mesh: content != Content::Points,
            points: content != Content::Mesh,
            precision: known(request.precision, "precision")?,
            keyframes: Duration::from_secs_f64(keyframes),
            message,
            after_event: request.after_event,
        })
    }
}
