//! One session's recording: what every reader must have, and as much of the past as the limit allows.

use std::collections::VecDeque;

use re_sdk::external::re_log_encoding::ToTransport as _;
use re_sdk::external::re_log_encoding::rrd::{CodecError, Compression};
use re_sdk::external::re_log_types::LogMsg;

use crate::lane::Lane;

pub(crate) use re_protos::log_msg::v1alpha1::log_msg::Msg;

/// A message of Rerun's, encoded once; clones share its payload.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    pub(crate) body: Msg,
    bytes: u64,
}

impl Message {
    pub(crate) fn encode(message: &LogMsg) -> Result<Self, CodecError> {
        // Uncompressed: LZ4 finds next to nothing in coordinates, and costs more than the rest of the encoding.
        let body = message.to_transport(Compression::Off)?;
        let bytes = body.encoded_len() as u64;
        Ok(Self { body, bytes })
    }
}

fn bytes_of(messages: &[Message]) -> u64 {
    messages.iter().map(|message| message.bytes).sum()
}

/// Mesh and points at one step.
#[derive(Debug)]
pub(crate) struct Step {
    /// Steps of one generation have the same triangles, colours, points and timelines. Counts from one.
    pub(crate) generation: u64,
    /// Whether all of that is in this step, or positions alone.
    pub(crate) whole: bool,
    pub(crate) messages: Vec<Message>,
}

/// See the module.
///
/// Rerun joins the components of an entity by time alone, so positions that follow a mesh of another generation would
/// be drawn with its triangles. Hence the rule that all of this keeps: a reader gets positions only after the whole
/// step of their generation, and no other whole step in between.
#[derive(Debug)]
pub(crate) struct Recording {
    pub(crate) session: String,
    pub(crate) ended: bool,
    /// Store info, properties, static data: never forgotten.
    setup: Vec<Message>,
    /// Never more bytes than the history may have.
    steps: Lane<Step>,
    /// Small; so they outlive the steps that they came with.
    plots: Lane<Message>,
    /// The newest whole step that is no longer in `steps`.
    base: Option<Step>,
}

/// Plots have this share of the history.
const PLOT_SHARE: u64 = 8;

impl Recording {
    pub(crate) const fn new(session: String, setup: Vec<Message>) -> Self {
        Self {
            session,
            ended: false,
            setup,
            steps: Lane::new(),
            plots: Lane::new(),
            base: None,
        }
    }

    pub(crate) fn push(&mut self, step: Step, plots: Vec<Message>, history_bytes: u64) {
        for plot in plots {
            self.plots.push(plot.bytes, plot);
        }
        while self.plots.bytes() > history_bytes / PLOT_SHARE && self.plots.len() > 1 {
            self.plots.forget_first();
        }
        self.steps.push(bytes_of(&step.messages), step);
        while self.steps.bytes() > history_bytes && self.steps.len() > 1 {
            self.forget_step();
        }
    }

    /// Keeps the last state and no past.
    pub(crate) fn keep_last(&mut self) {
        while self.steps.len() > 1 {
            self.forget_step();
        }
        while self.plots.len() > 0 {
            self.plots.forget_first();
        }
    }

    fn forget_step(&mut self) {
        if let Some(step) = self.steps.forget_first()
            && step.whole
        {
            self.base = Some(step);
        }
    }

    fn whole(&self, generation: u64) -> Option<&Step> {
        self.base
            .iter()
            .chain(self.steps.iter())
            .find(|step| step.whole && step.generation == generation)
    }

    /// Bytes kept for readers.
    pub(crate) fn bytes(&self) -> u64 {
        let base = self
            .base
            .as_ref()
            .map_or(0, |step| bytes_of(&step.messages));
        bytes_of(&self.setup) + self.steps.bytes() + self.plots.bytes() + base
    }
}

/// How far a reader has come in a recording.
#[derive(Debug)]
pub(crate) struct Place {
    setup: usize,
    plots: u64,
    steps: u64,
    /// The generation of the last step read; zero before any.
    generation: u64,
    /// Whether it has ever been up to date: before, it may lag by the whole history.
    live: bool,
}

impl Place {
    /// Before everything that is kept.
    pub(crate) fn start(recording: &Recording) -> Self {
        Self {
            setup: 0,
            plots: recording.plots.first(),
            steps: recording.steps.first(),
            generation: 0,
            live: false,
        }
    }

    /// After everything.
    pub(crate) fn end(recording: &Recording) -> Self {
        Self {
            setup: recording.setup.len(),
            plots: recording.plots.next(),
            steps: recording.steps.next(),
            generation: 0,
            live: true,
        }
    }

    pub(crate) fn is_at_end(&self, recording: &Recording) -> bool {
        self.setup == recording.setup.len()
            && self.plots == recording.plots.next()
            && self.steps == recording.steps.next()
    }

    /// Hands the next messages over, at most one step's. A place that is live and more than `backlog_bytes` behind
    /// first jumps to the newest step.
    ///
    /// * returns the number of steps jumped over.
    pub(crate) fn advance(
        &mut self,
        recording: &Recording,
        backlog_bytes: u64,
        to: &mut VecDeque<Message>,
    ) -> u64 {
        if let Some(message) = recording.setup.get(self.setup) {
            self.setup += 1;
            to.push_back(message.clone());
            return 0;
        }
        self.plots = self.plots.max(recording.plots.first());
        if let Some(message) = recording.plots.get(self.plots) {
            self.plots += 1;
            to.push_back(message.clone());
            return 0;
        }
        let steps = &recording.steps;
        let mut from = self.steps.max(steps.first());
        // Overtaken by what is forgotten: too slow to see the past as well.
        self.live |= from > self.steps;
        if self.live && steps.bytes_from(from) > backlog_bytes {
            from = steps.next() - 1;
        }
        let skipped = from - self.steps;
        self.steps = from;
        let Some(step) = steps.get(from) else {
            self.live = true;
            return skipped;
        };
        if step.whole || step.generation == self.generation {
            self.steps += 1;
            to.extend(step.messages.iter().cloned());
        } else {
            let whole = recording
                .whole(step.generation)
                .expect("a whole step leaves the lane only to become the base, before any of its generation leaves");
            to.extend(whole.messages.iter().cloned());
        }
        self.generation = step.generation;
        skipped
    }
}
