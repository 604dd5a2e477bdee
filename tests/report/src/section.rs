//! What a section finds: text, tables and plots, in the order in which a reader meets them.

use serde::Serialize;

use crate::{plot::Plot, timing::Spread};

/// What stops a section, in words.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// One part of the report.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section {
    /// On the command line and in file names.
    pub(crate) name: &'static str,
    /// On the page.
    pub(crate) title: &'static str,
    pub(crate) measure: fn() -> Result<Findings, Failure>,
}

/// A section that was measured.
#[derive(Serialize)]
pub(crate) struct Measured {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    /// What measuring took, s.
    pub(crate) seconds: f64,
    pub(crate) findings: Findings,
}

/// What a section found.
#[derive(Default, Serialize)]
#[serde(transparent)]
pub(crate) struct Findings {
    pub(crate) parts: Vec<Part>,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Part {
    Text(String),
    Table(Table),
    Plot(Plot),
}

impl Findings {
    /// Adds a paragraph.
    pub(crate) fn text(&mut self, text: impl Into<String>) {
        self.parts.push(Part::Text(text.into()));
    }

    pub(crate) fn table(&mut self, table: Table) {
        self.parts.push(Part::Table(table));
    }

    pub(crate) fn plot(&mut self, plot: Plot) {
        self.parts.push(Part::Plot(plot));
    }

    /// Says in plain words where peers were not measured to the end: the rest of the section stands.
    pub(crate) fn peers(&mut self, measured: Result<(), Failure>) {
        if let Err(failure) = measured {
            self.text(format!("Peers were not measured: {failure}."));
        }
    }

    pub(crate) fn plots(&self) -> impl Iterator<Item = &Plot> {
        self.parts.iter().filter_map(|part| match part {
            Part::Plot(plot) => Some(plot),
            Part::Text(_) | Part::Table(_) => None,
        })
    }
}

/// Rows of cells below names that say the units.
#[derive(Serialize)]
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Vec<Cell>>,
}

impl Table {
    pub(crate) fn new<T: Into<String>>(
        title: impl Into<String>,
        columns: impl IntoIterator<Item = T>,
    ) -> Self {
        Self {
            title: title.into(),
            columns: columns.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// # Panics
    /// If there are not as many cells as columns.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let cells: Vec<Cell> = cells.into_iter().collect();
        assert_eq!(cells.len(), self.columns.len(), "in {:?}", self.title);
        self.rows.push(cells);
    }
}

/// One cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Cell {
    Text(String),
    Number(f64),
    Spread(Spread),
    /// A law that holds or does not, and the figure behind the verdict.
    Verdict {
        holds: bool,
        figure: String,
    },
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<Spread> for Cell {
    fn from(spread: Spread) -> Self {
        Self::Spread(spread)
    }
}

/// A number in three digits, as people write it.
pub(crate) fn digits(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e6).contains(&size) {
        format!("{number:.1e}")
    } else if size < 1.0 {
        // Leading zeros are no digits: 0.00123 has three.
        let zeros = usize::from(size < 0.1) + usize::from(size < 0.01);
        format!("{number:.*}", 3 + zeros)
    } else if size < 10.0 {
        format!("{number:.2}")
    } else if size < 100.0 {
        format!("{number:.1}")
    } else {
        format!("{number:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let shown = [0.0, 0.001_234, 0.0123, 0.123, 1.234, 12.34, 1234.4].map(digits);
        assert_eq!(
            shown,
            ["0", "0.00123", "0.0123", "0.123", "1.23", "12.3", "1234"]
        );
        assert_eq!(digits(2.5e-16), "2.5e-16");
        assert_eq!(digits(-1.5e7), "-1.5e7");
    }
}
