//! Types and domains as nodes.

use graph_exchange::{Document, graph_json};
use graph_language::{DOMAINS, load};
use property_graph::{Element, Id};
use rc_diagnostics::SourceMap;
use rc_syntax::MemoryLoader;

const LAB: &str = r#"import "geometry.gdsl";
Domain lab open { entity Hose : Frame { }; relation near { a Frame; b Frame; }; };"#;

fn read(text: &str) -> Document {
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text);
    graph_json::read(&sources, source).0.expect("a graph")
}

#[test]
fn every_element_is_an_instance_of_its_type() {
    let mut sources = SourceMap::new();
    let source = sources.add("lab.gdsl", LAB);
    let (schema, found) = load(&mut sources, &MemoryLoader::new(DOMAINS), source);
    assert!(!found.has_errors(), "{found:?}");
    let schema = schema.expect("a schema");
    let document = read(
        r#"{"nodes": [
    {"id": "1:1", "type": "Hose", "attributes": {"name": "a"}},
    {"id": "1:2", "type": "Stray"}], "edges": [
    {"id": "1:3", "type": "near", "from": "1:1", "to": "1:1"}]}"#,
    );
    let (all, schema) = document.reflected(&schema).expect("a reflection");
    let graph = all.graph(schema.clone().into(), 1).expect("a graph");
    let now = graph.snapshot();
    let [instance_of, is_a] =
        ["instance_of", "is_a"].map(|name| now.symbol(name).expect("a relation"));
    let name = |node| now.node(node).expect("a node").name().to_owned();
    let above = |count: u64, relation| -> Vec<String> {
        let node = match now.find(Id::new(1, count)) {
            Some(Element::Node(node)) => node,
            Some(Element::Edge(edge)) => now.node_of(edge).expect("a node"),
            None => panic!("no element {count}"),
        };
        let first = now.out(node, instance_of).next().expect("a type");
        let mut names = vec![name(first)];
        names.extend(now.out(first, relation).map(name));
        names
    };
    assert_eq!(above(1, instance_of), ["Hose", "lab"]);
    assert_eq!(above(1, is_a), ["Hose", "Frame"]);
    assert_eq!(above(2, instance_of), ["Stray", "lab"]);
    assert_eq!(above(3, instance_of), ["near", "lab"]);
    // Each type is there once, also without instances.
    assert_eq!(now.named("Frame").count(), 1);
    assert_eq!(now.named("Twist").count(), 1);
    // Twice is not a reflection of anything.
    assert!(all.reflected(&schema).is_none());
}
