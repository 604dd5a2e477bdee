//! The arrays of VTK's XML files: text, base64 or raw, whole or in zlib blocks, inline or appended.

use std::cell::Cell;
use std::io::Read;

use flate2::read::ZlibDecoder;
use roxmltree::Node;

use super::cursor::{Cursor, shown};
use super::error::{Flaw, Parsed, Place};
use super::scalar::{Encoding, Endian, Scalar};

/// Deflate cannot make more than this many bytes of one.
pub(super) const GREATEST_RATIO: usize = 1032;

/// How the file writes its arrays.
pub(super) struct Layout<'a> {
    /// The file.
    pub(super) bytes: &'a [u8],
    pub(super) endian: Endian,
    /// The kind of the lengths that precede binary data.
    pub(super) header: Scalar,
    pub(super) compressed: bool,
    /// Where the appended data start, and whether they are raw rather than base64.
    pub(super) appended: Option<(usize, bool)>,
    /// Bytes that arrays may still have: those of a sound file are all different parts of it, those of a hostile one
    /// may be one part over and over.
    pub(super) budget: Cell<usize>,
}

impl Layout<'_> {
    pub(super) fn reals(&self, array: Node<'_, '_>) -> Parsed<Vec<f64>> {
        self.numbers(array, |cursor, encoding, kind| {
            cursor.real(encoding, kind, "a value")
        })
    }

    pub(super) fn integers(&self, array: Node<'_, '_>) -> Parsed<Vec<i64>> {
        self.numbers(array, |cursor, encoding, kind| {
            cursor.integer(encoding, kind, "a whole number")
        })
    }

    fn numbers<T>(
        &self,
        array: Node<'_, '_>,
        mut number: impl FnMut(&mut Cursor<'_>, Encoding, Scalar) -> Parsed<T>,
    ) -> Parsed<Vec<T>> {
        let kind = scalar(array)?;
        let mut numbers = Vec::new();
        if array.attribute("format") == Some("ascii") {
            let Some(range) = text_range(array) else {
                return Ok(numbers);
            };
            let mut cursor = Cursor::new(&self.bytes[..range.end]).starting(range.start);
            while cursor.peek().is_some() {
                numbers.push(number(&mut cursor, Encoding::Text, kind)?);
            }
            return Ok(numbers);
        }
        let data = self.data(array)?;
        let mut cursor = Cursor::new(&data);
        while cursor.remaining() > 0 {
            let value = number(&mut cursor, Encoding::Binary(self.endian), kind);
            // The offset would be one into the decoded array, which nobody sees.
            numbers.push(value.map_err(|flaw| flaw_at(array, flaw.reason))?);
        }
        Ok(numbers)
    }

    /// The bytes of a binary array.
    fn data(&self, array: Node<'_, '_>) -> Parsed<Vec<u8>> {
        let mut stream = match (array.attribute("format"), self.appended) {
            (Some("binary"), _) => {
                let range = text_range(array).unwrap_or(0..0);
                Stream::Base64(Base64::new(&self.bytes[range]))
            }
            (Some("appended"), Some((start, is_raw))) => {
                let offset: usize = attribute(array, "offset")?;
                let data = start
                    .checked_add(offset)
                    .and_then(|start| self.bytes.get(start..))
                    .ok_or_else(|| flaw_at(array, format!("offset {offset} is beyond the file")))?;
                if is_raw {
                    Stream::Raw(Cursor::new(data))
                } else {
                    Stream::Base64(Base64::new(data))
                }
            }
            (Some("appended"), None) => {
                return Err(flaw_at(array, "the file has no AppendedData"));
            }
            (format, _) => {
                let reason = format!(
                    "format {} is none of ascii, binary and appended",
                    shown(format.unwrap_or_default().as_bytes())
                );
                return Err(flaw_at(array, reason));
            }
        };
        let data = if self.compressed {
            self.blocks(&mut stream)
        } else {
            self.length(&mut stream).and_then(|length| {
                let data = stream.take(length)?;
                self.spend(length).map(|()| data)
            })
        };
        data.map_err(|reason| flaw_at(array, reason))
    }

    /// Compressed data: the number of blocks, the length of each and of the last, the compressed lengths, the blocks.
    fn blocks(&self, stream: &mut Stream<'_>) -> Result<Vec<u8>, String> {
        let count = self.length(stream)?;
        let full = self.length(stream)?;
        let last = self.length(stream)?;
        if count
            .checked_mul(self.header.size())
            .is_none_or(|bytes| bytes > stream.remaining())
        {
            return Err(format!("{count} compressed blocks are claimed"));
        }
        let lengths: Vec<usize> = (0..count)
            .map(|_| self.length(stream))
            .collect::<Result<_, _>>()?;
        let mut data = Vec::new();
        for (block, &length) in lengths.iter().enumerate() {
            let compressed = stream.take(length)?;
            let is_partial = block + 1 == count && last > 0;
            let wanted = if is_partial { last } else { full };
            if wanted > GREATEST_RATIO.saturating_mul(length) {
                return Err(format!("{length} bytes cannot hold a block of {wanted}"));
            }
            self.spend(wanted)?;
            let before = data.len();
            ZlibDecoder::new(compressed.as_slice())
                .take(wanted as u64)
                .read_to_end(&mut data)
                .map_err(|error| format!("compressed block {block}: {error}"))?;
            if data.len() - before != wanted {
                let got = data.len() - before;
                return Err(format!("block {block} holds {got} bytes, not {wanted}"));
            }
        }
        Ok(data)
    }

    fn spend(&self, bytes: usize) -> Result<(), String> {
        let left = self.budget.get().checked_sub(bytes);
        self.budget
            .set(left.ok_or("the arrays are larger than the file can hold")?);
        Ok(())
    }

    fn length(&self, stream: &mut Stream<'_>) -> Result<usize, String> {
        let bytes = stream.take(self.header.size())?;
        self.header
            .integer(&bytes, self.endian)
            .and_then(|length| usize::try_from(length).ok())
            .ok_or_else(|| "a length beyond any memory".to_owned())
    }
}

/// Binary data as bytes or in base64.
enum Stream<'a> {
    Raw(Cursor<'a>),
    Base64(Base64<'a>),
}

impl Stream<'_> {
    fn remaining(&self) -> usize {
        match self {
            Self::Raw(cursor) => cursor.remaining(),
            Self::Base64(base64) => base64.text.len(),
        }
    }

    fn take(&mut self, length: usize) -> Result<Vec<u8>, String> {
        match self {
            Self::Raw(cursor) => cursor
                .take(length, "an array")
                .map(<[u8]>::to_vec)
                .map_err(|flaw| flaw.reason),
            Self::Base64(base64) => base64.take(length),
        }
    }
}

/// Base64 text made of one or more padded parts: some writers end the part after a header, some do not.
struct Base64<'a> {
    text: &'a [u8],
    /// Decoded, not yet taken.
    ready: Vec<u8>,
}

impl<'a> Base64<'a> {
    fn new(text: &'a [u8]) -> Self {
        Self {
            text,
            ready: Vec::new(),
        }
    }

    fn take(&mut self, length: usize) -> Result<Vec<u8>, String> {
        if length / 3 > self.text.len() / 4 + 1 {
            return Err(format!(
                "{length} bytes are claimed, but {} characters remain",
                self.text.len()
            ));
        }
        let mut taken = std::mem::take(&mut self.ready);
        while taken.len() < length {
            let (bytes, count) = self.quantum()?;
            taken.extend_from_slice(&bytes[..count]);
        }
        self.ready = taken.split_off(length);
        Ok(taken)
    }

    /// Decodes four characters to one to three bytes.
    fn quantum(&mut self) -> Result<([u8; 3], usize), String> {
        let mut bits = 0_u32;
        let mut padding = 0;
        for _ in 0..4 {
            self.text = self.text.trim_ascii_start();
            let (&character, rest) = self
                .text
                .split_first()
                .ok_or("the base64 text ends early")?;
            self.text = rest;
            let value = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' => 0,
                _ => return Err(format!("{} is no base64", shown(&[character]))),
            };
            if character == b'=' {
                padding += 1;
            } else if padding > 0 {
                return Err("base64 goes on within its padding".to_owned());
            }
            bits = (bits << 6) | u32::from(value);
        }
        if padding > 2 {
            return Err("a base64 group of padding".to_owned());
        }
        let [_, bytes @ ..] = bits.to_be_bytes();
        Ok((bytes, 3 - padding))
    }
}

/// A number in an attribute of an element.
pub(super) fn attribute<T: std::str::FromStr>(node: Node<'_, '_>, name: &str) -> Parsed<T> {
    let value = node.attribute(name).ok_or_else(|| {
        flaw_at(
            node,
            format!("{} lacks attribute {name}", node.tag_name().name()),
        )
    })?;
    value
        .parse()
        .map_err(|_| flaw_at(node, format!("{name} is {}", shown(value.as_bytes()))))
}

/// A flaw in the line where an element starts.
pub(super) fn flaw_at(node: Node<'_, '_>, reason: impl Into<String>) -> Flaw {
    let row = node.document().text_pos_at(node.range().start).row;
    let name = node.attribute("Name");
    let reason = reason.into();
    Flaw {
        place: Place::Line(row as usize),
        reason: match name {
            Some(name) => format!("array {}: {reason}", shown(name.as_bytes())),
            None => reason,
        },
    }
}

/// Where the text of an element stands in the file.
fn text_range(array: Node<'_, '_>) -> Option<std::ops::Range<usize>> {
    array
        .children()
        .find(|child| child.is_text())
        .map(|text| text.range())
}

fn scalar(array: Node<'_, '_>) -> Parsed<Scalar> {
    Ok(match array.attribute("type") {
        Some("Int8") => Scalar::I8,
        Some("UInt8") => Scalar::U8,
        Some("Int16") => Scalar::I16,
        Some("UInt16") => Scalar::U16,
        Some("Int32") => Scalar::I32,
        Some("UInt32") => Scalar::U32,
        Some("Int64") => Scalar::I64,
        Some("UInt64") => Scalar::U64,
        Some("Float32") => Scalar::F32,
        Some("Float64") => Scalar::F64,
        other => {
            let shown = shown(other.unwrap_or_default().as_bytes());
            return Err(flaw_at(array, format!("{shown} is no type of numbers")));
        }
    })
}
