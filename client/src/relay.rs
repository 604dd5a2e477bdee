//! From a live source to a session.

use std::{
    pin::pin,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use futures::stream;
use nalgebra::Vector3;
use sinew_bridges::{Axes, BridgeError, Clock, Frame, Layout, OCCLUDED, Source, Update};
use sinew_proto::v1;
use tokio::{
    sync::mpsc,
    time::{Instant, timeout},
};

use crate::{Client, ClientError, MotionStream, motion::flagged_frame};

/// Frames that wait for the connection; more are dropped, since those that wait are older.
const WAITING: usize = 64;
/// Frames whose times tell a rate that nobody says.
const MEASURED: usize = 16;
/// Until a lost server is asked again.
const RETRY: Duration = Duration::from_secs(1);
/// For how long the last moments may be played, once the source is left.
const FAREWELL: Duration = Duration::from_secs(2);

/// What a source does not say, or says wrongly.
#[derive(Clone, Copy, Debug, Default)]
pub struct RelaySettings {
    /// Frames per second, Hz.
    pub rate_hz: Option<f64>,
    /// Metres per unit of length.
    pub unit_metres: Option<f64>,
    /// The axes of the positions.
    pub axes: Option<v1::Axes>,
    /// How frames become steps; [`v1::Delivery::Unspecified`] is live.
    pub delivery: v1::Delivery,
}

/// Why a source's motion does not reach a session any more.
#[derive(Debug, thiserror::Error)]
pub enum RelayError {
    /// The source ended.
    #[error(transparent)]
    Source(#[from] BridgeError),
    /// The session refused.
    #[error(transparent)]
    Session(#[from] ClientError),
    /// None of the points is a point of the session.
    #[error(
        "the source has none of the session's points: it sends {sent}; the session has {known}"
    )]
    Labels {
        /// The source's labels.
        sent: String,
        /// The session's.
        known: String,
    },
}

/// How it went.
#[derive(Clone, Copy, Debug, Default)]
pub struct Relayed {
    /// Frames sent.
    pub sent: u64,
    /// Frames dropped, since the connection was slow or lost.
    pub dropped: u64,
    /// Streams opened; each but the first came of a source or a server that started again.
    pub streams: u64,
    /// How often the session said that it has no room.
    pub throttled: u64,
    /// The last stream's last acknowledgement.
    pub ack: v1::Ack,
}

/// A session's points, and the way to it.
#[derive(Debug)]
pub struct Relay {
    client: Client,
    session: String,
    points: Vec<String>,
    settings: RelaySettings,
    heard: Option<Heard>,
    open: Option<Open>,
    retry: Option<Instant>,
    epoch: u64,
    relayed: Relayed,
}

/// The layout of the frames that come.
#[derive(Debug)]
struct Heard {
    layout: Layout,
    /// For each point of the session its place in the layout.
    places: Vec<Option<usize>>,
    /// Capture times of the first frames, while they tell the rate.
    times: Vec<f64>,
}

#[derive(Debug)]
struct Open {
    frames: mpsc::Sender<v1::MotionFrame>,
    motion: MotionStream,
    sequence: u64,
}

impl Relay {
    /// Learns a session's points.
    ///
    /// * `session` - `sessions/{id}`.
    ///
    /// # Errors
    /// `NOT_FOUND`.
    pub async fn to(
        client: Client,
        session: &str,
        settings: RelaySettings,
    ) -> Result<Self, ClientError> {
        let request = v1::GetKeyframeRequest {
            session: session.to_owned(),
            content: v1::Content::Points.into(),
            ..v1::GetKeyframeRequest::default()
        };
        Ok(Self {
            points: client.keyframe(request).await?.labels,
            client,
            session: session.to_owned(),
            settings,
            heard: None,
            open: None,
            retry: None,
            epoch: 0,
            relayed: Relayed::default(),
        })
    }

    /// Hands a source's frames to the session until `stop`, over any number of restarts on both sides. It takes the
    /// session over from whoever streams to it.
    ///
    /// * `note` - is told what people should know.
    ///
    /// # Errors
    /// The source's end, the session's refusal, or points of which the session has none.
    pub async fn run(
        mut self,
        source: &mut Source,
        stop: impl Future<Output = ()>,
        mut note: impl FnMut(String),
    ) -> Result<Relayed, RelayError> {
        let mut stop = pin!(stop);
        loop {
            tokio::select! {
                () = &mut stop => break,
                update = source.next() => match update? {
                    Update::Note(text) => note(text),
                    Update::Layout(layout) => self.arrange(layout, &mut note)?,
                    Update::Frame(frame) => self.hand_on(&frame, &mut note).await?,
                },
                answer = acknowledged(&mut self.open) => self.answered(answer, &mut note)?,
            }
        }
        Ok(self.farewell().await)
    }

    fn arrange(&mut self, layout: Layout, note: &mut impl FnMut(String)) -> Result<(), RelayError> {
        let places = places(&self.points, &layout.labels);
        let missing: Vec<&str> = (self.points.iter().zip(&places))
            .filter(|(_, place)| place.is_none())
            .map(|(label, _)| label.as_str())
            .collect();
        if missing.len() == self.points.len() {
            return Err(RelayError::Labels {
                sent: some(&layout.labels),
                known: some(&self.points),
            });
        }
        note(format!(
            "{}: {} of its {} points drive the session",
            layout.source,
            self.points.len() - missing.len(),
            layout.labels.len()
        ));
        if !missing.is_empty() {
            note(format!(
                "occluded, since it does not send them: {}",
                some(&missing)
            ));
        }
        self.open = None;
        self.heard = Some(Heard {
            layout,
            places,
            times: Vec::new(),
        });
        Ok(())
    }

    async fn hand_on(
        &mut self,
        frame: &Frame,
        note: &mut impl FnMut(String),
    ) -> Result<(), RelayError> {
        if self.open.is_none() {
            self.open_stream(frame.time, note).await?;
        }
        let (Some(open), Some(heard)) = (&mut self.open, &self.heard) else {
            self.relayed.dropped += 1;
            return Ok(());
        };
        let of_points = |i: &Option<usize>| match i {
            Some(i) => (frame.positions[*i], frame.flags[*i]),
            None => (Vector3::zeros(), OCCLUDED),
        };
        let (positions, flags): (Vec<_>, Vec<u8>) = heard.places.iter().map(of_points).unzip();
        open.sequence += 1;
        let message = flagged_frame(open.sequence, frame.time, &positions, &flags);
        match open.frames.try_send(message) {
            Ok(()) => self.relayed.sent += 1,
            Err(_) => self.relayed.dropped += 1,
        }
        Ok(())
    }

    /// Opens a stream, as soon as the source's rate is known and the server is not known to be away.
    async fn open_stream(
        &mut self,
        time: f64,
        note: &mut impl FnMut(String),
    ) -> Result<(), RelayError> {
        let Some(heard) = &mut self.heard else {
            return Ok(());
        };
        let known = self.settings.rate_hz.or(heard.layout.rate_hz);
        let Some(rate_hz) = known.or_else(|| measured(&mut heard.times, time)) else {
            return Ok(());
        };
        if self.retry.is_some_and(|retry| Instant::now() < retry) {
            return Ok(());
        }
        let layout = &heard.layout;
        let axes = self.settings.axes.or(layout.axes.map(named));
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        let millis = u64::try_from(since.as_millis()).unwrap_or(u64::MAX);
        self.epoch = millis.max(self.epoch.saturating_add(1));
        let mut hello = v1::Hello {
            session: self.session.clone(),
            source: layout.source.clone(),
            stream_epoch: self.epoch,
            rate_hz,
            unit_metres: self.settings.unit_metres.unwrap_or(layout.unit_metres),
            axes: axes.unwrap_or_default().into(),
            ..v1::Hello::default()
        };
        hello.set_delivery(match self.settings.delivery {
            v1::Delivery::Each => v1::Delivery::Each,
            v1::Delivery::Live | v1::Delivery::Unspecified => v1::Delivery::Live,
        });
        let (frames, mut waiting) = mpsc::channel(WAITING);
        let frames_on = stream::poll_fn(move |context| waiting.poll_recv(context));
        let live = hello.delivery() == v1::Delivery::Live;
        let opened = match layout.clock.clone() {
            Clock::Readable(clock) if live => {
                let read = move || clock.now();
                self.client.stream_motion_live(hello, frames_on, read).await
            }
            Clock::Readable(_) | Clock::Foreign => {
                self.client.stream_motion(hello, frames_on).await
            }
        };
        match opened {
            Ok(motion) => {
                note(format!("{rate_hz:.1} Hz into {}", self.session));
                self.relayed.streams += 1;
                self.open = Some(Open {
                    frames,
                    motion,
                    sequence: 0,
                });
                Ok(())
            }
            Err(error) => self.lost(error, note),
        }
    }

    fn answered(
        &mut self,
        answer: Result<Option<v1::Ack>, ClientError>,
        note: &mut impl FnMut(String),
    ) -> Result<(), RelayError> {
        match answer {
            Ok(Some(ack)) => {
                self.relayed.ack = ack;
                Ok(())
            }
            Ok(None) => self.lost(ClientError::Lost("it closed the stream".to_owned()), note),
            Err(error) => self.lost(error, note),
        }
    }

    /// Tries again later where the server was lost; a refusal is final.
    fn lost(
        &mut self,
        error: ClientError,
        note: &mut impl FnMut(String),
    ) -> Result<(), RelayError> {
        self.leave();
        match error {
            ClientError::Lost(_) | ClientError::Connect { .. } => {
                if self.retry.is_none() {
                    note(format!("{error}; trying again"));
                }
                self.retry = Some(Instant::now() + RETRY);
                Ok(())
            }
            ClientError::Address(_) | ClientError::Refused(_) | ClientError::Protocol(_) => {
                Err(error.into())
            }
        }
    }

    fn leave(&mut self) -> Option<MotionStream> {
        let Open { motion, .. } = self.open.take()?;
        self.relayed.throttled += motion.throttled();
        Some(motion)
    }

    /// Sends nothing more, and waits until what was sent is played.
    async fn farewell(mut self) -> Relayed {
        if let Some(mut motion) = self.leave() {
            let acks = async {
                while let Ok(Some(ack)) = motion.ack().await {
                    self.relayed.ack = ack;
                }
            };
            timeout(FAREWELL, acks).await.ok(); // a session that is paused plays nothing
        }
        self.relayed
    }
}

/// The next acknowledgement of a stream; never, where there is none.
async fn acknowledged(open: &mut Option<Open>) -> Result<Option<v1::Ack>, ClientError> {
    match open {
        Some(open) => open.motion.ack().await,
        None => std::future::pending().await,
    }
}

/// Frames per second by the median of the times between frames, once there are enough.
fn measured(times: &mut Vec<f64>, time: f64) -> Option<f64> {
    if times.len() <= MEASURED {
        times.push(time);
    }
    let mut between: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    between.sort_by(f64::total_cmp);
    let median = *between
        .get(MEASURED / 2)
        .filter(|_| times.len() > MEASURED)?;
    (median > 0.0).then(|| median.recip())
}

/// Where each point is among the labels of a source: by its whole name, or where no other has it by what follows the
/// last colon, as in `Walker:LKNE`.
fn places(points: &[String], labels: &[String]) -> Vec<Option<usize>> {
    let own = |label: &String| label.rsplit(':').next().unwrap_or_default().to_owned();
    let short: Vec<String> = labels.iter().map(own).collect();
    let find = |point: &String| {
        let whole = labels.iter().position(|label| label == point);
        whole.or_else(|| {
            let mut found = (0..labels.len()).filter(|&i| short[i] == *point);
            found.next().filter(|_| found.next().is_none())
        })
    };
    points.iter().map(find).collect()
}

/// The first few of a list, in words.
fn some<L: AsRef<str>>(labels: &[L]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<&str> = labels.iter().take(SHOWN).map(AsRef::as_ref).collect();
    match labels.len().checked_sub(SHOWN) {
        None | Some(0) => shown.join(", "),
        Some(more) => format!("{} and {more} more", shown.join(", ")),
    }
}

fn named(axes: Axes) -> v1::Axes {
    match axes {
        Axes::ZUpRight => v1::Axes::ZUpRightHanded,
        Axes::YUpRight => v1::Axes::YUpRightHanded,
        Axes::ZUpLeft => v1::Axes::ZUpLeftHanded,
        Axes::YUpLeft => v1::Axes::YUpLeftHanded,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strings(labels: &[&str]) -> Vec<String> {
        labels.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn points_are_found_by_their_whole_names_or_by_what_only_one_is_called() {
        let labels = strings(&["A:knee", "B:knee", "A:toe", "head", "B:head"]);
        let found = places(
            &strings(&["toe", "knee", "B:knee", "head", "tail"]),
            &labels,
        );
        assert_eq!(found, [Some(2), None, Some(1), Some(3), None]);
    }

    #[test]
    fn a_rate_is_that_of_most_frames() {
        let mut times = Vec::new();
        let rates: Vec<_> = (0..=MEASURED)
            .map(|i| i as f64 / 120.0 + if i > 10 { 0.1 } else { 0.0 }) // one gap
            .map(|time| measured(&mut times, time))
            .collect();
        assert!(rates[..MEASURED].iter().all(Option::is_none));
        assert!((rates[MEASURED].unwrap() - 120.0).abs() < 1e-9);
    }

    #[test]
    fn long_lists_are_told_by_their_beginning() {
        assert_eq!(some(&["a", "b"]), "a, b");
        let many: Vec<String> = (0..10).map(|i| i.to_string()).collect();
        assert_eq!(some(&many), "0, 1, 2, 3, 4, 5, 6, 7 and 2 more");
    }
}
