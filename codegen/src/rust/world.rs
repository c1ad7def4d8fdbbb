//! Names and types of Rust for the world of a component: what `templates/rust/world.rs.tera` prints.

use super::handlers::Handler;
use super::names;
use super::worker_traits::WorkerTrait;
use crate::view;
use graph_language::model::Kind;
use serde::Serialize;
use std::collections::BTreeSet;

/// The trait with the handlers of changes.
pub(super) const TRAIT: &str = "WorldHandlers";

/// The names that the module of a world has for all schemas.
const OWN: [&str; 9] = [
    "Context",
    "Edit",
    "None",
    "Ok",
    "Overruled",
    "Some",
    TRAIT,
    "View",
    "World",
];
/// The functions of every type of nodes or edges that is changed, and those of traits that an
/// attribute would hide.
const FUNCTIONS: [&str; 8] = [
    "as_ref", "borrow", "clone", "deref", "edit", "id", "remove", "set_in",
];
/// The functions of traits that a type of nodes would hide.
const HIDDEN: [&str; 3] = ["clone", "cmp", "index"];

/// The world of a component.
#[derive(Debug, Serialize)]
pub(crate) struct World<'a> {
    /// The field of the context.
    pub(super) field: String,
    name: &'a str,
    domain: &'a str,
    /// The files of the schema: pairs of a name and a text.
    files: Vec<String>,
    /// The texts that do not come with the framework.
    texts: Vec<File>,
    /// The calls that add rights to none; empty for all rights.
    rights: Vec<String>,
    everything: bool,
    types: Vec<Type<'a>>,
    /// Whether a type is read.
    reads: bool,
    /// The numbers of the slots that publish.
    publishes: String,
    /// The functions of the trait, as the user's worker has them.
    #[serde(skip)]
    handlers: Vec<Handler>,
}

/// A file of a schema.
#[derive(Debug, Serialize)]
struct File {
    constant: String,
    /// A literal.
    text: String,
}

/// A type of nodes or edges.
#[derive(Debug, Serialize)]
struct Type<'a> {
    kind: &'a str,
    ty: String,
    edit: String,
    change: String,
    /// The function that finds one.
    function: String,
    /// The function of the trait.
    handler: String,
    add: String,
    remove: String,
    doc: Vec<String>,
    is_edge: bool,
    /// The arguments of an edge: where it starts and ends.
    from: String,
    to: String,
    /// Whether nodes have an attribute `name`.
    has_name: bool,
    is_written: bool,
    /// Whether the type or one of its attributes is set.
    is_changed: bool,
    is_read: bool,
    attributes: Vec<Attribute<'a>>,
}

#[derive(Debug, Serialize)]
struct Attribute<'a> {
    name: &'a str,
    doc: Vec<String>,
    text: &'a str,
    get: String,
    set: String,
    /// The type of its value, and the function that reads it.
    ty: String,
    read: String,
    /// The type of the argument that sets it, and the function that makes a value of it, if it
    /// needs one.
    argument: String,
    value: &'static str,
    is_written: bool,
}

pub(super) fn of(view: &view::Component) -> Option<World<'_>> {
    let world = view.world.as_ref()?;
    let mut taken: BTreeSet<String> = OWN.map(str::to_owned).into();
    let mut functions: BTreeSet<String> = HIDDEN.map(str::to_owned).into();
    let types = world.types.iter();
    let types: Vec<Type> = types
        .map(|of| one(of, &mut taken, &mut functions))
        .collect();
    let read = types.iter().filter(|of| of.is_read);
    let mut handlers: Vec<Handler> = read
        .map(|of| {
            let (name, change) = (&of.handler, &of.change);
            let signature =
                format!("fn {name}(&mut self, ctx: &mut Context, change: &world::{change})");
            Handler::optional(name.clone(), signature)
        })
        .collect();
    let overruled = "fn overruled(&mut self, ctx: &mut Context, value: &world::Overruled)";
    handlers.push(Handler::optional(
        "overruled".to_owned(),
        overruled.to_owned(),
    ));
    let slots = view.slots.iter().enumerate();
    let publishes =
        slots.filter(|(_, slot)| slot.of_world && slot.role == rc_vocabulary::Role::Publishes);
    Some(World {
        field: names::snake(&world.name),
        name: &world.name,
        domain: &world.domain,
        files: world.files.iter().enumerate().map(entry).collect(),
        texts: world.files.iter().enumerate().filter_map(file).collect(),
        rights: world.writes.iter().flatten().map(right).collect(),
        everything: world.writes.is_none(),
        publishes: publishes
            .map(|(at, _)| at.to_string())
            .collect::<Vec<_>>()
            .join(", "),
        handlers,
        reads: types.iter().any(|of| of.is_read),
        types,
    })
}

/// The trait that the worker implements.
pub(super) fn handlers(world: &mut World) -> WorkerTrait {
    WorkerTrait {
        name: TRAIT.to_owned(),
        generics: String::new(),
        operations: Vec::new(),
        optional: std::mem::take(&mut world.handlers),
        slot: None,
    }
}

fn entry((at, (name, text)): (usize, &(String, String))) -> String {
    if comes_with_framework(name, text) {
        format!("typed::domain({name:?})")
    } else {
        format!("({name:?}, FILE_{at})")
    }
}

fn file((at, (name, text)): (usize, &(String, String))) -> Option<File> {
    (!comes_with_framework(name, text)).then(|| File {
        constant: format!("FILE_{at}"),
        text: raw(text),
    })
}

fn comes_with_framework(name: &str, text: &str) -> bool {
    graph_language::DOMAINS.contains(&(name, text))
}

/// A text as a raw string.
fn raw(text: &str) -> String {
    let mut marks = "#".to_owned();
    while text.contains(&format!("\"{marks}")) {
        marks.push('#');
    }
    format!("r{marks}\"{text}\"{marks}")
}

fn right(write: &view::world::Written) -> String {
    let kind = &write.kind;
    match (&write.attribute, write.stream_ns) {
        (None, _) => format!("with_type({kind:?})"),
        (Some(attribute), None) => format!("with_attribute({kind:?}, {attribute:?})"),
        (Some(attribute), Some(ns)) => {
            format!("with_stream({kind:?}, {attribute:?}, ::std::time::Duration::from_nanos({ns}))")
        }
    }
}

fn one<'a>(
    of: &'a view::world::Type,
    taken: &mut BTreeSet<String>,
    functions: &mut BTreeSet<String>,
) -> Type<'a> {
    let ty = names::free(names::ty(&of.name), taken);
    let bare = ty.trim_end_matches('_');
    let edit = names::free(format!("{bare}Edit"), taken);
    let change = names::free(format!("{bare}Change"), taken);
    let function = names::free(names::local(&of.name), functions);
    let bare = function.trim_end_matches('_').to_owned();
    let mut own: BTreeSet<String> = FUNCTIONS.map(str::to_owned).into();
    let attributes = of.attributes.iter();
    let attributes: Vec<Attribute> = attributes.map(|of| attribute(of, &mut own)).collect();
    let [from, to] = of
        .ports
        .as_ref()
        .map_or_else(Default::default, |[from, to]| {
            let from = names::local(from);
            let mut taken: BTreeSet<String> = [from.clone()].into();
            let to = names::free(names::local(to), &mut taken);
            [from, to]
        });
    Type {
        kind: &of.name,
        edit,
        change,
        handler: names::free(format!("{bare}_changed"), functions),
        add: names::free(format!("add_{bare}"), functions),
        remove: names::free(format!("remove_{bare}"), functions),
        function,
        ty,
        doc: of.doc.clone(),
        is_edge: of.ports.is_some(),
        from,
        to,
        has_name: of.ports.is_none()
            && of
                .attributes
                .iter()
                .any(|own| own.name == "name" && own.kind == Kind::Text),
        is_written: of.is_written,
        is_changed: of.is_written || of.attributes.iter().any(|own| own.is_written),
        is_read: of.is_read,
        attributes,
    }
}

fn attribute<'a>(of: &'a view::world::Attribute, own: &mut BTreeSet<String>) -> Attribute<'a> {
    let get = names::free(names::snake(&of.name), own);
    let set = names::free(format!("set_{}", get.trim_end_matches('_')), own);
    let plain = |ty: &str, read: &str, argument: &str, value: &'static str| {
        (ty.to_owned(), read.to_owned(), argument.to_owned(), value)
    };
    let (ty, read, argument, value) = match &of.kind {
        Kind::Bool => plain("bool", "boolean", "bool", ""),
        Kind::Int => plain("i64", "integer", "i64", ""),
        Kind::Float => plain("f64", "number", "f64", ""),
        Kind::Text | Kind::Enum(_) => plain("&'s str", "text", "&str", ""),
        Kind::Bytes => plain("&'s [u8]", "bytes", "&[u8]", ""),
        Kind::Ints(_) => plain(
            "&'s [i64]",
            "integers",
            "&[i64]",
            ", typed::write::integers",
        ),
        Kind::Floats(Some(count)) => (
            format!("[f64; {count}]"),
            format!("numbers::<{count}>"),
            format!("[f64; {count}]"),
            "",
        ),
        Kind::Floats(None) | Kind::Block(_) => {
            plain("::std::borrow::Cow<'s, [f64]>", "all_numbers", "&[f64]", "")
        }
        Kind::Texts => plain(
            "&'s [::std::sync::Arc<str>]",
            "texts",
            "&[&str]",
            ", typed::write::texts",
        ),
        Kind::Topic(_) => plain("&'s typed::Sample", "sample", "typed::Sample", ""),
    };
    Attribute {
        name: &of.name,
        doc: of.doc.clone(),
        text: &of.text,
        get,
        set,
        ty,
        read,
        argument,
        value,
        is_written: of.is_written,
    }
}
