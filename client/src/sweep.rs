//! Sweeps: one motion, many looks.
//!
//! A sweep file names a scene file and lists alternatives of its mapping and its rules, in JSON or TOML:
//!
//! ```toml
//! scene = "beam.toml"
//!
//! [[rows]]
//! label = "mean"
//! mapping.rule.mean = {}
//! [[rows]]
//! label = "cubic RBF"
//! mapping.rule.radial_basis = {}
//!
//! [[columns]]
//! label = "keep 10"
//! mapping.filter.keep.k = 10
//! [[columns]]
//! label = "keep 24"
//! mapping.filter.keep.k = 24
//! ```
//!
//! Each row meets each column: a view. Its mapping is the scene's, with the fields that the row sets replaced, then those
//! that the column sets; a field is one of `Mapping`'s own, such as `filter`, and is replaced whole. So are `rules`.

use std::{path::Path, sync::Arc};

use futures::{SinkExt as _, channel::mpsc};
use nalgebra::Vector3;
use serde::Deserialize;
use sinew_formats::take::Take;
use sinew_mesh::Grid;
use sinew_proto::v1;

use crate::{Client, ClientError, SceneFile, SceneFileError, grid, scene_file, take_frames};

/// Views of a sweep at most.
const VIEWS: usize = 64;
/// Frames that wait in a session at most while it is paused: below the 64 that its queue takes.
const AHEAD: u64 = 32;

/// What a sweep does.
#[derive(Debug)]
pub struct Sweep {
    /// Shown to people; the scene's, where the file gives none.
    pub title: String,
    /// The scene that all views share.
    pub scene: SceneFile,
    /// Frames of the motion, or steps; where the file gives none, the whole take or ten simulated seconds.
    pub frames: u64,
    /// How the surface is coloured in pictures.
    pub colour: Colour,
    /// Views side by side.
    pub columns: usize,
    /// Row after row.
    pub views: Vec<View>,
}

/// How a surface is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Colour {
    /// All alike.
    #[default]
    Plain,
    /// By the point that moves each vertex most.
    Points,
}

/// One look of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Shown to people.
    pub label: String,
    /// The whole mapping.
    pub mapping: v1::Mapping,
    /// When the mesh comes apart, and how.
    pub rules: Vec<v1::TopologyRule>,
}

/// A mesh and its points at one step of one view.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Steps taken.
    pub step: u64,
    /// Simulated time, s.
    pub time_seconds: f64,
    /// What the last step took, s.
    pub step_seconds: f64,
    /// The mesh, m.
    pub grid: Grid,
    /// The points, m.
    pub points: Vec<Vector3<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    #[serde(default)]
    title: String,
    scene: String,
    frames: Option<u64>,
    #[serde(default)]
    colour: Colour,
    #[serde(default)]
    rows: Vec<Alternative>,
    #[serde(default)]
    columns: Vec<Alternative>,
}

#[derive(Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Alternative {
    label: String,
    #[serde(default)]
    mapping: v1::Mapping,
    rules: Option<Vec<v1::TopologyRule>>,
}

impl Sweep {
    /// Reads a sweep file, the scene file that it names and the files that that names.
    ///
    /// # Errors
    /// [`SceneFileError`]: which file, which line or field, what is wrong.
    pub fn load(path: &Path) -> Result<Self, SceneFileError> {
        let text: Text = scene_file::read(path)?;
        let refuse = |field, problem: String| SceneFileError::File {
            path: path.to_owned(),
            field,
            problem,
        };
        if text.rows.is_empty() && text.columns.is_empty() {
            return Err(refuse(
                "rows",
                "is empty, and so is columns; list alternatives in one or both".into(),
            ));
        }
        let single = || vec![Alternative::default()];
        let rows = if text.rows.is_empty() {
            single()
        } else {
            text.rows
        };
        let columns = if text.columns.is_empty() {
            single()
        } else {
            text.columns
        };
        let count = rows.len() * columns.len();
        if count > VIEWS {
            return Err(refuse(
                "columns",
                format!("make {count} views with the rows; at most {VIEWS} fit one sweep"),
            ));
        }
        if text.frames == Some(0) {
            return Err(refuse(
                "frames",
                "is 0; give 1 or more, or leave it out".into(),
            ));
        }
        let scene = SceneFile::load(&path.parent().unwrap_or(Path::new("")).join(&text.scene))?;
        let base = scene.scene.mapping.clone().unwrap_or_default();
        let view = |row: &Alternative, column: &Alternative| View {
            label: [&*row.label, &column.label]
                .into_iter()
                .filter(|label| !label.is_empty())
                .collect::<Vec<_>>()
                .join(", "),
            mapping: overlaid(overlaid(base.clone(), &row.mapping), &column.mapping),
            rules: (column.rules.as_ref().or(row.rules.as_ref()))
                .unwrap_or(&scene.scene.rules)
                .clone(),
        };
        Ok(Self {
            title: if text.title.is_empty() {
                scene.scene.title.clone()
            } else {
                text.title
            },
            frames: frames(&scene, text.frames),
            colour: text.colour,
            columns: columns.len(),
            views: rows
                .iter()
                .flat_map(|row| columns.iter().map(|column| view(row, column)))
                .collect(),
            scene,
        })
    }

    /// Runs one view as a session of its own, in steps that do not depend on time: the session is paused, and takes as
    /// many steps as there are frames. `seen` gets the mesh at rest, then after every `every` frames and after the last.
    ///
    /// # Errors
    /// The server's refusal of the scene or the mapping; the fault of the session.
    ///
    /// # Panics
    /// If `every` is 0.
    pub async fn run(
        &self,
        client: &Client,
        view: &View,
        every: u64,
        mut seen: impl FnMut(Shot),
    ) -> Result<(), ClientError> {
        assert!(every > 0, "a shot needs a step");
        let session = self.create(client, view).await?;
        let outcome = self.step_through(client, &session, every, &mut seen).await;
        let deleted = client.delete_session(&session).await;
        outcome.and(deleted)
    }

    /// Creates a session of one view, paused; its name.
    async fn create(&self, client: &Client, view: &View) -> Result<String, ClientError> {
        let mut scene = self.scene.scene_for(client).await?;
        scene.mapping = Some(view.mapping.clone());
        scene.rules.clone_from(&view.rules);
        let request = v1::CreateSessionRequest {
            scene: Some(scene),
            ..v1::CreateSessionRequest::default()
        };
        Ok(client.create_session(request).await?.name)
    }

    async fn step_through(
        &self,
        client: &Client,
        session: &str,
        every: u64,
        seen: &mut impl FnMut(Shot),
    ) -> Result<(), ClientError> {
        let mut feed = match &self.scene.take {
            Some(take) => Some(Feed::open(client, session, take).await?),
            None => None,
        };
        let shot = async || {
            shot(
                client
                    .keyframe(v1::GetKeyframeRequest {
                        session: session.to_owned(),
                        precision: v1::Precision::F64.into(),
                        ..v1::GetKeyframeRequest::default()
                    })
                    .await?,
            )
        };
        seen(shot().await?);
        let mut done = 0;
        while done < self.frames {
            let next = (done + every).min(self.frames);
            while done < next {
                let steps = (next - done).min(AHEAD);
                if let Some(feed) = &mut feed {
                    feed.send(steps).await?;
                }
                client
                    .step(v1::StepRequest {
                        name: session.to_owned(),
                        steps: u32::try_from(steps).expect("at most AHEAD"),
                        expected_step: Some(done),
                    })
                    .await?;
                done += steps;
            }
            seen(shot().await?);
        }
        Ok(())
    }

    /// The point that moves each of these vertices most, by index, as a session's Explain says.
    ///
    /// # Errors
    /// As [`Sweep::run`].
    pub async fn strongest(
        &self,
        client: &Client,
        view: &View,
        vertices: &[u32],
    ) -> Result<Vec<u32>, ClientError> {
        let session = self.create(client, view).await?;
        let mut points = Vec::with_capacity(vertices.len());
        for &vertex in vertices {
            let why = client.explain(&session, vertex).await?;
            points.push(why.points.first().map_or(0, |influence| influence.index));
        }
        client.delete_session(&session).await?;
        Ok(points)
    }
}

/// A take on its way to a paused session, so many frames at a time.
struct Feed {
    frames: std::pin::Pin<Box<dyn futures::Stream<Item = v1::MotionFrame> + Send>>,
    sender: mpsc::Sender<v1::MotionFrame>,
    stream: crate::MotionStream,
}

impl Feed {
    async fn open(client: &Client, session: &str, take: &Take) -> Result<Self, ClientError> {
        let hello = v1::Hello {
            session: session.to_owned(),
            source: "sweep".to_owned(),
            labels: take.labels().to_vec(),
            ..v1::Hello::default()
        };
        let (sender, receiver) = mpsc::channel(usize::try_from(AHEAD).expect("small"));
        Ok(Self {
            frames: Box::pin(take_frames(Arc::new(take.clone()), usize::MAX)),
            stream: client.stream_motion(hello, receiver).await?,
            sender,
        })
    }

    /// Sends the next frames and waits until they have their place in the session's queue.
    async fn send(&mut self, count: u64) -> Result<(), ClientError> {
        use futures::StreamExt as _;
        let lost =
            || ClientError::Protocol("the stream of motion ended before its frames".to_owned());
        let mut last = 0;
        for _ in 0..count {
            let frame = self.frames.next().await.ok_or_else(lost)?;
            last = frame.sequence;
            self.sender.send(frame).await.map_err(|_| lost())?;
        }
        loop {
            let ack = self.stream.ack().await?.ok_or_else(lost)?;
            if ack.sequence >= last {
                return Ok(());
            }
        }
    }
}

/// The frames of a sweep: as asked, but no more than the take has.
fn frames(scene: &SceneFile, asked: Option<u64>) -> u64 {
    const SECONDS: f64 = 10.0;
    const STEP: f64 = 1.0 / 120.0;
    match (&scene.take, asked) {
        (Some(take), asked) => asked.unwrap_or(u64::MAX).min(take.frames() as u64),
        (None, Some(frames)) => frames,
        (None, None) => {
            let step = scene.scene.time_step_seconds;
            let step = if step > 0.0 { step } else { STEP };
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "`as` saturates"
            )]
            let steps = (SECONDS / step).round() as u64;
            steps.max(1)
        }
    }
}

/// A mapping with the fields that another one sets.
fn overlaid(base: v1::Mapping, over: &v1::Mapping) -> v1::Mapping {
    // Exhaustive: a new field does not compile until considered here.
    let v1::Mapping {
        weighting,
        filter,
        rule,
        points,
        reference,
        preset,
    } = over.clone();
    v1::Mapping {
        weighting: weighting.or(base.weighting),
        filter: filter.or(base.filter),
        rule: rule.or(base.rule),
        points: if points.is_empty() {
            base.points
        } else {
            points
        },
        reference: if reference == 0 {
            base.reference
        } else {
            reference
        },
        preset: if preset == 0 { base.preset } else { preset },
    }
}

fn shot(keyframe: v1::Keyframe) -> Result<Shot, ClientError> {
    let frame = keyframe.frame.unwrap_or_default();
    let timing = frame.timing.unwrap_or_default();
    #[expect(
        clippy::cast_precision_loss,
        reason = "a step takes far less than 2^53 ns"
    )]
    let step_seconds = timing.published.saturating_sub(timing.step_started) as f64 * 1e-9;
    Ok(Shot {
        step: frame.step,
        time_seconds: frame.time_seconds,
        step_seconds,
        grid: Grid {
            positions: grid::positions(frame.vertices.as_ref())?,
            cells: grid::cells(&keyframe.grid.unwrap_or_default())?,
        },
        points: grid::positions(frame.points.as_ref())?,
    })
}
