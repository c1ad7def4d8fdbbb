//! The memory image of plain types: what they look like where they are written and read in place.
//!
//! The layout is that of C on a 64-bit machine, members in their order: numbers have their natural size and
//! alignment, a `bool` is a byte, an enum an int32, a bounded sequence or string is its length as uint32 and then room
//! for as many elements as its bound says, an optional member is a sequence of at most one.

use crate::model::{Library, Member, Operation, Type, TypeDeclKind, TypeId};

/// What lengths are.
pub const LENGTH: Image = Image {
    size: 4,
    align: 4,
    counted: false,
};

/// The largest image that is sent, in bytes.
pub const LARGEST: u64 = 1 << 30;

/// Size and alignment of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image {
    /// In bytes, a multiple of the alignment.
    pub size: u64,
    /// In bytes, at most 8.
    pub align: u64,
    /// Whether there is a bounded sequence in it, which need not be full.
    pub counted: bool,
}

impl Image {
    /// `count` of them.
    #[must_use]
    pub fn times(self, count: u32) -> Self {
        Self {
            size: self.size.saturating_mul(u64::from(count)),
            ..self
        }
    }

    /// One behind the other.
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

/// The next place with this alignment.
pub fn aligned(size: u64, align: u64) -> u64 {
    size.checked_next_multiple_of(align).unwrap_or(u64::MAX)
}

impl Library {
    /// The image of a value of this type; none where its size is not known from the type alone.
    pub fn image(&self, ty: &Type) -> Option<Image> {
        let number = |size: u32| Image {
            size: u64::from(size),
            align: u64::from(size),
            counted: false,
        };
        Some(match ty {
            Type::Primitive(primitive) => number(primitive.size()),
            Type::String(bound) => Image::structure([LENGTH, number(1).times((*bound)?)]),
            Type::Sequence(element, bound) => self.sequence(element, (*bound)?)?,
            Type::Array(element, count) => self.image(element)?.times(*count),
            Type::Dictionary(..) => return None,
            Type::Named(id) => self.ty(*id).image?,
        })
    }

    /// The image of a member.
    pub fn member_image(&self, member: &Member) -> Option<Image> {
        if member.optional {
            self.sequence(&member.ty, 1)
        } else {
            self.image(&member.ty)
        }
    }

    fn sequence(&self, element: &Type, bound: u32) -> Option<Image> {
        let items = self.image(element)?.times(bound);
        Some(Image {
            counted: true,
            ..Image::structure([LENGTH, items])
        })
    }

    /// The structure whose values of this type are worth being written and read in place: a plain one with a bounded
    /// sequence.
    pub fn in_place(&self, ty: &Type) -> Option<TypeId> {
        let Type::Named(id) = self.resolved(ty) else {
            return None;
        };
        let decl = self.ty(*id);
        let image = decl.image?;
        let fits = matches!(decl.kind, TypeDeclKind::Struct(_)) && image.size <= LARGEST;
        (image.counted && fits).then_some(*id)
    }
}

impl Operation {
    /// The structure in which its only parameter travels as a topic, where that can be in place.
    pub fn topic_in_place(&self, library: &Library) -> Option<TypeId> {
        match self.inputs.as_slice() {
            [only] if !only.optional => library.in_place(&only.ty),
            _ => None,
        }
    }

    /// The structure in which its only result travels, where that can be in place.
    pub fn result_in_place(&self, library: &Library) -> Option<TypeId> {
        match (&self.result, self.outputs.as_slice()) {
            (Some(result), []) => library.in_place(result),
            (None, [only]) if !only.optional => library.in_place(&only.ty),
            _ => None,
        }
    }
}
