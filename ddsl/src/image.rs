//! The plan for values that travel in place, as memory images.

use crate::conversion::{Pair, between, kind};
use rc_conversion::Item;
use rc_idsl::model::{Layout, Member, Type, TypeDeclKind, TypeId};
use rc_quantity::Conversion as Factor;
use rc_vocabulary::layout::aligned;

/// The values of the image of a plain structure, whose bytes between converted numbers are skipped.
pub(crate) fn image_items(pair: &Pair<'_>, from: TypeId, to: TypeId) -> Vec<Item> {
    let mut image = Image::default();
    image.declared(pair, from, to, 0);
    image.items
}

/// The items up to byte `at`.
#[derive(Default)]
struct Image {
    items: Vec<Item>,
    at: usize,
}

/// A size of a plain type, which travels only if it is below 2^30.
fn small(size: usize) -> u32 {
    u32::try_from(size).unwrap_or(u32::MAX)
}

impl Image {
    /// Skips to a byte.
    fn skip_to(&mut self, offset: usize) {
        if offset > self.at {
            self.items.push(Item::Bytes(small(offset - self.at)));
            self.at = offset;
        }
    }

    fn declared(&mut self, pair: &Pair<'_>, from: TypeId, to: TypeId, offset: usize) {
        if let (
            TypeDeclKind::Struct(one) | TypeDeclKind::Exception(one),
            TypeDeclKind::Struct(other) | TypeDeclKind::Exception(other),
        ) = (&pair.from.ty(from).kind, &pair.to.ty(to).kind)
        {
            self.members(pair, one, other, offset);
        }
    }

    fn members(&mut self, pair: &Pair<'_>, from: &[Member], to: &[Member], start: usize) {
        let mut offset = 0;
        for (one, other) in from.iter().zip(to) {
            let Some(layout) = pair.from.member_image(one) else {
                return;
            };
            offset = aligned(offset, layout.align);
            let factor = between(one.unit.as_deref(), other.unit.as_deref());
            let at = start + offset;
            if one.optional {
                self.bounded(pair, (&one.ty, &other.ty), 1, factor, at);
            } else {
                self.value(pair, (&one.ty, &other.ty), factor, at);
            }
            offset += layout.size;
        }
    }

    /// The values of a type at a byte, which is a multiple of its alignment.
    fn value(
        &mut self,
        pair: &Pair<'_>,
        (from, to): (&Type, &Type),
        factor: Option<Factor>,
        offset: usize,
    ) {
        let (from, to) = (pair.from.resolved(from), pair.to.resolved(to));
        match (from, to) {
            (Type::Primitive(number), _) => {
                if let (Some(own), Some(factor)) = (kind(*number), factor) {
                    self.skip_to(offset);
                    self.items.push(Item::Numbers(1, own, Some(factor)));
                    self.at = offset + own.size();
                }
            }
            (Type::Array(one, count), Type::Array(other, _)) => {
                let Some(element) = pair.from.image(one) else {
                    return;
                };
                let items = element_items(pair, (one, other), factor, element);
                if !items.iter().any(Item::converts) {
                    return;
                }
                self.skip_to(offset);
                self.items.push(match items.as_slice() {
                    [Item::Numbers(1, number, factor)] => Item::Numbers(*count, *number, *factor),
                    _ => Item::Array(*count, items),
                });
                self.at = offset + element.times(*count).size;
            }
            (Type::Sequence(one, bound), Type::Sequence(other, _)) => {
                self.bounded(pair, (one, other), bound.unwrap_or(0), factor, offset);
            }
            (Type::Named(one), Type::Named(other)) => self.declared(pair, *one, *other, offset),
            _ => {}
        }
    }

    /// A length, and space for `bound` elements.
    fn bounded(
        &mut self,
        pair: &Pair<'_>,
        types: (&Type, &Type),
        bound: u32,
        factor: Option<Factor>,
        offset: usize,
    ) {
        let Some(element) = pair.from.image(types.0) else {
            return;
        };
        let items = element_items(pair, types, factor, element);
        if bound == 0 || !items.iter().any(Item::converts) {
            return;
        }
        self.skip_to(offset);
        let first = aligned(Layout::LENGTH.size, element.align);
        self.items.push(Item::Bounded {
            bound,
            padding: small(first - Layout::LENGTH.size),
            stride: small(element.size),
            items,
        });
        self.at = offset + first + element.times(bound).size;
    }
}

/// The values of one element, with the bytes up to the next one.
fn element_items(
    pair: &Pair<'_>,
    types: (&Type, &Type),
    factor: Option<Factor>,
    element: Layout,
) -> Vec<Item> {
    let mut image = Image::default();
    image.value(pair, types, factor, 0);
    if image.items.iter().any(Item::converts) {
        image.skip_to(element.size);
    }
    image.items
}
