//! Names and types of Python for the world of a component: what `templates/python/world.py.tera` prints.

use super::{documentation, layout, names};
use crate::view;
use crate::world_types::{self, Declarations, Spelling};
use graph_language::model::Kind;
use rc_vocabulary::Role;
use serde::Serialize;

const SPELLING: Spelling = Spelling {
    ty: names::class,
    function: names::member,
    attribute: names::member,
    argument: names::parameter,
    types: &[
        "Edit", "FILES", "READS", "RIGHTS", "View", "World", "World_", "_shared",
    ],
    functions: &[
        "add_edge", "add_node", "all", "edge", "graph", "node", "token", "_end", "_one", "_edge",
        "_new", "_between", "_query",
    ],
    members: &[
        "IS_EDGE", "KIND", "element", "end", "get", "id", "remove", "set", "start", "type",
        "_edit", "_of",
    ],
    arguments: &["self"],
    documentation: |text| documentation::docstring(8, &[format!("`{text}`")]),
    has_setters: false,
};

type Type<'a> = world_types::Type<'a, Documentation, Attribute>;
type Query<'a> = world_types::Query<'a, Parameter>;

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
    queries: Vec<Query<'a>>,
    handlers: Vec<Handler>,
    /// Numbers of slots as literals.
    publishes: String,
    receives: String,
}

/// The type of an argument of a query, and what makes a value of it.
#[derive(Debug, Serialize)]
struct Parameter {
    ty: &'static str,
    make: &'static str,
}

#[derive(Debug, Serialize)]
struct Handler {
    name: String,
    kind: String,
    class: String,
    signature: String,
}

/// Additions of Python to a type of nodes or edges.
#[derive(Debug, Serialize)]
struct Documentation {
    doc: String,
}

/// Additions of Python to an attribute: the type of its value, and that of its setter.
#[derive(Clone, Debug, Serialize)]
struct Attribute {
    ty: &'static str,
    argument: &'static str,
    doc: String,
}

impl World<'_> {
    /// Whether the worker has handlers of changes.
    pub(super) fn reads(&self) -> bool {
        !self.handlers.is_empty()
    }

    /// The functions that the worker may have, each with its argument and the type of that.
    pub(super) fn hooks(&self) -> impl Iterator<Item = (&str, [(&str, &str); 1])> {
        let changes = self.handlers.iter();
        let changes = changes.map(|of| (of.name.as_str(), [("change", of.class.as_str())]));
        changes.chain([("overruled", [("value", "Overruled")])])
    }
}

pub(super) fn of(view: &view::Component) -> Option<World<'_>> {
    let world = view.world.as_ref()?;
    let Declarations { types, queries } =
        world_types::of(world, &SPELLING, documentation, attribute, parameter);
    let read = types.iter().filter(|of| of.is_read);
    let handlers = read.map(|of| {
        let name = of.handler.clone();
        let arguments = ["self", "ctx: Context"].map(str::to_owned);
        let change = format!("change: _world.{}", of.change);
        let arguments: Vec<String> = arguments.into_iter().chain([change]).collect();
        Handler {
            signature: layout::call(4, &format!("def {name}"), &arguments, " -> None:"),
            kind: of.kind.to_owned(),
            class: of.ty.clone(),
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
        queries,
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

fn documentation(of: &view::world::Type) -> Documentation {
    let what = match of.ports {
        Some(_) => "An edge",
        None => "A node",
    };
    let doc = format!("{what} of the type `{}`.", of.name);
    Documentation {
        doc: documentation::docstring_or(4, &of.doc, doc),
    }
}

fn parameter(kind: view::world::Parameter) -> Parameter {
    use view::world::Parameter as Kinds;
    let (ty, make) = match kind {
        Kinds::Bool => ("bool", ""),
        Kinds::Int => ("int", ""),
        Kinds::Float => ("float", ""),
        Kinds::Text => ("str", ""),
        Kinds::Bytes => ("bytes", ""),
        Kinds::Pose => ("_abc.Sequence[float]", "list"),
        Kinds::Node => ("str | _shared.Node", "self._end"),
    };
    Parameter { ty, make }
}

fn attribute(of: &view::world::Attribute) -> Attribute {
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
        ty,
        argument,
        doc: documentation::docstring(8, &doc),
    }
}
