//! From sessions to the one thread that encodes.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::Shown;
use crate::happenings::Happening;
use crate::hub::Hub;
use crate::recorder::Recorder;

/// Steps of a session that changed its mesh and wait for the thread. With more, the oldest are not shown; only a thread
/// that is held up for as many steps comes to that.
const HAPPENINGS: usize = 1024;

/// One slot per session, for the frame to be shown next, and a queue for what must not be missed between two frames.
#[derive(Default)]
pub(crate) struct Mailbox {
    mail: Mutex<Mail>,
    bell: Condvar,
}

#[derive(Default)]
struct Mail {
    opened: Vec<(u64, Recorder)>,
    shown: BTreeMap<u64, Shown>,
    happened: BTreeMap<u64, VecDeque<Happening>>,
    ended: Vec<u64>,
    /// Someone came who wants what is there already.
    joined: bool,
    closing: bool,
}

impl Mail {
    fn is_empty(&self) -> bool {
        let Self {
            opened,
            shown,
            happened: _, // each comes with a frame
            ended,
            joined,
            closing,
        } = self;
        opened.is_empty() && shown.is_empty() && ended.is_empty() && !joined && !closing
    }
}

impl Mailbox {
    fn lock(&self) -> MutexGuard<'_, Mail> {
        self.mail.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn join(&self) {
        self.lock().joined = true;
        self.bell.notify_one();
    }

    pub(crate) fn close(&self) {
        self.lock().closing = true;
        self.bell.notify_one();
    }

    fn take(&self) -> Mail {
        let empty = |mail: &mut Mail| mail.is_empty();
        let mail = self.bell.wait_while(self.lock(), empty);
        let mut mail = mail.unwrap_or_else(PoisonError::into_inner);
        let closing = mail.closing;
        let taken = std::mem::take(&mut *mail);
        mail.closing = closing;
        taken
    }

    /// Sleeps until then, or until the mailbox closes.
    fn rest_until(&self, then: Instant) {
        let mut mail = self.lock();
        while let Some(left) = then.checked_duration_since(Instant::now())
            && !left.is_zero()
            && !mail.closing
        {
            let woken = self.bell.wait_timeout(mail, left);
            mail = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// A session's way to its viewers and its file. Dropping it ends the recording, after what was published last.
pub struct Publisher {
    mailbox: Arc<Mailbox>,
    key: u64,
    replaced: AtomicU64,
}

impl Publisher {
    pub(crate) fn new(mailbox: Arc<Mailbox>, key: u64, recorder: Recorder) -> Self {
        mailbox.lock().opened.push((key, recorder));
        Self {
            mailbox,
            key,
            replaced: AtomicU64::new(0),
        }
    }

    /// Leaves a frame to be shown. It replaces the one before if that has not been taken yet, so this never waits for
    /// a viewer, a file or an encoder; the lock that it takes is held to put a pointer in a map or to take it out.
    pub fn publish(&self, shown: Shown) {
        let happening = Happening::of(&shown.frame);
        let before = {
            let mut mail = self.mailbox.lock();
            if let Some(happening) = happening {
                let queue = mail.happened.entry(self.key).or_default();
                if queue.len() == HAPPENINGS {
                    queue.pop_front();
                }
                queue.push_back(happening);
            }
            mail.shown.insert(self.key, shown)
        };
        self.mailbox.bell.notify_one();
        if before.is_some() {
            self.replaced.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Frames that were replaced before they could be shown.
    pub fn replaced(&self) -> u64 {
        self.replaced.load(Ordering::Relaxed)
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        self.mailbox.lock().ended.push(self.key);
        self.mailbox.bell.notify_one();
    }
}

struct Session {
    recorder: Recorder,
    /// The newest frame, while nobody wants it.
    waiting: Option<Shown>,
}

/// Encodes what is left in the mailbox until it closes, and not more often than every `interval`.
pub(crate) fn run(mailbox: &Mailbox, hub: &Hub, interval: Duration) {
    let mut sessions = BTreeMap::new();
    loop {
        let start = Instant::now();
        let mail = mailbox.take();
        for (key, recorder) in mail.opened {
            let waiting = None;
            sessions.insert(key, Session { recorder, waiting });
        }
        for (key, happened) in mail.happened {
            if let Some(session) = sessions.get_mut(&key) {
                happened.into_iter().for_each(|h| session.recorder.learn(h));
            }
        }
        for (key, shown) in mail.shown {
            if let Some(session) = sessions.get_mut(&key) {
                session.waiting = Some(shown);
            }
        }
        sessions.retain(|&key, session| show(hub, key, session));
        for key in mail.ended {
            sessions.remove(&key);
            hub.end(key);
        }
        if mail.closing {
            hub.close();
            return;
        }
        mailbox.rest_until(start + interval);
    }
}

/// Encodes the newest frame if anyone wants it; says whether the session goes on.
fn show(hub: &Hub, key: u64, session: &mut Session) -> bool {
    if session.waiting.is_none() || !hub.is_wanted(key) {
        return true;
    }
    let Some(shown) = session.waiting.take() else {
        return true;
    };
    match session.recorder.record(&shown) {
        Ok((step, plots)) => hub.push(key, step, plots),
        Err(error) => {
            tracing::error!(%error, step = shown.frame.step, "a recording ends: its frame cannot be encoded");
            hub.end(key);
            return false;
        }
    }
    true
}
