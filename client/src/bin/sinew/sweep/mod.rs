//! `sinew sweep`: many looks of one motion, side by side.

mod picture;
mod recording;
mod sheet;
mod skin;

use std::path::PathBuf;

use clap::Args;
use nalgebra::Vector3;
use sinew_client::{
    Client,
    sweep::{Shot, Sweep},
};
use sinew_mesh::inspect;

use crate::out::{put, say};
use crate::{
    Failure, embedded,
    run::warn,
    table::{Table, count},
};
use picture::{Eye, Subject, draw};
use recording::Recording;
use sheet::{Cell, save, sheet};
use skin::{Palette, Skin};

/// Size of a picture, pixels.
const PICTURE: [usize; 2] = [440, 340];
/// Steps shown of each view in the recording, at most.
const SHOTS: u64 = 40;

/// Runs a grid of mappings, rules and elastic solids over one motion, one session for each, and shows them side by side: as a Rerun
/// recording with a view for each, and as a contact sheet.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew sweep client/scenes/figure-7.toml             writes figure-7.rrd and figure-7.png here
  sinew sweep figure-7.toml --out /tmp                and there
  sinew sweep figure-7.toml --server stage:7370       on a server that runs already")]
pub(crate) struct Arguments {
    /// The sweep file, JSON or TOML: a scene file and alternatives of its mapping, rules and elastic
    /// solid.
    #[arg(value_name = "SWEEP")]
    sweep: PathBuf,
    /// A server that runs already. Without it: one inside this command.
    #[arg(long, value_name = "HOST:PORT")]
    server: Option<String>,
    /// Folder for the recording and the contact sheet.
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

pub(crate) async fn sweep(arguments: Arguments) -> Result<(), Failure> {
    let sweep = Sweep::load(&arguments.sweep)?;
    warn(&sweep.scene.warnings);
    std::fs::create_dir_all(&arguments.out).map_err(|error| {
        format!(
            "cannot make the folder {}: {error}",
            arguments.out.display()
        )
    })?;
    let name = arguments
        .sweep
        .file_stem()
        .ok_or("a sweep file has a name")?;
    let path = |extension| arguments.out.join(name).with_extension(extension);
    say!(
        "{}: {} views, {} frames each",
        sweep.title,
        sweep.views.len(),
        count(sweep.frames)
    );
    let recording = path("rrd");
    let views = match &arguments.server {
        Some(address) => views(&Client::connect(address).await?, &sweep, &recording).await?,
        None => {
            let server = embedded::start(None, None).await?;
            let address = server.address().to_string();
            let outcome =
                async { views(&Client::connect(&address).await?, &sweep, &recording).await };
            let outcome = outcome.await;
            embedded::stop(server).await?;
            outcome?
        }
    };
    let picture = contact_sheet(&sweep, &views);
    save(&picture, &path("png"))?;
    put!("\n{}", table(&sweep, &views));
    say!("\n{}\n{}", recording.display(), path("png").display());
    Ok(())
}

/// A view when its motion is over.
struct Seen {
    last: Shot,
    skin: Skin,
    /// How many parts the mesh is in, where it changed.
    parts: Option<usize>,
    /// Median of the steps seen, s.
    step_seconds: f64,
    /// Distances from the first view's vertices, m: root of the mean square, and the greatest.
    apart: Option<[f64; 2]>,
}

async fn views(
    client: &Client,
    sweep: &Sweep,
    recording: &std::path::Path,
) -> Result<Vec<Seen>, Failure> {
    let labels: Vec<&str> = sweep.views.iter().map(|view| &*view.label).collect();
    let recording = Recording::create(recording, &labels, sweep.columns, sweep.scene.scene.up())?;
    let every = sweep.frames.div_ceil(SHOTS);
    let mut seen: Vec<Seen> = Vec::new();
    for (index, view) in sweep.views.iter().enumerate() {
        eprintln!("  {}", view.label);
        let mut shots = Vec::new();
        let refused = |error| format!("{}: {error}", view.label);
        sweep
            .run(client, view, every, |shot| shots.push(shot))
            .await
            .map_err(refused)?;
        let palette = Palette::of(sweep, client, view, &shots[0]).await?;
        for (i, shot) in shots.iter().enumerate() {
            let changed = i == 0 || shot.grid.cells != shots[i - 1].grid.cells;
            recording.add(index, shot, &palette.skin(shot), changed)?;
        }
        let mut times: Vec<f64> = shots[1..].iter().map(|shot| shot.step_seconds).collect();
        times.sort_by(f64::total_cmp);
        let last = shots.pop().ok_or("a sweep shows the rest pose at least")?;
        let changed = (shots.first()).is_some_and(|rest| rest.grid.cells != last.grid.cells);
        seen.push(Seen {
            apart: seen.first().and_then(|first| apart(&last, &first.last)),
            step_seconds: times[times.len() / 2],
            parts: changed.then(|| inspect(&last.grid).components),
            skin: palette.skin(&last),
            last,
        });
    }
    recording.finish()?;
    Ok(seen)
}

/// Distances between the vertices of two meshes; none where these are not the same.
fn apart(shot: &Shot, other: &Shot) -> Option<[f64; 2]> {
    if shot.grid.cells != other.grid.cells {
        return None;
    }
    let pairs = shot.grid.positions.iter().zip(&other.grid.positions);
    let squares: Vec<f64> = pairs.map(|(x, y)| (x - y).norm_squared()).collect();
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 vertices")]
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    Some([mean.sqrt(), squares.into_iter().fold(0.0, f64::max).sqrt()])
}

fn contact_sheet(sweep: &Sweep, views: &[Seen]) -> picture::Picture {
    let visible = |seen: &'_ Seen| -> Vec<Vector3<f64>> {
        let corners = seen.skin.surface.vertices.iter();
        corners
            .map(|&v| seen.last.grid.positions[v as usize])
            .collect()
    };
    let all: Vec<Vector3<f64>> = views.iter().flat_map(visible).collect();
    let eye = Eye::on(all.iter(), sweep.scene.scene.up(), PICTURE);
    let cell = |(view, seen): (&sinew_client::sweep::View, &Seen)| {
        let subject = Subject {
            positions: &seen.last.grid.positions,
            skin: &seen.skin,
            // Where points have the colours of the surface, they would only hide it.
            points: seen
                .skin
                .points
                .as_ref()
                .map_or(&*seen.last.points, |_| &[]),
        };
        let found = match (seen.parts, seen.apart) {
            (Some(parts), _) => format!("torn, in {parts} parts"),
            (None, Some([rms, max])) => {
                format!("from the first: rms {}, max {}", length(rms), length(max))
            }
            (None, None) => format!(
                "step {}, t = {:.2} s",
                seen.last.step, seen.last.time_seconds
            ),
        };
        Cell {
            picture: draw(&subject, &eye, PICTURE),
            label: view.label.clone(),
            figures: [found, format!("{} a step", time(seen.step_seconds))],
        }
    };
    let cells: Vec<Cell> = sweep.views.iter().zip(views).map(cell).collect();
    sheet(&sweep.title, sweep.columns, &cells)
}

fn table(sweep: &Sweep, views: &[Seen]) -> Table {
    let mut table = Table::of_numbers();
    table.row(["view", "step", "rms from the first", "max", "parts"]);
    for (view, seen) in sweep.views.iter().zip(views) {
        let [rms, max] = seen
            .apart
            .map_or(["-".to_owned(), "-".to_owned()], |apart| apart.map(length));
        let parts = seen.parts.map_or("-".to_owned(), |parts| parts.to_string());
        table.row([view.label.clone(), time(seen.step_seconds), rms, max, parts]);
    }
    table
}

fn length(metres: f64) -> String {
    if metres < 1.0 {
        format!("{:.1} mm", 1e3 * metres)
    } else {
        format!("{metres:.2} m")
    }
}

fn time(seconds: f64) -> String {
    format!("{:.2} ms", 1e3 * seconds)
}
