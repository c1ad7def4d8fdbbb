//! The structures of types that travel in place, see `rc_middleware::in_place`. Every gap of the layout is a member
//! of its own, so that no byte of one is without meaning.

use super::interfaces::bare;
use super::{checks, types};
use crate::{layout, names};
use rc_cdsl::Component;
use rc_cdsl::model::Role;
use rc_idsl::Library;
use rc_idsl::image::{self, Image};
use rc_idsl::model::{Member, ModuleId, Primitive, Type, TypeDeclKind, TypeId};
use rc_syntax::{Literal, LiteralKind, Name};
use serde::Serialize;
use std::collections::{BTreeSet, HashMap};

/// One structure.
#[derive(Debug, Serialize)]
pub struct Structure {
    /// Its name.
    pub name: String,
    /// The type that owns its values.
    pub value: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its fields, in their order.
    pub fields: Vec<Field>,
    /// Its methods: documentation, signature and body.
    pub methods: Vec<Method>,
    /// The body of `reset`.
    pub reset: Vec<String>,
    /// The body of `set`.
    pub set: Vec<String>,
    /// The expression of its value.
    pub owned: Vec<String>,
    /// The body of `check`, where there is something to be checked.
    pub check: Vec<String>,
    /// Whether it is a number that stands for a value of the enum `value`.
    pub number: bool,
}

/// One field.
#[derive(Debug, Serialize)]
pub struct Field {
    /// Its documentation.
    pub doc: Vec<String>,
    /// `pub name: Type`
    pub text: String,
}

/// One method.
#[derive(Debug, Serialize)]
pub struct Method {
    /// Its documentation.
    pub doc: Vec<String>,
    /// `pub fn …(&self) -> … {`
    pub signature: String,
    /// Its statements.
    pub body: Vec<String>,
}

/// The name of the structure of a type.
pub(super) fn name(library: &Library, id: TypeId) -> String {
    format!("{}InPlace", names::ty(&library.ty(id).name.text))
}

/// The same, with its module.
pub(super) fn path(library: &Library, id: TypeId) -> String {
    let module = super::type_module(library, library.ty(id).module);
    format!("{module}::{}", name(library, id))
}

/// The types that a component needs in place, with all that is in them.
pub(super) fn needed(component: &Component) -> BTreeSet<TypeId> {
    let library = &component.library;
    let mut needed = BTreeSet::new();
    for slot in &component.slots {
        for operation in &library.interface(slot.interface).operations {
            let root = match slot.role {
                Role::Publishes | Role::SubscribesTo => operation.topic_in_place(library),
                Role::Requires | Role::Implements if super::two_way(slot.role, operation) => {
                    operation.result_in_place(library)
                }
                Role::Requires | Role::Implements => None,
            };
            root.into_iter()
                .for_each(|id| reach(library, id, &mut needed));
        }
    }
    needed
}

fn reach(library: &Library, id: TypeId, out: &mut BTreeSet<TypeId>) {
    let mut next = vec![id];
    while let Some(id) = next.pop() {
        if matches!(library.ty(id).kind, TypeDeclKind::Alias(_)) || out.insert(id) {
            next.extend(library.named_in(id));
        }
    }
}

/// The methods that the structure of a type gets, each with the member that it is of.
pub(super) fn methods(library: &Library, id: TypeId) -> Vec<(&Name, String)> {
    let TypeDeclKind::Struct(members) = &library.ty(id).kind else {
        return Vec::new();
    };
    let of = |member: &Member| {
        let name = names::snake(&member.name.text);
        let short = bare(&name).to_owned();
        match library.resolved(&member.ty) {
            ty if member.optional || matches!(ty, Type::Sequence(..)) => {
                vec![name, format!("{short}_mut"), format!("resize_{short}")]
            }
            Type::Text(_) => vec![name, format!("set_{short}")],
            _ => Vec::new(),
        }
    };
    let all = members
        .iter()
        .flat_map(|m| of(m).into_iter().map(|method| (&m.name, method)));
    all.collect()
}

/// The structures of one type: first those of what is nested in it without a name.
pub(super) fn of(library: &Library, home: ModuleId, id: TypeId) -> Vec<Structure> {
    let decl = library.ty(id);
    let own = names::ty(&decl.name.text);
    match &decl.kind {
        TypeDeclKind::Struct(members) => {
            let parts: Vec<Part> = members
                .iter()
                .map(|member| {
                    let name = names::snake(&member.name.text);
                    Part {
                        ty: library.resolved(&member.ty).clone(),
                        optional: member.optional,
                        what: format!("{own}.{}", member.name.text),
                        source: format!("value.{name}"),
                        member: Some(member),
                        name,
                    }
                })
                .collect();
            let mut maker = Maker {
                library,
                home,
                done: Vec::new(),
                known: HashMap::new(),
            };
            let (mut structure, values) = maker.structure(&own, &own, &parts);
            structure.owned = literal(&own, &parts, &values);
            maker.done.push(structure);
            maker.done
        }
        TypeDeclKind::Enum(_) => {
            let doc = format!("`{own}` in place: a number, until somebody asks.");
            let mut structure = Structure::new(&own, &own, &doc);
            structure.number = true;
            vec![structure]
        }
        TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => Vec::new(),
    }
}

impl Structure {
    fn new(own: &str, value: &str, doc: &str) -> Self {
        Self {
            name: format!("{own}InPlace"),
            value: value.to_owned(),
            doc: layout::doc(&[doc.to_owned()]),
            fields: Vec::new(),
            methods: Vec::new(),
            reset: Vec::new(),
            set: Vec::new(),
            owned: Vec::new(),
            check: Vec::new(),
            number: false,
        }
    }

    /// Whether it mentions the module `in_place`; what has a length does, and what has a `bool`.
    pub(super) fn has_helpers(&self) -> bool {
        !self.methods.is_empty() || self.fields.iter().any(|f| f.text.contains("in_place::"))
    }

    fn field(&mut self, doc: &[String], text: String) {
        let doc = doc.to_vec();
        self.fields.push(Field { doc, text });
    }

    fn method(&mut self, doc: &str, head: &str, args: &[&str], returns: &str, body: Vec<String>) {
        let args: Vec<String> = args.iter().map(|arg| (*arg).to_owned()).collect();
        self.methods.push(Method {
            doc: layout::doc(&[doc.to_owned()]),
            signature: layout::signature(
                4,
                &format!("pub fn {head}"),
                &args,
                &format!(" -> {returns} {{"),
            ),
            body,
        });
    }
}

/// A member, or what stands for one in a structure without a name.
struct Part<'a> {
    name: String,
    ty: Type,
    optional: bool,
    /// How messages call it.
    what: String,
    /// The expression of its value in `set`.
    source: String,
    /// Where its documentation, range and default come from.
    member: Option<&'a Member>,
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

struct Maker<'a> {
    library: &'a Library,
    home: ModuleId,
    done: Vec<Structure>,
    known: HashMap<TypeId, Inside>,
}

/// What is in a value.
#[derive(Clone, Copy, Default)]
struct Inside {
    /// Lengths, of sequences, texts and optional members: an old value must not shine through.
    lengths: bool,
    /// Numbers with a range.
    ranges: bool,
}

impl Maker<'_> {
    /// The structure of `parts`, and the expression of the value of each.
    fn structure(&mut self, own: &str, value: &str, parts: &[Part]) -> (Structure, Vec<String>) {
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
                Type::Text(bound) => text(part, bound.unwrap_or(0), &mut view, &mut shape),
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
            Type::Text(_) => Inside {
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
            Type::Text(_) | Type::Sequence(..) => {
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
        kind: LiteralKind::Text(text),
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
fn literal(own: &str, parts: &[Part], values: &[String]) -> Vec<String> {
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
            super::doc(
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
