//! Names and types of Rust for the world of a component: what `templates/rust/world.rs.tera` prints.

use super::handlers::Handler;
use super::names;
use super::worker_traits::WorkerTrait;
use crate::view;
use crate::world::World as Files;
use crate::world_types::{self, Declarations, Spelling};
use graph_language::model::Kind;
use serde::Serialize;

/// The trait with the handlers of changes.
pub(super) const TRAIT: &str = "WorldHandlers";

const SPELLING: Spelling = Spelling {
    ty: names::ty,
    function: names::local,
    attribute: names::snake,
    argument: names::local,
    types: &[
        "Context",
        "Edit",
        "None",
        "Ok",
        "Overruled",
        "Sample",
        "Some",
        TRAIT,
        "View",
        "World",
    ],
    // Those of traits that a type of nodes would hide.
    functions: &["clone", "cmp", "index"],
    // Those of traits that an attribute would hide are among them.
    members: &[
        "as_ref", "borrow", "clone", "deref", "edit", "id", "remove", "set_in",
    ],
    arguments: &[],
    documentation: |text| format!("`{text}`"),
    has_setters: true,
};

type Type<'a> = world_types::Type<'a, Documentation<'a>, Attribute<'a>>;
type Query<'a> = world_types::Query<'a, Parameter>;

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
    /// The types of geometry, which the library has, each as the module exports it.
    geometry: Vec<String>,
    queries: Vec<Query<'a>>,
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

/// Additions of Rust to a type of nodes or edges.
#[derive(Debug, Serialize)]
struct Documentation<'a> {
    doc: &'a [String],
    /// Whether the library has the type.
    is_of_geometry: bool,
}

/// Additions of Rust to an attribute.
#[derive(Clone, Debug, Serialize)]
struct Attribute<'a> {
    doc: &'a [String],
    text: &'a str,
    /// The type of its value, and the function that reads it.
    ty: String,
    read: String,
    /// The type of the argument that sets it, and the function that makes a value of it, if it
    /// needs one.
    argument: String,
    value: &'static str,
}

/// The type of an argument of a query, and the function that makes a value of it.
#[derive(Debug, Serialize)]
struct Parameter {
    ty: &'static str,
    make: &'static str,
}

/// The world of any network: what `templates/rust/any_world.rs.tera` prints.
#[derive(Debug, Serialize)]
pub(crate) struct AnyWorld<'a> {
    name: &'a str,
    /// The calls that add rights to none.
    rights: Vec<String>,
    everything: bool,
}

pub(super) fn any(view: &view::Component) -> Option<AnyWorld<'_>> {
    let world = view.any_world.as_ref()?;
    Some(AnyWorld {
        name: &world.name,
        rights: world.writes.iter().flatten().map(right).collect(),
        everything: world.writes.is_none(),
    })
}

pub(super) fn of(view: &view::Component) -> Option<World<'_>> {
    let world = view.world.as_ref()?;
    let Declarations { types, queries } =
        world_types::of(world, &SPELLING, documentation, attribute, parameter);
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
        geometry: types.iter().filter_map(exported).collect(),
        types,
        queries,
    })
}

/// `Frame`, or `Frame as Frame_` if the module has another type of this name.
fn exported(of: &Type) -> Option<String> {
    let name = names::ty(of.kind);
    of.own.is_of_geometry.then(|| {
        if name == of.ty {
            name
        } else {
            format!("{name} as {}", of.ty)
        }
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

fn entry((at, file): (usize, &(String, String))) -> String {
    let name = &file.0;
    if Files::comes_with_framework(file) {
        format!("typed::domain({name:?})")
    } else {
        format!("({name:?}, FILE_{at})")
    }
}

fn file((at, file): (usize, &(String, String))) -> Option<File> {
    (!Files::comes_with_framework(file)).then(|| File {
        constant: format!("FILE_{at}"),
        text: raw(&file.1),
    })
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

fn documentation(of: &view::world::Type) -> Documentation<'_> {
    Documentation {
        doc: &of.doc,
        is_of_geometry: of.is_of_geometry,
    }
}

fn parameter(kind: view::world::Parameter) -> Parameter {
    use view::world::Parameter as Kinds;
    let (ty, make) = match kind {
        Kinds::Bool => ("bool", "plain"),
        Kinds::Int => ("i64", "plain"),
        Kinds::Float => ("f64", "plain"),
        Kinds::Text => ("&str", "plain"),
        Kinds::Bytes => ("&[u8]", "bytes"),
        Kinds::Pose => ("[f64; 6]", "pose"),
        Kinds::Node => ("impl typed::End", "node"),
    };
    Parameter { ty, make }
}

fn attribute(of: &view::world::Attribute) -> Attribute<'_> {
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
        doc: &of.doc,
        text: &of.text,
        ty,
        read,
        argument,
        value,
    }
}
