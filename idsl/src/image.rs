//! The memory image of plain types, which components write and read in place.
//!
//! The layout is that of C on a 64-bit machine, with members in order. Numbers have their natural
//! size and alignment. A `bool` is a byte, an enum an int32. A bounded sequence or string is its
//! length as uint32, then space for as many elements as its bound allows. An optional member is a
//! sequence of at most one element.

/// The image of the length of a sequence or string: a uint32.
pub const LENGTH: Image = Image {
    size: 4,
    align: 4,
    counted: false,
};

/// Size and alignment of a value in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image {
    /// In bytes, a multiple of the alignment.
    pub size: u64,
    /// In bytes, at most 8.
    pub align: u64,
    /// Whether it contains a bounded sequence or string, which may be partly filled.
    pub counted: bool,
}

impl Image {
    /// The image of an array of `count` elements.
    #[must_use]
    pub fn times(self, count: u32) -> Self {
        Self {
            size: self.size.saturating_mul(u64::from(count)),
            ..self
        }
    }

    /// The image of a struct with these members, in order.
    pub fn structure(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut whole = Self {
            size: 0,
            align: 1,
            counted: false,
        };
        for part in parts {
            whole.size = aligned(whole.size, part.align).saturating_add(part.size);
            whole.align = whole.align.max(part.align);
            whole.counted |= part.counted;
        }
        whole.size = aligned(whole.size, whole.align);
        whole
    }
}

/// The smallest multiple of `align` that is not less than `size`.
pub fn aligned(size: u64, align: u64) -> u64 {
    size.checked_next_multiple_of(align).unwrap_or(u64::MAX)
}
