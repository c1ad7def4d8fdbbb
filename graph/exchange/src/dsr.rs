//! Files of DSR, RoboComp's working memory: `{"DSRModel": {"symbols": {…}}}`.

use crate::document::{self, Document, Edge, Node};
use crate::json::{self, Members, Raw, float, quoted};
use crate::older::OLDER;
use crate::places::{Places, SEPARATOR};
use property_graph::{Id, Value};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    #[serde(rename = "DSRModel")]
    model: Model,
}

#[derive(Deserialize)]
struct Model {
    symbols: Members<Symbol>,
}

#[derive(Deserialize)]
struct Symbol {
    #[serde(default)]
    attribute: Members<Attribute>,
    id: Raw,
    #[serde(default)]
    links: Vec<Link>,
    #[serde(default)]
    name: String,
    #[serde(rename = "type")]
    kind: String,
}

#[derive(Deserialize)]
struct Link {
    dst: Raw,
    label: String,
    #[serde(rename = "linkAttribute", default)]
    attributes: Members<Attribute>,
    src: Raw,
}

#[derive(Deserialize)]
struct Attribute {
    #[serde(rename = "type")]
    kind: u64,
    value: Raw,
}

/// The types of DSR, by number.
const TYPES: [&str; 10] = [
    "string",
    "int",
    "float",
    "float vector",
    "bool",
    "bytes",
    "uint",
    "uint64",
    "double",
    "uint64 vector",
];

/// Whether a text looks like a file of DSR.
pub fn is_dsr(text: &str) -> bool {
    let start: &str = text.trim_start_matches('\u{feff}').trim_start();
    let rest = start.strip_prefix('{').map(str::trim_start);
    rest.is_some_and(|rest| rest.starts_with("\"DSRModel\""))
}

/// Reads a file. `None` if it is not JSON, or not one of DSR. Poses with the names of the oldest files get the
/// present ones, with a warning.
pub fn read(sources: &SourceMap, source: SourceId) -> (Option<Document>, Diagnostics) {
    let mut found = Diagnostics::new();
    let file: File = match json::read(sources, source) {
        Ok(file) => file,
        Err(error) if error.message == "expected an object, found an array" => {
            found.push(
                error.help("DSR's first files had arrays, and texts as values; they are not read"),
            );
            return (None, found);
        }
        Err(error) => {
            found.push(error);
            return (None, found);
        }
    };
    let mut wrong: Vec<(String, String)> = Vec::new();
    let mut older = Older::default();
    let mut document = Document::default();
    for (key, symbol) in file.model.symbols.0 {
        let path = ["", "DSRModel", "symbols", &key].join(&SEPARATOR.to_string());
        let Some(id) = symbol.id.integer() else {
            let message = format!("expected an id, found {}", symbol.id.described());
            wrong.push((format!("{path}{SEPARATOR}id"), message));
            continue;
        };
        let from = Id(u128::from(id));
        let mut node = Node {
            id: from,
            kind: symbol.kind,
            attributes: vec![("name".to_owned(), symbol.name.into(), None)],
            path: path.clone(),
        };
        let above = format!("{path}{SEPARATOR}attribute");
        for (name, attribute) in symbol.attribute.0 {
            // A few files have the name as an attribute, too.
            if name != "name" {
                let path = || format!("{above}{SEPARATOR}{name}");
                let value = value(&attribute, path, &mut wrong);
                node.attributes.extend(value.map(|v| (name, v, None)));
            }
        }
        document.nodes.push(node);
        for (at, link) in symbol.links.into_iter().enumerate() {
            let path = format!("{path}{SEPARATOR}links{SEPARATOR}{at}");
            if link.src.integer() != Some(id) {
                let message = format!("expected {id}, the id of the node that has the link");
                wrong.push((format!("{path}{SEPARATOR}src"), message));
            }
            let Some(to) = link.dst.integer() else {
                let message = format!("expected an id, found {}", link.dst.described());
                wrong.push((format!("{path}{SEPARATOR}dst"), message));
                continue;
            };
            let above = format!("{path}{SEPARATOR}linkAttribute");
            let mut attributes = link.attributes.0;
            if link.label == "RT" {
                older.rename(&above, &mut attributes);
            }
            let attributes = attributes.into_iter().filter_map(|(name, attribute)| {
                let path = || format!("{above}{SEPARATOR}{name}");
                let value = value(&attribute, path, &mut wrong)?;
                Some((name, value, None))
            });
            document.edges.push(Edge {
                id: None,
                kind: link.label,
                from,
                to: Id(u128::from(to)),
                attributes: attributes.collect(),
                path,
            });
        }
    }
    let older: Vec<_> = older.findings().collect();
    if !wrong.is_empty() || !older.is_empty() {
        let places = Places::new(source, sources.text(source));
        for (path, message) in older {
            found.push(Diagnostic::warning("older-name", places.of(&path), message));
        }
        for (path, message) in wrong {
            found.push(Diagnostic::error("wrong-json", places.of(&path), message));
            let attribute = path.strip_suffix(&format!("{SEPARATOR}value"));
            document.unread.extend(attribute.map(str::to_owned));
        }
    }
    (Some(document), found)
}

/// The attributes with names of the oldest files: of each name, the first place, and how many there are.
#[derive(Default)]
struct Older([Option<(String, usize)>; OLDER.len()]);

impl Older {
    /// Gives the attributes of an edge their present names, unless it has these, too.
    fn rename(&mut self, above: &str, attributes: &mut [(String, Attribute)]) {
        for ((oldest, present), seen) in OLDER.iter().zip(&mut self.0) {
            if attributes.iter().any(|(name, _)| name == present) {
                continue;
            }
            for (name, _) in attributes.iter_mut().filter(|(name, _)| name == oldest) {
                let place = || (format!("{above}{SEPARATOR}{oldest}"), 0);
                seen.get_or_insert_with(place).1 += 1;
                (*present).clone_into(name);
            }
        }
    }

    /// Places and messages.
    fn findings(self) -> impl Iterator<Item = (String, String)> {
        let all = OLDER.iter().zip(self.0);
        all.filter_map(|((oldest, present), seen)| {
            let (path, count) = seen?;
            let times = if count == 1 {
                String::new()
            } else {
                format!(" ({count} times)")
            };
            let message = format!("`{oldest}` is read as `{present}`, its present name{times}");
            Some((path, message))
        })
    }
}

/// The value of an attribute, by the number of its type.
fn value(
    attribute: &Attribute,
    path: impl Fn() -> String,
    wrong: &mut Vec<(String, String)>,
) -> Option<Value> {
    let raw = &attribute.value;
    let number = |raw: &Raw| match raw {
        Raw::Int(value) => Some(*value as f64),
        Raw::Float(value) => Some(*value),
        _ => None,
    };
    let integer = |raw: &Raw| match raw {
        Raw::Int(value) => Some(*value),
        Raw::Text(text) => text.parse().ok(),
        _ => None,
    };
    let list = match raw {
        Raw::List(items) => Some(items),
        _ => None,
    };
    let value = match (attribute.kind, raw) {
        (0, Raw::Text(text)) => Some(text.as_str().into()),
        (1 | 6 | 7, raw) => integer(raw).map(Value::Int),
        (2 | 8, raw) => number(raw).map(Value::Float),
        (3 | 10.., Raw::List(items)) => {
            let numbers: Option<Vec<f64>> = items.iter().map(number).collect();
            numbers.map(|numbers| Value::Floats(numbers.into()))
        }
        (4, Raw::Bool(yes)) => Some(Value::Bool(*yes)),
        (5, _) => list.and_then(|items| {
            let bytes = items.iter().map(|raw| u8::try_from(integer(raw)?).ok());
            let bytes: Option<Vec<u8>> = bytes.collect();
            bytes.map(|bytes| Value::Bytes(bytes.into()))
        }),
        (9, _) => list.and_then(|items| {
            let numbers: Option<Vec<i64>> = items.iter().map(integer).collect();
            numbers.map(|numbers| Value::Ints(numbers.into()))
        }),
        _ => None,
    };
    if value.is_none() {
        let kind = usize::try_from(attribute.kind).ok();
        let kind = kind.and_then(|kind| TYPES.get(kind)).unwrap_or(&"vector");
        let message = format!(
            "expected a value of DSR's type {} ({kind}), found {}",
            attribute.kind,
            raw.described()
        );
        wrong.push((format!("{}{SEPARATOR}value", path()), message));
    }
    value
}

/// Prints a document as a file of DSR: nodes in the order of ids, attributes in that of names.
/// Attributes that DSR has no type for are findings.
pub fn write(document: &Document) -> (String, Vec<String>) {
    let mut lost = Vec::new();
    let mut nodes: Vec<&Node> = document.nodes.iter().collect();
    nodes.sort_by_key(|node| node.id);
    let number = |id: Id| id.0 as u64;
    let mut ids: Vec<u64> = nodes.iter().map(|node| number(node.id)).collect();
    ids.sort_unstable();
    ids.dedup();
    if ids.len() < nodes.len() || nodes.iter().any(|node| u64::try_from(node.id.0).is_err()) {
        lost.push("DSR has ids of 64 bits: the writer in an id is left out".to_owned());
    }
    let mut links: std::collections::HashMap<Id, Vec<&Edge>> = std::collections::HashMap::new();
    for edge in &document.edges {
        links.entry(edge.from).or_default().push(edge);
    }
    let is_node: std::collections::HashSet<Id> = nodes.iter().map(|node| node.id).collect();
    let mut ends = document.edges.iter().flat_map(|edge| [edge.from, edge.to]);
    if ends.any(|end| !is_node.contains(&end)) {
        lost.push("DSR has no edges to edges: these are left out".to_owned());
        links
            .values_mut()
            .for_each(|edges| edges.retain(|e| is_node.contains(&e.to)));
    }
    let mut out = String::from("{\n    \"DSRModel\": {\n        \"symbols\": {");
    for (at, node) in nodes.iter().enumerate() {
        let id = number(node.id);
        let name = node.attributes.iter().find(|(name, ..)| name == "name");
        let name = name
            .and_then(|(_, value, _)| value.as_str())
            .unwrap_or_default();
        let rest = node.attributes.iter().filter(|(name, ..)| name != "name");
        out.push_str(if at == 0 { "\n" } else { ",\n" });
        out.push_str(&format!(
            "            \"{id}\": {{\n                \"attribute\": {{"
        ));
        out.push_str(&attributes(rest, "                    ", &mut lost));
        out.push_str(&format!(
            "\n                }},\n                \"id\": \"{id}\",\n                \"links\": ["
        ));
        let own = links.get(&node.id).map(Vec::as_slice).unwrap_or_default();
        for (at, edge) in own.iter().enumerate() {
            out.push_str(if at == 0 { "\n" } else { ",\n" });
            out.push_str(&format!(
                "                    {{\n                        \"dst\": \"{}\",\n                        \"label\": {},\n                        \"linkAttribute\": {{",
                number(edge.to),
                quoted(&edge.kind)
            ));
            let indent = "                            ";
            out.push_str(&attributes(edge.attributes.iter(), indent, &mut lost));
            out.push_str(&format!(
                "\n                        }},\n                        \"src\": \"{id}\"\n                    }}"
            ));
        }
        out.push_str(&format!(
            "\n                ],\n                \"name\": {},\n                \"type\": {}\n            }}",
            quoted(name),
            quoted(&node.kind)
        ));
    }
    out.push_str("\n        }\n    }\n}\n");
    lost.sort();
    lost.dedup();
    (out, lost)
}

fn attributes<'a>(
    all: impl Iterator<Item = &'a document::Attribute>,
    indent: &str,
    lost: &mut Vec<String>,
) -> String {
    let mut sorted: Vec<_> = all.collect();
    sorted.sort_by(|a, b| a.0.cmp(&b.0));
    let joined = |items: &mut dyn Iterator<Item = String>| items.collect::<Vec<_>>().join(", ");
    let texts = sorted.into_iter().filter_map(|(name, value, _)| {
        let (kind, value) = match value {
            Value::Text(text) => (0, quoted(text)),
            Value::Int(number) if i32::try_from(*number).is_ok() => (1, number.to_string()),
            Value::Int(number) if *number >= 0 => (7, format!("\"{number}\"")),
            Value::Float(number) => (2, float(*number)),
            Value::Floats(all) => (3, format!("[{}]", joined(&mut all.iter().map(|v| float(*v))))),
            Value::Bool(yes) => (4, yes.to_string()),
            Value::Bytes(all) => {
                (5, format!("[{}]", joined(&mut all.iter().map(ToString::to_string))))
            }
            Value::Ints(all) if all.iter().all(|v| *v >= 0) => {
                (9, format!("[{}]", joined(&mut all.iter().map(ToString::to_string))))
            }
            _ => {
                lost.push(format!("DSR has no type for `{name}`, which is {}", value.kind()));
                return None;
            }
        };
        let name = quoted(name);
        Some(format!(
            "\n{indent}{name}: {{\n{indent}    \"type\": {kind},\n{indent}    \"value\": {value}\n{indent}}}"
        ))
    });
    texts.collect::<Vec<_>>().join(",")
}
