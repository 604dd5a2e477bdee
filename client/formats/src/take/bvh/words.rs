//! The file as words, with braces as words of their own, and line numbers.

use super::super::error::{Fault, quoted};

/// A cursor over a text.
pub(super) struct Words<'a> {
    lines: std::str::Lines<'a>,
    /// What is left of the current line.
    rest: &'a str,
    line: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            lines: text.lines(),
            rest: "",
            line: 0,
        }
    }

    /// The current line, from 1.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    pub(super) fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::at_line(self.line, problem)
    }

    pub(super) fn next_word(&mut self) -> Result<&'a str, Fault> {
        loop {
            self.rest = self.rest.trim_start();
            if !self.rest.is_empty() {
                break;
            }
            self.rest = self.lines.next().ok_or_else(|| {
                self.fault("the file ends before its hierarchy and frame time are complete")
            })?;
            self.line += 1;
        }
        let end = match self
            .rest
            .find(|c: char| c.is_whitespace() || c == '{' || c == '}')
        {
            Some(0) => 1,
            Some(end) => end,
            None => self.rest.len(),
        };
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Ok(word)
    }

    /// The rest of the line up to a brace: a name, which may hold blanks.
    pub(super) fn name(&mut self) -> &'a str {
        let end = self.rest.find(['{', '}']).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        name.trim()
    }

    /// The next word must be `expected`, in any case.
    pub(super) fn expect(&mut self, expected: &str) -> Result<(), Fault> {
        let word = self.next_word()?;
        if word.eq_ignore_ascii_case(expected) {
            return Ok(());
        }
        Err(self.fault(format!(
            "{} stands where {expected} is expected",
            quoted(word)
        )))
    }

    pub(super) fn number(&mut self) -> Result<f64, Fault> {
        let word = self.next_word()?;
        let value = word.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| self.fault(format!("{} is not a finite number", quoted(word))))
    }

    /// The lines after the current one, with their numbers.
    pub(super) fn lines_after(&self) -> impl Iterator<Item = (&'a str, usize)> + use<'a> {
        self.lines.clone().zip(self.line + 1..)
    }
}
