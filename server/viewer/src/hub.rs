//! Where readers, be they viewers or files, find what was recorded.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Bound;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use crate::recording::{Message, Msg, Place, Recording, Step};

/// Recordings that have ended and still have viewers behind: more than these go, seen or not.
const ENDED_KEPT: usize = 8;

/// How much is kept, and for how many.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) history_bytes: u64,
    pub(crate) backlog_bytes: u64,
    pub(crate) viewers: usize,
}

/// What a reader reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Interest {
    /// A viewer, of every session.
    Everything,
    /// A viewer, of the session with this id.
    Session(String),
    /// A file, of the recording with this key.
    File(u64),
}

/// All recordings and how far each reader has come. The lock is held for moments only: nothing is encoded, sent or
/// written under it, and a reader that stands still holds nothing but numbers.
pub(crate) struct Hub {
    state: Mutex<State>,
    limits: Limits,
    /// For readers in threads.
    bell: Condvar,
    /// For readers in tasks.
    changes: watch::Sender<()>,
}

struct State {
    /// The blueprint: sent to everyone after the first recording's store info.
    greeting: Arc<[Message]>,
    recordings: BTreeMap<u64, Recording>,
    readers: BTreeMap<u64, Reader>,
    next_key: u64,
    closed: bool,
    skipped: u64,
}

struct Reader {
    interest: Interest,
    greeted: usize,
    places: BTreeMap<u64, Place>,
    /// The recording served last, so that the next one has its turn; zero before any.
    served: u64,
    /// At most one step's messages.
    out: VecDeque<Message>,
}

impl Reader {
    fn wants(&self, key: u64, recording: &Recording) -> bool {
        match &self.interest {
            Interest::Everything => true,
            Interest::Session(session) => *session == recording.session,
            Interest::File(file) => *file == key,
        }
    }

    fn awaits(&self, key: u64, recording: &Recording) -> bool {
        let place = self.places.get(&key);
        self.wants(key, recording) && !place.is_some_and(|place| place.is_at_end(recording))
    }

    fn is_file(&self) -> bool {
        match self.interest {
            Interest::File(_) => true,
            Interest::Everything | Interest::Session(_) => false,
        }
    }
}

/// What there is for a reader.
enum Next {
    Message(Message),
    Nothing,
    End,
}

/// Too many viewers.
#[derive(Debug)]
pub(crate) struct Full {
    pub(crate) viewers: usize,
}

/// What is kept, at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Viewers connected.
    pub viewers: usize,
    /// Recordings held for readers.
    pub recordings: usize,
    /// Bytes held for readers, all recordings together.
    pub held_bytes: u64,
    /// Steps that readers were too slow for, since the start.
    pub steps_skipped: u64,
}

impl Hub {
    pub(crate) fn new(greeting: Arc<[Message]>, limits: Limits) -> Arc<Self> {
        Arc::new(Self {
            state: Mutex::new(State {
                greeting,
                recordings: BTreeMap::new(),
                readers: BTreeMap::new(),
                next_key: 1,
                closed: false,
                skipped: 0,
            }),
            limits,
            bell: Condvar::new(),
            changes: watch::Sender::new(()),
        })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn changed(&self) {
        self.bell.notify_all();
        self.changes.send_replace(());
    }

    /// Adds a recording.
    pub(crate) fn open(&self, session: String, setup: Vec<Message>) -> u64 {
        let key = self.lock().open(session, setup);
        self.changed();
        key
    }

    /// Adds to a recording; nothing happens if it is gone.
    pub(crate) fn push(&self, key: u64, step: Step, plots: Vec<Message>) {
        if let Some(recording) = self.lock().recordings.get_mut(&key) {
            recording.push(step, plots, self.limits.history_bytes);
        }
        self.changed();
    }

    /// Ends a recording: its past is forgotten as soon as its file has it; its last state, as soon as everyone has it.
    pub(crate) fn end(&self, key: u64) {
        self.lock().end(key);
        self.changed();
    }

    /// Ends everything: readers get what is left, then the end.
    pub(crate) fn close(&self) {
        self.lock().close();
        self.changed();
    }

    /// Whether anyone reads this recording.
    pub(crate) fn is_wanted(&self, key: u64) -> bool {
        let state = self.lock();
        let Some(recording) = state.recordings.get(&key) else {
            return false;
        };
        state.readers.values().any(|r| r.wants(key, recording))
    }

    pub(crate) fn stats(&self) -> Stats {
        let state = self.lock();
        Stats {
            viewers: state.viewers(),
            recordings: state.recordings.len(),
            held_bytes: state.recordings.values().map(Recording::bytes).sum(),
            steps_skipped: state.skipped,
        }
    }

    /// Adds a reader, which starts with the oldest step kept.
    pub(crate) fn subscribe(self: &Arc<Self>, interest: Interest) -> Result<Subscription, Full> {
        let changes = self.changes.subscribe();
        let key = self.lock().subscribe(interest, self.limits.viewers)?;
        Ok(Subscription {
            hub: Arc::clone(self),
            key,
            changes,
        })
    }
}

impl State {
    fn open(&mut self, session: String, setup: Vec<Message>) -> u64 {
        let key = self.take_key();
        self.recordings.insert(key, Recording::new(session, setup));
        key
    }

    fn take_key(&mut self) -> u64 {
        self.next_key += 1;
        self.next_key - 1
    }

    fn viewers(&self) -> usize {
        self.readers.values().filter(|r| !r.is_file()).count()
    }

    fn subscribe(&mut self, interest: Interest, limit: usize) -> Result<u64, Full> {
        let mut reader = Reader {
            interest,
            greeted: 0,
            places: BTreeMap::new(),
            served: 0,
            out: VecDeque::new(),
        };
        if !reader.is_file() && self.viewers() >= limit {
            return Err(Full { viewers: limit });
        }
        for (&key, recording) in self.recordings.iter().filter(|(_, r)| r.ended) {
            reader.places.insert(key, Place::end(recording));
        }
        let key = self.take_key();
        self.readers.insert(key, reader);
        Ok(key)
    }

    fn unsubscribe(&mut self, reader: u64) {
        self.readers.remove(&reader);
        for key in self.ended() {
            self.settle(key);
        }
    }

    fn ended(&self) -> Vec<u64> {
        let ended = self.recordings.iter().filter(|(_, r)| r.ended);
        ended.map(|(&key, _)| key).collect()
    }

    fn end(&mut self, key: u64) {
        if let Some(recording) = self.recordings.get_mut(&key) {
            recording.ended = true;
        }
        self.settle(key);
        let lingering = self.lingering();
        for &key in &lingering[..lingering.len().saturating_sub(ENDED_KEPT)] {
            self.forget(key);
        }
    }

    fn close(&mut self) {
        self.closed = true;
        let live = self.recordings.iter_mut().filter(|(_, r)| !r.ended);
        let live: Vec<u64> = live.map(|(&key, _)| key).collect();
        for key in live {
            self.end(key);
        }
    }

    /// Forgets what nobody waits for of a recording that has ended.
    fn settle(&mut self, key: u64) {
        let Some(recording) = self.recordings.get_mut(&key).filter(|r| r.ended) else {
            return;
        };
        let mut waiting = self.readers.values().filter(|r| r.awaits(key, recording));
        match waiting.next() {
            None => self.forget(key),
            Some(first) if first.is_file() || waiting.any(Reader::is_file) => {}
            Some(_) => recording.keep_last(),
        }
    }

    /// Ended recordings that only viewers wait for, oldest first.
    fn lingering(&self) -> Vec<u64> {
        let file_awaits = |key, recording| {
            let mut files = self.readers.values().filter(|r| r.is_file());
            files.any(|reader| reader.awaits(key, recording))
        };
        let ended = self.recordings.iter().filter(|(_, r)| r.ended);
        let lingering = ended.filter(|&(&key, recording)| !file_awaits(key, recording));
        lingering.map(|(&key, _)| key).collect()
    }

    fn forget(&mut self, key: u64) {
        self.recordings.remove(&key);
        for reader in self.readers.values_mut() {
            reader.places.remove(&key);
        }
    }

    fn next(&mut self, reader: u64, backlog_bytes: u64) -> Next {
        let Some(reader) = self.readers.get_mut(&reader) else {
            return Next::End;
        };
        if let Some(message) = reader.out.pop_front() {
            return Next::Message(message);
        }
        // Viewers drop a blueprint for an application of which they have no recording yet.
        let has_recording = reader.served > 0;
        if let Some(message) = self.greeting.get(reader.greeted).filter(|_| has_recording) {
            reader.greeted += 1;
            return Next::Message(message.clone());
        }
        // A file waits for the disk, not for people: it may lag by the whole history.
        let backlog_bytes = if reader.is_file() {
            u64::MAX
        } else {
            backlog_bytes
        };
        let others = (Bound::Excluded(reader.served), Bound::Unbounded);
        let turns = self.recordings.range(others);
        for (&key, recording) in turns.chain(self.recordings.range(..=reader.served)) {
            if !reader.wants(key, recording) {
                continue;
            }
            let place = reader.places.entry(key);
            let place = place.or_insert_with(|| Place::start(recording));
            self.skipped += place.advance(recording, backlog_bytes, &mut reader.out);
            if let Some(message) = reader.out.pop_front() {
                reader.served = key;
                if recording.ended {
                    self.settle(key);
                }
                return Next::Message(message);
            }
        }
        let over = match reader.interest {
            Interest::File(file) => !self.recordings.contains_key(&file),
            Interest::Everything | Interest::Session(_) => self.closed,
        };
        if over { Next::End } else { Next::Nothing }
    }
}

/// A reader's end of the hub; dropping it leaves.
pub(crate) struct Subscription {
    hub: Arc<Hub>,
    key: u64,
    changes: watch::Receiver<()>,
}

impl Subscription {
    /// The next message, once there is one; `None` at the end.
    pub(crate) async fn next(&mut self) -> Option<Msg> {
        loop {
            // Seen before looking: a change during the look is not missed.
            self.changes.mark_unchanged();
            let next = self
                .hub
                .lock()
                .next(self.key, self.hub.limits.backlog_bytes);
            match next {
                Next::Message(message) => return Some(message.body),
                Next::End => return None,
                Next::Nothing => self.changes.changed().await.ok()?,
            }
        }
    }

    /// The next message, once there is one; `None` at the end. Blocks the thread.
    pub(crate) fn next_blocking(&mut self) -> Option<Msg> {
        let mut state = self.hub.lock();
        loop {
            match state.next(self.key, self.hub.limits.backlog_bytes) {
                Next::Message(message) => return Some(message.body),
                Next::End => return None,
                Next::Nothing => {
                    let woken = self.hub.bell.wait(state);
                    state = woken.unwrap_or_else(PoisonError::into_inner);
                }
            }
        }
    }
}

impl Drop for Subscription {
    fn drop(&mut self) {
        self.hub.lock().unsubscribe(self.key);
    }
}
