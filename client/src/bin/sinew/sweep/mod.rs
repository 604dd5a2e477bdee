//! `sinew sweep`: many mappings of one motion, side by side.

mod picture;
mod recording;
mod sheet;

use std::path::PathBuf;

use clap::Args;
use nalgebra::Vector3;
use re_sdk_types::components::Color;
use sinew_client::{
    Client,
    sweep::{Colour, Shot, Sweep},
};
use sinew_mesh::{Surface, surface};

use crate::out::{put, say};
use crate::{
    Failure, embedded,
    run::warn,
    table::{Table, count},
};
use picture::{Eye, Light, Subject, draw};
use recording::Recording;
use sheet::{Cell, save, sheet};

/// Size of a picture, pixels.
const PICTURE: [usize; 2] = [440, 340];
/// Steps shown of each view in the recording, at most.
const SHOTS: u64 = 40;
/// A plain surface, in linear light: a pale blue.
const PLAIN: Light = [0.28, 0.43, 0.62];

/// Runs a grid of mappings over one motion, one session per mapping, and shows them side by side: as a Rerun recording
/// with a view per mapping, and as a contact sheet.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew sweep client/scenes/figure-7.toml             writes figure-7.rrd and figure-7.png here
  sinew sweep figure-7.toml --out /tmp                and there
  sinew sweep figure-7.toml --server stage:7370       on a server that runs already")]
pub(crate) struct Arguments {
    /// The sweep file, JSON or TOML: a scene file and alternatives of its mapping.
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
    surface: Surface,
    colours: Vec<Light>,
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
        let first = surface(&shots[0].grid.cells);
        let colours = match sweep.colour {
            Colour::Plain => vec![PLAIN; first.vertices.len()],
            Colour::Points => {
                let points = sweep.strongest(client, view, &first.vertices).await?;
                points.into_iter().map(of_point).collect()
            }
        };
        let shown: Vec<Color> = colours
            .iter()
            .map(|light| {
                let [r, g, b] = sheet::encoded(light);
                Color::from_rgb(r, g, b)
            })
            .collect();
        for shot in &shots {
            recording.add(index, shot, &first, &shown)?;
        }
        let mut times: Vec<f64> = shots[1..].iter().map(|shot| shot.step_seconds).collect();
        times.sort_by(f64::total_cmp);
        let last = shots.pop().ok_or("a sweep shows the rest pose at least")?;
        seen.push(Seen {
            apart: seen.first().and_then(|first| apart(&last, &first.last)),
            step_seconds: times[times.len() / 2],
            surface: first,
            colours,
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
        let corners = seen.surface.vertices.iter();
        corners
            .map(|&v| seen.last.grid.positions[v as usize])
            .collect()
    };
    let all: Vec<Vector3<f64>> = views.iter().flat_map(visible).collect();
    let eye = Eye::on(all.iter(), sweep.scene.scene.up(), PICTURE);
    let cell = |(view, seen): (&sinew_client::sweep::View, &Seen)| {
        let subject = Subject {
            positions: &seen.last.grid.positions,
            surface: &seen.surface,
            colours: &seen.colours,
            points: &seen.last.points,
        };
        let apart = match seen.apart {
            Some([rms, max]) => format!("from the first: rms {}, max {}", length(rms), length(max)),
            None => format!(
                "step {}, t = {:.2} s",
                seen.last.step, seen.last.time_seconds
            ),
        };
        Cell {
            picture: draw(&subject, &eye, PICTURE),
            label: view.label.clone(),
            figures: [apart, format!("{} a step", time(seen.step_seconds))],
        }
    };
    let cells: Vec<Cell> = sweep.views.iter().zip(views).map(cell).collect();
    sheet(&sweep.title, sweep.columns, &cells)
}

fn table(sweep: &Sweep, views: &[Seen]) -> Table {
    let mut table = Table::of_numbers();
    table.row(["view", "step", "rms from the first", "max"]);
    for (view, seen) in sweep.views.iter().zip(views) {
        let [rms, max] = seen
            .apart
            .map_or(["-".to_owned(), "-".to_owned()], |apart| apart.map(length));
        table.row([view.label.clone(), time(seen.step_seconds), rms, max]);
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

/// Colours that tell neighbouring indices apart: hues by the golden angle, in linear light.
fn of_point(index: u32) -> Light {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = (0.58 + GOLDEN * f64::from(index)).fract() * std::f64::consts::TAU;
    #[expect(clippy::cast_possible_truncation, reason = "light has few digits")]
    let part = |shift: f64| (0.42 + 0.33 * (hue - shift).cos()) as f32;
    [part(0.0), part(2.094), part(4.189)]
}
