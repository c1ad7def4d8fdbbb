//! Parts of a graph by domain, and parts that are joined again.

use graph_exchange::{Document, JoinError, domains, graph_json};
use graph_language::{DOMAINS, load};
use property_graph::{Error, Graph, Id, Schema, Time, Value};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

const HOUSE: &str = r#"import "measurement.gdsl";
Domain house open
{
    entity Room
    {
        name string;
    };
    relation seen_from
    {
        room Room;
        frame Frame;
    };
};
"#;

fn house() -> Schema {
    let mut sources = SourceMap::new();
    let source = sources.add("house.gdsl", HOUSE);
    let (schema, found) = load(&mut sources, &MemoryLoader::new(DOMAINS), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    schema.expect("a schema")
}

/// A random graph with types of each domain, and with types that none declares.
fn random(rng: &mut fastrand::Rng) -> Document {
    let graph = Graph::new(Schema::anything().into(), 3);
    let kinds = ["Frame", "Pose", "Device", "Measurement", "Room", "stray"];
    let relations = ["of", "provenance", "seen_from", "loose", "loop_closure"];
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = Vec::new();
        for at in 0..rng.usize(0..30) {
            let node = edit.add_node(kinds[rng.usize(..kinds.len())])?;
            edit.set(node, "name", format!("n{at}"))?;
            nodes.push(node);
        }
        for _ in 0..nodes.len() * 2 {
            let [from, to] = [0, 1].map(|_| nodes[rng.usize(..nodes.len())]);
            let edge = edit.add_edge(relations[rng.usize(..relations.len())], from, to)?;
            edit.set(edge, "weight", rng.f64())?;
            // Some edges are ends of others.
            if rng.usize(..4) == 0 {
                let end = edit.node_of(edge)?;
                nodes.push(end);
                edit.add_edge("loose", from, end)?;
            }
        }
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    let mut document = Document::of(&graph.snapshot());
    document.schema = Some("house.gdsl".to_owned());
    document
}

/// MM11 of `RobMoSys` D3.2: the parts of all domains, joined in any order, are the graph.
#[test]
fn parts_of_all_domains_joined_are_the_graph() {
    let schema = house();
    let domains = domains(&schema);
    assert_eq!(domains, ["geometry", "house", "measurement"].into());
    let mut rng = fastrand::Rng::with_seed(11);
    let mut smaller = 0;
    for _ in 0..50 {
        let whole = random(&mut rng);
        let mut parts: Vec<Document> = domains.iter().map(|d| whole.part(&schema, d)).collect();
        for part in &parts {
            // A part is a graph: each edge has its ends.
            part.graph(Schema::anything().into(), 1).expect("a graph");
            smaller += usize::from(part.nodes.len() < whole.nodes.len());
        }
        rng.shuffle(&mut parts);
        let mut joined = Document::default();
        for part in &parts {
            // A part that was written and read is unchanged.
            let mut sources = SourceMap::new();
            let source = sources.add("part.graph", graph_json::write(part));
            let (read, found) = graph_json::read(&sources, source);
            assert!(found.is_empty());
            joined
                .join(&read.expect("a part"), (&schema, &schema))
                .expect("parts of one graph");
        }
        assert_eq!(graph_json::write(&joined), graph_json::write(&whole));
    }
    assert!(smaller > 50, "{smaller}");
}

/// A part has the elements of its domain and the ends of its edges, and nothing else.
#[test]
fn a_part_has_what_its_domain_declares() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let [frame, room, device, stray] =
            ["Frame", "Room", "Device", "stray"].map(|kind| edit.add_node(kind));
        edit.add_edge("seen_from", room?, frame?)?;
        edit.add_edge("loose", device?, stray?)?;
        edit.add_node("Frame")?;
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    let (schema, whole) = (house(), Document::of(&graph.snapshot()));
    let kinds = |domain: &str| {
        let part = whole.part(&schema, domain);
        let nodes = part.nodes.iter().map(|node| node.kind.clone());
        let edges = part.edges.iter().map(|edge| edge.kind.clone());
        nodes.chain(edges).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(kinds("geometry"), "Frame Frame");
    assert_eq!(kinds("measurement"), "Device");
    assert_eq!(kinds("house"), "Frame Room Device stray seen_from loose");
}

/// An element that two graphs have differently is told, and nothing is taken over.
#[test]
fn different_elements_of_one_id_are_not_joined() {
    let schema = house();
    let whole = random(&mut fastrand::Rng::with_seed(5));
    assert!(whole.edges.len() > 2);
    let refused = |change: &dyn Fn(&mut Document)| {
        let mut other = whole.clone();
        change(&mut other);
        let mut joined = whole.clone();
        let error = joined
            .join(&other, (&schema, &schema))
            .expect_err("a refused join");
        assert_eq!(joined, whole);
        error
    };
    let (node, edge) = (whole.nodes[1].id, whole.edges[1].id.expect("an id"));
    let name = |to: &str| ("name".to_owned(), Value::from(to), None);
    assert_eq!(
        refused(&|other| other.nodes[1].attributes = vec![name("another")]),
        JoinError::Differs(node)
    );
    assert_eq!(
        refused(&|other| "Other".clone_into(&mut other.nodes[1].kind)),
        JoinError::Differs(node)
    );
    assert_eq!(
        refused(&|other| other.edges[1].to = Id::new(3, 999)),
        JoinError::Differs(edge)
    );
    // An id of a node that is one of an edge elsewhere.
    assert_eq!(
        refused(&|other| other.edges[1].id = Some(node)),
        JoinError::Differs(node)
    );
    assert_eq!(refused(&|other| other.edges[1].id = None), JoinError::NoId);
    let mut same = whole.clone();
    same.join(&whole, (&schema, &schema))
        .expect("the same graph");
    assert_eq!(same, whole);
}

/// What schemas declare decides, not the names of their files; the message lists the differences.
#[test]
fn graphs_of_different_schemas_are_not_joined() {
    let schema = house();
    let whole = random(&mut fastrand::Rng::with_seed(5));
    let mut moved = whole.clone();
    moved.schema = Some("elsewhere/house.gdsl".to_owned());
    let mut joined = whole.clone();
    joined.join(&moved, (&schema, &schema)).expect("one schema");
    assert_eq!(joined, whole);

    let mut outgrown = schema.clone();
    outgrown.open = !outgrown.open;
    let removed = outgrown.entities.pop().expect("an entity");
    let frame = outgrown.entities.iter_mut().find(|e| e.name == "Frame");
    let frame = frame.expect("the entity of geometry");
    frame.doc.push("no difference".to_owned());
    frame.attributes[0].optional = !frame.attributes[0].optional;
    let error = joined.join(&whole, (&schema, &outgrown));
    let error = error.expect_err("a refused join");
    assert_eq!(joined, whole);
    let JoinError::Schemas(all) = &error else {
        panic!("{error}");
    };
    let about: Vec<&str> = all.iter().map(|d| d.what.as_str()).collect();
    for expected in ["Frame.name", removed.name.as_str(), "domain"] {
        assert!(about.contains(&expected), "{expected} in {error}");
    }
    let text = "Frame.name: `string` in the first schema, `string optional` in the second";
    let other = "Frame.name: `string optional` in the first schema, `string` in the second";
    let message = error.to_string();
    assert!(
        message.contains(text) || message.contains(other),
        "{message}"
    );
    // A graph without a schema takes over that of the other one.
    let mut free = Document::default();
    let anything = Schema::anything();
    free.join(&whole, (&anything, &schema)).expect("a graph");
    assert_eq!(free, whole);
}

/// A schema that a running graph has outgrown: differences and misfits are listed, and nothing is
/// left out in silence.
#[test]
fn a_migration_lists_what_differs() {
    let schema = |text: &str| {
        let mut sources = SourceMap::new();
        let source = sources.add("a.gdsl", text);
        let (schema, found) = load(&mut sources, &MemoryLoader::new(DOMAINS), source);
        assert_eq!(render(&sources, &found, Format::Short), "");
        std::sync::Arc::new(schema.expect("a schema"))
    };
    let old = schema(
        "Domain a { entity Cup { mass float unit \"g\"; }; entity Mug { }; relation on { a Cup; b Mug; }; };",
    );
    let new = schema("Domain a { entity Cup { mass float unit \"kg\" 0:10; }; entity Mug { }; };");
    let graph = Graph::new(std::sync::Arc::clone(&old), 1);
    let cup = graph.change(Time::ZERO, |edit| {
        let cup = edit.add_node("Cup")?;
        edit.set(cup, "mass", 250.0)?;
        Ok::<_, Error>(cup)
    });
    let cup = cup.expect("a cup");
    let migration = graph_exchange::migrate(&graph.snapshot(), &new, 1);
    let differences: Vec<String> = migration
        .differences
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        differences,
        [
            "Cup.mass: `float unit \"g\"` in the first schema, `float unit \"kg\" 0:10` in the second",
            "on: `relation on(a Cup, b Mug) of a` in the first schema only",
        ]
    );
    assert!(migration.graph.is_none());
    assert_eq!(migration.findings.len(), 1, "{:?}", migration.findings);
    // A number in another unit is another value.
    let expected = "graph:3:57: error[unit-mismatch]";
    assert!(
        migration.findings[0].starts_with(expected),
        "{:?}",
        migration.findings
    );
    let wider = schema(
        "Domain a { entity Cup { mass float unit \"g\" 0:1000; }; entity Mug { }; entity Pan { }; };",
    );
    let migration = graph_exchange::migrate(&graph.snapshot(), &wider, 1);
    assert_eq!(migration.findings, Vec::<String>::new());
    assert_eq!(migration.differences.len(), 3);
    let moved = migration.graph.expect("a graph");
    assert_eq!(moved.snapshot().schema(), &wider);
    let [before, after] = [&graph, &moved].map(|graph| Document::of(&graph.snapshot()));
    assert_eq!(before, after);
    let light = graph.change(Time::ZERO, |edit| edit.set(cup, "mass", -1.0));
    light.expect("a change");
    let migration = graph_exchange::migrate(&graph.snapshot(), &wider, 1);
    assert!(migration.graph.is_none());
    assert!(
        migration.findings[0].contains("wrong-value"),
        "{:?}",
        migration.findings
    );
}
