//! Plots as SVG, small enough to be read as text. Both axes are logarithmic: times and errors are compared by their ratios.

use maud::{Markup, html};
use serde::Serialize;

/// Marks and lines over two axes.
#[derive(Clone, Serialize)]
pub(crate) struct Plot {
    /// In the file's name.
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
}

#[derive(Clone, Serialize)]
pub(crate) struct Axis {
    /// What and in which unit.
    pub(crate) label: String,
    /// Values below are drawn at this one: errors of rounding, say, which a logarithm would give half the plot.
    pub(crate) floor: Option<f64>,
}

impl Axis {
    pub(crate) fn new(label: impl Into<String>) -> Self {
        let (label, floor) = (label.into(), None);
        Self { label, floor }
    }

    pub(crate) fn with_floor(mut self, floor: f64) -> Self {
        self.floor = Some(floor);
        self
    }
}

/// Marks joined by a line, with the series' name beside the last one.
#[derive(Clone, Serialize)]
pub(crate) struct Series {
    pub(crate) label: String,
    pub(crate) points: Vec<Point>,
    pub(crate) ink: Ink,
}

#[derive(Clone, Serialize)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Shown where the pointer rests on the mark.
    pub(crate) note: String,
}

/// How a series is drawn. Colours that people with colour blindness tell apart (Okabe and Ito).
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Ink {
    Grey,
    Blue,
    Orange,
    Green,
    Vermilion,
    Purple,
    /// A thin dashed line without marks: a limit, a law.
    Guide,
}

impl Ink {
    fn colour(self) -> &'static str {
        match self {
            Self::Grey | Self::Guide => "#999",
            Self::Blue => "#0072b2",
            Self::Orange => "#e69f00",
            Self::Green => "#009e73",
            Self::Vermilion => "#d55e00",
            Self::Purple => "#a0528a",
        }
    }
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 440.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 26.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 52.0;
/// Size of labels, and the mean width of a character and the height of a line at that size.
const FONT: (f64, f64, f64) = (11.0, 5.8, 12.0);

impl Plot {
    /// The whole picture. Values that are not finite, or not positive on a logarithmic axis without a floor, are left out.
    pub(crate) fn svg(&self) -> Markup {
        let xs = self
            .series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p.x));
        let ys = self
            .series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p.y));
        let x = Ruler::new(&self.x, xs, [LEFT, WIDTH - RIGHT]);
        let y = Ruler::new(&self.y, ys, [HEIGHT - BOTTOM, TOP]);
        let drawn: Vec<Drawn<'_>> = self
            .series
            .iter()
            .map(|series| Drawn::new(series, &x, &y))
            .collect();
        let names = place_names(&drawn);
        html! {
            svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) width=(WIDTH) height=(HEIGHT)
                font-family="system-ui, sans-serif" font-size=(FONT.0) role="img" aria-label=(self.title) {
                rect width="100%" height="100%" fill="#fff" {}
                text x=(LEFT) y="22" font-size="14" font-weight="600" { (self.title) }
                (self.axes(&x, &y))
                @for series in &drawn { (series.markup()) }
                @for (name, ink, [left, bottom]) in &names {
                    text x=(px(*left)) y=(px(*bottom)) stroke="#fff" stroke-width="3" stroke-opacity="0.8" { (name) }
                    text x=(px(*left)) y=(px(*bottom)) fill=(ink.colour()) { (name) }
                }
            }
        }
    }

    fn axes(&self, x: &Ruler, y: &Ruler) -> Markup {
        let (middle, foot) = ((LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 12.0);
        html! {
            @for value in x.ticks() {
                @let at = px(x.place(value).unwrap_or(LEFT));
                line x1=(at) x2=(at) y1=(TOP) y2=(HEIGHT - BOTTOM) stroke="#e6e6e6" {}
                text x=(at) y=(HEIGHT - BOTTOM + 16.0) text-anchor="middle" fill="#444" { (tick_text(value)) }
            }
            @for value in y.ticks() {
                @let at = y.place(value).unwrap_or(TOP);
                line x1=(LEFT) x2=(WIDTH - RIGHT) y1=(px(at)) y2=(px(at)) stroke="#e6e6e6" {}
                text x=(LEFT - 6.0) y=(px(at + 4.0)) text-anchor="end" fill="#444" { (tick_text(value)) }
            }
            rect x=(LEFT) y=(TOP) width=(WIDTH - LEFT - RIGHT) height=(HEIGHT - TOP - BOTTOM) fill="none" stroke="#888" {}
            text x=(middle) y=(foot) text-anchor="middle" fill="#222" { (self.x.label) }
            text transform=(format!("translate(16 {}) rotate(-90)", (TOP + HEIGHT - BOTTOM) / 2.0)) text-anchor="middle" fill="#222" { (self.y.label) }
        }
    }
}

/// From values to pixels.
struct Ruler {
    floor: Option<f64>,
    /// Ends of the axis, in decades.
    from: f64,
    to: f64,
    pixels: [f64; 2],
}

impl Ruler {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let mut ruler = Self {
            floor: axis.floor,
            from: 0.0,
            to: 1.0,
            pixels,
        };
        let seen: Vec<f64> = values.filter_map(|value| ruler.decade(value)).collect();
        let low = seen.iter().copied().fold(f64::INFINITY, f64::min);
        let high = seen.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if low <= high {
            let margin = 0.06 * (high - low).max(0.5);
            (ruler.from, ruler.to) = (low - margin, high + margin);
        }
        ruler
    }

    fn decade(&self, value: f64) -> Option<f64> {
        let decade = self.floor.map_or(value, |floor| value.max(floor)).log10();
        decade.is_finite().then_some(decade)
    }

    fn place(&self, value: f64) -> Option<f64> {
        let t = (self.decade(value)? - self.from) / (self.to - self.from);
        Some(self.pixels[0] + t * (self.pixels[1] - self.pixels[0]))
    }

    /// Where lines are drawn: with few decades at parts of them, with many not at every one.
    fn ticks(&self) -> Vec<f64> {
        let span = self.to - self.from;
        let parts: &[f64] = if span < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = (span / 10.0).ceil().max(1.0);
        let mut ticks = Vec::new();
        let mut decade = (self.from / every).floor() * every;
        while decade <= self.to {
            let values = parts.iter().map(|part| part * 10_f64.powf(decade));
            ticks.extend(values.filter(|value| (self.from..=self.to).contains(&value.log10())));
            decade += every;
        }
        ticks
    }
}

fn tick_text(value: f64) -> String {
    if (1e-3..1e6).contains(&value) {
        // As many digits as it has.
        let text = format!("{value:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.0e}")
    }
}

fn px(value: f64) -> String {
    format!("{value:.1}")
}

/// A series in pixels.
struct Drawn<'a> {
    series: &'a Series,
    marks: Vec<([f64; 2], &'a Point)>,
}

impl<'a> Drawn<'a> {
    fn new(series: &'a Series, x: &Ruler, y: &Ruler) -> Self {
        let place = |point: &'a Point| Some(([x.place(point.x)?, y.place(point.y)?], point));
        let marks = series.points.iter().filter_map(place).collect();
        Self { series, marks }
    }

    fn markup(&self) -> Markup {
        let ink = self.series.ink;
        let path: Vec<String> = self
            .marks
            .iter()
            .map(|([x, y], _)| format!("{},{}", px(*x), px(*y)))
            .collect();
        html! {
            polyline points=(path.join(" ")) fill="none" stroke=(ink.colour()) stroke-opacity="0.55"
                stroke-dasharray=[(ink == Ink::Guide).then_some("4 3")] {}
            @if ink != Ink::Guide {
                @for ([x, y], point) in &self.marks {
                    circle cx=(px(*x)) cy=(px(*y)) r="3.5" fill=(ink.colour()) {
                        title { (self.series.label) ": " (point.note) }
                    }
                }
            }
        }
    }
}

/// Left, top, right, bottom.
type Block = [f64; 4];

/// Where each series' name stands: beside its last mark, where the least lies below.
fn place_names<'a>(drawn: &'a [Drawn<'_>]) -> Vec<(&'a str, Ink, [f64; 2])> {
    let mut taken: Vec<Block> = drawn
        .iter()
        .filter(|series| series.series.ink != Ink::Guide)
        .flat_map(|series| &series.marks)
        .map(|([x, y], _)| [x - 4.0, y - 4.0, x + 4.0, y + 4.0])
        .collect();
    let mut names = Vec::new();
    for Drawn { series, marks } in drawn {
        let Some(([x, y], _)) = marks.last() else {
            continue;
        };
        #[expect(clippy::cast_precision_loss, reason = "a short name")]
        let (width, height) = (series.label.chars().count() as f64 * FONT.1, FONT.2);
        let best = candidates([*x, *y], width, height)
            .min_by(|a, b| cost(a, &taken).total_cmp(&cost(b, &taken)));
        if let Some(block) = best {
            taken.push(block);
            names.push((&*series.label, series.ink, [block[0], block[3] - 3.0]));
        }
    }
    names
}

/// Blocks of this size around a mark, the most welcome first.
fn candidates([x, y]: [f64; 2], width: f64, height: f64) -> impl Iterator<Item = Block> {
    let rows = [0.0, -1.0, 1.0, -1.7, 1.7, -2.6, 2.6, -3.5, 3.5];
    let sides = [x + 7.0, x - 7.0 - width, x - width / 2.0];
    rows.into_iter().flat_map(move |row| {
        sides.map(|left| {
            let top = y - height / 2.0 + row * height;
            [left, top, left + width, top + height]
        })
    })
}

/// How much a block covers of others, and how far it is out of the plot.
fn cost(block: &Block, taken: &[Block]) -> f64 {
    let over = |a: &Block, b: &Block| {
        let width = (a[2].min(b[2]) - a[0].max(b[0])).max(0.0);
        let height = (a[3].min(b[3]) - a[1].max(b[1])).max(0.0);
        width * height
    };
    let inside = [LEFT, TOP, WIDTH - 2.0, HEIGHT - BOTTOM];
    let area = (block[2] - block[0]) * (block[3] - block[1]);
    let outside = area - over(block, &inside);
    taken.iter().map(|other| over(block, other)).sum::<f64>() + 4.0 * outside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot {
        let point = |(x, y)| {
            let note = format!("{x} and {y}");
            Point { x, y, note }
        };
        Plot {
            name: "test".to_owned(),
            title: "A <test> & more".to_owned(),
            x: Axis::new("time, s"),
            y: Axis::new("error, m").with_floor(1e-16),
            series: vec![Series {
                label: "ours".to_owned(),
                points: points.into_iter().map(point).collect(),
                ink: Ink::Blue,
            }],
        }
    }

    #[test]
    fn marks_keep_the_order_of_their_values_and_stay_inside() {
        let plot = plot(vec![(1.0, 1e-3), (10.0, 0.0), (100.0, 1.0)]);
        let x = Ruler::new(&plot.x, [1.0, 100.0].into_iter(), [LEFT, WIDTH - RIGHT]);
        let at = [1.0, 10.0, 100.0].map(|value| x.place(value).unwrap());
        assert!(LEFT < at[0] && at[0] < at[1] && at[1] < at[2] && at[2] < WIDTH - RIGHT);
        assert!(((at[1] - at[0]) - (at[2] - at[1])).abs() < 1e-9);
        assert_eq!(plot.svg().into_string().matches("<circle").count(), 3);
    }

    #[test]
    fn what_has_no_place_is_left_out_and_text_is_escaped() {
        let svg = plot(vec![(-1.0, 1.0), (f64::NAN, 1.0), (1.0, 1.0)])
            .svg()
            .into_string();
        assert_eq!(svg.matches("<circle").count(), 1);
        assert!(svg.contains("A &lt;test&gt; &amp; more"));
        assert_eq!(
            plot(Vec::new())
                .svg()
                .into_string()
                .matches("<circle")
                .count(),
            0
        );
    }

    #[test]
    fn ticks_are_round_numbers() {
        let plot = plot(Vec::new());
        let ticks =
            |values: &[f64]| Ruler::new(&plot.x, values.iter().copied(), [0.0, 1.0]).ticks();
        assert_eq!(ticks(&[1.0, 20.0]), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks(&[1e-3, 1.0]).len(), 4);
        assert_eq!([0.01, 20.0, 1e-8].map(tick_text), ["0.01", "20", "1e-8"]);
    }
}
