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
}
