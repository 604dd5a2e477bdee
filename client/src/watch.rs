//! A subscription in the reader's control.

use futures::{Stream, StreamExt as _, channel::mpsc};
use sinew_proto::v1::{
    Credit, Resync, SubscribeRequest, WatchMode, WatchOpen, WatchRequest, watch_request::Item,
};

use crate::{ClientError, Subscription, Update, subscription::Received};

/// Requests that may wait for the connection; credit that finds no room waits here.
const REQUESTS: usize = 8;

/// Made by [`crate::Client::watch`].
#[derive(Debug)]
pub struct Watch {
    subscription: Subscription,
    asks: mpsc::Sender<WatchRequest>,
    /// Credit to be given.
    owed: u32,
    /// A keyframe was asked for, and none came yet.
    asked: bool,
}

impl Watch {
    pub(crate) fn requests(
        subscription: SubscribeRequest,
        mode: WatchMode,
    ) -> (
        mpsc::Sender<WatchRequest>,
        impl Stream<Item = WatchRequest> + use<>,
    ) {
        let open = Item::Open(WatchOpen {
            subscription: Some(subscription),
            mode: mode.into(),
        });
        let (asks, asked) = mpsc::channel(REQUESTS);
        let first = std::future::ready(request(open));
        let requests = futures::stream::once(first).chain(asked);
        (asks, requests)
    }

    pub(crate) fn new(subscription: Subscription, asks: mpsc::Sender<WatchRequest>) -> Self {
        Self {
            subscription,
            asks,
            owed: 0,
            asked: false,
        }
    }

    /// The next update; `None` after the Goodbye. Asking for it gives credit for the one before: whoever takes long over
    /// an update gets the newest next. Where something does not fit the mesh, a keyframe is asked for. Cancel safe.
    ///
    /// # Errors
    /// As [`Subscription::next`]; [`ClientError::Refused`] with `SUBSCRIBER_TOO_SLOW` where every frame was to arrive and
    /// could not.
    pub async fn next(&mut self) -> Result<Option<Update>, ClientError> {
        loop {
            self.owed += self.subscription.take_used();
            if self.owed > 0 && self.ask(Item::Credit(Credit { frames: self.owed })) {
                self.owed = 0;
            }
            let lost = self.subscription.mirror().needs_resync();
            self.asked = lost && (self.asked || self.ask(Item::Resync(Resync {})));
            match self.subscription.receive().await? {
                Received::Update(update) => return Ok(Some(update)),
                Received::Passed => {}
                Received::End => return Ok(None),
            }
        }
    }

    /// Asks for a keyframe.
    pub fn resync(&mut self) {
        self.ask(Item::Resync(Resync {}));
    }

    /// The subscription behind it: its mesh, its counts, its last event.
    pub fn subscription(&self) -> &Subscription {
        &self.subscription
    }

    fn ask(&mut self, item: Item) -> bool {
        self.asks.try_send(request(item)).is_ok()
    }
}

fn request(item: Item) -> WatchRequest {
    WatchRequest { item: Some(item) }
}
