//! Kinds of numbers in binary files.

/// Which byte of a binary number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Endian {
    Little,
    Big,
}

/// How the numbers of a section are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Text,
    Binary(Endian),
}

/// The kind of a binary number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of one number.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in `bytes`, which are exactly `self.size()` long.
    #[expect(
        clippy::cast_precision_loss,
        reason = "a coordinate stored as a 64-bit integer has no better real"
    )]
    pub(crate) fn real(self, bytes: &[u8], endian: Endian) -> f64 {
        let bits = bits(bytes, endian);
        match self {
            Self::F32 => f64::from(f32::from_bits(u32::try_from(bits).unwrap_or_default())),
            Self::F64 => f64::from_bits(bits),
            Self::U64 => bits as f64,
            Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::I32 | Self::U32 | Self::I64 => {
                self.signed(bits) as f64
            }
        }
    }

    /// The whole number in `bytes`, which are exactly `self.size()` long; `None` for reals and beyond `i64`.
    pub(crate) fn integer(self, bytes: &[u8], endian: Endian) -> Option<i64> {
        let bits = bits(bytes, endian);
        match self {
            Self::F32 | Self::F64 => None,
            Self::U64 => i64::try_from(bits).ok(),
            Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::I32 | Self::U32 | Self::I64 => {
                Some(self.signed(bits))
            }
        }
    }

    /// Extends the sign of the kinds that have one.
    fn signed(self, bits: u64) -> i64 {
        let unused = match self {
            Self::I8 => 56,
            Self::I16 => 48,
            Self::I32 => 32,
            Self::U8 | Self::U16 | Self::U32 | Self::I64 | Self::U64 | Self::F32 | Self::F64 => 0,
        };
        (bits << unused).cast_signed() >> unused
    }
}

fn bits(bytes: &[u8], endian: Endian) -> u64 {
    let shift = |value: u64, byte: &u8| (value << 8) | u64::from(*byte);
    match endian {
        Endian::Little => bytes.iter().rev().fold(0, shift),
        Endian::Big => bytes.iter().fold(0, shift),
    }
}
