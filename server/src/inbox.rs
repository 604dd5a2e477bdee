//! Motion that waits for a session's steps, in the order in which steps take it.

use std::{collections::BTreeMap, time::Duration};

use sinew_engine::{Drag, Exchange, MotionSample, Verdict};
use tokio::{
    sync::{mpsc, oneshot, watch},
    time::{Instant, sleep_until},
};

use crate::live::Live;

/// Motion frames that may wait for their steps; more are held back in the client by flow control.
pub(crate) const MOTION_QUEUE: usize = 64;

/// A motion sample and when it came.
#[derive(Debug)]
pub(crate) struct Arrival {
    /// In its stream; a sample of a record has another's.
    pub(crate) sequence: u64,
    pub(crate) sample: MotionSample,
    /// On the session's clock, s.
    pub(crate) received: f64,
    pub(crate) received_nanos: u64,
}

/// What a stream of motion says to its session.
#[derive(Debug)]
pub(crate) struct Input {
    /// Grows from stream to stream.
    pub(crate) stream: u64,
    pub(crate) item: Item,
}

#[derive(Debug)]
pub(crate) enum Item {
    Open(Delivery),
    Frame(Arrival),
    Drags(Drags),
    Ping(Exchange),
    /// No frame follows; answered when the last moment was played.
    Close(oneshot::Sender<()>),
}

/// Who is taken hold of and let go at once.
#[derive(Debug)]
pub(crate) struct Drags {
    /// The step that they come before.
    pub(crate) step: u64,
    pub(crate) drags: Vec<Drag>,
}

/// How frames become steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Delivery {
    /// One frame, one step.
    Each,
    /// Steps by capture time.
    Live {
        /// Of the source's frames, s.
        period: f64,
    },
}

/// What became of a stream's frames so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Progress {
    pub(crate) stream: u64,
    /// Sequence of the last frame that a step was given.
    pub(crate) used: u64,
    pub(crate) reordered: u64,
    pub(crate) late: u64,
    pub(crate) refused: u64,
    /// From capture to step, s.
    pub(crate) delay: f64,
    /// The session's clock less the source's, s.
    pub(crate) offset: f64,
    pub(crate) skew: f64,
}

/// When the next step is to be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Due {
    Now,
    At(Instant),
}

impl Due {
    /// Waits for it; for ever where there is none.
    pub(crate) async fn reached(due: Option<Self>) {
        match due {
            None => std::future::pending().await,
            Some(Self::At(instant)) if instant > Instant::now() => sleep_until(instant).await,
            Some(Self::Now | Self::At(_)) => {}
        }
    }
}

/// The actor's end of a session's motion.
#[derive(Debug)]
pub(crate) struct Inbox {
    inputs: mpsc::Receiver<Input>,
    begun: Instant,
    points: usize,
    time_step: f64,
    /// A point that goes faster from one frame to the next jumped, m/s.
    leap: f64,
    /// Of DELIVERY_EACH, by stream and sequence: whatever delivery follows, they are taken first.
    waiting: BTreeMap<(u64, u64), Arrival>,
    /// Drags by their step, in the order they came for each.
    drags: BTreeMap<u64, Vec<Drags>>,
    /// The last one of those that a step took.
    taken: (u64, u64),
    live: Option<Live>,
    closing: Option<oneshot::Sender<()>>,
    progress: watch::Sender<Progress>,
}

impl Inbox {
    /// An empty one, and its senders' ends.
    ///
    /// * `begun` - when the session's clock showed 0.
    pub(crate) fn new(
        begun: Instant,
        points: usize,
        time_step: f64,
        leap: f64,
    ) -> (Self, mpsc::Sender<Input>, watch::Receiver<Progress>) {
        // What is in the channel has no order yet, so that it is kept short.
        let (sender, inputs) = mpsc::channel(1);
        let (progress, told) = watch::channel(Progress::default());
        let inbox = Self {
            inputs,
            begun,
            points,
            time_step,
            leap,
            waiting: BTreeMap::new(),
            drags: BTreeMap::new(),
            taken: (0, 0),
            live: None,
            closing: None,
            progress,
        };
        (inbox, sender, told)
    }

    pub(crate) fn has_room(&self) -> bool {
        let drags: usize = self.drags.values().map(Vec::len).sum();
        self.waiting.len() + drags < MOTION_QUEUE
    }

    /// The next input; `None` where nobody is left to send one.
    pub(crate) async fn recv(&mut self) -> Option<Input> {
        self.inputs.recv().await
    }

    /// Takes in all that was sent.
    pub(crate) fn pull(&mut self) {
        while self.has_room()
            && let Ok(input) = self.inputs.try_recv()
        {
            self.accept(input);
        }
    }

    pub(crate) fn accept(&mut self, Input { stream, item }: Input) {
        let current = self.progress.borrow().stream;
        match (item, &mut self.live) {
            (Item::Open(delivery), _) => {
                self.live = match delivery {
                    Delivery::Each => None,
                    Delivery::Live { period } => {
                        Some(Live::new(self.points, period, self.time_step, self.leap))
                    }
                };
                self.closing = None;
                self.progress.send_replace(Progress {
                    stream,
                    ..Progress::default()
                });
            }
            // From a stream that another took over from.
            (Item::Frame(_) | Item::Drags(_) | Item::Ping(_) | Item::Close(_), _)
                if stream != current => {}
            (Item::Drags(drags), _) => self.drags.entry(drags.step).or_default().push(drags),
            (Item::Frame(arrival), Some(live)) => {
                live.frame(arrival);
            }
            (Item::Frame(arrival), None) => self.queue(stream, arrival),
            (Item::Ping(exchange), Some(live)) => live.ping(exchange),
            (Item::Close(played), Some(live)) => {
                live.close();
                self.closing = Some(played);
            }
            (Item::Ping(_) | Item::Close(_), None) => {}
        }
        self.report();
    }

    fn queue(&mut self, stream: u64, arrival: Arrival) {
        let place = (stream, arrival.sequence);
        let verdict = if place <= self.taken {
            Verdict::Late
        } else if self
            .waiting
            .last_key_value()
            .is_some_and(|(last, _)| place < *last)
        {
            Verdict::Reordered
        } else {
            Verdict::Taken
        };
        if verdict != Verdict::Late {
            self.waiting.insert(place, arrival);
        }
        self.progress.send_if_modified(|progress| {
            progress.late += u64::from(verdict == Verdict::Late);
            progress.reordered += u64::from(verdict == Verdict::Reordered);
            verdict != Verdict::Taken
        });
    }

    /// Takes all that comes before a step.
    pub(crate) fn take_drags(&mut self, step: u64) -> Vec<Drag> {
        let later = self.drags.split_off(&(step + 1));
        let now = std::mem::replace(&mut self.drags, later);
        let drags = now.into_values().flatten().map(|drags| drags.drags);
        drags.flatten().collect()
    }

    /// How many steps could be taken without waiting for more.
    pub(crate) fn waiting(&self) -> usize {
        self.waiting.len() + self.live.as_ref().map_or(0, Live::waiting)
    }

    /// When the next step is to be taken, if any is.
    pub(crate) fn due(&self) -> Option<Due> {
        if !self.waiting.is_empty() {
            return Some(Due::Now);
        }
        let due = self.live.as_ref()?.due()?;
        // A moment too far to be told never comes.
        let since = Duration::try_from_secs_f64(due.max(0.0)).ok()?;
        self.begun.checked_add(since).map(Due::At)
    }

    /// What the next step is given, by the clock.
    pub(crate) fn take_due(&mut self) -> Option<Arrival> {
        self.take(Some(self.begun.elapsed().as_secs_f64()))
    }

    /// What the next step is given, whether it is due or not.
    pub(crate) fn take_next(&mut self) -> Option<Arrival> {
        self.take(None)
    }

    fn take(&mut self, now: Option<f64>) -> Option<Arrival> {
        match self.waiting.pop_first() {
            Some((place, arrival)) => {
                self.taken = place;
                Some(arrival)
            }
            None => self.live.as_mut()?.take(now),
        }
    }

    /// Tells the stream how it goes, and when it is over; to be called after each step.
    pub(crate) fn report(&mut self) {
        let Some(live) = &self.live else { return };
        self.progress.send_if_modified(|progress| {
            let before = *progress;
            live.report(progress);
            *progress != before
        });
        if live.is_over()
            && let Some(closing) = self.closing.take()
        {
            closing.send(()).ok(); // the stream may have left
        }
    }
}
