//! `sinew demo`: the whole of Sinew in one command.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_client::{Client, SceneFile, Syntax};
use sinew_formats::take;
use sinew_server::Server;

use crate::out::{put, say};
use crate::{
    Failure,
    drive::{Report, Speed, post},
    embedded,
    run::{describe, warn},
    table::Table,
};

const SCENE: &str = include_str!("../../../demo/walk.json");
const TAKE: &[u8] = include_bytes!("../../../demo/walk.bvh");

/// The session's id, and so the name of the recording.
const SESSION: &str = "demo";

/// A walking figure, live: a server on loopback, a scene, a real take streamed at its own rate, and the mesh that
/// follows, in the browser and in Rerun.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew demo                            the walk, to the end; writes demo.rrd here
  sinew demo --stay                     keeps the page open afterwards, until Ctrl-C
  sinew demo --fast --out /tmp          as fast as the machine can
  sinew demo --scene mine.json          the same with a scene of your own")]
pub(crate) struct Arguments {
    /// Folder for the recording demo.rrd.
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// End after so many frames. Without it: the whole take.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// No pacing: as fast as the machine can.
    #[arg(long)]
    fast: bool,
    /// A scene file (JSON or TOML) instead of the walk.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Port on loopback. Without it: 7370, or any free one where that is taken.
    #[arg(long, value_name = "P")]
    port: Option<u16>,
    /// Keep serving after the last frame, until Ctrl-C.
    #[arg(long)]
    stay: bool,
}

pub(crate) async fn demo(arguments: Arguments) -> Result<(), Failure> {
    let file = match &arguments.scene {
        Some(path) => SceneFile::load(path)?,
        None => walk()?,
    };
    std::fs::create_dir_all(&arguments.out).map_err(|error| {
        format!(
            "cannot make the folder {}: {error}",
            arguments.out.display()
        )
    })?;
    let server = embedded::start(arguments.port, Some(arguments.out.clone())).await?;
    let outcome = tokio::select! {
        outcome = follow(&server, file, &arguments) => outcome,
        signal = tokio::signal::ctrl_c() => {
            signal?;
            Err("stopped by Ctrl-C before the end; the recording holds what there was".into())
        }
    };
    if let Ok(report) = &outcome {
        put!("\n{}", report.table());
        if arguments.stay {
            eprintln!("\nThe page stays open until Ctrl-C.");
            tokio::signal::ctrl_c().await?;
        }
    }
    // Recordings are whole only after the server has stopped: stop it whatever happened.
    let stopped = embedded::stop(server).await;
    outcome?;
    stopped?;
    put!("{}", files(&arguments.out)?);
    Ok(())
}

fn walk() -> Result<SceneFile, Failure> {
    let take = take::parse("walk.bvh", TAKE, &take::Options::default())?;
    let mut file = SceneFile::of_text(SCENE, Syntax::Json, Some(take))?;
    // What the file lacks, such as a unit, is known of this one.
    file.warnings.clear();
    Ok(file)
}

async fn follow(
    server: &Server,
    file: SceneFile,
    arguments: &Arguments,
) -> Result<Report, Failure> {
    let address = server.address();
    let client = Client::connect(&address.to_string()).await?;
    let speed = if arguments.fast {
        Speed::Unpaced
    } else {
        Speed::AsCaptured
    };
    warn(&file.warnings);
    let posted = post(&client, file, SESSION, arguments.frames, speed).await?;
    warn(&posted.session.warnings);
    say!("{}\n", describe(&posted));
    say!("  in the browser  http://{address}/sessions/{SESSION}");
    say!("  in Rerun        rerun+http://{address}/proxy\n");
    posted.run(&client).await
}

/// The files written, with their sizes.
fn files(out: &Path) -> Result<Table, Failure> {
    let path = out.join(format!("{SESSION}.rrd"));
    let size = std::fs::metadata(&path)
        .map_err(|error| format!("no recording {}: {error}", path.display()))?
        .len();
    if size == 0 {
        return Err(format!("the recording {} is empty", path.display()).into());
    }
    let mut table = Table::of_numbers();
    table.row(["files"]);
    table.row([format!("  {}", path.display()), bytes(size)]);
    Ok(table)
}

/// Bytes for people.
fn bytes(count: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "shown with three digits")]
    let size = count as f64;
    match count {
        0..1_000 => format!("{count} B"),
        1_000..1_000_000 => format!("{:.1} kB", size / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", size / 1e6),
        1_000_000_000.. => format!("{:.1} GB", size / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_and_the_take_inside_fit_each_other() {
        let file = walk().unwrap();
        let take = file.take.unwrap();
        assert_eq!((take.frames(), take.rate_hz()), (1064, 120.0));
        let Some(sinew_proto::v1::mesh::Source::Lattice(lattice)) = file.scene.mesh.unwrap().source
        else {
            panic!("no lattice")
        };
        for bone in lattice.bones {
            assert!(take.labels().contains(&bone.from), "{}", bone.from);
            assert!(take.labels().contains(&bone.to), "{}", bone.to);
        }
    }

    #[test]
    fn sizes_read_well() {
        assert_eq!(bytes(999), "999 B");
        assert_eq!(bytes(15_300_000), "15.3 MB");
    }
}
