//! Lays a structure out: its fields with their gaps, its methods, and how a value gets into it and out again.

use super::{Method, Structure, name, path};
use crate::view::interfaces::bare;
use crate::view::{checks, doc, types};
use crate::{layout, names};
use rc_idsl::Library;
use rc_idsl::image::{self, Image};
use rc_idsl::model::{Member, ModuleId, Primitive, Type, TypeDeclKind, TypeId};
use rc_syntax::{Literal, LiteralKind};
use std::collections::{BTreeSet, HashMap};

/// A member, or what stands for one in a structure without a name.
pub(super) struct Part<'a> {
    pub(super) name: String,
    pub(super) ty: Type,
    pub(super) optional: bool,
    /// How messages call it.
    pub(super) what: String,
    /// The expression of its value in `set`.
    pub(super) source: String,
    /// Where its documentation, range and default come from.
    pub(super) member: Option<&'a Member>,
}

/// How far a structure is laid out.
struct Shape {
    at: u64,
    align: u64,
    gaps: usize,
    /// Names of fields that are taken.
    taken: BTreeSet<String>,
}

impl Shape {
    /// Makes room: the gap before it becomes a field.
    fn place(&mut self, view: &mut Structure, image: Image) {
        self.align = self.align.max(image.align);
        let gap = image::aligned(self.at, image.align) - self.at;
        if gap > 0 {
            let name = self.name(&format!("_gap{}", self.gaps));
            self.gaps += 1;
            view.field(&[], format!("{name}: [u8; {gap}]"));
        }
        self.at += gap + image.size;
    }

    /// A name that no field has.
    fn name(&mut self, wanted: &str) -> String {
        let mut name = wanted.to_owned();
        while !self.taken.insert(name.clone()) {
            name.push('_');
        }
        name
    }
}

pub(super) struct Maker<'a> {
    pub(super) library: &'a Library,
    pub(super) home: ModuleId,
    pub(super) done: Vec<Structure>,
    pub(super) known: HashMap<TypeId, Inside>,
}

/// What is in a value.
#[derive(Clone, Copy, Default)]
pub(super) struct Inside {
    /// Lengths, of sequences, texts and optional members: an old value must not shine through.
    lengths: bool,
    /// Numbers with a range.
    ranges: bool,
}

impl Maker<'_> {
    /// The structure of `parts`, and the expression of the value of each.
    pub(super) fn structure(
        &mut self,
        own: &str,
        value: &str,
        parts: &[Part],
    ) -> (Structure, Vec<String>) {
        let mut view = Structure::new(own, value, &format!("`{value}` in place."));
        let mut shape = Shape {
            at: 0,
            align: 1,
            gaps: 0,
            taken: parts.iter().map(|part| part.name.clone()).collect(),
        };
        let mut values = Vec::new();
        for part in parts {
            values.push(match &part.ty {
                ty if part.optional => self.sequence(own, part, ty, 1, &mut view, &mut shape),
                Type::Sequence(element, bound) => self.sequence(
                    own,
                    part,
                    element,
                    bound.unwrap_or(0),
                    &mut view,
                    &mut shape,
                ),
                Type::String(bound) => text(part, bound.unwrap_or(0), &mut view, &mut shape),
                ty => self.single(own, part, ty, &mut view, &mut shape),
            });
        }
        let end = Image {
            size: 0,
            align: shape.align,
            counted: false,
        };
        shape.place(&mut view, end);
        if view.check.iter().any(|line| line.contains("reader.")) {
            let reader = "let reader = Reader::new(&[]);".to_owned();
            view.check.insert(0, reader);
        }
        (view, values)
    }

    /// A member of which there is always one.
    fn single(
        &mut self,
        own: &str,
        part: &Part,
        ty: &Type,
        view: &mut Structure,
        shape: &mut Shape,
    ) -> String {
        let Part { name, source, .. } = part;
        let item = self.item(own, part, ty);
        if let Some(image) = self.library.image(ty) {
            shape.place(view, image);
        }
        view.field(&documentation(part), format!("pub {name}: {item}"));
        let default = part.member.and_then(|member| member.default.as_ref());
        if is_number(ty) {
            let default = default.map_or_else(
                || zero(ty).to_owned(),
                |literal| types::value(self.library, ty, literal, self.home),
            );
            view.reset.push(format!("self.{name} = {default};"));
            let assigned = format!("self.{name} = {source};");
            if 8 + assigned.len() > layout::LINE {
                view.set.push(format!("self.{name} ="));
                view.set.push(format!("    {source};"));
            } else {
                view.set.push(assigned);
            }
            if let Some(member) = part.member {
                let place = format!("self.{name}");
                view.check.extend(checks::lines(
                    self.library,
                    member,
                    &part.what,
                    &place,
                    checks::Side::Read,
                ));
            }
            return chain(part, &[format!(".{name}")]);
        }
        match default {
            Some(literal) => {
                let value = types::value(self.library, ty, literal, self.home);
                view.reset.push(format!("self.{name}.put({value});"));
            }
            None => view
                .reset
                .push(format!("InPlace::reset(&mut self.{name});")),
        }
        let args = [format!("&mut self.{name}"), borrowed(source)];
        view.set
            .extend(lines(&layout::call(8, "InPlace::set", &args, "?;")));
        if self.inside(ty).ranges {
            view.check.push(format!("InPlace::check(&self.{name})?;"));
        }
        format!("InPlace::value(&self.{name})?")
    }

    /// A member with a length: a sequence, or one that need not be there.
    fn sequence(
        &mut self,
        own: &str,
        part: &Part,
        element: &Type,
        bound: u32,
        view: &mut Structure,
        shape: &mut Shape,
    ) -> String {
        let Part {
            name,
            what,
            source,
            optional,
            ..
        } = part;
        let element = self.library.resolved(element).clone();
        let item = self.item(own, part, &element);
        let image = self.library.image(&element).unwrap_or(image::LENGTH);
        let length = counted(part, &item, bound, image, view, shape);
        let slice = format!("&[{item}]");
        let both = |borrow: &str| {
            [
                format!("{borrow} self.{name}").replace("& ", "&"),
                format!("self.{length}"),
            ]
        };
        let body = lines(&layout::call(8, "in_place::filled", &both("&"), ""));
        view.methods.push(Method {
            doc: documentation(part),
            signature: format!("pub fn {name}(&self) -> {slice} {{"),
            body,
        });
        let slice = format!("&mut [{item}]");
        let body = lines(&layout::call(8, "in_place::filled_mut", &both("&mut"), ""));
        view.method(
            &format!("`{name}`, to be changed."),
            &format!("{}_mut", bare(name)),
            &["&mut self"],
            &slice,
            body,
        );
        let args = [
            format!("{what:?}"),
            format!("&mut self.{name}"),
            format!("&mut self.{length}"),
            "length".to_owned(),
        ];
        // What has lengths inside must not bring old ones along.
        let fresh = self.inside(&element).lengths;
        let (doc, body) = if fresh {
            let items = ["items".to_owned()];
            let mut body = lines(&layout::binding(8, &items, "in_place::resize", &args, "?;"));
            body.push("items.iter_mut().for_each(InPlace::reset);".to_owned());
            body.push("Ok(items)".to_owned());
            ("Sets how many there are; they have their defaults.", body)
        } else {
            let body = lines(&layout::call(8, "in_place::resize", &args, ""));
            (
                "Sets how many there are; they hold what was there, so write all of them.",
                body,
            )
        };
        view.method(
            doc,
            &format!("resize_{}", bare(name)),
            &["&mut self", "length: usize"],
            &format!("Result<{slice}, EncodeError>"),
            body,
        );
        let ranged = part.member.is_some_and(|member| member.range.is_some());
        if self.inside(&element).ranges {
            let items = format!(".{name}()");
            let calls = [&items, ".iter()", ".try_for_each(InPlace::check)?"];
            let all = layout::chain(8, 0, "self", &calls);
            view.check.extend(lines(&format!("{all};")));
        } else if let Some(member) = part.member.filter(|_| *optional && ranged) {
            let place = format!("self.{name}().first().copied()");
            let side = checks::Side::Read;
            view.check
                .extend(checks::lines(self.library, member, what, &place, side));
        }
        view.reset.push(format!("self.{length} = 0;"));
        let source = if *optional {
            format!("{source}.as_slice()")
        } else {
            source.clone()
        };
        let items = ["items".to_owned()];
        let head = format!("self.resize_{}", bare(name));
        view.set.extend(lines(&layout::binding(
            8,
            &items,
            &head,
            &[format!("{source}.len()")],
            "?;",
        )));
        let items_of = if *optional { source } else { borrowed(&source) };
        if is_number(&element) {
            view.set.push(format!("items.copy_from_slice({items_of});"));
        } else {
            view.set
                .push(format!("in_place::set_all(items, {items_of})?;"));
        }
        match (optional, is_number(&element)) {
            (true, true) => chain(
                part,
                &[
                    format!(".{name}()"),
                    ".first()".to_owned(),
                    ".copied()".to_owned(),
                ],
            ),
            (true, false) => format!("in_place::first(self.{name}())?"),
            (false, true) => chain(part, &[format!(".{name}()"), ".to_vec()".to_owned()]),
            (false, false) => format!("in_place::values(self.{name}())?"),
        }
    }

    /// What is in a value of a type, however deep.
    fn inside(&mut self, ty: &Type) -> Inside {
        let ty = self.library.resolved(ty).clone();
        match &ty {
            Type::Primitive(_) | Type::Dictionary(..) => Inside::default(),
            Type::String(_) => Inside {
                lengths: true,
                ranges: false,
            },
            Type::Sequence(element, _) => Inside {
                lengths: true,
                ..self.inside(element)
            },
            Type::Array(element, _) => self.inside(element),
            Type::Named(id) => {
                if let Some(known) = self.known.get(id) {
                    return *known;
                }
                let mut found = Inside::default();
                if let TypeDeclKind::Struct(members) = &self.library.ty(*id).kind {
                    for member in members {
                        let inner = self.inside(&member.ty);
                        let number =
                            matches!(self.library.resolved(&member.ty), Type::Primitive(_));
                        found.lengths |= inner.lengths || member.optional;
                        found.ranges |= inner.ranges || (number && member.range.is_some());
                    }
                }
                self.known.insert(*id, found);
                found
            }
        }
    }

    /// A type in place, as a member or an element. What is counted and has no name gets one.
    fn item(&mut self, own: &str, part: &Part, ty: &Type) -> String {
        let ty = self.library.resolved(ty).clone();
        match &ty {
            Type::Primitive(Primitive::Bool) => "in_place::Bool".to_owned(),
            Type::Array(element, count) => format!("[{}; {count}]", self.item(own, part, element)),
            Type::Named(id) if self.library.ty(*id).module == self.home => name(self.library, *id),
            Type::Named(id) => path(self.library, *id),
            Type::String(_) | Type::Sequence(..) => {
                let member = part.name.trim_start_matches("r#");
                let own = format!("{own}{}Item", names::camel(member));
                let value = types::rust(self.library, &ty, self.home);
                let inner = Part {
                    name: "items".to_owned(),
                    ty,
                    optional: false,
                    what: part.what.clone(),
                    source: "value".to_owned(),
                    member: None,
                };
                let (mut structure, mut values) = self.structure(&own, &value, &[inner]);
                structure.owned =
                    vec![values.pop().map_or_else(
                        String::new,
                        |value| match value.strip_suffix('?') {
                            Some(result) => result.to_owned(),
                            None => format!("Ok({value})"),
                        },
                    )];
                let name = structure.name.clone();
                self.done.push(structure);
                name
            }
            Type::Primitive(_) | Type::Dictionary(..) => types::rust(self.library, &ty, self.home),
        }
    }
}

/// A member with a length of bytes.
fn text(part: &Part, bound: u32, view: &mut Structure, shape: &mut Shape) -> String {
    let Part {
        name, what, source, ..
    } = part;
    let byte = Image {
        size: 1,
        align: 1,
        counted: false,
    };
    let length = counted(part, "u8", bound, byte, view, shape);
    let bytes = format!("in_place::filled(&self.{name}, self.{length})");
    view.methods.push(Method {
        doc: documentation(part),
        signature: format!("pub fn {name}(&self) -> Result<&str, DecodeError> {{"),
        body: lines(&layout::call(8, "in_place::text", &[bytes], "")),
    });
    let set = |text: &str| {
        [
            format!("{what:?}"),
            format!("&mut self.{name}"),
            format!("&mut self.{length}"),
            text.to_owned(),
        ]
    };
    let body = lines(&layout::call(8, "in_place::set_text", &set("text"), ""));
    view.method(
        &format!("Sets `{name}`."),
        &format!("set_{}", bare(name)),
        &["&mut self", "text: &str"],
        "Result<(), EncodeError>",
        body,
    );
    view.reset.push(format!("self.{length} = 0;"));
    let default = part.member.and_then(|member| member.default.as_ref());
    if let Some(Literal {
        kind: LiteralKind::String(text),
        ..
    }) = default
    {
        // It was checked against its bound when the type was.
        view.reset.extend(lines(&layout::call(
            8,
            "let _ = in_place::set_text",
            &set(&format!("{text:?}")),
            ";",
        )));
    }
    let head = format!("self.set_{}", bare(name));
    view.set
        .extend(lines(&layout::call(8, &head, &[borrowed(source)], "?;")));
    chain(part, &[format!(".{name}()?"), ".to_owned()".to_owned()])
}

/// Places a length and room for `bound` elements; the result is the name of the length.
fn counted(
    part: &Part,
    item: &str,
    bound: u32,
    image: Image,
    view: &mut Structure,
    shape: &mut Shape,
) -> String {
    let length = shape.name(&format!("{}_length", bare(&part.name)));
    shape.place(view, image::LENGTH);
    view.field(&[], format!("{length}: u32"));
    shape.place(view, image.times(bound));
    view.field(&[], format!("{}: [{item}; {bound}]", part.name));
    length
}

/// The literal of a structure: rustfmt keeps one up to 18 characters on its line.
pub(super) fn literal(own: &str, parts: &[Part], values: &[String]) -> Vec<String> {
    let fields: Vec<String> = parts
        .iter()
        .zip(values)
        .map(|(part, value)| format!("{}: {value}", part.name))
        .collect();
    match fields.as_slice() {
        [] => vec![format!("Ok({own} {{}})")],
        [one] if one.len() <= 18 => vec![format!("Ok({own} {{ {one} }})")],
        _ => {
            let mut lines = vec![format!("Ok({own} {{")];
            for field in &fields {
                let field = format!("    {field},");
                lines.extend(field.lines().map(str::to_owned));
            }
            lines.push("})".to_owned());
            lines
        }
    }
}

fn documentation(part: &Part) -> Vec<String> {
    part.member.map_or_else(
        || layout::doc(&["What there is.".to_owned()]),
        |member| {
            doc(
                &member.doc,
                member.unit.as_ref(),
                checks::range_text(member).as_ref(),
            )
        },
    )
}

/// The reference to a value: the whole one is a reference already.
fn borrowed(source: &str) -> String {
    if source == "value" {
        source.to_owned()
    } else {
        format!("&{source}")
    }
}

/// Whether it is copied as it is.
fn is_number(ty: &Type) -> bool {
    matches!(ty, Type::Primitive(primitive) if *primitive != Primitive::Bool)
}

fn zero(ty: &Type) -> &'static str {
    match ty {
        Type::Primitive(primitive) if primitive.is_float() => "0.0",
        _ => "0",
    }
}

/// An expression in the literal of a structure; what is too long has a line for each call.
fn chain(part: &Part, calls: &[String]) -> String {
    let calls: Vec<&str> = calls.iter().map(String::as_str).collect();
    let text = layout::chain(12, part.name.len() + 2, "self", &calls);
    text.replace("\n        ", "\n")
}

/// A statement that was laid out eight spaces deep, as lines without that.
fn lines(text: &str) -> Vec<String> {
    text.lines()
        .map(|line| line.strip_prefix("        ").unwrap_or(line).to_owned())
        .collect()
}
