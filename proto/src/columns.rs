//! Columns of numbers: between the forms that travel and plain vectors.

use bytes::Bytes;

use crate::v1::{Indices, Precision, Reals};

/// Why a column cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnError {
    /// More than one of the forms is given.
    #[error("holds more than one of {forms}")]
    SeveralForms {
        /// The column's forms.
        forms: &'static str,
    },
    /// The bytes end within a number.
    #[error("`{form}` has {bytes} bytes, which is no multiple of {width}")]
    Ragged {
        /// The form given.
        form: &'static str,
        /// Its length.
        bytes: usize,
        /// Bytes of one number.
        width: usize,
    },
}

impl Reals {
    /// Packs numbers; rounds them for [`Precision::F32`].
    pub fn pack(numbers: &[f64], precision: Precision) -> Self {
        match precision {
            Precision::F64 => Self {
                f64: pack(numbers, |x| x.to_le_bytes()),
                ..Self::default()
            },
            Precision::Unspecified | Precision::F32 => Self {
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "the caller asked for binary32"
                )]
                f32: pack(numbers, |x| (x as f32).to_le_bytes()),
                ..Self::default()
            },
        }
    }

    /// Reads the numbers. An empty column has none.
    ///
    /// # Errors
    /// [`ColumnError`] where two forms are given or the bytes end within a number.
    pub fn unpack(&self) -> Result<Vec<f64>, ColumnError> {
        let given = [
            self.f32.is_empty(),
            self.f64.is_empty(),
            self.values.is_empty(),
        ];
        if given.iter().filter(|empty| !**empty).count() > 1 {
            return Err(ColumnError::SeveralForms {
                forms: "f32, f64, values",
            });
        }
        if !self.f32.is_empty() {
            unpack("f32", &self.f32, |bytes| {
                f64::from(f32::from_le_bytes(bytes))
            })
        } else if !self.f64.is_empty() {
            unpack("f64", &self.f64, f64::from_le_bytes)
        } else {
            Ok(self.values.clone())
        }
    }

    /// True where no form holds a number.
    pub fn is_empty(&self) -> bool {
        self.f32.is_empty() && self.f64.is_empty() && self.values.is_empty()
    }
}

impl Indices {
    /// Packs indices.
    pub fn pack(indices: &[u32]) -> Self {
        Self {
            u32: pack(indices, |i| i.to_le_bytes()),
            values: Vec::new(),
        }
    }

    /// Reads the indices. An empty column has none.
    ///
    /// # Errors
    /// [`ColumnError`] where both forms are given or the bytes end within an index.
    pub fn unpack(&self) -> Result<Vec<u32>, ColumnError> {
        match (self.u32.is_empty(), self.values.is_empty()) {
            (false, false) => Err(ColumnError::SeveralForms {
                forms: "u32, values",
            }),
            (false, true) => unpack("u32", &self.u32, u32::from_le_bytes),
            (true, _) => Ok(self.values.clone()),
        }
    }
}

fn pack<T: Copy, const N: usize>(numbers: &[T], bytes: impl Fn(T) -> [u8; N]) -> Bytes {
    let mut packed = vec![0; numbers.len() * N];
    for (slot, number) in packed.chunks_exact_mut(N).zip(numbers) {
        slot.copy_from_slice(&bytes(*number));
    }
    packed.into()
}

fn unpack<T, const N: usize>(
    form: &'static str,
    bytes: &[u8],
    number: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, ColumnError> {
    let (whole, rest) = bytes.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(ColumnError::Ragged {
            form,
            bytes: bytes.len(),
            width: N,
        });
    }
    Ok(whole.iter().map(|chunk| number(*chunk)).collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn f64_columns_come_back_bit_for_bit(bits in proptest::collection::vec(any::<u64>(), 0..50)) {
            let numbers: Vec<f64> = bits.iter().map(|b| f64::from_bits(*b)).collect();
            let back = Reals::pack(&numbers, Precision::F64).unpack().unwrap();
            prop_assert_eq!(back.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), bits);
        }

        #[test]
        fn f32_columns_round_once(numbers in proptest::collection::vec(-1e6..1e6f64, 0..50)) {
            let back = Reals::pack(&numbers, Precision::F32).unpack().unwrap();
            for (x, y) in numbers.iter().zip(&back) {
                prop_assert!((x - y).abs() <= x.abs() * 6e-8 + 1e-38);
            }
        }

        #[test]
        fn indices_come_back(indices in proptest::collection::vec(any::<u32>(), 0..50)) {
            prop_assert_eq!(Indices::pack(&indices).unpack().unwrap(), indices);
        }
    }

    #[test]
    fn a_column_in_two_forms_is_refused() {
        let mut reals = Reals::pack(&[1.0], Precision::F64);
        reals.values.push(1.0);
        assert!(matches!(
            reals.unpack(),
            Err(ColumnError::SeveralForms { .. })
        ));
    }

    #[test]
    fn bytes_that_end_within_a_number_are_refused() {
        let reals = Reals {
            f32: Bytes::from_static(&[0; 7]),
            ..Reals::default()
        };
        assert_eq!(
            reals.unpack(),
            Err(ColumnError::Ragged {
                form: "f32",
                bytes: 7,
                width: 4
            })
        );
    }

    #[test]
    fn every_message_has_the_json_mapping() {
        let json = r#"{"positions":{"values":[0,0.5,1]},"cellTypes":"Cg==","connectivity":{"values":[0]}}"#;
        let grid: crate::v1::UnstructuredGrid = serde_json::from_str(json).unwrap();
        assert_eq!(grid.positions.as_ref().unwrap().values, [0.0, 0.5, 1.0]);
        assert_eq!(&grid.cell_types[..], [10]);
        assert_eq!(
            serde_json::from_str::<crate::v1::UnstructuredGrid>(
                &serde_json::to_string(&grid).unwrap()
            )
            .unwrap(),
            grid
        );
    }
}
