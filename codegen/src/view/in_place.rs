//! The layout of values of plain types in shared memory, see `rc_vocabulary::layout`. Every gap of
//! the layout has a number of bytes here, so that a printed structure leaves no byte without a
//! member.

use super::checks::{self, Check};
use super::members::{self, member};
use super::types::{Type, of_type};
use rc_idsl::Library;
use rc_idsl::model::{self, Member, TypeDeclKind, TypeId};
use rc_vocabulary::Primitive;
use rc_vocabulary::layout::{self, Layout};
use serde::Serialize;
use std::collections::HashMap;

/// A structure in shared memory.
#[derive(Debug, Serialize)]
pub struct Structure {
    /// The named type, then the members that lead from it to a sequence or a text without a name of
    /// its own.
    pub path: Vec<String>,
    /// The type of its values.
    pub value: Type,
    /// Whether it is the number of an enumerator.
    pub number: bool,
    /// The members, in order.
    pub parts: Vec<Part>,
    /// Bytes of the gap after the last part.
    pub gap: usize,
}

/// A member of such a structure.
#[derive(Debug, Serialize)]
pub struct Part {
    /// The member of the named type; none in a structure without a name.
    pub member: Option<members::Member>,
    /// Bytes of the gap before it.
    pub gap: usize,
    /// For a sequence, a text and an optional member, which begin with their length as a uint32.
    pub room: Option<Room>,
    /// Type of the elements, or of the only one.
    pub item: Item,
    /// Checks of a reader.
    pub checks: Vec<Check>,
    /// Whether elements hold lengths, which must not survive in a slot that is used again.
    pub has_lengths: bool,
    /// Whether elements hold numbers with a range.
    pub has_ranges: bool,
}

/// The room for the elements of a part.
#[derive(Debug, Serialize)]
pub struct Room {
    /// Bytes of the gap between the length and the elements.
    pub gap: usize,
    /// The number of elements that it can hold.
    pub bound: u32,
}

/// Content of a part.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Item {
    /// A number as it is.
    Number {
        /// Its type.
        name: Primitive,
    },
    /// A `bool` in one byte.
    Bool,
    /// The bytes of a text.
    Bytes,
    /// A fixed number of items.
    Array {
        /// Type of the elements.
        element: Box<Item>,
        /// How many.
        length: u32,
    },
    /// A structure of a named type.
    Named {
        /// The module of this type.
        module: String,
        /// Name in the IDSL.
        name: String,
    },
    /// A structure without a name of its own.
    Unnamed {
        /// Members that lead to the structure.
        path: Vec<String>,
    },
}

/// Contents of the types examined so far.
pub(crate) type Known = HashMap<TypeId, Inside>;

/// Contents of the values of a type.
#[derive(Clone, Copy, Default)]
pub(crate) struct Inside {
    /// Lengths, of sequences, texts and optional members.
    lengths: bool,
    /// Numbers with a range.
    ranges: bool,
}

/// The structures of a type, each after those that it contains.
pub(crate) fn of(library: &Library, id: TypeId, known: &mut Known) -> Vec<Structure> {
    let decl = library.ty(id);
    let fits = decl.image.is_some_and(rc_vocabulary::Layout::fits);
    if !fits {
        return Vec::new();
    }
    let path = vec![decl.name.text.clone()];
    let value = of_type(library, &model::Type::Named(id));
    match &decl.kind {
        TypeDeclKind::Struct(members) => {
            let parts: Vec<Source> = members
                .iter()
                .map(|member| Source {
                    member: Some(member),
                    ty: library.resolved(&member.ty),
                    optional: member.optional,
                })
                .collect();
            let mut done = Vec::new();
            let structure = structure(library, path, value, &parts, &mut done, known);
            done.push(structure);
            done
        }
        TypeDeclKind::Enum(_) => vec![Structure {
            path,
            value,
            number: true,
            parts: Vec::new(),
            gap: 0,
        }],
        TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => Vec::new(),
    }
}

/// The source of a part.
struct Source<'a> {
    member: Option<&'a Member>,
    ty: &'a model::Type,
    optional: bool,
}

fn structure(
    library: &Library,
    path: Vec<String>,
    value: Type,
    sources: &[Source],
    done: &mut Vec<Structure>,
    known: &mut Known,
) -> Structure {
    let (mut at, mut align) = (0, 1);
    let mut place = |image: Layout| {
        align = align.max(image.align);
        let gap = layout::aligned(at, image.align) - at;
        at += gap + image.size;
        gap
    };
    let mut parts = Vec::new();
    for source in sources {
        let bytes = model::Type::Primitive(Primitive::U8);
        let (element, bound) = match source.ty {
            ty if source.optional => (ty, Some(1)),
            model::Type::Sequence { element, bound } => (library.resolved(element), *bound),
            model::Type::Text { bound } => (&bytes, *bound),
            ty @ (model::Type::Primitive(_)
            | model::Type::Array { .. }
            | model::Type::Dictionary { .. }
            | model::Type::Named(_)) => (ty, None),
        };
        let image = library.image(element).unwrap_or(Layout::LENGTH);
        let (gap, room) = match bound {
            None => (place(image), None),
            Some(bound) => {
                let gap = place(Layout::LENGTH);
                let room = Room {
                    gap: place(image.times(bound)),
                    bound,
                };
                (gap, Some(room))
            }
        };
        let mut of_member = path.clone();
        of_member.push(match source.member {
            Some(member) => member.name.text.clone(),
            None => "items".to_owned(),
        });
        let is_text = !source.optional && matches!(source.ty, model::Type::Text { .. });
        let item = if is_text {
            Item::Bytes
        } else {
            item(library, of_member, element, done, known)
        };
        let inside = inside(library, element, known);
        parts.push(Part {
            gap,
            room,
            item,
            checks: source
                .member
                .map(|member| checks::of_number(library, member))
                .unwrap_or_default(),
            member: source.member.map(|m| member(library, m)),
            has_lengths: inside.lengths,
            has_ranges: inside.ranges,
        });
    }
    let gap = layout::aligned(at, align) - at;
    Structure {
        path,
        value,
        number: false,
        parts,
        gap,
    }
}

/// A type as an element or a member. A sequence or a text in it gets a structure of its own.
fn item(
    library: &Library,
    path: Vec<String>,
    ty: &model::Type,
    done: &mut Vec<Structure>,
    known: &mut Known,
) -> Item {
    match library.resolved(ty) {
        model::Type::Primitive(Primitive::Bool) => Item::Bool,
        model::Type::Primitive(primitive) => Item::Number { name: *primitive },
        model::Type::Array { element, length } => Item::Array {
            element: Box::new(item(library, path, element, done, known)),
            length: *length,
        },
        model::Type::Named(id) => {
            let decl = library.ty(*id);
            Item::Named {
                module: library.module(decl.module).name.text.clone(),
                name: decl.name.text.clone(),
            }
        }
        // A dictionary has no image, so it does not occur here.
        ty @ (model::Type::Text { .. }
        | model::Type::Sequence { .. }
        | model::Type::Dictionary { .. }) => {
            let source = Source {
                member: None,
                ty,
                optional: false,
            };
            let value = of_type(library, ty);
            let structure = structure(library, path.clone(), value, &[source], done, known);
            done.push(structure);
            Item::Unnamed { path }
        }
    }
}

fn inside(library: &Library, ty: &model::Type, known: &mut Known) -> Inside {
    match library.resolved(ty) {
        model::Type::Primitive(_) | model::Type::Dictionary { .. } => Inside::default(),
        model::Type::Text { .. } => Inside {
            lengths: true,
            ranges: false,
        },
        model::Type::Sequence { element, .. } => Inside {
            lengths: true,
            ..inside(library, element, known)
        },
        model::Type::Array { element, .. } => inside(library, element, known),
        model::Type::Named(id) => {
            if let Some(inside) = known.get(id) {
                return *inside;
            }
            let mut found = Inside::default();
            if let TypeDeclKind::Struct(members) = &library.ty(*id).kind {
                for member in members {
                    let inner = inside(library, &member.ty, known);
                    let number = matches!(library.resolved(&member.ty), model::Type::Primitive(_));
                    found.lengths |= inner.lengths || member.optional;
                    found.ranges |= inner.ranges || (number && member.range.is_some());
                }
            }
            known.insert(*id, found);
            found
        }
    }
}
