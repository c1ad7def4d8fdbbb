//! The types of numbers.

/// The type of a number, which is little endian and aligned to its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names of Rust's own types")]
pub enum Number {
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

impl Number {
    /// All types, with their letters in the texts of plans: those of Python's `struct`.
    pub(crate) const ALL: [(Self, char); 10] = [
        (Self::I8, 'b'),
        (Self::U8, 'B'),
        (Self::I16, 'h'),
        (Self::U16, 'H'),
        (Self::I32, 'i'),
        (Self::U32, 'I'),
        (Self::I64, 'q'),
        (Self::U64, 'Q'),
        (Self::F32, 'f'),
        (Self::F64, 'd'),
    ];

    /// The letter in the texts of plans.
    pub(crate) fn letter(self) -> char {
        let mut all = Self::ALL.iter();
        all.find(|(number, _)| *number == self)
            .map_or('B', |(_, letter)| *letter)
    }

    /// In bytes.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number at a byte, as the nearest `f64`. NaN behind the end.
    pub(crate) fn read(self, bytes: &[u8], at: usize) -> f64 {
        let Some(item) = bytes.get(at..).and_then(|rest| rest.get(..self.size())) else {
            return f64::NAN;
        };
        let mut word = [0; 8];
        word[..self.size()].copy_from_slice(item);
        let bits = u64::from_le_bytes(word);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            clippy::cast_precision_loss,
            reason = "the low bytes are the number, and above 2^53 the nearest f64 is meant"
        )]
        match self {
            Self::I8 => f64::from(bits as i8),
            Self::U8 => f64::from(bits as u8),
            Self::I16 => f64::from(bits as i16),
            Self::U16 => f64::from(bits as u16),
            Self::I32 => f64::from(bits as i32),
            Self::U32 => f64::from(bits as u32),
            Self::I64 => bits as i64 as f64,
            Self::U64 => bits as f64,
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
        }
    }

    /// Whether a number of this type is finite after it was written.
    #[inline]
    pub(crate) fn holds(self, value: f64) -> bool {
        #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
        match self {
            Self::F32 => (value as f32).is_finite(),
            Self::F64 => value.is_finite(),
            integer => integer.write(&mut [0; 8], 0, value),
        }
    }

    /// Writes a number at a byte: a whole one if the type is one of integers. `false` if it does not
    /// fit.
    pub(crate) fn write(self, bytes: &mut [u8], at: usize, value: f64) -> bool {
        let size = self.size();
        let Some(item) = bytes.get_mut(at..).and_then(|rest| rest.get_mut(..size)) else {
            return false;
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "compared below, or rounded"
        )]
        let word = match self {
            Self::F32 => u64::from((value as f32).to_bits()),
            Self::F64 => value.to_bits(),
            integer => {
                let whole = value as i128;
                let bits = 8 * size;
                let (least, most) = match integer {
                    Self::U8 | Self::U16 | Self::U32 | Self::U64 => (0, (1_i128 << bits) - 1),
                    _ => (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1),
                };
                if value.is_nan() || !(least..=most).contains(&whole) {
                    return false;
                }
                let mut word = [0; 8];
                word.copy_from_slice(&whole.to_le_bytes()[..8]);
                u64::from_le_bytes(word)
            }
        };
        item.copy_from_slice(&word.to_le_bytes()[..size]);
        true
    }
}
