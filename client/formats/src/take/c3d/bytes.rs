//! Checked reads of numbers as three kinds of processor wrote them.

use super::super::error::Fault;
use super::BLOCK;

/// Whose numbers the file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Processor {
    /// Little-endian IEEE.
    Intel,
    /// Little-endian integers, VAX F floats.
    Dec,
    /// Big-endian IEEE: SGI, MIPS.
    Mips,
}

/// The file, and how to read its numbers.
pub(super) struct Bytes<'a> {
    all: &'a [u8],
    processor: Processor,
    /// Where the parameter section begins.
    pub(super) parameters: usize,
}

impl<'a> Bytes<'a> {
    /// Finds the parameter section, whose fourth byte names the processor.
    pub(super) fn new(all: &'a [u8]) -> Result<Self, Fault> {
        let byte = |at: usize, what: &str| {
            all.get(at).copied().ok_or_else(|| {
                Fault::at_byte(at, format!("the file ends at byte {} in {what}", all.len()))
            })
        };
        let block = byte(0, "the header")?;
        let key = byte(1, "the header")?;
        if key != 0x50 || block == 0 {
            return Err(Fault::at_byte(
                0,
                format!("begins with {block:#04x} {key:#04x}, not like a C3D file"),
            ));
        }
        let parameters = (usize::from(block) - 1) * BLOCK;
        let at = parameters + 3;
        let processor = match byte(at, "the parameter section to which byte 0 points")? {
            84 => Processor::Intel,
            85 => Processor::Dec,
            86 => Processor::Mips,
            other => {
                return Err(Fault::at_byte(
                    at,
                    format!("processor type {other} is none of 84 (Intel), 85 (DEC), 86 (MIPS)"),
                ));
            }
        };
        Ok(Self {
            all,
            processor,
            parameters,
        })
    }

    pub(super) fn all(&self) -> &'a [u8] {
        self.all
    }

    /// The `len` bytes at `at`.
    pub(super) fn slice(&self, at: usize, len: usize) -> Result<&'a [u8], Fault> {
        let end = at.checked_add(len).filter(|&end| end <= self.all.len());
        end.map(|end| &self.all[at..end]).ok_or_else(|| {
            Fault::at_byte(
                at,
                format!("needs {len} bytes, but the file ends at {}", self.all.len()),
            )
        })
    }

    pub(super) fn u8(&self, at: usize) -> Result<u8, Fault> {
        Ok(self.slice(at, 1)?[0])
    }

    pub(super) fn u16(&self, at: usize) -> Result<u16, Fault> {
        let bytes = self.slice(at, 2)?;
        Ok(self.decode_i16([bytes[0], bytes[1]]).cast_unsigned())
    }

    pub(super) fn f32(&self, at: usize) -> Result<f64, Fault> {
        let bytes = self.slice(at, 4)?;
        Ok(self.decode_f32([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    pub(super) fn decode_i16(&self, bytes: [u8; 2]) -> i16 {
        match self.processor {
            Processor::Intel | Processor::Dec => i16::from_le_bytes(bytes),
            Processor::Mips => i16::from_be_bytes(bytes),
        }
    }

    /// A 32-bit float, widened: half of the VAX range lies outside that of an IEEE `f32`.
    pub(super) fn decode_f32(&self, bytes: [u8; 4]) -> f64 {
        match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes).into(),
            Processor::Dec => vax_f(bytes),
            Processor::Mips => f32::from_be_bytes(bytes).into(),
        }
    }
}

/// A VAX F float: two little-endian 16-bit words, the high one first; sign, 8 bits of exponent with bias 128, 23 bits
/// of fraction after a hidden 0.1₂. Exponent 0 is zero or, with the sign set, the reserved operand, here NaN.
fn vax_f([b0, b1, b2, b3]: [u8; 4]) -> f64 {
    let bits = u32::from_le_bytes([b2, b3, b0, b1]);
    let negative = bits >> 31 == 1;
    let exponent = (bits >> 23) & 0xff;
    if exponent == 0 {
        return if negative { f64::NAN } else { 0.0 };
    }
    let hidden = 1 << 23;
    let fraction = f64::from(bits & (hidden - 1) | hidden) / f64::from(hidden << 1);
    let magnitude = fraction * 2.0_f64.powi(exponent.cast_signed() - 128);
    if negative { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::vax_f;

    #[test]
    fn vax_floats_have_their_words_swapped_and_a_wider_range() {
        assert_eq!(vax_f([0x80, 0x40, 0, 0]), 1.0);
        assert_eq!(vax_f([0xc0, 0xc0, 0, 0]), -1.5);
        assert_eq!(vax_f([0xed, 0xc3, 0x00, 0x40]), -118.625);
        assert_eq!(vax_f([0, 0, 0, 0]), 0.0);
        assert!(vax_f([0, 0x80, 0, 0]).is_nan());
        // The largest: (1 − 2⁻²⁴) · 2¹²⁷, and the smallest: 2⁻¹²⁸, a denormal in IEEE.
        assert_eq!(
            vax_f([0xff, 0x7f, 0xff, 0xff]),
            (1.0 - 0.5_f64.powi(24)) * 2.0_f64.powi(127)
        );
        assert_eq!(vax_f([0x80, 0, 0, 0]), 0.5_f64.powi(128));
    }
}
