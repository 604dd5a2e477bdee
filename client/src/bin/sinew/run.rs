//! `sinew run`: a scene from a file.

use std::path::PathBuf;

use clap::Args;
use sinew_client::{Client, SceneFile};

use crate::out::{put, say};
use crate::{
    Failure,
    drive::{Posted, Report, Speed, post},
    table::count,
};

/// Runs a scene file: posts it, streams its take where it names one, receives the mesh, and measures.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew run bridge.toml                          on a server inside this command
  sinew run walk.json --server stage:7370        on a server that runs already
  sinew run bridge.toml --frames 600 --fast      600 steps, as fast as the machine can
  sinew run walk.json --session take-3           names the session")]
pub(crate) struct Arguments {
    /// The scene file, JSON or TOML.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// A server that runs already. Without it: one inside this command.
    #[arg(long, value_name = "HOST:PORT")]
    server: Option<String>,
    /// End after so many frames. Without it: the whole take, or ten simulated seconds.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// No pacing: as fast as the machine can.
    #[arg(long)]
    fast: bool,
    /// The session's id. Without it: one that the server makes.
    #[arg(long, value_name = "ID", default_value = "", hide_default_value = true)]
    session: String,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    let file = SceneFile::load(&arguments.scene)?;
    warn(&file.warnings);
    let report = match &arguments.server {
        Some(address) => {
            let client = Client::connect(address).await?;
            let (name, outcome) = follow(&client, file, &arguments).await?;
            let deleted = client.delete_session(&name).await;
            let report = outcome?;
            deleted?;
            report
        }
        None => embedded(file, &arguments).await?,
    };
    put!("\n{}", report.table());
    Ok(())
}

#[cfg(feature = "embedded")]
async fn embedded(file: SceneFile, arguments: &Arguments) -> Result<Report, Failure> {
    let server = crate::embedded::start(None, None).await?;
    let address = server.address();
    let outcome = async {
        let client = Client::connect(&address.to_string()).await?;
        follow(&client, file, arguments).await?.1
    }
    .await;
    crate::embedded::stop(server).await?;
    outcome
}

#[cfg(not(feature = "embedded"))]
async fn embedded(_: SceneFile, _: &Arguments) -> Result<Report, Failure> {
    Err("this build holds no server; give --server HOST:PORT".into())
}

/// The session's name, and how its run went.
async fn follow(
    client: &Client,
    file: SceneFile,
    arguments: &Arguments,
) -> Result<(String, Result<Report, Failure>), Failure> {
    let speed = if arguments.fast {
        Speed::Unpaced
    } else {
        Speed::AsCaptured
    };
    let posted = post(client, file, &arguments.session, arguments.frames, speed).await?;
    warn(&posted.session.warnings);
    say!("{}", describe(&posted));
    let name = posted.session.name.clone();
    Ok((name, posted.run(client).await))
}

/// What a session holds, in a sentence.
pub(crate) fn describe(posted: &Posted) -> String {
    let session = &posted.session;
    let title = if session.title.is_empty() {
        &session.name
    } else {
        &session.title
    };
    format!(
        "{title}: {} points move {} vertices in {} cells, {} frames at {:.0} Hz.",
        count(u64::from(session.point_count)),
        count(u64::from(session.vertex_count)),
        count(u64::from(session.cell_count)),
        count(posted.total()),
        posted.rate_hz(),
    )
}

/// Shows warnings.
pub(crate) fn warn(warnings: &[String]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}
