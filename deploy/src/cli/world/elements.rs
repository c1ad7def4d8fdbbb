//! Nodes and edges as a command line names them, and as commands print them.

use crate::cli::output::Failure;
use graph_exchange::graph_json::{value_of, value_text};
use graph_language::model::Kind;
use rc_diagnostics::foreign::{clean, clean_to};
use rc_quantity::Unit;
use rc_world::property_graph::{EdgeRef, Element, Id, NodeId, NodeRef, Snapshot, Value};
use serde_json::{Map, json};
use std::collections::BTreeSet;

/// How many characters of a value are printed for people.
const MOST_VALUE: usize = 400;

/// The meaning of a word of the command line: an element, and perhaps one of its attributes.
pub(super) struct Named {
    pub(super) element: Element,
    pub(super) attribute: Option<String>,
}

fn usage(message: String) -> Failure {
    Failure(2, message)
}

/// `#WRITER:COUNT`
fn id(word: &str) -> Option<Id> {
    let (writer, count) = word.strip_prefix('#')?.split_once(':')?;
    Some(Id::new(writer.parse().ok()?, count.parse().ok()?))
}

/// The names of nodes, for messages.
fn names(world: &Snapshot) -> BTreeSet<&str> {
    world
        .nodes()
        .map(|node| node.name())
        .filter(|name| !name.is_empty())
        .collect()
}

/// The node of a name or an id.
fn node(world: &Snapshot, word: &str) -> Result<Option<NodeId>, Failure> {
    if let Some(id) = id(word) {
        return Ok(world.find_node(id));
    }
    let mut found = world.named(word);
    match (found.next(), found.next()) {
        (Some(node), None) => Ok(Some(node)),
        (None, _) => Ok(None),
        (Some(_), Some(_)) => {
            let ids = world.named(word).take(8);
            let ids = ids.filter_map(|node| world.node(node).ok());
            let ids: Vec<String> = ids.map(|node| id_text(node.id())).collect();
            let (word, ids) = (clean(word), ids.join(", "));
            Err(usage(format!(
                "several nodes have the name `{word}`: {ids}"
            )))
        }
    }
}

fn required(world: &Snapshot, word: &str) -> Result<NodeId, Failure> {
    node(world, word)?.ok_or_else(|| unknown(world, word))
}

fn unknown(world: &Snapshot, word: &str) -> Failure {
    let hint = match rc_diagnostics::nearest(word, names(world)) {
        Some(near) => format!("; did you mean `{}`?", clean(near)),
        None => "; `rcdeploy world get` without an element lists all".to_owned(),
    };
    usage(format!("no node has the name `{}`{hint}", clean(word)))
}

/// The element of a word without an attribute: `NAME`, `#ID`, or `PARENT/RELATION/CHILD`.
fn element(world: &Snapshot, word: &str) -> Result<Option<Element>, Failure> {
    if let Some(found) = node(world, word)? {
        return Ok(Some(found.into()));
    }
    if let Some(id) = id(word) {
        return Ok(world.find(id));
    }
    let parts: Vec<&str> = word.split('/').collect();
    let [from, relation, to] = parts.as_slice() else {
        return Ok(None);
    };
    let (from, to) = (required(world, from)?, required(world, to)?);
    let edges = world.out_edges(from, None).filter(|edge| edge.to() == to);
    let edges: Vec<EdgeRef<'_>> = edges.collect();
    if let Some(edge) = edges.iter().find(|edge| edge.type_name() == *relation) {
        return Ok(Some(edge.edge_id().into()));
    }
    let all: BTreeSet<&str> = edges.iter().map(EdgeRef::type_name).collect();
    let hint = if all.is_empty() {
        "; there is none between these nodes".to_owned()
    } else {
        format!("; there is {}", clean(&Vec::from_iter(all).join(", ")))
    };
    Err(usage(format!("no edge `{}`{hint}", clean(word))))
}

/// The meaning of a word. An attribute follows the last point.
pub(super) fn named(world: &Snapshot, word: &str) -> Result<Named, Failure> {
    if let Ok(Some(element)) = element(world, word) {
        let attribute = None;
        return Ok(Named { element, attribute });
    }
    if let Some((of, attribute)) = word.rsplit_once('.')
        && let Some(element) = element(world, of)?
    {
        let attribute = Some(attribute.to_owned());
        return Ok(Named { element, attribute });
    }
    element(world, word)?;
    // Perhaps a mistyped name with a point in it, otherwise one with an attribute.
    let is_whole = rc_diagnostics::nearest(word, names(world)).is_some();
    let of = word.rsplit_once('.').filter(|_| !is_whole);
    Err(unknown(world, of.map_or(word, |(of, _)| of)))
}

/// The attributes of a type that have a value, or that the schema has.
pub(super) fn attributes(world: &Snapshot, element: Element) -> BTreeSet<&str> {
    let kind = kind(world, element);
    let declared = world.schema().attributes(kind).unwrap_or_default();
    let set: Vec<&str> = match element {
        Element::Node(node) => world.node(node).map_or_else(
            |_| Vec::new(),
            |node| node.attributes().map(|(name, _)| name).collect(),
        ),
        Element::Edge(edge) => world.edge(edge).map_or_else(
            |_| Vec::new(),
            |edge| edge.attributes().map(|(name, _)| name).collect(),
        ),
    };
    declared
        .iter()
        .map(|own| own.name.as_str())
        .chain(set)
        .collect()
}

/// Fails for an attribute that the type of an element has not.
pub(super) fn unknown_attribute(world: &Snapshot, element: Element, name: &str) -> Failure {
    let all = attributes(world, element);
    let hint = match rc_diagnostics::nearest(name, all.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("it has {}", Vec::from_iter(all).join(", ")),
    };
    let (kind, name) = (clean(kind(world, element)), clean(name));
    usage(format!("`{kind}` has no attribute `{name}`; {hint}"))
}

/// The type of an element.
pub(super) fn kind(world: &Snapshot, element: Element) -> &str {
    match element {
        Element::Node(node) => world.node(node).map_or("", |node| node.type_name()),
        Element::Edge(edge) => world.edge(edge).map_or("", |edge| edge.type_name()),
    }
}

fn id_text(id: Id) -> String {
    format!("#{}:{}", id.writer(), id.count())
}

/// The name of a node, or its id if it has none, or if others have the same.
fn node_word(world: &Snapshot, node: NodeRef<'_>) -> String {
    match node.name() {
        "" => id_text(node.id()),
        name if world.named(name).nth(1).is_some() => id_text(node.id()),
        name => clean(name),
    }
}

/// The word that means an element.
pub(super) fn word(world: &Snapshot, element: Element) -> String {
    let of_node = |node| {
        let node = world.node(node);
        node.map_or_else(|_| String::new(), |node| node_word(world, node))
    };
    match element {
        Element::Node(node) => of_node(node),
        Element::Edge(edge) => world.edge(edge).map_or_else(
            |_| String::new(),
            |edge| {
                let (from, to) = (of_node(edge.from()), of_node(edge.to()));
                format!("{from}/{}/{to}", clean(edge.type_name()))
            },
        ),
    }
}

/// A value for people.
pub(super) fn shown(value: &Value) -> String {
    clean_to(&value_text(value), MOST_VALUE)
}

/// A value as JSON.
pub(super) fn json_of(value: &Value) -> serde_json::Value {
    serde_json::from_str(&value_text(value)).unwrap_or_default()
}

/// An element with its attributes as JSON.
pub(super) fn document(world: &Snapshot, element: Element) -> serde_json::Value {
    let mut object = json!({
        "element": word(world, element),
        "type": kind(world, element),
    });
    let mut attributes = Map::new();
    match element {
        Element::Node(node) => {
            if let Ok(node) = world.node(node) {
                object["id"] = json!(id_text(node.id()));
                attributes.extend(
                    node.attributes()
                        .map(|(name, value)| (name.to_owned(), json_of(value))),
                );
            }
        }
        Element::Edge(edge) => {
            if let Ok(edge) = world.edge(edge) {
                object["id"] = json!(id_text(edge.id()));
                attributes.extend(
                    edge.attributes()
                        .map(|(name, value)| (name.to_owned(), json_of(value))),
                );
            }
        }
    }
    object["attributes"] = attributes.into();
    object
}

/// An element with its attributes, for people.
pub(super) fn text(world: &Snapshot, element: Element) -> String {
    let unit = |name: &str| {
        let declared = world
            .schema()
            .attributes(kind(world, element))
            .unwrap_or_default();
        let own = declared.iter().find(|own| own.name == name);
        own.and_then(|own| own.unit.clone())
            .map_or_else(String::new, |unit| format!(" {}", clean(&unit)))
    };
    let mut lines = format!("{} {}\n", clean(kind(world, element)), word(world, element));
    let mut add = |(name, value): (&str, &Value)| {
        lines += &format!("    {} = {}{}\n", clean(name), shown(value), unit(name));
    };
    match element {
        Element::Node(node) => world
            .node(node)
            .into_iter()
            .flat_map(|node| node.attributes())
            .for_each(&mut add),
        Element::Edge(edge) => world
            .edge(edge)
            .into_iter()
            .flat_map(|edge| edge.attributes())
            .for_each(&mut add),
    }
    lines
}

/// A number with a unit behind it, as in `80 cm`, in the unit of the attribute. The error says what is wrong with
/// the unit; without it, the text is no such number.
fn in_unit(text: &str, own: Option<&str>) -> Result<Value, Option<String>> {
    // The longest begin that is a number: that of `5eV` is `5`, that of `1e3 m` is `1e3`.
    let begins = text.char_indices().rev().map(|(at, _)| at);
    let mut numbers = begins.filter_map(|at| Some((at, text[..at].trim().parse().ok()?)));
    let (at, number): (usize, f64) = numbers.next().ok_or(None)?;
    let unit = text[at..].trim();
    if unit.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | ',')) {
        return Err(None);
    }
    let own = own.ok_or_else(|| Some("the attribute has no unit".to_owned()))?;
    let parsed =
        |unit: &str| Unit::parse(unit).map_err(|error| Some(format!("`{}`: {error}", clean(unit))));
    let conversion = parsed(unit)?.conversion_to(&parsed(own)?);
    let conversion = conversion
        .ok_or_else(|| Some(format!("a number in `{}` is none in `{own}`", clean(unit))))?;
    Ok(Value::Float(conversion.apply(number)))
}

/// The value that a text means for an attribute.
pub(super) fn value(
    world: &Snapshot,
    element: Element,
    name: &str,
    text: &str,
) -> Result<Value, Failure> {
    let kind = kind(world, element);
    let declared = world.schema().attributes(kind).unwrap_or_default();
    let declared = declared.iter().find(|own| own.name == name);
    if declared.is_none() && !world.schema().open {
        return Err(unknown_attribute(world, element, name));
    }
    let wrong = |expected: &str| {
        let (name, text) = (clean(name), clean(text));
        usage(format!(
            "`{name}` of `{}` is {expected}, found `{text}`",
            clean(kind)
        ))
    };
    let list = || serde_json::from_str::<Vec<serde_json::Value>>(text);
    let floats = |expected: &str| {
        let list = list().map_err(|_| wrong(expected))?;
        let numbers: Option<Vec<f64>> = list.iter().map(serde_json::Value::as_f64).collect();
        numbers
            .map(|all| Value::Floats(all.into()))
            .ok_or_else(|| wrong(expected))
    };
    let Some(declared) = declared else {
        return Ok(guessed(text));
    };
    let expected = declared.kind.text();
    match (&declared.kind, value_of(text)) {
        (Kind::Text | Kind::Enum(_), Some(value @ Value::Text(_)))
        | (Kind::Ints(_), Some(value @ Value::Ints(_)))
        | (Kind::Texts, Some(value @ Value::Texts(_)))
        | (Kind::Bytes, Some(value @ Value::Bytes(_)))
        | (Kind::Topic(_), Some(value @ Value::Sample(_))) => return Ok(value),
        _ => {}
    }
    match &declared.kind {
        Kind::Bool => text
            .parse()
            .map(Value::Bool)
            .map_err(|_| wrong("true or false")),
        Kind::Int => text.parse().map(Value::Int).map_err(|_| wrong(&expected)),
        Kind::Float => match text.parse() {
            Ok(number) => Ok(Value::Float(number)),
            Err(_) => in_unit(text, declared.unit.as_deref()).map_err(|reason| match reason {
                Some(reason) => usage(format!("`{}`: {reason}", clean(name))),
                None => wrong(&expected),
            }),
        },
        Kind::Text | Kind::Enum(_) => Ok(Value::Text(text.into())),
        Kind::Ints(_) => {
            let list = list().map_err(|_| wrong("integers like `[1, 2]`"))?;
            let all: Option<Vec<i64>> = list.iter().map(serde_json::Value::as_i64).collect();
            all.map(|all| Value::Ints(all.into()))
                .ok_or_else(|| wrong(&expected))
        }
        Kind::Floats(_) | Kind::Block(_) => floats("numbers like `[0.5, 1]`"),
        Kind::Texts => {
            let list: Result<Vec<String>, _> = serde_json::from_str(text);
            let list = list.map_err(|_| wrong(r#"texts like `["a", "b"]`"#))?;
            let all = list.iter().map(|text| text.as_str().into());
            Ok(Value::Texts(all.collect()))
        }
        Kind::Bytes => Err(wrong(r#"bytes in Base64 like `{"bytes": "AQID"}`"#)),
        Kind::Topic(of) => {
            let of = of.as_deref().unwrap_or("RoboCompCamera::TImage");
            Err(wrong(&format!(
                r#"a sample of a topic like `{{"topic": "camera.image", "type": "{}", "sequence": 42}}`"#,
                clean(of)
            )))
        }
    }
}

/// The value of a text for an attribute that no schema knows.
fn guessed(text: &str) -> Value {
    value_of(text).unwrap_or_else(|| Value::Text(text.into()))
}
