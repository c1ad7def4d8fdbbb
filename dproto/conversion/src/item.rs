//! The values of a message, in their order.

use crate::formula::Formula;
use alloc::vec::Vec;
use core::fmt::{self, Write};
use rc_quantity::Conversion;
use rc_vocabulary::Primitive;

/// A value of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// This many numbers of one type. They stay as they are without a conversion.
    Numbers(u32, Primitive, Option<Conversion>),
    /// This many numbers of one type that the formula of the group around them reads and writes.
    Marked(u32, Primitive),
    /// A number that a change of frames needs, as the sender has it.
    KeptNumber(Primitive, Option<Conversion>),
    /// A string that a change of frames needs.
    KeptText,
    /// Values with marked numbers, which a formula converts together.
    Group {
        /// The values.
        items: Vec<Item>,
        /// The new values of their marked numbers.
        formula: Formula,
    },
    /// Bytes that stay as they are, without alignment.
    Bytes(u32),
    /// A string: its length with the zero at its end, then its bytes.
    Text,
    /// A sequence, a dictionary, or an optional value: the number of its elements, then the values
    /// of each.
    Sequence(Vec<Item>),
    /// Values that follow each other so many times.
    Array(u32, Vec<Item>),
    /// A sequence in a memory image: the number of its elements, and space for `bound` of them.
    Bounded {
        /// The most elements.
        bound: u32,
        /// The bytes between the number and the first element.
        padding: u32,
        /// The bytes from one element to the next.
        stride: u32,
        /// The values of an element.
        items: Vec<Item>,
    },
}

impl Item {
    /// How many numbers belong to the group around it.
    pub(crate) fn marked(&self) -> usize {
        match self {
            Self::Marked(times, _) => *times as usize,
            Self::Array(times, items) => {
                let one: usize = items.iter().map(Self::marked).sum();
                one.saturating_mul(*times as usize)
            }
            // The number of elements is known only at run time.
            _ => 0,
        }
    }

    /// Whether it holds a number that is converted, or a value that a change of frames needs.
    #[must_use]
    pub fn converts(&self) -> bool {
        match self {
            Self::Numbers(_, _, conversion) => conversion.is_some(),
            Self::Marked(..) | Self::Group { .. } | Self::KeptNumber(..) | Self::KeptText => true,
            Self::Bytes(_) | Self::Text => false,
            Self::Sequence(items) | Self::Array(_, items) | Self::Bounded { items, .. } => {
                items.iter().any(Self::converts)
            }
        }
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |f: &mut fmt::Formatter<'_>, count: u32| match count {
            1 => Ok(()),
            more => write!(f, "{more}"),
        };
        let converted = |f: &mut fmt::Formatter<'_>, by: &Option<Conversion>| match by {
            Some(conversion) => write!(f, "{{{}}}", conversion.code()),
            None => Ok(()),
        };
        match self {
            Self::Numbers(times, number, conversion) => {
                count(f, *times)?;
                f.write_char(number.letter())?;
                converted(f, conversion)
            }
            Self::Marked(times, number) => {
                count(f, *times)?;
                write!(f, "{}!", number.letter())
            }
            Self::KeptNumber(number, conversion) => {
                write!(f, "{}?", number.letter())?;
                converted(f, conversion)
            }
            Self::KeptText => f.write_str("s?"),
            Self::Group { items, formula } => write!(f, "{{{}|{formula}}}", Items(items)),
            Self::Bytes(bytes) => {
                count(f, *bytes)?;
                f.write_char('x')
            }
            Self::Text => f.write_char('s'),
            Self::Sequence(items) => write!(f, "[{}]", Items(items)),
            Self::Array(times, items) => write!(f, "{times}({})", Items(items)),
            Self::Bounded {
                bound,
                padding,
                stride,
                items,
            } => write!(f, "{bound}<{padding},{stride}:{}>", Items(items)),
        }
    }
}

/// Values one after the other.
pub(crate) struct Items<'a>(pub(crate) &'a [Item]);

impl fmt::Display for Items<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|item| item.fmt(f))
    }
}
