//! `sinew-report`: what Sinew's features cost and how exact they are, measured through the engine's public face.
//!
//! ```text
//! cargo run --release -p sinew-report                   everything
//! cargo run --release -p sinew-report -- mapping rbf    these sections alone
//! cargo run --release -p sinew-report -- --list         what sections there are
//! ```
//!
//! writes `target/report/`: `index.html`, which opens without a network, one `SECTION-PLOT.svg` per plot, and `report.json`
//! with every number unrounded.
//!
//! # To add a section
//!
//! One file in `sections/`, one line in [`sections::ALL`]:
//!
//! ```text
//! pub(crate) const SECTION: Section = Section { name: "tearing", title: "Tearing", measure };
//!
//! fn measure() -> Result<Findings, Failure> {
//!     let mut findings = Findings::default();
//!     findings.text("What the reader should know first.");
//!     let mut table = Table::new("Time of a tear", ["mesh", "tear, µs"]);
//!     table.row(["100k".into(), Cell::from(spread)]);
//!     findings.table(table);
//!     findings.plot(plot);
//!     Ok(findings)
//! }
//! ```
//!
//! * Times come from [`timing::by_turns`], which runs all contenders in every round: machines drift, so only
//!   [`timing::Spread::of_ratio`] of one run compares. Cells made of a [`timing::Spread`] show and flag their noise.
//! * [`worlds`] builds worlds of points and meshes, moves them and measures how far they are from the truth;
//!   [`fields`] has motions with known answers.
//! * [`peers`] runs other programs on the same input; where one is not installed, say so by
//!   [`section::Findings::text`], never leave a row out silently.

mod fields;
mod page;
mod peers;
mod plot;
mod section;
mod sections;
mod timing;
mod worlds;

use std::{fs, path::PathBuf, process::ExitCode, time::Instant};

use clap::Parser;
use section::{Failure, Measured, Section};

/// Measures speed against error, and writes a page, plots and numbers.
#[derive(Parser)]
#[command(name = "sinew-report")]
struct Arguments {
    /// The sections to measure. Without any: all.
    #[arg(value_name = "SECTION")]
    sections: Vec<String>,
    /// Folder for the report.
    #[arg(long, value_name = "DIR", default_value = "target/report")]
    out: PathBuf,
    /// Only print the sections that there are.
    #[arg(long)]
    list: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.list {
        for section in sections::ALL {
            println!("{:10} {}", section.name, section.title);
        }
        return ExitCode::SUCCESS;
    }
    match report(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("sinew-report: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn report(arguments: &Arguments) -> Result<(), Failure> {
    let mut measured = Vec::new();
    for section in chosen(&arguments.sections)? {
        eprintln!("{} …", section.name);
        let start = Instant::now();
        let findings = (section.measure)().map_err(|error| format!("{}: {error}", section.name))?;
        let seconds = start.elapsed().as_secs_f64();
        eprintln!("{} took {seconds:.0} s", section.name);
        measured.push(Measured {
            name: section.name,
            title: section.title,
            seconds,
            findings,
        });
    }
    fs::create_dir_all(&arguments.out)?;
    for section in &measured {
        for plot in section.findings.plots() {
            let name = format!("{}-{}.svg", section.name, plot.name);
            fs::write(arguments.out.join(name), plot.svg().into_string())?;
        }
    }
    let page = arguments.out.join("index.html");
    fs::write(&page, page::page(&measured).into_string())?;
    let numbers = serde_json::to_vec_pretty(&measured)?;
    fs::write(arguments.out.join("report.json"), numbers)?;
    println!("{}", page.display());
    Ok(())
}

/// The sections of these names; all, where there are none.
fn chosen(names: &[String]) -> Result<Vec<Section>, Failure> {
    if names.is_empty() {
        return Ok(sections::ALL.to_vec());
    }
    let find = |name: &String| {
        let found = sections::ALL.iter().find(|section| section.name == name);
        found.copied().ok_or_else(|| {
            let known = sections::ALL.map(|section| section.name).join(", ");
            format!("no section is called `{name}`; there are {known}").into()
        })
    };
    names.iter().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_can_be_chosen_alone_and_an_unknown_one_is_named() {
        for section in sections::ALL {
            assert_eq!(chosen(&[section.name.to_owned()]).unwrap().len(), 1);
        }
        assert_eq!(chosen(&[]).unwrap().len(), sections::ALL.len());
        let error = chosen(&["maping".to_owned()]).unwrap_err().to_string();
        assert!(error.contains("`maping`"), "{error}");
        assert!(error.contains("mapping"), "{error}");
    }
}
