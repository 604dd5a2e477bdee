//! Sweeps: one motion, many looks.
//!
//! A sweep file names a scene file and lists alternatives of its mapping, its rules and its elastic solid, in JSON or TOML:
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
//! `elastic` is merged into the scene's `motion.elastic`, as protobuf merges messages.

use std::{path::Path, sync::Arc};

use futures::{SinkExt as _, channel::mpsc};
use nalgebra::Vector3;
use prost::Message as _;
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Colour {
    /// All alike.
    #[default]
    Plain,
    /// By the point that moves each vertex most.
    Points,
    /// By how far each vertex is from where it was at rest: this far, m, and further, is the end of the scale.
    Displacement(f64),
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
    /// What is merged into the scene's elastic solid; with nothing set, it stays as it is.
    pub elastic: v1::ElasticSolid,
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
    #[serde(default)]
    elastic: v1::ElasticSolid,
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
            let problem = "is empty, and so is columns; list alternatives in one or both";
            return Err(refuse("rows", problem.into()));
        }
        let [rows, columns] = [&text.rows, &text.columns].map(|given| match &given[..] {
            [] => vec![Alternative::default()],
            some => some.to_vec(),
        });
        let count = rows.len() * columns.len();
        if count > VIEWS {
            let problem =
                format!("make {count} views with the rows; at most {VIEWS} fit one sweep");
            return Err(refuse("columns", problem));
        }
        if text.frames == Some(0) {
            let problem = "is 0; give 1 or more, or leave it out";
            return Err(refuse("frames", problem.into()));
        }
        let scene = SceneFile::load(&path.parent().unwrap_or(Path::new("")).join(&text.scene))?;
        if let Colour::Displacement(end) = text.colour
            && !(end.is_finite() && end > 0.0)
        {
            let problem =
                format!("is {end}; give the displacement at the end of the scale, m, above 0");
            return Err(refuse("colour.displacement", problem));
        }
        let varied = |one: &Alternative| one.elastic != v1::ElasticSolid::default();
        if rows.iter().chain(&columns).any(varied) && solid(&mut scene.scene.clone()).is_none() {
            let problem = "is given, and the scene has no motion.elastic; leave it out";
            return Err(refuse("elastic", problem.into()));
        }
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
            elastic: merged(row.elastic.clone(), &column.elastic),
        };
        Ok(Self {
            title: match &*text.title {
                "" => scene.scene.title.clone(),
                title => title.to_owned(),
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
        if let Some(solid) = solid(&mut scene) {
            *solid = merged(std::mem::take(solid), &view.elastic);
        }
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

/// The elastic solid that is a scene's motion.
fn solid(scene: &mut v1::Scene) -> Option<&mut v1::ElasticSolid> {
    match scene.motion.as_mut()?.source.as_mut()? {
        v1::motion::Source::Elastic(solid) => Some(solid),
        v1::motion::Source::External(_)
        | v1::motion::Source::MassSpring(_)
        | v1::motion::Source::Particles(_) => None,
    }
}

/// A solid with what another one sets.
fn merged(mut base: v1::ElasticSolid, over: &v1::ElasticSolid) -> v1::ElasticSolid {
    base.merge(&*over.encode_to_vec())
        .expect("what was just encoded is read");
    base
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
