//! Little-endian numbers and strings of a packet, in their order.

use nalgebra::Vector3;

/// Why a packet cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} at byte {at} is beyond the packet's end")]
pub struct Garbled {
    /// What was to stand there.
    pub what: &'static str,
    /// Where.
    pub at: usize,
}

/// Reads a packet from its beginning to its end; nothing is allocated by a count that the packet only claims.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursor<'a> {
    packet: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(packet: &'a [u8]) -> Self {
        Self { packet, at: 0 }
    }

    pub(crate) fn bytes(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], Garbled> {
        let garbled = Garbled { what, at: self.at };
        let end = self.at.checked_add(count).ok_or(garbled)?;
        let bytes = self.packet.get(self.at..end).ok_or(garbled)?;
        self.at = end;
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], Garbled> {
        let bytes = self.bytes(N, what)?;
        Ok(bytes.try_into().expect("N bytes were taken"))
    }

    pub(crate) fn u16(&mut self, what: &'static str) -> Result<u16, Garbled> {
        self.array(what).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, what: &'static str) -> Result<u32, Garbled> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, what: &'static str) -> Result<u64, Garbled> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub(crate) fn f32(&mut self, what: &'static str) -> Result<f32, Garbled> {
        self.array(what).map(f32::from_le_bytes)
    }

    pub(crate) fn f64(&mut self, what: &'static str) -> Result<f64, Garbled> {
        self.array(what).map(f64::from_le_bytes)
    }

    /// Three binary32.
    pub(crate) fn vector(&mut self, what: &'static str) -> Result<Vector3<f64>, Garbled> {
        let mut next = || self.f32(what).map(f64::from);
        Ok(Vector3::new(next()?, next()?, next()?))
    }

    /// Text that a zero ends. What is not UTF-8 is replaced.
    pub(crate) fn text(&mut self, what: &'static str) -> Result<String, Garbled> {
        let garbled = Garbled { what, at: self.at };
        let rest = self.packet.get(self.at..).ok_or(garbled)?;
        let length = rest.iter().position(|byte| *byte == 0).ok_or(garbled)?;
        self.at += length + 1;
        Ok(String::from_utf8_lossy(&rest[..length]).into_owned())
    }
}
