//! Queries do not see whether an edge is a node to others (MM06 of `RobMoSys` D3.2).

use graph_query::{Budget, Query};
use property_graph::schema::{Entity, Port, Relation};
use property_graph::{EdgeId, Error, Graph, NodeId, Schema, Snapshot, Time};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::HashMap;

fn graph() -> (Graph, EdgeId, NodeId) {
    let entity = |name: &str| Entity {
        name: name.to_owned(),
        ..Entity::default()
    };
    let relation = |name: &str, ends: [&str; 2], promotes: Option<&str>| Relation {
        name: name.to_owned(),
        ports: ends
            .map(|entity| Port {
                name: entity.to_lowercase(),
                entity: entity.to_owned(),
                ..Port::default()
            })
            .into(),
        promotes: promotes.map(str::to_owned),
        ..Relation::default()
    };
    let schema = Schema {
        open: true,
        entities: vec![entity("Frame"), entity("Pose"), entity("Device")],
        relations: vec![
            relation("is_at", ["Frame", "Frame"], Some("Pose")),
            relation("said_by", ["Pose", "Device"], None),
        ],
        ..Schema::default()
    };
    let graph = Graph::new(schema.into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let [cup, table, camera] = [("cup", "Frame"), ("table", "Frame"), ("camera", "Device")]
            .map(|(name, kind)| {
                let node = edit.add_node(kind)?;
                edit.set(node, "name", name)?;
                Ok::<_, Error>(node)
            });
        let edge = edit.add_edge("is_at", cup?, table?)?;
        edit.set(edge, "since", 2.5)?;
        Ok::<_, Error>((edge, camera?))
    });
    let (edge, camera) = made.expect("a graph");
    (graph, edge, camera)
}

fn rows(graph: &Snapshot, text: &str) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, found) = Query::prepare(&sources, source, graph.schema());
    let found = render(&sources, &found, Format::Short);
    let query = query.unwrap_or_else(|| panic!("{text}: {found}"));
    let rows = query.run(graph, &HashMap::new(), Budget::default());
    let lines = rows.expect("rows").cells;
    let mut lines: Vec<String> = lines
        .iter()
        .map(|row| {
            let cells: Vec<String> = row.iter().map(|cell| cell.shown(graph)).collect();
            cells.join(" ")
        })
        .collect();
    lines.sort();
    lines.join("; ")
}

#[test]
fn promotion_and_demotion_are_invisible_to_queries() {
    let (graph, is_at, camera) = graph();
    let cases = [
        (
            "MATCH (a)-[r:is_at]->(b) RETURN a.name, r.since, b.name",
            "cup 2.5 table",
        ),
        ("MATCH (n) RETURN count(*)", "3"),
        ("MATCH (p:Pose) RETURN type(p), p.since", "is_at 2.5"),
        ("MATCH (p:is_at) WHERE p.since > 3 RETURN p", ""),
        ("MATCH (f:Frame) RETURN f.name", "cup; table"),
        (
            "MATCH (p:Pose), (a)-[p]->(b) RETURN a.name, b.name",
            "cup table",
        ),
        (
            "MATCH (a {name: 'cup'})-[r]->(b) RETURN type(r), b.name",
            "is_at table",
        ),
    ];
    let check = || {
        let now = graph.snapshot();
        for (text, expected) in cases {
            assert_eq!(rows(&now, text), expected, "{text}");
        }
    };
    check();
    let said_by = graph.change(Time::ZERO, |edit| {
        let pose = edit.node_of(is_at)?;
        edit.add_edge("said_by", pose, camera)
    });
    check();
    let removed = graph.change(Time::ZERO, |edit| edit.remove_edge(said_by.clone()?));
    removed.expect("a change");
    check();
}

#[test]
fn an_edge_is_found_where_another_one_starts() {
    let (graph, is_at, camera) = graph();
    let made = graph.change(Time::ZERO, |edit| {
        let pose = edit.node_of(is_at)?;
        edit.add_edge("said_by", pose, camera)?;
        // A pose that is a node of its own.
        let own = edit.add_node("Pose")?;
        edit.set(own, "name", "own")?;
        edit.add_edge("said_by", own, camera)
    });
    made.expect("edges");
    let now = graph.snapshot();
    for (text, expected) in [
        (
            "MATCH (p:Pose)-[:said_by]->(d:Device) RETURN coalesce(p.name, type(p)), d.name",
            "is_at camera; own camera",
        ),
        (
            "MATCH (d {name: 'camera'})<-[:said_by]-(p) RETURN p.since",
            "2.5; null",
        ),
        ("MATCH (p)-[:said_by]->() RETURN p", "(own:Pose); [:is_at]"),
        (
            "MATCH (a)-[p:is_at]->(b), (p)-[:said_by]->(d) RETURN a.name, b.name, d.name",
            "cup table camera",
        ),
        (
            "MATCH (p)-[:said_by]->(d), (a)-[p]->(b) RETURN a.name, b.name, d.name",
            "cup table camera",
        ),
        (
            "MATCH (p), (p)-[:said_by]->(d) RETURN p",
            "(own:Pose); [:is_at]",
        ),
        (
            "MATCH ()-[s:said_by]->() RETURN startNode(s)",
            "(own:Pose); [:is_at]",
        ),
        ("MATCH (a)-[r]->(b)-[s]->(c) RETURN count(*)", "0"),
        ("MATCH (p:Frame)-[:said_by]->(d) RETURN p", ""),
    ] {
        assert_eq!(rows(&now, text), expected, "{text}");
    }
}
