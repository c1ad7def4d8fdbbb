//! Files of ours: `.graph`, JSON with one node or edge a line, in the order of ids.

use crate::document::{Attribute, Document, Edge, Node};
use crate::json::{self, Members, Raw, float, quoted};
use crate::places::{Places, SEPARATOR};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use property_graph::{Id, Sample, Value};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use serde::Deserialize;
use std::sync::Arc;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    schema: Option<String>,
    nodes: Vec<NodeOf>,
    #[serde(default)]
    edges: Vec<EdgeOf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NodeOf {
    id: String,
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    attributes: Members<Raw>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EdgeOf {
    id: String,
    #[serde(rename = "type")]
    kind: String,
    from: String,
    to: String,
    #[serde(default)]
    attributes: Members<Raw>,
}

/// `writer:count`
fn id(text: &str) -> Option<Id> {
    let (writer, count) = text.split_once(':')?;
    Some(Id::new(writer.parse().ok()?, count.parse().ok()?))
}

fn id_text(id: Id) -> String {
    format!("\"{}:{}\"", id.writer(), id.count())
}

/// The error: path and message.
type PathErrors = Vec<(String, String)>;

/// Reads a file. `None` if it is not JSON, or has another form.
pub fn read(sources: &SourceMap, source: SourceId) -> (Option<Document>, Diagnostics) {
    let mut found = Diagnostics::new();
    let file: File = match json::read(sources, source) {
        Ok(file) => file,
        Err(error) => {
            found.push(error);
            return (None, found);
        }
    };
    if let Some((start, end)) = json::wide_integer(sources.text(source)) {
        let message = "an integer has 64 bits at most";
        let error = Diagnostic::error("wrong-json", Span::new(source, start, end), message);
        found.push(error.help("a float has a point or an exponent"));
    }
    let mut wrong = PathErrors::new();
    let mut document = Document {
        schema: file.schema,
        ..Document::default()
    };
    let known = |text: &str, path: &str, member: &str, wrong: &mut PathErrors| {
        let read = id(text);
        if read.is_none() {
            let path = format!("{path}{SEPARATOR}{member}");
            let text = rc_diagnostics::foreign::clean(text);
            wrong.push((path, format!("expected an id like `1:42`, found `{text}`")));
        }
        read
    };
    for (at, node) in file.nodes.into_iter().enumerate() {
        let path = format!("{SEPARATOR}nodes{SEPARATOR}{at}");
        let Some(id) = known(&node.id, &path, "id", &mut wrong) else {
            continue;
        };
        document.nodes.push(Node {
            id,
            kind: node.kind,
            attributes: values(node.attributes, &path, &mut wrong),
            path,
        });
    }
    for (at, edge) in file.edges.into_iter().enumerate() {
        let path = format!("{SEPARATOR}edges{SEPARATOR}{at}");
        let id = known(&edge.id, &path, "id", &mut wrong);
        let from = known(&edge.from, &path, "from", &mut wrong);
        let to = known(&edge.to, &path, "to", &mut wrong);
        let (Some(id), Some(from), Some(to)) = (id, from, to) else {
            continue;
        };
        document.edges.push(Edge {
            id: Some(id),
            kind: edge.kind,
            from,
            to,
            attributes: values(edge.attributes, &path, &mut wrong),
            path,
        });
    }
    if !wrong.is_empty() {
        let places = Places::new(source, sources.text(source));
        for (path, message) in wrong {
            found.push(Diagnostic::error("wrong-json", places.of(&path), message));
            document.unread.push(path);
        }
    }
    (Some(document), found)
}

/// The place of the name of the schema.
pub fn schema_span(sources: &SourceMap, source: SourceId) -> Span {
    Places::new(source, sources.text(source)).of(&format!("{SEPARATOR}schema"))
}

fn values(members: Members<Raw>, above: &str, wrong: &mut PathErrors) -> Vec<Attribute> {
    let all = members.0.into_iter().filter_map(|(name, raw)| {
        let (value, unit) = match with_unit(&raw) {
            Some((value, unit)) => (value, Some(unit.to_owned())),
            None => (value(&raw), None),
        };
        if value.is_none() {
            let path = format!("{above}{SEPARATOR}attributes{SEPARATOR}{name}");
            let message = format!(
                "expected a value of an attribute, found {}",
                raw.described()
            );
            wrong.push((path, message));
        }
        Some((name, value?, unit))
    });
    all.collect()
}

/// `{"value": 3, "unit": "kg"}`
fn with_unit(raw: &Raw) -> Option<(Option<Value>, &str)> {
    let Raw::Object(Members(members)) = raw else {
        return None;
    };
    let member = |name: &str| members.iter().find(|(known, _)| known == name);
    match (members.len(), member("value"), member("unit")) {
        (2, Some((_, raw)), Some((_, Raw::Text(unit)))) => Some((value(raw), unit)),
        _ => None,
    }
}

fn value(raw: &Raw) -> Option<Value> {
    Some(match raw {
        Raw::Bool(yes) => Value::Bool(*yes),
        Raw::Int(number) => Value::Int(*number),
        Raw::Float(number) => Value::Float(*number),
        Raw::Text(text) => text.as_str().into(),
        Raw::List(items) => list(items)?,
        Raw::Object(Members(members)) => match members.as_slice() {
            [(name, Raw::Text(text))] if name == "bytes" => {
                Value::Bytes(STANDARD.decode(text).ok()?.into())
            }
            [(name, Raw::List(items))] if name == "ints" && items.is_empty() => {
                Value::Ints(Arc::new([]))
            }
            [(name, Raw::List(items))] if name == "strings" && items.is_empty() => {
                Value::Texts(Arc::new([]))
            }
            _ => sample(raw)?.into(),
        },
        Raw::Null | Raw::Large(_) => return None,
    })
}

/// `{"topic": "camera.image", "type": "RoboCompCamera::TImage", "sequence": 42}`
fn sample(raw: &Raw) -> Option<Sample> {
    let Raw::Object(Members(members)) = raw else {
        return None;
    };
    let member = |name: &str| {
        let found = members.iter().find(|(known, _)| known == name);
        found.map(|(_, raw)| raw)
    };
    match (
        members.len(),
        member("topic"),
        member("type"),
        member("sequence"),
    ) {
        (
            3,
            Some(Raw::Text(topic)),
            Some(Raw::Text(kind)),
            Some(sequence @ (Raw::Int(_) | Raw::Large(_))),
        ) => Some(Sample {
            topic: topic.clone(),
            kind: kind.clone(),
            sequence: sequence.integer()?,
        }),
        _ => None,
    }
}

fn list(items: &[Raw]) -> Option<Value> {
    let ints: Option<Vec<i64>> = items
        .iter()
        .map(|raw| match raw {
            Raw::Int(number) => Some(*number),
            _ => None,
        })
        .collect();
    if let Some(ints) = ints.filter(|ints| !ints.is_empty()) {
        return Some(Value::Ints(ints.into()));
    }
    let floats: Option<Vec<f64>> = items
        .iter()
        .map(|raw| match raw {
            // An integer among floats keeps its value.
            Raw::Int(number) => {
                let float = *number as f64;
                (float as i128 == i128::from(*number)).then_some(float)
            }
            Raw::Float(number) => Some(*number),
            _ => None,
        })
        .collect();
    if let Some(floats) = floats {
        return Some(Value::Floats(floats.into()));
    }
    let texts: Option<Vec<Arc<str>>> = items
        .iter()
        .map(|raw| match raw {
            Raw::Text(text) => Some(text.as_str().into()),
            _ => None,
        })
        .collect();
    texts.map(|texts| Value::Texts(texts.into()))
}

/// Prints a document: equal graphs give equal texts.
pub fn write(document: &Document) -> String {
    let mut out = String::from("{\n");
    if let Some(schema) = &document.schema {
        out.push_str(&format!("  \"schema\": {},\n", quoted(schema)));
    }
    let mut nodes: Vec<&Node> = document.nodes.iter().collect();
    nodes.sort_by_key(|node| node.id);
    let nodes = nodes.iter().map(|node| {
        format!(
            "    {{\"id\": {}, \"type\": {}{}}}",
            id_text(node.id),
            quoted(&node.kind),
            attributes(&node.attributes)
        )
    });
    let mut edges: Vec<&Edge> = document.edges.iter().collect();
    edges.sort_by_key(|edge| edge.id);
    let edges = edges.iter().map(|edge| {
        format!(
            "    {{\"id\": {}, \"type\": {}, \"from\": {}, \"to\": {}{}}}",
            id_text(edge.id.unwrap_or_default()),
            quoted(&edge.kind),
            id_text(edge.from),
            id_text(edge.to),
            attributes(&edge.attributes)
        )
    });
    let lines = |items: Vec<String>| {
        if items.is_empty() {
            "[]".to_owned()
        } else {
            format!(
                "[
{}
  ]",
                items.join(
                    ",
"
                )
            )
        }
    };
    out.push_str(&format!("  \"nodes\": {},\n", lines(nodes.collect())));
    out.push_str(&format!("  \"edges\": {}\n}}\n", lines(edges.collect())));
    out
}

fn attributes(all: &[Attribute]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let mut sorted: Vec<_> = all.iter().collect();
    sorted.sort_by(|a, b| a.0.cmp(&b.0));
    let texts = sorted.into_iter().map(|(name, value, unit)| {
        let text = value_text(value);
        let text = match unit {
            Some(unit) => format!("{{\"value\": {text}, \"unit\": {}}}", quoted(unit)),
            None => text,
        };
        format!("{}: {text}", quoted(name))
    });
    let texts: Vec<String> = texts.collect();
    format!(", \"attributes\": {{{}}}", texts.join(", "))
}

/// The value of a text that [`value_text`] prints.
pub fn value_of(text: &str) -> Option<Value> {
    value(&serde_json::from_str(text).ok()?)
}

/// A value as a file has it.
pub fn value_text(value: &Value) -> String {
    let listed = |items: Vec<String>| format!("[{}]", items.join(", "));
    match value {
        Value::Bool(yes) => yes.to_string(),
        Value::Int(number) => number.to_string(),
        Value::Float(number) => float(*number),
        Value::Text(text) => quoted(text),
        Value::Bytes(bytes) => format!("{{\"bytes\": \"{}\"}}", STANDARD.encode(bytes)),
        Value::Ints(all) if all.is_empty() => "{\"ints\": []}".to_owned(),
        Value::Texts(all) if all.is_empty() => "{\"strings\": []}".to_owned(),
        Value::Ints(all) => listed(all.iter().map(ToString::to_string).collect()),
        Value::Floats(all) => listed(all.iter().map(|number| float(*number)).collect()),
        Value::Texts(all) => listed(all.iter().map(|text| quoted(text)).collect()),
        Value::Sample(sample) => format!(
            "{{\"topic\": {}, \"type\": {}, \"sequence\": {}}}",
            quoted(&sample.topic),
            quoted(&sample.kind),
            sample.sequence
        ),
    }
}
