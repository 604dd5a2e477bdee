//! One reader for text and binary alike, which knows its place when something is wrong.

use std::str::FromStr;

use nalgebra::Vector3;

use super::error::{Flaw, Parsed, Place};
use super::scalar::{Encoding, Scalar};

/// A position in a file's bytes. Everything read is checked against the bytes that remain.
#[derive(Clone)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    comment: Option<u8>,
    /// Start of what was read last: the place that a flaw names.
    last: usize,
    last_was_binary: bool,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            comment: None,
            last: 0,
            last_was_binary: false,
        }
    }

    /// Text in which `#` starts a comment that ends with its line.
    pub(crate) fn with_comments(bytes: &'a [u8]) -> Self {
        Self {
            comment: Some(b'#'),
            ..Self::new(bytes)
        }
    }

    /// The same file from `at` on.
    pub(crate) fn starting(self, at: usize) -> Self {
        Self {
            at: at.min(self.bytes.len()),
            ..self
        }
    }

    pub(crate) fn at(&self) -> usize {
        self.at
    }

    pub(crate) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    pub(crate) fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// What is wrong with what was read last.
    pub(crate) fn flaw(&self, reason: impl Into<String>) -> Flaw {
        let place = if self.last_was_binary {
            Place::Byte(self.last)
        } else {
            let before = &self.bytes[..self.last.min(self.bytes.len())];
            Place::Line(1 + before.iter().filter(|&&byte| byte == b'\n').count())
        };
        Flaw {
            place,
            reason: reason.into(),
        }
    }

    fn skip_blanks(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if Some(byte) == self.comment {
                self.at += until_newline(self.rest());
            } else if byte.is_ascii_whitespace() {
                self.at += 1;
            } else {
                break;
            }
        }
    }

    /// The next word, on this line or a later one.
    pub(crate) fn word(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        self.last = self.at;
        self.last_was_binary = false;
        let rest = self.rest();
        let length = rest
            .iter()
            .position(|byte| byte.is_ascii_whitespace() || Some(*byte) == self.comment)
            .unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    /// The next word, if there is one before the line ends; the end of the line is not passed.
    pub(crate) fn word_on_line(&mut self) -> Option<&'a [u8]> {
        let mut ahead = self.clone();
        let word = ahead.word()?;
        if self.bytes[self.at..ahead.last].contains(&b'\n') {
            return None;
        }
        *self = ahead;
        Some(word)
    }

    /// The next word, which stays to be read.
    pub(crate) fn peek(&self) -> Option<&'a [u8]> {
        self.clone().word()
    }

    /// The rest of this line without its end, which is passed.
    pub(crate) fn line(&mut self) -> &'a [u8] {
        self.last = self.at;
        self.last_was_binary = false;
        let rest = self.rest();
        let length = until_newline(rest);
        self.at = (self.at + length + 1).min(self.bytes.len());
        rest[..length].trim_ascii()
    }

    /// Passes the rest of a line, which must be blank: binary data starts right after it.
    pub(crate) fn end_line(&mut self) -> Parsed<()> {
        let rest = self.line();
        if rest.is_empty() {
            return Ok(());
        }
        Err(self.flaw(format!(
            "expected the end of the line, found {}",
            shown(rest)
        )))
    }

    /// The next word as text; `what` names it in the error.
    pub(crate) fn text(&mut self, what: &str) -> Parsed<&'a str> {
        let word = self
            .word()
            .ok_or_else(|| self.flaw(format!("the file ends where {what} was expected")))?;
        std::str::from_utf8(word)
            .map_err(|_| self.flaw(format!("expected {what}, found {}", shown(word))))
    }

    /// The next word must be `keyword`, in any case.
    pub(crate) fn keyword(&mut self, keyword: &str) -> Parsed<()> {
        let word = self.text(keyword)?;
        if word.eq_ignore_ascii_case(keyword) {
            return Ok(());
        }
        Err(self.flaw(format!(
            "expected {keyword}, found {}",
            shown(word.as_bytes())
        )))
    }

    /// The next word as a number.
    pub(crate) fn number<T: FromStr>(&mut self, what: &str) -> Parsed<T> {
        let word = self.text(what)?;
        word.parse()
            .map_err(|_| self.flaw(format!("expected {what}, found {}", shown(word.as_bytes()))))
    }

    /// The next `length` bytes.
    pub(crate) fn take(&mut self, length: usize, what: &str) -> Parsed<&'a [u8]> {
        self.last = self.at;
        self.last_was_binary = true;
        let rest = self.rest();
        let taken = rest.get(..length).ok_or_else(|| {
            self.flaw(format!(
                "{what} needs {length} bytes, but {} remain",
                rest.len()
            ))
        })?;
        self.at += length;
        Ok(taken)
    }

    /// A finite real.
    pub(crate) fn real(&mut self, encoding: Encoding, kind: Scalar, what: &str) -> Parsed<f64> {
        let value: f64 = match encoding {
            Encoding::Text => self.number(what)?,
            Encoding::Binary(endian) => kind.real(self.take(kind.size(), what)?, endian),
        };
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.flaw(format!("{what} is {value}; it must be finite")))
    }

    /// A whole number.
    pub(crate) fn integer(&mut self, encoding: Encoding, kind: Scalar, what: &str) -> Parsed<i64> {
        match encoding {
            Encoding::Text => self.number(what),
            Encoding::Binary(endian) => {
                let bytes = self.take(kind.size(), what)?;
                kind.integer(bytes, endian)
                    .ok_or_else(|| self.flaw(format!("{what} is not a whole number in range")))
            }
        }
    }

    /// A coordinate triple.
    pub(crate) fn point(&mut self, encoding: Encoding, kind: Scalar) -> Parsed<Vector3<f64>> {
        let mut point = Vector3::zeros();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            point[axis] = self.real(encoding, kind, name)?;
        }
        Ok(point)
    }

    /// A vertex number counted from `base`, of `vertices` that there are; the result counts from 0.
    pub(crate) fn vertex(
        &mut self,
        encoding: Encoding,
        kind: Scalar,
        base: i64,
        vertices: usize,
    ) -> Parsed<u32> {
        let number = self.integer(encoding, kind, "a vertex number")?;
        self.in_range(number, base, vertices, "vertex")
    }

    /// `number`, counted from `base`, as an index below `length`.
    pub(crate) fn in_range(
        &self,
        number: i64,
        base: i64,
        length: usize,
        what: &str,
    ) -> Parsed<u32> {
        number
            .checked_sub(base)
            .and_then(|index| u32::try_from(index).ok())
            .filter(|&index| (index as usize) < length)
            .ok_or_else(|| {
                self.flaw(format!(
                    "{what} number {number} does not exist: there are {length}, counted from {base}"
                ))
            })
    }

    /// A claimed count, believed only if so many things of at least `least` bytes can follow.
    pub(crate) fn claim(&self, count: i64, least: usize, what: &str) -> Parsed<usize> {
        let refuse = |why: String| self.flaw(format!("{count} {what} are claimed, but {why}"));
        let count = usize::try_from(count).map_err(|_| refuse("no count is negative".into()))?;
        match count.checked_mul(least) {
            Some(bytes) if bytes <= self.remaining() => Ok(count),
            _ => Err(refuse(format!("only {} bytes follow", self.remaining()))),
        }
    }

    /// The next word as the count of things of at least `least` bytes each.
    pub(crate) fn count(&mut self, least: usize, what: &str) -> Parsed<usize> {
        let count = self.number(&format!("the number of {what}"))?;
        self.claim(count, least, what)
    }
}

/// The least bytes that one number takes: what a claimed count must be covered by.
pub(crate) fn least_size(encoding: Encoding, kind: Scalar) -> usize {
    match encoding {
        Encoding::Text => 1,
        Encoding::Binary(_) => kind.size(),
    }
}

/// A word for an error message: readable and short.
pub(crate) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&word[..word.len().min(LONGEST)]);
    let more = if word.len() > LONGEST { "…" } else { "" };
    format!("“{}{more}”", text.escape_debug())
}

fn until_newline(bytes: &[u8]) -> usize {
    bytes
        .iter()
        .position(|&byte| byte == b'\n')
        .unwrap_or(bytes.len())
}
