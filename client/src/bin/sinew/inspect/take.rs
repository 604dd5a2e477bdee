//! What a take holds.

use serde_json::json;
use sinew_formats::take::{self, Options, Take, Up};

use super::{Arguments, some};
use crate::out::{put, say};
use crate::{
    Failure,
    table::{Table, count},
};

pub(super) fn inspect(arguments: &Arguments) -> Result<(), Failure> {
    let options = Options {
        unit_scale: arguments.unit_scale,
    };
    let take = take::read(&arguments.file, &options)?;
    if arguments.json {
        say!("{:#}", to_json(&take));
    } else {
        say!("{}", arguments.file.display());
        put!("{}", describe(&take));
        if arguments.gaps {
            put!("{}", picture(&take));
        }
    }
    Ok(())
}

fn seconds(take: &Take) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 frames")]
    let frames = take.frames() as f64;
    frames / take.rate_hz()
}

fn up(take: &Take) -> Option<&'static str> {
    take.up().map(|up| match up {
        Up::Y => "y",
        Up::Z => "z",
    })
}

fn describe(take: &Take) -> String {
    let mut table = Table::of_words();
    let frames = format!(
        "{} at {} Hz, {:.2} s from {:.3} s",
        count(take.frames() as u64),
        take.rate_hz(),
        seconds(take),
        take.first_time_seconds()
    );
    table.row(["  frames", &frames]);
    table.row(["  points", &count(take.labels().len() as u64)]);
    if !take.skeleton().is_empty() {
        table.row(["  bones", &count(take.skeleton().len() as u64)]);
    }
    table.row(["  up", up(take).unwrap_or("not known")]);
    let gaps = take.gaps();
    let hidden: usize = gaps.iter().map(|gap| gap.missing).sum();
    table.row([
        "  hidden",
        &format!(
            "{} of {} samples",
            count(hidden as u64),
            count(take.visible().len() as u64)
        ),
    ]);
    let labels: Vec<_> = take.labels().iter().collect();
    table.row(["  labels", &some(&labels)]);
    let mut text = table.to_string();
    let mut hidden = Table::of_numbers();
    hidden.row(["  point", "hidden", "gaps", "longest"]);
    for (label, gap) in take
        .labels()
        .iter()
        .zip(&gaps)
        .filter(|(_, gap)| gap.missing > 0)
    {
        hidden.row([
            format!("  {label}"),
            format!("{:.1} %", 100.0 * gap.missing_share(take.frames())),
            count(gap.gaps as u64),
            count(gap.longest as u64),
        ]);
    }
    if gaps.iter().any(|gap| gap.missing > 0) {
        text += &format!("\nhidden, in frames:\n{hidden}");
    }
    for warning in take.warnings() {
        text += &format!("warning: {warning}\n");
    }
    text
}

/// Columns of the picture, at most.
const WIDE: usize = 64;

/// A row for each point, time from left to right: `█` seen, `▒` seen at times, `·` not seen.
fn picture(take: &Take) -> String {
    let (points, frames) = (take.labels().len(), take.frames());
    let wide = frames.min(WIDE);
    let mut table = Table::of_words();
    for (point, label) in take.labels().iter().enumerate() {
        let bar: String = (0..wide)
            .map(|column| {
                let span = column * frames / wide..(column + 1) * frames / wide;
                let seen = |frame: &usize| take.visible()[frame * points + point];
                match span.clone().filter(seen).count() {
                    0 => '·',
                    all if all == span.len() => '█',
                    _ => '▒',
                }
            })
            .collect();
        table.row([format!("  {label}"), bar]);
    }
    format!(
        "\nseen (█ always, ▒ at times, · never), {:.2} s from left to right:\n{table}",
        seconds(take)
    )
}

fn to_json(take: &Take) -> serde_json::Value {
    let points: Vec<_> = take
        .labels()
        .iter()
        .zip(take.gaps())
        .map(|(label, gap)| {
            json!({
                "label": label, "missing": gap.missing, "gaps": gap.gaps, "longestGap": gap.longest,
            })
        })
        .collect();
    json!({
        "kind": "take",
        "format": take.format().map(|format| format.extensions()[0]),
        "frames": take.frames(),
        "rateHz": take.rate_hz(),
        "firstTimeSeconds": take.first_time_seconds(),
        "up": up(take),
        "points": points,
        "skeleton": take.skeleton(),
        "warnings": take.warnings(),
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn wave() -> Take {
        let seen = Some(Vector3::x());
        Take::new(["hand", "foot"], 50.0, [seen, seen, None, seen])
    }

    #[test]
    fn the_text_names_what_is_hidden() {
        assert_eq!(
            describe(&wave()),
            "  frames  2 at 50 Hz, 0.04 s from 0.000 s\n  \
               points  2\n  \
               up      not known\n  \
               hidden  1 of 4 samples\n  \
               labels  hand foot\n\
             \nhidden, in frames:\n  \
               point  hidden  gaps  longest\n  \
               hand   50.0 %     1        1\n"
        );
    }

    #[test]
    fn the_picture_shows_when_a_point_is_seen() {
        let (seen, hidden) = (Some(Vector3::x()), None);
        let hand = (0..128).map(|frame| if frame < 64 { seen } else { hidden });
        let foot = (0..128).map(|frame| if frame % 2 == 0 { seen } else { hidden });
        let samples = hand.zip(foot).flat_map(|(hand, foot)| [hand, foot]);
        let text = picture(&Take::new(["hand", "foot"], 64.0, samples));
        let (full, none, some) = ("█".repeat(32), "·".repeat(32), "▒".repeat(64));
        assert_eq!(
            text,
            format!(
                "\nseen (█ always, ▒ at times, · never), 2.00 s from left to right:\n  hand  {full}{none}\n  foot  {some}\n"
            )
        );
    }

    #[test]
    fn the_json_holds_every_point() {
        let json = to_json(&wave());
        assert_eq!(json["points"][0]["missing"], 1);
        assert_eq!(json["points"][1]["label"], "foot");
        assert_eq!(json["rateHz"], 50.0);
    }
}
