//! The plan for values that travel in place, as memory images.

use crate::meaning::chosen;
use crate::moves::Moves;
use crate::pair::{ChosenPair, Known, Marks, Pair, between, numbers, unmark};
use rc_conversion::{Item, Move};
use rc_idsl::model::{Layout, Member, Type, TypeDeclKind, TypeId};
use rc_quantity::Conversion as Factor;
use rc_vocabulary::layout::aligned;

/// The values of the image of a plain structure, whose bytes between converted numbers are skipped,
/// and its changes of frames.
pub(crate) fn image_items<'a>(
    pair: &Pair<'a>,
    (from, to): (TypeId, TypeId),
    chosen: ChosenPair<'a>,
) -> (Vec<Move>, Vec<Item>) {
    let mut image = Image::default();
    image.declared(pair, (from, to), chosen, 0);
    (image.moves.into_moves(), image.items)
}

/// The items up to byte `at`.
#[derive(Default)]
struct Image {
    items: Vec<Item>,
    at: usize,
    /// Marks of the structure that is converted as a whole.
    marks: Option<Marks>,
    moves: Moves,
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

    fn declared<'a>(
        &mut self,
        pair: &Pair<'a>,
        (from, to): (TypeId, TypeId),
        chosen: ChosenPair<'a>,
        offset: usize,
    ) {
        let (
            TypeDeclKind::Struct(one) | TypeDeclKind::Exception(one),
            TypeDeclKind::Struct(other) | TypeDeclKind::Exception(other),
        ) = (
            &pair.from.library.ty(from).kind,
            &pair.to.library.ty(to).kind,
        )
        else {
            return;
        };
        let whole = (Some(from), Some(to));
        if self.marks.as_ref().is_some_and(Marks::has) {
            self.members(pair, whole, (one, other), offset);
            return;
        }
        let outer = self.marks.take();
        let meaning = pair.meaning(from, to, chosen);
        let known = meaning.as_ref().and_then(Known::get);
        let is_identity = known.is_some_and(|meaning| meaning.is_identity);
        let open = self.moves.count();
        // The plan of the encoded message has the same changes, and already reports missing ones.
        let change = pair.changes((from, to), (one, other), meaning.as_ref(), &mut self.moves);
        self.marks = meaning.map(Marks::new);
        let start = self.items.len();
        self.members(pair, whole, (one, other), offset);
        let change = self.moves.close(open).and(change);
        let marks = std::mem::replace(&mut self.marks, outer);
        let Some(marks) = marks else {
            return;
        };
        let mut items = self.items.split_off(start);
        if is_identity {
            items.iter_mut().for_each(unmark);
            self.items.extend(items);
        } else {
            // The plan of the encoded message has the same numbers, and already reports missing
            // ones.
            let group = change.ok().and_then(|change| marks.group(items, change));
            self.items.extend(group);
        }
    }

    fn members(
        &mut self,
        pair: &Pair<'_>,
        whole: (Option<TypeId>, Option<TypeId>),
        (from, to): (&[Member], &[Member]),
        start: usize,
    ) {
        let mut offset = 0;
        let place = self.moves.place();
        let prefix = self.marks.as_ref().map_or(0, |marks| marks.prefix.len());
        for (one, other) in from.iter().zip(to) {
            let Some(layout) = pair.from.library.member_image(one) else {
                return;
            };
            offset = aligned(offset, layout.align);
            self.moves.enter(place, &one.name.text);
            let factor = between(one.unit.as_deref(), other.unit.as_deref());
            let at = start + offset;
            if let Some(marks) = &mut self.marks {
                marks.prefix.truncate(prefix);
                marks.prefix.push_str(&one.name.text);
                marks.prefix.push('.');
            }
            let chosen = (
                chosen(pair.from, whole.0, one),
                chosen(pair.to, whole.1, other),
            );
            if one.optional {
                self.bounded(pair, (&one.ty, &other.ty), 1, (factor, chosen), at);
            } else {
                self.value(pair, (&one.ty, &other.ty), (factor, chosen), at);
            }
            offset += layout.size;
        }
        self.moves.leave(place);
        if let Some(marks) = &mut self.marks {
            marks.prefix.truncate(prefix);
        }
    }

    /// The values of a type at a byte, which is a multiple of its alignment.
    fn value<'a>(
        &mut self,
        pair: &Pair<'a>,
        (from, to): (&Type, &Type),
        (factor, chosen): (Option<Factor>, ChosenPair<'a>),
        offset: usize,
    ) {
        let (from, to) = (
            pair.from.library.resolved(from),
            pair.to.library.resolved(to),
        );
        if let Some(item) = self.moves.take(from) {
            if let Item::KeptNumber(number, _) = item {
                self.skip_to(offset);
                self.at = offset + number.size();
                self.items.push(Item::KeptNumber(number, factor));
            }
            return;
        }
        if self.marks.as_ref().is_some_and(Marks::has)
            && let Some((array, number)) = numbers(pair.from.library, from)
        {
            self.skip_to(offset);
            let count = array.unwrap_or(1);
            if let Some(marks) = &mut self.marks {
                marks.take(array);
            }
            self.items.push(Item::Marked(count, number));
            self.at = offset + number.size() * count as usize;
            return;
        }
        match (from, to) {
            (Type::Primitive(number), _) => {
                if let (Some(own), Some(factor)) = (number.number(), factor) {
                    self.skip_to(offset);
                    self.items.push(Item::Numbers(1, own, Some(factor)));
                    self.at = offset + own.size();
                }
            }
            (
                Type::Array {
                    element: one,
                    length: count,
                },
                Type::Array { element: other, .. },
            ) => {
                let Some(element) = pair.from.library.image(one) else {
                    return;
                };
                let items = self.element_items(pair, (one, other), (factor, chosen), element);
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
            (
                Type::Sequence {
                    element: one,
                    bound,
                },
                Type::Sequence { element: other, .. },
            ) => {
                self.bounded(
                    pair,
                    (one, other),
                    bound.unwrap_or(0),
                    (factor, chosen),
                    offset,
                );
            }
            (Type::Named(one), Type::Named(other)) => {
                self.declared(pair, (*one, *other), chosen, offset);
            }
            (
                Type::Text { .. }
                | Type::Sequence { .. }
                | Type::Array { .. }
                | Type::Dictionary { .. }
                | Type::Named(_),
                _,
            ) => {}
        }
    }

    /// A length, and space for `bound` elements.
    fn bounded<'a>(
        &mut self,
        pair: &Pair<'a>,
        types: (&Type, &Type),
        bound: u32,
        factor: (Option<Factor>, ChosenPair<'a>),
        offset: usize,
    ) {
        let Some(element) = pair.from.library.image(types.0) else {
            return;
        };
        let items = self.element_items(pair, types, factor, element);
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

    /// The values of one element, with the bytes up to the next one.
    fn element_items<'a>(
        &mut self,
        pair: &Pair<'a>,
        types: (&Type, &Type),
        factor: (Option<Factor>, ChosenPair<'a>),
        element: Layout,
    ) -> Vec<Item> {
        let mut image = Image {
            moves: std::mem::take(&mut self.moves),
            ..Image::default()
        };
        image.moves.repeat();
        image.value(pair, types, factor, 0);
        if image.items.iter().any(Item::converts) {
            image.skip_to(element.size);
        }
        image.moves.repeated();
        self.moves = image.moves;
        image.items
    }
}
