//! Names and types of Python for the world of a component: what `templates/python/world.py.tera` prints.

use super::{documentation, layout, names};
use crate::view;
use graph_language::model::Kind;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// The names that the module of a world has for all schemas.
const OWN: [&str; 8] = [
    "Edit", "FILES", "READS", "RIGHTS", "View", "World", "World_", "_shared",
];
/// Members of every class of nodes or edges, and of what changes one.
const MEMBERS: [&str; 12] = [
    "IS_EDGE", "KIND", "element", "end", "get", "id", "remove", "set", "start", "type", "_edit",
    "_of",
];
/// Functions of every view and every change.
const FUNCTIONS: [&str; 12] = [
    "add_edge", "add_node", "all", "edge", "graph", "node", "token", "_end", "_one", "_edge",
    "_new", "_between",
];

/// The world of a component.
#[derive(Debug, Serialize)]
pub(crate) struct World<'a> {
    /// The field of the context.
    field: String,
    domain: &'a str,
    /// Names and texts of the files of the schema, as literals.
    files: Vec<[String; 2]>,
    /// Literals of what it writes.
    rights: Vec<String>,
    everything: bool,
    types: Vec<Type<'a>>,
    handlers: Vec<Handler>,
    /// Numbers of slots as literals.
    publishes: String,
    receives: String,
}

#[derive(Debug, Serialize)]
struct Handler {
    name: String,
    kind: String,
    class: String,
    signature: String,
}

/// A type of nodes or edges.
#[derive(Debug, Serialize)]
struct Type<'a> {
    kind: &'a str,
    class: String,
    edit: String,
    change: String,
    /// The function that finds one, and the one that adds one.
    function: String,
    add: String,
    doc: String,
    is_edge: bool,
    from: String,
    to: String,
    has_name: bool,
    is_written: bool,
    is_changed: bool,
    is_read: bool,
    attributes: Vec<Attribute<'a>>,
}

#[derive(Debug, Serialize)]
struct Attribute<'a> {
    name: &'a str,
    member: String,
    /// The type of its value, and of what sets it.
    ty: String,
    argument: String,
    doc: String,
    is_written: bool,
}

pub(super) fn of(view: &view::Component) -> Option<World<'_>> {
    let world = view.world.as_ref()?;
    let mut classes: BTreeSet<String> = OWN.map(str::to_owned).into();
    let mut functions: BTreeSet<String> = FUNCTIONS.map(str::to_owned).into();
    let types = world.types.iter();
    let types: Vec<Type> = types
        .map(|of| one(of, &mut classes, &mut functions))
        .collect();
    let read = types.iter().filter(|of| of.is_read);
    let handlers = read.map(|of| {
        let name = format!("{}_changed", of.function.trim_end_matches('_'));
        let arguments = ["self", "ctx: Context"].map(str::to_owned);
        let change = format!("change: _world.{}", of.change);
        let arguments: Vec<String> = arguments.into_iter().chain([change]).collect();
        Handler {
            signature: layout::call(4, &format!("def {name}"), &arguments, " -> None:"),
            kind: of.kind.to_owned(),
            class: of.class.clone(),
            name,
        }
    });
    let slots = view.slots.iter().enumerate();
    let slots = slots.filter(|(_, slot)| slot.of_world);
    let of_role = |role: Role| {
        let slots = slots.clone().filter(move |(_, slot)| slot.role == role);
        slots.map(|(at, slot)| (at, slot.interface == "WorldStream"))
    };
    let publishes: Vec<String> = of_role(Role::Publishes)
        .map(|(at, _)| at.to_string())
        .collect();
    let receives = of_role(Role::SubscribesTo);
    let receives: Vec<String> = receives
        .map(|(at, is_stream)| format!("({at}, {})", if is_stream { "True" } else { "False" }))
        .collect();
    Some(World {
        field: names::snake(&world.name),
        domain: &world.domain,
        files: world
            .files
            .iter()
            .map(|(name, text)| [literal(name), lines(text)])
            .collect(),
        rights: world.writes.iter().flatten().map(right).collect(),
        everything: world.writes.is_none(),
        handlers: handlers.collect(),
        types,
        publishes: format!("({})", publishes.join(", ")),
        receives: format!("({})", receives.join(", ")),
    })
}

/// A text as a literal of Python. JSON has the same escapes.
fn literal(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}

/// A text of several lines as literals, one a line.
fn lines(text: &str) -> String {
    let lines = text.split_inclusive('\n').map(literal);
    let lines: Vec<String> = lines.map(|line| format!("        {line}")).collect();
    format!("(\n{}\n        )", lines.join("\n"))
}

fn right(write: &view::world::Written) -> String {
    let attribute = write
        .attribute
        .as_deref()
        .map_or_else(|| "None".to_owned(), literal);
    let stream = write
        .stream_ns
        .map_or_else(|| "None".to_owned(), |ns| ns.to_string());
    format!("({}, {attribute}, {stream})", literal(&write.kind))
}

/// A name that is not taken yet.
fn free(mut name: String, taken: &mut BTreeSet<String>) -> String {
    while taken.contains(&name) {
        name.push('_');
    }
    taken.insert(name.clone());
    name
}

fn one<'a>(
    of: &'a view::world::Type,
    classes: &mut BTreeSet<String>,
    functions: &mut BTreeSet<String>,
) -> Type<'a> {
    let class = free(names::class(&of.name), classes);
    let bare = class.trim_end_matches('_').to_owned();
    let function = free(names::member(&of.name), functions);
    let mut members: BTreeSet<String> = MEMBERS.map(str::to_owned).into();
    let attributes = of.attributes.iter();
    let attributes: Vec<Attribute> = attributes.map(|own| attribute(own, &mut members)).collect();
    let [from, to] = of
        .ports
        .as_ref()
        .map_or_else(Default::default, |[from, to]| {
            let from = names::parameter(from);
            let mut taken: BTreeSet<String> = [from.clone(), "self".to_owned()].into();
            [from, free(names::parameter(to), &mut taken)]
        });
    let what = if of.ports.is_some() {
        "An edge"
    } else {
        "A node"
    };
    Type {
        kind: &of.name,
        edit: free(format!("{bare}Edit"), classes),
        change: free(format!("{bare}Change"), classes),
        add: free(format!("add_{}", function.trim_end_matches('_')), functions),
        function,
        class,
        doc: documentation::docstring_or(4, &of.doc, format!("{what} of the type `{}`.", of.name)),
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

fn attribute<'a>(of: &'a view::world::Attribute, members: &mut BTreeSet<String>) -> Attribute<'a> {
    let (ty, argument) = match &of.kind {
        Kind::Bool => ("bool", "bool"),
        Kind::Int => ("int", "int"),
        Kind::Float => ("float", "float"),
        Kind::Text | Kind::Enum(_) => ("str", "str"),
        Kind::Bytes => ("bytes", "bytes"),
        Kind::Ints(_) => ("list[int]", "_abc.Sequence[int]"),
        Kind::Floats(_) | Kind::Block(_) => ("list[float]", "_abc.Sequence[float]"),
        Kind::Texts => ("list[str]", "_abc.Sequence[str]"),
        Kind::Topic(_) => ("_typing.Any", "_typing.Any"),
    };
    let mut doc = of.doc.clone();
    doc.push(format!("`{}`. `None` if it has no value.", of.text));
    Attribute {
        name: &of.name,
        member: free(names::member(&of.name), members),
        ty: ty.to_owned(),
        argument: argument.to_owned(),
        doc: documentation::docstring(8, &doc),
        is_written: of.is_written,
    }
}
