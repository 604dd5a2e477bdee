//! The parameter section: groups of named arrays.

use super::super::error::Fault;
use super::BLOCK;
use super::bytes::Bytes;
use super::header::Header;

/// The records of the section, their contents unread: one spoilt parameter that nobody asks for costs nothing.
pub(super) struct Parameters<'a> {
    bytes: &'a Bytes<'a>,
    records: Vec<Record<'a>>,
}

struct Record<'a> {
    /// Positive for a parameter of the group with this number, negative for the group itself.
    id: i8,
    name: &'a [u8],
    /// Where the contents begin, and where the next record does.
    body: usize,
    end: usize,
}

/// One array.
pub(super) struct Parameter<'a> {
    bytes: &'a Bytes<'a>,
    /// Where in the file it begins.
    pub(super) at: usize,
    kind: Kind,
    dimensions: &'a [u8],
    data: &'a [u8],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Text,
    Byte,
    Integer,
    Real,
}

impl<'a> Parameters<'a> {
    /// Lists the records. The section's own count of blocks is often wrong, so it ends where the chain of records does,
    /// or where the data begin.
    pub(super) fn read(bytes: &'a Bytes<'a>, header: &Header) -> Result<Self, Fault> {
        let data = (usize::from(header.data_block) * BLOCK).saturating_sub(BLOCK);
        let end = match data {
            data if data > bytes.parameters => data.min(bytes.all().len()),
            _ => bytes.all().len(),
        };
        let mut records = Vec::new();
        let mut at = bytes.parameters + 4;
        while at < end {
            // A negative length of the name marks a locked record.
            let length = usize::from(bytes.u8(at)?.cast_signed().unsigned_abs());
            let id = bytes.u8(at + 1)?.cast_signed();
            if length == 0 || id == 0 {
                break;
            }
            let name = bytes.slice(at + 2, length)?;
            let link = at + 2 + length;
            let offset = usize::from(bytes.u16(link)?);
            let next = match offset {
                0 => end,
                _ => link + offset,
            };
            if next < link + 2 || next > bytes.all().len() {
                return Err(Fault::at_byte(
                    link,
                    format!("the next parameter cannot be {offset} bytes further"),
                ));
            }
            records.push(Record {
                id,
                name,
                body: link + 2,
                end: next,
            });
            at = next;
        }
        Ok(Self { bytes, records })
    }

    /// The parameter `group:name`, both in upper case; `None` if the file has none.
    pub(super) fn find(&self, group: &str, name: &str) -> Result<Option<Parameter<'a>>, Fault> {
        let named =
            |record: &&Record, name: &str| record.name.eq_ignore_ascii_case(name.as_bytes());
        let mut groups = self.records.iter().filter(|record| record.id < 0);
        let Some(group) = groups.find(|record| named(record, group)) else {
            return Ok(None);
        };
        let mut members = self
            .records
            .iter()
            .filter(|record| record.id > 0 && record.id.unsigned_abs() == group.id.unsigned_abs());
        members
            .find(|record| named(record, name))
            .map(|record| Parameter::read(self.bytes, record))
            .transpose()
    }
}

impl<'a> Parameter<'a> {
    fn read(bytes: &'a Bytes<'a>, record: &Record) -> Result<Self, Fault> {
        let at = record.body;
        let kind = match bytes.u8(at)?.cast_signed() {
            -1 => Kind::Text,
            1 => Kind::Byte,
            2 => Kind::Integer,
            4 => Kind::Real,
            other => {
                return Err(Fault::at_byte(
                    at,
                    format!("parameter type {other} is none of -1, 1, 2, 4"),
                ));
            }
        };
        let rank = usize::from(bytes.u8(at + 1)?);
        let dimensions = bytes.slice(at + 2, rank)?;
        let size = dimensions
            .iter()
            .fold(kind.size(), |size, &n| size.saturating_mul(n.into()));
        let begin = at + 2 + rank;
        if size > record.end.saturating_sub(begin) {
            return Err(Fault::at_byte(
                at,
                format!(
                    "parameter of {size} bytes runs past the next record at {}",
                    record.end
                ),
            ));
        }
        Ok(Self {
            bytes,
            at,
            kind,
            dimensions,
            data: bytes.slice(begin, size)?,
        })
    }

    /// The strings: the first dimension is their length, the others count them. Blanks around them are padding.
    pub(super) fn strings(&self) -> Result<Vec<String>, Fault> {
        if self.kind != Kind::Text {
            return Err(Fault::at_byte(
                self.at,
                "parameter holds numbers where text is expected",
            ));
        }
        let length = self.dimensions.first().copied().unwrap_or(1).into();
        if length == 0 {
            return Ok(Vec::new());
        }
        Ok(self.data.chunks_exact(length).map(text).collect())
    }

    /// The first number, `None` in an empty array.
    pub(super) fn number(&self) -> Result<Option<f64>, Fault> {
        Ok(match self.kind {
            Kind::Text => return Err(self.not_numbers()),
            Kind::Byte => self.data.first().map(|&byte| byte.into()),
            Kind::Integer => self
                .data
                .as_chunks()
                .0
                .first()
                .map(|&word| self.bytes.decode_i16(word).into()),
            Kind::Real => self
                .data
                .as_chunks()
                .0
                .first()
                .map(|&word| self.bytes.decode_f32(word)),
        })
    }

    /// The array as counts: integers are unsigned, floats are cut to whole numbers; `None` stands for what is no count.
    pub(super) fn counts(&self) -> Result<Vec<Option<u32>>, Fault> {
        Ok(match self.kind {
            Kind::Text => return Err(self.not_numbers()),
            Kind::Byte => self.data.iter().map(|&byte| Some(byte.into())).collect(),
            Kind::Integer => {
                let (words, _) = self.data.as_chunks();
                let unsigned = |word| self.bytes.decode_i16(word).cast_unsigned();
                words
                    .iter()
                    .map(|&word| Some(unsigned(word).into()))
                    .collect()
            }
            Kind::Real => {
                let (words, _) = self.data.as_chunks();
                words
                    .iter()
                    .map(|&word| whole(self.bytes.decode_f32(word)))
                    .collect()
            }
        })
    }

    fn not_numbers(&self) -> Fault {
        Fault::at_byte(self.at, "parameter holds text where numbers are expected")
    }
}

impl Kind {
    /// Bytes per element.
    fn size(self) -> usize {
        match self {
            Self::Text | Self::Byte => 1,
            Self::Integer => 2,
            Self::Real => 4,
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the range is checked, a fraction is to be cut"
)]
fn whole(value: f64) -> Option<u32> {
    (0.0..=f64::from(u32::MAX))
        .contains(&value)
        .then_some(value as u32)
}

/// Text up to a NUL, which some programs pad with, without blanks around it. What is not UTF-8 is taken for Latin-1.
fn text(bytes: &[u8]) -> String {
    let end = bytes
        .iter()
        .position(|&byte| byte == 0)
        .unwrap_or(bytes.len());
    let text = match str::from_utf8(&bytes[..end]) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes[..end].iter().map(|&byte| char::from(byte)).collect(),
    };
    text.trim().to_owned()
}
