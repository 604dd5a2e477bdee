//! How viewers lay a session out.

use re_sdk::blueprint::{
    Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel,
    Spatial3DView, Tabs, TextLogView, TimePanel, TimeSeriesView, Vertical,
};
use re_sdk::external::re_log_types::LogMsg;
use re_sdk::log::{Chunk, RowId};
use re_sdk::{
    AsComponents, EntityPath, RecordingStreamBuilder, StoreId, StoreKind, TimeCell, TimePoint,
};
use re_sdk_types::blueprint::archetypes::{Background, EyeControls3D, ViewBlueprint};
use re_sdk_types::blueprint::components::{BackgroundKind, PanelState, PlayState};
use re_sdk_types::components::{Color, Name};

use crate::EncodeError;
use crate::recorder::{
    APPLICATION, EVENTS, EXTENT, FRACTURE, LATENCY_MS, MEASURES, MESH, PLACES, POINTS, READINGS,
    STEP, STEP_MS,
};
use crate::recording::Message;

const MESH_VIEW: &str = "Mesh";
const POINTS_VIEW: &str = "Points";
const BACKGROUND: u32 = 0x1a20_24ff;

/// The blueprint's messages. One serves all sessions: a viewer has one layout per application, and a new one with each
/// session would undo what its user arranged.
pub(crate) fn messages() -> Result<Vec<Message>, EncodeError> {
    let (stream, stored) = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .memory()?;
    layout().send(&stream, BlueprintActivation::default())?;
    let mut messages = stored.take();
    messages.retain(|message| message.store_id().kind() == StoreKind::Blueprint);
    // The activation comes last: what follows it would come too late.
    let activation = messages.pop();
    let mut properties = Vec::new();
    for message in &messages {
        properties.extend(properties_for(message)?);
    }
    let all = messages.iter().chain(&properties).chain(&activation);
    all.map(|message| Ok(Message::encode(message)?)).collect()
}

/// If the message makes a 3D view: its properties, which the SDK's blueprints cannot say.
fn properties_for(message: &LogMsg) -> Result<Vec<LogMsg>, EncodeError> {
    let LogMsg::ArrowMsg(store, message) = message else {
        return Ok(Vec::new());
    };
    let chunk = Chunk::from_arrow_msg(message)?;
    let name = ViewBlueprint::descriptor_display_name().component;
    let name = chunk.component_mono::<Name>(name, 0).transpose()?;
    let followed = match name.as_ref().map(Name::as_str) {
        Some(MESH_VIEW | POINTS_VIEW) => EXTENT,
        Some(_) | None => return Ok(Vec::new()),
    };
    // What walks stays in sight.
    let eye = EyeControls3D::new().with_tracking_entity(followed);
    let background = Background::new(BackgroundKind::SolidColor);
    let background = background.with_color(Color::from_u32(BACKGROUND));
    let properties: [(&str, &dyn AsComponents); 2] =
        [("EyeControls3D", &eye), ("Background", &background)];
    let property = |(name, property)| {
        let path = chunk
            .entity_path()
            .join(&EntityPath::from_single_string(name));
        row(store, path, property)
    };
    properties.into_iter().map(property).collect()
}

fn row(
    store: &StoreId,
    path: EntityPath,
    components: &dyn AsComponents,
) -> Result<LogMsg, EncodeError> {
    let at = TimePoint::default().with_index("blueprint", TimeCell::from_sequence(0));
    let chunk = Chunk::builder(path)
        .with_archetype(RowId::new(), at, components)
        .build()?;
    Ok(LogMsg::ArrowMsg(store.clone(), chunk.to_arrow_msg()?))
}

fn layout() -> Blueprint {
    let scene =
        Spatial3DView::new(MESH_VIEW).with_contents([MESH, FRACTURE, POINTS, PLACES, EXTENT]);
    // Points that drive a volume stand inside of it: here they are seen.
    let points = Spatial3DView::new(POINTS_VIEW).with_contents([POINTS, EXTENT]);
    let plot = |name: &str, entity: &str| -> ContainerLike {
        TimeSeriesView::new(name).with_origin(entity).into()
    };
    let times = Tabs::new([plot("Step, ms", STEP_MS), plot("Latency, ms", LATENCY_MS)]);
    let read = Tabs::new([plot("Measures", MEASURES), plot("Readings", READINGS)]);
    let aside: [ContainerLike; 4] = [
        points.into(),
        read.into(),
        TextLogView::new("Events").with_origin(EVENTS).into(),
        times.into(),
    ];
    let aside = Vertical::new(aside).with_row_shares([2.0, 1.0, 1.0, 1.0]);
    let views: [ContainerLike; 2] = [scene.into(), aside.into()];
    Blueprint::new(Horizontal::new(views).with_column_shares([3.0, 1.0]))
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(
            TimePanel::new()
                .with_state(PanelState::Collapsed)
                .with_timeline(STEP)
                .with_play_state(PlayState::Following),
        )
}
