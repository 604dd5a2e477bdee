//! The page: one file, no script, nothing from elsewhere.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::section::{Cell, Measured, Part, Table, digits};

const STYLE: &str = "
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1340px; margin: 2em auto; padding: 0 1em }
h1 { margin-bottom: 0 } h2 { margin-top: 2.5em; border-bottom: 1px solid #ccc }
p { max-width: 50em } nav a { margin-right: 1.2em }
table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums }
caption { text-align: left; font-weight: 600; padding-bottom: .3em }
th, td { padding: .15em .8em .15em 0; text-align: right; border-bottom: 1px solid #eee; vertical-align: top }
th:first-child, td.text { text-align: left } thead th { border-bottom: 1px solid #888; font-weight: 500 }
.spread { color: #777; font-size: 85% } .noisy { color: #b35900 } .fails { color: #b00020; font-weight: 600 }
.plots { display: flex; flex-wrap: wrap; gap: 12px } .plots svg { border: 1px solid #eee; height: auto; max-width: 100% }
";

pub(crate) fn page(sections: &[Measured]) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { "Sinew: speed against error" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Sinew: speed against error" }
                p {
                    "Measured through the engine’s public face on " (threads()) " cores. Times are those for which the processor was kept, medians with their quartiles; "
                    "what is compared was run by turns in one run, and a ratio is the median of the rounds’ ratios. "
                    span.noisy { "≈" } " marks a median whose quartiles lie more than a quarter apart: repeat it on a quiet machine. "
                    "All numbers, unrounded: " a href="report.json" { "report.json" } "."
                }
                nav { @for section in sections { a href=(format!("#{}", section.name)) { (section.title) } } }
                @for section in sections { (body(section)) }
            }
        }
    }
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn body(section: &Measured) -> Markup {
    let is_plot = |part: &Part| matches!(part, Part::Plot(_));
    html! {
        section id=(section.name) {
            h2 { (section.title) }
            @for run in section.findings.parts.chunk_by(|a, b| is_plot(a) && is_plot(b)) {
                @if is_plot(&run[0]) { div.plots { @for item in run { (part(item)) } } } @else { (part(&run[0])) }
            }
            p.spread { "Measured in " (format!("{:.0}", section.seconds)) " s: "
                code { "cargo run --release -p sinew-report -- " (section.name) } }
        }
    }
}

fn part(part: &Part) -> Markup {
    match part {
        Part::Text(text) => html! { p { (text) } },
        Part::Plot(plot) => plot.svg(),
        Part::Table(rows) => table(rows),
    }
}

fn table(table: &Table) -> Markup {
    html! {
        table {
            caption { (table.title) }
            thead { tr { @for name in &table.columns { th { (name) } } } }
            tbody { @for row in &table.rows { tr { @for item in row { (cell(item)) } } } }
        }
    }
}

fn cell(cell: &Cell) -> Markup {
    match cell {
        Cell::Text(text) => html! { td.text { (text) } },
        Cell::Number(number) => html! { td { (digits(*number)) } },
        Cell::Verdict {
            holds: true,
            figure,
        } => html! { td.text { "✓ " (figure) } },
        Cell::Verdict {
            holds: false,
            figure,
        } => html! { td.text.fails { "✗ " (figure) } },
        Cell::Spread(spread) => html! {
            td {
                @if spread.is_noisy() { span.noisy { "≈ " } }
                (digits(spread.median))
                span.spread { " (" (digits(spread.low)) "–" (digits(spread.high)) ")" }
            }
        },
    }
}
