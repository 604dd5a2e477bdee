//! Sinew from a program: connect, post a scene, stream motion, receive the mesh that follows.
//!
//! A scene may come from a file, which names its take and its mesh ([`SceneFile`]):
//!
//! ```no_run
//! use std::{path::Path, sync::Arc};
//!
//! use sinew_client::{Client, SceneFile, Update, grid, paced, take_frames};
//! use sinew_proto::v1;
//!
//! # async fn tour() -> Result<(), Box<dyn std::error::Error>> {
//! let client = Client::connect("127.0.0.1:7370").await?;
//!
//! // A session is one scene that steps on its own.
//! let mut file = SceneFile::load(Path::new("walk.json"))?;
//! let session = client
//!     .create_session(v1::CreateSessionRequest {
//!         session_id: "walk".to_owned(),
//!         scene: Some(file.scene_for(&client).await?),
//!         run: true,
//!         ..v1::CreateSessionRequest::default()
//!     })
//!     .await?;
//!
//! // Subscribe before the motion starts, so that no frame is missed.
//! let mut subscription = client
//!     .subscribe(v1::SubscribeRequest {
//!         session: session.name.clone(),
//!         ..v1::SubscribeRequest::default()
//!     })
//!     .await?;
//!
//! // The take's frames leave at their capture times.
//! let take = Arc::new(file.take.take().ok_or("the scene names no take")?);
//! let hello = v1::Hello { session: session.name, source: "walk".to_owned(), ..Default::default() };
//! let mut motion = client.stream_motion(hello, paced(take_frames(take, usize::MAX))).await?;
//! tokio::spawn(async move { while let Ok(Some(_ack)) = motion.ack().await {} });
//!
//! while let Some(update) = subscription.next().await? {
//!     match update {
//!         Update::Keyframe(keyframe) => println!("labels {:?}", keyframe.labels),
//!         Update::Frame(frame) => {
//!             let vertices = grid::positions(frame.vertices.as_ref())?;
//!             println!("step {}: vertex 0 at {}", frame.step, vertices[0]);
//!         }
//!         // The subscription's mirror has the mesh as it is now.
//!         Update::Patch(patch) => println!("topology version {}", patch.to_version),
//!         Update::Events(events) => println!("{} events", events.len()),
//!         Update::Goodbye(_) => break,
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! A refusal is an error with its code, its reason and the field that is wrong; its text says what to do:
//!
//! ```no_run
//! # async fn refused(client: sinew_client::Client) {
//! let error = client.session("sessions/nobody").await.expect_err("there is none");
//! println!("{error}");
//! let refusal = error.refusal().expect("the server answered");
//! println!("{:?} {} {:?}", refusal.code, refusal.reason, refusal.field);
//! # }
//! ```
//!
//! Scene files need no server to be read:
//!
//! ```
//! use sinew_client::{SceneFile, Syntax};
//!
//! let error = SceneFile::of_text("title = \"Strip\"\n[mesh]\nlatice = {}", Syntax::Toml, None)
//!     .expect_err("a letter is missing");
//! assert_eq!((error.line, error.field.as_str()), (3, "mesh.latice"));
//! ```

mod chunks;
mod client;
mod error;
pub mod grid;
mod mirror;
mod motion;
mod record;
mod relay;
mod scene_file;
mod subscription;
pub mod sweep;
mod upload;
pub mod vtk;
mod watch;

pub use client::Client;
pub use error::{ClientError, Refusal};
pub use mirror::{Applied, MeshMirror};
pub use motion::{CaptureClock, MotionStream, motion_frame, paced, paced_by, take_frames};
pub use record::{MotionRecord, RECORD_MAGIC, RecordError, Recording};
pub use relay::{Relay, RelayError, RelaySettings, Relayed};
pub use scene_file::{ParseError, SceneFile, SceneFileError, Syntax, load_edits, load_mapping};
pub use sinew_bridges as bridges;
pub use sinew_formats::take::Take;
pub use subscription::{Counts, Subscription, Update};
pub use watch::Watch;
