//! The header block.

use super::super::error::Fault;
use super::bytes::Bytes;

/// The header's words as written; which of them to believe is for [`Layout`](super::layout::Layout) to say.
pub(super) struct Header {
    pub(super) points: u16,
    /// Analog numbers per frame of points: channels × samples.
    pub(super) analog: u16,
    /// The numbers of the first and last frame, from 1.
    pub(super) first: u16,
    pub(super) last: u16,
    /// Units of length per integer step; negative if the data are floats.
    pub(super) scale: f64,
    /// The block, from 1, where the data begin.
    pub(super) data_block: u16,
    pub(super) rate_hz: f64,
}

impl Header {
    pub(super) const POINTS_AT: usize = 2;
    pub(super) const FIRST_AT: usize = 6;
    pub(super) const SCALE_AT: usize = 12;
    pub(super) const DATA_BLOCK_AT: usize = 16;
    pub(super) const RATE_AT: usize = 20;

    pub(super) fn read(bytes: &Bytes) -> Result<Self, Fault> {
        Ok(Self {
            points: bytes.u16(Self::POINTS_AT)?,
            analog: bytes.u16(4)?,
            first: bytes.u16(Self::FIRST_AT)?,
            last: bytes.u16(8)?,
            scale: bytes.f32(Self::SCALE_AT)?,
            data_block: bytes.u16(Self::DATA_BLOCK_AT)?,
            rate_hz: bytes.f32(Self::RATE_AT)?,
        })
    }
}
