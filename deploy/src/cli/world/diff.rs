//! `rcdeploy world diff`: the differences between two worlds.

use super::replica::Listener;
use crate::cli::output::{Failure, show};
use graph_exchange::{Document, dsr, graph_json};
use rc_deploy_client::Format;
use rc_diagnostics::foreign::{clean, clean_to};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_world::property_graph::{Id, Value};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// How many characters of a value are printed for people.
const MOST_VALUE: usize = 200;

/// The differences of two worlds.
#[derive(Serialize)]
struct Differences {
    /// The elements that only the first world has, that only the second one has, and those with other
    /// attributes.
    only_first: Vec<ElementRef>,
    only_second: Vec<ElementRef>,
    changed: Vec<Changed>,
}

#[derive(Serialize)]
struct ElementRef {
    /// None for an edge in a file of DSR.
    id: Option<String>,
    element: String,
    #[serde(rename = "type")]
    kind: String,
}

#[derive(Serialize)]
struct Changed {
    #[serde(flatten)]
    of: ElementRef,
    attribute: String,
    first: Option<serde_json::Value>,
    second: Option<serde_json::Value>,
}

/// An element, in the form in which two of them are compared.
struct Item<'d> {
    /// None for an edge in a file of DSR.
    id: Option<Id>,
    kind: &'d str,
    ends: Option<(Id, Id)>,
    attributes: BTreeMap<&'d str, &'d Value>,
}

/// The identity of an element in both worlds.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Key<'d> {
    Id(Id),
    /// The ends and the type of an edge, where edges have no ids, and which one of several it is.
    Ends(Id, &'d str, Id, usize),
}

type Items<'d> = BTreeMap<Key<'d>, Item<'d>>;

/// The elements of two graphs. If one of them is a file of DSR, whose edges have no ids, edges are
/// identified by their ends.
fn both<'d>(first: &'d Document, second: &'d Document) -> (Items<'d>, Items<'d>) {
    let mut edges = first.edges.iter().chain(&second.edges);
    let have_ids = edges.all(|edge| edge.id.is_some());
    (items(first, have_ids), items(second, have_ids))
}

fn items(document: &Document, have_ids: bool) -> Items<'_> {
    fn attributes(all: &[graph_exchange::Attribute]) -> BTreeMap<&str, &Value> {
        all.iter()
            .map(|(name, value, _)| (name.as_str(), value))
            .collect()
    }
    let nodes = document.nodes.iter().map(|node| {
        let item = Item {
            id: Some(node.id),
            kind: &node.kind,
            ends: None,
            attributes: attributes(&node.attributes),
        };
        (Key::Id(node.id), item)
    });
    let mut all: Items<'_> = nodes.collect();
    let mut several: BTreeMap<(Id, &str, Id), usize> = BTreeMap::new();
    for edge in &document.edges {
        let item = Item {
            id: edge.id,
            kind: &edge.kind,
            ends: Some((edge.from, edge.to)),
            attributes: attributes(&edge.attributes),
        };
        let by_ends = || {
            let (from, kind, to) = (edge.from, edge.kind.as_str(), edge.to);
            let count = several.entry((from, kind, to)).or_default();
            *count += 1;
            Key::Ends(from, kind, to, *count)
        };
        let key = edge.id.filter(|_| have_ids).map_or_else(by_ends, Key::Id);
        all.insert(key, item);
    }
    all
}

fn id_text(id: Id) -> String {
    format!("{}:{}", id.writer(), id.count())
}

fn name(all: &Items<'_>, id: Id) -> String {
    let item = all.get(&Key::Id(id));
    let name = item.and_then(|item| item.attributes.get("name"));
    match name.and_then(|name| name.as_str()) {
        Some(name) => clean(name),
        None => format!("#{}", id_text(id)),
    }
}

fn of(all: &Items<'_>, item: &Item<'_>) -> ElementRef {
    let kind = clean(item.kind);
    ElementRef {
        id: item.id.map(id_text),
        element: match (item.ends, item.id) {
            (Some((from, to)), _) => format!("{}/{kind}/{}", name(all, from), name(all, to)),
            (None, Some(id)) => name(all, id),
            (None, None) => String::new(),
        },
        kind,
    }
}

/// The graph that a word means: a file, a network, or one replica of it: `NETWORK@COMPONENT`. `None` at Ctrl-C.
fn graph(word: &str) -> Result<Option<Document>, Failure> {
    let path = Path::new(word);
    let ending = path.extension().and_then(|ending| ending.to_str());
    if matches!(ending, Some("graph" | "json")) {
        return file(path).map(Some);
    }
    let (network, only) = match word.rsplit_once('@') {
        Some((network, only)) => (network, Some(only)),
        None => (word, None),
    };
    let listener = Listener::joined(network, only)?;
    Ok(listener.map(|listener| Document::of(&listener.world.snapshot())))
}

fn file(path: &Path) -> Result<Document, Failure> {
    let cannot = |error: &dyn std::fmt::Display| Failure(1, format!("{}: {error}", path.display()));
    let text = rc_files::read(path).map_err(|error| cannot(&error))?;
    let mut sources = SourceMap::new();
    let (source, mark) = graph_exchange::add(&mut sources, path, text);
    let mut found = Diagnostics::new();
    let document = match mark {
        Some(mark) => {
            found.push(mark);
            None
        }
        None if dsr::is_dsr(sources.text(source)) => {
            let (document, more) = dsr::read(&sources, source);
            found.extend(more);
            document
        }
        None => {
            let (document, more) = graph_json::read(&sources, source);
            found.extend(more);
            document
        }
    };
    document.filter(|_| !found.has_errors()).ok_or_else(|| {
        crate::cli::output::print_findings(&sources, &found, rc_diagnostics::Format::Human);
        Failure(1, String::new())
    })
}

pub(super) fn diff(first: &str, second: &str, format: Format) -> Result<u8, Failure> {
    let (Some(first), Some(second)) = (graph(first)?, graph(second)?) else {
        return Ok(0);
    };
    let (first, second) = both(&first, &second);
    let found = compare(&first, &second);
    let is_equal =
        found.only_first.is_empty() && found.only_second.is_empty() && found.changed.is_empty();
    show(format, &found, text)?;
    Ok(u8::from(!is_equal))
}

fn compare(first: &Items<'_>, second: &Items<'_>) -> Differences {
    // An element with other ends, or of another type, is another one.
    let same = |a: &Item<'_>, b: &Item<'_>| a.kind == b.kind && a.ends == b.ends;
    let only = |own: &Items<'_>, other: &Items<'_>| {
        let all = own.iter();
        let all = all.filter(|(key, item)| other.get(key).is_none_or(|other| !same(item, other)));
        all.map(|(_, item)| of(own, item)).collect()
    };
    let mut changed = Vec::new();
    for (key, a) in first {
        let Some(b) = second.get(key).filter(|b| same(a, b)) else {
            continue;
        };
        let mut names: Vec<&str> = a
            .attributes
            .keys()
            .chain(b.attributes.keys())
            .copied()
            .collect();
        names.sort_unstable();
        names.dedup();
        for name in names {
            let (x, y) = (a.attributes.get(name), b.attributes.get(name));
            if x != y {
                let json = |value: &&Value| super::elements::json_of(value);
                changed.push(Changed {
                    of: of(first, a),
                    attribute: clean(name),
                    first: x.map(json),
                    second: y.map(json),
                });
            }
        }
    }
    Differences {
        only_first: only(first, second),
        only_second: only(second, first),
        changed,
    }
}

fn text(found: &Differences) -> String {
    let mut lines = String::new();
    for (mark, all) in [("-", &found.only_first), ("+", &found.only_second)] {
        for of in all {
            lines += &format!("{mark} {} {}\n", of.kind, of.element);
        }
    }
    for change in &found.changed {
        let value = |value: &Option<serde_json::Value>| match value {
            Some(value) => clean_to(&value.to_string(), MOST_VALUE),
            None => "no value".to_owned(),
        };
        let (first, second) = (value(&change.first), value(&change.second));
        let of = &change.of;
        lines += &format!(
            "  {} {}.{}: {first} and {second}\n",
            of.kind, of.element, change.attribute
        );
    }
    if lines.is_empty() {
        lines += "no difference\n";
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_world::property_graph::{Graph, Schema, Time};

    #[test]
    fn elements_and_attributes_that_differ_are_told() {
        let graph = Graph::new(Schema::anything().into(), 7);
        let made = graph.change(Time::ZERO, |edit| {
            let room = edit.add_node("room")?;
            edit.set(room, "name", "kitchen")?;
            edit.set(room, "length", 4.0)?;
            let door = edit.add_node("door")?;
            edit.set(door, "name", "front")?;
            edit.add_edge("RT", room, door)?;
            Ok::<_, rc_world::property_graph::Error>((room, door))
        });
        let (room, door) = made.expect("a change");
        let before = Document::of(&graph.snapshot());
        let changed = graph.change(Time::ZERO, |edit| {
            edit.set(room, "length", 5.0)?;
            edit.remove_node(door)
        });
        changed.expect("a change");
        let after = Document::of(&graph.snapshot());
        let compared = |first: &Document, second: &Document| {
            let (first, second) = both(first, second);
            text(&compare(&first, &second))
        };
        let found = compared(&before, &after);
        assert_eq!(
            found,
            "- door front\n- RT kitchen/RT/front\n  room kitchen.length: 4.0 and 5.0\n"
        );
        assert_eq!(compared(&after, &after), "no difference\n");
    }

    /// They have no ids there.
    #[test]
    fn edges_of_files_of_dsr_are_the_same_by_their_ends() {
        let read = |text: &str| {
            let mut sources = SourceMap::new();
            let source = sources.add("world.json", text);
            let (document, found) = dsr::read(&sources, source);
            assert!(!found.has_errors(), "{found:?}");
            document.expect("a document")
        };
        let link = |to: u64, label: &str, level: u64| {
            format!(
                r#"{{"dst": "{to}", "label": "{label}", "src": "1", "linkAttribute": {{"level": {{"type": 1, "value": {level}}}}}}}"#
            )
        };
        let file = |links: [String; 2]| {
            let nodes: Vec<String> = (1..4)
                .map(|id| {
                    let links = if id == 1 { links.join(", ") } else { String::new() };
                    format!(
                        r#""{id}": {{"attribute": {{}}, "id": "{id}", "links": [{links}], "name": "n{id}", "type": "box"}}"#
                    )
                })
                .collect();
            let nodes = nodes.join(", ");
            read(&format!(r#"{{"DSRModel": {{"symbols": {{{nodes}}}}}}}"#))
        };
        let before = file([link(2, "RT", 1), link(3, "RT", 1)]);
        let after = file([link(2, "RT", 2), link(3, "in", 1)]);
        let (first, second) = both(&before, &after);
        assert_eq!(
            text(&compare(&first, &second)),
            "- RT n1/RT/n3\n+ in n1/in/n3\n  RT n1/RT/n2.level: 1 and 2\n"
        );
    }
}
