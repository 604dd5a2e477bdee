//! Rerun's proxy protocol, for reading only.

use std::sync::Arc;

use futures::Stream;
use futures::stream::{self, BoxStream};
use re_protos::log_msg::v1alpha1::LogMsg;
use re_protos::sdk_comms::v1alpha1 as proto;
use re_protos::sdk_comms::v1alpha1::message_proxy_service_server::MessageProxyService;
use tonic::{Request, Response, Status, Streaming};

use crate::hub::{Full, Hub, Interest, Subscription};
use crate::publisher::Mailbox;

/// Serves what was recorded. The codes here belong to Rerun's protocol, not to Sinew's.
pub struct Feed {
    hub: Arc<Hub>,
    mailbox: Arc<Mailbox>,
}

impl Feed {
    pub(crate) fn new(hub: Arc<Hub>, mailbox: Arc<Mailbox>) -> Self {
        Self { hub, mailbox }
    }
}

/// The protocol cannot say which recording a viewer wants, but a browser says which page it asks from: a session's page
/// gets that session and is not sent the others.
fn interest_of<T>(request: &Request<T>) -> Interest {
    let page = request.metadata().get("referer");
    let session = page.and_then(|page| session_of(page.to_str().ok()?));
    session.map_or(Interest::Everything, |id| Interest::Session(id.to_owned()))
}

/// The `id` of `…/sessions/{id}`, whatever follows.
fn session_of(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once("://")?;
    let (_, path) = rest.split_once('/')?;
    let id = path.strip_prefix("sessions/")?;
    let id = id.split(['?', '#', '/']).next()?;
    (!id.is_empty()).then_some(id)
}

fn messages(from: Subscription) -> impl Stream<Item = Result<proto::ReadMessagesResponse, Status>> {
    stream::unfold(from, async |mut from| {
        let msg = Some(from.next().await?);
        let log_msg = Some(LogMsg { msg });
        Some((Ok(proto::ReadMessagesResponse { log_msg }), from))
    })
}

fn read_only() -> Status {
    Status::permission_denied(
        "this server shows its own sessions and takes no recordings from others",
    )
}

#[tonic::async_trait]
impl MessageProxyService for Feed {
    async fn write_messages(
        &self,
        _: Request<Streaming<proto::WriteMessagesRequest>>,
    ) -> Result<Response<proto::WriteMessagesResponse>, Status> {
        Err(read_only())
    }

    type ReadMessagesStream = BoxStream<'static, Result<proto::ReadMessagesResponse, Status>>;

    async fn read_messages(
        &self,
        request: Request<proto::ReadMessagesRequest>,
    ) -> Result<Response<Self::ReadMessagesStream>, Status> {
        let subscription = self.hub.subscribe(interest_of(&request));
        let subscription = subscription.map_err(|Full { viewers }| {
            Status::resource_exhausted(format!(
                "{viewers} viewers are connected already; close one"
            ))
        })?;
        self.mailbox.join();
        Ok(Response::new(Box::pin(messages(subscription))))
    }

    async fn write_table(
        &self,
        _: Request<proto::WriteTableRequest>,
    ) -> Result<Response<proto::WriteTableResponse>, Status> {
        Err(read_only())
    }

    type ReadTablesStream = stream::Empty<Result<proto::ReadTablesResponse, Status>>;

    async fn read_tables(
        &self,
        _: Request<proto::ReadTablesRequest>,
    ) -> Result<Response<Self::ReadTablesStream>, Status> {
        Ok(Response::new(stream::empty()))
    }
}

#[cfg(test)]
mod tests {
    use super::session_of;

    #[test]
    fn a_sessions_page_names_its_session() {
        for page in [
            "http://127.0.0.1:8080/sessions/walk",
            "https://host/sessions/walk?renderer=webgl",
            "https://host/sessions/walk/#x",
        ] {
            assert_eq!(session_of(page), Some("walk"), "{page}");
        }
    }

    #[test]
    fn any_other_page_names_none() {
        for page in [
            "",
            "http://host",
            "http://host/",
            "http://host/sessions/",
            "sessions/walk",
        ] {
            assert_eq!(session_of(page), None, "{page}");
        }
    }
}
