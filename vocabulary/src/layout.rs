//! The memory image of plain types, which components write and read in place.
//!
//! The layout is that of C on a 64-bit machine, with members in order. Numbers have their natural
//! size and alignment. A `bool` is a byte, an enum an int32. A bounded sequence or string is its
//! length as uint32, then space for as many elements as its bound allows. An optional member is a
//! sequence of at most one element.

/// The largest image that travels, in bytes.
pub const LARGEST: usize = 1 << 30;

/// Size and alignment of a value in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// In bytes, a multiple of the alignment. `usize::MAX` represents all larger sizes.
    pub size: usize,
    /// In bytes, at most 8.
    pub align: usize,
    /// Whether it contains a bounded sequence or string, which may be partly filled.
    pub counted: bool,
}

impl Layout {
    /// The length of a sequence or string: a uint32.
    pub const LENGTH: Self = Self::number(4);
    /// The number of an enum: an int32.
    pub const ENUM: Self = Self::number(4);
    /// A structure without members.
    const NOTHING: Self = Self {
        size: 0,
        align: 1,
        counted: false,
    };

    /// A number of this many bytes.
    pub const fn number(size: usize) -> Self {
        Self {
            size,
            align: size,
            counted: false,
        }
    }

    /// An array of `count` elements.
    #[must_use]
    pub fn times(self, count: u32) -> Self {
        Self {
            size: self.size.saturating_mul(count as usize),
            ..self
        }
    }

    /// A length, and space for as many elements as `bound` allows.
    #[must_use]
    pub fn sequence(element: Self, bound: u32) -> Self {
        Self {
            counted: true,
            ..Self::structure([Self::LENGTH, element.times(bound)])
        }
    }

    /// A text of at most `bound` bytes. It does not count as partly filled.
    #[must_use]
    pub fn text(bound: u32) -> Self {
        Self::structure([Self::LENGTH, Self::number(1).times(bound)])
    }

    /// A structure with these members, in order.
    pub fn structure(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut whole = Self::NOTHING;
        for part in parts {
            whole.size = aligned(whole.size, part.align).saturating_add(part.size);
            whole.align = whole.align.max(part.align);
            whole.counted |= part.counted;
        }
        whole.size = aligned(whole.size, whole.align);
        whole
    }

    /// Whether values of it can travel: it has at most [`LARGEST`] bytes.
    pub fn fits(self) -> bool {
        self.size <= LARGEST
    }
}

/// The smallest multiple of `align` that is not less than `size`.
pub fn aligned(size: usize, align: usize) -> usize {
    size.checked_next_multiple_of(align).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_aligned_and_sizes_do_not_overflow() {
        let text = Layout::text(3);
        assert_eq!((text.size, text.align, text.counted), (8, 4, false));
        let points = Layout::sequence(Layout::number(8), 2);
        assert_eq!((points.size, points.align, points.counted), (24, 8, true));
        let whole = Layout::structure([Layout::number(1), points, Layout::number(2)]);
        assert_eq!((whole.size, whole.align, whole.counted), (40, 8, true));
        assert_eq!(Layout::structure([]).size, 0);
        let huge = points.times(u32::MAX).times(u32::MAX);
        assert_eq!(huge.size, usize::MAX);
        assert!(!huge.fits() && whole.fits());
        assert_eq!(
            Layout::structure([Layout::number(1), huge]).size,
            usize::MAX
        );
    }
}
