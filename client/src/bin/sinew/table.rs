//! Text in columns.

/// Rows of cells in columns, the first of which stands to the left.
#[derive(Debug)]
pub(crate) struct Table {
    rows: Vec<Vec<String>>,
    values: Align,
}

/// Where the cells of all columns after the first stand.
#[derive(Clone, Copy, Debug)]
enum Align {
    Left,
    Right,
}

impl Table {
    /// For numbers, which stand to the right.
    pub(crate) fn of_numbers() -> Self {
        let (rows, values) = (Vec::new(), Align::Right);
        Self { rows, values }
    }

    /// For words, which stand to the left.
    pub(crate) fn of_words() -> Self {
        let (rows, values) = (Vec::new(), Align::Left);
        Self { rows, values }
    }

    /// Adds a row.
    pub(crate) fn row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        for row in &self.rows {
            let mut line = String::new();
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                match (column, self.values) {
                    (0, _) => line += &format!("{cell:<width$}"),
                    (_, Align::Left) => line += &format!("  {cell:<width$}"),
                    (_, Align::Right) => line += &format!("  {cell:>width$}"),
                }
            }
            writeln!(to, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// A whole number with its thousands apart.
pub(crate) fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_align() {
        let mut table = Table::of_numbers();
        table
            .row(["latency", "p50", "p99"])
            .row(["step", "0.41 ms", "12.30 ms"])
            .row(["end to end", "–", "1 ms"]);
        assert_eq!(
            table.to_string(),
            "latency         p50       p99\n\
             step        0.41 ms  12.30 ms\n\
             end to end        –      1 ms\n"
        );
    }

    #[test]
    fn words_stand_to_the_left() {
        let mut table = Table::of_words();
        table.row(["a", "long", "x"]).row(["b", "-", "y"]);
        assert_eq!(table.to_string(), "a  long  x\nb  -     y\n");
    }

    #[test]
    fn a_short_row_has_no_spaces_at_its_end() {
        let mut table = Table::of_numbers();
        table.row(["a", "b"]).row(["longer"]);
        assert_eq!(table.to_string(), "a       b\nlonger\n");
    }

    #[test]
    fn thousands_stand_apart() {
        assert_eq!(count(7), "7");
        assert_eq!(count(1064), "1,064");
        assert_eq!(count(1_234_567), "1,234,567");
    }
}
