//! The memory image of plain types, which components write and read in place.
//!
//! The layout is that of C on a 64-bit machine, with members in order. Numbers have their natural
//! size and alignment. A `bool` is a byte, an enum an int32. A bounded sequence or string is its
//! length as uint32, then space for as many elements as its bound allows. An optional member is a
//! sequence of at most one element.

use crate::model::{Library, Member, Operation, Type, TypeDeclKind, TypeId};

/// The image of the length of a sequence or string: a uint32.
pub const LENGTH: Image = Image {
    size: 4,
    align: 4,
    counted: false,
};

/// The maximum size of an image that is sent, in bytes.
pub const LARGEST: u64 = 1 << 30;

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

impl Library {
    /// The image of a value of this type. `None` if the type does not determine its size.
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

    /// The image of a member. `None` as for [`image`](Self::image).
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

    /// The struct behind `ty` if its values can travel in place: a plain struct with a bounded
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
    /// The struct of the only parameter, if a topic of this operation can travel in place.
    pub fn topic_in_place(&self, library: &Library) -> Option<TypeId> {
        match self.inputs.as_slice() {
            [only] if !only.optional => library.in_place(&only.ty),
            _ => None,
        }
    }

    /// The struct of the only result, if the reply can travel in place.
    pub fn result_in_place(&self, library: &Library) -> Option<TypeId> {
        match (&self.result, self.outputs.as_slice()) {
            (Some(result), []) => library.in_place(result),
            (None, [only]) if !only.optional => library.in_place(&only.ty),
            _ => None,
        }
    }
}
