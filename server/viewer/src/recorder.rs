//! From frames to Rerun's messages.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector3;
use re_sdk::external::arrow::array::{ArrayRef, FixedSizeListArray, PrimitiveArray, UInt32Array};
use re_sdk::external::arrow::buffer::ScalarBuffer;
use re_sdk::external::arrow::datatypes::{ArrowPrimitiveType, Field, Float32Type, UInt32Type};
use re_sdk::external::re_log_types::{LogMsg, SetStoreInfo, StoreInfo, StoreSource};
use re_sdk::log::{Chunk, RowId};
use re_sdk::{AsComponents, EntityPath, SerializedComponentBatch, StoreId, TimeCell, TimePoint};
use re_sdk_types::archetypes::{
    Mesh3D, Points3D, RecordingInfo, Scalars, SeriesLines, ViewCoordinates,
};
use re_sdk_types::components::{Color, Radius};
use sinew_engine::{Frame, Layout, Measured, PointState, UpAxis};
use sinew_mesh::{Surface, split_surface, vertex_normals};

use crate::happenings::Happening;
use crate::recording::{Message, Step};
use crate::scars::Scars;
use crate::{EncodeError, SessionInfo, Shown, palette};

pub(crate) const APPLICATION: &str = "sinew";
pub(crate) const MESH: &str = "/mesh";
/// The faces that came apart.
pub(crate) const FRACTURE: &str = "/fracture";
pub(crate) const POINTS: &str = "/points";
/// What happened, and where.
pub(crate) const EVENTS: &str = "/events";
pub(crate) const PLACES: &str = "/events/places";
/// What the rules measure, and their thresholds.
pub(crate) const MEASURES: &str = "/plots/measures";
/// What the scene's probes read.
pub(crate) const READINGS: &str = "/plots/readings";
/// Invisible; what the eye follows.
pub(crate) const EXTENT: &str = "/extent";
pub(crate) const STEP_MS: &str = "/plots/step_ms";
pub(crate) const LATENCY_MS: &str = "/plots/latency_ms";
pub(crate) const STEP: &str = "step";
const SIMULATION_TIME: &str = "simulation_time";
const CAPTURE_TIME: &str = "capture_time";

const POINT_RADIUS: Radius = Radius(re_sdk_types::datatypes::Float32(-3.5)); // negative: in points of the screen
/// Share of the mesh's reach that makes viewers put the eye where all of the mesh is seen, with room around it: tried.
const FRAMING: f64 = 0.8;
const VALID: u32 = 0xffff_ffff;
const PREDICTED: u32 = 0xffd9_4dff;
const HELD: u32 = 0xff8c_1aff;
const LOST: u32 = 0xe023_23ff;
/// No colour of the palette is as dark or as warm.
const FRACTURED: u32 = 0xb314_2bff;
const THRESHOLD: u32 = 0x9aa0_a6ff;
/// Steps with events that wait for someone to show them to; of more, the newest.
const UNTOLD: usize = 256;

/// Writes one session's frames as rows. Each row carries all timelines.
pub(crate) struct Recorder {
    store: StoreId,
    labels: Vec<String>,
    probes: Vec<String>,
    drawn: Option<Drawn>,
    generation: u64,
    normals: Vec<[f32; 3]>,
    scars: Scars,
    /// A fracture was drawn, so that one that is no more must be cleared.
    scarred: bool,
    untold: VecDeque<Happening>,
}

/// What the last whole step said, so that positions alone can follow it.
struct Drawn {
    layout: Arc<Layout>,
    surface: Surface,
    fracture: Surface,
    /// The points that are not absent.
    points: Vec<usize>,
    has_capture_time: bool,
    /// From the mesh's centre to what a view should show, m.
    reach: Vector3<f64>,
}

impl Drawn {
    fn new(frame: &Frame, scars: &Scars) -> Self {
        let [surface, fracture] = split_surface(&frame.layout.cells, |face| scars.contain(face));
        let centre = centre(&surface, &frame.vertices);
        let away = surface
            .vertices
            .iter()
            .map(|&v| frame.vertices[v as usize] - centre);
        let reach = away.fold(Vector3::zeros(), |reach, away| reach.sup(&away.abs()));
        Self {
            layout: Arc::clone(&frame.layout),
            surface,
            fracture,
            reach: reach * FRAMING,
            points: present(frame).collect(),
            has_capture_time: frame.capture_time_seconds.is_some(),
        }
    }

    /// Two invisible points that the eye follows. Were it to follow the mesh, it would cut a tall one off, and jump with
    /// every limb that moves the mesh's bounds.
    fn extent(&self, vertices: &[Vector3<f64>]) -> Points3D {
        let centre = centre(&self.surface, vertices);
        let corners = [centre - self.reach, centre + self.reach];
        let corners = corners.map(|corner| <[f32; 3]>::from(corner.cast::<f32>()));
        Points3D::new(corners)
            .with_radii([0.0])
            .with_colors([Color::TRANSPARENT])
    }

    /// Whether positions alone say all that is new in `frame`. On a timeline that the whole step did not have they
    /// would stand there without triangles.
    fn covers(&self, frame: &Frame) -> bool {
        (Arc::ptr_eq(&self.layout, &frame.layout) || self.layout == frame.layout)
            && (self.has_capture_time || frame.capture_time_seconds.is_none())
            && self.points.iter().copied().eq(present(frame))
    }
}

/// The mean of the vertices on the surface.
fn centre(surface: &Surface, vertices: &[Vector3<f64>]) -> Vector3<f64> {
    let on_it = surface.vertices.iter().map(|&v| vertices[v as usize]);
    on_it.sum::<Vector3<f64>>() / (surface.vertices.len().max(1) as f64)
}

/// The points that have a position.
fn present(frame: &Frame) -> impl Iterator<Item = usize> {
    let states = frame.point_states.iter().enumerate();
    states.filter_map(|(point, state)| (*state != PointState::Absent).then_some(point))
}

impl Recorder {
    /// * `name` – of the recording, different from every other's.
    pub(crate) fn new(session: &SessionInfo, name: &str) -> Self {
        Self {
            store: StoreId::recording(APPLICATION, name),
            labels: session.labels.clone(),
            probes: session.probes.clone(),
            drawn: None,
            generation: 0,
            normals: Vec::new(),
            scars: Scars::default(),
            scarred: false,
            untold: VecDeque::new(),
        }
    }

    /// What a viewer must have before the first step.
    pub(crate) fn setup(&self, session: &SessionInfo) -> Result<Vec<Message>, EncodeError> {
        let source = StoreSource::Other(APPLICATION.to_owned());
        let info = LogMsg::SetStoreInfo(SetStoreInfo {
            row_id: RowId::new().as_tuid(),
            info: StoreInfo::new(self.store.clone(), source),
        });
        let up = match session.up {
            UpAxis::Y => ViewCoordinates::RIGHT_HAND_Y_UP(),
            UpAxis::Z => ViewCoordinates::RIGHT_HAND_Z_UP(),
        };
        let properties = RecordingInfo::new().with_name(session.title.as_str());
        let line = |name: &str, index| {
            let colour = Color::from_u32(palette::qualitative(index));
            SeriesLines::new().with_names([name]).with_colors([colour])
        };
        Ok(vec![
            Message::encode(&info)?,
            self.fixed(EntityPath::properties(), &properties)?,
            self.fixed(EntityPath::root(), &up)?,
            self.fixed(STEP_MS, &line("step", 0))?,
            self.fixed(LATENCY_MS, &line("latency", 1))?,
        ])
    }

    /// Takes what a step did to the mesh; it is shown with the next frame.
    pub(crate) fn learn(&mut self, happening: Happening) {
        if let Some(patch) = &happening.change.patch {
            self.scars.follow(patch, happening.vertices);
        }
        if self.untold.len() == UNTOLD {
            self.untold.pop_front();
        }
        self.untold.push_back(happening);
    }

    /// The rows of one step: mesh and points, then the plots and what happened.
    pub(crate) fn record(&mut self, shown: &Shown) -> Result<(Step, Vec<Message>), EncodeError> {
        let frame = &*shown.frame;
        let (drawn, whole) = match self.drawn.take().filter(|drawn| drawn.covers(frame)) {
            Some(drawn) => (drawn, false),
            None => (Drawn::new(frame, &self.scars), true),
        };
        self.generation += u64::from(whole);
        let at = time_of(frame);
        let mut messages = Vec::with_capacity(4);
        if !drawn.surface.triangles.is_empty() {
            let mut mesh = self.surface(&drawn.surface, frame, whole);
            if whole {
                mesh.push(dominant_colours(&drawn));
            }
            messages.push(self.row(MESH, &at, mesh)?);
            let extent = drawn.extent(&frame.vertices).as_serialized_batches();
            messages.push(self.row(EXTENT, &at, extent)?);
        }
        if !drawn.fracture.triangles.is_empty() {
            let mut fracture = self.surface(&drawn.fracture, frame, whole);
            if whole {
                let colour = Mesh3D::update_fields().with_albedo_factor(FRACTURED);
                fracture.extend(colour.as_serialized_batches());
            }
            self.scarred = true;
            messages.push(self.row(FRACTURE, &at, fracture)?);
        } else if whole && self.scarred {
            let none = Mesh3D::clear_fields().as_serialized_batches();
            messages.push(self.row(FRACTURE, &at, none)?);
        }
        let points = self.points(&drawn, frame, whole);
        messages.push(self.row(POINTS, &at, points)?);
        let mut plots = vec![self.plot(STEP_MS, &at, shown.step_seconds)?];
        if let Some(seconds) = shown.latency_seconds {
            plots.push(self.plot(LATENCY_MS, &at, seconds)?);
        }
        for measured in &frame.measures {
            plots.push(self.measured(&at, measured)?);
        }
        for (index, (name, reading)) in self.probes.iter().zip(&frame.readings).enumerate() {
            plots.push(self.reading(&at, index, name, reading)?);
        }
        for happening in std::mem::take(&mut self.untold) {
            plots.extend(happening.messages(&self.store)?);
        }
        self.drawn = Some(drawn);
        let generation = self.generation;
        let step = Step {
            generation,
            whole,
            messages,
        };
        Ok((step, plots))
    }

    /// A surface's positions and normals; of a whole step, also its triangles.
    fn surface(
        &mut self,
        surface: &Surface,
        frame: &Frame,
        whole: bool,
    ) -> Vec<SerializedComponentBatch> {
        vertex_normals(&frame.vertices, surface, &mut self.normals);
        let positions = surface.vertices.iter().map(|&v| v as usize);
        let mut batches = vec![
            batch(
                positions_of(&frame.vertices, positions),
                Mesh3D::descriptor_vertex_positions(),
            ),
            batch(
                triples::<Float32Type>(self.normals.as_flattened().to_vec()),
                Mesh3D::descriptor_vertex_normals(),
            ),
        ];
        if whole {
            batches.push(batch(
                triples::<UInt32Type>(surface.triangles.as_flattened().to_vec()),
                Mesh3D::descriptor_triangle_indices(),
            ));
        }
        batches
    }

    fn points(&self, drawn: &Drawn, frame: &Frame, whole: bool) -> Vec<SerializedComponentBatch> {
        let points = || drawn.points.iter().copied();
        let colours = points().map(|point| match frame.point_states[point] {
            PointState::Valid => VALID,
            PointState::Predicted => PREDICTED,
            PointState::Held => HELD,
            PointState::Lost | PointState::Absent => LOST,
        });
        let mut batches = vec![
            batch(
                positions_of(&frame.points, points()),
                Points3D::descriptor_positions(),
            ),
            batch(
                Arc::new(UInt32Array::from_iter_values(colours)),
                Points3D::descriptor_colors(),
            ),
        ];
        if whole {
            let label = |point| self.labels.get(point).map_or("", String::as_str);
            let constant = Points3D::update_fields()
                .with_labels(points().map(label))
                .with_radii([POINT_RADIUS])
                .with_show_labels(false);
            batches.extend(constant.as_serialized_batches());
        }
        batches
    }

    fn plot(&self, entity: &str, at: &TimePoint, seconds: f64) -> Result<Message, EncodeError> {
        self.row(
            entity,
            at,
            Scalars::single(seconds * 1e3).as_serialized_batches(),
        )
    }

    /// A measure and its threshold, with their names: a reader may come at any step.
    fn measured(&self, at: &TimePoint, measured: &Measured) -> Result<Message, EncodeError> {
        let Measured {
            rule,
            greatest,
            threshold,
        } = *measured;
        let colours = [palette::qualitative(rule), THRESHOLD].map(Color::from_u32);
        let lines = SeriesLines::new()
            .with_names([format!("rule {rule}"), format!("threshold {rule}")])
            .with_colors(colours);
        let mut batches = Scalars::new([greatest, threshold]).as_serialized_batches();
        batches.extend(lines.as_serialized_batches());
        self.row(format!("{MEASURES}/{rule}"), at, batches)
    }

    /// A vector, with its names: a reader may come at any step.
    fn reading(
        &self,
        at: &TimePoint,
        index: usize,
        name: &str,
        reading: &Vector3<f64>,
    ) -> Result<Message, EncodeError> {
        let names = ["x", "y", "z"].map(|axis| format!("{name} {axis}"));
        let mut batches = Scalars::new([reading.x, reading.y, reading.z]).as_serialized_batches();
        batches.extend(SeriesLines::new().with_names(names).as_serialized_batches());
        self.row(format!("{READINGS}/{index}"), at, batches)
    }

    fn fixed(
        &self,
        entity: impl Into<EntityPath>,
        components: &dyn AsComponents,
    ) -> Result<Message, EncodeError> {
        self.row(
            entity,
            &TimePoint::STATIC,
            components.as_serialized_batches(),
        )
    }

    fn row(
        &self,
        entity: impl Into<EntityPath>,
        at: &TimePoint,
        batches: Vec<SerializedComponentBatch>,
    ) -> Result<Message, EncodeError> {
        let chunk = Chunk::builder(entity)
            .with_serialized_batches(RowId::new(), at.clone(), batches)
            .build()?;
        let message = LogMsg::ArrowMsg(self.store.clone(), chunk.to_arrow_msg()?);
        Ok(Message::encode(&message)?)
    }
}

/// The colour of each vertex's strongest point.
fn dominant_colours(drawn: &Drawn) -> SerializedComponentBatch {
    let Drawn {
        surface, layout, ..
    } = drawn;
    let dominant = surface.vertices.iter();
    let dominant = dominant.map(|&v| layout.dominant[v as usize]);
    batch(
        Arc::new(UInt32Array::from_iter_values(
            dominant.map(palette::qualitative),
        )),
        Mesh3D::descriptor_vertex_colors(),
    )
}

pub(crate) fn time_of(frame: &Frame) -> TimePoint {
    let step = i64::try_from(frame.step).unwrap_or(i64::MAX);
    let at = TimePoint::default()
        .with_index(STEP, TimeCell::from_sequence(step))
        .with_index(SIMULATION_TIME, duration(frame.time_seconds));
    match frame.capture_time_seconds {
        Some(seconds) => at.with_index(CAPTURE_TIME, duration(seconds)),
        None => at,
    }
}

/// Sources count from where they like, so the time of capture is a duration too, and no date.
#[expect(
    clippy::cast_possible_truncation,
    reason = "`as` saturates: a time beyond 292 years stays there"
)]
fn duration(seconds: f64) -> TimeCell {
    TimeCell::from_duration_nanos((seconds * 1e9).round() as i64)
}

fn batch(array: ArrayRef, descriptor: re_sdk::ComponentDescriptor) -> SerializedComponentBatch {
    SerializedComponentBatch::new(array, descriptor)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "viewers draw single precision"
)]
fn positions_of(of: &[Vector3<f64>], which: impl ExactSizeIterator<Item = usize>) -> ArrayRef {
    let mut flat = Vec::with_capacity(3 * which.len());
    for index in which {
        let metres = of[index];
        flat.extend_from_slice(&[metres.x as f32, metres.y as f32, metres.z as f32]);
    }
    triples::<Float32Type>(flat)
}

/// Rerun's vectors of three, straight from memory: several times faster than through its typed components.
fn triples<T: ArrowPrimitiveType>(flat: Vec<T::Native>) -> ArrayRef
where
    ScalarBuffer<T::Native>: From<Vec<T::Native>>,
{
    let field = Arc::new(Field::new("item", T::DATA_TYPE, false));
    let values = PrimitiveArray::<T>::new(flat.into(), None);
    Arc::new(FixedSizeListArray::new(field, 3, Arc::new(values), None))
}
