//! Pictures have everything once, and only so much as a reader can see.

use crate::{MOST, of_graph, of_schema};
use graph_exchange::{Document, graph_json};
use rc_diagnostics::SourceMap;
use rc_syntax::MemoryLoader;

fn graph(text: &str) -> Document {
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text);
    let (document, found) = graph_json::read(&sources, source);
    assert!(found.is_empty(), "{found:?}");
    document.expect("a graph")
}

/// Texts, and tooltips of lines.
fn drawn(svg: &str) -> (Vec<String>, Vec<String>) {
    let document = roxmltree::Document::parse(svg).expect("XML");
    let texts = document.descendants().filter(|n| n.has_tag_name("text"));
    let texts = texts.filter_map(|node| node.text().map(str::to_owned));
    let lines = document.descendants().filter(|node| {
        let is_path = |child: &roxmltree::Node<'_, '_>| child.has_tag_name("path");
        node.has_tag_name("g") && node.children().filter(is_path).count() == 1
    });
    let titles = lines.filter_map(|line| line.children().find(|c| c.has_tag_name("title")));
    let titles = titles.filter_map(|title| title.text().map(str::to_owned));
    (texts.collect(), titles.collect())
}

const KITCHEN: &str = r#"{"nodes": [
    {"id": "1:1", "type": "Room", "attributes": {"name": "a<b>\u001b[1m"}},
    {"id": "1:2", "type": "Person", "attributes": {"name": "Ada", "age": 36}},
    {"id": "1:3", "type": "Person"}],
"edges": [
    {"id": "1:4", "type": "in", "from": "1:2", "to": "1:1", "attributes": {"since": 2.5}},
    {"id": "1:5", "type": "knows", "from": "1:2", "to": "1:3"},
    {"id": "1:6", "type": "knows", "from": "1:2", "to": "1:2"}]}"#;

#[test]
fn a_graph_is_drawn_with_names_types_and_relations() {
    let picture = of_graph(&graph(KITCHEN), "kitchen");
    let svg = picture.svg().expect("a picture");
    let (texts, lines) = drawn(&svg);
    for expected in ["Ada", "1:3", "Room", "Person", "in", "↺ knows"] {
        assert!(texts.iter().any(|t| t == expected), "{expected}: {texts:?}");
    }
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(lines[0].starts_with("Ada in a<b>"), "{lines:?}");
    assert!(lines[0].ends_with("\nsince: 2.5"), "{lines:?}");
    assert_eq!(lines[1], "Ada knows 1:3");
    assert!(svg.contains("age: 36"));
    assert!(!svg.contains('\u{1b}'), "a control sequence of a file");
    let dot = picture.dot();
    assert!(dot.contains("n1 -> n2 [label=\"↺ knows\""), "{dot}");
    assert!(dot.contains("n1 [label=\"Ada\\nPerson\""), "{dot}");
}

#[test]
fn a_schema_is_drawn_with_own_attributes_parents_and_ports() {
    let text = r#"Domain home
{
    entity Object { name string key; mass float unit "kg" 0: optional; };
    entity Cup : Object { volume float unit "l"; };
    entity Room { };
    relation in { what Object :1; where Room; tree; };
    relation above { what Object; below Object; };
};"#;
    let mut sources = SourceMap::new();
    let source = sources.add("home.gdsl", text);
    let (schema, found) = graph_language::load(&mut sources, &MemoryLoader::default(), source);
    assert!(!found.has_errors(), "{found:?}");
    let picture = of_schema(&schema.expect("a schema"));
    let (texts, lines) = drawn(&picture.svg().expect("a picture"));
    let mut rows: Vec<&str> = texts.iter().map(String::as_str).collect();
    rows.retain(|row| !["Object", "Cup", "Room", "home"].contains(row));
    rows.sort_unstable();
    let expected = [
        "in (what 0:1, where, tree)",
        "is a Object",
        "mass float unit \"kg\" 0: optional",
        "name string key",
        "volume float unit \"l\"",
        "↺ above (what, below)",
    ];
    assert_eq!(rows, expected);
    assert_eq!(lines, ["Object in Room", "Cup is a Object"]);
}

#[test]
fn a_graph_that_nobody_could_read_is_no_svg() {
    let mut large = graph(KITCHEN);
    let edge = large.edges[0].clone();
    large.edges = vec![edge; MOST];
    let picture = of_graph(&large, "large");
    let error = picture.svg().expect_err("too many lines");
    assert!(
        error.to_string().contains(&(MOST + 3).to_string()),
        "{error}"
    );
    assert_eq!(picture.dot().matches(" -> ").count(), MOST);
}
