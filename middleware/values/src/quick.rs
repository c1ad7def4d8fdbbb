//! Checks of small bodies whose bytes are copied as they are: the types of a structure as one list, which takes few
//! instructions and little of the processor's cache.

use crate::types::{Enum, Member, Named, Primitive, Type};
use std::sync::Arc;

/// The longest body that is checked so, in bytes. Larger arrays are copied apart from their structure.
const MOST: usize = 8 * 1024;

/// The most types in a structure: one whose structures have structures each, many times, has more than memory holds.
const MOST_TYPES: usize = 256;

/// The parts of a structure in the order of their bytes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quick {
    parts: Vec<Part>,
    /// The largest alignment of its numbers, from 4 on.
    align: usize,
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    /// This many numbers of this size.
    Numbers(usize, usize),
    /// An empty structure.
    Octet,
    Bool,
    Text(usize),
    Enum(Arc<Enum>),
    /// A sequence of numbers of this size, and its bound.
    NumberSequence(usize, usize),
    /// A sequence of structures, texts and the like, and its bound.
    Sequence(Vec<Part>, usize),
}

fn most(bound: Option<u32>) -> usize {
    bound.map_or(usize::MAX, |bound| bound as usize)
}

/// Lists the parts of a structure.
struct Listing {
    /// The types so far, with those of elements and of structures in it.
    count: usize,
    /// The largest alignment so far.
    align: usize,
}

impl Listing {
    fn structure(&mut self, members: &[Member], parts: &mut Vec<Part>) -> Option<()> {
        if members.is_empty() {
            parts.push(Part::Octet);
        }
        for member in members {
            if member.optional || member.range.is_some() {
                return None;
            }
            self.add(&member.ty, parts)?;
        }
        Some(())
    }

    fn size(&mut self, of: Primitive) -> Option<usize> {
        let size = of.size();
        self.align = self.align.max(size);
        (of != Primitive::Bool).then_some(size)
    }

    fn add(&mut self, ty: &Type, parts: &mut Vec<Part>) -> Option<()> {
        self.count += 1;
        if self.count > MOST_TYPES {
            return None;
        }
        let part = match ty {
            Type::Primitive(Primitive::Bool) => Part::Bool,
            Type::Primitive(of) => Part::Numbers(self.size(*of)?, 1),
            Type::Text { bound } => Part::Text(most(*bound)),
            Type::Sequence { element, bound } => match &**element {
                Type::Primitive(of) => Part::NumberSequence(self.size(*of)?, most(*bound)),
                other => {
                    let mut each = Vec::new();
                    self.add(other, &mut each)?;
                    Part::Sequence(each, most(*bound))
                }
            },
            Type::Array { element, length } => match &**element {
                Type::Primitive(of) => Part::Numbers(self.size(*of)?, *length as usize),
                _ => return None,
            },
            Type::Dictionary { .. } => return None,
            Type::Named(Named::Enum(of)) => Part::Enum(Arc::clone(of)),
            Type::Named(Named::Struct(of)) => return self.structure(&of.members, parts),
        };
        parts.push(part);
        Some(())
    }
}

impl Quick {
    /// `None` for a structure with parts that [`copy`](crate::copy) checks in another way: ranges, optional members,
    /// dictionaries, arrays of anything but numbers.
    pub(crate) fn of(members: &[Member]) -> Option<Self> {
        let (mut listing, mut parts) = (Listing { count: 0, align: 4 }, Vec::new());
        listing.structure(members, &mut parts)?;
        Some(Self {
            parts,
            align: listing.align,
        })
    }

    /// The length of the structure at the begin of `bytes`, which begin at the byte `from` of their message. `None` if
    /// they hold none, or if at the byte `to` of another message they would be others.
    pub(crate) fn length(&self, bytes: &[u8], from: usize, to: usize) -> Option<usize> {
        if from % self.align != to % self.align || bytes.len() > MOST {
            return None;
        }
        let mut check = Check {
            bytes,
            from: from % self.align,
            at: 0,
        };
        check.parts(&self.parts)?;
        Some(check.at)
    }
}

struct Check<'b> {
    bytes: &'b [u8],
    from: usize,
    at: usize,
}

impl<'b> Check<'b> {
    fn parts(&mut self, parts: &[Part]) -> Option<()> {
        for part in parts {
            match part {
                Part::Numbers(size, count) => self.numbers(*size, *count)?,
                Part::Octet => drop(self.take(1)?),
                Part::Bool => {
                    let [0 | 1] = self.take(1)? else {
                        return None;
                    };
                }
                Part::Text(bound) => {
                    let length = self.count()?;
                    let [text @ .., 0] = self.take(length)? else {
                        return None;
                    };
                    if text.len() > *bound
                        || text.contains(&0)
                        || std::str::from_utf8(text).is_err()
                    {
                        return None;
                    }
                }
                Part::Enum(of) => {
                    of.name_of(self.word()?.cast_signed())?;
                }
                Part::NumberSequence(size, bound) => {
                    let count = self.count().filter(|count| count <= bound)?;
                    self.numbers(*size, count)?;
                }
                Part::Sequence(each, bound) => {
                    let count = self.count().filter(|count| count <= bound)?;
                    for _ in 0..count {
                        self.parts(each)?;
                    }
                }
            }
        }
        Some(())
    }

    fn numbers(&mut self, size: usize, count: usize) -> Option<()> {
        if count == 0 {
            return Some(());
        }
        self.align(size);
        self.take(size.checked_mul(count)?).map(drop)
    }

    fn word(&mut self) -> Option<u32> {
        self.align(4);
        let word = self.take(4)?.first_chunk()?;
        Some(u32::from_le_bytes(*word))
    }

    /// A number of elements, of which each has a byte at least.
    fn count(&mut self) -> Option<usize> {
        let count = self.word()? as usize;
        (count <= self.bytes.len() - self.at).then_some(count)
    }

    /// Sizes are powers of two.
    fn align(&mut self, size: usize) {
        self.at = ((self.from + self.at + size - 1) & !(size - 1)) - self.from;
    }

    fn take(&mut self, size: usize) -> Option<&'b [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(size)?)?;
        self.at += size;
        Some(taken)
    }
}
