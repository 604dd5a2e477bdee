//! What happened to a mesh, as text and as places.

use std::sync::Arc;

use re_sdk::external::re_log_types::LogMsg;
use re_sdk::log::{Chunk, RowId};
use re_sdk::{AsComponents as _, StoreId, TimePoint};
use re_sdk_types::archetypes::{Points3D, TextLog};
use re_sdk_types::components::{Color, Radius, TextLogLevel};
use sinew_engine::{Change, Effect, Event, EventKind, Frame};

use crate::EncodeError;
use crate::recorder::{EVENTS, PLACES, time_of};
use crate::recording::Message;

/// Lines for one step; of more events the rest is counted.
const LINES: usize = 100;
const PLACE: u32 = 0xff3b_30ff;
const PLACE_RADIUS: Radius = Radius(re_sdk_types::datatypes::Float32(-5.0)); // negative: in points of the screen

/// The facts of one step.
pub(crate) struct Happening {
    at: TimePoint,
    pub(crate) change: Arc<Change>,
    /// Vertices of the mesh afterwards.
    pub(crate) vertices: usize,
}

impl Happening {
    /// What the frame's step did, if it did something.
    pub(crate) fn of(frame: &Frame) -> Option<Self> {
        Some(Self {
            at: time_of(frame),
            change: Arc::clone(frame.change.as_ref()?),
            vertices: frame.vertices.len(),
        })
    }

    /// Lines for the log, and the places.
    pub(crate) fn messages(&self, store: &StoreId) -> Result<Vec<Message>, EncodeError> {
        let events = &self.change.events;
        if events.is_empty() {
            return Ok(Vec::new());
        }
        let mut log = Chunk::builder(EVENTS);
        for event in &events[..events.len().min(LINES)] {
            let line = TextLog::new(line(event)).with_level(level(&event.kind));
            log = log.with_archetype(RowId::new(), self.at.clone(), &line);
        }
        if let Some(more) = events.len().checked_sub(LINES).filter(|more| *more > 0) {
            let line = TextLog::new(format!("and {more} more events at this step"));
            log = log.with_archetype(RowId::new(), self.at.clone(), &line);
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "viewers draw single precision"
        )]
        let places = events
            .iter()
            .map(|e| e.position.map(|metres| metres as f32));
        let places = Points3D::new(places.map(<[f32; 3]>::from))
            .with_colors([Color::from_u32(PLACE)])
            .with_radii([PLACE_RADIUS]);
        let places = Chunk::builder(PLACES).with_serialized_batches(
            RowId::new(),
            self.at.clone(),
            places.as_serialized_batches(),
        );
        [log.build()?, places.build()?]
            .iter()
            .map(|chunk| {
                let message = LogMsg::ArrowMsg(store.clone(), chunk.to_arrow_msg()?);
                Ok(Message::encode(&message)?)
            })
            .collect()
    }
}

fn level(kind: &EventKind) -> TextLogLevel {
    let level = match kind {
        EventKind::Refused(_) => TextLogLevel::WARN,
        EventKind::Crossed { .. } => TextLogLevel::DEBUG,
        EventKind::Torn { .. }
        | EventKind::Glued { .. }
        | EventKind::Removed
        | EventKind::Added
        | EventKind::Divided
        | EventKind::Collapsed
        | EventKind::Followed(_) => TextLogLevel::INFO,
    };
    level.into()
}

fn line(event: &Event) -> String {
    let what = match &event.kind {
        EventKind::Crossed {
            measured,
            threshold,
        } => format!("{measured:.4} crossed {threshold:.4}"),
        EventKind::Torn { faces } => format!("torn along {faces} faces"),
        EventKind::Glued { faces } => format!("glued along {faces} faces"),
        EventKind::Removed => format!("{} cells removed", event.cells.len()),
        EventKind::Added => format!("{} cells added", event.cells.len()),
        EventKind::Divided => format!("{} cells divided", event.cells.len()),
        EventKind::Collapsed => "an edge was drawn together".to_owned(),
        EventKind::Refused(why) => format!("refused: {why}"),
        EventKind::Followed(Effect::FragmentBorn {
            fragment,
            parent,
            cells,
        }) => format!("fragment {fragment} of {cells} cells born from {parent}"),
        EventKind::Followed(Effect::FragmentsJoined { fragment, absorbed }) => {
            format!("fragment {absorbed} joined {fragment}")
        }
        EventKind::Followed(Effect::InnerFracture) => "fractured inside".to_owned(),
        EventKind::Followed(Effect::FractureOpened) => {
            "an inner fracture reached the surface".to_owned()
        }
    };
    match event.rule {
        Some(rule) => format!("rule {rule}: {what}"),
        None => what,
    }
}
